// The stiff and extreme cases that estimates have to survive, each with its answer.

#include <doctest/doctest.h>

#include "closed_forms.h"
#include "sphere_mesh.h"
#include "wisp/geometry/bvh.h"
#include "wisp/pde/section.h"

using namespace wisp;
using wisp::test::domain_of;
using wisp::test::make_sphere;
using wisp::test::points_in;
using wisp::test::scores;
using wisp::test::triangles;

namespace {

// (1 - sinh kr / (r sinh k)) / c: the unit ball with f = -1, g = 0.
double screened_ball(double r, double c) {
  const double k = std::sqrt(c);
  if (k < 1e-2) {
    // (1 - r^2) / 6 - c (7 - 10 r^2 + 3 r^4) / 360 + ...
    return (1 - r * r) / 6 - c * (7 - 10 * r * r + 3 * r * r * r * r) / 360;
  }
  if (r == 0) return (1 - 2 * k * std::exp(-k) / -std::expm1(-2 * k)) / c;
  return (1 - std::exp(-k * (1 - r)) * std::expm1(-2 * k * r) / std::expm1(-2 * k) / r) / c;
}

pde_problem constant_source(const pde_domain& domain, double c, double f = -1) {
  pde_problem p;
  p.domain = domain;
  p.equation = pde_equation::screened_poisson;
  p.screening = c;
  p.boundary = [](const dvec3&) { return 0.0; };
  p.source = [f](const dvec3&) { return f; };
  return p;
}

// The estimate at a point lies within five standard errors and `slack` times the answer:
// a false alarm in two million.
void check_value(const pde_problem& p, const dvec3& at, double expected, solve_options o = {},
                 double slack = 1e-9) {
  if (o.epsilon == 0) o.epsilon = 1e-6 * p.domain.size();
  const dvec3 points[] = {at};
  const solution s = solve(p, points, o);
  REQUIRE(s.values[0].status == point_status::ok);
  CHECK(s.unfinished == 0);
  const double mean = s.values[0].mean.x, error = s.values[0].standard_error.x;
  CAPTURE(mean);
  CAPTURE(error);
  CAPTURE(expected);
  CHECK(std::abs(mean - expected) <= 5 * error + slack * std::abs(expected));
}

pde_problem harmonic(const pde_domain& domain) {
  pde_problem p;
  p.domain = domain;
  p.boundary = [](const dvec3& x) { return x.x * x.y + x.z; };
  return p;
}

void check_harmonic(const pde_domain& domain, const dbox3& box) {
  const auto points = points_in(domain, 40, box, 9);
  REQUIRE(points.size() == 40);
  solve_options o;
  o.walks = 512;
  o.epsilon = 1e-6 * domain.size();
  const solution s = solve(harmonic(domain), points, o);
  CHECK(s.unfinished == 0);
  scores z;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const dvec3& p = points[i];
    z.add(s.values[i].mean.x, s.values[i].standard_error.x, p.x * p.y + p.z);
  }
  CHECK(z.mean_is_right());
  CHECK(z.squares / z.count < 1 + 6 * std::sqrt(2.0 / z.count));
}

}  // namespace

TEST_CASE("pde: any screening of a constant source in the unit ball") {
  const pde_domain ball(sdf_sphere({0, 0, 0}, 1));
  for (const double c : {0.0, 1e-10, 1e-6, 1e-4, 0.01, 1.0, 100.0, 1e4, 1e6, 1e8, 1e10}) {
    CAPTURE(c);
    for (const double r : {0.0, 0.5, 0.999}) {
      CAPTURE(r);
      solve_options o;
      o.walks = 2048;
      // the shell takes 1e-7 of the slope at the boundary, which is 1 / k or 1 / 3
      o.epsilon = 1e-7 / std::max(1.0, std::sqrt(c));
      check_value(constant_source(ball, c), {r, 0, 0}, screened_ball(r, c), o, 1e-5);
    }
  }
}

