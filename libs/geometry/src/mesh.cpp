#include "wisp/geometry/mesh.h"

#include <algorithm>
#include <cmath>

#include "wisp/core/sampling.h"

namespace wisp {

namespace {

// All the arithmetic here is in double: the square of the size of a small
// model's small face does not fit a float.
dvec3 to_double(const vec3& v) { return {v.x, v.y, v.z}; }

bool in_range(int i, std::size_t count) { return i >= 0 && static_cast<std::size_t>(i) < count; }

}  // namespace

std::vector<ivec3> quads_to_triangles(std::span<const ivec4> quads) {
  std::vector<ivec3> triangles;
  triangles.reserve(quads.size() * 2);
  for (const ivec4& q : quads) {
    if (q.z == q.w) {
      triangles.push_back({q.x, q.y, q.z});
    } else {
      triangles.push_back({q.x, q.y, q.w});
      triangles.push_back({q.z, q.w, q.y});
    }
  }
  return triangles;
}

std::vector<vec3> vertex_normals(std::span<const ivec3> triangles, std::span<const ivec4> quads,
                                 std::span<const vec3> positions) {
  std::vector<dvec3> sums(positions.size(), dvec3{0, 0, 0});
  auto point = [&](int i) { return to_double(positions[static_cast<std::size_t>(i)]); };
  auto add = [&](int i, const dvec3& n) { sums[static_cast<std::size_t>(i)] += n; };
  auto usable = [](const dvec3& n) {
    return std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z);
  };
  for (const ivec3& t : triangles) {
    if (!in_range(t.x, positions.size()) || !in_range(t.y, positions.size()) ||
        !in_range(t.z, positions.size()))
      continue;
    dvec3 n = glm::cross(point(t.y) - point(t.x), point(t.z) - point(t.x));
    if (!usable(n)) continue;
    for (int i : {t.x, t.y, t.z}) add(i, n);
  }
  for (const ivec4& q : quads) {
    if (!in_range(q.x, positions.size()) || !in_range(q.y, positions.size()) ||
        !in_range(q.z, positions.size()) || !in_range(q.w, positions.size()))
      continue;
    // The cross product of the diagonals is twice the area vector, whichever
    // way the quad is split; with z == w it is that of the triangle.
    dvec3 n = glm::cross(point(q.z) - point(q.x), point(q.w) - point(q.y));
    if (!usable(n)) continue;
    for (int i : {q.x, q.y, q.z}) add(i, n);
    if (q.w != q.z) add(q.w, n);
  }

  std::vector<vec3> normals(positions.size());
  for (std::size_t i = 0; i < sums.size(); i++) {
    double length = std::sqrt(glm::dot(sums[i], sums[i]));
    normals[i] = length > 0 && std::isfinite(length) ? vec3{sums[i] * (1 / length)} : vec3{0, 0, 0};
  }
  return normals;
}

mesh_area_sampler make_area_sampler(std::span<const ivec3> triangles,
                                    std::span<const vec3> positions) {
  mesh_area_sampler sampler;
  sampler.cdf.reserve(triangles.size());
  double sum = 0;
  for (const ivec3& t : triangles) {
    if (in_range(t.x, positions.size()) && in_range(t.y, positions.size()) &&
        in_range(t.z, positions.size())) {
      dvec3 a = to_double(positions[static_cast<std::size_t>(t.x)]);
      dvec3 n = glm::cross(to_double(positions[static_cast<std::size_t>(t.y)]) - a,
                           to_double(positions[static_cast<std::size_t>(t.z)]) - a);
      double area = std::sqrt(glm::dot(n, n)) / 2;
      if (std::isfinite(area)) sum += area;
    }
    sampler.cdf.push_back(sum);
  }
  return sampler;
}

mesh_sample sample_area(const mesh_area_sampler& sampler, float rel, const vec2& ruv) {
  if (sampler.cdf.empty() || !(sampler.cdf.back() > 0)) return {};
  double total = sampler.cdf.back();
  // Below the total, so that upper_bound finds a triangle, and the one it finds
  // raises the sum, so that it has an area.
  double r = std::clamp(static_cast<double>(rel) * total, 0.0, std::nextafter(total, 0.0));
  if (std::isnan(r)) r = 0;
  auto it = std::upper_bound(sampler.cdf.begin(), sampler.cdf.end(), r);
  return {static_cast<int>(it - sampler.cdf.begin()), sample_triangle(ruv)};
}

}  // namespace wisp
