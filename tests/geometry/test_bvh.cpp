#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "brute_force.h"
#include "data_meshes.h"
#include "wisp/geometry/bvh.h"

using namespace wisp;
using namespace wisp::test;

namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr int share = 20;  // sanitizers are slow
#else
constexpr int share = 1;
#endif

// How many points of the mesh's own get an answer that is not right.
int wrong_answers(const mesh& m, const bvh& tree, int points, uint64_t seed = 21) {
  const elements e = elements_of(m);
  int wrong = 0;
  for (const dvec3& p : query_points(e, points, seed)) {
    const closest_point_result r = closest_point(tree, p);
    const char* what = whats_wrong(e, p, r);
    if (what == nullptr && r) {
      what = whats_inconsistent(r.at, e.corners(std::size_t(r.element)), e.kind);
    }
    if (what != nullptr) {
      if (wrong++ == 0)
        MESSAGE(std::string(m.name), ": ", std::string(what), " from ", p.x, " ", p.y, " ", p.z);
    }
  }
  return wrong;
}

bool same(const closest_point_result& a, const closest_point_result& b) {
  return a.distance == b.distance && a.lower_bound == b.lower_bound && a.element == b.element &&
         a.at.point == b.at.point && a.at.uv == b.at.uv && a.at.feature == b.at.feature &&
         a.at.feature_index == b.at.feature_index;
}

// How many results of all kinds differ between two trees over the same mesh.
int differences(const mesh& m, const bvh& a, const bvh& b, int points) {
  int n = 0;
  for (const dvec3& p : query_points(elements_of(m), points, 22)) {
    n += same(closest_point(a, p), closest_point(b, p)) ? 0 : 1;
    const closest_point_options o{.tolerance = 0.25};
    n += same(closest_point(a, p, o), closest_point(b, p, o)) ? 0 : 1;
    const distance_bounds x = bound_distance(a, p, 0.2), y = bound_distance(b, p, 0.2);
    n += x.lower == y.lower && x.upper == y.upper ? 0 : 1;
  }
  return n;
}

}  // namespace

TEST_CASE("geometry: what a tree says of itself") {
  const bvh none;
  CHECK(none.empty());
  CHECK(none.size() == 0);
  CHECK(none.left_out() == 0);
  CHECK(none.bytes() == 0);
  CHECK(none.data() == nullptr);
  CHECK(none.element() == bvh_element::triangle);
  CHECK(none.min().x > none.max().x);

  mesh m = soup(30, 0.5);
  m.positions.push_back({100, 100, 100});  // of no triangle
  const bvh tree = make_bvh(m.triangles, m.positions);
  CHECK(tree.size() == 30);
  CHECK(tree.left_out() == 0);
  CHECK(tree.bytes() > 30 * 50);
  dvec3 low{std::numeric_limits<double>::infinity()}, high = -low;
  for (std::size_t i = 0; i + 1 < m.positions.size(); ++i) {
    low = glm::min(low, m.positions[i]);
    high = glm::max(high, m.positions[i]);
  }
  CHECK(tree.min() == low);
  CHECK(tree.max() == high);
  const bvh copy = tree;
  CHECK(copy.data() == tree.data());
  CHECK(std::string(geometry_target()).size() > 1);
}

