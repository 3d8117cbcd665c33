// Sums over walks, where budgets send them, messages of what is refused, and how right
// errors are.

#include <doctest/doctest.h>

#include <string>

#include "../../libs/pde/src/point_walks.h"
#include "../../libs/pde/src/tally.h"
#include "closed_forms.h"
#include "wisp/pde/section.h"

using namespace wisp;
using wisp::test::points_in;
using wisp::test::scores;

namespace {

const dbox3 unit_box{{-1, -1, -1}, {1, 1, 1}};

double u(const dvec3& p) { return std::exp(2 * p.x) * std::sin(2 * p.y) + p.z; }

pde_problem in_ball() {
  pde_problem p;
  p.domain = pde_domain(sdf_sphere({0, 0, 0}, 1));
  p.boundary = u;
  return p;
}

}  // namespace

TEST_CASE("pde: tallies join as if they were one") {
  rng_state rng = make_rng(3);
  tally<dvec4> all, joined;
  double sum = 0, squares = 0;
  constexpr int parts = 5, each = 7;
  for (int i = 0; i < parts; ++i) {
    tally<dvec4> part;
    for (int j = 0; j < each + i; ++j) {
      const double x = rand1d(rng) + i;  // parts that differ
      all.add(dvec4{x, 1, -x, 0});
      part.add(dvec4{x, 1, -x, 0});
      sum += x;
      squares += x * x;
    }
    joined.merge(part);
  }
  joined.merge({});
  const double n = parts * each + parts * (parts - 1) / 2;
  const double error = std::sqrt((squares - sum * sum / n) / (n * (n - 1)));
  for (const auto& t : {all, joined}) {
    CHECK(t.count == static_cast<std::uint64_t>(n));
    CHECK(t.mean.x == doctest::Approx(sum / n).epsilon(1e-13));
    CHECK(t.mean.z == doctest::Approx(-sum / n).epsilon(1e-13));
    CHECK(t.standard_error().x == doctest::Approx(error).epsilon(1e-12));
    CHECK(t.standard_error().y == 0);
  }
  CHECK(std::isnan(tally<dvec4>{}.standard_error().x));
}

TEST_CASE("pde: blocks of directions are opposite or even, and each is uniform") {
  // Second moments of each place of a block, within 5 standard errors: a false alarm in
  // 2e4 for all 16 places and components.
  rng_state rng = make_rng(4);
  dvec3 pair[2], lattice[16];
  block_directions(rng, pair);
  CHECK(glm::length(pair[0] + pair[1]) < 1e-12);
  constexpr int n = 20000;
  dvec3 sum[16] = {}, squares[16] = {};
  double nearest = 2;
  for (int i = 0; i < n; ++i) {
    block_directions(rng, lattice);
    for (int a = 0; a < 16; ++a) {
      sum[a] += lattice[a];
      squares[a] += lattice[a] * lattice[a];
      for (int b = 0; b < a && i < 50; ++b) {
        nearest = std::min(nearest, glm::distance(lattice[a], lattice[b]));
      }
    }
  }
  CHECK(nearest > 0.5);  // 16 that are independent come as near as 0.1 at once
  for (int a = 0; a < 16; ++a) {
    for (int c = 0; c < 3; ++c) {
      CHECK(std::abs(sum[a][c]) < 5 * std::sqrt(n / 3.0));
      CHECK(std::abs(squares[a][c] - n / 3.0) < 5 * std::sqrt(n * 4 / 45.0));
    }
  }
}

TEST_CASE("pde: time goes to points by deviation over the root of cost") {
  // A loud corner of the ball, and quiet points; costs differ with the distance from the
  // boundary. Rounds only, no clock: stopped from on_progress.
  pde_problem p = in_ball();
  p.boundary = [](const dvec3& x) { return x.x > 0 ? 100 * x.x * x.y : 0.1 * x.y; };
  const dvec3 points[] = {{0.9, 0.1, 0}, {0.99, 0, 0.02}, {-0.6, 0, 0}, {0, 0, 0}, {0.5, 0.5, 0.3}};
  solve_options o;
  o.walks = 64;
  o.seconds = 1e9;
  o.epsilon = 1e-5;
  o.on_progress = [](const solve_options::progress& now) { return now.walks < 60000; };
  const solution s = solve(p, points, o);
  CHECK(s.stopped);
  double least = 1e300, most = 0;
  for (const estimate& e : s.values) {
    // walks ~ deviation / root of steps; deviation is that of pairs, as of all points
    const double n = static_cast<double>(e.walks);
    const double wanted = e.standard_error.x * std::sqrt(n) / std::sqrt(e.mean_steps);
    CAPTURE(e.walks);
    CHECK(e.walks > 16);
    least = std::min(least, n / wanted);
    most = std::max(most, n / wanted);
  }
  MESSAGE("walks over what they should be, most to least: " << most / least);
  CHECK(most / least < 1.4);
}

