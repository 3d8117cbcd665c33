#pragma once

// Approximate generalized winding numbers of triangles in any state and of oriented
// points, by Taylor's expansions of far parts (Barill et al., Fast Winding Numbers for
// Soups and Clouds, 2018):
//   w(p) = 1/(4 pi) integral of n.(x - p) / |x - p|^3 dA.
// Unlike winding_number.h, the cost does not grow with the boundary, and the result is
// not exact: a closed mesh gives whole numbers but for the errors below.
//
// The series of a part is that of the potential 1/|x - p| about the part's centroid;
// as that is harmonic, only the symmetric, traceless part of each moment counts: 3, 5
// and 7 numbers for the orders 1, 2 and 3, in place of 3, 9 and 27. Eight parts are
// computed at once, and eight triangles, near ones by their exact solid angle (Van
// Oosterom and Strackee, The Solid Angle of a Plane Triangle, 1983).

#include <cstddef>
#include <memory>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/bvh.h"

namespace wisp {

struct fast_winding_options {
  int order = 3;    // of the expansions: 1, 2 or 3; a higher one takes more memory and little time
  int threads = 0;  // to build with; 0: all
};

struct fast_winding_data;  // within the library

// What the expansions of a mesh or cloud are. Immutable; copies share it, and any
// number of threads may query it at once. A default one is empty.
class WISP_API fast_winding {
 public:
  fast_winding() = default;
  explicit fast_winding(std::shared_ptr<const fast_winding_data> data) : data_(std::move(data)) {}

  // Memory held beside the tree's, which a mesh shares; a cloud's tree counts.
  std::size_t bytes() const;
  // 0 for a default one.
  int order() const;

  const fast_winding_data* data() const { return data_.get(); }

 private:
  std::shared_ptr<const fast_winding_data> data_ = {};
};

// The expansions of the triangles of a tree. Triangles that the tree left out do not
// count. Cost: about 0.1 s for a million triangles. Throws std::invalid_argument for a
// tree that is not of triangles or an order that is not 1, 2 or 3.
WISP_API fast_winding make_fast_winding(const bvh& tree, const fast_winding_options& options = {});

// Those of points that each stand for a piece of surface: its area, and the direction
// out of the solid. Without areas they are estimated (estimate_areas() in
// point_cloud.h). Normals may have any length; a point that is not finite, or whose
// normal is not finite or zero, does not count. Throws std::invalid_argument where the
// sizes differ, an area is negative or not finite, or the order is not 1, 2 or 3.
WISP_API fast_winding make_fast_winding(std::span<const dvec3> points,
                                        std::span<const dvec3> normals,
                                        std::span<const double> areas = {},
                                        const fast_winding_options& options = {});

// The winding number around p: about 1 inside of a closed mesh whose triangles are
// counter-clockwise seen from outside, 0 outside. NaN for a p that is not finite, 0 for
// nothing at all. Never allocates.
//
// A part of the surface is expanded where p is farther than beta times the part's radius
// from its area-weighted centroid, from which that radius is measured. The largest errors
// at 400,000 points in the box of and near to each of three meshes of 70,000 and 1.1
// million triangles, one of them open:
//
//   beta       1.5     2       2.35    3       4       6
//   order 1    0.21    0.095   0.061   0.033   0.018   0.007
//   order 2    0.13    0.052   0.036   0.021   0.011   0.0044
//   order 3    0.032   0.007   0.0032  0.0011  0.0004  0.0002
//
// The first term that orders 1 and 2 leave out has one sign all over a flat surface, so
// that errors add up; about the middle of a ball order 2 has up to 1.6 times these. With infinity
// every triangle is computed by itself. Throws std::invalid_argument for a beta that is not above
// 0; with one below 1 parts may be expanded where their series do not converge.
//
// Single precision, finished in double for triangles that p almost touches: 1e-6 are
// wrong far from the surface, and about 1e-8 / h at a distance h, in half sizes of the
// mesh. The winding number of a cloud makes no sense nearer to it than its points are
// to each other; at a point itself that point does not count.
WISP_API double fast_winding_number(const fast_winding& fast, const dvec3& p, double beta = 2.35);

// The same for each of `points`, on `threads` threads (0: all): of a large mesh in the
// order of a space-filling curve, which is faster. Throws
// std::invalid_argument for spans of different sizes.
WISP_API void fast_winding_numbers(const fast_winding& fast, std::span<const dvec3> points,
                                   std::span<double> results, double beta = 2.35, int threads = 1);

}  // namespace wisp
