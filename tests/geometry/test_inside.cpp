#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <stdexcept>

#include "geometry/mesh_files.h"
#include "wisp/geometry/inside.h"
#include "wisp/geometry/solid_angle.h"

using namespace wisp;
using namespace wisp::test_meshes;

namespace {

inside_test make(const mesh& m, fill_rule rule = fill_rule::nonzero) {
  return inside_test(m.tree(), {.rule = rule, .threads = 1});
}

}  // namespace

TEST_CASE("geometry: fill rules and their confidence") {
  struct row {
    double w;
    bool nonzero, positive, even_odd;
    double confidence[3];
  };
  const row rows[] = {{0, false, false, false, {1, 1, 1}},
                      {1, true, true, true, {1, 1, 1}},
                      {2, true, true, false, {1, 1, 1}},
                      {3, true, true, true, {1, 1, 1}},
                      {-1, true, false, true, {1, 1, 1}},
                      {-2, true, false, false, {1, 1, 1}},
                      {0.25, false, false, false, {0.5, 0.5, 0.5}},
                      {0.5, true, true, true, {0, 0, 0}},
                      {0.75, true, true, true, {0.5, 0.5, 0.5}},
                      {1.25, true, true, true, {1, 1, 0.5}},
                      {1.75, true, true, false, {1, 1, 0.5}},
                      {-0.25, false, false, false, {0.5, 1, 0.5}},
                      {-0.75, true, false, true, {0.5, 1, 0.5}},
                      {-1.5, true, false, true, {1, 1, 0}}};
  for (const row& r : rows) {
    CAPTURE(r.w);
    const bool expected[3] = {r.nonzero, r.positive, r.even_odd};
    const fill_rule rules[3] = {fill_rule::nonzero, fill_rule::positive, fill_rule::even_odd};
    for (int i = 0; i < 3; ++i) {
      const inside_result x = judge_winding(r.w, rules[i]);
      CHECK(x.inside == expected[i]);
      CHECK(x.winding == r.w);
      CHECK(x.confidence == doctest::Approx(r.confidence[i]));
    }
  }
  const inside_result none = judge_winding(std::numeric_limits<double>::quiet_NaN(), {});
  CHECK(!none.inside);
  CHECK(std::isnan(none.winding));
  CHECK(none.confidence == 0);
}

TEST_CASE("geometry: solids that are closed inverted doubled nested and hollow") {
  const mesh ball = sphere(3);
  mesh doubled = ball, hollow = ball, nested = ball, apart = ball;
  append(doubled, ball);
  append(hollow, moved(inverted(ball), 0.5, {0, 0, 0}));
  append(nested, moved(ball, 0.5, {0, 0, 0}));
  append(apart, inverted(moved(ball, 1, {3, 0, 0})));
  const dvec3 center{0.01, 0.02, 0.03}, shell{0.7, 0.1, 0.05}, out{0.8, 0.8, 0.1};
  struct row {
    mesh m;
    double at[3];       // winding numbers at center, shell and out
    bool inside[3][3];  // by rule, at these
  };
  const row rows[] = {
      {ball, {1, 1, 0}, {{true, true, false}, {true, true, false}, {true, true, false}}},
      {inverted(ball),
       {-1, -1, 0},
       {{true, true, false}, {false, false, false}, {true, true, false}}},
      {doubled, {2, 2, 0}, {{true, true, false}, {true, true, false}, {false, false, false}}},
      {hollow, {0, 1, 0}, {{false, true, false}, {false, true, false}, {false, true, false}}},
      {nested, {2, 1, 0}, {{true, true, false}, {true, true, false}, {false, true, false}}},
  };
  const fill_rule rules[3] = {fill_rule::nonzero, fill_rule::positive, fill_rule::even_odd};
  for (const row& r : rows) {
    for (int k = 0; k < 3; ++k) {
      const inside_test t = make(r.m, rules[k]);
      CHECK(t.method() == inside_method::crossings);
      CHECK(t.rule() == rules[k]);
      CHECK(t.boundary_edges() == 0);
      const dvec3 points[3] = {center, shell, out};
      for (int i = 0; i < 3; ++i) {
        const inside_result x = inside(t, points[i]);
        CHECK(x.winding == r.at[i]);
        CHECK(x.inside == r.inside[k][i]);
        CHECK(x.confidence == 1);
      }
    }
  }
  // two balls that face different ways are both solid
  const inside_test t = make(apart);
  CHECK(inside(t, center).inside);
  CHECK(inside(t, {3, 0, 0}).inside);
  CHECK(!inside(t, {1.5, 0, 0}).inside);
}

