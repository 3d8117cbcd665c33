#pragma once

// The exact generalized winding number of a mesh: crossings of one axis-parallel ray,
// and of the mesh's open boundary the angles that it makes around the ray (Martens et
// al., the antipodal method, arXiv 2605.01536, 2026):
//   w(p) = sum over crossings of sign(v.n)
//        + 1/(2 pi) sum over boundary edges (a, b) of
//            atan2(-v.(a x b), |a||b| - |b| v.a - |a| v.b + a.b),
// a and b relative to p, v the direction of the ray. A closed mesh has no boundary:
// what is left is a whole number.
//
// No ray slips through an edge or counts it twice: whether a triangle is crossed
// follows from exact predicates, with ties broken as if the point were moved by an
// infinitely small amount, and the boundary's terms take their signs from the same.
// So the winding number of a closed mesh is an exact whole number anywhere.

#include <cstddef>
#include <memory>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/bvh.h"

namespace wisp {

struct winding_options {
  // What the boundary's part may be wrong by. Runs of boundary edges that are far
  // enough away are replaced by a straight edge and the solid angle between run and
  // edge, as a series of multipoles. 0: every edge by itself. >= 0.
  double tolerance = 1e-6;
  // Keep the crossings for the cells of a grid that no triangle touches, so that most
  // points need to look no farther than to the next such cell. Up to 8 MB.
  bool grid = true;
  int threads = 0;  // to build with; 0: all
};

struct winding_data;  // within the library

// What winding numbers of a mesh are computed from. Immutable; copies share it, and
// any number of threads may ask it at once. A default one is of an empty mesh.
class WISP_API winding {
 public:
  winding() = default;
  explicit winding(std::shared_ptr<const winding_data> data) : data_(std::move(data)) {}

  // Directed edges of the boundary, with their multiplicity: those that no opposite
  // edge of another triangle cancels. Vertices at the same position are one.
  std::size_t boundary_edges() const;
  // Closed runs that these form.
  std::size_t boundary_loops() const;
  // Whether there is no boundary, so that winding numbers are whole.
  bool closed() const { return boundary_edges() == 0; }
  // Cells of the grid; 0: there is none.
  std::size_t grid_cells() const;
  // Memory held besides the tree.
  std::size_t bytes() const;
  const bvh& tree() const;

  const winding_data* data() const { return data_.get(); }

 private:
  std::shared_ptr<const winding_data> data_ = {};
};

// Triangles that the tree left out are not of the mesh: it is open there. Cost: about
// a fifth of a second for a million triangles. Throws std::invalid_argument for a
// tree that is not over triangles or a tolerance that is not >= 0.
WISP_API winding make_winding(const bvh& tree, const winding_options& options = {});

// The winding number of the mesh around p. A whole number for a closed mesh. On the
// surface it is that of a side of it; on the boundary, some number between those
// around. NaN for a p with a NaN, 0 infinitely far away. Never allocates.
WISP_API double winding_number(const winding& w, const dvec3& p);

// The same for each of `points`, on `threads` threads (0: all). The spans must have
// one size (std::invalid_argument).
WISP_API void winding_numbers(const winding& w, std::span<const dvec3> points,
                              std::span<double> results, int threads = 1);

}  // namespace wisp
