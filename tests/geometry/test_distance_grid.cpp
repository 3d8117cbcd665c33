#include <doctest/doctest.h>

#include <cmath>
#include <thread>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/geometry/distance_grid.h"

using namespace wisp;

namespace {

dvec3 random_point(rng_state& rng, double size) {
  const double x = rand1d(rng), y = rand1d(rng), z = rand1d(rng);
  return (dvec3{x, y, z} * 2.0 - 1.0) * size;
}

bvh make_soup(int triangles, double size, const dvec3& offset, double edge) {
  rng_state rng = make_rng(5, static_cast<uint64_t>(triangles));
  std::vector<dvec3> positions;
  std::vector<ivec3> indices;
  for (int i = 0; i < triangles; ++i) {
    const dvec3 center = random_point(rng, size);
    for (int k = 0; k < 3; ++k) positions.push_back(offset + center + random_point(rng, edge));
    indices.push_back(ivec3{3 * i, 3 * i + 1, 3 * i + 2});
  }
  return make_bvh(indices, positions);
}

}  // namespace

TEST_CASE("geometry: a distance grid bounds the distance of any point") {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double offset : {0.0, 1e5}) {
      const dvec3 origin = dvec3{offset, -offset, offset / 3} * scale;
      const bvh tree = make_soup(40, scale, origin, 0.1 * scale);
      const distance_grid grid(tree, {.resolution = 24});
      rng_state rng = make_rng(11);
      int from_cells = 0;
      for (int i = 0; i < 3000; ++i) {
        const dvec3 p = origin + random_point(rng, 1.6 * scale);
        for (const double tolerance : {0.1, 0.3, 0.6}) {
          const distance_bounds b = bound_distance(grid, p, tolerance);
          const double d = closest_point(tree, p).distance;
          REQUIRE(b.lower <= d);
          REQUIRE(b.upper >= d);
          REQUIRE(b.lower >= (1 - tolerance) * b.upper - 1e-5 * scale);
          const distance_bounds t = bound_distance(tree, p, tolerance);
          from_cells += b.lower != t.lower;
        }
      }
      CHECK(from_cells > 1000);
    }
  }
}

TEST_CASE("geometry: a distance grid takes what it is asked for and no more") {
  const bvh tree = make_soup(10, 1, {0, 0, 0}, 0.2);
  const distance_grid grid(tree, {.resolution = 32, .margin = 0});
  CHECK(grid.levels() == 1);
  CHECK(grid.filled() == 0);
  const dvec3 p = (tree.min() + tree.max()) / 2.0;
  bound_distance(grid, p, 0.2);
  bound_distance(grid, p, 0.2);
  CHECK(grid.filled() == 1);
  bound_distance(grid, tree.max() + 1.0, 0.2);
  CHECK(grid.filled() == 1);
}

TEST_CASE("geometry: threads that share a distance grid get what one gets") {
  const bvh tree = make_soup(60, 1, {0, 0, 0}, 0.1);
  const distance_grid alone(tree), shared(tree);
  std::vector<dvec3> points;
  rng_state rng = make_rng(3);
  for (int i = 0; i < 4000; ++i) points.push_back(random_point(rng, 1.2));
  std::vector<distance_bounds> expected, got[2];
  for (const dvec3& p : points) expected.push_back(bound_distance(alone, p, 0.2));
  auto work = [&](int t) {
    for (const dvec3& p : points) got[t].push_back(bound_distance(shared, p, 0.2));
  };
  std::thread other(work, 1);
  work(0);
  other.join();
  for (std::size_t i = 0; i < points.size(); ++i) {
    REQUIRE(got[0][i].lower == expected[i].lower);
    REQUIRE(got[1][i].upper == expected[i].upper);
  }
}

TEST_CASE("geometry: a distance grid over nothing or over one point is the tree") {
  const distance_grid none(make_point_bvh({}));
  CHECK(none.levels() == 0);
  CHECK(std::isinf(bound_distance(none, {0, 0, 0}, 0.2).lower));
  const std::vector<dvec3> one = {{1, 2, 3}};
  const distance_grid grid(make_point_bvh(one));
  const distance_bounds b = bound_distance(grid, {1, 2, 7}, 0.2);
  CHECK(b.lower == doctest::Approx(4).epsilon(1e-5));
  CHECK(b.upper == doctest::Approx(4).epsilon(1e-5));
  CHECK(bound_distance(grid, {NAN, 0, 0}, 0.2).lower == 0);
  CHECK_THROWS_AS(distance_grid(make_point_bvh(one), {.resolution = 0}), std::invalid_argument);
  CHECK_THROWS_AS(distance_grid(make_point_bvh(one), {.margin = -1}), std::invalid_argument);
}

TEST_CASE("geometry: many bounds of a distance grid are those of one at a time") {
  const bvh tree = make_soup(60, 1, {3, 0, 0}, 0.1);
  const distance_grid grid(tree, {.resolution = 512}), other(tree, {.resolution = 512});
  CHECK(grid.levels() == 3);
  std::vector<dvec3> points;
  rng_state rng = make_rng(4);
  for (int i = 0; i < 3000; ++i) points.push_back(dvec3{3, 0, 0} + random_point(rng, 1.5));
  points.push_back({NAN, 0, 0});
  std::vector<double> bounds(points.size(), -1);
  for (const double tolerance : {0.1, 0.5}) {
    grid.lower_bounds(points, bounds, tolerance);
    int found = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      REQUIRE(bounds[i] == other.lower_bound(points[i], tolerance));
      const double d = closest_point(tree, points[i]).distance;
      if (bounds[i] == 0) continue;
      ++found;
      REQUIRE(bounds[i] <= d);
      REQUIRE(bounds[i] >= (1 - tolerance) * d);
    }
    CHECK(found > 1500);
  }
  CHECK(bounds.back() == 0);
  CHECK(grid.bytes() > grid.filled());
  CHECK_THROWS_AS(grid.lower_bounds(points, std::span<double>(bounds).first(2), 0.5),
                  std::invalid_argument);
}
