// wisp as a folder of another project.

#include <cstdio>

#include "wisp/core/parallel.h"
#include "wisp/hair/bsdf.h"
#include "wisp/pde/domain.h"

int main() {
  auto bsdf = wisp::hair::make_hair_bsdf(wisp::hair::hair_parameters<double>{});
  int threads = wisp::thread_count(0);
  std::printf("variance of R %g, %d threads\n", bsdf.v[0], threads);
  const wisp::pde_domain ball(wisp::sdf_sphere({0, 0, 0}, 2));
  const double radius = ball.clearance({0.5, 0, 0}, 0.5);
  std::printf("a ball of radius %g fits\n", radius);
  return bsdf.v[0] > 0 && threads >= 1 && radius == 1.5 ? 0 : 1;
}
