#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/geometry/sphere_trace.h"

using namespace wisp;

namespace {

double uniform(rng_state& rng, double low, double high) { return low + (high - low) * rand1d(rng); }
dvec3 random_point(rng_state& rng, double size) {
  const double x = uniform(rng, -size, size), y = uniform(rng, -size, size);
  return {x, y, uniform(rng, -size, size)};
}

// Towards what lies about the origin.
sdf_ray random_ray(rng_state& rng, double from, double size) {
  const dvec3 origin = random_point(rng, from);
  return {origin, (random_point(rng, size) - origin) * uniform(rng, 0.2, 3)};
}

sdf carved() {
  const std::vector<sdf> blend = {sdf_torus({0, 0, 0}, {0, 0, 1}, 0.6, 0.2),
                                  sdf_torus({0, 0, 0}, {0, 1, 0}, 0.6, 0.2)};
  const std::vector<sdf> parts = {sdf_smooth_union(blend, 0.2), sdf_sphere({0.6, 0, 0}, 0.3),
                                  sdf_box({-0.6, 0, 0}, {0.1, 0.4, 0.1})};
  return sdf_difference(parts);
}

// Follows the ray in small steps: no surface before t, none at all where it missed.
void check_against_march(const sdf& solid, const std::vector<cut_plane>& cuts, const sdf_ray& ray,
                         const trace_result& r, double end) {
  const auto value = [&](double t) {
    const dvec3 p = ray.origin + t * ray.direction;
    double v = signed_distance(solid, p);
    for (const cut_plane& c : cuts) {
      v = std::max(v, glm::dot(p - c.point, glm::normalize(c.normal)));
    }
    return v;
  };
  const double first = value(1e-6);
  const double until = r.end == trace_end::hit ? r.at.t : end;
  for (int i = 1; i < 400; ++i) {
    const double v = value(until * i / 400);
    REQUIRE((first > 0 ? v : -v) > -1e-8);
  }
  if (r.end == trace_end::hit) {
    REQUIRE(std::abs(value(r.at.t)) < 1e-8);
    REQUIRE(r.at.from_inside == (first < 0));
    REQUIRE(glm::length(r.at.normal) == doctest::Approx(1));
    REQUIRE(glm::length(r.at.point - (ray.origin + r.at.t * ray.direction)) < 1e-12);
  }
}

}  // namespace

TEST_CASE("geometry: rays meet a sphere where they should") {
  const sdf s = sdf_sphere({1, 2, 3}, 2);
  rng_state rng = make_rng(4);
  int hits = 0;
  for (int i = 0; i < 5000; ++i) {
    sdf_ray ray = random_ray(rng, 6, 2.5);
    ray.origin += dvec3{1, 2, 3};
    const dvec3 o = ray.origin - dvec3{1, 2, 3};
    const double a = glm::dot(ray.direction, ray.direction), b = glm::dot(o, ray.direction);
    const double disc = b * b - a * (glm::dot(o, o) - 4);
    double expected = -1;
    if (disc > 0) {
      expected = (-b - std::sqrt(disc)) / a;
      if (expected < 0) expected = (-b + std::sqrt(disc)) / a;
    }
    if (std::abs(disc) < 1e-6 * a) continue;  // grazing
    const trace_result r = sphere_trace(s, ray);
    if (expected < 0) {
      REQUIRE(r.end == trace_end::miss);
      continue;
    }
    REQUIRE(r.end == trace_end::hit);
    ++hits;
    REQUIRE(std::abs(r.at.t - expected) * std::sqrt(a) < 1e-10);
    const dvec3 n = (r.at.point - dvec3{1, 2, 3}) / 2.0;
    REQUIRE(glm::distance(n, r.at.normal) < 1e-5);
    REQUIRE(r.at.from_inside == (glm::length(o) < 2));
  }
  CHECK(hits > 500);
}

TEST_CASE("geometry: rays against carved tori find the first surface") {
  const sdf s = carved();
  rng_state rng = make_rng(9);
  int hits = 0, steps = 0, plain_steps = 0;
  for (int i = 0; i < 3000; ++i) {
    const sdf_ray ray = random_ray(rng, i % 2 == 0 ? 2 : 0.9, 0.9);
    const double far = 6 / glm::length(ray.direction);
    const trace_result r = sphere_trace(s, ray, {.t_max = far});
    if (r.end == trace_end::step_limit) continue;
    check_against_march(s, {}, ray, r, far);
    hits += r.end == trace_end::hit;
    steps += r.steps;
    plain_steps += sphere_trace(s, ray, {.t_max = far, .relaxation = 0}).steps;
  }
  CHECK(hits > 1000);
  CHECK(steps < 0.95 * plain_steps);
}

