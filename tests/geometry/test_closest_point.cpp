#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <thread>

#include "brute_force.h"

using namespace wisp;
using namespace wisp::test;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

#if defined(__SANITIZE_ADDRESS__)
constexpr int share = 20;  // sanitizers are slow
#else
constexpr int share = 1;
#endif

bvh tree_of(const mesh& m) { return make_bvh(m.triangles, m.positions); }

double half_size(const bvh& tree) { return largest(tree.max() / 2.0 - tree.min() / 2.0); }

// How many answers are wrong, and the first thing that was.
struct tally {
  int wrong = 0;
  std::string first = "";
  void count(const char* what, const dvec3& p, const char* name) {
    if (what == nullptr) return;
    if (wrong++ == 0) {
      first = std::string(name) + ": " + what + " from " + std::to_string(p.x) + " " +
              std::to_string(p.y) + " " + std::to_string(p.z);
    }
  }
};
#define CHECK_NONE(t) CHECK_MESSAGE((t).wrong == 0, (t).wrong, " wrong; the first: ", (t).first)

void check_tree(tally& t, const elements& e, const bvh& tree, const std::vector<dvec3>& points,
                const char* name) {
  for (const dvec3& p : points) {
    const closest_point_result r = closest_point(tree, p);
    const char* wrong = whats_wrong(e, p, r);
    if (wrong == nullptr && r) {
      wrong = whats_inconsistent(r.at, e.corners(std::size_t(r.element)), e.kind);
    }
    t.count(wrong, p, name);
  }
}

// What a bound in single precision may be off by.
double bound_noise(const bvh& tree, const dvec3& p) {
  const double size = 2 * half_size(tree);
  const dvec3 c = tree.min() / 2.0 + tree.max() / 2.0;
  return 1e-5 * std::max(size, largest(p - c));
}

}  // namespace

TEST_CASE("geometry: closest points against all triangles") {
  tally t;
  for (const mesh& m : awkward_meshes()) {
    check_tree(t, elements_of(m), tree_of(m), query_points(elements_of(m), 4000 / share), m.name);
  }
  CHECK_NONE(t);
}

TEST_CASE("geometry: closest points of huge and tiny and distant meshes") {
  const std::vector<mesh> some = {bumpy(1), slivers(40, 1e3), cube(1), soup(64, 0.5), degenerate()};
  tally t;
  for (const mesh& m : some) {
    for (const double scale : {1e-60, 1e-30, 1e-6, 1e6, 1e30, 1e60}) {
      const mesh s = transformed(m, scale);
      check_tree(t, elements_of(s), tree_of(s), query_points(elements_of(s), 800 / share), m.name);
      const mesh o = transformed(m, scale, dvec3{1e5, -2e5, 3e4} * scale);
      check_tree(t, elements_of(o), tree_of(o), query_points(elements_of(o), 800 / share), m.name);
    }
    for (const double offset : {1e9, 1e12}) {
      const mesh o = transformed(m, 1, dvec3{offset, -offset / 3, offset / 7});
      check_tree(t, elements_of(o), tree_of(o), query_points(elements_of(o), 800 / share), m.name);
    }
  }
  CHECK_NONE(t);
}

TEST_CASE("geometry: distances to a mesh far from the origin lose nothing") {
  // vertices and points that doubles hold exactly, so that the distance is known from
  // the same mesh at the origin
  mesh m = soup(100, 0.5);
  for (dvec3& p : m.positions) p = glm::round(p * 0x1p20) * 0x1p-20;
  const double offset = 0x1p30;
  const mesh far = transformed(m, 1, dvec3{offset, -offset, offset});
  const bvh tree = tree_of(m), far_tree = tree_of(far);
  rng_state rng = make_rng(31);
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const dvec3 p = glm::round(random_in_cube(rng, 2) * 0x1p20) * 0x1p-20;
    const double d = closest_point(tree, p).distance;
    const double e = closest_point(far_tree, p + dvec3{offset, -offset, offset}).distance;
    worst = std::max(worst, std::abs(d - e));
  }
  CHECK(worst <= 1e-14);
}

