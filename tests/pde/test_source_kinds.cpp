// Slopes of sources, sources outside of a body, peaks with weights, and both estimators of
// point sources.

#include <doctest/doctest.h>

#include "ball_problems.h"

using namespace wisp;
using wisp::test::ball_greens;
using wisp::test::check_values;
using wisp::test::in_ball;
using wisp::test::points_in;
using wisp::test::scores;
using wisp::test::unit_box;

TEST_CASE("pde: slopes of sources on curves and meshes and of screened point sources") {
  // Slopes by differences of the closed forms, held to as values are above.
  const auto check_slopes = [](const pde_problem& p, const auto& u, const dbox3& box,
                               point_source_estimator way) {
    solve_options o;
    o.gradient = true;
    o.walks = 4096;
    o.epsilon = 1e-6;
    o.point_sources = way;
    const auto points = points_in(p.domain, 25, box, 14);
    const solution s = solve(p, points, o);
    scores z;
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        dvec3 h{0};
        h[c] = 1e-5;
        const double slope = (u(points[i] + h) - u(points[i] - h)) / 2e-5;
        z.add(s.gradients[i].mean[0][c], std::hypot(s.gradients[i].standard_error[0][c], 1e-5),
              slope);
      }
    }
    const double square = z.squares / z.count;
    CAPTURE(square);
    CHECK(z.mean_is_right());
    CHECK(z.squares / z.count < 1 + 6 * std::sqrt(2.0 / z.count));
  };
  const dbox3 inner{{-0.7, -0.7, -0.7}, {0.7, 0.7, 0.7}};
  constexpr auto fundamental = point_source_estimator::fundamental;
  // two segments, and a square of four triangles that are not alike
  const dvec3 a{-0.5, 0.6, 0.1}, b{0.3, 0.7, 0.2}, c{0.5, 0.4, -0.3};
  pde_problem line = in_ball();
  line.curve_sources.push_back({{a, b, c}, {2, 0, 0, 0}});
  const auto on_line = [&](const dvec3& x) {
    double sum = 0;
    constexpr int n = 2000;
    for (int i = 0; i < n; ++i) {
      sum += ball_greens(x, a + (i + 0.5) / n * (b - a)) * glm::distance(a, b) / n;
      sum += ball_greens(x, b + (i + 0.5) / n * (c - b)) * glm::distance(b, c) / n;
    }
    return -2 * sum;
  };
  check_slopes(line, on_line, {{-0.7, -0.7, -0.7}, {0.7, 0.2, 0.7}}, fundamental);
  pde_problem square = in_ball();
  square.mesh_sources.push_back(
      {{{-0.3, -0.4, 0.5}, {0.3, -0.4, 0.5}, {0.3, 0.2, 0.5}, {-0.3, 0.2, 0.5}, {-0.2, 0.1, 0.5}},
       {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}},
       {-3, 0, 0, 0}});
  const auto on_square = [](const dvec3& x) {
    double sum = 0;
    constexpr int n = 100;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        sum += ball_greens(x, {-0.3 + 0.6 * (i + 0.5) / n, -0.4 + 0.6 * (j + 0.5) / n, 0.5});
      }
    }
    return 3 * 0.36 * sum / (n * n);
  };
  check_values(square, on_square, {.walks = 2048}, {{-0.7, -0.7, -0.7}, {0.7, 0.7, 0.4}});
  check_slopes(square, on_square, {{-0.7, -0.7, -0.7}, {0.7, 0.7, 0.2}}, fundamental);
  pde_problem middle = in_ball();
  middle.equation = pde_equation::screened_poisson;
  middle.screening = 9;
  middle.point_sources = {{{0, 0, 0}, {2, 0, 0, 0}}};
  for (const auto way : {fundamental, point_source_estimator::balls}) {
    check_slopes(
        middle, [](const dvec3& x) { return -2 * greens(glm::length(x), 1, 3); }, inner, way);
  }
  // outside of the ball
  pde_problem beyond = in_ball();
  beyond.domain = pde_domain(sdf_sphere({0, 0, 0}, 1), domain_side::exterior);
  beyond.point_sources = {{{0, 0, 2}, {1, 0, 0, 0}}};
  for (const auto way : {fundamental, point_source_estimator::balls}) {
    check_slopes(
        beyond,
        [](const dvec3& x) {
          return -ball_greens(x, {0, 0, 2});
        },
        {{-3, -3, -3}, {3, 3, 1.5}}, way);
  }
}

