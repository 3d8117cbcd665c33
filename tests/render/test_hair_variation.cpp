// Hair that differs from strand to strand and along the strand.

#include <doctest/doctest.h>

#include <set>

#include "accel.h"
#include "hair_material.h"
#include "support/scenes.h"
#include "support/statistics.h"
#include "surface.h"

using namespace wisp;
using namespace wisp::test;

namespace {

material_data make_hair(const vec3& sigma_a = {0.4f, 0.8f, 1.6f}) {
  material_data m;
  m.type = material_type::hair;
  m.hair.sigma_a = sigma_a;
  return m;
}

// Upright strands side by side at x = 0, 1, 2 ..., y from 0 to 6; of splines with
// the same ends as the chains, as uneven as splines allow.
shape_data make_row(int strands, curve_basis basis, curve_profile profile) {
  shape_data shape;
  shape.basis = basis;
  shape.profile = profile;
  shape.strands.push_back(0);
  for (int k = 0; k < strands; k++) {
    bool spline = basis != curve_basis::linear && basis != curve_basis::bezier;
    for (int i = spline ? -1 : 0; i <= (spline ? 7 : 6); i++) {
      shape.positions.push_back({float(k), float(i), (i % 2 == 0 ? 0.0f : 0.1f)});
      shape.radius.push_back(0.1f);
    }
    shape.strands.push_back(uint32_t(shape.positions.size()));
  }
  return shape;
}

render_scene prepare(scene_data scene) {
  if (scene.environments.empty()) add_sky(scene, {1, 1, 1});
  warning_list warnings;
  return prepare_scene(std::move(scene), {}, warnings);
}
render_scene prepare(shape_data shape, material_data material) {
  scene_data scene;
  add_shape(scene, std::move(shape), std::move(material));
  return prepare(std::move(scene));
}

surface_point hit_at(const render_scene& scene, float x, float y) {
  ray3 ray{{x, y, 5}, {0, 0, -1}, 0, infinity};
  ray_hit hit;
  REQUIRE(scene.accel->intersect(ray, hit));
  return eval_surface(scene, ray, hit);
}

// A row of pixels.
texture_data make_texture(const std::vector<vec4>& pixels) {
  texture_data texture;
  texture.width = int(pixels.size());
  texture.height = 1;
  texture.pixelsf = pixels;
  return texture;
}

std::string why(const render_scene& scene) {
  for (const auto& part : scene.parts)
    if (part.name == "hair lobes") return part.why;
  return "";
}

scene_data varied_ball(const material_data& material, curve_basis basis = curve_basis::bspline) {
  scene_data scene;
  add_shape(scene, make_hair_ball(500, 0.6f, 0.01f, basis), material);
  add_sky(scene, {1, 1, 1});
  add_ortho_camera(scene, look_at({0, 0, 5}, {0, 0, 0}), 2.5f);
  return scene;
}

}  // namespace

TEST_CASE("render: a strand's number does not depend on how its curve is given or cut") {
  material_data material = make_hair();
  material.hair.random_color = 1;
  std::vector<float> numbers;
  for (auto profile : {curve_profile::flat, curve_profile::round})
    for (auto basis : {curve_basis::linear, curve_basis::bspline, curve_basis::catmull_rom,
                       curve_basis::bezier}) {
      auto scene = prepare(make_row(5, basis, profile), material);
      for (int k = 0; k < 5; k++) {
        if (int(numbers.size()) <= k)
          numbers.push_back(hit_at(scene, float(k), 3.2f).strand_number);
        for (float y : {0.3f, 2.7f, 5.6f})
          CHECK(hit_at(scene, float(k) + 0.05f, y).strand_number == numbers[std::size_t(k)]);
      }
    }
  CHECK(std::set<float>(numbers.begin(), numbers.end()).size() == 5);
}

TEST_CASE("render: strands' numbers are uniform, and others in another copy or stream") {
  for (uint32_t copy : {0u, 1u, 70000u})
    for (uint32_t stream : {variation_stream, texcoord_stream}) {
      std::vector<double> counts(32, 0), expected(32, 1000);
      double product = 0;
      for (uint32_t k = 0; k < 32000; k++) {
        float r = strand_number(copy, k, stream);
        CHECK(r >= 0);
        CHECK(r < 1);
        counts[std::size_t(r * 32)]++;
        product += (double(r) - 0.5) * (double(strand_number(copy + 1, k, stream)) - 0.5);
        product += (double(r) - 0.5) * (double(strand_number(copy, k + 1, stream)) - 0.5);
        product += (double(r) - 0.5) * (double(strand_number(copy, k, 1 - stream)) - 0.5);
      }
      CHECK(chi_square_p_value(counts, expected) > 1e-6);
      // Each product has a standard deviation of 1 / 12.
      CHECK(std::abs(product) < 6 * std::sqrt(3 * 32000.0) / 12);
    }
}

