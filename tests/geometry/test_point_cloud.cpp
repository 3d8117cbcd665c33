#include "wisp/geometry/point_cloud.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "wisp/geometry/fast_winding.h"

using namespace wisp;

namespace {

constexpr double tau = 6.283185307179586477;

std::vector<dvec3> random_points(int count, double size, unsigned seed = 7) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-size, size);
  std::vector<dvec3> points;
  for (int i = 0; i < count; ++i) points.emplace_back(u(random), u(random), u(random));
  return points;
}

struct cloud {
  std::vector<dvec3> points, normals;
};

// Points on a sphere, evenly along a spiral or at random.
cloud make_sphere(int count, double radius, bool even, const dvec3& center = {0, 0, 0}) {
  cloud c;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> u;
  for (int i = 0; i < count; ++i) {
    const double z = even ? 1 - (2 * i + 1.0) / count : 2 * u(random) - 1;
    const double a = even ? 2.399963229728653 * i : tau * u(random);
    const double r = std::sqrt(1 - z * z);
    c.normals.emplace_back(r * std::cos(a), r * std::sin(a), z);
    c.points.push_back(center + radius * c.normals.back());
  }
  return c;
}

}  // namespace

TEST_CASE("geometry: winding numbers of a cloud") {
  struct place {
    double radius;
    dvec3 center;
  };
  for (const place& at : {place{1, {0, 0, 0}}, place{1e-6, {0, 0, 0}}, place{3, {1e5, 0, -1e5}}}) {
    CAPTURE(at.radius);
    const cloud c = make_sphere(4000, at.radius, true, at.center);
    const fast_winding fast = make_fast_winding(c.points, c.normals);
    for (const dvec3& p : random_points(300, 1.5)) {
      const double l = glm::length(p);
      if (std::abs(l - 1) < 0.1) continue;
      const double w = fast_winding_number(fast, at.center + at.radius * p);
      CHECK(std::abs(w - (l < 1 ? 1 : 0)) < 0.02);
    }
    for (const dvec3& p : c.points) CHECK(std::isfinite(fast_winding_number(fast, p)));
  }
}

TEST_CASE("geometry: expansions of a cloud agree with its sum") {
  const cloud c = make_sphere(1500, 1, false);
  const std::vector<double> areas = estimate_areas(c.points, c.normals);
  std::vector<dvec3> doubled = c.normals;
  for (dvec3& n : doubled) n *= 2.0;  // of any length
  double errors[4] = {};
  for (int order = 1; order <= 3; ++order) {
    CAPTURE(order);
    const fast_winding fast = make_fast_winding(c.points, doubled, areas, {order, 1});
    double error = 0;
    for (const dvec3& p : random_points(200, 1.5)) {
      double sum = 0;
      for (std::size_t i = 0; i < c.points.size(); ++i) {
        const dvec3 d = c.points[i] - p;
        sum += areas[i] * glm::dot(c.normals[i], d) / std::pow(glm::length(d), 3) / (2 * tau);
      }
      error = std::max(error, std::abs(fast_winding_number(fast, p) - sum));
      CHECK(std::abs(fast_winding_number(fast, p, 1e9) - sum) < 1e-4);
    }
    errors[order] = error;
  }
  CHECK(errors[3] < 0.2 * errors[1]);
  CHECK(errors[3] < 0.2 * errors[2]);
  CHECK(errors[3] < 0.005);
}

TEST_CASE("geometry: areas of points") {
  for (const bool even : {true, false}) {
    CAPTURE(even);
    const cloud c = make_sphere(5000, 2, even);
    double sum = 0;
    for (const double a : estimate_areas(c.points, c.normals)) {
      CHECK(a > 0);
      sum += a;
    }
    CHECK(sum == doctest::Approx(8 * tau).epsilon(0.03));
  }
  // a square lattice with an edge; twice, with points that do not count
  std::vector<dvec3> points, normals;
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) points.emplace_back(0.1 * i, 0.1 * j, 5);
  }
  normals.assign(points.size(), dvec3{0, 0, 3});
  std::vector<double> areas = estimate_areas(points, normals);
  CHECK(areas[20 * 10 + 10] == doctest::Approx(0.01).epsilon(1e-9));
  CHECK(areas[0] > 0.002);
  CHECK(areas[0] < 0.06);
  points.insert(points.end(), points.begin(), points.end());
  normals.assign(points.size(), dvec3{0, 0, 1});
  points.emplace_back(std::nan(""), 0, 0);
  normals.emplace_back(0, 0, 1);
  points.emplace_back(9, 9, 9);
  normals.emplace_back(0, 0, 0);
  areas = estimate_areas(points, normals, 24, 2);
  CHECK(areas[20 * 10 + 10] == doctest::Approx(0.005).epsilon(1e-9));
  CHECK(areas[800] == 0);
  CHECK(areas[801] == 0);
  const fast_winding fast = make_fast_winding(points, normals);
  CHECK(fast_winding_number(fast, {0.95, 0.95, 4.8}) > 0.3);
  CHECK(fast_winding_number(fast, {0.95, 0.95, 5.2}) < -0.3);
  CHECK(estimate_areas({}, {}).empty());
  const std::vector<dvec3> one = {{1, 2, 3}}, up = {{0, 0, 1}};
  CHECK(estimate_areas(one, up)[0] == 0);
}