TEST_CASE("pde: balls of any size and screening") {
  for (const double radius : {1e-6, 1e-4, 1.0, 1e6}) {
    for (const double x : {1e-8, 1e-3, 1.0, 30.0, 1e4}) {
      CAPTURE(radius);
      CAPTURE(x);
      const double c = x * x / (radius * radius);
      solve_options o;
      o.walks = 1024;
      o.epsilon = radius * 1e-7 / std::max(1.0, x);
      check_value(constant_source(pde_domain(sdf_sphere({0, 0, 0}, radius)), c),
                  {0.5 * radius, 0, 0}, radius * radius * screened_ball(0.5, x * x), o, 1e-5);
    }
  }
}

TEST_CASE("pde: the bias of the shell falls with its width") {
  const pde_domain ball(sdf_sphere({0, 0, 0}, 1));
  const double exact = 0.125;
  double last = 1;
  for (const double epsilon : {0.1, 0.01, 1e-3, 1e-5, 2e-7}) {
    solve_options o;
    o.walks = 1 << 16;
    o.epsilon = epsilon;
    const dvec3 points[] = {{0.5, 0, 0}};
    const solution s = solve(constant_source(ball, 0), points, o);
    const double off = std::abs(s.values[0].mean.x / exact - 1);
    CAPTURE(epsilon);
    CHECK(off < 3 * epsilon + 5 * s.values[0].standard_error.x / exact);
    if (epsilon > 1e-3) CHECK(off < 0.5 * last);
    last = off;
  }
}

TEST_CASE("pde: scales from 1e-6 to 1e6 and an origin 1e5 boxes away") {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double offset : {0.0, 1e5}) {
      CAPTURE(scale);
      CAPTURE(offset);
      const dvec3 center = dvec3{offset, -offset, 0.5 * offset} * scale;
      const triangles t = make_sphere(3, scale, center);
      for (const pde_domain& d : {domain_of(t), pde_domain(sdf_sphere(center, scale))}) {
        pde_problem p;
        p.domain = d;
        p.boundary = [=](const dvec3& x) {
          const dvec3 q = (x - center) / scale;
          return q.x * q.y + q.z;
        };
        const dvec3 at{0.3, -0.4, 0.2};
        solve_options o;
        o.walks = 1024;
        check_value(p, center + scale * at, at.x * at.y + at.z, o, 1e-5);
      }
    }
  }
}

TEST_CASE("pde: a gap of 1e-4 between walls") {
  const sdf parts[] = {sdf_sphere({0, 0, 0}, 1), sdf_sphere({0, 0, 0}, 1 - 1e-4)};
  triangles outer = make_sphere(5, 1);
  const triangles inner = make_sphere(5, 1 - 1e-4);
  const int n = static_cast<int>(outer.positions.size());
  outer.positions.insert(outer.positions.end(), inner.positions.begin(), inner.positions.end());
  for (const ivec3& f : inner.indices) outer.indices.push_back({n + f[0], n + f[2], n + f[1]});
  const auto u = [](const dvec3& p) { return 1 / glm::length(p); };
  // facets lie within 4e-4 of the sphere: walls of a mesh are as far apart as its radii
  const double middle = 1 - 0.5e-4;
  pde_problem p;
  p.boundary = u;
  solve_options o;
  o.walks = 512;
  o.epsilon = 1e-8;
  p.domain = pde_domain(sdf_difference(parts));
  check_value(p, {0, 0, middle}, 1 / middle, o);
  p.domain = domain_of(outer);
  check_value(p, {0, 0, middle}, 1 / middle, o);
}