TEST_CASE("geometry: a cut solid shows its inside") {
  const sdf s = carved();
  const std::vector<cut_plane> cuts = {{{0, 0, 0.05}, {0, 0, 2}}, {{0.1, 0, 0}, {1, 1, 0}}};
  rng_state rng = make_rng(10);
  int on_plane[2] = {0, 0}, on_solid = 0;
  for (int i = 0; i < 4000; ++i) {
    const sdf_ray ray = random_ray(rng, 2, 0.9);
    const double far = 6 / glm::length(ray.direction);
    const trace_result r = sphere_trace(s, cuts, ray, {.t_max = far});
    if (r.end == trace_end::step_limit) continue;
    check_against_march(s, cuts, ray, r, far);
    if (r.end != trace_end::hit) continue;
    if (r.at.plane < 0) {
      ++on_solid;
      REQUIRE(std::abs(signed_distance(s, r.at.point)) < 1e-8);
    } else {
      const cut_plane& c = cuts[static_cast<std::size_t>(r.at.plane)];
      ++on_plane[r.at.plane];
      REQUIRE(std::abs(glm::dot(r.at.point - c.point, glm::normalize(c.normal))) < 1e-8);
      REQUIRE(glm::distance(r.at.normal, glm::normalize(c.normal)) < 1e-12);
      REQUIRE(signed_distance(s, r.at.point) < 1e-8);
    }
  }
  CHECK(on_solid > 200);
  CHECK(on_plane[0] > 50);
  CHECK(on_plane[1] > 50);
}

TEST_CASE("geometry: rays that start on a surface leave it") {
  const sdf s = sdf_sphere({0, 0, 0}, 1);
  const trace_result out = sphere_trace(s, {{1, 0, 0}, {1, 0.2, 0}});
  CHECK(out.end == trace_end::miss);
  const trace_result in = sphere_trace(s, {{1, 0, 0}, {-1, 0, 0}});
  CHECK(in.end == trace_end::hit);
  CHECK(in.at.t == doctest::Approx(2));
  CHECK(in.at.from_inside);
}

TEST_CASE("geometry: a pixel's cone and limits end a ray early") {
  const sdf s = carved();
  const sdf_ray ray = {{0.7, 0.05, 3}, {0, 0, -1}};
  const trace_result exact = sphere_trace(s, ray);
  const trace_result rough = sphere_trace(s, ray, {.cone = 1e-3});
  REQUIRE(exact.end == trace_end::hit);
  REQUIRE(rough.end == trace_end::hit);
  CHECK(std::abs(exact.at.t - rough.at.t) < 1e-2);
  CHECK(rough.steps <= exact.steps);
  CHECK(sphere_trace(s, ray, {.t_max = exact.at.t * 0.99}).end == trace_end::miss);
  CHECK(sphere_trace(s, ray, {.max_steps = 2}).end == trace_end::step_limit);
  const trace_result later = sphere_trace(s, ray, {.t_min = exact.at.t + 0.01});
  CHECK(later.end == trace_end::hit);
  CHECK(later.at.from_inside);
}

TEST_CASE("geometry: rays of any scale and none at all") {
  for (const double scale : {1e-6, 1e6}) {
    const sdf s = sdf_box(dvec3{1e3, 0, 0} * scale, dvec3{scale});
    const trace_result r = sphere_trace(s, {{0, 0, 0}, {1, 0, 0}});
    REQUIRE(r.end == trace_end::hit);
    CHECK(r.at.t == doctest::Approx(999 * scale).epsilon(1e-6));
    CHECK(r.at.normal.x == doctest::Approx(-1));
  }
  const sdf s = sdf_sphere({0, 0, 0}, 1);
  CHECK(sphere_trace(s, {{0, 0, 3}, {0, 0, 0}}).end == trace_end::miss);
  CHECK(sphere_trace(s, {{NAN, 0, 3}, {0, 0, -1}}).end == trace_end::miss);
  CHECK(sphere_trace(sdf_empty(), {{0, 0, 3}, {0, 0, -1}}).end == trace_end::miss);
  const auto nan = [](const dvec3&) { return std::nan(""); };
  const sdf broken = sdf_function(nan, {dvec3{-1}, dvec3{1}});
  CHECK(sphere_trace(broken, {{0, 0, 3}, {0, 0, -1}}).end == trace_end::miss);
  // an infinite solid
  const trace_result floor = sphere_trace(sdf_plane({0, 0, 0}, {0, 1, 0}), {{0, 5, 0}, {3, -1, 0}});
  REQUIRE(floor.end == trace_end::hit);
  CHECK(floor.at.t == doctest::Approx(5));
  CHECK(floor.at.normal.y == doctest::Approx(1));
  CHECK(sphere_trace(sdf_plane({0, 0, 0}, {0, 1, 0}), {{0, 5, 0}, {3, 1, 0}}).end ==
        trace_end::miss);
}

