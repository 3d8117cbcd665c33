// Stiff and extreme cases beyond those of values inside of balls: gradients, equations of
// any size, solids that touch, leaves and meshes of one's own.

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

// The slope along r of (1 - sinh kr / (r sinh k)) / c, the unit ball with f = -1, g = 0.
double screened_slope(double r, double c) {
  const double k = std::sqrt(c);
  if (k < 1e-2) return -r / 3 + c * (20 * r - 12 * r * r * r) / 360;
  const double e = std::exp(-k * (1 - r)) / -std::expm1(-2 * k);
  const double sinh = e * -std::expm1(-2 * k * r), cosh = e * (1 + std::exp(-2 * k * r));
  return -(k * r * cosh - sinh) / (r * r * c);
}

// A value or slope lies within five standard errors and `slack` times `size`, what such
// numbers are like: a false alarm in two million.
void near(double mean, double error, double expected, double size, double slack = 1e-5) {
  CAPTURE(mean);
  CAPTURE(error);
  CAPTURE(expected);
  CHECK(std::abs(mean - expected) <= 5 * error + slack * size);
}

// Values and slopes at many points of a problem whose solution is known, as z-scores.
template <typename U, typename G>
void check(const pde_problem& p, const U& u, const G& gradient, const dbox3& box,
           solve_options o = {}) {
  const auto points = points_in(p.domain, 40, box, 21);
  REQUIRE(points.size() == 40);
  o.gradient = true;
  if (o.epsilon == 0) o.epsilon = 1e-6 * p.domain.size();
  const solution s = solve(p, points, o);
  CHECK(s.unfinished == 0);
  scores values, slopes;
  for (std::size_t i = 0; i < points.size(); ++i) {
    REQUIRE(s.values[i].status == point_status::ok);
    values.add(s.values[i].mean.x, s.values[i].standard_error.x, u(points[i]));
    const dvec3 g = gradient(points[i]);
    for (int a = 0; a < 3; ++a) {
      slopes.add(s.gradients[i].mean[0][a], s.gradients[i].standard_error[0][a], g[a]);
    }
  }
  const double squares = values.squares / values.count, sq = slopes.squares / slopes.count;
  CAPTURE(squares);
  CAPTURE(sq);
  CHECK(values.mean_is_right());
  CHECK(slopes.mean_is_right());
  CHECK(squares < 1 + 6 * std::sqrt(2.0 / values.count));
  CHECK(sq < 1 + 6 * std::sqrt(2.0 / slopes.count));
}

}  // namespace

TEST_CASE("pde: slopes for any screening of a constant source in the unit ball") {
  pde_problem p;
  p.domain = pde_domain(sdf_sphere({0, 0, 0}, 1));
  p.equation = pde_equation::screened_poisson;
  p.boundary = [](const dvec3&) { return 0.0; };
  p.source = [](const dvec3&) { return -1.0; };
  for (const double c : {0.0, 1e-10, 1e-4, 1.0, 100.0, 1e4, 1e8, 1e10}) {
    CAPTURE(c);
    p.screening = c;
    for (const double r : {0.5, 0.99}) {
      CAPTURE(r);
      solve_options o;
      o.walks = 1024;
      o.gradient = true;
      o.epsilon = 1e-7 / std::max(1.0, std::sqrt(c));
      const dvec3 points[] = {r * dvec3{0.6, 0, 0.8}};
      const solution s = solve(p, points, o);
      const dvec3 mean = s.gradients[0].mean[0], error = s.gradients[0].standard_error[0];
      const double slope = screened_slope(r, c), size = 1 / std::max(3.0, std::sqrt(c));
      near(mean.x, error.x, 0.6 * slope, size);
      near(mean.y, error.y, 0, size);
      near(mean.z, error.z, 0.8 * slope, size);
    }
  }
}

