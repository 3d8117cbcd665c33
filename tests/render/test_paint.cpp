// Colours that functions give to surfaces, and solids that are cut open.

#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <stdexcept>

#include "accel.h"
#include "path.h"
#include "support/scenes.h"
#include "surface.h"

using namespace wisp;
using namespace wisp::test;

namespace {

const frame3 turned = {vec3{0, 1.5f, 0}, vec3{0, 0, 1.5f}, vec3{1.5f, 0, 0}, vec3{0.5f, 0.2f, -1}};

// A ball of radius 1 without what lies in front of z = 0.25.
scene_data cut_ball(solid_display display, const frame3& frame = identity_frame) {
  scene_data scene;
  solid_data solid;
  solid.display = display;
  solid.resolution = 64;
  solid_node ball;
  ball.radius = 1;
  solid.nodes = {ball};
  solid.cuts = {{{0, 0, 0.25}, {0, 0, 3}}};
  scene.solids.push_back(solid);
  shape_data shape;
  shape.solid = 0;
  material_data white;
  white.color = {1, 1, 1};
  add_shape(scene, shape, white, frame);
  add_sky(scene, {1, 1, 1});
  add_ortho_camera(scene, look_at({0, 0, 3}, {0, 0, 0}), 0.9f);
  return scene;
}

render_scene prepare(scene_data scene) {
  warning_list warnings;
  return prepare_scene(std::move(scene), {}, warnings);
}

// Every pixel of a picture, with the extremes over all of them.
struct extremes {
  dvec3 least = dvec3{1e9}, most = dvec3{-1e9};
};
extremes render_extremes(scene_data scene, int samples = 4) {
  const render_scene prepared = prepare(std::move(scene));
  trace_options options;
  options.width = options.height = 16;
  options.samples = samples;
  options.filter = pixel_filter::box;
  trace_state state = make_trace_state(prepared, options);
  trace_image(state, prepared, options);
  extremes result;
  for (std::size_t i = 0; i < state.radiance.size(); i++) {
    const dvec3 p = dvec3(state.radiance[i]) / static_cast<double>(state.samples[i]);
    result.least = glm::min(result.least, p);
    result.most = glm::max(result.most, p);
  }
  return result;
}

}  // namespace

TEST_CASE("render: paint is asked at the point that is hit in the space of the shape") {
  for (const frame3& frame : {identity_frame, turned})
    for (const bool traced : {true, false}) {
      scene_data scene = cut_ball(solid_display::trace, frame);
      if (!traced) {
        scene.shapes[0] = make_sphere(48);
        scene.solids.clear();
      }
      scene.shapes[0].paint.color = [](const vec3& p, int cut) {
        return vec4(p, cut >= 0 ? 0.5f : 1.0f);
      };
      scene.materials[0].color = {0.5f, 1, 1};
      const render_scene prepared = prepare(std::move(scene));
      CHECK_FALSE(prepared.has_transparency);
      rng_state rng = make_rng(3);
      int hits = 0, on_cut = 0;
      for (int i = 0; i < 5000; i++) {
        const vec3 from = 3.0f * sample_sphere({rand1f(rng), rand1f(rng)});
        const vec3 to = 0.9f * sample_sphere({rand1f(rng), rand1f(rng)});
        const vec3 o = transform_point(frame, from), d = transform_vector(frame, to - from);
        const ray3 ray{o, glm::normalize(d), 0, infinity};
        ray_hit hit;
        if (!prepared.accel->intersect(ray, hit)) continue;
        hits++;
        const surface_point p = eval_surface(prepared, ray, hit);
        const vec3 local = transform_point(inverse(frame), p.position);
        REQUIRE(glm::distance(vec3(p.color), local) < 1e-5f);
        const material_point m = eval_material(prepared, p);
        REQUIRE(glm::distance(m.color, local * vec3{0.5f, 1, 1}) < 1e-5f);
        if (!traced) continue;
        REQUIRE(local.z < 0.25f + 1e-4f);
        const bool cut = p.color.w < 0.75f;
        on_cut += cut;
        if (cut) {
          REQUIRE(local.z == doctest::Approx(0.25).epsilon(1e-5));
          const vec3 normal = transform_normal(frame, {0, 0, 1});
          REQUIRE(std::abs(glm::dot(p.geometric_normal, normal)) > 0.9999f);
        } else {
          REQUIRE(glm::length(local) == doctest::Approx(1).epsilon(1e-5));
        }
      }
      CHECK(hits > 2000);
      if (traced) CHECK(on_cut > 300);
    }
}

