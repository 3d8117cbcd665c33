// Budgets, determinism, errors that say what they are, and what reduces variance.

#include <doctest/doctest.h>

#include "closed_forms.h"
#include "wisp/pde/section.h"

using namespace wisp;
using wisp::test::points_in;

namespace {

const dbox3 unit_box{{-1, -1, -1}, {1, 1, 1}};

double u(const dvec3& p) { return std::exp(2 * p.x) * std::sin(2 * p.y) + p.z; }

pde_problem problem() {
  const sdf parts[] = {sdf_box({0, 0, 0}, {0.8, 0.7, 0.6}), sdf_sphere({0.5, 0.4, 0.2}, 0.5)};
  pde_problem p;
  p.domain = pde_domain(sdf_difference(parts));
  p.boundary = u;
  return p;
}

bool same(const solution& a, const solution& b) {
  if (a.values.size() != b.values.size() || a.gradients.size() != b.gradients.size()) return false;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    if (a.values[i].mean != b.values[i].mean || a.values[i].walks != b.values[i].walks ||
        a.values[i].standard_error != b.values[i].standard_error) {
      return false;
    }
  }
  for (std::size_t i = 0; i < a.gradients.size(); ++i) {
    if (a.gradients[i].mean != b.gradients[i].mean) return false;
  }
  return true;
}

// The mean over points of the squared standard error, of values or gradients.
double variance(const pde_problem& p, solve_options o, bool of_gradient = false) {
  o.walks = 4096;
  o.gradient = of_gradient;
  const auto points = points_in(p.domain, 20, unit_box, 3);
  const solution s = solve(p, points, o);
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (of_gradient) {
      sum += glm::dot(s.gradients[i].standard_error[0], s.gradients[i].standard_error[0]);
    } else {
      sum += s.values[i].standard_error.x * s.values[i].standard_error.x;
    }
  }
  return sum;
}

}  // namespace

TEST_CASE("pde: results are the same at any number of threads") {
  pde_problem p = problem();
  const auto points = points_in(p.domain, 150, unit_box);
  for (const bool gradient : {false, true}) {
    solve_options o;
    o.gradient = gradient;
    o.threads = 1;
    const solution one = solve(p, points, o);
    o.error = 0.05;
    const solution to_error = solve(p, points, o);
    for (const int threads : {2, 3, 0}) {
      o.threads = threads;
      o.error = 0;
      CHECK(same(solve(p, points, o), one));
      o.error = 0.05;
      CHECK(same(solve(p, points, o), to_error));
    }
    o.error = 0;
    o.seed = 1;
    CHECK_FALSE(same(solve(p, points, o), one));
  }
  const section_grid grid = make_section_grid(p.domain, {.resolution = 32});
  section_options o;
  o.solve.threads = 1;
  const solution one = solve_section(p, grid, o);
  o.solve.threads = 3;
  CHECK(same(solve_section(p, grid, o), one));
}

TEST_CASE("pde: budgets of error are met by walks where the error is") {
  const pde_problem p = problem();
  const auto points = points_in(p.domain, 60, unit_box);
  solve_options o;
  o.error = 0.02;
  const solution s = solve(p, points, o);
  std::uint64_t least = ~std::uint64_t{0}, most = 0;
  double off = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(s.values[i].standard_error.x <= 0.02);
    least = std::min(least, s.values[i].walks);
    most = std::max(most, s.values[i].walks);
    off += std::pow((s.values[i].mean.x - u(points[i])) / 0.02, 2);
  }
  CHECK(most > 10 * least);
  CHECK(off / 60 < 1.8);
  o.max_walks = 100;
  for (const estimate& e : solve(p, points, o).values) CHECK(e.walks < 500);
  const section_grid grid = make_section_grid(p.domain, {.resolution = 32});
  section_options so;
  so.solve.error = 0.02;
  for (const estimate& e : solve_section(p, grid, so).values) CHECK(e.standard_error.x <= 0.02);
}