TEST_CASE("geometry: vertices that are not finite leave their elements out") {
  constexpr double bad[] = {std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::infinity(),
                            -std::numeric_limits<double>::infinity()};
  mesh m = soup(50, 0.5);
  for (std::size_t i = 0; i < 9; ++i) {
    m.positions[15 * i + i % 3][static_cast<int>(i / 3)] = bad[i % 3];
  }
  const bvh tree = make_bvh(m.triangles, m.positions);
  CHECK(tree.size() == 41);
  CHECK(tree.left_out() == 9);
  CHECK(wrong_answers(m, tree, 500) == 0);
  // all of them, and a vertex that only they have
  std::vector<dvec3> positions(9, dvec3{bad[0], 0, 0});
  const std::vector<ivec3> triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
  const bvh none = make_bvh(triangles, positions);
  CHECK(none.empty());
  CHECK(none.left_out() == 3);
  CHECK(none.min().x > none.max().x);
  // of segments and points
  positions[3] = positions[4] = {1, 2, 3};
  CHECK(make_point_bvh(positions).size() == 2);
  CHECK(make_point_bvh(positions).left_out() == 7);
  CHECK(closest_point(make_point_bvh(positions), {0, 0, 0}).element == 3);
  const std::vector<ivec2> segments = {{0, 1}, {3, 4}, {4, 5}};
  const bvh one = make_segment_bvh(segments, positions);
  CHECK(one.size() == 1);
  CHECK(one.left_out() == 2);
  CHECK(closest_point(one, {0, 0, 0}).element == 1);
}

TEST_CASE("geometry: an index that is not of a vertex is refused") {
  const std::vector<dvec3> positions(4, dvec3{1, 2, 3});
  const std::vector<vec3> floats(4, vec3{1, 2, 3});
  const std::vector<ivec3> high = {{0, 1, 2}, {0, 4, 1}}, low = {{0, 1, -1}};
  CHECK_THROWS_WITH_AS(make_bvh(high, positions), "bvh: element 1 has vertex 4; there are 4",
                       std::invalid_argument);
  CHECK_THROWS_WITH_AS(make_bvh(high, floats), "bvh: element 1 has vertex 4; there are 4",
                       std::invalid_argument);
  CHECK_THROWS_WITH_AS(make_bvh(low, positions), "bvh: element 0 has vertex -1; there are 4",
                       std::invalid_argument);
  CHECK_THROWS_AS(make_bvh(low, std::span<const dvec3>()), std::invalid_argument);
  const std::vector<ivec2> segments = {{0, 3}, {1, 2}, {3, 4}};
  CHECK_THROWS_WITH_AS(make_segment_bvh(segments, positions),
                       "bvh: element 2 has vertex 4; there are 4", std::invalid_argument);
  const std::vector<ivec3> extreme = {{std::numeric_limits<int>::min(), 0, 0},
                                      {0, std::numeric_limits<int>::max(), 0}};
  CHECK_THROWS_AS(make_bvh(extreme, positions), std::invalid_argument);
}

TEST_CASE("geometry: trees of all counts around leaves and nodes hold all that they were given") {
  for (const int n : {1,  2,  3,  4,  5,  6,   7,   8,   9,   10,  15,  16,   17,  31,
                      33, 63, 64, 65, 72, 127, 128, 129, 511, 513, 700, 4095, 4097}) {
    const mesh m = soup(n, 0.1, uint64_t(n));
    const bvh tree = make_bvh(m.triangles, m.positions);
    REQUIRE(tree.size() == std::size_t(n));
    // each one can be found from its middle, unless it is a neighbour's
    int missed = 0;
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(3 * i);
      const dvec3 p = (m.positions[k] + m.positions[k + 1] + m.positions[k + 2]) / 3.0;
      const closest_point_result r = closest_point(tree, p);
      missed += r && r.distance <= 4e-16 * std::max(1.0, largest(p)) ? 0 : 1;
    }
    CHECK(missed == 0);
    if (n < 800) CHECK(wrong_answers(m, tree, 200 / share) == 0);
  }
}

