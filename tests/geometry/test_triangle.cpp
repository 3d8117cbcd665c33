#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "brute_force.h"

using namespace wisp;
using namespace wisp::test;

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

std::array<dvec3, 3> random_triangle(rng_state& rng, double aspect) {
  const mesh m = slivers(6, aspect, next_uint(rng));
  const auto i = static_cast<std::size_t>(3 * (next_uint(rng) % 6));
  return {m.positions[i], m.positions[i + 1], m.positions[i + 2]};
}

// A point over, beside, on or near the triangle.
dvec3 random_point(rng_state& rng, const std::array<dvec3, 3>& v) {
  const double a = uniform(rng, -0.2, 1.2), b = uniform(rng, -0.2, 1.2);
  const dvec3 on = v[0] + a * (v[1] - v[0]) + b * (v[2] - v[0]);
  switch (next_uint(rng) % 4) {
    case 0:
      return random_in_cube(rng, 2);
    case 1:
      return on;
    case 2:
      return on + random_direction(rng) * std::pow(10.0, uniform(rng, -12, 0));
    default:
      return v[0] + std::abs(a) / 2 * (v[1] - v[0]) + std::abs(b) / 3 * (v[2] - v[0]);
  }
}

}  // namespace

TEST_CASE("geometry: the closest point of a triangle has its distance and its features") {
  // by Voronoi regions of a right triangle
  const dvec3 a{0, 0, 0}, b{2, 0, 0}, c{0, 2, 0};
  struct known {
    dvec3 p, point;
    mesh_feature feature;
    int index;
  };
  const known all[] = {
      {{0.5, 0.5, 3}, {0.5, 0.5, 0}, mesh_feature::face, 0},
      {{0.5, 0.5, -3}, {0.5, 0.5, 0}, mesh_feature::face, 0},
      {{0.25, 0.5, 0}, {0.25, 0.5, 0}, mesh_feature::face, 0},
      {{-1, -1, 1}, {0, 0, 0}, mesh_feature::vertex, 0},
      {{5, -1, 1}, {2, 0, 0}, mesh_feature::vertex, 1},
      {{-1, 9, 1}, {0, 2, 0}, mesh_feature::vertex, 2},
      {{1, -1, 1}, {1, 0, 0}, mesh_feature::edge, 0},
      {{3, 3, -1}, {1, 1, 0}, mesh_feature::edge, 1},
      {{-3, 0.5, 0}, {0, 0.5, 0}, mesh_feature::edge, 2},
      {{0, 0, 0}, {0, 0, 0}, mesh_feature::vertex, 0},
      {{2, 0, 0}, {2, 0, 0}, mesh_feature::vertex, 1},
      {{0, 2, 0}, {0, 2, 0}, mesh_feature::vertex, 2},
      {{1, 0, 0}, {1, 0, 0}, mesh_feature::edge, 0},
      {{1, 1, 0}, {1, 1, 0}, mesh_feature::edge, 1},
      {{0, 0.5, 0}, {0, 0.5, 0}, mesh_feature::edge, 2},
  };
  for (const known& k : all) {
    CAPTURE(k.p.x);
    CAPTURE(k.p.y);
    for (int turn = 0; turn < 3; ++turn) {
      std::array<dvec3, 3> v = {a, b, c};
      std::rotate(v.begin(), v.begin() + (3 - turn) % 3, v.end());
      const element_point e = closest_point_on_triangle(k.p, v[0], v[1], v[2]);
      CHECK(e.point == k.point);
      CHECK(e.feature == k.feature);
      CHECK(e.feature_index == (k.feature == mesh_feature::face ? 0 : (k.index + turn) % 3));
      CHECK(whats_inconsistent(e, v, bvh_element::triangle) == nullptr);
    }
  }
}

TEST_CASE("geometry: closest points of triangles and slivers against extended precision") {
  rng_state rng = make_rng(1);
  for (const double aspect : {1.0, 10.0, 1e2, 1e4, 1e5, 1e6, 2e6, 1e7, 1e8, 1e10, 1e12}) {
    CAPTURE(aspect);
    // the normal of the thinnest is noise, and so is where a point lies along them
    const double most = aspect > 1e8 ? 5e-12 : 16 * epsilon;
    double worst = 0;
    for (int i = 0; i < 4000; ++i) {
      const auto v = random_triangle(rng, aspect);
      const dvec3 p = random_point(rng, v);
      const element_point e = closest_point_on_triangle(p, v[0], v[1], v[2]);
      const char* wrong = whats_inconsistent(e, v, bvh_element::triangle);
      if (wrong != nullptr) {
        CHECK_MESSAGE(wrong == nullptr, std::string(wrong));
        break;
      }
      const double error = std::abs(glm::distance(p, e.point) - wide_distance(p, v[0], v[1], v[2]));
      worst = std::max(worst, error);
    }
    CHECK(worst <= most);
  }
}

