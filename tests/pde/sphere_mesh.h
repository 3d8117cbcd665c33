#pragma once

#include <vector>

#include "wisp/geometry/bvh.h"
#include "wisp/pde/domain.h"

namespace wisp::test {

// An octahedron refined to a ball of the given radius; vertices lie on it.
struct triangles {
  std::vector<dvec3> positions = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                  {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  std::vector<ivec3> indices = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
};
inline triangles make_sphere(int times, double radius, const dvec3& center = {0, 0, 0}) {
  triangles t;
  const auto at = [&](int i) { return t.positions[static_cast<std::size_t>(i)]; };
  for (int i = 0; i < times; ++i) {
    std::vector<ivec3> finer;
    for (const ivec3& f : t.indices) {
      const int n = static_cast<int>(t.positions.size());
      for (int k = 0; k < 3; ++k) {
        t.positions.push_back(glm::normalize(at(f[k]) + at(f[(k + 1) % 3])));
      }
      finer.push_back({f[0], n, n + 2});
      finer.push_back({n, f[1], n + 1});
      finer.push_back({n + 2, n + 1, f[2]});
      finer.push_back({n, n + 1, n + 2});
    }
    t.indices = finer;
  }
  for (dvec3& p : t.positions) p = center + radius * p;
  return t;
}
inline pde_domain domain_of(const triangles& t, domain_side side = domain_side::interior) {
  return pde_domain(mesh_solid(make_bvh(t.indices, t.positions)), side);
}

}  // namespace wisp::test