TEST_CASE("geometry: trees that grow deep") {
  // sizes that fall so that a split by area peels off a few at a time
  for (const double ratio : {0.5, 0.9, 0.97}) {
    const mesh m = exponential(700, ratio);
    CHECK(wrong_answers(m, make_bvh(m.triangles, m.positions), 400 / share) == 0);
  }
  // points that gather at a corner, in each of many scales
  mesh corner{.name = "corner"};
  rng_state rng = make_rng(23);
  for (int i = 0; i < 3000; ++i) {
    const double s = std::pow(2.0, -0.04 * i);
    const dvec3 a = random_in_cube(rng, s);
    add_triangle(corner, a, a + random_in_cube(rng, s * 0.01), a + random_in_cube(rng, s * 0.01));
  }
  CHECK(wrong_answers(corner, make_bvh(corner.triangles, corner.positions), 200 / share) == 0);
  // many of one kind, which no split tells apart, beside others
  const mesh many = joined(repeated(soup(1, 1), 6000 / share), soup(50, 0.3));
  const bvh tree = make_bvh(many.triangles, many.positions);
  CHECK(tree.size() == many.triangles.size());
  CHECK(wrong_answers(many, tree, 100 / share) == 0);
  CHECK(closest_point(tree, many.positions[0]).element == 0);
  // points of which most are one
  std::vector<dvec3> points(5000, dvec3{1, 1, 1});
  points[4321] = {1, 1, 1 + 1e-12};
  points[17] = {-1, 0, 0};
  const bvh cloud = make_point_bvh(points);
  CHECK(closest_point(cloud, {1, 1, 1}).element == 0);
  CHECK(closest_point(cloud, {1, 1, 2}).element == 4321);
  CHECK(closest_point(cloud, {-2, 0, 0}).element == 17);
}

TEST_CASE("geometry: trees of floats and of doubles are one where the values are") {
  const mesh m = bumpy(3);
  std::vector<vec3> floats;
  std::vector<dvec3> doubles;
  for (const dvec3& p : m.positions) {
    floats.emplace_back(p);
    doubles.emplace_back(floats.back());
  }
  const mesh rounded{.name = "floats", .triangles = m.triangles, .positions = doubles};
  const bvh a = make_bvh(m.triangles, floats), b = make_bvh(m.triangles, doubles);
  CHECK(differences(rounded, a, b, 2000 / share) == 0);
  CHECK(wrong_answers(rounded, a, 400 / share) == 0);
  CHECK(a.bytes() == b.bytes());
  CHECK(make_bvh(m.triangles, m.positions).bytes() > a.bytes());
}

TEST_CASE("geometry: a tree does not depend on the threads that built it") {
  for (const mesh& m : {bumpy(5), soup(20000, 0.02), exponential(9000, 0.9995)}) {
    const bvh one = make_bvh(m.triangles, m.positions, {.threads = 1});
    for (const int threads : {2, 2, 0}) {
      const bvh more = make_bvh(m.triangles, m.positions, {.threads = threads});
      CHECK(one.bytes() == more.bytes());
      CHECK(differences(m, one, more, 2000 / share) == 0);
    }
  }
}

TEST_CASE("geometry: a tree that was refitted answers as one that is built anew") {
  rng_state rng = make_rng(24);
  const std::vector<mesh> all = {bumpy(2),         cube(2),      soup(100, 0.4),
                                 slivers(50, 1e6), degenerate(), soup(1, 1)};
  for (const mesh& m : all) {
    const bvh tree = make_bvh(m.triangles, m.positions);
    mesh floats = m, moved = m, flat = m;
    for (dvec3& p : floats.positions) p = dvec3(vec3(p * 1.5));
    for (dvec3& p : moved.positions) p += random_in_cube(rng, 0.5);
    for (dvec3& p : flat.positions) p.y = 0;
    mesh away = transformed(m, 1e-7, {4, 5, -6}), point = transformed(m, 0, {1, 2, 3});
    bvh chain = tree;
    for (const mesh& to : {m, moved, floats, flat, away, point, moved}) {
      const bvh once = refit(tree, to.positions, {.threads = 1});
      chain = refit(chain, to.positions, {.threads = 2});
      const bvh fresh = make_bvh(to.triangles, to.positions);
      CHECK(once.size() == fresh.size());
      CHECK(once.min() == fresh.min());
      CHECK(once.max() == fresh.max());
      CHECK(wrong_answers(to, once, 300 / share) == 0);
      CHECK(differences(to, once, chain, 200 / share) == 0);
      int differ = 0;
      for (const dvec3& p : query_points(elements_of(to), 300 / share, 25)) {
        differ += same(closest_point(once, p), closest_point(fresh, p)) ? 0 : 1;
      }
      CHECK(differ == 0);
    }
    // the first is as it was
    CHECK(wrong_answers(m, tree, 200 / share) == 0);
  }
  // segments and points
  std::vector<dvec3> points;
  std::vector<ivec2> segments;
  for (int i = 0; i < 90; ++i) points.push_back(random_in_cube(rng, 1));
  for (int i = 0; i + 1 < 90; ++i) segments.push_back({i, i + 1});
  const bvh line = make_segment_bvh(segments, points), cloud = make_point_bvh(points);
  for (dvec3& p : points) p = p * p + 1.0;
  const bvh line_to = make_segment_bvh(segments, points), cloud_to = make_point_bvh(points);
  const bvh line_by = refit(line, points), cloud_by = refit(cloud, points);
  CHECK(line_by.element() == bvh_element::segment);
  CHECK(cloud_by.element() == bvh_element::point);
  for (int i = 0; i < 500; ++i) {
    const dvec3 p = random_in_cube(rng, 3);
    CHECK(same(closest_point(line_by, p), closest_point(line_to, p)));
    CHECK(same(closest_point(cloud_by, p), closest_point(cloud_to, p)));
  }
}

