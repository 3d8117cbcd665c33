// A boundary value problem inside of a shape that only this program knows: a gyroid's
// labyrinth, cut to a ball. The problem has a known solution, so that the program can
// tell how right it is. Ends with 1 if it is not.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/trigonometric.hpp>
#include <vector>

#include "wisp/pde/solve.h"

namespace {

using wisp::dvec3;

// Negative inside. A walk takes |f| for a distance that holds no boundary, so that f must
// not change faster than by 1 for each unit of length. The gradient of g is never longer
// than frequency * sqrt(3); of two such functions the larger is one as well.
double labyrinth(const dvec3& p) {
  constexpr double frequency = 5;
  const dvec3 s = glm::sin(frequency * p), c = glm::cos(frequency * p);
  const double g = s.x * c.y + s.y * c.z + s.z * c.x;
  const double wall = (g - 0.5) / (frequency * std::sqrt(3.0));
  const double ball = glm::length(p) - 1;
  return std::max(wall, ball);
}

// lap u - c u = f with this u, whose Laplacian is -5 times its first term.
constexpr double screening = 4;
double wave(const dvec3& p) { return std::cos(3 * p.x) * std::exp(2 * p.y); }
double exact(const dvec3& p) { return wave(p) + p.x * p.y * p.z + p.z; }
double source(const dvec3& p) { return -5 * wave(p) - screening * exact(p); }

}  // namespace

int main() {
  wisp::pde_problem problem;
  problem.domain = wisp::pde_domain(labyrinth, wisp::dbox3{{-1, -1, -1}, {1, 1, 1}});
  problem.equation = wisp::pde_equation::screened_poisson;
  problem.screening = screening;
  problem.boundary = exact;  // any function of a point; here it has to be the solution
  problem.source = source;

  std::vector<dvec3> points;
  for (int i = 0; i < 16; i++) {
    const double t = -0.9 + 0.12 * i;
    points.push_back({0.5 * t, -0.3 * t - 0.1, 0.7 * t});
  }
  wisp::solve_options options;
  options.walks = 8192;
  options.epsilon = 1e-5;  // walks end so near to the boundary: far below the errors here
  const wisp::solution u = wisp::solve(problem, points, options);

  std::printf("  x      y      z        u      exact    error   standard error      z\n");
  double squares = 0, largest = 0, worst_error = 0;
  int inside = 0, outside = 0, wrong = 0;
  for (std::size_t i = 0; i < points.size(); i++) {
    const dvec3& p = points[i];
    const wisp::estimate& e = u.values[i];
    std::printf("%6.3f %6.3f %6.3f ", p.x, p.y, p.z);
    if (e.status != wisp::point_status::ok) {
      std::printf("      in the wall\n");
      outside++;
      if (labyrinth(p) < 0) wrong++;
      continue;
    }
    if (labyrinth(p) >= 0) wrong++;
    inside++;
    const double error = e.mean.x - exact(p), score = error / e.standard_error.x;
    squares += score * score;
    largest = std::max(largest, std::abs(score));
    worst_error = std::max(worst_error, e.standard_error.x);
    std::printf("%8.4f %8.4f %8.4f %16.4f %6.2f\n", e.mean.x, exact(p), error, e.standard_error.x,
                score);
  }
  const double rms = std::sqrt(squares / inside);
  std::printf("%d points inside, %d not; z: root mean square %.2f, largest %.2f\n", inside, outside,
              rms, largest);
  std::printf("%llu walks of %.1f steps in %.2f s\n", static_cast<unsigned long long>(u.walks),
              static_cast<double>(u.steps) / static_cast<double>(u.walks), u.seconds);

  // Errors are those that the estimates claim, and small.
  const bool good = wrong == 0 && inside >= 8 && outside >= 3 && u.unfinished == 0 && rms < 2 &&
                    largest < 4.5 && worst_error < 0.01;
  if (!good) std::printf("this is not the solution\n");
  return good ? 0 : 1;
}