TEST_CASE("render: what is unlit shows its colour exactly and reflects nothing") {
  const vec3 cut_color = {0.125f, 0.5f, 2};
  for (const vec3& sky : {vec3{0, 0, 0}, vec3{5, 5, 5}}) {
    scene_data scene = cut_ball(solid_display::trace);
    scene.environments[0].emission = sky;
    scene.shapes[0].paint.unlit = true;
    scene.shapes[0].paint.color = [&](const vec3&, int cut) {
      return cut == 0 ? vec4(cut_color, 1) : vec4(1, 0, 0, 1);
    };
    const extremes seen = render_extremes(scene);  // the face of the cut fills the picture
    CHECK(seen.least == dvec3(cut_color));
    CHECK(seen.most == dvec3(cut_color));
    scene.cameras[0].frame = look_at({0, 0, -3}, {0, 0, 0});
    const extremes behind = render_extremes(scene);
    CHECK(behind.least == dvec3{1, 0, 0});
    CHECK(behind.most == dvec3{1, 0, 0});
  }
}

TEST_CASE("render: what is lit reflects its paint") {
  for (const bool traced : {true, false}) {
    scene_data scene = cut_ball(solid_display::trace);
    if (!traced) {
      scene.shapes[0] = make_square(2);
      scene.cameras[0].frame = look_at({0, 3, 0.001f}, {0, 0, 0});
    }
    scene.shapes[0].paint.color = [](const vec3&, int) { return vec4(0.25f, 0.5f, 0.75f, 1); };
    const measured m = measure(std::move(scene), 16, 64);
    CHECK(m.mean.x == doctest::Approx(0.25).epsilon(0.01));
    CHECK(m.mean.y == doctest::Approx(0.5).epsilon(0.01));
    CHECK(m.mean.z == doctest::Approx(0.75).epsilon(0.01));
  }
}

TEST_CASE("render: paint without opacity lets rays pass") {
  scene_data scene = cut_ball(solid_display::trace);
  scene.environments[0].emission = {3, 3, 3};
  material_data white;
  // upright, before the ball
  add_shape(scene, make_square(2), white,
            frame3{vec3{1, 0, 0}, vec3{0, 0, 1}, vec3{0, -1, 0}, vec3{0, 0, 1}});
  auto& paint = scene.shapes[1].paint;
  scene.cameras[0].frame = look_at({0, 0, 3}, {0, 0, 0});
  paint.unlit = true;
  paint.transparent = true;
  paint.color = [](const vec3&, int) { return vec4(9, 9, 9, 0); };
  scene.shapes[0].paint.unlit = true;
  scene.shapes[0].paint.color = [](const vec3&, int) { return vec4(0.5f, 0.5f, 0.5f, 1); };
  CHECK(prepare(scene).has_transparency);
  extremes seen = render_extremes(scene);
  CHECK(seen.least == dvec3{0.5});
  CHECK(seen.most == dvec3{0.5});
  paint.color = [](const vec3&, int) { return vec4(9, 9, 9, 1); };
  seen = render_extremes(scene);
  CHECK(seen.least == dvec3{9});
  CHECK(seen.most == dvec3{9});
}

TEST_CASE("render: a cut solid that is meshed ends at the cut") {
  const render_scene meshed = prepare(cut_ball(solid_display::mesh));
  REQUIRE(meshed.scene.shapes[0].triangles.size() > 1000);
  float low = 1e9f, high = -1e9f;
  for (const vec3& p : meshed.scene.shapes[0].positions)
    low = std::min(low, p.z), high = std::max(high, p.z);
  CHECK(low == doctest::Approx(-1).epsilon(0.01));
  CHECK(high == doctest::Approx(0.25).epsilon(0.01));
}

TEST_CASE("render: scenes without paint are as before and sections must be replaced") {
  scene_data scene = cut_ball(solid_display::trace, turned);
  scene.solids.clear();
  scene.shapes[0] = make_sphere(16);
  scene_data painted = scene;
  const render_scene plain = prepare(scene);
  CHECK(plain.scene.instances[0].frame == identity_frame);  // moved to where it is seen
  CHECK_FALSE(plain.has_transparency);
  painted.shapes[0].paint.color = [](const vec3&, int) { return vec4(1); };
  const render_scene other = prepare(painted);
  REQUIRE(plain.parts.size() == other.parts.size());
  for (std::size_t i = 0; i < plain.parts.size(); i++) {
    CHECK(plain.parts[i].name == other.parts[i].name);
    CHECK(plain.parts[i].built == other.parts[i].built);
  }
  // an unlit surface is light enough not to warn of darkness
  painted.environments.clear();
  painted.shapes[0].paint.unlit = true;
  warning_list warnings;
  prepare_scene(std::move(painted), {}, warnings);
  CHECK(warnings.empty());

  instance_data section;
  section.section = 0;
  scene.instances.push_back(section);
  CHECK_THROWS_AS(prepare(scene), std::invalid_argument);
}