TEST_CASE("pde: starts on the boundary and outside and on a vertex and at a source") {
  const triangles t = make_sphere(2, 1);
  pde_problem p = constant_source(domain_of(t), 0);
  p.boundary = [](const dvec3& x) { return 2 + x.z; };
  p.point_sources.push_back({{0.2, 0, 0}, {1, 0, 0, 0}});
  const dvec3 center = (t.positions[0] + t.positions[2] + t.positions[4]) / 3.0;
  const dvec3 on_face = (t.positions[static_cast<std::size_t>(t.indices[0][0])] +
                         t.positions[static_cast<std::size_t>(t.indices[0][1])]) /
                        2.0;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const dvec3 points[] = {{0, 0, 1},   {0, 0, 2},    on_face,       {0.2, 0, 0},
                          {nan, 0, 0}, 2.0 * center, {1e300, 0, 0}, {0.2, 1e-9, 0}};
  for (const auto way : {point_source_estimator::fundamental, point_source_estimator::balls}) {
    solve_options o;
    o.gradient = true;
    o.point_sources = way;
    const solution s = solve(p, points, o);
    CHECK(s.values[0].status == point_status::boundary);
    CHECK(s.values[0].mean.x == 3);
    CHECK(s.values[0].walks == 0);
    CHECK(s.values[1].status == point_status::outside);
    CHECK(std::isnan(s.values[1].mean.x));
    CHECK(std::isnan(s.gradients[1].mean[0].x));
    // rounding decides on which side of a face it lies, but it is no more than next to it
    if (s.values[2].status != point_status::outside) {
      CHECK(s.values[2].mean.x == doctest::Approx(2 + on_face.z).epsilon(1e-6));
    }
    CHECK(s.values[3].status == point_status::singular);
    CHECK(std::isnan(s.values[3].mean.x));
    CHECK(s.values[4].status == point_status::outside);
    CHECK(s.values[6].status == point_status::outside);
    // next to a source of strength 1, u is about -1 / (4 pi 1e-9)
    CHECK(s.values[7].mean.x == doctest::Approx(-1 / (4 * 3.14159265358979 * 1e-9)).epsilon(1e-6));
  }
}

TEST_CASE("pde: a source with a pole") {
  // lap r = 2 / r, lap log r = 1 / r^2
  const pde_domain ball(sdf_sphere({0, 0, 0}, 1));
  pde_problem p;
  p.domain = ball;
  p.equation = pde_equation::poisson;
  p.boundary = [](const dvec3&) { return 0.0; };
  solve_options o;
  o.walks = 4096;
  p.source = [](const dvec3& x) { return 2 / glm::length(x); };
  for (const double r : {0.0, 0.01, 0.5}) check_value(p, {0, r, 0}, r - 1, o, 1e-5);
  p.source = [](const dvec3& x) { return 1 / glm::dot(x, x); };
  for (const double r : {0.2, 0.5}) check_value(p, {0, r, 0}, std::log(r), o, 1e-5);
}

TEST_CASE("pde: meshes with degenerate and doubled and inverted triangles and NaN vertices") {
  const dbox3 box{{-0.7, -0.7, -0.7}, {0.7, 0.7, 0.7}};
  triangles t = make_sphere(4, 1);
  const auto n = t.indices.size();
  triangles broken = t;
  for (std::size_t i = 0; i < n; i += 7) broken.indices.push_back(t.indices[i]);  // doubled
  for (std::size_t i = 0; i < n; i += 11) {                                       // no area
    broken.indices.push_back({t.indices[i][0], t.indices[i][0], t.indices[i][1]});
  }
  broken.positions.push_back({NAN, 0, 0});
  broken.indices.push_back({0, 1, static_cast<int>(broken.positions.size()) - 1});
  check_harmonic(domain_of(broken), box);
  triangles inverted = t;
  for (ivec3& f : inverted.indices) std::swap(f[1], f[2]);
  check_harmonic(domain_of(inverted), box);
  triangles mixed = t;  // one face in fifty the wrong way round
  for (std::size_t i = 0; i < n; i += 50) std::swap(mixed.indices[i][1], mixed.indices[i][2]);
  check_harmonic(domain_of(mixed), box);
}

TEST_CASE("pde: self-intersecting and non-manifold meshes") {
  triangles a = make_sphere(4, 1, {-0.5, 0, 0});
  const triangles b = make_sphere(4, 1, {0.5, 0, 0});
  const int n = static_cast<int>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const ivec3& f : b.indices) a.indices.push_back(f + n);
  // all of their triangles are boundary, those within the other ball too
  check_harmonic(domain_of(a), {{-1.2, -0.8, -0.8}, {1.2, 0.8, 0.8}});
  triangles fin = make_sphere(4, 1);  // an edge with three faces
  fin.positions.push_back({0, 0, 0.8});
  fin.indices.push_back(
      {fin.indices[0][0], fin.indices[0][1], static_cast<int>(fin.positions.size()) - 1});
  check_harmonic(domain_of(fin), {{-0.7, -0.7, -0.7}, {0.7, 0.7, 0.7}});
}