TEST_CASE("pde: budgets of time and callers that stop keep what is there") {
  const pde_problem p = problem();
  const auto points = points_in(p.domain, 60, unit_box);
  const section_grid grid = make_section_grid(p.domain, {.resolution = 24});
  for (const bool section : {false, true}) {
    section_options o;
    const auto run = [&] {
      return section ? solve_section(p, grid, o) : solve(p, points, o.solve);
    };
    o.solve.seconds = 0.2;
    const solution timed = run();
    CHECK_FALSE(timed.stopped);
    CHECK(timed.seconds >= 0.2);
    int calls = 0;
    double last = -1;
    o.solve.seconds = 1e9;
    o.solve.on_progress = [&](const solve_options::progress& now) {
      CHECK(static_cast<double>(now.walks) > last);
      last = static_cast<double>(now.walks);
      return ++calls < 3;
    };
    const solution stopped = run();
    CHECK(stopped.stopped);
    CHECK(calls == 3);
    CHECK(std::isfinite(stopped.values[0].mean.x));
    CHECK(stopped.walks > 0);
  }
}

TEST_CASE("pde: any number of walks is done exactly") {
  const pde_problem p = problem();
  const dvec3 points[] = {{0, 0, 0}};
  for (const auto d : {first_directions::independent, first_directions::antithetic,
                       first_directions::stratified}) {
    for (const std::uint64_t n : {1, 2, 3, 15, 16, 17, 48, 1000}) {
      solve_options o;
      o.walks = n;
      o.directions = d;
      const solution s = solve(p, points, o);
      CHECK(s.values[0].walks == n);
      CHECK(s.walks == n);
      CHECK(std::isfinite(s.values[0].mean.x));
    }
  }
}

TEST_CASE("pde: errors fall with the root of the walks") {
  // Over 1500 points the slope of log RMSE over log walks has a deviation of about 0.006.
  const pde_problem p = problem();
  const auto points = points_in(p.domain, 1500, unit_box);
  std::vector<double> x, y;
  for (const std::uint64_t n : {8, 32, 128, 512}) {
    solve_options o;
    o.walks = n;
    o.seed = n;
    o.epsilon = 1e-5;
    const solution s = solve(p, points, o);
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      sum += std::pow(s.values[i].mean.x - u(points[i]), 2);
    }
    x.push_back(std::log(static_cast<double>(n)));
    y.push_back(0.5 * std::log(sum / 1500));
  }
  const double mx = (x[0] + x[1] + x[2] + x[3]) / 4, my = (y[0] + y[1] + y[2] + y[3]) / 4;
  double xy = 0, xx = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    xy += (x[i] - mx) * (y[i] - my);
    xx += (x[i] - mx) * (x[i] - mx);
  }
  MESSAGE("slope " << xy / xx);
  CHECK(std::abs(xy / xx + 0.5) < 0.03);
}

TEST_CASE("pde: intervals hold what they should") {
  const pde_problem p = problem();
  const auto all = points_in(p.domain, 3000, unit_box);
  std::vector<dvec3> points;  // not those next to the boundary
  for (const dvec3& q : all) {
    if (p.domain.clearance(q, 0.1) > 0.05) points.push_back(q);
  }
  solve_options o;
  o.walks = 256;
  o.epsilon = 1e-5;
  const solution s = solve(p, points, o);
  double within = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    within += std::abs(s.values[i].mean.x - u(points[i])) < 1.96 * s.values[i].standard_error.x;
  }
  const double n = static_cast<double>(points.size());
  MESSAGE("coverage " << within / n);
  CHECK(within / n == doctest::Approx(0.95).epsilon(5 * std::sqrt(0.05 * 0.95 / n)));
}

TEST_CASE("pde: what is meant to reduce the variance does") {
  pde_problem p = problem();
  p.equation = pde_equation::poisson;
  p.source = [](const dvec3& x) { return 3 + x.x; };
  solve_options plain;
  plain.directions = first_directions::independent;
  plain.control_variates = false;
  solve_options control = plain, pairs = plain, blocks = plain, both = plain;
  control.control_variates = true;
  pairs.directions = first_directions::antithetic;
  blocks.directions = first_directions::stratified;
  both.directions = first_directions::antithetic;
  both.control_variates = true;
  for (const bool gradient : {false, true}) {
    const double base = variance(p, plain, gradient);
    const auto check = [&](const char* name, const solve_options& o, double least) {
      const double ratio = base / variance(p, o, gradient);
      MESSAGE(std::string(gradient ? "gradient, " : "value, ")
              << std::string(name) << ": " << ratio);
      CHECK(ratio > least);
    };
    // of values only what the first step adds goes away; of gradients the mean of u does
    const double least = gradient ? 8 : 1.02;
    check("control variates", control, least);
    check("opposite directions", pairs, least);
    check("blocks", blocks, least);
    check("opposite directions and control variates", both, least);
  }
}