TEST_CASE("render: copies of a shape differ, other shapes change nothing") {
  material_data material = make_hair();
  material.hair.random_roughness = 1;
  scene_data scene;
  add_shape(scene, make_row(2, curve_basis::linear, curve_profile::flat), material);
  auto alone = prepare(scene);
  scene.instances.push_back(scene.instances[0]);
  scene.instances.back().frame[3] = {10, 0, 0};
  add_shape(scene, make_row(1, curve_basis::linear, curve_profile::flat), material,
            {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {20, 0, 0}});
  std::swap(scene.instances.front(), scene.instances.back());
  std::swap(scene.instances[1], scene.instances[2]);
  auto more = prepare(scene);
  for (float k : {0.0f, 1.0f}) {
    CHECK(hit_at(alone, k, 1).strand_number == hit_at(more, k, 1).strand_number);
    CHECK(hit_at(more, k + 10, 1).strand_number != hit_at(more, k, 1).strand_number);
  }
}

TEST_CASE("render: only what varies is made anew at a hit") {
  auto row = [] { return make_row(4, curve_basis::bspline, curve_profile::flat); };
  hair_look look;
  auto plain = prepare(row(), make_hair());
  surface_point p = hit_at(plain, 1, 2);
  CHECK(p.strand_number == 0.5f);
  CHECK(plain.copies.empty());
  CHECK(plain.accel->curves(0).strands.empty());
  find_hair_look(plain, p, look);
  CHECK(look.bsdf == &plain.hair[0].bsdf);
  CHECK(look.sigma_a == vec3{0.4f, 0.8f, 1.6f});
  CHECK(why(plain) == "1 hair materials");

  material_data material = make_hair();
  material.hair.random_color = 0.5f;
  auto colors = prepare(row(), material);
  CHECK(why(colors) == "1 hair materials, 1 varies by strand");
  for (int k = 0; k < 4; k++) {
    p = hit_at(colors, float(k), 2);
    hair_look varied;
    find_hair_look(colors, p, varied);
    CHECK(varied.bsdf == &colors.hair[0].bsdf);
    float factor = 1 + (p.strand_number - 0.5f);
    CHECK(varied.sigma_a.x == doctest::Approx(0.4f * factor));
    CHECK(varied.sigma_a.z == doctest::Approx(1.6f * factor));
  }

  material = make_hair();
  material.hair.random_roughness = 0.5f;
  auto lobes = prepare(row(), material);
  p = hit_at(lobes, 3, 2);
  hair_look varied;
  find_hair_look(lobes, p, varied);
  REQUIRE(varied.own);
  CHECK(varied.bsdf == &*varied.own);
  CHECK(varied.sigma_a == vec3{0.4f, 0.8f, 1.6f});
  CHECK(varied.bsdf->v[0] ==
        doctest::Approx(hair::longitudinal_variance(0.3f * (1 + (p.strand_number - 0.5f)))));
  CHECK(varied.bsdf->sin_tilt[0] == lobes.hair[0].bsdf.sin_tilt[0]);

  // One number for all: nothing varies.
  material.hair.random = 1.0f;
  auto fixed = prepare(row(), material);
  CHECK(!fixed.hair[0].roughness_varies);
  CHECK(fixed.hair[0].bsdf.v[0] == doctest::Approx(hair::longitudinal_variance(0.45f)));
}

TEST_CASE("render: absorption varies around its mean") {
  material_data material = make_hair();
  material.hair.random_color = 1;
  auto scene = prepare(varied_ball(material));
  double sum = 0;
  std::set<float> seen;
  auto rng = make_rng(2);
  for (int i = 0; i < 20000; i++) {
    ray3 ray{{3 * rand1f(rng) - 1.5f, 3 * rand1f(rng) - 1.5f, 5}, {0, 0, -1}, 0, infinity};
    ray_hit hit;
    if (!scene.accel->intersect(ray, hit)) continue;
    surface_point p = eval_surface(scene, ray, hit);
    hair_look look;
    find_hair_look(scene, p, look, false);
    if (seen.insert(p.strand_number).second) sum += double(look.sigma_a.y);
  }
  double n = double(seen.size());
  CHECK(n > 300);  // of 500; nearly half are on the far side, seen between the others
  // Uniform in [0, 1.6]: a standard deviation of 1.6 / sqrt(12).
  CHECK(std::abs(sum / n - 0.8) < 5 * 1.6 / std::sqrt(12 * n));
}