TEST_CASE("geometry: closest distances against extended precision") {
  tally t;
  for (const mesh& m : awkward_meshes()) {
    const elements e = elements_of(m);
    const bvh tree = tree_of(m);
    for (const dvec3& p : query_points(e, 400 / share, 2)) {
      const double d = closest_point(tree, p).distance, w = wide_closest(e, p);
      const double noise =
          m.noise + 1e-15 * d + std::max(rounding(p, tree.min()), rounding(p, tree.max()));
      t.count(std::abs(d - w) <= noise ? nullptr : "distance", p, m.name);
    }
  }
  CHECK_NONE(t);
}

TEST_CASE("geometry: a million closest points on slivers and sheets are never wrong") {
  tally t;
  for (uint64_t i = 0; i < 100; ++i) {
    // between 10 and 40 slivers of one kind, alone, doubled by a sheet, or in a big soup
    mesh m = slivers(10 + static_cast<int>(i % 31), std::pow(10.0, double(i % 13)), i + 10);
    if (i % 3 == 1) m = joined(m, transformed(m, 1 + 1e-7));
    if (i % 3 == 2) m = joined(m, soup(20, 3, i));
    if (i % 7 == 0) m = joined(m, transformed(m, 1e-4));
    check_tree(t, elements_of(m), tree_of(m), query_points(elements_of(m), 10000 / share, i),
               m.name);
  }
  CHECK_NONE(t);
}

TEST_CASE("geometry: a sliver is not taken for farther than what is next to it") {
  // one sliver under p, and something else that is a little farther: of which single
  // precision would not know which is the nearer
  rng_state rng = make_rng(19);
  tally t;
  for (int i = 0; i < 60000 / share; ++i) {
    mesh m = slivers(1 + i % 2, std::pow(10.0, uniform(rng, 0.5, 4.5)), uint64_t(i));
    const auto k = static_cast<std::size_t>(3 * (i % 2));
    double a = rand1d(rng), b = rand1d(rng);
    if (a + b > 1) {
      a = 1 - a;
      b = 1 - b;
    }
    const dvec3 u = m.positions[k + 1] - m.positions[k], v = m.positions[k + 2] - m.positions[k];
    const double d = std::pow(10.0, uniform(rng, -6, 0));
    const dvec3 p = m.positions[k] + a * u + b * v + d * glm::normalize(glm::cross(u, v));
    const double more = 1e-6 + std::pow(10.0, uniform(rng, -6, -2));
    const dvec3 q = p + random_direction(rng) * (d + more);
    add_triangle(m, q, q, q);
    const elements e = elements_of(m);
    t.count(whats_wrong(e, p, closest_point(tree_of(m), p)), p, m.name);
  }
  CHECK_NONE(t);
}

TEST_CASE("geometry: closest points of segments and of points") {
  rng_state rng = make_rng(8);
  tally t;
  for (const int n : {1, 5, 8, 9, 64, 65, 300}) {
    for (const double length : {0.0, 1e-3, 0.5}) {
      for (const double scale : {1e-30, 1.0, 1e30}) {
        std::vector<dvec3> positions;
        std::vector<ivec2> segments;
        elements e{.kind = bvh_element::segment};
        for (int i = 0; i < n; ++i) {
          const dvec3 a = random_in_cube(rng, 1);
          positions.push_back(a * scale);
          positions.push_back((a + random_in_cube(rng, length)) * scale);
          segments.push_back({2 * i, 2 * i + 1});
          e.vertices.push_back({2 * i, 2 * i + 1, 2 * i + 1});
        }
        if (n > 64) positions[2] = {no_number, 0, 0};
        e.positions = positions;
        const bvh tree = make_segment_bvh(segments, positions);
        CHECK(tree.element() == bvh_element::segment);
        check_tree(t, e, tree, query_points(e, 400 / share), "segments");

        elements f{.kind = bvh_element::point, .positions = positions};
        for (int i = 0; i < 2 * n; ++i) f.vertices.push_back(ivec3{i});
        const bvh points = make_point_bvh(positions);
        CHECK(points.element() == bvh_element::point);
        check_tree(t, f, points, query_points(f, 400 / share), "points");
      }
    }
  }
  CHECK_NONE(t);
}