TEST_CASE("geometry: sphere tracing refuses wrong options") {
  const sdf s = sdf_sphere({0, 0, 0}, 1);
  const sdf_ray ray;
  CHECK_THROWS_AS(sphere_trace(s, ray, {.tolerance = 0}), std::invalid_argument);
  CHECK_THROWS_AS(sphere_trace(s, ray, {.cone = -1}), std::invalid_argument);
  CHECK_THROWS_AS(sphere_trace(s, ray, {.relaxation = 1}), std::invalid_argument);
  CHECK_THROWS_AS(sphere_trace(s, ray, {.max_steps = 0}), std::invalid_argument);
  const std::vector<cut_plane> none = {{{0, 0, 0}, {0, 0, 0}}};
  CHECK_THROWS_AS(sphere_trace(s, none, ray), std::invalid_argument);
}

TEST_CASE("geometry: rays meet boxes where they should") {
  const dvec3 c = {0.3, -0.1, 0.2}, half = {1, 0.5, 0.7};
  const sdf s = sdf_box(c, half);
  rng_state rng = make_rng(14);
  int hits = 0;
  for (int i = 0; i < 5000; ++i) {
    const sdf_ray ray = random_ray(rng, i % 3 == 0 ? 0.9 : 4, 1.2);
    double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
    int enter_axis = 0, leave_axis = 0;
    for (int a = 0; a < 3; ++a) {
      double t0 = (c[a] - half[a] - ray.origin[a]) / ray.direction[a];
      double t1 = (c[a] + half[a] - ray.origin[a]) / ray.direction[a];
      if (t0 > t1) std::swap(t0, t1);
      if (t0 > enter) enter = t0, enter_axis = a;
      if (t1 < leave) leave = t1, leave_axis = a;
    }
    if (std::abs(enter - leave) < 1e-6 || std::abs(enter) < 1e-6) continue;  // an edge
    const trace_result r = sphere_trace(s, ray);
    const bool meets = enter < leave && leave > 0;
    REQUIRE((r.end == trace_end::hit) == meets);
    if (!meets) continue;
    ++hits;
    const double t = enter > 0 ? enter : leave;
    const int axis = enter > 0 ? enter_axis : leave_axis;
    REQUIRE(std::abs(r.at.t - t) * glm::length(ray.direction) < 1e-10);
    REQUIRE(std::abs(r.at.normal[axis]) == doctest::Approx(1));
    REQUIRE(r.at.normal[axis] * ray.direction[axis] * (enter > 0 ? -1 : 1) > 0);
    REQUIRE(r.at.from_inside == (enter < 0));
  }
  CHECK(hits > 1500);
}

TEST_CASE("geometry: rays meet a torus at the roots of its quartic") {
  const double major = 1, minor = 0.35;
  const sdf s = sdf_torus({0, 0, 0}, {0, 0, 1}, major, minor);
  rng_state rng = make_rng(15);
  int hits = 0, misses = 0;
  for (int i = 0; i < 1500; ++i) {
    sdf_ray ray = random_ray(rng, i % 3 == 0 ? 1 : 4, 1.2);
    ray.direction = glm::normalize(ray.direction);
    const auto f = [&](double t) {  // the implicit polynomial
      const dvec3 p = ray.origin + t * ray.direction;
      const double a = glm::dot(p, p) + major * major - minor * minor;
      return a * a - 4 * major * major * (p.x * p.x + p.y * p.y);
    };
    // its first root by fine steps and bisection
    const double step = 2e-3;
    double root = -1, least = std::numeric_limits<double>::infinity();
    for (double t = 0; t < 9 && root < 0; t += step) {
      least = std::min(least, std::abs(f(t)));
      if ((f(t) < 0) == (f(t + step) < 0)) continue;
      double low = t, high = t + step;
      for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        ((f(middle) < 0) == (f(low) < 0) ? low : high) = middle;
      }
      root = low;
    }
    if (root < 0 && least < 1e-3) continue;  // grazing
    const trace_result r = sphere_trace(s, ray);
    REQUIRE((r.end == trace_end::hit) == (root >= 0));
    root < 0 ? ++misses : ++hits;
    if (root < 0) continue;
    const dvec3 p = ray.origin + root * ray.direction;
    const dvec3 ring = major * glm::normalize(dvec3{p.x, p.y, 0});
    const dvec3 n = glm::normalize(p - ring);
    const double slope = std::abs(glm::dot(n, ray.direction));
    if (slope < 1e-3) continue;
    REQUIRE(std::abs(r.at.t - root) * slope < 1e-11);
    REQUIRE(glm::distance(r.at.normal, n) < 1e-7);
  }
  CHECK(hits > 500);
  CHECK(misses > 100);
}

