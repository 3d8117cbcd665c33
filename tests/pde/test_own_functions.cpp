// Functions of a program's own: what is taken for one, and what is said where there is none
// or where it gives no numbers.

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "wisp/pde/section.h"
#include "wisp/pde/solve.h"

using namespace wisp;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
const dbox3 unit_box{{-1, -1, -1}, {1, 1, 1}};

double ball(const dvec3& p) { return glm::length(p) - 1; }
double height(const dvec3& p) { return p.z; }

pde_problem in_ball() {
  pde_problem p;
  p.domain = pde_domain(ball, unit_box);
  p.boundary = height;
  return p;
}

std::string why_not(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "";
}
std::string why_not(const pde_problem& p) {
  return why_not([&] { solve(p, std::vector<dvec3>{{0, 0, 0}}); });
}

point_status status_at(const pde_problem& p, const dvec3& x) {
  const solution s = solve(p, std::vector<dvec3>{x});
  CHECK(std::isnan(s.values[0].mean.x) ==
        (s.values[0].status != point_status::ok && s.values[0].status != point_status::boundary));
  return s.values[0].status;
}

}  // namespace

TEST_CASE("pde: a function that is none makes an empty field") {
  using function = std::function<double(const dvec3&)>;
  double (*const null_pointer)(const dvec3&) = nullptr;
  CHECK_FALSE(boundary_field{});
  CHECK_FALSE(boundary_field(function{}));
  CHECK_FALSE(boundary_field(std::function<dvec3(dvec3)>{}));
  CHECK_FALSE(boundary_field(std::function<double(const boundary_point&)>{}));
  CHECK_FALSE(boundary_field(null_pointer));
  CHECK_FALSE(boundary_field(space_field{}));
  CHECK_FALSE(space_field(function{}));
  CHECK_FALSE(space_field(null_pointer));

  CHECK(boundary_field(height));
  CHECK(boundary_field(function{height}));
  CHECK(boundary_field([](const dvec3& p) { return p.x; }));
  CHECK(boundary_field(space_field(height)));
  CHECK(space_field([shift = 1.0](const dvec3& p) { return p.x + shift; }));

  pde_problem p = in_ball();
  p.boundary = function{};
  CHECK(why_not(p).find("boundary values are missing") != std::string::npos);
  CHECK(why_not([&] {
          solve_section(p, make_section_grid(p.domain, {.resolution = 8}));
        }).find("boundary values are missing") != std::string::npos);
  p.boundary = null_pointer;
  CHECK(why_not(p).find("boundary values are missing") != std::string::npos);
  p = in_ball();
  p.equation = pde_equation::biharmonic;
  p.boundary_laplacian = function{};
  CHECK(why_not(p).find("Laplacian") != std::string::npos);
  CHECK_THROWS_AS(boundary_field{}(boundary_point{}), std::bad_function_call);
}

TEST_CASE("pde: values of a field may be any numbers, its function has to be const") {
  const boundary_point at{{1, 2, 3}, 4, {0, 0}};
  CHECK(boundary_field([](const dvec3& p) { return vec3(p); })(at) == dvec4{1, 2, 3, 0});
  CHECK(boundary_field([](const dvec3& p) { return dvec2(p.y, p.z); })(at) == dvec4{2, 3, 0, 0});
  CHECK(boundary_field([](vec3 p) { return p.x; })(at) == dvec4{1, 0, 0, 0});
  CHECK(boundary_field([](const dvec3&) { return 7; })(at) == dvec4{7, 0, 0, 0});
  CHECK(boundary_field([](const boundary_point& p) { return p.element; })(at).x == 4);

  auto counting = [n = 0](const dvec3&) mutable { return n++; };
  auto text = [](const dvec3&) { return std::string("warm"); };
  static_assert(!std::is_constructible_v<boundary_field, decltype(counting)>);
  static_assert(!std::is_constructible_v<space_field, decltype(counting)>);
  static_assert(!std::is_constructible_v<boundary_field, decltype(text)>);
  static_assert(!std::is_constructible_v<boundary_field, double>);
}

TEST_CASE("pde: a domain of one's own needs a function and bounds") {
  const std::function<double(const dvec3&)> none;
  CHECK(why_not([&] { pde_domain(none, unit_box); }).find("no function") != std::string::npos);
  CHECK(why_not([] { pde_domain(ball, dbox3{}); }).find("bounds") != std::string::npos);
  CHECK(why_not([] {
          pde_domain(ball, dbox3{{not_a_number, 0, 0}, {1, 1, 1}});
        }).find("bounds") != std::string::npos);
  CHECK_FALSE(pde_domain(ball, infinite_box).empty());
  pde_problem p = in_ball();
  p.domain = {};
  CHECK(why_not(p).find("domain is empty") != std::string::npos);
}

TEST_CASE("pde: what is not a number is undefined where it is met") {
  pde_problem p = in_ball();
  CHECK(status_at(p, {0, 0, 0.5}) == point_status::ok);
  CHECK(status_at(p, {0, 0, 1}) == point_status::boundary);
  // of the boundary, at a point on it
  p.boundary = [](const dvec3&) { return not_a_number; };
  CHECK(status_at(p, {0, 0, 1}) == point_status::undefined);
  CHECK(status_at(p, {0, 0, 0.5}) == point_status::undefined);
  // of the distance, at the point and beside it
  for (const domain_side side : {domain_side::interior, domain_side::exterior}) {
    p = in_ball();
    p.domain = pde_domain([](const dvec3& q) { return q.x > 0.25 ? not_a_number : ball(q); },
                          unit_box, side);
    const double out = side == domain_side::interior ? 1 : 3;
    CHECK(status_at(p, {0.5 * out, 0, 0}) == point_status::undefined);
    CHECK(status_at(p, {0.2 * out, 0, 0}) == point_status::undefined);
    CHECK_FALSE(p.domain.contains({0.5, 0, 0}));
  }
  // channels that the problem does not have
  p = in_ball();
  p.boundary = [](const dvec3&) { return dvec2(1, 2); };
  const solution s = solve(p, std::vector<dvec3>{{0, 0, 1}, {0, 0, 0.5}});
  for (const estimate& e : s.values) CHECK(e.mean == dvec4{1, 0, 0, 0});
}

TEST_CASE("pde: an exception of a function comes out of solve") {
  struct trouble {};
  pde_problem p = in_ball();
  p.boundary = [](const dvec3&) -> double { throw trouble{}; };
  CHECK_THROWS_AS(solve(p, std::vector<dvec3>{{0, 0, 0}}), trouble);
  p = in_ball();
  p.domain = pde_domain([](const dvec3&) -> double { throw trouble{}; }, unit_box);
  CHECK_THROWS_AS(solve(p, std::vector<dvec3>{{0, 0, 0}}), trouble);
}

TEST_CASE("pde: options and grids that cannot be are refused") {
  const pde_problem p = in_ball();
  solve_options options;
  options.max_walks = 0;
  CHECK(why_not([&] {
          solve(p, std::vector<dvec3>{{0, 0, 0}}, options);
        }).find("max_walks") != std::string::npos);
  pde_problem other = p;
  other.equation = static_cast<pde_equation>(17);
  CHECK(why_not(other).find("equation") != std::string::npos);

  section_grid grid = make_section_grid(p.domain, {.resolution = 8});
  grid.cells.back() = static_cast<std::uint32_t>(grid.width * grid.height);
  CHECK(why_not([&] { solve_section(p, grid); }).find("cell") != std::string::npos);
  grid.cells.clear();
  CHECK(why_not([&] { solve_section(p, grid); }).find("cell") != std::string::npos);
}
