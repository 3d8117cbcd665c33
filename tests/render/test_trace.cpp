#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <limits>

#include "accel.h"
#include "support/scenes.h"
#include "support/statistics.h"
#include "surface.h"

using namespace wisp;
using namespace wisp::test;

namespace {

scene_data hair_scene() {
  scene_data scene;
  material_data hair;
  hair.type = material_type::hair;
  add_shape(scene, make_hair_ball(500, 0.6f, 0.01f, curve_basis::bspline), hair);
  material_data matte;
  matte.color = {0.5f, 0.4f, 0.3f};
  add_shape(scene, make_sphere(), matte);
  material_data light;
  light.emission = {8, 8, 8};
  add_shape(scene, make_square(), light, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 4, 1}});
  add_sky(scene, {0.3f, 0.3f, 0.4f});
  add_ortho_camera(scene, look_at({0, 0, 5}, {0, 0, 0}), 3);
  return scene;
}

trace_state render(const render_scene& scene, trace_options options) {
  trace_state state = make_trace_state(scene, options);
  trace_image(state, scene, options);
  return state;
}

trace_options small(int samples = 8) {
  trace_options options;
  options.width = options.height = 32;
  options.samples = samples;
  return options;
}

}  // namespace

TEST_CASE("render: the same picture, bit for bit, at any number of threads and in any passes") {
  warning_list warnings;
  auto scene = prepare_scene(hair_scene(), {}, warnings);
  auto options = small();
  options.threads = 1;
  auto one = render(scene, options);
  for (int threads : {2, 3, 8}) {
    options.threads = threads;
    auto many = render(scene, options);
    CHECK(one.radiance == many.radiance);
    CHECK(one.squares == many.squares);
  }
  auto split = make_trace_state(scene, options);
  for (int count : {1, 5, 2}) trace_samples(split, scene, options, count);
  CHECK(one.radiance == split.radiance);
  options.seed = 1;
  CHECK(one.radiance != render(scene, options).radiance);
}

TEST_CASE("render: h is signed, and uniform over a strand at any distance") {
  // Rays through an upright strand from 1e-1 to 1e4 units; the expected h is the
  // offset over the radius, left and right as seen. 1e-3 of false alarm in all.
  for (auto profile : {curve_profile::flat, curve_profile::round})
    for (auto basis : {curve_basis::linear, curve_basis::bspline}) {
      scene_data scene;
      shape_data strand;
      strand.basis = basis;
      strand.profile = profile;
      for (int i = 0; i < 6; i++) {
        strand.positions.push_back({0, float(i) - 2.5f, 0});
        strand.radius.push_back(0.01f);
      }
      strand.strands = {0, 6};
      material_data hair;
      hair.type = material_type::hair;
      add_shape(scene, strand, hair);
      add_sky(scene, {1, 1, 1});
      warning_list warnings;
      auto prepared = prepare_scene(std::move(scene), {}, warnings);
      for (float distance : {0.1f, 1.0f, 100.0f, 1e4f}) {
        auto rng = make_rng(5);
        std::vector<double> counts(20, 0), expected(20, 100);
        for (int i = 0; i < 2000; i++) {
          float h = (float(i) + rand1f(rng)) / 1000 - 1;
          ray3 ray{{h * 0.0099999f, 0.1f, distance}, {0, 0, -1}, 0, infinity};
          ray_hit hit;
          if (!prepared.accel->intersect(ray, hit)) continue;
          surface_point p = eval_surface(prepared, ray, hit);
          // wo = +z, the strand points up: y of the local frame is wo x tangent = -x.
          CHECK(p.across.x == doctest::Approx(-1));
          CHECK(p.h == doctest::Approx(-h).epsilon(1e-3).scale(1));
          counts[std::size_t(std::clamp((p.h + 1) * 10, 0.0f, 19.0f))]++;
        }
        if (distance <= 100) CHECK(chi_square_p_value(counts, expected) > 1e-5);
      }
    }
}