TEST_CASE("geometry: cut balls are met where they should") {
  const sdf s = sdf_sphere({0, 0, 0}, 1);
  rng_state rng = make_rng(16);
  int on_plane = 0, on_ball = 0, from_inside = 0, none = 0;
  for (int i = 0; i < 6000; ++i) {
    sdf_ray ray = random_ray(rng, i % 2 == 0 ? 2 : 0.8, 1);
    ray.direction = glm::normalize(ray.direction);
    std::vector<cut_plane> cuts;
    for (int k = 0; k < 1 + i % 3; ++k) {
      cuts.push_back({random_point(rng, 0.4), random_point(rng, 1)});
    }
    // the ray's part in each convex piece, and in all
    struct bound {
      double t;
      int plane;
    };
    const double b = glm::dot(ray.origin, ray.direction);
    const double disc = b * b - glm::dot(ray.origin, ray.origin) + 1;
    if (std::abs(disc) < 1e-6) continue;
    bound in{-b - std::sqrt(std::max(disc, 0.0)), -1}, out{-b + std::sqrt(std::max(disc, 0.0)), -1};
    for (std::size_t k = 0; k < cuts.size(); ++k) {
      const dvec3 n = glm::normalize(cuts[k].normal);
      const double rate = glm::dot(n, ray.direction);
      const double t = glm::dot(n, cuts[k].point - ray.origin) / rate;
      if (rate < 0 && t > in.t) in = {t, static_cast<int>(k)};
      if (rate > 0 && t < out.t) out = {t, static_cast<int>(k)};
    }
    if (std::abs(in.t - out.t) < 1e-6 || std::abs(in.t) < 1e-6) continue;
    const bool meets = disc > 0 && in.t < out.t && out.t > 0;
    const bound at = in.t > 0 ? in : out;
    const trace_result r = sphere_trace(s, cuts, ray);
    REQUIRE((r.end == trace_end::hit) == meets);
    if (!meets) {
      ++none;
      continue;
    }
    REQUIRE(std::abs(r.at.t - at.t) < 1e-9);
    REQUIRE(r.at.plane == at.plane);
    REQUIRE(r.at.from_inside == (in.t < 0));
    const dvec3 n =
        at.plane < 0 ? r.at.point : glm::normalize(cuts[static_cast<std::size_t>(at.plane)].normal);
    REQUIRE(glm::distance(r.at.normal, n) < 1e-8);
    ++(at.plane < 0 ? on_ball : on_plane);
    from_inside += in.t < 0;
  }
  CHECK(on_plane > 500);
  CHECK(on_ball > 500);
  CHECK(from_inside > 300);
  CHECK(none > 500);
}

TEST_CASE("geometry: rays from a cut start on the side that they go to") {
  const sdf s = sdf_sphere({0, 0, 0}, 1);
  const std::vector<cut_plane> cuts = {{{0, 0, 0.25}, {0, 0, 1}}};
  rng_state rng = make_rng(17);
  for (int i = 0; i < 500; ++i) {
    dvec3 p = random_point(rng, 0.6);
    p.z = 0.25 + uniform(rng, -1e-12, 1e-12);
    dvec3 d = glm::normalize(random_point(rng, 1));
    d.z = std::max(std::abs(d.z), 1e-3);
    REQUIRE(sphere_trace(s, cuts, {p, d}).end == trace_end::miss);
    d.z = -d.z;
    const trace_result r = sphere_trace(s, cuts, {p, d});
    REQUIRE(r.end == trace_end::hit);
    REQUIRE(r.at.from_inside);
    REQUIRE(r.at.plane == -1);
    REQUIRE(glm::length(r.at.point) == doctest::Approx(1));
  }
  // along the plane, in what is cut away and in what is not
  CHECK(sphere_trace(s, cuts, {{-3, 0, 0.3}, {1, 0, 0}}).end == trace_end::miss);
  CHECK(sphere_trace(s, cuts, {{-3, 0, 0.2}, {1, 0, 0}}).end == trace_end::hit);
  // t_min and t_max hold for planes too
  const sdf_ray down = {{0, 0, 3}, {0, 0, -1}};
  CHECK(sphere_trace(s, cuts, down).at.t == doctest::Approx(2.75));
  CHECK(sphere_trace(s, cuts, down, {.t_max = 2.7}).end == trace_end::miss);
  const trace_result later = sphere_trace(s, cuts, down, {.t_min = 2.8});
  CHECK(later.at.from_inside);
  CHECK(later.at.t == doctest::Approx(4));
}

