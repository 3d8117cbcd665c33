#pragma once

// Points that stand for a surface: their neighbours, and the area of each. Any number of
// threads may ask one tree at once.

#include <span>
#include <vector>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/bvh.h"

namespace wisp {

// Writes the indices of the k points nearest to p to `found`, the nearest first, of
// equally near ones that with the lower index, and returns how many there are: fewer
// than k where the tree has fewer, none for a p that is not finite. Exact: distances
// are compared in double. Throws std::invalid_argument for a tree that is not of points,
// a negative k or a `found` with less room than k.
WISP_API int nearest_neighbors(const bvh& points, const dvec3& p, int k, std::span<int> found);

// The area of the surface that each point stands for: that of its Voronoi cell among
// its k nearest neighbours (>= 3), all projected to the plane of its normal (Barill et
// al., Fast Winding Numbers for Soups and Clouds, 2018, section 4.2). A cell ends where
// other points than these could bound it, or else those at the edge of an open surface
// would have none. Neighbours whose normals point away, by more than 120 degrees, are of
// the other side of something thin and bound nothing. Points at one place share its cell.
// 0 for a point that is not finite or whose normal is not finite or zero, and where all k
// neighbours are at the point.
// Throws std::invalid_argument where the sizes differ or k is below 3.
WISP_API std::vector<double> estimate_areas(std::span<const dvec3> points,
                                            std::span<const dvec3> normals, int k = 12,
                                            int threads = 0);
// The same with a tree that is already there: that of these points.
WISP_API std::vector<double> estimate_areas(const bvh& tree, std::span<const dvec3> points,
                                            std::span<const dvec3> normals, int k = 12,
                                            int threads = 0);

}  // namespace wisp
