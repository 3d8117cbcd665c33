#pragma once

// Meshes for the tests of geometry: smooth ones, boxes, soups, and all that is
// awkward.

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "wisp/core/math.h"
#include "wisp/core/rng.h"

namespace wisp::test {

struct mesh {
  const char* name = "";
  std::vector<ivec3> triangles = {};
  std::vector<dvec3> positions = {};
  // What distances of the thinnest slivers lose in double, whose normals are noise.
  double noise = 0;
};

inline double uniform(rng_state& rng, double low, double high) {
  return low + (high - low) * rand1d(rng);
}
inline dvec3 random_in_cube(rng_state& rng, double half) {
  const double x = uniform(rng, -half, half), y = uniform(rng, -half, half);
  return {x, y, uniform(rng, -half, half)};
}
inline dvec3 random_direction(rng_state& rng) {
  const double z = uniform(rng, -1, 1), phi = uniform(rng, 0, 2 * static_cast<double>(pi));
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

inline void add_triangle(mesh& m, const dvec3& a, const dvec3& b, const dvec3& c) {
  const int n = static_cast<int>(m.positions.size());
  for (const dvec3& v : {a, b, c}) m.positions.push_back(v);
  m.triangles.push_back({n, n + 1, n + 2});
}
// Appends b to a.
inline mesh joined(mesh a, const mesh& b) {
  const int n = static_cast<int>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const ivec3& t : b.triangles) a.triangles.push_back(t + ivec3{n});
  return a;
}
inline mesh transformed(mesh m, double scale, const dvec3& offset = {0, 0, 0}) {
  for (dvec3& p : m.positions) p = p * scale + offset;
  return m;
}

// A closed grid of m by n quads over u and v, both periodic, with `at` in [0, 1)^2.
template <typename At>
mesh periodic_grid(const char* name, int m, int n, const At& at) {
  mesh g{.name = name};
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < n; ++j) g.positions.push_back(at(double(i) / m, double(j) / n));
  }
  const auto id = [&](int i, int j) { return (i % m) * n + j % n; };
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < n; ++j) {
      g.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      g.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  }
  return g;
}
inline mesh torus(int m, int n, double major = 0.7, double minor = 0.3) {
  return periodic_grid("torus", m, n, [&](double u, double v) {
    const double a = u * 2 * static_cast<double>(pi), b = v * 2 * static_cast<double>(pi);
    const double r = major + minor * std::cos(b);
    return dvec3{r * std::cos(a), r * std::sin(a), minor * std::sin(b)};
  });
}

// Parts each triangle in four; edges share their new vertex.
inline mesh subdivided(const mesh& m) {
  mesh s{.name = m.name, .positions = m.positions};
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [at, added] =
        middles.try_emplace(std::minmax(a, b), static_cast<int>(s.positions.size()));
    if (added) {
      const dvec3 &p = m.positions[std::size_t(a)], &q = m.positions[std::size_t(b)];
      s.positions.push_back((p + q) / 2.0);
    }
    return at->second;
  };
  for (const ivec3& t : m.triangles) {
    const int ab = middle(t.x, t.y), bc = middle(t.y, t.z), ca = middle(t.z, t.x);
    for (const ivec3& f :
         {ivec3{t.x, ab, ca}, ivec3{ab, t.y, bc}, ivec3{ca, bc, t.z}, ivec3{ab, bc, ca}}) {
      s.triangles.push_back(f);
    }
  }
  return s;
}

// The cube [-1, 1]^3, twelve triangles, subdivided: coordinates are exact, so that
// many elements are equally far.
inline mesh cube(int levels) {
  mesh m{.name = "cube"};
  for (int i = 0; i < 8; ++i) {
    m.positions.push_back(
        {(i & 1) != 0 ? 1.0 : -1.0, (i & 2) != 0 ? 1.0 : -1.0, (i & 4) != 0 ? 1.0 : -1.0});
  }
  for (const ivec4& q : {ivec4{0, 2, 3, 1}, ivec4{4, 5, 7, 6}, ivec4{0, 1, 5, 4}, ivec4{2, 6, 7, 3},
                         ivec4{0, 4, 6, 2}, ivec4{1, 3, 7, 5}}) {
    m.triangles.push_back({q.x, q.y, q.z});
    m.triangles.push_back({q.x, q.z, q.w});
  }
  for (int i = 0; i < levels; ++i) m = subdivided(m);
  return m;
}
// A ball of 8 * 4^levels triangles.
inline mesh sphere(int levels) {
  mesh m{
      .name = "sphere",
      .triangles =
          {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}},
      .positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  for (int i = 0; i < levels; ++i) {
    m = subdivided(m);
    for (dvec3& p : m.positions) p = glm::normalize(p);
  }
  return m;
}
// A ball with bumps of many sizes.
inline mesh bumpy(int levels) {
  mesh m = sphere(levels);
  m.name = "bumpy";
  for (dvec3& p : m.positions) {
    double r = 1;
    for (const double f : {2.0, 5.0, 13.0}) {
      r += 0.4 / f * std::sin(f * p.x + 1) * std::cos(f * p.y) * std::sin(f * p.z + f);
    }
    p *= r * 0.8;
  }
  return m;
}