TEST_CASE("geometry: rays that touch go on") {
  // two boxes share a face, which is no surface
  const std::vector<sdf> boxes = {sdf_box({-1, 0, 0}, {1, 1, 1}), sdf_box({1, 0, 0}, {1, 1, 1})};
  const sdf both = sdf_union(boxes);
  rng_state rng = make_rng(18);
  for (int i = 0; i < 200; ++i) {
    const sdf_ray ray = {{uniform(rng, -1.9, -0.1), uniform(rng, -0.5, 0.5), 0.3},
                         {1, uniform(rng, -0.1, 0.1), 0.01}};
    const trace_result r = sphere_trace(both, ray);
    REQUIRE(r.end == trace_end::hit);
    REQUIRE(r.at.point.x == doctest::Approx(2));
    REQUIRE(r.at.from_inside);
  }
  // and projection does not land there
  CHECK_FALSE(project(both, {-0.1, 0.2, 0.1}));
  const auto q = project(both, {-1.9, 0.2, 0.1});
  REQUIRE(q);
  CHECK(q->point.x == doctest::Approx(-2));
  CHECK(q->closest);
  // grazing a ball, a little within and a little without
  const sdf s = sdf_sphere({0, 0, 0}, 1);
  CHECK(sphere_trace(s, {{-3, 1 - 1e-6, 0}, {1, 0, 0}}).end == trace_end::hit);
  CHECK(sphere_trace(s, {{-3, 1 + 1e-6, 0}, {1, 0, 0}}).end == trace_end::miss);
}

TEST_CASE("geometry: rays far away and far from the origin") {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double offset : {0.0, 1e5}) {
      const dvec3 o = dvec3{offset, -offset, offset} * scale;
      const sdf s = sdf_sphere(o, scale);
      for (const double far : {3.0, 1e3, 1e6}) {
        const dvec3 d = glm::normalize(dvec3{-1, -2, -2});
        const trace_result r = sphere_trace(s, {o - far * scale * d, d});
        REQUIRE(r.end == trace_end::hit);
        const double rounding = 1e-15 * (far + offset);
        REQUIRE(std::abs(r.at.t / scale - (far - 1)) < 1e-10 + 4 * rounding);
        REQUIRE(glm::distance(r.at.normal, -d) < 1e-9 + 4 * rounding);
      }
    }
  }
  // along an axis a ray comes into the box next to the surface: that is no start on it
  const sdf ball = sdf_sphere({0, 0, 0}, 1);
  for (const double far : {1e4, 1e7, 1e9}) {
    for (const double aside : {0.0, 1e-3, 3e-3}) {
      const dvec3 d = glm::normalize(dvec3{aside, -1, 0});
      const trace_result r = sphere_trace(ball, {-far * d, d});
      REQUIRE(r.end == trace_end::hit);
      CHECK_FALSE(r.at.from_inside);
      CHECK(std::abs(r.at.t - (far - 1)) < 4e-15 * far);
    }
  }
  // infinite solids have no size; a start on them has a side after all
  const sdf floor = sdf_plane({0, 0, 0}, {0, 1, 0});
  CHECK(sphere_trace(floor, {{0, 0, 0}, {0, 1, 0}}).end == trace_end::miss);
  CHECK(sphere_trace(floor, {{0, 0, 0}, {0, -1, 0}}).end == trace_end::miss);
  CHECK(sphere_trace(floor, {{0, 1e-7, 0}, {0, -1, 0}}).at.t == doctest::Approx(1e-7));
  const trace_result r = sphere_trace(carved(), {{0, 0, 3}, {0.1, 0.15, -1}}, {.max_steps = 3});
  REQUIRE(r.end == trace_end::step_limit);
  CHECK(r.at.t > 0);
}