TEST_CASE("pde: an open mesh loses walks and says so") {
  triangles t = make_sphere(4, 1);
  std::erase_if(t.indices, [&](const ivec3& f) {
    return t.positions[static_cast<std::size_t>(f[0])].z > 0.8;
  });
  const pde_domain d = domain_of(t);
  const dvec3 points[] = {{0, 0, 0}, {0, 0, -0.5}, {0.3, 0, 0.4}};
  solve_options o;
  o.walks = 1024;
  const solution s = solve(harmonic(d), points, o);
  CHECK(s.unfinished > 10);
  for (const estimate& e : s.values) CHECK(std::isfinite(e.mean.x));
}

TEST_CASE("pde: empty domains are refused and parts need not be connected") {
  const sdf empty[] = {sdf_sphere({0, 0, 0}, 1), sdf_sphere({0, 0, 0}, 2)};
  const sdf apart[] = {sdf_sphere({-5, 0, 0}, 1), sdf_sphere({5, 0, 0}, 1)};
  const sdf disjoint = sdf_intersection(apart);
  CHECK_THROWS_AS(solve(harmonic(pde_domain()), {}, {}), std::invalid_argument);
  CHECK_THROWS_AS(solve(harmonic(pde_domain(disjoint)), {}, {}), std::invalid_argument);
  CHECK_THROWS_AS(solve(harmonic(domain_of({{}, {}})), {}, {}), std::invalid_argument);
  // empty, though its box does not tell: nowhere is inside
  const pde_domain hollow(sdf_difference(empty));
  const dvec3 points[] = {{0, 0, 0}, {0.9, 0, 0}};
  const solution none = solve(harmonic(hollow), points, {});
  for (const estimate& e : none.values) CHECK(e.status == point_status::outside);
  CHECK_THROWS_AS(make_section_grid(hollow, {}), std::invalid_argument);
  const pde_domain both(sdf_union(apart));
  check_harmonic(both, {{-6, -1, -1}, {-4, 1, 1}});
  check_harmonic(both, {{4, -1, -1}, {6, 1, 1}});
}

TEST_CASE("pde: walks pass from one part of a union to another") {
  const dbox3 box{{-1, -0.5, -0.5}, {1, 0.5, 0.5}};
  const sdf overlapping[] = {sdf_box({-0.4, 0, 0}, {0.6, 0.5, 0.5}),
                             sdf_box({0.4, 0, 0}, {0.6, 0.5, 0.5})};
  check_harmonic(pde_domain(sdf_union(overlapping)), box);
  // Where parts only touch, values are 0 on what they share, and walks are held up there
  // until they are cut short, which is counted.
  const sdf touching[] = {sdf_box({-0.5, 0, 0}, {0.5, 0.5, 0.5}),
                          sdf_box({0.5, 0, 0}, {0.5, 0.5, 0.5})};
  const dvec3 points[] = {{0.1, 0.2, 0}};
  solve_options o;
  o.epsilon = 1e-5;
  CHECK(solve(harmonic(pde_domain(sdf_union(touching))), points, o).unfinished > 0);
}

TEST_CASE("pde: functions that are far from distances take more steps") {
  const dbox3 box{{-1, -1, -1}, {1, 1, 1}};
  const auto quarter = [](const dvec3& p) { return 0.25 * (glm::length(p) - 1); };
  pde_problem p = harmonic(pde_domain(quarter, box));
  solve_options o;
  o.max_steps = 1 << 14;
  o.walks = 256;
  check_value(p, {0.3, -0.2, 0.5}, 0.44, o, 1e-5);
  p.domain = pde_domain(quarter, box, domain_side::exterior);
  p.boundary = [](const dvec3& x) { return 1 / glm::distance(x, dvec3{0.1, 0.2, 0}); };
  check_value(p, {0, 0, 3}, 1 / glm::distance(dvec3{0, 0, 3}, dvec3{0.1, 0.2, 0}), o, 1e-5);
}

TEST_CASE("pde: walks that are cut short are counted") {
  const pde_domain ball(sdf_sphere({0, 0, 0}, 1));
  solve_options o;
  o.max_steps = 3;
  const dvec3 points[] = {{0.3, 0, 0}};
  const solution s = solve(harmonic(ball), points, o);
  CHECK(s.unfinished > s.walks / 2);
  CHECK(s.values[0].unfinished == s.unfinished);
}