TEST_CASE("pde: data that is not a number is told") {
  pde_problem p = problem();
  p.boundary = [](const dvec3& x) { return x.x > 0.7 ? std::nan("") : 1.0; };
  const dvec3 points[] = {{0.2, -0.2, 0}};
  const solution s = solve(p, points, {});
  CHECK(s.values[0].status == point_status::undefined);
  CHECK(std::isnan(s.values[0].mean.x));
  const section_grid grid = make_section_grid(p.domain, {.resolution = 12});
  int undefined = 0;
  for (const estimate& e : solve_section(p, grid, {}).values) {
    undefined += e.status == point_status::undefined;
    CHECK((e.status == point_status::undefined) == std::isnan(e.mean.x));
  }
  CHECK(undefined > 0);
}

TEST_CASE("pde: problems and options that are not valid are refused") {
  const auto refused = [](auto change) {
    pde_problem p = problem();
    solve_options o;
    change(p, o);
    const dvec3 points[] = {{0, 0, 0}};
    CHECK_THROWS_AS(solve(p, points, o), std::invalid_argument);
  };
  using P = pde_problem;
  using O = solve_options;
  constexpr double inf = std::numeric_limits<double>::infinity();
  refused([](P& p, O&) { p.boundary = {}; });
  refused([](P& p, O&) { p.domain = {}; });
  refused([](P& p, O&) { p.channels = 5; });
  refused([](P& p, O&) { p.screening = 1; });
  refused([](P& p, O&) { p.source = u; });
  for (const double c : {-1.0, inf, -inf, std::nan("")}) {
    refused([c](P& p, O&) {
      p.equation = pde_equation::screened_poisson;
      p.screening = c;
    });
  }
  refused([](P& p, O&) { p.equation = pde_equation::biharmonic; });
  refused([](P& p, O&) {
    p.equation = pde_equation::biharmonic;
    p.boundary_laplacian = u;
    p.domain = pde_domain(sdf_sphere({0, 0, 0}, 1), domain_side::exterior);
  });
  refused([](P& p, O&) {
    p.equation = pde_equation::poisson;
    p.point_sources.push_back({{inf, 0, 0}, {1, 0, 0, 0}});
  });
  refused([](P& p, O&) {
    p.equation = pde_equation::poisson;
    p.curve_sources.push_back({{{0, 0, 0}}, {1, 0, 0, 0}});
  });
  refused([](P& p, O&) {
    p.equation = pde_equation::poisson;
    p.mesh_sources.push_back({{{0, 0, 0}}, {{0, 1, 2}}, {1, 0, 0, 0}});
  });
  refused([](P&, O& o) { o.walks = 0; });
  refused([](P&, O& o) { o.epsilon = -1; });
  refused([](P&, O& o) { o.epsilon = inf; });
  refused([](P&, O& o) { o.max_steps = 0; });
  refused([](P&, O& o) { o.tolerance = 1; });
  refused([](P&, O& o) { o.error = -1; });
  refused([](P&, O& o) { o.seconds = 0; });
  refused([](P&, O& o) { o.nested_walks = 0; });
  refused([](P&, O& o) { o.roulette_continue = 0; });
  const pde_domain d = problem().domain;
  CHECK_THROWS_AS(make_section_grid(d, {.origin = {9, 9, 9}}), std::invalid_argument);
  CHECK_THROWS_AS(make_section_grid(d, {.normal = {0, 0, 0}}), std::invalid_argument);
  CHECK_THROWS_AS(make_section_grid(d, {.resolution = 1}), std::invalid_argument);
  CHECK_THROWS_AS(make_section_grid(d, {.up = {0, 0, 2}}), std::invalid_argument);
  CHECK_THROWS_AS(make_section_grid(pde_domain(sdf_plane({0, 0, 0}, {0, 0, 1})), {}),
                  std::invalid_argument);
}
