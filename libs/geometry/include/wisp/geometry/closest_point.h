#pragma once

// Closest points: on one triangle or segment, and on all that a bvh holds.
//
// Everything is in double: walks on spheres divide distances by one another over
// many orders of magnitude. Results are the same on any machine, at any thread
// count; bounds may differ between processors in their last bits of single precision.
// No function here allocates, but the batched one. Any number of threads may ask one tree
// at once.

#include <limits>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/bvh.h"

namespace wisp {

// The part of an element that a closest point lies on.
enum struct mesh_feature : uint8_t { face, edge, vertex };

// A closest point of one triangle, segment (vertices 0 and 1) or point (vertex 0).
struct element_point {
  dvec3 point = {0, 0, 0};
  dvec2 uv = {0, 0};  // barycentrics of vertices 1 and 2
  mesh_feature feature = mesh_feature::vertex;
  int feature_index = 0;  // of the edge (0: 01, 1: 12, 2: 20) or vertex; 0 for the face
};

// The closest point to p of a triangle, after Ericson, Real-Time Collision Detection,
// 2005, section 5.1.5, with the squared distance kept from the cancellation that
// slivers bring: a triangle without area is the segment or point that it is.
WISP_API element_point closest_point_on_triangle(const dvec3& p, const dvec3& a, const dvec3& b,
                                                 const dvec3& c);
WISP_API element_point closest_point_on_segment(const dvec3& p, const dvec3& a, const dvec3& b);

struct closest_point_options {
  // Elements farther than this are not looked for. >= 0.
  double max_distance = std::numeric_limits<double>::infinity();
  // In [0, 1): a query may stop once it has proved a lower bound of (1 - tolerance)
  // times the distance of the point that it has found. With 0 the point is the
  // closest one.
  double tolerance = 0;
};

struct closest_point_result {
  // Of the point below; infinity when nothing lies within max_distance.
  double distance = std::numeric_limits<double>::infinity();
  // Nothing is closer than this: `distance` for tolerance 0, max_distance when
  // nothing was found.
  double lower_bound = 0;
  int element = -1;  // its index as given; of equally close ones the first; -1: none
  element_point at = {};
  explicit operator bool() const { return element >= 0; }
};

// The closest point to p. A p that is not finite finds nothing, with a lower bound
// of 0.
WISP_API closest_point_result closest_point(const bvh& tree, const dvec3& p,
                                            const closest_point_options& options = {});

// The same for each of `points`, which are worked on in an order that keeps
// neighbours together, on `threads` threads (0: all). The spans must have one size
// (std::invalid_argument).
WISP_API void closest_points(const bvh& tree, std::span<const dvec3> points,
                             std::span<closest_point_result> results,
                             const closest_point_options& options = {}, int threads = 1);

// Whether something is closer to p than r (false for equal). Stops at the first
// such element.
WISP_API bool closer_than(const bvh& tree, const dvec3& p, double r);

// Bounds of a distance, lower <= distance <= upper.
struct distance_bounds {
  double lower = 0;
  double upper = std::numeric_limits<double>::infinity();
};
// Bounds with lower >= (1 - tolerance) * upper, but for rounding of 1e-6 of the size
// of the tree; cheaper than a closest point as they need not touch an element:
// with a tolerance of 0.2, what a step of a walk on spheres asks for. tolerance in
// (0, 1). A p that is not finite has the bounds 0 and infinity.
WISP_API distance_bounds bound_distance(const bvh& tree, const dvec3& p, double tolerance);
// The same for each of `points`, as closest_points does.
WISP_API void bound_distances(const bvh& tree, std::span<const dvec3> points,
                              std::span<distance_bounds> results, double tolerance,
                              int threads = 1);

}  // namespace wisp
