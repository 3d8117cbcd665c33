#include "wisp/scene/scene.h"

#include <algorithm>
#include <cmath>

#include "wisp/scene/solid.h"

namespace wisp {

namespace {

struct box3 {
  vec3 min{infinity};
  vec3 max{-infinity};
};

bool in_range(int i, std::size_t count) { return i >= 0 && static_cast<std::size_t>(i) < count; }

void add(box3& box, const vec3& p, float radius) {
  if (!is_finite(p)) return;
  vec3 r{std::isfinite(radius) && radius > 0 ? radius : 0};
  if (!is_finite(p - r) || !is_finite(p + r)) r = vec3{0};
  box.min = glm::min(box.min, p - r);
  box.max = glm::max(box.max, p + r);
}

// The points whose hull holds segment i of a strand: those of the cubic in
// Bezier form, since splines leave (or do not reach) their own control points.
int hull(curve_basis basis, const vec3* p, vec3 result[4]) {
  switch (basis) {
    case curve_basis::linear:
      result[0] = p[0], result[1] = p[1];
      return 2;
    case curve_basis::bezier:
      std::copy(p, p + 4, result);
      return 4;
    case curve_basis::bspline:
      result[0] = (p[0] + 4.0f * p[1] + p[2]) / 6.0f;
      result[1] = (2.0f * p[1] + p[2]) / 3.0f;
      result[2] = (p[1] + 2.0f * p[2]) / 3.0f;
      result[3] = (p[1] + 4.0f * p[2] + p[3]) / 6.0f;
      return 4;
    case curve_basis::catmull_rom:
      result[0] = p[1];
      result[1] = p[1] + (p[2] - p[0]) / 6.0f;
      result[2] = p[2] - (p[3] - p[1]) / 6.0f;
      result[3] = p[2];
      return 4;
  }
  return 0;
}

void add_strands(box3& box, const shape_data& shape, const frame3& frame, float scale) {
  uint32_t stride = shape.basis == curve_basis::bezier ? 3 : 1;
  for (std::size_t s = 0; s + 1 < shape.strands.size(); s++) {
    uint32_t begin = shape.strands[s], end = shape.strands[s + 1];
    if (end > shape.positions.size() || begin >= end) continue;
    float radius = 0;
    if (shape.radius.size() == shape.positions.size())
      for (uint32_t i = begin; i < end; i++) radius = std::max(radius, shape.radius[i]);
    uint32_t segments = segment_count(shape.basis, end - begin);
    for (uint32_t i = 0; i < segments; i++) {
      vec3 points[4];
      int count = hull(shape.basis, shape.positions.data() + begin + i * stride, points);
      for (int k = 0; k < count; k++) add(box, transform_point(frame, points[k]), radius * scale);
    }
  }
}

void add_shape(box3& box, const shape_data& shape, const frame3& frame) {
  float scale = std::max({glm::length(frame[0]), glm::length(frame[1]), glm::length(frame[2])});
  auto vertex = [&](int i, float radius) {
    if (in_range(i, shape.positions.size()))
      add(box, transform_point(frame, shape.positions[static_cast<std::size_t>(i)]), radius);
  };
  for (int i : shape.points)
    vertex(i, in_range(i, shape.radius.size()) ? shape.radius[static_cast<std::size_t>(i)] * scale
                                               : 0);
  for (const ivec3& t : shape.triangles)
    for (int k = 0; k < 3; k++) vertex(t[k], 0);
  for (const ivec4& q : shape.quads)
    for (int k = 0; k < 4; k++) vertex(q[k], 0);
  add_strands(box, shape, frame, scale);
}

}  // namespace

std::array<vec3, 2> scene_bounds(const scene_data& scene) {
  box3 box;
  // Shapes that subdivs refine are empty before that: their control meshes count.
  std::vector<int> subdiv_of(scene.shapes.size(), invalid_id);
  for (std::size_t i = 0; i < scene.subdivs.size(); i++)
    if (in_range(scene.subdivs[i].shape, subdiv_of.size()))
      subdiv_of[static_cast<std::size_t>(scene.subdivs[i].shape)] = static_cast<int>(i);
  for (const auto& instance : scene.instances) {
    int shown = instance.shape, solid = invalid_id;
    if (in_range(instance.section, scene.sections.size())) {
      const int problem = scene.sections[static_cast<std::size_t>(instance.section)].problem;
      if (!in_range(problem, scene.problems.size())) continue;
      shown = scene.problems[static_cast<std::size_t>(problem)].shape;
      solid = scene.problems[static_cast<std::size_t>(problem)].solid;
    } else if (in_range(shown, scene.shapes.size())) {
      solid = scene.shapes[static_cast<std::size_t>(shown)].solid;
    }
    const bool is_solid = in_range(solid, scene.solids.size());
    if (!is_solid && !in_range(shown, scene.shapes.size())) continue;
    const auto index = static_cast<std::size_t>(is_solid ? 0 : shown);
    if (is_solid) {
      const dbox3 b = solid_bounds(scene, scene.solids[static_cast<std::size_t>(solid)]);
      if (is_empty(b) || !is_finite(b)) continue;
      for (int corner = 0; corner < 8; corner++) {
        const dvec3 p = {corner & 1 ? b.max.x : b.min.x, corner & 2 ? b.max.y : b.min.y,
                         corner & 4 ? b.max.z : b.min.z};
        add(box, transform_point(instance.frame, vec3(p)), 0);
      }
    } else if (scene.shapes[index].positions.empty() && subdiv_of[index] != invalid_id) {
      for (const vec3& p : scene.subdivs[static_cast<std::size_t>(subdiv_of[index])].positions)
        add(box, transform_point(instance.frame, p), 0);
    } else {
      add_shape(box, scene.shapes[index], instance.frame);
    }
  }
  return {box.min, box.max};
}

camera_data default_camera(const scene_data& scene) {
  auto [min, max] = scene_bounds(scene);
  if (!(min.x <= max.x)) min = vec3{-1}, max = vec3{1};
  glm::dvec3 low = min, high = max;
  glm::dvec3 center = (low + high) / 2.0, half = (high - low) / 2.0;

  camera_data camera;
  camera.name = "default";
  double tangent = std::tan(35.0 / 2 * 3.14159265358979 / 180);
  camera.lens = static_cast<float>(static_cast<double>(camera.film) / 2 / tangent);
  // Far enough to see the front of the box, which is its nearest and so its
  // largest face, with a margin of a tenth. A face without extent leaves what
  // the depth is worth, and what floats tell apart at such a place.
  double place = std::max(glm::length(low), glm::length(high));
  double least = std::max(half.z * 1e-3, place * 1e-6);
  if (!(least > 0)) least = 1e-6;
  double distance = 1.1 * std::max({half.x / tangent, half.y / tangent * camera.aspect, least});
  double eye = center.z + half.z + distance;
  camera.frame[3] = {static_cast<float>(center.x), static_cast<float>(center.y),
                     static_cast<float>(std::min(eye, 3e38))};
  camera.focus = static_cast<float>(std::clamp(half.z + distance, 1e-37, 3e38));
  return camera;
}

}  // namespace wisp
