#pragma once

// Problems with sources in the unit ball, and how their solutions are held to closed forms.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "closed_forms.h"
#include "wisp/pde/greens.h"

namespace wisp::test {

inline const dbox3 unit_box{{-1, -1, -1}, {1, 1, 1}};

// Green's function of the unit ball, and of its outside, by an image charge.
inline double ball_greens(const dvec3& x, const dvec3& y) {
  const double image =
      std::sqrt(std::max(glm::dot(x, x) * glm::dot(y, y) - 2 * glm::dot(x, y) + 1, 0.0));
  return (1 / glm::distance(x, y) - 1 / image) / (4 * pi_d);
}

// Poisson's equation, 0 on the boundary.
inline pde_problem in_ball(double radius = 1) {
  pde_problem p;
  p.domain = pde_domain(sdf_sphere({0, 0, 0}, radius));
  p.equation = pde_equation::poisson;
  p.boundary = [](const dvec3&) { return 0.0; };
  return p;
}

// z-scores of 50 points: the mean within 5 deviations and squares within 6, a false alarm
// in 1e5 or so.
template <typename F>
void check_values(const pde_problem& p, const F& exact, solve_options o = {},
                  const dbox3& box = unit_box, int channel = 0) {
  const auto points = points_in(p.domain, 50, box, 4);
  REQUIRE(points.size() == 50);
  o.walks = std::max<std::uint64_t>(o.walks, 1024);
  o.epsilon = 1e-6;
  const solution s = solve(p, points, o);
  scores z;
  for (std::size_t i = 0; i < points.size(); ++i) {
    REQUIRE(s.values[i].status == point_status::ok);
    const double error = s.values[i].standard_error[channel];
    // where nothing is left to sample the answer is exact, but for the shell
    z.add(s.values[i].mean[channel], std::hypot(error, 1e-5), exact(points[i]));
  }
  const double mean = z.sum / std::sqrt(z.count), square = z.squares / z.count;
  CAPTURE(mean);
  CAPTURE(square);
  CHECK(z.mean_is_right());
  CHECK(z.squares / z.count < 1 + 6 * std::sqrt(2.0 / z.count));
}

}  // namespace wisp::test