TEST_CASE("render: hair that absorbs nothing is white however it varies") {
  for (int kind = 0; kind < 4; kind++) {
    material_data material = make_hair({0, 0, 0});
    scene_data scene;
    if (kind == 0) material.hair.random_roughness = 1;
    if (kind == 1) material.hair.random_color = material.hair.random_roughness = 1;
    if (kind == 2) {
      material.hair.p_max = 5;
      material.hair.coat = 0.8f;
      material.hair.roughness[1] = {0.1f, 0.6f};
      material.hair.random_roughness = 0.7f;
    }
    if (kind == 3) {
      material.hair.principled = hair::principled_hair<float>{};
      material.hair.principled->parametrization = hair::hair_parametrization::absorption;
      material.hair.principled->absorption_coefficient = {0, 0, 0};
      material.hair.principled->random_roughness = 1;
      material.hair.principled->coat = 0.5f;
    }
    scene = varied_ball(material);
    if (kind == 2) {
      scene.textures.push_back(make_texture({{0.2f, 1.5f, 0, 1}, {1, 0.5f, 0, 1}}));
      scene.materials[0].roughness_tex = 0;
    }
    CAPTURE(kind);
    measured m = measure(std::move(scene), 24, 16, 4000);
    for (int k = 0; k < 3; k++)
      CHECK(std::abs(m.mean[k] - 1) < 4.5 * std::sqrt(3.0) * m.error + 1e-3);
    CHECK(m.worst < 0.02);
  }
}

TEST_CASE("render: an image runs from root to tip") {
  // Black at the root, green at the tip, as the first hit sees it.
  for (auto profile : {curve_profile::flat, curve_profile::round})
    for (auto basis : {curve_basis::linear, curve_basis::bspline, curve_basis::bezier}) {
      material_data material = make_hair({0.01f, 0.01f, 0.01f});
      material.color_tex = 0;
      scene_data scene;
      std::vector<vec4> pixels(64);
      for (std::size_t i = 0; i < 64; i++) pixels[i] = {0, (float(i) + 0.5f) / 64, 1, 1};
      scene.textures.push_back(make_texture(pixels));
      add_shape(scene, make_row(2, basis, profile), material);
      auto prepared = prepare(scene);
      CHECK(why(prepared) == "1 hair materials, 1 varies by texture");
      CHECK(prepared.scene.textures[0].clamp_s);
      for (float y : {0.002f, 0.1f, 1.3f, 3.0f, 5.5f, 5.998f}) {
        surface_point p = hit_at(prepared, 1, y);
        // The curves are uniform in y but for rounded ends of cubics.
        CHECK(p.texcoord.x == doctest::Approx(y / 6).epsilon(0.01).scale(1));
        CHECK(p.texcoord.y != hit_at(prepared, 0, y).texcoord.y);
        hair_look look;
        find_hair_look(prepared, p, look);
        vec3 color = hair::color_from_sigma_a(look.sigma_a, look.beta_n);
        vec3 base = hair::color_from_sigma_a(vec3{0.01f}, 0.3f);
        float expected = std::clamp(y / 6, 0.5f / 64, 63.5f / 64);
        CHECK(color.y == doctest::Approx(base.y * expected).epsilon(0.01).scale(1));
        CHECK(color.z == doctest::Approx(base.z).epsilon(0.01));
      }
    }
}

TEST_CASE("render: texture coordinates of the file win over root to tip, unless told") {
  material_data material = make_hair();
  material.color_tex = 0;
  scene_data scene;
  scene.textures.push_back(make_texture({{1, 1, 1, 1}, {0.5f, 0.5f, 0.5f, 1}}));
  shape_data row = make_row(2, curve_basis::bspline, curve_profile::flat);
  for (std::size_t i = 0; i < row.positions.size(); i++)
    row.texcoords.push_back({0.25f + row.positions[i].x, 0.5f});
  add_shape(scene, row, material);
  auto prepared = prepare(scene);
  CHECK(!prepared.scene.textures[0].clamp_s);
  for (float y : {0.1f, 3.0f, 5.9f}) {
    CHECK(hit_at(prepared, 0, y).texcoord.x == doctest::Approx(0.25f));
    CHECK(hit_at(prepared, 1, y).texcoord.x == doctest::Approx(1.25f));
    CHECK(hit_at(prepared, 1, y).texcoord.y == doctest::Approx(0.5f));
  }
  scene.materials[0].hair.strand_uv = true;
  auto along = prepare(scene);
  CHECK(along.scene.textures[0].clamp_s);
  CHECK(hit_at(along, 1, 5.5f).texcoord.x == doctest::Approx(5.5f / 6).epsilon(0.01));

  // An image that a sphere has, too, is copied for the strands.
  material_data matte;
  matte.color = {1, 1, 1};
  matte.color_tex = 0;
  add_shape(scene, make_sphere(16, 0.1f), matte, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-5, 0, 0}});
  auto both = prepare(scene);
  REQUIRE(both.scene.textures.size() == 2);
  CHECK(both.scene.materials[0].color_tex == 1);
  CHECK(both.scene.materials[1].color_tex == 0);
  CHECK(!both.scene.textures[0].clamp_s);
  CHECK(both.scene.textures[1].clamp_s);
  CHECK(!both.scene.textures[1].pixelsf.empty());
}