TEST_CASE("pde: every equation at any size and far from the origin") {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double offset : {0.0, 1e5}) {
      CAPTURE(scale);
      CAPTURE(offset);
      const dvec3 o = dvec3{offset, -offset, 0.5 * offset} * scale;
      const auto q = [=](const dvec3& x) { return (x - o) / scale; };
      const dbox3 box{o - 0.6 * scale, o + 0.6 * scale};
      pde_problem p;
      p.domain = pde_domain(sdf_sphere(o, scale));
      solve_options options;
      options.walks = 512;
      options.epsilon = 2e-6 * scale;
      // lap (r^2 (x^2 - y^2)) = 14 (x^2 - y^2), by the unit of length squared
      const auto u = [=](const dvec3& x) {
        const dvec3 y = q(x);
        return glm::dot(y, y) * (y.x * y.x - y.y * y.y);
      };
      const auto gradient = [=](const dvec3& x) {
        const dvec3 y = q(x);
        const double r2 = glm::dot(y, y), d = y.x * y.x - y.y * y.y;
        return dvec3{2 * y.x * (d + r2), 2 * y.y * (d - r2), 2 * y.z * d} / scale;
      };
      const auto laplacian = [=](const dvec3& x) {
        const dvec3 y = q(x);
        return 14 * (y.x * y.x - y.y * y.y) / (scale * scale);
      };
      p.boundary = u;
      p.equation = pde_equation::biharmonic;
      p.boundary_laplacian = laplacian;
      check(p, u, gradient, box, options);
      p.equation = pde_equation::poisson;
      p.source = laplacian;
      check(p, u, gradient, box, options);
      p.equation = pde_equation::screened_poisson;
      p.screening = 5 / (scale * scale);
      p.source = [=](const dvec3& x) { return laplacian(x) - 5 / (scale * scale) * u(x); };
      check(p, u, gradient, box, options);
    }
  }
}

TEST_CASE("pde: solids that touch let walks through if they may take their time") {
  // Values are 0 on a face that two boxes share, and walks cross it by steps of epsilon:
  // some 1 / epsilon of them.
  const sdf boxes[] = {sdf_box({-0.5, 0, 0}, {0.5, 0.5, 0.5}),
                       sdf_box({0.5, 0, 0}, {0.5, 0.5, 0.5})};
  pde_problem p;
  p.domain = pde_domain(sdf_union(boxes));
  const auto u = [](const dvec3& x) { return 2 * x.x * x.y + x.z; };
  p.boundary = u;
  solve_options o;
  o.epsilon = 4e-3;
  o.max_steps = 1 << 16;
  o.walks = 512;
  scores z;
  const auto points = points_in(p.domain, 30, {{-0.7, -0.3, -0.3}, {0.7, 0.3, 0.3}}, 5);
  const solution s = solve(p, points, o);
  CHECK(s.unfinished == 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double error = std::hypot(s.values[i].standard_error.x, o.epsilon);
    z.add(s.values[i].mean.x, error, u(points[i]));
  }
  CHECK(z.mean_is_right());
  CHECK(z.squares / z.count < 1 + 6 * std::sqrt(2.0 / z.count));
  // had the face been a wall that takes the nearest value, walks would have ended there at
  // x = 0 from either side: the answer at these points tells the two apart
  p.boundary = [](const dvec3& x) { return std::abs(x.x) > 0.999 ? 1.0 : x.x < 0 ? 0.3 : 0.7; };
  const dvec3 middle[] = {{1e-3, 0, 0}, {-1e-3, 0, 0}};
  const solution both = solve(p, middle, o);
  CHECK(std::abs(both.values[0].mean.x - both.values[1].mean.x) <
        5 * std::hypot(both.values[0].standard_error.x, both.values[1].standard_error.x) + 0.01);
  // two spheres that touch in a point: hardly a walk passes, none is lost
  const sdf spheres[] = {sdf_sphere({-1, 0, 0}, 1), sdf_sphere({1, 0, 0}, 1)};
  p.domain = pde_domain(sdf_union(spheres));
  p.boundary = u;
  check(p, u,
        [](const dvec3& x) {
          return dvec3{2 * x.y, 2 * x.x, 1};
        },
        {{-1.5, -0.6, -0.6}, {1.5, 0.6, 0.6}}, {.walks = 512});
}

