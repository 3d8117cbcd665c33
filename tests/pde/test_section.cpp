#include <doctest/doctest.h>

#include "closed_forms.h"
#include "wisp/pde/section.h"

using namespace wisp;
using wisp::test::scores;

namespace {

struct shared_case {
  std::string name;
  pde_problem problem;
  std::function<double(const dvec3&)> exact;
};

std::vector<shared_case> cases() {
  std::vector<shared_case> all;
  const sdf parts[] = {sdf_box({0, 0, 0}, {0.8, 0.7, 0.6}), sdf_sphere({0.5, 0.4, 0.2}, 0.5)};
  const pde_domain d(sdf_difference(parts));
  const auto add = [&](const std::string& name, pde_equation e,
                       std::function<double(const dvec3&)> u) -> pde_problem& {
    pde_problem p;
    p.domain = d;
    p.equation = e;
    p.boundary = u;
    all.push_back({name, p, u});
    return all.back().problem;
  };
  add("laplace", pde_equation::laplace,
      [](const dvec3& p) { return std::exp(3 * p.x) * std::sin(3 * p.y) + p.z; });
  auto& poisson = add("poisson", pde_equation::poisson,
                      [](const dvec3& p) { return std::cos(3 * p.x) * std::exp(p.y); });
  poisson.source = [](const dvec3& p) { return -8 * std::cos(3 * p.x) * std::exp(p.y); };
  poisson.point_sources.push_back({{0.1, 0.05, 0}, {0, 0, 0, 0}});
  for (const double c : {1e-3, 3.0, 400.0, 1e5}) {
    auto& s = add("screened " + std::to_string(c), pde_equation::screened_poisson,
                  [](const dvec3& p) { return std::cos(p.x + 2 * p.y + 1); });
    s.screening = c;
    s.source = [c](const dvec3& p) { return -(5 + c) * std::cos(p.x + 2 * p.y + 1); };
  }
  const double k = 2;
  add("screened without a source", pde_equation::screened_poisson, [k](const dvec3& p) {
    return std::exp(k * p.x);
  }).screening = k * k;
  add("biharmonic", pde_equation::biharmonic, [](const dvec3& p) {
    return glm::dot(p, p) * (p.x * p.x - p.y * p.y + 1);
  }).boundary_laplacian = [](const dvec3& p) { return 14 * (p.x * p.x - p.y * p.y) + 6; };
  return all;
}

}  // namespace

TEST_CASE("pde: sections with shared walks are as far off as they say") {
  for (const shared_case& c : cases()) {
    CAPTURE(c.name);
    const section_grid grid =
        make_section_grid(c.problem.domain, {.origin = {0, 0, 0.05}, .resolution = 20});
    REQUIRE(grid.points.size() > 100);
    // few points of each of many runs, as errors of neighbours go together
    scores s;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      section_options o;
      o.solve.walks = 64;
      o.solve.epsilon = 1e-6;
      o.solve.seed = seed;
      const solution found = solve_section(c.problem, grid, o);
      REQUIRE(found.values.size() == grid.points.size());
      for (std::size_t i = seed % 29; i < grid.points.size(); i += 29) {
        REQUIRE(found.values[i].status == point_status::ok);
        // next to the boundary one walk in many goes far, and errors of few are not normal
        if (c.problem.domain.clearance(grid.points[i], 0.1) < 0.03) continue;
        s.add(found.values[i].mean.x, found.values[i].standard_error.x, c.exact(grid.points[i]));
      }
    }
    const double mean_score = s.sum / std::sqrt(s.count), mean_square = s.squares / s.count;
    CAPTURE(mean_score);
    CAPTURE(mean_square);
    CHECK(s.mean_is_right());
    // Errors come from 16 passes (squares have a mean of 15 / 13), and points of a run are
    // not independent.
    CHECK(s.squares / s.count < 1.9);
    CHECK(s.squares / s.count > 0.6);
  }
}

TEST_CASE("pde: sections with shared walks tell how many they make") {
  for (const std::uint64_t walks : {1u, 16u, 100u, 300u}) {
    CAPTURE(walks);
    pde_problem p;
    p.domain = pde_domain(sdf_sphere({0, 0, 0}, 1));
    p.boundary = [](const dvec3& x) { return x.x; };
    const section_grid grid = make_section_grid(p.domain, {.resolution = 96});
    section_options o;
    o.solve.walks = walks;
    std::uint64_t made = 0, planned = 0;
    o.solve.on_progress = [&](const solve_options::progress& now) {
      CHECK(now.walks > made);
      made = now.walks;
      planned = now.planned;
      return true;
    };
    const solution s = solve_section(p, grid, o);
    CHECK(made == planned);
    CHECK(s.walks == planned);
    // fewer than the cells would have made by themselves, but more for each of them
    CHECK((walks < 16 || s.walks < walks * grid.points.size()));
    for (const estimate& e : s.values) CHECK(e.walks >= 2 * walks * 9 / 10);
  }
}

TEST_CASE("pde: sections with shared walks have constants without error") {
  pde_problem p;
  p.domain = pde_domain(sdf_sphere({0, 0, 0}, 1));
  p.channels = 2;
  p.boundary = [](const dvec3&) { return dvec2{3, -1e6}; };
  section_options o;
  o.solve.walks = 1;
  for (const bool controlled : {true, false}) {
    o.solve.control_variates = controlled;
    const section_grid grid = make_section_grid(p.domain, {.resolution = 24});
    double worst = 0;
    for (const estimate& e : solve_section(p, grid, o).values) {
      worst = std::max({worst, std::abs(e.mean.x - 3), std::abs(e.mean.y * 1e-6 + 1)});
    }
    // without control variates the kernels of few walks have a mean that is not 1
    CHECK((worst < 1e-12) == controlled);
  }
}
