#include <doctest/doctest.h>

#include <cmath>
#include <stdexcept>

#include "accel.h"
#include "support/scenes.h"

using namespace wisp;
using namespace wisp::test;

namespace {

solid_data carved_ball(solid_display display) {
  solid_data solid;
  solid.name = "carved ball";
  solid.display = display;
  solid.resolution = 96;
  solid_node ball, bite, cut;
  ball.type = bite.type = solid_type::sphere;
  ball.radius = 1;
  bite.a = {0.6, 0.4, 0.7};
  bite.radius = 0.5;
  cut.type = solid_type::difference;
  cut.operands = {0, 1};
  solid.nodes = {ball, bite, cut};
  return solid;
}

scene_data solid_scene(solid_display display, const frame3& frame = identity_frame) {
  scene_data scene;
  scene.solids.push_back(carved_ball(display));
  shape_data shape;
  shape.solid = 0;
  material_data grey;
  grey.color = {0.5f, 0.5f, 0.5f};
  add_shape(scene, shape, grey, frame);
  add_sky(scene, {1, 1, 1});
  add_ortho_camera(scene, look_at({2, 1.5f, 3}, {0, 0, 0}), 2.4f);
  return scene;
}

render_scene prepare(scene_data scene) {
  warning_list warnings;
  return prepare_scene(std::move(scene), {}, warnings);
}

}  // namespace

TEST_CASE("render: a solid that is traced and one that is meshed are seen alike") {
  // turned, moved and scaled, so that rays have to be taken to the solid's space
  const frame3 frame = {vec3{0, 1.1f, 0}, vec3{0, 0, 1.1f}, vec3{1.1f, 0, 0}, vec3{0.1f, 0.2f, 0}};
  for (const frame3& f : {identity_frame, frame}) {
    const render_scene traced = prepare(solid_scene(solid_display::trace, f));
    const render_scene meshed = prepare(solid_scene(solid_display::mesh, f));
    rng_state rng = make_rng(5);
    int hits = 0, differ = 0;
    for (int i = 0; i < 20000; ++i) {
      const vec3 from = 3.0f * sample_sphere({rand1f(rng), rand1f(rng)});
      const vec3 to = 0.9f * sample_sphere({rand1f(rng), rand1f(rng)});
      const ray3 ray{from, glm::normalize(to - from), 0, infinity};
      ray_hit a, b;
      const bool in_a = traced.accel->intersect(ray, a), in_b = meshed.accel->intersect(ray, b);
      REQUIRE(in_a == traced.accel->occluded(ray));
      if (in_a != in_b) {
        ++differ;
        continue;
      }
      if (!in_a) continue;
      ++hits;
      REQUIRE(a.kind == element_kind::solid);
      if (std::abs(a.t - b.t) > 0.02f) ++differ;  // past an edge
      const float cosine = glm::dot(normalize_or_zero(a.ng), normalize_or_zero(b.ng));
      if (cosine < 0.97f) ++differ;
    }
    CHECK(hits > 10000);
    CHECK(differ < 200);
  }
}

TEST_CASE("render: a traced solid takes from the sky what it should") {
  // a convex grey ball in a white sky shows its albedo, whatever draws it
  for (const solid_display display : {solid_display::trace, solid_display::mesh}) {
    scene_data scene = solid_scene(display);
    scene.solids[0].nodes.resize(1);
    scene.cameras.clear();
    add_ortho_camera(scene, look_at({2, 1.5f, 3}, {0, 0, 0}), 1.0f);
    const measured m = measure(std::move(scene), 16, 64);
    for (int k = 0; k < 3; ++k) CHECK(m.mean[k] == doctest::Approx(0.5).epsilon(0.01));
  }
}

TEST_CASE("render: what solids need is built and reported and nothing else") {
  const auto built = [](const render_scene& scene, const std::string& name) {
    for (const auto& part : scene.parts)
      if (part.name == name) return part.built;
    FAIL("no part ", name);
    return false;
  };
  const render_scene traced = prepare(solid_scene(solid_display::trace));
  CHECK(built(traced, "solid rays"));
  CHECK_FALSE(built(traced, "solid meshes"));
  CHECK_FALSE(built(traced, "triangle rays"));
  CHECK_FALSE(built(traced, "distance tree"));
  const render_scene meshed = prepare(solid_scene(solid_display::mesh));
  CHECK_FALSE(built(meshed, "solid rays"));
  CHECK(built(meshed, "solid meshes"));
  CHECK(built(meshed, "triangle rays"));

  scene_data with_mesh = solid_scene(solid_display::mesh);
  with_mesh.shapes.push_back(make_sphere(32, 0.4f));
  solid_node mesh;
  mesh.type = solid_type::mesh;
  mesh.shape = 1;
  with_mesh.solids[0].nodes = {mesh};
  const render_scene of_mesh = prepare(std::move(with_mesh));
  CHECK(built(of_mesh, "distance tree"));
  CHECK(of_mesh.scene.shapes[1].positions.empty());  // it was there for the solid alone
}

TEST_CASE("render: a solid that is infinite or empty cannot be shown") {
  for (const solid_display display : {solid_display::trace, solid_display::mesh}) {
    scene_data scene = solid_scene(display);
    solid_node plane;
    plane.type = solid_type::plane;
    plane.b = {0, 1, 0};
    scene.solids[0].nodes = {plane};
    CHECK_THROWS_AS(prepare(std::move(scene)), std::invalid_argument);
    scene_data empty = solid_scene(display);
    empty.solids[0].nodes[1].a = {0, 0, 0};
    empty.solids[0].nodes[1].radius = 2;
    empty.solids[0].nodes[2].type = solid_type::intersection;
    empty.solids[0].nodes[1].a = {9, 0, 0};
    CHECK_THROWS_AS(prepare(std::move(empty)), std::invalid_argument);
  }
}
