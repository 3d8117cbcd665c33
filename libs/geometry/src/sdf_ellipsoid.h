#pragma once

// The closest point of an ellipsoid, as in Eberly, Distance from a Point to an
// Ellipse, an Ellipsoid, or a Hyperellipsoid (2013), in other unknowns: of the
// distance from the innermost pole, which has all its digits where the root is near
// that, and by Newton's method on the reciprocal of the length (More and Sorensen,
// Computing a Trust Region Step, 1983), which never passes the root.

#include <algorithm>
#include <cmath>

#include "wisp/core/math.h"

namespace wisp {

// The u > 0 where the length of (n.x / (u + d.x), n.y / (u + d.y), n.z / u) is 1;
// n >= 0, n.z > 0, d >= 0.
inline double ellipsoid_root(const dvec3& n, const dvec2& d) {
  double u = std::max({n.z, n.x - d.x, n.y - d.y});  // there one term alone is 1
  for (int i = 0; i < 100; ++i) {
    const double x = u + d.x, y = u + d.y;
    const double a = n.x / x, b = n.y / y, c = n.z / u;
    const double s = a * a + b * b + c * c;
    const double half_slope = a * a / x + b * b / y + c * c / u;
    const double next = u + s * (std::sqrt(s) - 1) / half_slope;
    if (!(next > u)) break;
    u = next;
  }
  return u;
}

// The closest point of an ellipse with half axes e to y >= 0; e.x >= e.y > 0.
inline dvec2 closest_on_ellipse(const dvec2& e, const dvec2& y) {
  const double d = (e.x - e.y) * (e.x + e.y);
  if (y.y > 0) {
    const double r = (e.x / e.y) * (e.x / e.y), away = d / (e.y * e.y);
    const double u = ellipsoid_root({r * (y.x / e.x), 0, y.y / e.y}, {away, 0});
    return {r * y.x / (u + away), y.y / u};
  }
  const double n = e.x * y.x;
  if (n < d) {
    const double q = n / d;
    return {e.x * q, e.y * std::sqrt(std::max(0.0, 1 - q * q))};
  }
  return {e.x, 0};
}

// The same of an ellipsoid; e.x >= e.y >= e.z > 0.
inline dvec3 closest_on_ellipsoid(const dvec3& e, const dvec3& y) {
  const dvec2 d = {(e.x - e.z) * (e.x + e.z), (e.y - e.z) * (e.y + e.z)};
  if (y.z > 0) {
    const dvec2 r = {(e.x / e.z) * (e.x / e.z), (e.y / e.z) * (e.y / e.z)};
    const dvec2 away = d / (e.z * e.z);
    const double u =
        ellipsoid_root({r.x * (y.x / e.x), r.y * (y.y / e.y), y.z / e.z}, {away.x, away.y});
    return {r.x * y.x / (u + away.x), r.y * y.y / (u + away.y), y.z / u};
  }
  const dvec2 n = {e.x * y.x, e.y * y.y};
  if ((n.x < d.x || n.x == 0) && (n.y < d.y || n.y == 0)) {
    const dvec2 q = {n.x > 0 ? n.x / d.x : 0, n.y > 0 ? n.y / d.y : 0};
    const double rest = 1 - q.x * q.x - q.y * q.y;
    if (rest > 0) return {e.x * q.x, e.y * q.y, e.z * std::sqrt(rest)};
  }
  const dvec2 q = closest_on_ellipse({e.x, e.y}, {y.x, y.y});
  return {q.x, q.y, 0};
}

}  // namespace wisp
