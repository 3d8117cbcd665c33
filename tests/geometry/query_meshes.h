#pragma once

// Meshes that the tests of closest points and winding numbers make themselves, points
// to ask about, and closest points by looking at all elements.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "wisp/core/math.h"
#include "wisp/geometry/closest_point.h"

namespace wisp_test {

using wisp::dvec3;
using wisp::ivec2;
using wisp::ivec3;

struct tri_mesh {
  std::vector<ivec3> triangles = {};
  std::vector<dvec3> positions = {};
  std::array<dvec3, 3> corners(std::size_t t) const {
    const ivec3& v = triangles[t];
    return {positions[static_cast<std::size_t>(v.x)], positions[static_cast<std::size_t>(v.y)],
            positions[static_cast<std::size_t>(v.z)]};
  }
};

// The same numbers everywhere, which the distributions of <random> are not.
struct random_numbers {
  std::mt19937_64 engine;
  explicit random_numbers(uint64_t seed) : engine(seed) {}
  double operator()() { return static_cast<double>(engine() >> 11) * 0x1p-53; }
  double operator()(double low, double high) { return low + (high - low) * (*this)(); }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(engine() % n); }
  dvec3 in_cube(double low = -1, double high = 1) {
    const double x = (*this)(low, high), y = (*this)(low, high), z = (*this)(low, high);
    return {x, y, z};
  }
  dvec3 direction() {
    for (;;) {
      const dvec3 d = in_cube();
      const double l = glm::length(d);
      if (l > 0.1 && l < 1) return d / l;
    }
  }
};

// A closed ball of 8 * 4^levels triangles, with vertices on the axes.
inline tri_mesh ball(int levels) {
  tri_mesh m;
  m.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  m.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                 {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [at, fresh] = middles.try_emplace({std::min(a, b), std::max(a, b)},
                                                   static_cast<int>(m.positions.size()));
      if (fresh) {
        m.positions.push_back(glm::normalize(m.positions[static_cast<std::size_t>(a)] +
                                             m.positions[static_cast<std::size_t>(b)]));
      }
      return at->second;
    };
    std::vector<ivec3> finer;
    for (const ivec3& f : m.triangles) {
      const int ab = middle(f.x, f.y), bc = middle(f.y, f.z), ca = middle(f.z, f.x);
      finer.insert(finer.end(), {{f.x, ab, ca}, {f.y, bc, ab}, {f.z, ca, bc}, {ab, bc, ca}});
    }
    m.triangles = std::move(finer);
  }
  return m;
}

// A ball with bumps: closed, smooth, not symmetric.
inline tri_mesh bumpy_body(int levels) {
  tri_mesh m = ball(levels);
  for (dvec3& p : m.positions) {
    p *= 1 + 0.15 * std::sin(7 * p.x + 1) * std::cos(5 * p.y) + 0.2 * p.z * std::sin(3 * p.x);
  }
  return m;
}

inline tri_mesh ring(int around, int across, double tube = 0.3) {
  tri_mesh m;
  constexpr double turn = 6.283185307179586477;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double a = turn * i / around, b = turn * j / across;
      const double r = 1 + tube * std::cos(b);
      m.positions.push_back({r * std::cos(a), r * std::sin(a), tube * std::sin(b)});
    }
  }
  const auto at = [&](int i, int j) { return (i % around) * across + j % across; };
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      m.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      m.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return m;
}

// Cells of a lattice, full or empty; outside all are empty.
struct voxels {
  int size = 0;
  std::vector<bool> full = {};
  explicit voxels(int n, bool value = false)
      : size(n), full(static_cast<std::size_t>(n * n * n), value) {}
  std::size_t index(const ivec3& c) const {
    return static_cast<std::size_t>((c.z * size + c.y) * size + c.x);
  }
  bool at(const ivec3& c) const {
    for (int a = 0; a < 3; ++a) {
      if (c[a] < 0 || c[a] >= size) return false;
    }
    return full[index(c)];
  }
};

