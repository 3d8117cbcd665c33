// Parallel loops and meshes, without a scene and without a renderer.

#include <cstddef>
#include <cstdio>
#include <vector>

#include "wisp/core/parallel.h"
#include "wisp/core/rng.h"
#include "wisp/core/sampling.h"
#include "wisp/core/statistics.h"
#include "wisp/geometry/subdivide.h"

int main() {
  // The mean of z over the hemisphere with a cosine density is 2 / 3.
  std::vector<double> z(20000);
  wisp::parallel_for(
      z.size(), 0,
      [&](std::size_t i) {
        auto rng = wisp::make_rng(1, i);
        float x = wisp::rand1f(rng), y = wisp::rand1f(rng);
        z[i] = static_cast<double>(wisp::sample_hemisphere_cos({x, y}).z);
      },
      256);
  wisp::running_stats stats;
  for (double value : z) wisp::add_sample(stats, value);
  double off = (stats.mean - 2.0 / 3.0) / wisp::standard_error(stats);

  wisp::quad_mesh<wisp::vec3> square;
  square.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.quads = {{0, 1, 2, 3}};
  auto refined = wisp::subdivide_catmullclark(square, true);

  std::printf("mean %g, %g standard errors off; %zu quads\n", stats.mean, off,
              refined.quads.size());
  return off > -5 && off < 5 && refined.quads.size() == 4 && refined.vertices.size() == 9 ? 0 : 1;
}