TEST_CASE("pde: max_walks bounds what a budget may take") {
  const pde_problem p = in_ball();
  const dvec3 points[] = {{0.1, 0.2, 0.3}, {0.5, 0, 0}};
  for (const auto d : {first_directions::independent, first_directions::antithetic,
                       first_directions::stratified}) {
    solve_options o;
    o.directions = d;
    o.max_walks = 96;
    o.seconds = 100;
    for (const double error : {0.0, 1e-9}) {
      o.error = error;
      const solution s = solve(p, points, o);
      for (const estimate& e : s.values) CHECK(e.walks == 96);
      CHECK_FALSE(s.stopped);
      CHECK(s.seconds < 50);
    }
  }
}

TEST_CASE("pde: budgets of error hold for every channel and are honest") {
  pde_problem p = in_ball();
  p.channels = 2;
  p.boundary = [](const dvec3& x) { return dvec2{0.01 * u(x), u(x)}; };
  std::vector<dvec3> points;  // not next to the boundary, where few walks know too little
  for (const dvec3& q : points_in(p.domain, 400, unit_box)) {
    if (glm::length(q) < 0.8) points.push_back(q);
  }
  solve_options o;
  o.error = 0.02;
  o.epsilon = 1e-6;
  const solution s = solve(p, points, o);
  scores z;
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(s.values[i].standard_error.x <= 0.02);
    CHECK(s.values[i].standard_error.y <= 0.02);
    z.add(s.values[i].mean.y, s.values[i].standard_error.y, u(points[i]));
  }
  // Stopping where the error happens to be small makes squares somewhat larger than 1.
  CHECK(z.mean_is_right());
  CHECK(z.squares / z.count < 1.3 + 5 * std::sqrt(2.0 / z.count));
}

TEST_CASE("pde: a caller that stops at once has what was done") {
  const pde_problem p = in_ball();
  const auto points = points_in(p.domain, 300, unit_box);
  solve_options o;
  o.walks = 1 << 14;
  o.threads = 1;
  int calls = 0;
  o.on_progress = [&](const solve_options::progress& now) {
    CHECK(now.planned == 300u << 14);
    ++calls;
    return false;
  };
  const solution s = solve(p, points, o);
  CHECK(s.stopped);
  CHECK(calls == 1);
  std::uint64_t done = 0;
  for (const estimate& e : s.values) {
    done += e.walks;
    CHECK(std::isfinite(e.mean.x) == (e.walks > 0));
  }
  CHECK(done == s.walks);
  CHECK(done < 300u << 14);
}

TEST_CASE("pde: errors fall with the root of the walks over three decades") {
  // 250 points at each of six numbers of walks: the slope has a deviation of 0.008, and
  // 0.03 lies four of them away, a false alarm in 1e4.
  const pde_problem p = in_ball();
  const auto points = points_in(p.domain, 250, {{-0.6, -0.6, -0.6}, {0.6, 0.6, 0.6}});
  double mx = 0, my = 0, xx = 0, xy = 0, count = 0;
  for (const std::uint64_t n : {16, 64, 256, 1024, 4096, 16384}) {
    solve_options o;
    o.walks = n;
    o.seed = 100 + n;
    o.epsilon = 1e-4;
    const solution s = solve(p, points, o);
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      sum += std::pow(s.values[i].mean.x - u(points[i]), 2);
    }
    const double x = std::log(static_cast<double>(n)), y = 0.5 * std::log(sum);
    mx += x;
    my += y;
    xx += x * x;
    xy += x * y;
    ++count;
  }
  const double slope = (xy - mx * my / count) / (xx - mx * mx / count);
  MESSAGE("slope " << slope);
  CHECK(std::abs(slope + 0.5) < 0.03);
}

TEST_CASE("pde: intervals of gradients hold what they should") {
  // 95 % within 5 standard deviations of a binomial over 3 components of 700 points; they
  // are not independent, so that a false alarm is one in 1e4 rather than in 1e6.
  const pde_problem p = in_ball();
  const auto points = points_in(p.domain, 700, {{-0.55, -0.55, -0.55}, {0.55, 0.55, 0.55}});
  for (const bool control : {false, true}) {
    solve_options o;
    o.walks = 512;
    o.epsilon = 1e-5;
    o.gradient = true;
    o.control_variates = control;
    o.seed = 3;
    const solution s = solve(p, points, o);
    double within = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const dvec3& x = points[i];
      const double e = 2 * std::exp(2 * x.x);
      const dvec3 exact{e * std::sin(2 * x.y), e * std::cos(2 * x.y), 1};
      for (int a = 0; a < 3; ++a) {
        within += std::abs(s.gradients[i].mean[0][a] - exact[a]) <
                  1.96 * s.gradients[i].standard_error[0][a];
      }
    }
    const double n = 3 * 700;
    MESSAGE("coverage " << within / n);
    CHECK(std::abs(within / n - 0.95) < 5 * std::sqrt(0.05 * 0.95 / n));
  }
}