TEST_CASE("geometry: of equally close elements the first is found") {
  // the center of a grid of boxes is equally far from many faces and corners
  mesh m;
  for (const double x : {-3.0, 3.0}) {
    for (const double y : {-3.0, 3.0}) {
      for (const double z : {-3.0, 3.0}) m = joined(m, transformed(cube(1), 1, {x, y, z}));
    }
  }
  const auto check = [](const mesh& mm, const dvec3& p) {
    const brute_result b = brute_closest(elements_of(mm), p);
    const closest_point_result r = closest_point(tree_of(mm), p);
    CHECK(r.distance == b.distance());
    CHECK(r.element == b.element);
  };
  for (const mesh& mm : {m, repeated(m, 2)}) {
    for (const dvec3& p : {dvec3{0, 0, 0}, dvec3{0, 0, 3}, dvec3{0, 3, 3}, dvec3{3, 3, 3},
                           dvec3{0, 0, 100}, dvec3{0, 0, 2}, dvec3{4, 4, 4}, dvec3{0, 50, 0}}) {
      check(mm, p);
    }
  }
  // each triangle found at its own copy of least index, whatever order they are in
  mesh turned = repeated(soup(20, 0.5), 30);
  rng_state rng = make_rng(77);
  for (std::size_t i = turned.triangles.size() - 1; i > 0; --i) {
    std::swap(turned.triangles[i], turned.triangles[next_uint(rng) % (i + 1)]);
  }
  const elements e = elements_of(turned);
  const bvh tree = tree_of(turned);
  int wrong = 0;
  for (const dvec3& p : query_points(e, 400)) {
    wrong += closest_point(tree, p).element == brute_closest(e, p).element ? 0 : 1;
  }
  CHECK(wrong == 0);
}

TEST_CASE("geometry: closest points of trees over nothing and from nowhere") {
  const std::vector<dvec3> unused = {{1, 2, 3}, {4, 5, 6}};
  mesh broken = soup(3, 1);
  for (std::size_t i : {0u, 4u, 8u}) broken.positions[i].x = no_number;
  for (const bvh& tree : {bvh(), make_bvh(std::span<const ivec3>(), unused), tree_of(broken)}) {
    CHECK(tree.empty());
    const closest_point_result r = closest_point(tree, {0, 0, 0});
    CHECK_FALSE(r);
    CHECK(r.element == -1);
    CHECK(r.distance == inf);
    CHECK(r.lower_bound == inf);
    CHECK(closest_point(tree, {0, 0, 0}, {.max_distance = 3}).lower_bound == 3);
    CHECK_FALSE(closer_than(tree, {0, 0, 0}, inf));
    CHECK(bound_distance(tree, {0, 0, 0}, 0.2).lower == inf);
    CHECK(bound_distance(tree, {no_number, 0, 0}, 0.2).lower == 0);
    const std::vector<dvec3> points(3, dvec3{1, 2, 3});
    std::vector<closest_point_result> results(3);
    closest_points(tree, points, results);
    CHECK_FALSE(results[2]);
    CHECK(results[2].lower_bound == inf);
  }
  const bvh tree = tree_of(cube(1));
  for (const double bad : {no_number, inf, -inf}) {
    for (int a = 0; a < 3; ++a) {
      dvec3 p{0, 0, 0};
      p[a] = bad;
      CHECK_FALSE(closest_point(tree, p));
      CHECK(closest_point(tree, p).lower_bound == 0);
      CHECK(closest_point(tree, p).distance == inf);
      CHECK_FALSE(closer_than(tree, p, inf));
      CHECK(bound_distance(tree, p, 0.5).lower == 0);
      CHECK(bound_distance(tree, p, 0.5).upper == inf);
    }
  }
  // as far as doubles go
  CHECK(closest_point(tree, {1e150, 0, 0}).distance == doctest::Approx(1e150));
  CHECK(closest_point(tree, {0, 0, -1e150}).at.point.z == -1);
}