// The surface between full and empty cells, counter-clockwise outside: two triangles to
// a face, over shared vertices at whole coordinates. Diagonals alternate.
inline tri_mesh voxel_surface(const voxels& v) {
  tri_mesh m;
  std::map<std::array<int, 3>, int> ids;
  const auto id = [&](const ivec3& c) {
    const auto [at, fresh] = ids.try_emplace({c.x, c.y, c.z}, static_cast<int>(m.positions.size()));
    if (fresh) m.positions.push_back(dvec3(c));
    return at->second;
  };
  for (int i = 0; i < v.size * v.size * v.size; ++i) {
    const ivec3 c = {i % v.size, i / v.size % v.size, i / v.size / v.size};
    if (!v.at(c)) continue;
    for (int a = 0; a < 3; ++a) {
      for (int side = 0; side < 2; ++side) {
        ivec3 other = c, u = {0, 0, 0}, w = {0, 0, 0}, base = c;
        other[a] += side == 1 ? 1 : -1;
        if (v.at(other)) continue;
        u[(a + 1) % 3] = 1;
        w[(a + 2) % 3] = 1;
        base[a] += side;
        if (side == 0) std::swap(u, w);
        const int q[4] = {id(base), id(base + u), id(base + u + w), id(base + w)};
        const int k = (c.x + c.y + c.z) % 2;
        m.triangles.push_back({q[k], q[k + 1], q[k + 2]});
        m.triangles.push_back({q[k], q[k + 2], q[(k + 3) % 4]});
      }
    }
  }
  return m;
}

inline tri_mesh box_grid(int n) { return voxel_surface(voxels(n, true)); }

inline tri_mesh random_soup(std::size_t n, double size, uint64_t seed) {
  random_numbers random(seed);
  tri_mesh m;
  for (std::size_t i = 0; i < n; ++i) {
    const dvec3 c = random.in_cube();
    const int v = static_cast<int>(m.positions.size());
    for (int k = 0; k < 3; ++k) m.positions.push_back(c + size * random.in_cube());
    m.triangles.push_back({v, v + 1, v + 2});
  }
  return m;
}

// Needles (a short edge) and caps (a vertex close to the longest edge) of aspects from
// 10^2 to 10^12.
inline tri_mesh slivers(std::size_t n, uint64_t seed) {
  random_numbers random(seed);
  tri_mesh m;
  for (std::size_t i = 0; i < n; ++i) {
    const double thin = std::pow(10.0, -random(2, 12)), length = random(0.05, 1);
    const dvec3 a = random.in_cube(), d = random.direction() * length;
    const dvec3 across = glm::normalize(glm::cross(d, random.direction())) * (thin * length);
    const double along = i % 2 == 0 ? 1 : random(0.1, 0.9);
    std::array<dvec3, 3> v = {a, a + d, a + along * d + across};
    std::rotate(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(i % 3), v.end());
    const int first = static_cast<int>(m.positions.size());
    m.positions.insert(m.positions.end(), v.begin(), v.end());
    m.triangles.push_back({first, first + 1, first + 2});
  }
  return m;
}

inline tri_mesh joined(const tri_mesh& a, const tri_mesh& b) {
  tri_mesh m = a;
  const int base = static_cast<int>(a.positions.size());
  m.positions.insert(m.positions.end(), b.positions.begin(), b.positions.end());
  for (const ivec3& t : b.triangles) m.triangles.push_back(t + base);
  return m;
}
inline tri_mesh flipped(tri_mesh m) {
  for (ivec3& t : m.triangles) std::swap(t.y, t.z);
  return m;
}
inline tri_mesh moved(tri_mesh m, double scale, const dvec3& offset = {0, 0, 0}) {
  for (dvec3& p : m.positions) p = p * scale + offset;
  return m;
}
// Each triangle with vertices of its own; zeros get a random sign.
inline tri_mesh unwelded(const tri_mesh& m, uint64_t seed = 1) {
  random_numbers random(seed);
  tri_mesh result;
  for (std::size_t t = 0; t < m.triangles.size(); ++t) {
    const int v = static_cast<int>(result.positions.size());
    for (dvec3 p : m.corners(t)) {
      for (int a = 0; a < 3; ++a) {
        if (p[a] == 0) p[a] = random() < 0.5 ? -0.0 : 0.0;
      }
      result.positions.push_back(p);
    }
    result.triangles.push_back({v, v + 1, v + 2});
  }
  return result;
}
// Without each triangle for which drop(index) holds.
template <typename Drop>
tri_mesh without(const tri_mesh& m, const Drop& drop) {
  tri_mesh result = m;
  result.triangles.clear();
  for (std::size_t t = 0; t < m.triangles.size(); ++t) {
    if (!drop(t)) result.triangles.push_back(m.triangles[t]);
  }
  return result;
}

