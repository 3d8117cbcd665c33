#pragma once

// What single queries and batches share: how a query starts, and how it is finished
// in double.

#include <algorithm>
#include <cmath>
#include <optional>

#include "query.h"

namespace wisp {

// The best of what was compared in double. Vertices and p are scaled by a power of
// two, which changes no digit, so that no square overflows or vanishes.
struct finish {
  const bvh_data* data = nullptr;
  dvec3 p = {0, 0, 0};
  double distance2 = std::numeric_limits<double>::infinity();
  uint32_t element = bvh_no_child;
  double enough = 0;
  element_point at = {};

  finish(const bvh_data& d, const dvec3& x) : data(&d), p(x * d.scale) {}
  void compare(uint32_t slot) {
    const auto v = data->corners(slot);
    const uint32_t t = data->elements[slot];
    const double s = data->scale;
    const dvec3 v0 = v[0] * s, v1 = v[1] * s, v2 = v[2] * s;
    element_point e;
    if (data->element == bvh_element::triangle) {
      e = closest_point_on_triangle(p, v0, v1, v2);
    } else {
      e = closest_point_on_segment(p, v0, v1);
    }
    // by differences of vertices, which lose nothing far from the origin
    const dvec3 r = e.feature == mesh_feature::vertex
                        ? p - e.point
                        : p - v0 - e.uv.x * (v1 - v0) - e.uv.y * (v2 - v0);
    const double d2 = glm::dot(r, r);
    if (d2 < distance2 || (d2 == distance2 && t < element)) {
      distance2 = d2;
      element = t;
      at = e;
    }
  }
  double distance() const { return std::sqrt(distance2) * data->unit; }
};

// Whether p, normalized, is too far away for single precision.
inline bool is_far(const dvec3& normalized) {
  const dvec3 x = glm::abs(normalized);
  return !(std::max({x.x, x.y, x.z}) <= far_from);
}

void start(nearest_query& q, finish& best, const bvh_data& data, const dvec3& x,
           const closest_point_options& options);
closest_point_result finish_up(const nearest_query& q, finish& best, const bvh& tree,
                               const dvec3& p, const closest_point_options& options);
// What needs no traversal in single precision, or cannot have one.
std::optional<closest_point_result> special_case(const bvh& tree, const dvec3& p,
                                                 const closest_point_options& options);

void start(bounds_query& q, const bvh_data& data, const dvec3& x, double tolerance);
distance_bounds finish_up(const bounds_query& q, const bvh& tree, const dvec3& p, double tolerance);
std::optional<distance_bounds> special_bounds(const bvh& tree, const dvec3& p);

}  // namespace wisp