TEST_CASE("render: a scattered ray does not meet its own fibre") {
  for (auto profile : {curve_profile::flat, curve_profile::round}) {
    scene_data scene;
    shape_data strand;
    strand.profile = profile;
    strand.basis = curve_basis::bspline;
    for (int i = 0; i < 30; i++) {
      strand.positions.push_back({0, float(i) * 0.1f, 0});
      strand.radius.push_back(0.02f);
    }
    strand.strands = {0, 30};
    material_data hair;
    hair.type = material_type::hair;
    add_shape(scene, strand, hair);
    add_sky(scene, {1, 1, 1});
    warning_list warnings;
    auto prepared = prepare_scene(std::move(scene), {}, warnings);
    auto rng = make_rng(8);
    int met = 0, hits = 0;
    for (int i = 0; i < 20000; i++) {
      ray3 ray{{0.019f * (2 * rand1f(rng) - 1), 1 + rand1f(rng), 1}, {0, 0, -1}, 0, infinity};
      ray_hit hit;
      if (!prepared.accel->intersect(ray, hit)) continue;
      hits++;
      surface_point p = eval_surface(prepared, ray, hit);
      vec3 d = sample_sphere({rand1f(rng), rand1f(rng)});
      if (std::abs(d.y) > 0.98f) continue;  // along the fibre the skip is bounded
      ray_hit again;
      if (prepared.accel->intersect(spawn_ray(p, d, d), again)) met++;
    }
    CHECK(hits > 19000);
    CAPTURE(int(profile));
    CHECK(met == 0);
  }
}

TEST_CASE("render: only what a scene needs is built") {
  auto built = [](scene_data scene) {
    warning_list warnings;
    std::vector<std::string> names;
    for (const auto& part : prepare_scene(std::move(scene), {}, warnings).parts) {
      CHECK_FALSE(part.why.empty());
      if (part.built) names.push_back(part.name);
    }
    return names;
  };
  auto has = [](const std::vector<std::string>& names, const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  scene_data plain;
  material_data matte;
  matte.color = {0.5f, 0.5f, 0.5f};
  add_shape(plain, make_sphere(), matte);
  add_sky(plain, {1, 1, 1});
  add_ortho_camera(plain, look_at({0, 0, 5}, {0, 0, 0}), 3);
  plain.textures.resize(1);  // names no file: it must not be read
  plain.textures[0].path = "missing.png";
  auto names = built(plain);
  for (auto name : {"curve rays", "point rays", "light sampler", "environment sampler", "textures",
                    "hair lobes", "subdivision", "instances", "triangle rays"})
    CHECK_FALSE(has(names, name));
  CHECK(has(names, "quad rays"));
  names = built(hair_scene());
  CHECK(has(names, "curve rays"));
  CHECK(has(names, "hair lobes"));
  CHECK(has(names, "light sampler"));
  CHECK_FALSE(has(names, "environment sampler"));
  // The plan says the same.
  scene_data planned = hair_scene();
  for (const auto& part : plan_parts(planned)) CHECK(part.built == has(names, part.name.c_str()));
}

TEST_CASE("render: instances of one shape are where they should be, scaled and mirrored") {
  // Three instances share a shape; a fourth scene has their shapes apart. Same picture.
  std::vector<frame3> frames = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1.2f, 0, 0}},
                                {{0.5f, 0, 0}, {0, 0.5f, 0}, {0, 0, 0.5f}, {0.4f, 0.5f, 0}},
                                {{-0.7f, 0, 0}, {0, 0.7f, 0}, {0, 0, 0.7f}, {1.2f, -0.5f, 0}}};
  auto make = [&](bool shared, bool hair) {
    scene_data scene;
    material_data material;
    material.type = hair ? material_type::hair : material_type::matte;
    material.color = {0.7f, 0.7f, 0.7f};
    for (std::size_t i = 0; i < frames.size(); i++) {
      shape_data shape =
          hair ? make_hair_ball(60, 0.4f, 0.02f, curve_basis::bspline) : make_sphere(16, 0.5f);
      add_shape(scene, shape, material, frames[i]);
      if (shared) scene.instances.back().shape = 0;
    }
    add_sky(scene, {1, 1, 1});
    add_ortho_camera(scene, look_at({0, 0, 5}, {0, 0, 0}), 5);
    return scene;
  };
  for (bool hair : {false, true}) {
    warning_list warnings;
    auto options = small(64);
    options.depth = true;
    auto a = render(prepare_scene(make(true, hair), {}, warnings), options);
    auto b = render(prepare_scene(make(false, hair), {}, warnings), options);
    double difference = 0, mean = 0;
    for (std::size_t i = 0; i < a.radiance.size(); i++) {
      difference += std::abs(a.radiance[i].x - b.radiance[i].x) / 64;
      mean += b.radiance[i].x / 64;
      CHECK(std::abs(int(a.depth_samples[i]) - int(b.depth_samples[i])) <= 3);
    }
    // The same paths up to rounding at edges.
    CHECK(difference / mean < 0.01);
  }
}

