// wisp as sources that the build of another project fetched.

#include <cstdio>

#include "wisp/core/parallel.h"
#include "wisp/hair/bsdf.h"

int main() {
  auto bsdf = wisp::hair::make_hair_bsdf(wisp::hair::hair_parameters<double>{});
  int threads = wisp::thread_count(0);
  std::printf("variance of R %g, %d threads\n", bsdf.v[0], threads);
  return bsdf.v[0] > 0 && threads >= 1 ? 0 : 1;
}
