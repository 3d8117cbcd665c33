#pragma once

// What several layers ask of triangle and quad meshes. A quad with z == w is
// the triangle x y z. The functions are pure and safe to call from any thread. Faces with
// an index that is not of a vertex, or a vertex that is not finite, count nothing.

#include <span>
#include <vector>

#include "wisp/core/export.h"
#include "wisp/core/math.h"

namespace wisp {

// Unit normal of a triangle, counter-clockwise outside; zero if it has no area.
inline vec3 triangle_normal(const vec3& a, const vec3& b, const vec3& c) {
  return normalize_or_zero(glm::cross(b - a, c - a));
}
inline float triangle_area(const vec3& a, const vec3& b, const vec3& c) {
  return glm::length(glm::cross(b - a, c - a)) / 2;
}

// Splits quads into triangles (x y w, z w y), keeping degenerate quads as one.
WISP_API std::vector<ivec3> quads_to_triangles(std::span<const ivec4> quads);

// Area-weighted vertex normals of unit length; zero for vertices of no face.
WISP_API std::vector<vec3> vertex_normals(std::span<const ivec3> triangles,
                                          std::span<const ivec4> quads,
                                          std::span<const vec3> positions);

// Area-weighted points on the faces of a mesh, by inversion of the running sum.
struct mesh_area_sampler {
  std::vector<double> cdf = {};  // cdf[i]: area of triangles 0..i, in squared units of length
};
WISP_API mesh_area_sampler make_area_sampler(std::span<const ivec3> triangles,
                                             std::span<const vec3> positions);
struct mesh_sample {
  int triangle = -1;  // none where there is no area
  vec2 uv = {0, 0};   // barycentrics of the second and third vertex
};
// rel in [0, 1) picks the triangle, ruv the point, uniform over the area.
WISP_API mesh_sample sample_area(const mesh_area_sampler& sampler, float rel, const vec2& ruv);

}  // namespace wisp