TEST_CASE("render: sizes and cameras out of range are refused") {
  scene_data scene = hair_scene();
  trace_options options;
  options.width = 0;
  CHECK(image_size(scene, options) == ivec2{1280, 1280});
  options.width = 70000;
  CHECK_THROWS_AS(image_size(scene, options), std::invalid_argument);
  options.width = options.height = 30000;
  CHECK_THROWS_AS(image_size(scene, options), std::invalid_argument);
  options.width = -3;
  CHECK_THROWS_AS(image_size(scene, options), std::invalid_argument);
  options = {};
  options.camera = 1;
  CHECK_THROWS_AS(image_size(scene, options), std::invalid_argument);
  scene.instances[0].shape = 99;
  warning_list warnings;
  CHECK_THROWS_AS(prepare_scene(std::move(scene), {}, warnings), std::invalid_argument);
  CHECK_THROWS_AS(prepare_scene(scene_data{}, {}, warnings), std::invalid_argument);
}

TEST_CASE("render: numbers at the ends of the range of float give a finite picture") {
  for (int variant = 0; variant < 4; variant++) {
    scene_data scene = hair_scene();
    if (scene.cameras.empty()) scene.cameras.push_back(default_camera(scene));
    camera_data& camera = scene.cameras[0];
    if (variant == 0) camera.focus = 1e-30f;
    if (variant == 1) camera.aperture = 1e30f;
    if (variant == 2) camera.frame[3] = vec3(3e18f);
    if (variant == 3) {
      for (auto& shape : scene.shapes)
        for (auto& p : shape.positions) p *= 1e18f;
      camera = default_camera(scene);
    }
    warning_list warnings;
    auto prepared = prepare_scene(std::move(scene), {}, warnings);
    auto options = small(2);
    auto state = make_trace_state(prepared, options);
    trace_image(state, prepared, options);
    bool finite = true;
    for (float value : get_image(state).pixels) finite = finite && std::isfinite(value);
    CHECK(finite);
  }
}

TEST_CASE("render: stops early for time, error and a stop flag") {
  warning_list warnings;
  auto scene = prepare_scene(hair_scene(), {}, warnings);
  auto options = small(1 << 20);
  options.seconds = 0.3;
  auto state = make_trace_state(scene, options);
  int samples = trace_image(state, scene, options);
  CHECK(samples > 0);
  CHECK(samples < 1 << 20);
  options.seconds = 0;
  options.error = 0.05f;
  state = make_trace_state(scene, options);
  trace_image(state, scene, options);
  CHECK(image_error(state) <= 0.05);
  std::atomic<bool> stop = true;
  state = make_trace_state(scene, options);
  CHECK(trace_image(state, scene, options, {}, &stop) == 0);
}

TEST_CASE("render: the error that is reported is honest") {
  // Against a long run: the true error must not exceed the estimate by more than
  // chance (the estimate averages 1024 pixels), and stratification must not hurt.
  warning_list warnings;
  auto scene = prepare_scene(hair_scene(), {}, warnings);
  auto options = small(2048);
  options.filter = pixel_filter::box;
  auto truth = render(scene, options);
  options.samples = 16;
  options.seed = 77;
  auto rough = render(scene, options);
  double squares = 0;
  for (std::size_t i = 0; i < truth.radiance.size(); i++) {
    dvec3 d = dvec3(truth.radiance[i]) / 2048.0 - dvec3(rough.radiance[i]) / 16.0;
    squares += glm::dot(d, d);
  }
  double rmse = std::sqrt(squares / (3.0 * double(truth.radiance.size())));
  CHECK(rmse < 1.15 * image_error(rough));
  CHECK(rmse > 0.3 * image_error(rough));
}
