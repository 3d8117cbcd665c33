#pragma once

// Signed distances of meshes in any state: the distance of the closest point, with the
// sign of an inside test by winding numbers.

#include <cstddef>
#include <limits>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/closest_point.h"
#include "wisp/geometry/inside.h"
#include "wisp/geometry/sdf.h"

namespace wisp {

// A mesh as a solid: its tree and its inside test. Copies share them; any number of
// threads may query it at once. A default one is empty.
class WISP_API mesh_solid {
 public:
  mesh_solid() = default;
  // Throws std::invalid_argument for a tree that is not over triangles.
  explicit mesh_solid(const bvh& tree, const inside_options& options = {}) : test_(tree, options) {}
  explicit mesh_solid(const inside_test& test) : test_(test) {}

  const bvh& tree() const { return test_.tree(); }
  const inside_test& test() const { return test_; }
  inside_method method() const { return test_.method(); }
  std::size_t boundary_edges() const { return test_.boundary_edges(); }
  // Memory held besides the tree.
  std::size_t bytes() const { return test_.bytes(); }

 private:
  inside_test test_ = {};
};

inline inside_result inside(const mesh_solid& mesh, const dvec3& p) {
  return inside(mesh.test(), p);
}

struct signed_distance_result {
  double distance = std::numeric_limits<double>::infinity();  // negative inside
  closest_point_result closest = {};                          // none beyond `within`
  inside_result side = {};
};

// The signed distance, exactly 0 on the surface; +infinity for an empty mesh, NaN for
// a p with a NaN. Of an open mesh the solid also ends where the winding number is 1/2,
// away from the surface: there the sign changes and the distance does not pass 0.
WISP_API double signed_distance(const mesh_solid& mesh, const dvec3& p);
// The same where it is no farther than `within` (>= 0) from 0, +-within elsewhere:
// cheaper, as nothing farther is looked for.
WISP_API double signed_distance(const mesh_solid& mesh, const dvec3& p, double within);
// With the closest point and what the inside test said.
WISP_API signed_distance_result
find_signed_distance(const mesh_solid& mesh, const dvec3& p,
                     double within = std::numeric_limits<double>::infinity());

// The same for each of `points`, on `threads` threads (0: all). The spans must have
// one size (std::invalid_argument).
WISP_API void signed_distances(const mesh_solid& mesh, std::span<const dvec3> points,
                               std::span<double> results, int threads = 1);

// The mesh as a leaf of a tree of solids. Where it is open, values jump from one sign
// to the other where the winding number is 1/2, with no surface of the mesh there: a
// ball of radius |value| may then hold a part of that.
WISP_API sdf sdf_mesh(const mesh_solid& mesh);

}  // namespace wisp
