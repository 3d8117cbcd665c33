#pragma once

// Small scenes made in memory.

#include <cmath>
#include <utility>

#include "wisp/core/rng.h"
#include "wisp/core/sampling.h"
#include "wisp/render/render_scene.h"
#include "wisp/render/trace.h"
#include "wisp/scene/scene.h"

namespace wisp::test {

inline shape_data make_sphere(int steps = 64, float radius = 1) {
  shape_data shape;
  int rows = steps / 2;
  for (int j = 0; j <= rows; j++)
    for (int i = 0; i <= steps; i++) {
      float theta = pi * float(j) / float(rows), phi = 2 * pi * float(i) / float(steps);
      vec3 n = {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
      shape.positions.push_back(n * radius);
      shape.normals.push_back(n);
      shape.texcoords.push_back({float(i) / float(steps), float(j) / float(rows)});
    }
  for (int j = 0; j < rows; j++)
    for (int i = 0; i < steps; i++) {
      int a = j * (steps + 1) + i, b = a + steps + 1;
      shape.quads.push_back({a, a + 1, b + 1, b});
    }
  return shape;
}

// A square of side 2 in the xz plane that faces +y.
inline shape_data make_square(float half = 1) {
  shape_data shape;
  shape.positions = {{-half, 0, half}, {half, 0, half}, {half, 0, -half}, {-half, 0, -half}};
  shape.texcoords = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  shape.quads = {{0, 1, 2, 3}};
  return shape;
}

// Straight strands from the unit sphere outwards and bent down.
inline shape_data make_hair_ball(int strands, float length, float radius, curve_basis basis,
                                 uint64_t seed = 3) {
  shape_data shape;
  shape.basis = basis;
  shape.strands.push_back(0);
  auto rng = make_rng(seed);
  for (int k = 0; k < strands; k++) {
    vec3 n = sample_sphere({rand1f(rng), rand1f(rng)});
    for (int i = 0; i < 7; i++) {
      float s = float(i) / 6;
      shape.positions.push_back(n * (1 + s * length) + vec3{0, -0.5f * s * s * length, 0});
      shape.radius.push_back(radius * (1 - 0.7f * s));
    }
    shape.strands.push_back(uint32_t(shape.positions.size()));
  }
  return shape;
}

inline int add_shape(scene_data& scene, shape_data shape, material_data material,
                     const frame3& frame = identity_frame) {
  scene.shapes.push_back(std::move(shape));
  scene.materials.push_back(std::move(material));
  instance_data instance;
  instance.frame = frame;
  instance.shape = int(scene.shapes.size()) - 1;
  instance.material = int(scene.materials.size()) - 1;
  scene.instances.push_back(instance);
  return int(scene.instances.size()) - 1;
}

inline void add_sky(scene_data& scene, const vec3& radiance) {
  environment_data environment;
  environment.emission = radiance;
  scene.environments.push_back(environment);
}

// A frame at `eye` that looks along -z at `target`.
inline frame3 look_at(const vec3& eye, const vec3& target, const vec3& up = {0, 1, 0}) {
  vec3 z = glm::normalize(eye - target), x = glm::normalize(glm::cross(up, z));
  return {x, glm::cross(z, x), z, eye};
}

// A square orthographic picture of side `size`.
inline void add_ortho_camera(scene_data& scene, const frame3& frame, float size) {
  camera_data camera;
  camera.frame = frame;
  camera.orthographic = true;
  camera.film = size;
  camera.lens = 1;
  camera.aspect = 1;
  camera.focus = 10;
  scene.cameras.push_back(camera);
}

struct measured {
  dvec3 mean = {0, 0, 0};
  double error = 0;  // standard error of the mean over pixels and channels
  double worst = 0;  // largest |pixel - 1|
};

// Renders and averages all pixels.
inline measured measure(scene_data scene, int resolution, int samples, int bounces = 64,
                        uint64_t seed = 1) {
  warning_list warnings;
  render_scene prepared = prepare_scene(std::move(scene), {}, warnings);
  trace_options options;
  options.width = options.height = resolution;
  options.samples = samples;
  options.bounces = bounces;
  options.seed = seed;
  options.filter = pixel_filter::box;
  trace_state state = make_trace_state(prepared, options);
  trace_image(state, prepared, options);
  measured m;
  double pixels = double(state.radiance.size());
  for (std::size_t i = 0; i < state.radiance.size(); i++) {
    dvec3 p = dvec3(state.radiance[i]) / double(state.samples[i]);
    m.mean += p / pixels;
    for (int k = 0; k < 3; k++) m.worst = std::max(m.worst, std::abs(p[k] - 1));
  }
  m.error = image_error(state) / std::sqrt(pixels);
  return m;
}

}  // namespace wisp::test
