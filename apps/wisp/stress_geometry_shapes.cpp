#include "stress_geometry_shapes.h"

#include <algorithm>
#include <map>
#include <utility>

using namespace wisp;

void add_triangle(stress_mesh& m, const dvec3& a, const dvec3& b, const dvec3& c) {
  const int n = static_cast<int>(m.positions.size());
  m.positions.insert(m.positions.end(), {a, b, c});
  m.triangles.push_back({n, n + 1, n + 2});
}

stress_mesh joined(stress_mesh a, const stress_mesh& b) {
  const int n = static_cast<int>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const ivec3& t : b.triangles) a.triangles.push_back(t + ivec3{n});
  return a;
}

stress_mesh moved(stress_mesh m, double scale, const dvec3& offset) {
  for (dvec3& p : m.positions) p = p * scale + offset;
  return m;
}

stress_mesh inside_out(stress_mesh m) {
  for (ivec3& t : m.triangles) std::swap(t.y, t.z);
  return m;
}

stress_mesh subdivided(const stress_mesh& m) {
  stress_mesh s{m.positions, {}};
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [at, added] =
        middles.try_emplace(std::minmax(a, b), static_cast<int>(s.positions.size()));
    if (added) {
      s.positions.push_back(
          (m.positions[static_cast<std::size_t>(a)] + m.positions[static_cast<std::size_t>(b)]) /
          2.0);
    }
    return at->second;
  };
  for (const ivec3& t : m.triangles) {
    const int ab = middle(t.x, t.y), bc = middle(t.y, t.z), ca = middle(t.z, t.x);
    s.triangles.insert(s.triangles.end(),
                       {{t.x, ab, ca}, {ab, t.y, bc}, {ca, bc, t.z}, {ab, bc, ca}});
  }
  return s;
}

stress_mesh cube_mesh(int levels) {
  stress_mesh m;
  for (int i = 0; i < 8; ++i) {
    m.positions.push_back(
        {(i & 1) != 0 ? 1.0 : -1.0, (i & 2) != 0 ? 1.0 : -1.0, (i & 4) != 0 ? 1.0 : -1.0});
  }
  for (const ivec4& q : {ivec4{0, 2, 3, 1}, ivec4{4, 5, 7, 6}, ivec4{0, 1, 5, 4}, ivec4{2, 6, 7, 3},
                         ivec4{0, 4, 6, 2}, ivec4{1, 3, 7, 5}}) {
    m.triangles.insert(m.triangles.end(), {{q.x, q.y, q.z}, {q.x, q.z, q.w}});
  }
  for (int i = 0; i < levels; ++i) m = subdivided(m);
  return m;
}

stress_mesh ball_mesh(int levels) {
  stress_mesh m{
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
      {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  for (int i = 0; i < levels; ++i) {
    m = subdivided(m);
    for (dvec3& p : m.positions) p = glm::normalize(p);
  }
  return m;
}

stress_mesh bumpy_mesh(int levels) {
  stress_mesh m = ball_mesh(levels);
  for (dvec3& p : m.positions) {
    double r = 1;
    for (const double f : {2.0, 5.0, 13.0}) {
      r += 0.4 / f * std::sin(f * p.x + 1) * std::cos(f * p.y) * std::sin(f * p.z + f);
    }
    p *= 0.8 * r;
  }
  return m;
}

stress_mesh dome_mesh(int n) {
  stress_mesh m;
  const int rings = n / 4;
  for (int i = 0; i < rings; ++i) {
    const double up = 0.5 * stress_pi * i / rings;
    for (int j = 0; j < n; ++j) {
      const double around = 2 * stress_pi * j / n;
      m.positions.push_back({std::cos(up) * std::cos(around), std::cos(up) * std::sin(around),
                             i == 0 ? 0 : std::sin(up)});
    }
  }
  m.positions.push_back({0, 0, 1});
  for (int j = 0; j < n; ++j) {
    const int next = (j + 1) % n;
    for (int i = 0; i + 1 < rings; ++i) {
      const int a = i * n + j, b = i * n + next;
      m.triangles.insert(m.triangles.end(), {{a, b, b + n}, {a, b + n, a + n}});
    }
    m.triangles.push_back({(rings - 1) * n + j, (rings - 1) * n + next, rings * n});
  }
  return m;
}

stress_mesh sliver_mesh(int n, double aspect) {
  stress_mesh m;
  rng_state rng = shape_rng(1);
  for (int i = 0; i < n; ++i) {
    const dvec3 a = random_in_cube(rng, 1), b = a + random_direction(rng) * uniform(rng, 0.2, 2);
    const dvec3 out = glm::normalize(glm::cross(b - a, random_direction(rng)));
    const dvec3 c = a + (b - a) * (i % 2 == 0 ? 0.0 : rand1d(rng)) + out / aspect;
    const dvec3 v[3] = {a, b, c};
    add_triangle(m, v[i % 3], v[(i + 1) % 3], v[(i + 2) % 3]);
  }
  return m;
}

stress_mesh soup_mesh(int n, double edge) {
  stress_mesh m;
  rng_state rng = shape_rng(2);
  for (int i = 0; i < n; ++i) {
    const dvec3 c = random_in_cube(rng, 1), u = random_in_cube(rng, edge);
    add_triangle(m, c, c + u, c + random_in_cube(rng, edge));
  }
  return m;
}

dvec3 point_on(const stress_mesh& m, std::size_t t, int kind, rng_state& rng) {
  const int k = static_cast<int>(rand_index(rng, 3));
  const dvec3 &a = m.corner(t, k), &b = m.corner(t, (k + 1) % 3), &c = m.corner(t, (k + 2) % 3);
  if (kind == 2) return a;
  double u = rand1d(rng), v = rand1d(rng);
  if (kind == 1) return a + u * (b - a);
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  return a + u * (b - a) + v * (c - a);
}

dvec3 point_about(const stress_mesh& m, std::size_t i, rng_state& rng) {
  dvec3 low{stress_inf}, high{-stress_inf};
  for (const dvec3& p : m.positions) {
    if (!std::isfinite(p.x + p.y + p.z)) continue;
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const dvec3 center = low / 2.0 + high / 2.0, sides = high / 2.0 - low / 2.0;
  const double half = std::max({sides.x, sides.y, sides.z});
  if (i % 6 < 2) return center + random_in_cube(rng, i % 6 == 0 ? half : 3 * half);
  dvec3 on{stress_nan};
  while (!std::isfinite(on.x + on.y + on.z)) {
    const uint32_t count = static_cast<uint32_t>(m.triangles.size());
    on = point_on(m, rand_index(rng, count), static_cast<int>(i / 6 % 3), rng);
  }
  if (i % 6 == 5) return on;
  return on + random_direction(rng) * (half * magnitude(rng, -12, -1));
}