TEST_CASE("pde: sources outside of a body") {
  // Green's function outside of the ball is that of its inside, by the same image; a shell
  // of radius a around it makes -s a^2 (1 / max(r, a) - 1 / (r a)).
  pde_problem p = in_ball();
  p.domain = pde_domain(sdf_sphere({0, 0, 0}, 1), domain_side::exterior);
  const dbox3 around{{-4, -4, -4}, {4, 4, 4}};
  const dvec3 a{1.5, -1, 0}, b{1.5, 2, 0.5};
  const auto on_line = [&](const dvec3& x) {
    double sum = 0;
    constexpr int n = 4000;
    for (int i = 0; i < n; ++i) sum += ball_greens(x, a + (i + 0.5) / n * (b - a));
    return -sum / n * glm::distance(a, b);
  };
  p.curve_sources.push_back({{a, 0.5 * (a + b), b}, {1, 0, 0, 0}});
  check_values(p, on_line, {.walks = 1024}, around);
  // A source's strength scales u and nothing else, however small: one part is inside of
  // the body and has no effect.
  p.curve_sources.push_back({{{0, 0, 0}, {0, 0.5, 0}}, {7, 0, 0, 0}});
  check_values(p, on_line, {.walks = 1024}, around);
  const dvec3 points[] = {{0, 0, 3}};
  p.curve_sources.pop_back();
  solve_options o;
  const double one = solve(p, points, o).values[0].mean.x;
  for (const double s : {1e-15, 1e-30, 1e30}) {
    p.curve_sources[0].strength.x = s;
    CHECK(solve(p, points, o).values[0].mean.x / s == doctest::Approx(one).epsilon(1e-9));
  }
  pde_problem q = in_ball();
  q.domain = p.domain;
  mesh_source shell;  // an octahedron refined four times, its vertices at radius 2
  shell.positions = {{2, 0, 0}, {-2, 0, 0}, {0, 2, 0}, {0, -2, 0}, {0, 0, 2}, {0, 0, -2}};
  shell.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                     {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int times = 0; times < 5; ++times) {
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& t : shell.triangles) {
      const auto n = static_cast<std::uint32_t>(shell.positions.size());
      for (std::size_t k = 0; k < 3; ++k) {
        shell.positions.push_back(
            2.0 * glm::normalize(shell.positions[t[k]] + shell.positions[t[(k + 1) % 3]]));
      }
      finer.push_back({t[0], n, n + 2});
      finer.push_back({n, t[1], n + 1});
      finer.push_back({n + 2, n + 1, t[2]});
      finer.push_back({n, n + 1, n + 2});
    }
    shell.triangles = finer;
  }
  double area = 0;
  for (const auto& t : shell.triangles) {
    area += 0.5 * glm::length(glm::cross(shell.positions[t[1]] - shell.positions[t[0]],
                                         shell.positions[t[2]] - shell.positions[t[0]]));
  }
  q.mesh_sources.push_back(shell);
  const double strength = area / (4 * pi_d);  // s a^2, less what facets lack
  check_values(
      q,
      [&](const dvec3& x) {
        const double r = glm::length(x);
        return -strength * (1 / std::max(r, 2.0) - 1 / (2 * r));
      },
      {.walks = 4096}, around);
}