TEST_CASE("geometry: a tolerance keeps its promise") {
  tally t;
  int inexact = 0;
  for (const mesh& m : awkward_meshes()) {
    const elements e = elements_of(m);
    const bvh tree = tree_of(m);
    for (const dvec3& p : query_points(e, 600 / share, 3)) {
      const closest_point_result exact = closest_point(tree, p);
      for (const double tolerance : {1e-12, 1e-3, 0.2, 0.9, 1 - 1e-9}) {
        const closest_point_result r = closest_point(tree, p, {.tolerance = tolerance});
        const char* wrong = nullptr;
        if (!r) {
          wrong = "nothing found with a tolerance";
        } else if (r.lower_bound > exact.distance || r.distance < exact.distance) {
          wrong = "bound of a tolerance";
        } else if (r.lower_bound < (1 - tolerance) * r.distance - bound_noise(tree, p)) {
          wrong = "farther than the tolerance";
        } else if (std::abs(glm::distance(p, r.at.point) - r.distance) >
                       rounding(p, r.at.point) + 8e-16 * extent(e, std::size_t(r.element), p) ||
                   whats_inconsistent(r.at, e.corners(std::size_t(r.element)), e.kind) != nullptr) {
          wrong = "point of a tolerance";
        }
        inexact += r.distance > exact.distance ? 1 : 0;
        t.count(wrong, p, m.name);
      }
    }
  }
  CHECK_NONE(t);
  CHECK(inexact > 100);  // or there is nothing that a tolerance gains
}

TEST_CASE("geometry: nothing beyond the greatest distance, and all that is within") {
  tally t;
  for (const mesh& m : awkward_meshes()) {
    const bvh tree = tree_of(m);
    for (const dvec3& p : query_points(elements_of(m), 300 / share, 4)) {
      const closest_point_result exact = closest_point(tree, p);
      const double d = exact.distance, above = std::nextafter(d, inf);
      for (const double tolerance : {0.0, 0.2, 0.9}) {
        for (const double most : {d, above, 2 * d, inf}) {
          const auto r = closest_point(tree, p, {.max_distance = most, .tolerance = tolerance});
          const char* wrong = !r                             ? "not found within"
                              : r.distance > most            ? "beyond"
                              : r.lower_bound > d            ? "bound within"
                              : tolerance > 0                ? nullptr
                              : r.distance != d              ? "distance within"
                              : r.element != exact.element   ? "element within"
                              : r.at.point != exact.at.point ? "point within"
                                                             : nullptr;
          t.count(wrong, p, m.name);
        }
        if (!(d > 0)) continue;
        for (const double most : {std::nextafter(d, 0.0), d / 2, 0.0}) {
          const auto r = closest_point(tree, p, {.max_distance = most, .tolerance = tolerance});
          t.count(r || r.distance != inf || r.element != -1 ? "found beyond"
                  : r.lower_bound != most                   ? "bound beyond"
                                                            : nullptr,
                  p, m.name);
        }
      }
      for (const double most : {no_number, -1.0}) {
        const auto r = closest_point(tree, p, {.max_distance = most});
        t.count(r || r.lower_bound > d ? "found within nothing" : nullptr, p, m.name);
      }
    }
  }
  CHECK_NONE(t);
}