TEST_CASE("geometry: areas of points on sheets that are close to each other") {
  // a second lattice above, moved a little: on the same side; and facing away, moved more
  for (const bool away : {false, true}) {
    CAPTURE(away);
    std::vector<dvec3> points, normals;
    for (int sheet = 0; sheet < 2; ++sheet) {
      const double by = sheet * (away ? 0.03 : 1e-4);
      for (int i = 0; i < 20; ++i) {
        for (int j = 0; j < 20; ++j) points.emplace_back(0.1 * i + by, 0.1 * j, 0.02 * sheet);
      }
      normals.resize(points.size(), {0, 0, away && sheet == 0 ? -1 : 1});
    }
    const std::vector<double> areas = estimate_areas(points, normals, 20);
    for (const int sheet : {0, 400}) {
      for (int i = 3; i < 17; ++i) {
        for (int j = 3; j < 17; ++j) {
          const auto k = static_cast<std::size_t>(sheet + 20 * i + j);
          CHECK(std::abs(areas[k] - 0.01) < 1e-4);
        }
      }
    }
    if (!away) continue;
    const fast_winding plate = make_fast_winding(points, normals);
    CHECK(std::abs(fast_winding_number(plate, {0.95, 0.95, 0.2})) < 0.02);
    CHECK(std::abs(fast_winding_number(plate, {0.95, 0.95, -0.2})) < 0.02);
  }
}

TEST_CASE("geometry: nearest neighbors are those of a search through all") {
  for (const dvec3& offset : {dvec3{0, 0, 0}, dvec3{1e5, 0, 0}}) {
    std::vector<dvec3> points = random_points(2000, 1);
    for (std::size_t i = 0; i < 50; ++i) points.push_back(points[i]);  // as near
    for (dvec3& p : points) p += offset;
    const bvh tree = make_point_bvh(points);
    for (dvec3 p : random_points(60, 2, 9)) {
      p += offset;
      std::set<std::pair<double, int>> all;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const dvec3 d = points[i] - p;
        all.emplace(glm::dot(d, d), static_cast<int>(i));
      }
      std::vector<int> found(17, -1);
      REQUIRE(nearest_neighbors(tree, p, 17, found) == 17);
      auto expected = all.begin();
      for (const int i : found) {
        CHECK(i == expected->second);
        ++expected;
      }
    }
  }
  const std::vector<dvec3> points = {{0, 0, 0}, {1, 0, 0}};
  const bvh tree = make_point_bvh(points);
  std::vector<int> found(5);
  CHECK(nearest_neighbors(tree, {0.9, 0, 0}, 5, found) == 2);
  CHECK(found[0] == 1);
  CHECK(nearest_neighbors(tree, {1e30, 0, 0}, 1, found) == 1);
  CHECK(nearest_neighbors(tree, {0, 0, 0}, 0, found) == 0);
  CHECK(nearest_neighbors(tree, {std::nan(""), 0, 0}, 5, found) == 0);
  CHECK(nearest_neighbors(bvh(), {0, 0, 0}, 5, found) == 0);
  CHECK_THROWS_AS(nearest_neighbors(tree, {0, 0, 0}, 6, found), std::invalid_argument);
  CHECK_THROWS_AS(nearest_neighbors(tree, {0, 0, 0}, -1, found), std::invalid_argument);
  const ivec3 one{0, 1, 1};
  const bvh triangles = make_bvh({&one, 1}, points);
  CHECK_THROWS_AS(nearest_neighbors(triangles, {0, 0, 0}, 1, found), std::invalid_argument);
}

TEST_CASE("geometry: wrong clouds are refused") {
  const cloud c = make_sphere(50, 1, true);
  const std::span normals(c.normals);
  std::vector<double> areas(50, 0.2);
  CHECK_NOTHROW(make_fast_winding(c.points, normals, areas));
  CHECK_THROWS_AS(make_fast_winding(c.points, normals.first(49), areas), std::invalid_argument);
  CHECK_THROWS_AS(make_fast_winding(c.points, normals, std::span(areas).first(3)),
                  std::invalid_argument);
  areas[7] = -1;
  CHECK_THROWS_AS(make_fast_winding(c.points, normals, areas), std::invalid_argument);
  areas[7] = std::nan("");
  CHECK_THROWS_AS(make_fast_winding(c.points, normals, areas), std::invalid_argument);
  CHECK_THROWS_AS(estimate_areas(c.points, normals, 2), std::invalid_argument);
  CHECK_THROWS_AS(estimate_areas(c.points, normals.first(3)), std::invalid_argument);
}
