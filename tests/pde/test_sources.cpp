// Sources at points, on curves and on meshes, and volumetric ones with peaks.

#include <doctest/doctest.h>

#include "ball_problems.h"
#include "wisp/pde/section.h"

using namespace wisp;
using wisp::test::ball_greens;
using wisp::test::check_values;
using wisp::test::in_ball;
using wisp::test::points_in;
using wisp::test::scores;
using wisp::test::unit_box;

TEST_CASE("pde: point sources by both estimators") {
  const dvec3 a{0.3, 0.1, -0.2}, b{-0.5, 0, 0.4};
  for (const auto way : {point_source_estimator::fundamental, point_source_estimator::balls}) {
    solve_options o;
    o.point_sources = way;
    pde_problem p = in_ball();
    p.point_sources = {{a, {2, 0, 0, 0}}, {b, {-0.7, 0, 0, 0}}, {{3, 0, 0}, {50, 0, 0, 0}}};
    check_values(
        p, [&](const dvec3& x) { return -2 * ball_greens(x, a) + 0.7 * ball_greens(x, b); }, o);
    // in the middle of a screened ball
    p.equation = pde_equation::screened_poisson;
    p.screening = 9;
    p.point_sources = {{{0, 0, 0}, {2, 0, 0, 0}}};
    check_values(
        p, [&](const dvec3& x) { return -2 * greens(glm::length(x), 1, 3); }, o);
    // outside of the ball: the image lies inside
    pde_problem e = in_ball();
    e.domain = pde_domain(sdf_sphere({0, 0, 0}, 1), domain_side::exterior);
    e.point_sources = {{{0, 0, 2}, {1, 0, 0, 0}}};
    check_values(e,
                 [&](const dvec3& x) {
                   return -ball_greens(x, {0, 0, 2});
                 },
                 o, {{-3, -3, -3}, {3, 3, 3}});
  }
}

TEST_CASE("pde: slopes of point sources") {
  const dvec3 a{0.3, 0.1, -0.2};
  for (const auto way : {point_source_estimator::fundamental, point_source_estimator::balls}) {
    pde_problem p = in_ball();
    p.point_sources = {{a, {2, 0, 0, 0}}};
    solve_options o;
    o.point_sources = way;
    o.gradient = true;
    o.walks = 2048;
    o.epsilon = 1e-6;
    const auto points = points_in(p.domain, 30, unit_box, 4);
    const solution s = solve(p, points, o);
    scores z;
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        dvec3 h{0};
        h[c] = 1e-5;
        const double slope =
            -2 * (ball_greens(points[i] + h, a) - ball_greens(points[i] - h, a)) / 2e-5;
        z.add(s.gradients[i].mean[0][c], std::hypot(s.gradients[i].standard_error[0][c], 1e-5),
              slope);
      }
    }
    CHECK(z.mean_is_right());
    CHECK(z.squares / z.count < 1 + 6 * std::sqrt(2.0 / z.count));
  }
}

TEST_CASE("pde: sources on curves and meshes") {
  const dvec3 a{-0.5, 0.1, 0}, b{0.4, 0.2, 0.3};
  pde_problem p = in_ball();
  p.curve_sources.push_back({{a, 0.3 * a + 0.7 * b, b}, {1.5, 0, 0, 0}});
  const double length = glm::distance(a, b);
  const auto on_line = [&](const dvec3& x) {
    double sum = 0;
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i) sum += ball_greens(x, a + (i + 0.5) / n * (b - a));
    return -1.5 * sum / n * length;
  };
  check_values(p, on_line);

  // a shell of radius 1/2: u is constant in it, and falls like 1 / r - 1 beyond
  pde_problem q = in_ball();
  mesh_source shell;
  constexpr int rows = 96, columns = 192;
  for (int i = 0; i <= rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const double t = pi_d * i / rows, f = 2 * pi_d * j / columns;
      shell.positions.push_back(
          0.5 * dvec3{std::sin(t) * std::cos(f), std::sin(t) * std::sin(f), std::cos(t)});
    }
  }
  for (std::uint32_t i = 0; i < rows; ++i) {
    for (std::uint32_t j = 0; j < columns; ++j) {
      const std::uint32_t k = (j + 1) % columns, c = i * columns, d = c + columns;
      shell.triangles.push_back({c + j, d + j, d + k});
      shell.triangles.push_back({c + j, d + k, c + k});
    }
  }
  shell.strength = {3, 0, 0, 0};
  q.mesh_sources.push_back(shell);
  const auto around = [](const dvec3& x) {
    return -3 * 0.25 * (1 / std::max(glm::length(x), 0.5) - 1);
  };
  check_values(
      q, [&](const dvec3& x) { return around(x) * (1 - 3e-4); });  // of the area of the sphere
  // both, and a volumetric source, and a section that shares its walks
  pde_problem all = q;
  all.curve_sources = p.curve_sources;
  all.source = [](const dvec3&) { return 2.0; };
  const auto sum = [&](const dvec3& x) {
    return around(x) * (1 - 3e-4) + on_line(x) + (glm::dot(x, x) - 1) / 3;
  };
  check_values(all, sum);
  const section_grid grid = make_section_grid(all.domain, {.resolution = 12});
  scores z;
  section_options o;
  o.solve.walks = 256;
  o.solve.epsilon = 1e-6;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    o.solve.seed = seed;
    const solution s = solve_section(all, grid, o);
    for (std::size_t i = seed; i < grid.points.size(); i += 13) {
      // next to the boundary one walk in many goes far, and errors of few are not normal
      if (glm::length(grid.points[i]) > 0.95) continue;
      z.add(s.values[i].mean.x, s.values[i].standard_error.x, sum(grid.points[i]));
    }
  }
  CHECK(z.count > 30);
  CHECK(z.mean_is_right());
  CHECK(z.squares / z.count < 2);
}