TEST_CASE("geometry: a tolerance does not hide what lies just within the greatest distance") {
  // something just beyond is opened first; something nearer must still be found
  rng_state rng = make_rng(9);
  int missed = 0, wrong_bounds = 0;
  for (int i = 0; i < 4000 / share; ++i) {
    std::vector<dvec3> points;
    const dvec3 p = random_in_cube(rng, 0.1);
    const dvec3 u = random_direction(rng), v = -u;
    // a group of eight whose box reaches nearer than its nearest point
    const double beyond = 1 + std::pow(10.0, uniform(rng, -12, -6));
    for (int k = 0; k < 8; ++k) {
      dvec3 w = glm::normalize(u + random_in_cube(rng, 0.6));
      points.push_back(p + w * beyond * (k == 0 ? 1.0 : uniform(rng, 1, 1.05)));
    }
    const double within = uniform(rng, 0.8, 1);
    for (int k = 0; k < 8; ++k) {
      dvec3 w = glm::normalize(v + random_in_cube(rng, 0.01));
      points.push_back(p + w * within * (k == 0 ? 1.0 : uniform(rng, 1, 1.01)));
    }
    const bvh tree = make_point_bvh(points);
    const double d = closest_point(tree, p).distance;
    const auto r = closest_point(tree, p, {.max_distance = 1, .tolerance = 0.3});
    missed += d <= 1 && !r ? 1 : 0;
    wrong_bounds += r.lower_bound > d ? 1 : 0;
  }
  CHECK(missed + wrong_bounds == 0);
}

TEST_CASE("geometry: closer than a distance to the last bit") {
  tally t;
  std::vector<mesh> all = awkward_meshes();
  all.push_back(repeated(soup(3, 1), 70));
  for (const mesh& m : all) {
    const bvh tree = tree_of(m);
    for (const dvec3& p : query_points(elements_of(m), 1500 / share, 5)) {
      const double d = closest_point(tree, p).distance, above = std::nextafter(d, inf);
      const char* wrong = nullptr;
      if (closer_than(tree, p, d)) wrong = "closer than its distance";
      if (!closer_than(tree, p, above)) wrong = "not closer than a bit more";
      if (!closer_than(tree, p, 1.001 * d + 1e-300)) wrong = "not closer than more";
      if (!closer_than(tree, p, 2 * d + 1e-300)) wrong = "not closer than twice";
      if (!closer_than(tree, p, inf)) wrong = "not closer than infinity";
      if (d > 0 && closer_than(tree, p, std::nextafter(d, 0.0))) wrong = "closer than a bit less";
      if (closer_than(tree, p, d / 2) || closer_than(tree, p, 0.999 * d))
        wrong = "closer than less";
      if (closer_than(tree, p, 0) || closer_than(tree, p, -1) || closer_than(tree, p, no_number)) {
        wrong = "closer than nothing";
      }
      t.count(wrong, p, m.name);
    }
  }
  CHECK_NONE(t);
}

TEST_CASE("geometry: bounds hold the distance and are as close as asked") {
  tally t;
  for (const mesh& m : awkward_meshes()) {
    const bvh tree = tree_of(m);
    for (const dvec3& p : query_points(elements_of(m), 2000 / share, 6)) {
      const double d = closest_point(tree, p).distance;
      for (const double tolerance : {1e-3, 0.2, 0.8}) {
        const distance_bounds b = bound_distance(tree, p, tolerance);
        const char* wrong = nullptr;
        if (!(b.lower >= 0 && b.lower <= d && d <= b.upper)) wrong = "bounds without the distance";
        if (!(b.lower >= (1 - tolerance) * b.upper - bound_noise(tree, p))) wrong = "loose bounds";
        t.count(wrong, p, m.name);
      }
    }
  }
  CHECK_NONE(t);
}

