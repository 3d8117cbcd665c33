#pragma once

// Subdivision of quad meshes, for any vertex data of dimension 2 to 4. The functions are
// pure and safe to call from any thread.

#include <utility>
#include <vector>

#include "wisp/core/export.h"
#include "wisp/core/math.h"

namespace wisp {

// A mesh of quads over vertices of type T; a quad with z == w is a triangle.
template <typename T>
struct quad_mesh {
  std::vector<ivec4> quads = {};
  std::vector<T> vertices = {};
};

// One step of Catmull-Clark subdivision (Catmull and Clark 1978): every face of
// n sides becomes n quads. lock_boundary keeps boundary vertices where they are,
// as is usual for texture coordinates; otherwise boundary edges follow the
// cubic B-spline rule (DeRose et al. 1998). An edge of three or more faces is
// treated as a boundary. Vertices come out as the old ones, one for each edge,
// one for each face, in the order of the faces, on every machine; each face's
// quads replace it in place. Throws std::invalid_argument for indices that are
// not of a vertex and std::length_error when the result would not fit an int.
template <typename T>
quad_mesh<T> subdivide_catmullclark(const quad_mesh<T>& mesh, bool lock_boundary);
// One step of linear subdivision: the same connectivity, no smoothing.
template <typename T>
quad_mesh<T> subdivide_linear(const quad_mesh<T>& mesh);

extern template WISP_API quad_mesh<vec2> subdivide_catmullclark(const quad_mesh<vec2>&, bool);
extern template WISP_API quad_mesh<vec3> subdivide_catmullclark(const quad_mesh<vec3>&, bool);
extern template WISP_API quad_mesh<vec4> subdivide_catmullclark(const quad_mesh<vec4>&, bool);
extern template WISP_API quad_mesh<vec2> subdivide_linear(const quad_mesh<vec2>&);
extern template WISP_API quad_mesh<vec3> subdivide_linear(const quad_mesh<vec3>&);
extern template WISP_API quad_mesh<vec4> subdivide_linear(const quad_mesh<vec4>&);

}  // namespace wisp