TEST_CASE("render: roughness and absorption from textures and vertices") {
  material_data material = make_hair();
  material.hair.sigma_a = {};
  material.hair.color = vec3{0.3f, 0.4f, 0.5f};
  material.roughness_tex = 0;
  material.sigma_a_tex = 1;
  scene_data scene;
  scene.textures.push_back(make_texture({{0.5f, 2, 9, 1}}));
  scene.textures.push_back(make_texture({{2, 1, 0, 1}}));
  shape_data row = make_row(1, curve_basis::bspline, curve_profile::flat);
  for (std::size_t i = 0; i < row.positions.size(); i++)
    row.roughness.push_back({1 + row.positions[i].y / 6, 0.5f});
  add_shape(scene, row, material);
  auto prepared = prepare(scene);
  for (float y : {0.1f, 3.0f, 5.9f}) {
    surface_point p = hit_at(prepared, 0, y);
    CHECK(p.roughness.x == doctest::Approx(1 + y / 6).epsilon(0.01));
    CHECK(p.roughness.y == doctest::Approx(0.5f));
    hair_look look;
    find_hair_look(prepared, p, look);
    float beta_m = 0.3f * p.roughness.x * 0.5f;
    REQUIRE(look.own);
    CHECK(look.own->v[0] == doctest::Approx(hair::longitudinal_variance(beta_m)));
    CHECK(look.own->s[0] == doctest::Approx(hair::logistic_scale(0.3f)));
    vec3 sigma_a = hair::sigma_a_from_color(vec3{0.3f, 0.4f, 0.5f}, 0.3f);
    CHECK(look.sigma_a.x == doctest::Approx(2 * sigma_a.x));
    CHECK(look.sigma_a.y == doctest::Approx(sigma_a.y));
    CHECK(look.sigma_a.z == 0);
  }
}

TEST_CASE("render: varied hair is the same at any number of threads") {
  material_data material = make_hair();
  material.hair.random_color = material.hair.random_roughness = 0.8f;
  material.color_tex = 0;
  scene_data data = varied_ball(material);
  data.textures.push_back(make_texture({{1, 0.5f, 1, 1}, {0.2f, 1, 1, 1}}));
  trace_options options;
  options.width = options.height = 24;
  options.samples = 8;
  std::vector<dvec4> first;
  for (int threads : {1, 2, 5}) {
    warning_list warnings;
    auto scene = prepare_scene(scene_data(data), {.threads = threads}, warnings);
    options.threads = threads;
    trace_state state = make_trace_state(scene, options);
    trace_image(state, scene, options);
    if (first.empty()) first = state.radiance;
    CHECK(first == state.radiance);
  }
  data.materials[0].hair.random = 0.5f;
  warning_list warnings;
  auto scene = prepare_scene(std::move(data), {}, warnings);
  trace_state state = make_trace_state(scene, options);
  trace_image(state, scene, options);
  CHECK(first != state.radiance);
}

TEST_CASE("render: a principled hair gives the picture of its parameters, bit for bit") {
  material_data own = make_hair({0.245531f, 0.52f, 1.365f});
  own.hair.beta_m = 0.25f;
  own.hair.beta_n = 0.4f;
  own.hair.alpha = -3;
  own.hair.coat = 0.5f;
  material_data other;
  other.type = material_type::hair;
  other.hair.principled = hair::principled_hair<float>{};
  auto& p = *other.hair.principled;
  p.parametrization = hair::hair_parametrization::absorption;
  p.roughness = 0.25f;
  p.radial_roughness = 0.4f;
  p.offset = 3;
  p.coat = 0.5f;
  auto picture = [](const material_data& material) {
    auto scene = prepare(varied_ball(material));
    trace_options options;
    options.width = options.height = 24;
    options.samples = 4;
    trace_state state = make_trace_state(scene, options);
    trace_image(state, scene, options);
    return state.radiance;
  };
  auto reference = picture(own);
  CHECK(picture(other) == reference);
  p.coat = 0.4f;
  CHECK(picture(other) != reference);
}