TEST_CASE("pde: sources that are not numbers are told by value and gradient") {
  pde_problem p = in_ball();
  p.equation = pde_equation::poisson;
  p.source = [](const dvec3& x) {
    return glm::distance(x, dvec3{0.5, 0, 0}) < 0.05 ? std::nan("") : 1.0;
  };
  const dvec3 points[] = {{0.3, 0, 0}, {-0.9, 0, 0}};
  int undefined = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    solve_options o;
    o.gradient = true;
    o.walks = 16;
    o.seed = seed;
    const solution s = solve(p, points, o);
    for (std::size_t i = 0; i < 2; ++i) {
      const bool told = s.values[i].status == point_status::undefined;
      undefined += told;
      CHECK(told == std::isnan(s.values[i].mean.x));
      CHECK(told == std::isnan(s.gradients[i].mean[0].x));
    }
  }
  CHECK(undefined > 20);
}

TEST_CASE("pde: what is refused is told in words of its own") {
  const auto message = [](auto change) {
    pde_problem p = in_ball();
    p.equation = pde_equation::poisson;
    change(p);
    try {
      check_problem(p);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string("nothing");
  };
  constexpr double inf = std::numeric_limits<double>::infinity();
  const auto says = [&](auto change, const char* word) {
    const std::string text = message(change);
    CAPTURE(text);
    CHECK(text.find(word) != std::string::npos);
  };
  using P = pde_problem;
  CHECK(message([](P&) {}) == "nothing");
  says([](P& p) { p.domain = {}; }, "domain is empty");
  says([](P& p) { p.channels = 0; }, "channels");
  says([](P& p) { p.channels = 5; }, "channels");
  says([](P& p) { p.boundary = {}; }, "boundary values");
  says([](P& p) { p.screening = -1; }, "not negative");
  says([](P& p) { p.screening = std::nan(""); }, "finite");
  says([](P& p) { p.screening = 1; }, "screened Poisson");
  says([](P& p) { p.infinity.x = inf; }, "infinity should be finite");
  says([](P& p) { p.equation = pde_equation::biharmonic; }, "Laplacian");
  const pde_domain outside(sdf_sphere({0, 0, 0}, 1), domain_side::exterior);
  says(
      [&](P& p) {
        p.equation = pde_equation::biharmonic;
        p.boundary_laplacian = u;
        p.domain = outside;
      },
      "exterior biharmonic");
  says(
      [&](P& p) {
        p.equation = pde_equation::screened_poisson;
        p.screening = 1;
        p.infinity.x = 2;
        p.domain = outside;
      },
      "tends to 0");
  says(
      [](P& p) {
        p.equation = pde_equation::laplace;
        p.source = u;
      },
      "no source");
  says(
      [](P& p) {
        p.equation = pde_equation::biharmonic;
        p.boundary_laplacian = u;
        p.point_sources = {{}};
      },
      "no source");
  says([](P& p) { p.point_sources = {{{0, inf, 0}}}; }, "point source");
  says([](P& p) { p.point_sources = {{{0, 0, 0}, {inf, 0, 0, 0}}}; }, "point source");
  says([](P& p) { p.curve_sources = {{{{0, 0, 0}}}}; }, "two points");
  says([](P& p) { p.curve_sources = {{{{0, 0, 0}, {inf, 0, 0}}}}; }, "finite points");
  says([](P& p) { p.curve_sources = {{{{0, 0, 0}, {1, 0, 0}}, {0, inf, 0, 0}}}; }, "strength");
  says([](P& p) { p.mesh_sources = {{{{0, 0, 0}}, {{0, 0, 1}}}}; }, "vertex");
  says([](P& p) { p.mesh_sources = {{{{0, inf, 0}}, {{0, 0, 0}}}}; }, "finite points");
  says([](P& p) { p.mesh_sources = {{{}, {}, {inf, 0, 0, 0}}}; }, "strength");
  says([](P& p) { p.source_peaks = {{{inf, 0, 0}}}; }, "peak");
  says([](P& p) { p.source_peaks = {{{0, 0, 0}, 0}}; }, "peak");
  says([](P& p) { p.source_peaks = {{{0, 0, 0}, 1, 0}}; }, "peak");
  // sections refuse the same options, whether walks are shared or not
  const pde_problem p = in_ball();
  const section_grid grid = make_section_grid(p.domain, {.resolution = 4});
  for (const bool share : {false, true}) {
    section_options o;
    o.share = share;
    o.solve.walks = 0;
    CHECK_THROWS_AS(solve_section(p, grid, o), std::invalid_argument);
    o.solve.walks = 16;
    o.solve.tolerance = 2;
    CHECK_THROWS_AS(solve_section(p, grid, o), std::invalid_argument);
    o.solve.tolerance = 0.3;
    CHECK_NOTHROW(solve_section(p, grid, o));
  }
}
