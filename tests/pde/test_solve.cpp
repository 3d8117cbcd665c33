#include <doctest/doctest.h>

#include "closed_forms.h"

using namespace wisp;
using wisp::test::known_problem;
using wisp::test::points_in;
using wisp::test::scores;

namespace {

constexpr double pi64 = 3.14159265358979323846;
const dbox3 unit_box{{-1, -1, -1}, {1, 1, 1}};

sdf ball(double radius = 1) { return sdf_sphere({0, 0, 0}, radius); }
sdf carved() {
  const sdf parts[] = {sdf_box({0, 0, 0}, {0.8, 0.7, 0.6}), sdf_sphere({0.5, 0.4, 0.2}, 0.5)};
  return sdf_difference(parts);
}

// u as data on the boundary, and what the equation makes of it inside.
known_problem make(const std::string& name, const pde_domain& domain, pde_equation equation,
                   std::function<double(const dvec3&)> u, std::function<dvec3(const dvec3&)> grad,
                   std::function<double(const dvec3&)> source = {}, double screening = 0,
                   std::function<double(const dvec3&)> laplacian = {}) {
  known_problem k{name, {}, u, grad};
  k.problem.domain = domain;
  k.problem.equation = equation;
  k.problem.screening = screening;
  k.problem.boundary = u;
  if (source) k.problem.source = source;
  if (laplacian) k.problem.boundary_laplacian = laplacian;
  return k;
}

std::vector<known_problem> interior_problems() {
  std::vector<known_problem> all;
  const pde_domain in_ball(ball()), in_carved(carved());
  for (const pde_domain& d : {in_ball, in_carved}) {
    all.push_back(make(
        "laplace xyz", d, pde_equation::laplace,
        [](const dvec3& p) { return p.x * p.y * p.z + p.x * p.x - p.y * p.y; },
        [](const dvec3& p) {
          return dvec3{p.y * p.z + 2 * p.x, p.x * p.z - 2 * p.y, p.x * p.y};
        }));
    all.push_back(make(
        "laplace exp(5x) cos 3y sin 4z", d, pde_equation::laplace,
        [](const dvec3& p) { return std::exp(5 * p.x) * std::cos(3 * p.y) * std::sin(4 * p.z); },
        [](const dvec3& p) {
          const double e = std::exp(5 * p.x);
          return dvec3{5 * e * std::cos(3 * p.y) * std::sin(4 * p.z),
                       -3 * e * std::sin(3 * p.y) * std::sin(4 * p.z),
                       4 * e * std::cos(3 * p.y) * std::cos(4 * p.z)};
        }));
    all.push_back(make(
        "poisson sines", d, pde_equation::poisson,
        [](const dvec3& p) {
          return std::sin(pi64 * p.x) * std::sin(pi64 * p.y) * std::sin(pi64 * p.z);
        },
        [](const dvec3& p) {
          const double sx = std::sin(pi64 * p.x), sy = std::sin(pi64 * p.y),
                       sz = std::sin(pi64 * p.z);
          return pi64 * dvec3{std::cos(pi64 * p.x) * sy * sz, sx * std::cos(pi64 * p.y) * sz,
                              sx * sy * std::cos(pi64 * p.z)};
        },
        [](const dvec3& p) {
          return -3 * pi64 * pi64 * std::sin(pi64 * p.x) * std::sin(pi64 * p.y) *
                 std::sin(pi64 * p.z);
        }));
    // |a|^2 = c + 2, so that f = 2 u
    for (const double c : {1e-6, 1.0}) {
      const double a = std::sqrt((c + 2) / 3);
      all.push_back(make(
          "screened exp, c = " + std::to_string(c), d, pde_equation::screened_poisson,
          [a](const dvec3& p) { return std::exp(a * (p.x + p.y + p.z)); },
          [a](const dvec3& p) { return dvec3{a} * std::exp(a * (p.x + p.y + p.z)); },
          [a](const dvec3& p) { return 2 * std::exp(a * (p.x + p.y + p.z)); }, c));
    }
    for (const double c : {50.0, 1e4, 1e8}) {
      all.push_back(make(
          "screened cosine, c = " + std::to_string(c), d, pde_equation::screened_poisson,
          [](const dvec3& p) { return std::cos(p.x + 2 * p.y + 1); },
          [](const dvec3& p) {
            return -std::sin(p.x + 2 * p.y + 1) * dvec3{1, 2, 0};
          },
          [c](const dvec3& p) { return -(5 + c) * std::cos(p.x + 2 * p.y + 1); }, c));
    }
    all.push_back(make(
        "biharmonic r^2 (x^2 - y^2)", d, pde_equation::biharmonic,
        [](const dvec3& p) { return glm::dot(p, p) * (p.x * p.x - p.y * p.y); },
        [](const dvec3& p) {
          const double r2 = glm::dot(p, p), q = p.x * p.x - p.y * p.y;
          return dvec3{2 * p.x * (q + r2), 2 * p.y * (q - r2), 2 * p.z * q};
        },
        {}, 0, [](const dvec3& p) { return 14 * (p.x * p.x - p.y * p.y); }));
  }
  return all;
}

void check(const known_problem& k, solve_options options, int points, const std::string& what,
           const dbox3& box = unit_box) {
  CAPTURE(k.name);
  CAPTURE(what);
  options.epsilon = 1e-6;
  const auto at = points_in(k.problem.domain, points, box);
  REQUIRE(static_cast<int>(at.size()) == points);
  const solution s = solve(k.problem, at, options);
  scores values, slopes;
  for (std::size_t i = 0; i < at.size(); ++i) {
    REQUIRE(s.values[i].status == point_status::ok);
    values.add(s.values[i].mean.x, s.values[i].standard_error.x, k.exact(at[i]));
    if (!options.gradient) continue;
    const dvec3 g = k.gradient(at[i]);
    for (int a = 0; a < 3; ++a) {
      slopes.add(s.gradients[i].mean[0][a], s.gradients[i].standard_error[0][a], g[a]);
    }
  }
  CHECK(s.unfinished == 0);
  INFO("values: " << values.sum / std::sqrt(values.count) << " " << values.squares / values.count);
  CHECK(values.mean_is_right());
  CHECK(values.spread_is_right());
  if (!options.gradient) return;
  INFO("gradients: " << slopes.sum / std::sqrt(slopes.count) << " "
                     << slopes.squares / slopes.count);
  CHECK(slopes.mean_is_right());
  CHECK(slopes.spread_is_right());
}

}  // namespace

