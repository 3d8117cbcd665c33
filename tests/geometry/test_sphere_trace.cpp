#include <doctest/doctest.h>

#include <cmath>
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
    // off by the tolerance over the cosine
    REQUIRE(std::abs(r.at.t - expected) * a < 1e-6 * std::sqrt(a) / std::sqrt(disc) * a + 1e-7);
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
