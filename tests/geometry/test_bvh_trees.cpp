#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "query_meshes.h"
#include "wisp/geometry/bvh.h"
#include "wisp/geometry/closest_point.h"

using namespace wisp;
using namespace wisp_test;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

// Of how many points the two say something else.
std::size_t differences(const bvh& a, const bvh& b, const std::vector<dvec3>& points) {
  std::size_t n = 0;
  for (const dvec3& p : points) {
    const closest_point_result x = closest_point(a, p), y = closest_point(b, p);
    n += x.element != y.element || x.distance != y.distance || x.at.point != y.at.point ||
         x.at.uv != y.at.uv || x.at.feature != y.at.feature ||
         x.at.feature_index != y.at.feature_index;
  }
  return n;
}

std::vector<vec3> in_single(const std::vector<dvec3>& positions) {
  return {positions.begin(), positions.end()};
}

}  // namespace

TEST_CASE("geometry: what trees of every kind say of themselves") {
  const bvh none;
  CHECK(none.empty());
  CHECK(none.size() == 0);
  CHECK(none.left_out() == 0);
  CHECK(none.bytes() == 0);
  CHECK(none.min().x > none.max().x);
  CHECK(none.element() == bvh_element::triangle);

  const tri_mesh m = moved(ball(2), 3, {1, 2, 3});
  const bvh tree = make_bvh(m.triangles, m.positions);
  const bounding_box box = box_of(m.positions);
  CHECK(tree.size() == m.triangles.size());
  CHECK(tree.min() == box.min);
  CHECK(tree.max() == box.max);
  CHECK(tree.element() == bvh_element::triangle);
  CHECK(tree.bytes() > m.triangles.size() * 12);
  CHECK(tree.bytes() < m.triangles.size() * 400);
  const bvh copy = tree;
  CHECK(copy.data() == tree.data());
  CHECK(std::string(geometry_target()) != "");

  const std::vector<ivec2> segments = {{0, 1}, {1, 2}};
  CHECK(make_segment_bvh(segments, m.positions).element() == bvh_element::segment);
  CHECK(make_point_bvh(m.positions).element() == bvh_element::point);
  CHECK(make_point_bvh(m.positions).size() == m.positions.size());
  CHECK(make_point_bvh(std::vector<dvec3>()).empty());
  CHECK(make_segment_bvh(std::vector<ivec2>(), std::vector<dvec3>()).empty());
}

TEST_CASE("geometry: elements with vertices that are not finite are left out") {
  tri_mesh m = ball(1);
  m.positions.push_back({not_a_number, 0, 0});
  m.positions.push_back({0, inf, 0});
  m.positions.push_back({0, 0, -inf});
  m.positions.push_back({not_a_number, not_a_number, not_a_number});  // of no element
  const int v = static_cast<int>(m.positions.size()) - 4;
  const std::size_t good = m.triangles.size();
  for (int k = 0; k < 3; ++k) m.triangles.insert(m.triangles.begin() + 5, {0, v + k, 1});
  const bvh tree = make_bvh(m.triangles, m.positions);
  CHECK(tree.size() == good);
  CHECK(tree.left_out() == 3);
  CHECK(tree.min() == box_of(m.positions).min);
  CHECK(tree.max() == box_of(m.positions).max);

  const bvh all_bad = make_bvh(std::vector<ivec3>(10, {v, 0, 1}), m.positions);
  CHECK(all_bad.empty());
  CHECK(all_bad.left_out() == 10);
  CHECK(all_bad.min().x > all_bad.max().x);
  CHECK_FALSE(static_cast<bool>(closest_point(all_bad, {0, 0, 0})));
  CHECK(closest_point(all_bad, {0, 0, 0}).lower_bound == inf);
  CHECK(make_point_bvh(m.positions).left_out() == 4);
}