TEST_CASE("geometry: the inside test chooses by what the mesh is") {
  CHECK(inside_test().method() == inside_method::nothing);
  CHECK(make(mesh{}).method() == inside_method::nothing);
  const mesh ball = sphere(4);
  CHECK(make(ball).method() == inside_method::crossings);
  const mesh open = without(ball, [](std::size_t i) { return i % 100 == 0; });
  CHECK(make(open).method() == inside_method::boundary);
  const mesh small = soup(100, 0.3, 1), large = soup(2000, 0.1, 2);
  CHECK(make(small).method() == inside_method::boundary);
  CHECK(make(large).method() == inside_method::moments);
  CHECK(make(large).boundary_edges() == 6000);
  // many holes in all of it are as costly as a soup
  const mesh sieve = without(sphere(6), [](std::size_t i) { return i % 7 == 0; });
  CHECK(make(sieve).boundary_edges() > 10000);
  CHECK(make(sieve).method() == inside_method::moments);
  // one long boundary is not
  const mesh cut = without(sphere(6), [](std::size_t i) { return i < 8192; });
  CHECK(make(cut).method() == inside_method::boundary);
  for (const mesh* m : {&ball, &open, &large}) {
    CHECK(std::strlen(make(*m).reason()) > 10);
    CHECK(make(*m).bytes() > 0);
  }
  CHECK_THROWS_AS(inside_test(make_point_bvh(ball.positions, {.threads = 1})),
                  std::invalid_argument);
}

TEST_CASE("geometry: inside tests of open meshes follow the winding number") {
  const mesh open = without(sphere(4), [](std::size_t i) { return i % 50 == 0; });
  const mesh sieve = without(sphere(5), [](std::size_t i) { return i % 5 == 0; });
  const mesh confetti = soup(1500, 0.3, 3);
  const mesh meshes[] = {open, sieve, confetti};
  for (const mesh& m : meshes) {
    const inside_test t = make(m);
    const double error = t.method() == inside_method::moments ? 2e-3 : 1e-6;
    int bad = 0;
    for (const dvec3& p : points_around(m, 400, 4)) {
      const inside_result x = inside(t, p);
      const double w = winding_number_sum(m.triangles, m.positions, p);
      if (std::abs(x.winding - w) > error) ++bad;
      if (std::abs(std::abs(w) - 0.5) > error && x.inside != (std::abs(w) > 0.5)) ++bad;
      if (std::abs(x.confidence - std::min(1.0, std::abs(2 * std::abs(w) - 1))) > 2 * error) ++bad;
    }
    CHECK(bad == 0);
  }
}

TEST_CASE("geometry: inside tests of points that are not finite and of batches") {
  constexpr double inf_double = std::numeric_limits<double>::infinity();
  constexpr double nan_double = std::numeric_limits<double>::quiet_NaN();
  const mesh ball = sphere(3);
  const mesh open = without(ball, [](std::size_t i) { return i == 5; });
  const mesh confetti = soup(1500, 0.3, 3);
  for (const mesh* m : {&ball, &open, &confetti}) {
    const inside_test t = make(*m);
    CHECK(!inside(t, {nan_double, 0, 0}).inside);
    CHECK(std::isnan(inside(t, {0, nan_double, 0}).winding));
    CHECK(inside(t, {0, nan_double, 0}).confidence == 0);
    CHECK(inside(t, {inf_double, 0, 0}).winding == 0);
    CHECK(!inside(t, {0, 0, -inf_double}).inside);
    const auto points = points_around(*m, 3000, 5);
    std::vector<inside_result> results(points.size());
    for (const int threads : {1, 2}) {
      inside_all(t, points, results, threads);
      int bad = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const inside_result x = inside(t, points[i]);
        bad += x.inside != results[i].inside || x.winding != results[i].winding;
      }
      CHECK(bad == 0);
    }
    results.pop_back();
    CHECK_THROWS_AS(inside_all(t, points, results), std::invalid_argument);
  }
  CHECK(!inside(inside_test(), {0, 0, 0}).inside);
  CHECK(inside(inside_test(), {0, 0, 0}).confidence == 1);
  CHECK(std::isnan(inside(inside_test(), {nan_double, 0, 0}).winding));
}

TEST_CASE("geometry: inside tests of meshes from files") {
  const auto folder = data_folder();
  if (!folder) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  CHECK(make(read(*folder + "bunny_closed.obj")).method() == inside_method::crossings);
  const mesh bunny = read(*folder + "stanford-bunny.obj");
  const inside_test t = make(bunny);
  CHECK(t.method() == inside_method::boundary);
  CHECK(t.boundary_edges() == 223);
  // the holes in its base are small
  const dvec3 middle = 0.5 * (t.tree().min() + t.tree().max());
  CHECK(inside(t, middle).inside);
  CHECK(inside(t, middle).confidence > 0.8);
  CHECK(make(read(*folder + "rabbit.obj")).method() == inside_method::crossings);
  CHECK(make(read(*folder + "soup.stl")).method() == inside_method::boundary);
}