// n triangles anywhere, with sides of about `edge`.
inline mesh soup(int n, double edge, uint64_t seed = 1) {
  mesh m{.name = "soup"};
  rng_state rng = make_rng(seed, 7);
  for (int i = 0; i < n; ++i) {
    const dvec3 c = random_in_cube(rng, 1), u = random_in_cube(rng, edge);
    const dvec3 v = random_in_cube(rng, edge);
    add_triangle(m, c, c + u, c + v);
  }
  return m;
}
// Triangles of length about 1 and a height of 1 / aspect: needles with a short edge,
// and caps, whose vertex is close to the longest edge.
inline mesh slivers(int n, double aspect, uint64_t seed = 1) {
  mesh m{.name = "slivers", .noise = aspect > 1e8 ? 5e-12 : 0};
  rng_state rng = make_rng(seed, 8);
  for (int i = 0; i < n; ++i) {
    const dvec3 a = random_in_cube(rng, 1), b = a + random_direction(rng) * uniform(rng, 0.2, 2);
    const dvec3 out = glm::normalize(glm::cross(b - a, random_direction(rng)));
    const dvec3 c = a + (b - a) * (i % 2 == 0 ? 0.0 : rand1d(rng)) + out / aspect;
    const std::array<dvec3, 3> v = {a, b, c};
    const auto k = static_cast<std::size_t>(i % 3);
    add_triangle(m, v[k], v[(k + 1) % 3], v[(k + 2) % 3]);
  }
  return m;
}
// A flat fan and strips that meet at thin angles, all in one plane but for `noise`.
inline mesh thin_fan(int n, double noise) {
  mesh m{.name = "thin fan", .positions = {{0, 0, 0}}};
  rng_state rng = make_rng(3, 9);
  for (int i = 0; i <= n; ++i) {
    const double a = 1e-3 * i;
    m.positions.push_back(dvec3{std::cos(a), std::sin(a), 0} + random_in_cube(rng, noise));
    if (i > 0) m.triangles.push_back({0, i, i + 1});
  }
  return m;
}
// Triangles whose sizes and distances from the origin fall by `ratio`.
inline mesh exponential(int n, double ratio) {
  mesh m{.name = "exponential"};
  rng_state rng = make_rng(4, 10);
  double size = 1;
  for (int i = 0; i < n; ++i, size *= ratio) {
    const dvec3 a = dvec3{size, 0.3 * size, 0.1 * size};
    const dvec3 b = a + random_in_cube(rng, size / 4);
    add_triangle(m, a, b, a + random_in_cube(rng, size / 4));
  }
  return m;
}
// Triangles without area, once each kind, and a proper one.
inline mesh degenerate() {
  mesh m{.name = "degenerate"};
  const dvec3 a{-1, 0, 0}, b{1, 0.5, 0}, c{0, 0.25, 0};
  add_triangle(m, a, a, a);
  add_triangle(m, a, b, b);
  add_triangle(m, a, a, b);
  add_triangle(m, a, b, a);
  add_triangle(m, a, b, c);
  add_triangle(m, c, a, b);
  add_triangle(m, b, c, a);
  add_triangle(m, a, b, {0, -1, 1});
  add_triangle(m, b * 3.0, b * 5.0, b * 7.0);
  return m;
}
// Each triangle `times` times, at indices far apart.
inline mesh repeated(const mesh& m, int times) {
  mesh r{.name = "repeated", .positions = m.positions};
  for (int i = 0; i < times; ++i) {
    r.triangles.insert(r.triangles.end(), m.triangles.begin(), m.triangles.end());
  }
  return r;
}

// Meshes with something awkward each.
inline std::vector<mesh> awkward_meshes() {
  std::vector<mesh> all = {torus(12, 8),
                           cube(2),
                           bumpy(2),
                           soup(150, 0.3),
                           soup(150, 2),
                           soup(200, 0.01),
                           slivers(60, 1e2),
                           slivers(60, 1e4),
                           slivers(60, 1e6),
                           slivers(60, 1e8),
                           slivers(60, 1e12),
                           thin_fan(100, 0),
                           thin_fan(100, 1e-9),
                           exponential(60, 0.5),
                           exponential(200, 0.8),
                           degenerate(),
                           repeated(degenerate(), 10),
                           repeated(soup(1, 1), 100),
                           repeated(cube(0), 9)};
  for (const int n : {1, 2, 7, 8, 9, 64, 65}) all.push_back(soup(n, 0.2, uint64_t(n)));
  // one vertex far away from all others
  mesh far = soup(80, 0.3);
  far.name = "far vertex";
  far.positions[5] = {1e6, 3e5, -2e6};
  all.push_back(far);
  // sheets that nearly coincide
  mesh sheets = {.name = "sheets"};
  for (int i = 0; i < 5; ++i) {
    sheets = joined(sheets, transformed(subdivided(cube(0)), 1 + i * 1e-7));
  }
  all.push_back(sheets);
  mesh flat = cube(2);
  flat.name = "flat";
  for (dvec3& p : flat.positions) p.z = 0;
  all.push_back(flat);
  mesh line = cube(1);
  line.name = "line";
  for (dvec3& p : line.positions) p = dvec3{p.x, 2 * p.x, -p.x};
  all.push_back(line);
  mesh one_point = soup(40, 0);
  one_point.name = "one point";
  for (dvec3& p : one_point.positions) p = {0.3, 0.4, 0.5};
  all.push_back(one_point);
  mesh broken = soup(60, 0.5);
  broken.name = "broken";
  broken.positions[4].x = std::numeric_limits<double>::quiet_NaN();
  broken.positions[33].y = std::numeric_limits<double>::infinity();
  broken.positions[90].z = -std::numeric_limits<double>::infinity();
  all.push_back(broken);
  return all;
}

}  // namespace wisp::test
