// Parallel loops and statistics, without a scene and without a renderer.

#include <cstddef>
#include <cstdio>
#include <vector>

#include "wisp/core/parallel.h"
#include "wisp/core/rng.h"
#include "wisp/core/sampling.h"
#include "wisp/core/statistics.h"

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

  std::printf("mean %g, %g standard errors off\n", stats.mean, off);
  return off > -5 && off < 5 ? 0 : 1;
}
