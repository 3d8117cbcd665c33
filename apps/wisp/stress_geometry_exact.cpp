#include "stress_geometry_exact.h"

#include <algorithm>
#include <cmath>

using namespace wisp;

wide wide_root(wide x) {
  if (!(x > 0)) return 0;
  wide y = std::sqrt(static_cast<double>(x));
  for (int i = 0; i < 3; ++i) y = (y + x / y) / 2;
  return y;
}

namespace {

bool usable(const stress_mesh& m, std::size_t t) {
  for (int k = 0; k < 3; ++k) {
    const dvec3& v = m.corner(t, k);
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) return false;
  }
  return true;
}

// Squared, from q to the segment from 0 to e.
wide segment_distance2(const wide3& q, const wide3& e) {
  const wide e2 = dot(e, e);
  wide s = e2 > 0 ? dot(q, e) / e2 : wide(0);
  s = s < 0 ? wide(0) : s > 1 ? wide(1) : s;
  const wide3 r = q - s * e;
  return dot(r, r);
}

wide triangle_distance2(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
  const wide3 v[3] = {wide3(a), wide3(b), wide3(c)}, q(p);
  const wide3 n = cross(v[1] - v[0], v[2] - v[0]);
  const wide n2 = dot(n, n);
  bool above = n2 > 0;
  wide best = -1;
  for (int k = 0; k < 3; ++k) {
    const wide3 e = v[(k + 1) % 3] - v[k];
    const wide d = segment_distance2(q - v[k], e);
    if (best < 0 || d < best) best = d;
    above = above && dot(cross(n, e), q - v[k]) >= 0;
  }
  if (!above) return best;
  const wide height = dot(n, q - v[0]);
  return std::min(best, height * height / n2);
}

}  // namespace

double exact_distance(const stress_mesh& m, std::size_t t, const dvec3& p) {
  return static_cast<double>(
      wide_root(triangle_distance2(p, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2))));
}

double exact_distance(const stress_mesh& m, const dvec3& p) {
  wide best2 = -1;
  double best = stress_inf;
  for (std::size_t t = 0; t < m.triangles.size(); ++t) {
    if (!usable(m, t)) continue;
    // leaves out what is certainly farther: the ball around the triangle is
    const dvec3 a = m.corner(t, 0) - p, b = m.corner(t, 1) - p, c = m.corner(t, 2) - p;
    const dvec3 center = (a + b + c) / 3.0;
    const double radius =
        std::max({glm::distance(center, a), glm::distance(center, b), glm::distance(center, c)});
    if (glm::length(center) * (1 - 1e-9) - radius * (1 + 1e-9) > best) continue;
    const wide d = triangle_distance2(p, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2));
    if (!(best2 < 0) && !(d < best2)) continue;
    best2 = d;
    best = static_cast<double>(wide_root(d));
  }
  return best;
}

double exact_winding(const stress_mesh& m, const dvec3& p) {
  using real = long double;
  using real3 = glm::vec<3, real>;
  real sum = 0;
  for (std::size_t t = 0; t < m.triangles.size(); ++t) {
    if (!usable(m, t)) continue;
    const real3 a = real3(m.corner(t, 0)) - real3(p), b = real3(m.corner(t, 1)) - real3(p),
                c = real3(m.corner(t, 2)) - real3(p);
    const real la = std::sqrt(glm::dot(a, a)), lb = std::sqrt(glm::dot(b, b)),
               lc = std::sqrt(glm::dot(c, c));
    sum += 2 * std::atan2(
                   glm::dot(a, glm::cross(b - a, c - a)),
                   la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return static_cast<double>(sum / (4 * std::acos(real(-1))));
}

int crossing_sum(const stress_mesh& m, const dvec3& p, const dvec3& direction) {
  using real3 = glm::vec<3, long double>;
  const real3 v(direction);
  int sum = 0;
  for (std::size_t t = 0; t < m.triangles.size(); ++t) {
    if (!usable(m, t)) continue;
    const real3 a = real3(m.corner(t, 0)) - real3(p), b = real3(m.corner(t, 1)) - real3(p),
                c = real3(m.corner(t, 2)) - real3(p);
    // the ray's line passes all edges on one side
    const auto ab = glm::dot(v, glm::cross(a, b)), bc = glm::dot(v, glm::cross(b, c)),
               ca = glm::dot(v, glm::cross(c, a));
    const bool left = ab > 0 && bc > 0 && ca > 0, right = ab < 0 && bc < 0 && ca < 0;
    if (!left && !right) continue;
    const real3 n = glm::cross(b - a, c - a);
    const auto height = glm::dot(n, a), slope = glm::dot(n, v);
    if ((height > 0) == (slope > 0)) sum += slope > 0 ? 1 : -1;
  }
  return sum;
}

double exact_ellipsoid(const dvec3& radii, const dvec3& p) {
  // The closest point is x_i = r_i^2 p_i / (s + r_i^2 - m) with m the least r_i^2 and
  // s > 0 the root of sum (x_i / r_i)^2 = 1, which falls with s.
  const double least = std::min({radii.x, radii.y, radii.z});
  const wide m = wide(least) * wide(least);
  wide top = 0, inside = -1;
  for (int i = 0; i < 3; ++i) {
    const wide q = wide(p[i]) / wide(radii[i]);
    inside += q * q;
    top += wide(radii[i]) * wide(std::abs(p[i]));  // the root is no larger
  }
  const auto over = [&](wide s) {
    wide sum = -1;
    for (int i = 0; i < 3; ++i) {
      const wide r = radii[i], x = r * wide(p[i]) / (s + (r * r - m));
      sum += x * x;
    }
    return sum > 0;
  };
  // by magnitudes first, as s may be tiny beside the radii
  for (int i = 0; i < 4000 && top > 0 && !over(top / 2); ++i) top /= 2;
  wide low = top / 2;
  for (int i = 0; i < 120; ++i) {
    const wide middle = (low + top) / 2;
    (over(middle) ? low : top) = middle;
  }
  wide d2 = 0;
  for (int i = 0; i < 3; ++i) {
    const wide r2 = wide(radii[i]) * wide(radii[i]), e = wide(p[i]) * (low - m) / (low + (r2 - m));
    d2 += e * e;
  }
  const double d = static_cast<double>(wide_root(d2));
  return inside < 0 ? -d : d;
}