TEST_CASE("geometry: indices that are not of a vertex") {
  const std::vector<dvec3> three = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (const int bad : {-1, 3, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {
    for (int k = 0; k < 3; ++k) {
      ivec3 t = {0, 1, 2};
      t[k] = bad;
      const std::vector<ivec3> triangles = {{0, 1, 2}, t};
      CHECK_THROWS_AS(make_bvh(triangles, three), std::invalid_argument);
      CHECK_THROWS_AS(make_bvh(triangles, in_single(three)), std::invalid_argument);
    }
    CHECK_THROWS_AS(make_segment_bvh(std::vector<ivec2>{{0, bad}}, three), std::invalid_argument);
    CHECK_THROWS_AS(make_segment_bvh(std::vector<ivec2>{{bad, 0}}, three), std::invalid_argument);
  }
  CHECK_THROWS_AS(make_bvh(std::vector<ivec3>{{0, 0, 0}}, std::vector<dvec3>()),
                  std::invalid_argument);
}

TEST_CASE("geometry: trees of floats are those of the same doubles") {
  const tri_mesh m = bumpy_body(3);
  const std::vector<vec3> single = in_single(m.positions);
  const std::vector<dvec3> rounded(single.begin(), single.end());
  const bvh a = make_bvh(m.triangles, single), b = make_bvh(m.triangles, rounded);
  CHECK(differences(a, b, points_around(m, 500, 1)) == 0);
  CHECK(a.bytes() == b.bytes());
  CHECK(a.bytes() < make_bvh(m.triangles, m.positions).bytes());
  // one vertex that is not a float is kept
  std::vector<dvec3> mixed = rounded;
  mixed[5] = mixed[5] * (1 + 1e-12);
  REQUIRE(dvec3(vec3(mixed[5])) != mixed[5]);
  const bvh c = make_bvh(m.triangles, mixed);
  CHECK(closest_point(c, mixed[5]).distance == 0);
  CHECK(closest_point(c, mixed[5] * 2.0).at.point == mixed[5]);
}

TEST_CASE("geometry: trees do not depend on the number of threads") {
  for (const tri_mesh& m : {bumpy_body(5), random_soup(20000, 0.02, 4)}) {
    const bvh one = make_bvh(m.triangles, m.positions, {.threads = 1});
    const std::vector<dvec3> points = points_around(m, 800, 5);
    for (const int threads : {2, 3, 0}) {
      const bvh more = make_bvh(m.triangles, m.positions, {.threads = threads});
      CHECK(more.size() == one.size());
      CHECK(differences(one, more, points) == 0);
      std::size_t bounds_differ = 0;
      for (const dvec3& p : points) {
        const distance_bounds x = bound_distance(one, p, 0.3), y = bound_distance(more, p, 0.3);
        bounds_differ += x.lower != y.lower || x.upper != y.upper;
      }
      CHECK(bounds_differ == 0);
    }
  }
}

TEST_CASE("geometry: what is hard to split") {
  // depths of trees by sizes that fall exponentially, heaps, and long rows
  std::vector<dvec3> points;
  for (int i = 0; i < 3000; ++i) points.push_back({std::ldexp(1.0, -i / 3), i % 3 * 1e-3, 0});
  for (int i = 0; i < 500; ++i) points.push_back({0, 0, 0});
  for (int i = 0; i < 500; ++i) points.push_back({1, i, 0});
  const bvh tree = make_point_bvh(points);
  random_numbers random(6);
  std::size_t wrong = 0;
  for (int i = 0; i < 300; ++i) {
    dvec3 p = random.in_cube() * std::ldexp(1.0, -static_cast<int>(random.below(60)));
    if (i % 5 == 0) p *= 1000.0;
    const brute_point truth = brute_force(
        points.size(), 1, [&](std::size_t k, int) { return points[k]; }, p);
    const closest_point_result r = closest_point(tree, p);
    wrong += r.element != truth.element || r.distance != truth.distance;
  }
  CHECK(wrong == 0);
}

TEST_CASE("geometry: a refitted tree is as right as a fresh one") {
  tri_mesh m = bumpy_body(3);
  m.positions.push_back({9, 9, 9});                                   // of no element
  m.positions.push_back({not_a_number, not_a_number, not_a_number});  // of one that is left out
  m.triangles.push_back({0, 1, static_cast<int>(m.positions.size()) - 1});
  const bvh tree = make_bvh(m.triangles, m.positions);
  REQUIRE(tree.left_out() == 1);
  random_numbers random(31);
  for (const double s : {1.0, 1e-20, 1e20}) {
    tri_mesh after = m;
    for (dvec3& p : after.positions) p = s * (p + 0.3 * random.in_cube() + dvec3{5, 0, 0});
    const bvh fresh = make_bvh(after.triangles, after.positions);
    const bvh fitted = refit(tree, after.positions, {.threads = 2});
    CHECK(fitted.size() == tree.size());
    CHECK(fitted.left_out() == 1);
    CHECK(fitted.min() == fresh.min());
    CHECK(fitted.max() == fresh.max());
    after.positions.back() = {0, 0, 0};
    const std::vector<dvec3> points = points_around(after, 700, 2);
    CHECK(differences(fresh, fitted, points) == 0);
    std::size_t wrong = 0;
    for (const dvec3& p : points) {
      const distance_bounds b = bound_distance(fitted, p, 0.2);
      const double d = closest_point(fresh, p).distance;
      wrong += !(b.lower <= d && d <= b.upper);
    }
    CHECK(wrong == 0);
    // the old one stays as it was
    CHECK(tree.max() == make_bvh(m.triangles, m.positions).max());
  }
  // from floats to doubles, and back
  const std::vector<vec3> single = in_single(m.positions);
  const bvh of_floats = make_bvh(m.triangles, single);
  const bvh of_doubles = refit(of_floats, m.positions);
  CHECK(differences(of_doubles, tree, points_around(ball(2), 300, 3)) == 0);
  const std::vector<dvec3> rounded(single.begin(), single.end());
  CHECK(refit(of_doubles, rounded).bytes() < of_doubles.bytes());
  // all to one place
  const bvh heap = refit(tree, std::vector<dvec3>(m.positions.size(), dvec3{1, 2, 3}));
  CHECK(closest_point(heap, {1, 2, 4}).distance == 1);
  CHECK(closest_point(heap, {1, 2, 4}).element == 0);
}

TEST_CASE("geometry: refits that cannot be") {
  const tri_mesh m = ball(1);
  const bvh tree = make_bvh(m.triangles, m.positions);
  std::vector<dvec3> positions = m.positions;
  positions.pop_back();
  CHECK_THROWS_AS(refit(tree, positions), std::invalid_argument);
  positions.resize(m.positions.size() + 1);
  CHECK_THROWS_AS(refit(tree, positions), std::invalid_argument);
  for (const double bad : {not_a_number, inf, -inf}) {
    positions = m.positions;
    positions[3].y = bad;
    CHECK_THROWS_AS(refit(tree, positions), std::invalid_argument);
  }
  CHECK_THROWS_AS(refit(bvh(), m.positions), std::invalid_argument);
  CHECK(refit(bvh(), std::vector<dvec3>()).empty());
}
