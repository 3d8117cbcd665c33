#pragma once

// Axis-aligned boxes in double. The functions are pure and safe to call from any thread.

#include <cmath>
#include <limits>

#include "wisp/core/math.h"

namespace wisp {

// Empty unless said otherwise: min > max.
struct dbox3 {
  dvec3 min = dvec3{std::numeric_limits<double>::infinity()};
  dvec3 max = -dvec3{std::numeric_limits<double>::infinity()};
};

inline constexpr dbox3 infinite_box{-dvec3{std::numeric_limits<double>::infinity()},
                                    dvec3{std::numeric_limits<double>::infinity()}};

inline bool is_empty(const dbox3& b) {
  return !(b.min.x <= b.max.x && b.min.y <= b.max.y && b.min.z <= b.max.z);
}
inline bool is_finite(const dbox3& b) {
  for (int a = 0; a < 3; ++a) {
    if (!std::isfinite(b.min[a]) || !std::isfinite(b.max[a])) return false;
  }
  return true;
}
inline dbox3 merge(const dbox3& a, const dbox3& b) {
  return {glm::min(a.min, b.min), glm::max(a.max, b.max)};
}
inline dbox3 merge(const dbox3& a, const dvec3& p) {
  return {glm::min(a.min, p), glm::max(a.max, p)};
}
inline dbox3 intersect(const dbox3& a, const dbox3& b) {
  return {glm::max(a.min, b.min), glm::min(a.max, b.max)};
}
// The box moved outwards on all sides; an empty one stays empty.
inline dbox3 grow(const dbox3& b, double by) {
  return is_empty(b) ? b : dbox3{b.min - by, b.max + by};
}
inline bool contains(const dbox3& b, const dvec3& p) {
  return p.x >= b.min.x && p.y >= b.min.y && p.z >= b.min.z && p.x <= b.max.x && p.y <= b.max.y &&
         p.z <= b.max.z;
}
// 0 inside; infinite for an empty box.
inline double distance_squared(const dbox3& b, const dvec3& p) {
  const dvec3 d = glm::max(glm::max(b.min - p, p - b.max), dvec3{0});
  return d.x * d.x + d.y * d.y + d.z * d.z;
}
inline double distance(const dbox3& b, const dvec3& p) { return std::sqrt(distance_squared(b, p)); }

}  // namespace wisp