TEST_CASE("pde: estimates of known solutions are as far off as they say") {
  for (const known_problem& k : interior_problems()) {
    solve_options o;
    o.walks = 1024;
    o.gradient = true;
    check(k, o, 60, "defaults");
  }
}

TEST_CASE("pde: first directions and control variates keep estimates right") {
  for (const known_problem& k : interior_problems()) {
    // too long a tail for so few walks
    if (k.name == "laplace exp(5x) cos 3y sin 4z") continue;
    for (const auto d : {first_directions::independent, first_directions::stratified}) {
      for (const bool control : {false, true}) {
        solve_options o;
        o.walks = 1024;
        o.gradient = true;
        o.directions = d;
        o.control_variates = control;
        o.seed = 5;
        check(k, o, 30, control ? "controlled" : "plain");
      }
    }
  }
}

TEST_CASE("pde: source samples may be uniform") {
  for (const known_problem& k : interior_problems()) {
    if (!k.problem.source) continue;
    solve_options o;
    o.walks = 1024;
    o.sampling = source_sampling::uniform;
    check(k, o, 40, "uniform");
  }
}

TEST_CASE("pde: biharmonic estimators agree") {
  for (const known_problem& k : interior_problems()) {
    if (k.problem.equation != pde_equation::biharmonic) continue;
    for (const auto b : {biharmonic_estimator::tree, biharmonic_estimator::nested}) {
      for (const int n : {1, 3}) {
        solve_options o;
        o.walks = 512;
        o.gradient = true;
        o.biharmonic = b;
        o.nested_walks = n;
        check(k, o, 40, b == biharmonic_estimator::tree ? "tree" : "nested");
      }
    }
  }
}

TEST_CASE("pde: exterior problems") {
  const dbox3 around{{-4, -4, -4}, {4, 4, 4}};
  std::vector<known_problem> all;
  const dvec3 a{0.2, -0.1, 0.3};
  for (const sdf& solid : {ball(), carved()}) {
    const pde_domain d(solid, domain_side::exterior);
    const dvec3 inside =
        glm::length(a) < 0.5 && signed_distance(solid, a) < 0 ? a : dvec3{-0.3, -0.2, 0};
    all.push_back(make(
        "1 / |x - a|", d, pde_equation::laplace,
        [inside](const dvec3& p) { return 1 / glm::distance(p, inside); },
        [inside](const dvec3& p) {
          const double r = glm::distance(p, inside);
          return (inside - p) / (r * r * r);
        }));
    all.push_back(make(
        "3 + z / r^3", d, pde_equation::laplace,
        [inside](const dvec3& p) {
          const dvec3 q = p - inside;
          return 3 + q.z / std::pow(glm::length(q), 3);
        },
        [inside](const dvec3& p) {
          const dvec3 q = p - inside;
          const double r = glm::length(q);
          return dvec3{0, 0, 1} / (r * r * r) - 3 * q.z / std::pow(r, 5) * q;
        }));
    all.back().problem.infinity = {3, 0, 0, 0};
    for (const double k : {1e-3, 1.0}) {
      all.push_back(make(
          "screened exp(-k r) / r", d, pde_equation::screened_poisson,
          [inside, k](const dvec3& p) {
            const double r = glm::distance(p, inside);
            return std::exp(-k * (r - 1)) / r;
          },
          [inside, k](const dvec3& p) {
            const double r = glm::distance(p, inside);
            return -(1 + k * r) / (r * r) * std::exp(-k * (r - 1)) * (p - inside) / r;
          },
          {}, k * k));
    }
    // lap (1 + r^2)^(-1/2) = -3 (1 + r^2)^(-5/2)
    all.push_back(make(
        "poisson (1 + r^2)^(-1/2)", d, pde_equation::poisson,
        [](const dvec3& p) { return 1 / std::sqrt(1 + glm::dot(p, p)); },
        [](const dvec3& p) { return -p * std::pow(1 + glm::dot(p, p), -1.5); },
        [](const dvec3& p) { return -3 * std::pow(1 + glm::dot(p, p), -2.5); }));
  }
  for (const known_problem& k : all) {
    solve_options o;
    o.walks = 1024;
    o.gradient = true;
    check(k, o, 40, "sphere", around);
    if (k.problem.source) continue;
    o.exterior = exterior_estimator::roulette;
    check(k, o, 40, "roulette", around);
  }
}
