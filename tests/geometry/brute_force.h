#pragma once

// Closest points found the slow way, to hold the tree to.

#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "make_meshes.h"
#include "wisp/geometry/closest_point.h"

namespace wisp::test {

struct wide3 {
  long double x = 0, y = 0, z = 0;
  wide3() = default;
  wide3(long double a, long double b, long double c) : x(a), y(b), z(c) {}
  explicit wide3(const dvec3& v) : x(v.x), y(v.y), z(v.z) {}
  friend wide3 operator-(const wide3& a, const wide3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend wide3 operator+(const wide3& a, const wide3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend wide3 operator*(long double s, const wide3& a) { return {s * a.x, s * a.y, s * a.z}; }
  friend long double dot(const wide3& a, const wide3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
  }
};

// The distance from q to the segment from 0 to e, all relative to one vertex.
inline long double wide_segment_distance2(const wide3& q, const wide3& e) {
  const long double e2 = dot(e, e);
  wide3 r = q;
  // twice: the second step takes away what the first one lost by rounding
  long double t = 0;
  for (int i = 0; i < 2 && e2 > 0; ++i) {
    t = std::clamp(t + dot(r, e) / e2, 0.0L, 1.0L);
    r = q - t * e;
  }
  return dot(r, r);
}

// The distance of p to the triangle a b c, by coordinates along and across its
// longest edge, in extended precision and with a step of refinement, so that
// slivers are right. Coordinates must lie in 1e-500 to 1e500.
inline double wide_distance(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
  const wide3 v[3] = {wide3(a), wide3(b), wide3(c)};
  int k = 0;  // opposite of the longest edge
  long double longest = -1;
  for (int i = 0; i < 3; ++i) {
    const wide3 e = v[(i + 2) % 3] - v[(i + 1) % 3];
    if (dot(e, e) > longest) {
      longest = dot(e, e);
      k = i;
    }
  }
  const wide3 o = v[(k + 1) % 3], base = v[(k + 2) % 3] - o, side = v[k] - o, q = wide3(p) - o;
  long double best = std::min(wide_segment_distance2(q, base), wide_segment_distance2(q, side));
  best = std::min(best, wide_segment_distance2(wide3(p) - v[k], v[(k + 2) % 3] - v[k]));
  if (!(longest > 0)) return static_cast<double>(std::sqrt(best));
  const long double foot = dot(side, base) / longest;
  wide3 height = side - foot * base;
  height = height - dot(height, base) / longest * base;
  const long double h2 = dot(height, height);
  if (!(h2 > 0)) return static_cast<double>(std::sqrt(best));
  long double x = 0, y = 0;  // q = x base + y side + normal
  wide3 r = q;
  for (int i = 0; i < 3; ++i) {
    const long double dy = dot(r, height) / h2;
    const long double dx = dot(r, base) / longest - dy * foot;
    x += dx;
    y += dy;
    r = q - (x * base + y * side);
  }
  if (x >= 0 && y >= 0 && x + y <= 1) best = std::min(best, dot(r, r));
  return static_cast<double>(std::sqrt(best));
}

// Elements as triples of vertices: of segments the last two are one, of points all.
struct elements {
  bvh_element kind = bvh_element::triangle;
  std::vector<ivec3> vertices = {};
  std::span<const dvec3> positions = {};

  std::array<dvec3, 3> corners(std::size_t i) const {
    const ivec3& t = vertices[i];
    return {positions[std::size_t(t.x)], positions[std::size_t(t.y)], positions[std::size_t(t.z)]};
  }
  bool usable(std::size_t i) const {
    for (const dvec3& v : corners(i)) {
      if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) return false;
    }
    return true;
  }
};
inline elements elements_of(const mesh& m) {
  return {bvh_element::triangle, m.triangles, m.positions};
}

inline element_point closest_on(const elements& e, std::size_t i, const dvec3& p) {
  const auto v = e.corners(i);
  return e.kind == bvh_element::triangle ? closest_point_on_triangle(p, v[0], v[1], v[2])
                                         : closest_point_on_segment(p, v[0], v[1]);
}
// Squared, of differences of vertices, which lose nothing far from the origin.
inline double distance2_to(const elements& e, std::size_t i, const dvec3& p) {
  const auto v = e.corners(i);
  const element_point at = closest_on(e, i, p);
  const dvec3 r = at.feature == mesh_feature::vertex
                      ? p - at.point
                      : p - v[0] - at.uv.x * (v[1] - v[0]) - at.uv.y * (v[2] - v[0]);
  return glm::dot(r, r);
}

struct brute_result {
  double distance2 = std::numeric_limits<double>::infinity();
  int element = -1;  // the first of those that are equally close
  double distance() const { return std::sqrt(distance2); }
};
inline brute_result brute_closest(const elements& e, const dvec3& p) {
  brute_result best;
  for (std::size_t i = 0; i < e.vertices.size(); ++i) {
    if (!e.usable(i)) continue;
    const double d = distance2_to(e, i, p);
    if (best.element < 0 || d < best.distance2) best = {d, static_cast<int>(i)};
  }
  return best;
}
// The distance in extended precision, by other means than the library's.
inline double wide_closest(const elements& e, const dvec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < e.vertices.size(); ++i) {
    if (!e.usable(i)) continue;
    const auto v = e.corners(i);
    best = std::min(best, wide_distance(p, v[0], v[1], v[2]));
  }
  return best;
}

inline double largest(const dvec3& p) {
  return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}
// The greatest coordinate of the element relative to p.
inline double extent(const elements& e, std::size_t i, const dvec3& p) {
  const auto v = e.corners(i);
  return std::max({largest(v[0] - p), largest(v[1] - p), largest(v[2] - p)});
}
// What a coordinate of p, or of what it is close to, may lose by rounding.
inline double rounding(const dvec3& p, const dvec3& q) {
  return 8 * std::numeric_limits<double>::epsilon() * std::max(largest(p), largest(q));
}

// What is wrong with an answer; nullptr when all is right. What is squared must not
// overflow or vanish.
inline const char* whats_wrong(const elements& e, const dvec3& p, const closest_point_result& r) {
  const brute_result b = brute_closest(e, p);
  const double d = b.distance();
  if (b.element < 0) return r || std::isfinite(r.distance) ? "found what is not there" : nullptr;
  if (!r) return "found nothing";
  if (r.element >= static_cast<int>(e.vertices.size())) return "an element that there is not";
  const auto i = static_cast<std::size_t>(r.element);
  const double noise = 8e-16 * std::max(d, extent(e, i, p));
  if (!(std::abs(r.distance - d) <= noise)) return "distance";
  if (r.lower_bound != r.distance) return "lower bound";
  const double own2 = distance2_to(e, i, p);
  if (std::sqrt(own2) > d + noise) return "an element that is farther";
  if (own2 == b.distance2 && r.element > b.element) return "not the first of equals";
  const element_point at = closest_on(e, i, p);
  if (largest(r.at.point - at.point) > rounding(p, at.point)) return "not the element's point";
  if (std::abs(glm::distance(p, r.at.point) - r.distance) > noise + rounding(p, at.point)) {
    return "distance of the point";
  }
  return nullptr;
}

// What of an element_point does not fit together.
inline const char* whats_inconsistent(const element_point& at, const std::array<dvec3, 3>& v,
                                      bvh_element kind) {
  const double x = at.uv.x, y = at.uv.y, w = 1 - x - y;
  if (!(x >= 0 && y >= 0 && w >= -1e-15)) return "uv out of range";
  const dvec3 q = v[0] + x * (v[1] - v[0]) + y * (v[2] - v[0]);
  double noise = 0;
  for (const dvec3& c : v) noise = std::max(noise, rounding(c, at.point));
  if (!(largest(q - at.point) <= noise)) return "uv is another point";
  const int k = at.feature_index;
  const double weights[3] = {w, x, y};
  switch (at.feature) {
    case mesh_feature::face:
      if (kind != bvh_element::triangle) return "a face of no triangle";
      return k == 0 && x > 0 && y > 0 ? nullptr : "face";
    case mesh_feature::edge:
      if (kind == bvh_element::point || k < 0 || k > 2) return "edge index";
      if (kind == bvh_element::segment && (k != 0 || y != 0)) return "edge of a segment";
      return std::abs(weights[(k + 2) % 3]) <= 1e-15 ? nullptr : "edge and uv";
    case mesh_feature::vertex:
      if (k < 0 || k > 2) return "vertex index";
      if (at.point != v[std::size_t(k)]) return "not that vertex";
      return std::abs(weights[k] - 1) <= 1e-15 ? nullptr : "vertex and uv";
  }
  return "no feature";
}

// n points to ask from: in the box, near the surface, on vertices, edges and faces,
// and far away.
inline std::vector<dvec3> query_points(const elements& e, int n, uint64_t seed = 1) {
  std::vector<std::size_t> usable;
  dvec3 low{std::numeric_limits<double>::infinity()}, high = -low;
  for (std::size_t i = 0; i < e.vertices.size(); ++i) {
    if (!e.usable(i)) continue;
    usable.push_back(i);
    for (const dvec3& v : e.corners(i)) {
      low = glm::min(low, v);
      high = glm::max(high, v);
    }
  }
  std::vector<dvec3> points;
  if (usable.empty()) return points;
  const dvec3 center = low / 2.0 + high / 2.0;
  double half = largest(high / 2.0 - low / 2.0);
  if (half == 0) half = largest(center) > 0 ? largest(center) : 1;
  rng_state rng = make_rng(seed, 3);
  for (int i = 0; i < n; ++i) {
    const auto v = e.corners(usable[next_uint(rng) % usable.size()]);
    double a = rand1d(rng), b = rand1d(rng);
    if (a + b > 1) {
      a = 1 - a;
      b = 1 - b;
    }
    const dvec3 on = v[0] * (1 - a - b) + v[1] * a + v[2] * b;
    switch (i % 8) {
      case 0:
        points.push_back(center + random_in_cube(rng, half));
        break;
      case 1: {
        const double off = std::pow(10.0, uniform(rng, -12, -1));
        points.push_back(on + random_direction(rng) * half * off);
        break;
      }
      case 2:
        points.push_back(v[i / 8 % 3]);
        break;
      case 3:
        points.push_back((v[0] + v[1 + i / 8 % 2]) / 2.0);
        break;
      case 4:
        points.push_back(on);
        break;
      case 5:
        points.push_back(center + random_in_cube(rng, 3 * half));
        break;
      case 6: {  // about where single precision ends
        points.push_back(center + random_direction(rng) * half * uniform(rng, 3, 20));
        break;
      }
      default: {
        const double far[4] = {10, 1e3, 1e6, 1e12};
        points.push_back(center + random_direction(rng) * half * far[i / 8 % 4]);
      }
    }
  }
  return points;
}

}  // namespace wisp::test