TEST_CASE("geometry: what cannot be refitted") {
  constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
  mesh m = soup(20, 0.5);
  m.positions[4].x = not_a_number;
  m.positions.push_back({1, 2, 3});  // of no triangle
  const bvh tree = make_bvh(m.triangles, m.positions);
  std::vector<dvec3> to = m.positions;
  to.pop_back();
  CHECK_THROWS_WITH_AS(refit(tree, to), "refit: 60 positions; the tree was made of 61",
                       std::invalid_argument);
  CHECK_THROWS_AS(refit(tree, {}), std::invalid_argument);
  to = m.positions;
  to[30].y = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH_AS(refit(tree, to), "refit: vertex 30 is not finite", std::invalid_argument);
  // of an element that was left out any vertex may be what it likes, and stays out
  to = m.positions;
  to[4] = {0, 0, 0};
  to[3].x = to.back().x = not_a_number;
  const bvh by = refit(tree, to);
  CHECK(by.size() == 19);
  CHECK(by.left_out() == 1);
  for (int i = 0; i < 3; ++i) m.positions[std::size_t(3 + i)].x = not_a_number;
  CHECK(wrong_answers(m, by, 200) == 0);
  CHECK_THROWS_AS(refit(bvh(), to), std::invalid_argument);
  CHECK(refit(bvh(), {}).empty());
  const bvh nothing = make_bvh(std::span<const ivec3>(), to);
  CHECK(refit(nothing, to).empty());
  CHECK_THROWS_AS(refit(nothing, {}), std::invalid_argument);
}

TEST_CASE("geometry: closest points of meshes as they are found in the wild") {
  if (std::getenv("WISP_TEST_DATA") == nullptr) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  for (const char* name :
       {"stanford-bunny.obj", "soup.stl", "cube_with_fold.ply", "sliver_tet.ply", "degenerated.obj",
        "joined_tetrahedra.obj", "rabbit.obj", "quadknot.obj", "busted.STL"}) {
    const std::optional<mesh> m = data_mesh(name);
    if (!m) {
      MESSAGE("skipped: ", std::string(name), " is not there");
      continue;
    }
    INFO(std::string(name));
    const bvh tree = make_bvh(m->triangles, m->positions);
    REQUIRE(m->triangles.size() > 0);
    CHECK(tree.size() == m->triangles.size());
    const int n = 1500000 / static_cast<int>(m->triangles.size() + 700) / share;
    CHECK(wrong_answers(*m, tree, n + 20 / share) == 0);
    if (m->triangles.size() > 1000) continue;
    const mesh tiny = transformed(*m, 1e-6, {0.3, 0.2, 0.1});
    CHECK(wrong_answers(tiny, make_bvh(tiny.triangles, tiny.positions), 500 / share) == 0);
  }
}
