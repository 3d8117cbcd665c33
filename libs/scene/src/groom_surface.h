#pragma once

// What a groom asks of the mesh it grows on: area-weighted roots and the signed
// closest point.

#include <array>
#include <optional>
#include <vector>

#include "wisp/geometry/closest_point.h"
#include "wisp/scene/groom.h"
#include "wisp/scene/scene.h"

namespace wisp {

struct groom_surface {
  // Vertices that share a position are one, so that seams have no gaps.
  std::vector<vec3> positions = {};
  std::vector<ivec3> triangles = {};  // without those that have no area
  std::vector<ivec3> corners = {};    // the same triangles over the mesh's vertices

  // Pseudonormals (unit length): a point whose closest point lies on a face, an
  // edge or a vertex is outside where it lies on the positive side of its normal.
  std::vector<vec3> face_normals = {};
  std::vector<std::array<vec3, 3>> edge_normals = {};  // of edges 01, 12, 20
  std::vector<vec3> vertex_normals = {};

  bvh tree = {};  // of the triangles
};

// Throws std::invalid_argument for a mesh without faces of positive area.
groom_surface make_groom_surface(const shape_data& mesh);

struct groom_surface_point {
  vec3 position = {0, 0, 0};
  vec3 normal = {0, 0, 0};  // away from the surface on the outside, through the query point
  float distance = 0;       // negative inside
};

// The closest point of the surface to p, if it is nearer than `radius`.
std::optional<groom_surface_point> closest_surface_point(const groom_surface& surface,
                                                         const vec3& p, float radius);

struct groom_root {
  vec3 position = {0, 0, 0};
  vec3 normal = {0, 0, 0};  // smooth
  vec2 texcoord = {0, 0};
  float density = 1;  // (0, 1], below 1 in the fade of the region
};

// One root for each strand, uniform over the area of the region times its
// density. Throws std::invalid_argument where the region holds no area.
std::vector<groom_root> place_roots(const groom_surface& surface, const shape_data& mesh,
                                    const groom_params& params);

}  // namespace wisp
