// A refined mesh and its closest points, without a scene and without a renderer.

#include <cmath>
#include <cstdio>
#include <vector>

#include "wisp/geometry/closest_point.h"
#include "wisp/geometry/mesh.h"
#include "wisp/geometry/subdivide.h"

int main() {
  wisp::quad_mesh<wisp::vec3> square;
  square.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.quads = {{0, 1, 2, 3}};
  for (int i = 0; i < 4; ++i) square = wisp::subdivide_linear(square);

  const wisp::bvh tree = wisp::make_bvh(wisp::quads_to_triangles(square.quads), square.vertices);
  const auto r = wisp::closest_point(tree, {0.3, 1.4, 0.3});
  std::printf("%zu triangles, %s: %g at (%g, %g, %g)\n", tree.size(), wisp::geometry_target(),
              r.distance, r.at.point.x, r.at.point.y, r.at.point.z);
  return tree.size() == 512 && std::abs(r.distance - 0.5) < 1e-12 ? 0 : 1;
}
