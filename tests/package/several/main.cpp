// Hair, distances and a PDE in one program, and a camera where there is a renderer.

#include <cmath>
#include <cstdio>
#include <vector>

#include "wisp/geometry/sdf.h"
#include "wisp/hair/bsdf.h"
#include "wisp/hair/version.h"
#include "wisp/pde/solve.h"
#if defined(WITH_RENDER)
#include "wisp/render/trace.h"
#endif

static_assert(WISP_VERSION_NUMBER >= WISP_MAKE_VERSION(0, 1, 0));

int main() {
  const auto bsdf = wisp::hair::make_hair_bsdf(wisp::hair::hair_parameters<float>{});

  wisp::pde_problem harmonic;
  harmonic.domain = wisp::pde_domain(wisp::sdf_sphere({0, 0, 0}, 1));
  harmonic.boundary = [](const wisp::dvec3& p) { return p.x; };
  const std::vector<wisp::dvec3> points = {{0.5, 0, 0}};
  wisp::solve_options options;
  options.walks = 4096;
  const auto u = wisp::solve(harmonic, points, options).values[0];

  bool good = bsdf.v[0] > 0 && std::abs(u.mean.x - 0.5) < 6 * u.standard_error.x + 1e-3;
  std::printf("wisp %s: variance of R %g, u(0.5, 0, 0) = %g +- %g\n", WISP_VERSION_STRING,
              static_cast<double>(bsdf.v[0]), u.mean.x, u.standard_error.x);

#if defined(WITH_RENDER)
  wisp::scene_data scene;
  scene.cameras.emplace_back();
  wisp::trace_options size;
  size.width = 64;
  size.height = 32;
  good = good && wisp::image_size(scene, size) == wisp::ivec2{64, 32};
#endif
  return good ? 0 : 1;
}