TEST_CASE("pde: peaks with weights and uniform samples keep the mean") {
  // two of them, one within the other's reach, and f is one Gaussian at each
  const dvec3 at[] = {{0.2, 0.3, 0}, {-0.3, 0.1, 0.2}};
  const double width[] = {0.03, 0.05}, height[] = {300, -100};
  pde_problem p = in_ball();
  p.source = [=](const dvec3& x) {
    double sum = 0;
    for (int i = 0; i < 2; ++i) {
      const dvec3 d = (x - at[i]) / width[i];
      sum += height[i] * std::exp(-0.5 * glm::dot(d, d));
    }
    return sum;
  };
  p.source_peaks = {{at[0], width[0], 1}, {at[1], width[1], 5}, {{0.9, 0, 0}, 0.2, 0.5}};
  const auto exact = [=](const dvec3& x) {
    double sum = 0;
    for (int i = 0; i < 2; ++i) {
      const double r = glm::distance(x, at[i]);
      const double mass = height[i] * std::pow(2 * pi_d * width[i] * width[i], 1.5);
      sum -= mass *
             (ball_greens(x, at[i]) - std::erfc(r / (width[i] * std::sqrt(2.0))) / (4 * pi_d * r));
    }
    return sum;
  };
  for (const auto sampling : {source_sampling::greens, source_sampling::uniform}) {
    solve_options o;
    o.sampling = sampling;
    o.walks = 2048;
    check_values(p, exact, o, {{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}});
  }
}

TEST_CASE("pde: both estimators of point sources agree where there is no closed form") {
  // off the middle of a screened ball, three sources in two channels; the second
  // channel by one estimator against the first by the other
  pde_problem p = in_ball();
  p.equation = pde_equation::screened_poisson;
  p.screening = 6;
  p.channels = 2;
  p.boundary = [](const dvec3& x) { return dvec2{x.x, x.x}; };
  p.point_sources = {{{0.5, 0, 0.3}, {1, 1, 0, 0}},
                     {{-0.2, 0.6, 0}, {-2, -2, 0, 0}},
                     {{0, 0, -4}, {1e3, 1e3, 0, 0}}};
  solve_options o;
  o.walks = 4096;
  o.epsilon = 1e-6;
  o.gradient = true;
  const auto points = points_in(p.domain, 40, unit_box, 8);
  const solution a = solve(p, points, o);
  o.point_sources = point_source_estimator::balls;
  o.seed = 77;
  const solution b = solve(p, points, o);
  scores z, slopes;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& v = a.values[i];
    const auto& w = b.values[i];
    z.add(v.mean.x, std::hypot(v.standard_error.x, w.standard_error.y), w.mean.y);
    for (int c = 0; c < 3; ++c) {
      slopes.add(
          a.gradients[i].mean[0][c],
          std::hypot(a.gradients[i].standard_error[0][c], b.gradients[i].standard_error[1][c]),
          b.gradients[i].mean[1][c]);
    }
  }
  CHECK(z.mean_is_right());
  CHECK(z.squares / z.count < 1 + 6 * std::sqrt(2.0 / z.count));
  CHECK(slopes.mean_is_right());
  CHECK(slopes.squares / slopes.count < 1 + 6 * std::sqrt(2.0 / slopes.count));
}

TEST_CASE("pde: exterior problems with sources near the solid are right from far away") {
  // u = 1 / (1 + r^2) outside of the unit ball. z-scores of 400 points at each distance: the
  // bounds are some five standard errors of their mean and of their mean square.
  pde_problem p;
  p.domain = pde_domain(sdf_sphere({0, 0, 0}, 1), domain_side::exterior);
  p.equation = pde_equation::poisson;
  p.infinity = dvec4{0};
  const auto u = [](const dvec3& x) { return 1 / (1 + glm::dot(x, x)); };
  p.boundary = u;
  p.source = [](const dvec3& x) {
    const double q = glm::dot(x, x);
    return (2 * q - 6) / ((1 + q) * (1 + q) * (1 + q));
  };
  for (const double r : {3.0, 30.0, 300.0, 3000.0}) {
    std::vector<dvec3> points;
    for (int i = 0; i < 400; ++i) {
      points.push_back(
          r * glm::normalize(dvec3{std::cos(0.7 * i), std::sin(0.7 * i), std::sin(1.3 * i)}));
    }
    solve_options o;
    o.walks = 256;
    o.epsilon = 1e-5;
    const solution s = solve(p, points, o);
    double mean = 0, squares = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double z = (s.values[i].mean.x - u(points[i])) / s.values[i].standard_error.x;
      mean += z / 400;
      squares += z * z / 400;
    }
    CAPTURE(r);
    CHECK(std::abs(mean) < 0.25);
    CHECK(squares > 0.65);
    CHECK(squares < 1.4);
  }
}