TEST_CASE("pde: leaves of one's own may be bounds of the distance") {
  struct quarter final : sdf_leaf_base {
    double distance(const dvec3& p, double) const override { return 0.25 * (glm::length(p) - 1); }
    sdf_properties properties() const override {
      sdf_properties about;
      about.bounds = {{-1, -1, -1}, {1, 1, 1}};
      return about;
    }
  };
  const auto leaf = sdf_leaf(std::make_shared<quarter>());
  const sdf parts[] = {leaf, sdf_sphere({0.5, 0.4, 0.2}, 0.4)};
  pde_problem p;
  const auto u = [](const dvec3& x) { return x.x * x.y * x.z + x.x; };
  p.boundary = u;
  for (const sdf& solid : {leaf, sdf_difference(parts)}) {
    p.domain = pde_domain(solid);
    check(p, u,
          [](const dvec3& x) {
            return dvec3{x.y * x.z + 1, x.x * x.z, x.x * x.y};
          },
          {{-0.8, -0.8, -0.8}, {0.8, 0.8, 0.8}}, {.walks = 512, .max_steps = 1 << 14});
  }
}

TEST_CASE("pde: outside of meshes of any size") {
  const dvec3 inside{0.2, -0.1, 0.3};
  for (const double scale : {1e-6, 1.0, 1e6}) {
    CAPTURE(scale);
    pde_problem p;
    p.domain = domain_of(make_sphere(3, scale), domain_side::exterior);
    p.infinity = {3, 0, 0, 0};
    const auto u = [=](const dvec3& x) { return 3 + 1 / glm::distance(x / scale, inside); };
    p.boundary = u;
    check(p, u,
          [=](const dvec3& x) {
            const double r = glm::distance(x / scale, inside);
            return (inside - x / scale) / (r * r * r * scale);
          },
          {dvec3{-4 * scale}, dvec3{4 * scale}}, {.walks = 512});
  }
}

TEST_CASE("pde: data of triangles comes with element and barycentrics") {
  // numbers at vertices, joined linearly in each triangle: those of a linear function
  const triangles t = make_sphere(3, 1);
  const auto linear = [](const dvec3& x) { return 1 + x.x - 2 * x.y + 3 * x.z; };
  std::vector<double> at_vertices;
  for (const dvec3& v : t.positions) at_vertices.push_back(linear(v));
  pde_problem p;
  p.domain = domain_of(t);
  p.boundary = [&](const boundary_point& b) {
    if (b.element < 0) return std::nan("");
    const ivec3 f = t.indices[static_cast<std::size_t>(b.element)];
    const auto v = [&](int k) { return at_vertices[static_cast<std::size_t>(f[k])]; };
    return (1 - b.uv.x - b.uv.y) * v(0) + b.uv.x * v(1) + b.uv.y * v(2);
  };
  check(p, linear,
        [](const dvec3&) {
          return dvec3{1, -2, 3};
        },
        {{-0.7, -0.7, -0.7}, {0.7, 0.7, 0.7}}, {.walks = 512});
}

TEST_CASE("pde: the bias of a shell of a thousandth") {
  // The ball with f = -1 at r = 0.5: u is 1/8, and what ends walks at epsilon takes about
  // epsilon / 3 away from it. The error is 4e-4 of u; a false alarm in two million.
  pde_problem p;
  p.domain = pde_domain(sdf_sphere({0, 0, 0}, 1));
  p.equation = pde_equation::poisson;
  p.boundary = [](const dvec3&) { return 0.0; };
  p.source = [](const dvec3&) { return -1.0; };
  solve_options o;
  o.walks = 1 << 20;
  o.epsilon = 1e-3;
  const dvec3 points[] = {{0.5, 0, 0}};
  const solution s = solve(p, points, o);
  const double off = s.values[0].mean.x - 0.125, error = s.values[0].standard_error.x;
  CAPTURE(off);
  CAPTURE(error);
  CHECK(error < 1e-4);
  CHECK(off < 5 * error);
  CHECK(off > -o.epsilon / 3 - 5 * error);
}

TEST_CASE("pde: a half space has no size and walks come back to its wall") {
  pde_problem p;
  p.domain = pde_domain(sdf_plane({0, 0, 0}, {0, 0, 1}));
  const dvec3 a{0, 0, 1};
  p.boundary = [a](const dvec3& x) { return 1 / glm::distance(x, a); };
  check(
      p, [a](const dvec3& x) { return 1 / glm::distance(x, a); },
      [a](const dvec3& x) {
        const double r = glm::distance(x, a);
        return (a - x) / (r * r * r);
      },
      {{-2, -2, -2}, {2, 2, -0.2}}, {.walks = 2048, .epsilon = 1e-6});
}