TEST_CASE("geometry: the extended precision that tests rely on against a dense minimum") {
  rng_state rng = make_rng(2);
  for (int i = 0; i < 30; ++i) {
    const auto v = random_triangle(rng, i % 3 == 0 ? 1e3 : 1.0 + i % 4);
    const dvec3 p = random_point(rng, v);
    double least = std::numeric_limits<double>::infinity();
    constexpr int n = 200;
    for (int a = 0; a <= n; ++a) {
      for (int b = 0; a + b <= n; ++b) {
        const double x = double(a) / n, y = double(b) / n;
        least = std::min(least, glm::distance(p, v[0] * (1 - x - y) + v[1] * x + v[2] * y));
      }
    }
    const double d = wide_distance(p, v[0], v[1], v[2]);
    CHECK(d <= least + 1e-15);
    CHECK(least <= d + 4.0 / n);
  }
}

TEST_CASE("geometry: a triangle without area is the segment or point that it is") {
  rng_state rng = make_rng(3);
  for (int i = 0; i < 20000; ++i) {
    const dvec3 a = random_in_cube(rng, 1), b = random_in_cube(rng, 1), p = random_in_cube(rng, 2);
    const double s = rand1d(rng);
    const dvec3 c = i % 2 == 0 ? a + s * (b - a) : a + 2 * s * (b - a);  // nearly in line
    const std::array<std::array<dvec3, 3>, 5> all = {
        {{a, a, a}, {a, b, b}, {a, a, b}, {a, b, a}, {a, b, c}}};
    for (const auto& v : all) {
      const element_point e = closest_point_on_triangle(p, v[0], v[1], v[2]);
      const double d = wide_distance(p, v[0], v[1], v[2]);
      const bool right = std::abs(glm::distance(p, e.point) - d) <= 16 * epsilon &&
                         whats_inconsistent(e, v, bvh_element::triangle) == nullptr;
      if (!right) {
        FAIL("a degenerate triangle of a: ", a.x, " ", a.y, " ", a.z);
      }
    }
    const element_point e = closest_point_on_triangle(a, a, a, a);
    CHECK(e.point == a);
    CHECK(e.feature == mesh_feature::vertex);
  }
}

TEST_CASE("geometry: triangles and segments of any magnitude have their closest points") {
  rng_state rng = make_rng(4);
  for (const int exponent : {-230, -100, -50, -1, 0, 1, 50, 100, 230}) {
    const double s = std::ldexp(1.0, exponent);
    CAPTURE(exponent);
    int wrong = 0;
    for (int i = 0; i < 1000; ++i) {
      const auto v = random_triangle(rng, 2);
      const dvec3 p = random_point(rng, v);
      const element_point e = closest_point_on_triangle(p, v[0], v[1], v[2]);
      const element_point f = closest_point_on_triangle(p * s, v[0] * s, v[1] * s, v[2] * s);
      const element_point g = closest_point_on_segment(p, v[0], v[1]);
      const element_point h = closest_point_on_segment(p * s, v[0] * s, v[1] * s);
      wrong += f.point == e.point * s && f.uv == e.uv && f.feature == e.feature ? 0 : 1;
      wrong += h.point == g.point * s && h.uv == g.uv && h.feature == g.feature ? 0 : 1;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("geometry: closest points of segments") {
  const dvec3 a{1, 1, 1}, b{3, 1, 1};
  CHECK(closest_point_on_segment({2, 5, 1}, a, b).point == dvec3{2, 1, 1});
  CHECK(closest_point_on_segment({2, 5, 1}, a, b).uv == dvec2{0.5, 0});
  CHECK(closest_point_on_segment({2, 5, 1}, a, b).feature == mesh_feature::edge);
  CHECK(closest_point_on_segment({-2, 5, 1}, a, b).feature_index == 0);
  CHECK(closest_point_on_segment({9, 5, 1}, a, b).feature_index == 1);
  CHECK(closest_point_on_segment({9, 5, 1}, a, b).point == b);
  CHECK(closest_point_on_segment({9, 5, 1}, a, a).point == a);
  rng_state rng = make_rng(5);
  int wrong = 0;
  for (int i = 0; i < 20000; ++i) {
    const dvec3 v0 = random_in_cube(rng, 1), v1 = i % 5 == 0 ? v0 : random_in_cube(rng, 1);
    const dvec3 p = i % 3 == 0 ? v0 + rand1d(rng) * (v1 - v0) : random_in_cube(rng, 2);
    const element_point e = closest_point_on_segment(p, v0, v1);
    const double d = wide_distance(p, v0, v1, v1);
    wrong += std::abs(glm::distance(p, e.point) - d) <= 8 * epsilon ? 0 : 1;
    wrong += whats_inconsistent(e, {v0, v1, v1}, bvh_element::segment) == nullptr ? 0 : 1;
  }
  CHECK(wrong == 0);
}