inline bool all_finite(const dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

struct bounding_box {
  dvec3 min = {0, 0, 0}, max = {0, 0, 0};
  dvec3 center() const { return min / 2.0 + max / 2.0; }
  double size() const {
    const dvec3 d = max - min;
    return std::max({d.x, d.y, d.z});
  }
};
inline bounding_box box_of(const std::vector<dvec3>& positions) {
  bounding_box b;
  bool any = false;
  for (const dvec3& p : positions) {
    if (!all_finite(p)) continue;
    b.min = any ? glm::min(b.min, p) : p;
    b.max = any ? glm::max(b.max, p) : p;
    any = true;
  }
  return b;
}

// Points in and around the box, on and near vertices, edges and faces, and far away.
inline std::vector<dvec3> points_around(const tri_mesh& m, std::size_t n, uint64_t seed) {
  random_numbers random(seed);
  const bounding_box box = box_of(m.positions);
  const double size = box.size() > 0 ? box.size() : 1;
  std::vector<dvec3> points;
  while (points.size() < n) {
    const std::size_t kind = points.size() % 16;
    if (kind < 5 || m.triangles.empty()) {
      points.push_back(box.center() + 0.6 * size * random.in_cube());
      continue;
    }
    if (kind < 7) {
      constexpr double how_far[] = {10, 1e3, 1e6, 1e12, 3, 7, 9};
      const double far = how_far[random.below(7)];
      points.push_back(box.center() + size * far * random.direction());
      continue;
    }
    const auto v = m.corners(random.below(m.triangles.size()));
    double s = random(), t = random() * (1 - s);
    if (kind == 7) s = t = 0;
    if (kind == 8) t = 0;
    if (kind == 9) s = t = 0.5;
    dvec3 p = v[0] + s * (v[1] - v[0]) + t * (v[2] - v[0]);
    if (kind > 10) {
      const double off = std::pow(10.0, -random(0, 12));
      p += random.direction() * (size * off);
    }
    points.push_back(all_finite(p) ? p : box.center());
  }
  return points;
}

struct brute_point {
  double distance = std::numeric_limits<double>::infinity();
  int element = -1;  // the first of the closest
  wisp::element_point at = {};
};

// count elements, corner(i, k) their vertices, one to three of them. All is scaled by
// one power of two, so that no square is lost.
template <typename Corner>
brute_point brute_force(std::size_t count, int vertices, const Corner& corner, const dvec3& p) {
  double largest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = 0; k < vertices; ++k) {
      const dvec3 v = glm::abs(corner(i, k));
      if (all_finite(v)) largest = std::max({largest, v.x, v.y, v.z});
    }
  }
  const int e = std::clamp(150 - (largest > 0 ? std::ilogb(largest) : 0), -1000, 1000);
  const double scale = std::ldexp(1.0, e), back = std::ldexp(1.0, -e);
  const dvec3 x = p * scale;
  double least = std::numeric_limits<double>::infinity();
  brute_point best;
  for (std::size_t i = 0; i < count; ++i) {
    const dvec3 a = corner(i, 0), b = corner(i, std::min(1, vertices - 1)),
                c = corner(i, vertices - 1);
    if (!all_finite(a) || !all_finite(b) || !all_finite(c)) continue;
    const wisp::element_point at =
        vertices == 3 ? wisp::closest_point_on_triangle(x, a * scale, b * scale, c * scale)
                      : wisp::closest_point_on_segment(x, a * scale, b * scale);
    // squares decide, of which several may have one root
    const dvec3 v0 = a * scale, v1 = b * scale, v2 = c * scale;
    const dvec3 r = at.feature == wisp::mesh_feature::vertex
                        ? x - at.point
                        : x - v0 - at.uv.x * (v1 - v0) - at.uv.y * (v2 - v0);
    const double d2 = glm::dot(r, r);
    if (d2 < least) {
      least = d2;
      best = {std::sqrt(d2) * back, static_cast<int>(i), at};
      best.at.point *= back;
    }
  }
  return best;
}

inline brute_point brute_force(const tri_mesh& m, const dvec3& p) {
  return brute_force(
      m.triangles.size(), 3,
      [&](std::size_t i, int k) {
        return m.positions[static_cast<std::size_t>(m.triangles[i][k])];
      },
      p);
}

}  // namespace wisp_test