TEST_CASE("pde: peaks change the variance of a source and not its mean") {
  const dvec3 center{0.2, 0.3, 0};
  const double width = 0.02;
  pde_problem p = in_ball();
  p.source = [=](const dvec3& x) {
    const dvec3 d = (x - center) / width;
    return 1e4 * std::exp(-0.5 * glm::dot(d, d));
  };
  // beyond it, the field of its mass at its center
  const double mass = 1e4 * std::pow(2 * pi_d, 1.5) * width * width * width;
  const auto exact = [&](const dvec3& x) {
    const double r = glm::distance(x, center);
    return -mass *
           (ball_greens(x, center) - (1 - std::erf(r / (width * std::sqrt(2.0)))) / (4 * pi_d * r));
  };
  solve_options o;
  pde_problem with = p;
  with.source_peaks.push_back({center, width, 1});
  // not next to the boundary, where a walk in a hundred meets the peak
  o.walks = 8192;
  check_values(with, exact, o, {{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}});
  o.walks = 4096;
  const dvec3 points[] = {{0.1, 0.2, 0.1}, {-0.3, 0, 0.2}, {0.2, 0.3, 0}};
  const solution a = solve(p, points, o), b = solve(with, points, o);
  for (std::size_t i = 0; i < 3; ++i) {
    const double ratio = std::pow(a.values[i].standard_error.x / b.values[i].standard_error.x, 2);
    MESSAGE("variance without peaks over that with: " << ratio);
    CHECK(ratio > 2);
  }
}

TEST_CASE("pde: channels share their walks") {
  pde_problem p = in_ball();
  p.channels = 3;
  p.boundary = [](const dvec3& x) { return dvec3{x.x, x.y * x.z, 1}; };
  p.source = [](const dvec3& x) { return dvec3{1, x.x, 0}; };
  p.point_sources.push_back({{0.1, 0, 0}, {1, 0, 2, 0}});
  const dvec3 points[] = {{0.3, 0.2, -0.4}};
  solve_options o;
  o.gradient = true;
  const solution all = solve(p, points, o);
  CHECK(all.values[0].mean.w == 0);
  for (int c = 0; c < 3; ++c) {
    pde_problem one = p;
    one.channels = 1;
    one.boundary = [&p, c](const boundary_point& x) { return p.boundary(x)[c]; };
    one.source = [&p, c](const dvec3& x) { return p.source(x)[c]; };
    one.point_sources[0].strength = {p.point_sources[0].strength[c], 0, 0, 0};
    const solution s = solve(one, points, o);
    const auto i = static_cast<std::size_t>(c);
    CHECK(s.values[0].mean.x == doctest::Approx(all.values[0].mean[c]).epsilon(1e-12));
    CHECK(s.values[0].standard_error.x ==
          doctest::Approx(all.values[0].standard_error[c]).epsilon(1e-9));
    CHECK(s.gradients[0].mean[0].y == doctest::Approx(all.gradients[0].mean[i].y).epsilon(1e-9));
  }
}
