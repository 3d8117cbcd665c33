#pragma once

// The solid angle of a triangle and the winding number as the plain sum of them: the
// reference that faster ways (winding_number.h, fast_winding.h) are held to. The functions
// are pure and safe to call from any thread.

#include <cmath>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"

namespace wisp {

// The signed solid angle of the triangle a, b, c seen from p, in [-2 pi, 2 pi]:
// positive where p sees it clockwise, as from the inside of a mesh whose triangles are
// counter-clockwise outside. In the plane of the triangle it is 0 outside of it and
// may be either of +-2 pi on it. With an error of rounding only, relative to the
// angle where p is far away; lengths from 1e-290 to 1e290.
// Van Oosterom and Strackee, The Solid Angle of a Plane Triangle, 1983, equation 8.
inline double solid_angle(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
  dvec3 pa = a - p, pb = b - p, pc = c - p, ab = b - a, ac = c - a;
  const dvec3 most = glm::max(glm::abs(pa), glm::max(glm::abs(pb), glm::abs(pc)));
  const double size = std::max({most.x, most.y, most.z});
  if (!(size > 1e-90 && size < 1e90)) {
    if (!(size > 0) || !std::isfinite(size)) return size == 0 ? 0.0 : size - size;
    // a power of two changes no digit; twice, as one alone may not be a double
    const int exponent = std::ilogb(size), half = exponent / 2;
    for (const int e : {half, exponent - half}) {
      for (dvec3* v : {&pa, &pb, &pc, &ab, &ac}) *v *= std::ldexp(1.0, -e);
    }
  }
  const double la = glm::length(pa), lb = glm::length(pb), lc = glm::length(pc);
  // by the edges, which are short where the triangle is far
  const double volume = glm::dot(pa, glm::cross(ab, ac));
  const double cosine =
      la * lb * lc + glm::dot(pa, pb) * lc + glm::dot(pb, pc) * la + glm::dot(pc, pa) * lb;
  return 2 * std::atan2(volume, cosine);
}

// The generalized winding number of a triangle soup (Jacobson et al., Robust
// Inside-Outside Segmentation using Generalized Winding Numbers, 2013, equation 5):
// 1 inside and 0 outside of a closed mesh that is counter-clockwise outside. Triangles
// with a vertex that is not finite count nothing. Cost: that of all triangles.
// NaN for a p with a NaN. Throws std::invalid_argument for an index that is not of a vertex.
WISP_API double winding_number_sum(std::span<const ivec3> triangles,
                                   std::span<const dvec3> positions, const dvec3& p);

}  // namespace wisp
