// The camera of scenes that have none.

#include <doctest/doctest.h>

#include "wisp/scene/scene.h"

using namespace wisp;

namespace {

// A triangle that is `size` wide, high and deep.
camera_data camera_for(float size) {
  scene_data scene;
  shape_data shape;
  shape.positions = {{0, 0, 0}, {size, 0, size}, {0, size, 0}};
  shape.triangles = {{0, 1, 2}};
  scene.shapes.push_back(shape);
  scene.instances.push_back({"", identity_frame, 0, 0});
  return default_camera(scene);
}

}  // namespace

TEST_CASE("scene: the default camera sees scenes of any size alike") {
  auto one = camera_for(1);
  for (float size : {1e-20f, 1e-9f, 1e-6f, 1e6f, 1e20f}) {
    CAPTURE(size);
    auto camera = camera_for(size);
    for (int i = 0; i < 3; i++)
      CHECK(camera.frame[3][i] / size == doctest::Approx(one.frame[3][i]).epsilon(1e-5));
    CHECK(camera.focus / size == doctest::Approx(one.focus).epsilon(1e-5));
  }
}

TEST_CASE("scene: the default camera stands off what has no extent") {
  for (float place : {0.0f, 1e-9f, 1.0f, 1e6f}) {
    CAPTURE(place);
    scene_data scene;
    shape_data shape;
    shape.positions = {vec3{place}};
    shape.points = {0};
    scene.shapes.push_back(shape);
    scene.instances.push_back({"", identity_frame, 0, 0});
    auto camera = default_camera(scene);
    CHECK(camera.frame[3].z > place);
    CHECK(camera.focus > 0);
  }
}
