// Heat in a body that is given by a distance function alone: a ball of radius 1 without
// a tube along z. Its surface is at 1 where x > 0 and at 0 elsewhere, and a source warms
// it. Prints the temperature and its gradient along a line.

#include <cmath>
#include <cstdio>
#include <vector>

#include "wisp/pde/solve.h"

using namespace wisp;

double body(const dvec3& p) {
  const double ball = glm::length(p) - 1;
  const double tube = std::hypot(p.x, p.y) - 0.3;
  return std::max(ball, -tube);  // the ball without the tube
}

int main() {
  pde_problem heat;
  heat.domain = pde_domain(body, dbox3{{-1, -1, -1}, {1, 1, 1}});
  heat.equation = pde_equation::poisson;
  heat.boundary = [](const dvec3& p) { return p.x > 0 ? 1.0 : 0.0; };
  heat.source = [](const dvec3& p) { return -4 * std::exp(-8 * glm::dot(p, p)); };

  std::vector<dvec3> points;
  for (double x = -0.95; x < 1; x += 0.1) points.push_back({x, 0, 0});

  solve_options options;
  options.walks = 1024;
  options.gradient = true;
  const solution u = solve(heat, points, options);

  for (std::size_t i = 0; i < points.size(); ++i) {
    const estimate& e = u.values[i];
    if (e.status != point_status::ok) {
      std::printf("%5.2f  outside\n", points[i].x);
      continue;
    }
    std::printf("%5.2f  %.3f +- %.3f  slope %6.2f +- %.2f\n", points[i].x, e.mean.x,
                e.standard_error.x, u.gradients[i].mean[0].x, u.gradients[i].standard_error[0].x);
  }

  // the same number twice, the tube outside, and warm where it should be
  const bool fine = u.values[10].status == point_status::outside && u.values[18].mean.x > 0.8 &&
                    u.values[1].mean.x < 0.2 &&
                    solve(heat, points, options).values[5].mean.x == u.values[5].mean.x;
  return fine ? 0 : 1;
}