TEST_CASE("geometry: batches find what single queries find") {
  const auto same = [](const closest_point_result& a, const closest_point_result& b) {
    return a.distance == b.distance && a.lower_bound == b.lower_bound && a.element == b.element &&
           a.at.point == b.at.point && a.at.uv == b.at.uv && a.at.feature == b.at.feature &&
           a.at.feature_index == b.at.feature_index;
  };
  tally t;
  std::vector<mesh> all = awkward_meshes();
  all.push_back(transformed(soup(100, 0.3), 1, {1e12, 1e12, 0}));
  all.push_back(transformed(cube(2), 1e-30, dvec3{1e-25, 0, 0}));
  all.push_back(bumpy(4));
  for (const mesh& m : all) {
    const bvh tree = tree_of(m);
    std::vector<dvec3> points = query_points(elements_of(m), 1501, 7);
    points[7] = {no_number, 0, 0};
    points[8] = {0, -inf, 0};
    const double size = half_size(tree) + 1e-30;
    for (const closest_point_options& options :
         {closest_point_options{}, closest_point_options{.max_distance = 0.2 * size},
          closest_point_options{.tolerance = 0.3}, closest_point_options{.tolerance = 1e-12},
          closest_point_options{.max_distance = size, .tolerance = 0.1}}) {
      std::vector<closest_point_result> single;
      for (const dvec3& p : points) single.push_back(closest_point(tree, p, options));
      for (const int threads : {1, 2, 0}) {
        std::vector<closest_point_result> batch(points.size());
        closest_points(tree, points, batch, options, threads);
        for (std::size_t i = 0; i < points.size(); ++i) {
          t.count(same(single[i], batch[i]) ? nullptr : "batch", points[i], m.name);
        }
      }
    }
    for (const int threads : {1, 2, 0}) {
      std::vector<distance_bounds> batch(points.size());
      bound_distances(tree, points, batch, 0.2, threads);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const distance_bounds b = bound_distance(tree, points[i], 0.2);
        t.count(b.lower == batch[i].lower && b.upper == batch[i].upper ? nullptr : "batched bounds",
                points[i], m.name);
      }
    }
  }
  CHECK_NONE(t);
}

TEST_CASE("geometry: batches of any size, and of sizes that do not match") {
  const bvh tree = tree_of(bumpy(2));
  rng_state rng = make_rng(12);
  for (const std::size_t n : {0u, 1u, 2u, 3u, 4u, 511u, 512u, 513u, 1025u}) {
    std::vector<dvec3> points(n);
    for (dvec3& p : points) p = random_in_cube(rng, n % 2 == 0 ? 1 : 20);
    std::vector<closest_point_result> results(n);
    std::vector<distance_bounds> bounds(n);
    closest_points(tree, points, results, {}, 2);
    bound_distances(tree, points, bounds, 0.5, 2);
    int wrong = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double d = closest_point(tree, points[i]).distance;
      wrong += results[i].distance == d && bounds[i].lower <= d && bounds[i].upper >= d ? 0 : 1;
    }
    CHECK(wrong == 0);
  }
  std::vector<dvec3> points(4);
  std::vector<closest_point_result> results(3);
  std::vector<distance_bounds> bounds(5);
  CHECK_THROWS_WITH_AS(closest_points(tree, points, results),
                       "closest_points: 3 results for 4 points", std::invalid_argument);
  CHECK_THROWS_WITH_AS(bound_distances(tree, points, bounds, 0.2),
                       "bound_distances: 5 results for 4 points", std::invalid_argument);
}

TEST_CASE("geometry: a tree answers several threads at once") {
  const mesh m = bumpy(4);
  const bvh tree = tree_of(m);
  const std::vector<dvec3> points = query_points(elements_of(m), 20000 / share, 13);
  std::vector<closest_point_result> expected, found[3];
  for (const dvec3& p : points) expected.push_back(closest_point(tree, p));
  std::vector<std::thread> threads;
  for (auto& f : found) {
    threads.emplace_back([&] {
      const bvh copy = tree;
      for (const dvec3& p : points) f.push_back(closest_point(copy, p));
    });
  }
  for (std::thread& th : threads) th.join();
  int wrong = 0;
  for (const auto& f : found) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      wrong += f[i].element == expected[i].element && f[i].distance == expected[i].distance ? 0 : 1;
    }
  }
  CHECK(wrong == 0);
}
