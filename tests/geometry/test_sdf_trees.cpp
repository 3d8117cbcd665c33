#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <thread>
#include <vector>

#include "random_points.h"
#include "wisp/geometry/sdf.h"

// Trees of many solids, deep ones, and solids of any size and place.

using namespace wisp;
using wisp::test::random_point;
using wisp::test::rounds;
using wisp::test::uniform;

namespace {

struct counting_leaf final : sdf_leaf_base {
  sdf solid;
  long* count;
  double stretch;  // distances times this
  counting_leaf(const sdf& s, long* n, double f = 1) : solid(s), count(n), stretch(f) {}
  double distance(const dvec3& p, double within) const override {
    ++*count;
    const double v = stretch * signed_distance(solid, p);
    // no more than was asked for
    return std::abs(v) > within ? std::copysign(within, v) : v;
  }
  sdf_properties properties() const override {
    sdf_properties about = wisp::properties(solid);
    about.lipschitz = stretch;
    return about;
  }
};
sdf counted(const sdf& solid, long* count, double stretch = 1) {
  return sdf_leaf(std::make_shared<counting_leaf>(solid, count, stretch));
}

sdf random_solid(rng_state& rng, double size) {
  const dvec3 c = random_point(rng, 1);
  const double r = size * uniform(rng, 0.3, 1);
  const double kind = rand1d(rng);
  if (kind < 0.4) return sdf_sphere(c, r);
  if (kind < 0.6) return sdf_box(c, {r, 0.6 * r, 1.3 * r});
  if (kind < 0.7) return sdf_torus(c, random_point(rng, 1), r, 0.3 * r);
  if (kind < 0.8) return sdf_ellipsoid(c, {r, 0.5 * r, 0.8 * r});
  // bounds that are not the distance
  const std::vector<sdf> lens = {sdf_sphere(c, r), sdf_sphere(c + dvec3{r, 0, 0}, r)};
  if (kind < 0.9) return sdf_intersection(lens);
  return sdf_transform({1, 0, 0, 0, 0.5, 0, 0.3, 0, 2, 0, 0, 0},
                       sdf_offset(sdf_sphere(c, r), -0.1 * r));
}

}  // namespace

TEST_CASE("geometry: values of unions are those without a tree to the last bit") {
  rng_state rng = make_rng(3);
  for (const int n : {2, 3, 7, 50, 400}) {
    std::vector<sdf> solids;
    for (int i = 0; i < n; ++i) solids.push_back(random_solid(rng, 0.2));
    const sdf box = sdf_box({0, 0, 0}, {0.9, 0.8, 1});
    std::vector<sdf> of_box = {box};
    of_box.insert(of_box.end(), solids.begin(), solids.end());
    const sdf all = sdf_union(solids), carved = sdf_difference(of_box);
    const sdf smooth = sdf_smooth_union(solids, 0.05);
    const dbox3 carved_box = properties(carved).bounds;
    int wrong = 0, off = 0;
    for (int i = 0; i < 200 * rounds; ++i) {
      const dvec3 p = random_point(rng, i % 5 == 0 ? 1e3 : 1.5);
      std::vector<double> values;
      for (const sdf& s : solids) values.push_back(signed_distance(s, p));
      std::sort(values.begin(), values.end());
      wrong += signed_distance(all, p) != values[0];
      const double uncut = std::max(signed_distance(box, p), -values[0]);
      const double away = distance(carved_box, p);
      wrong += signed_distance(carved, p) != (away > 0 ? std::max(away, uncut) : uncut);
      double folded = values[0];
      for (std::size_t j = 1; j < values.size(); ++j) {
        const double h = std::max(0.05 - std::abs(folded - values[j]), 0.0);
        folded = std::min(folded, values[j]) - h * h / (4 * 0.05);
      }
      off += !(std::abs(signed_distance(smooth, p) - folded) <= 1e-15 * (1 + std::abs(folded)));
    }
    CHECK(wrong == 0);
    CHECK(off == 0);
  }
}

TEST_CASE("geometry: what cannot matter is not evaluated in any operation") {
  rng_state rng = make_rng(8);
  long count = 0;
  std::vector<sdf> spheres;
  for (int i = 0; i < 1000; ++i) {
    spheres.push_back(counted(sdf_sphere(random_point(rng, 1), 0.05), &count));
  }
  std::vector<sdf> carved = {sdf_box({0, 0, 0}, {1, 1, 1})};
  carved.insert(carved.end(), spheres.begin(), spheres.end());
  // one after the other, and in groups of groups
  sdf grown = spheres[0], thinned = carved[0];
  std::vector<sdf> groups;
  for (std::size_t i = 1; i < spheres.size(); ++i) {
    grown = sdf_union(std::vector<sdf>{grown, spheres[i]});
    thinned = sdf_difference(std::vector<sdf>{thinned, spheres[i]});
  }
  thinned = sdf_difference(std::vector<sdf>{thinned, spheres[0]});
  for (std::size_t i = 0; i < 10; ++i) {
    groups.push_back(
        sdf_union(std::vector<sdf>(spheres.begin() + static_cast<long>(100 * i),
                                   spheres.begin() + static_cast<long>(100 * i + 100))));
  }
  struct case_of {
    sdf solid;
    long limit;
  };
  const case_of cases[] = {
      {sdf_union(spheres), 12},
      {grown, 16},
      {sdf_union(groups), 12},
      {sdf_difference(carved), 12},
      {thinned, 16},
      {sdf_smooth_union(spheres, 0.02), 16},
      {sdf_smooth_difference(carved, 0.02), 16},
      {sdf_complement(sdf_offset(sdf_union(spheres), 0.01)), 12},
  };
  const sdf reference = sdf_union(spheres);
  for (const case_of& c : cases) {
    CAPTURE(&c - cases);
    count = 0;
    for (int i = 0; i < 1000; ++i) signed_distance(c.solid, random_point(rng, 1.3));
    CHECK(count < c.limit * 1000);
    CHECK(count > 500);
    count = 0;
    for (int i = 0; i < 100; ++i) signed_distance(c.solid, random_point(rng, 1.3), -0.001, 0.001);
    CHECK(count < 10 * 100);
  }
  for (int i = 0; i < 1000; ++i) {
    const dvec3 p = random_point(rng, 1.3);
    REQUIRE(signed_distance(grown, p) == signed_distance(reference, p));
    REQUIRE(signed_distance(thinned, p) == signed_distance(cases[3].solid, p));
  }
  // far away, their box says it
  count = 0;
  CHECK(signed_distance(reference, {1e6, 0, 0}, -1, 100) == 100);
  CHECK(count == 0);
}

TEST_CASE("geometry: leaves may stop at what is asked for and have any Lipschitz constant") {
  long count = 0;
  rng_state rng = make_rng(21);
  const sdf s = sdf_sphere({0, 0, 0}, 1);
  const sdf steep = counted(s, &count, 4);
  CHECK(properties(steep).lipschitz == 1);
  CHECK_FALSE(properties(steep).exact_outside);
  for (int i = 0; i < 1000; ++i) {
    const dvec3 p = random_point(rng, 2);
    const double v = signed_distance(s, p), w = signed_distance(steep, p);
    REQUIRE(w == doctest::Approx(std::abs(v) > 0 && !contains(properties(s).bounds, p)
                                     ? std::max(v, distance(properties(s).bounds, p))
                                     : v));
    const double low = uniform(rng, -1, 0), high = uniform(rng, 0, 1);
    REQUIRE(std::clamp(signed_distance(steep, p, low, high), low, high) ==
            doctest::Approx(std::clamp(w, low, high)));
  }
  CHECK_THROWS_AS(counted(s, &count, 0), std::invalid_argument);
  CHECK_THROWS_AS(counted(s, &count, INFINITY), std::invalid_argument);
}

TEST_CASE("geometry: solids may be nested without end") {
  const int n = 10000;
  rng_state rng = make_rng(5);
  const sdf ball = sdf_sphere({0, 0, 0}, 1);
  const auto two = [](const sdf& a, const sdf& b) { return std::vector<sdf>{a, b}; };
  sdf offsets = ball, transforms = ball, unions = ball, mixed = ball, smooth = ball, met = ball;
  const double turn = 0.01;
  const glm::dmat4x3 frame = {
      std::cos(turn), std::sin(turn), 0, -std::sin(turn), std::cos(turn), 0, 0, 0, 1, 0, 0, 1e-4};
  std::vector<dvec3> centers;
  for (int i = 0; i < n; ++i) {
    offsets = sdf_offset(offsets, i % 2 == 0 ? 2e-4 : -1e-4);
    transforms = sdf_transform(frame, transforms);
    centers.push_back(random_point(rng, 3));
    const sdf small = sdf_sphere(centers.back(), 0.1);
    unions = sdf_union(two(unions, small));
    mixed = sdf_offset(sdf_smooth_union(two(sdf_complement(mixed), small), 1e-3), 1e-6);
    smooth = sdf_smooth_union(two(smooth, small), 1e-3);
    met =
        sdf_union(two(sdf_intersection(two(met, sdf_box({0, 0, 0}, dvec3{9 - 1e-4 * i}))), small));
  }
  for (int i = 0; i < 5; ++i) {
    const dvec3 p = random_point(rng, 3);
    const double away = glm::length(p) - 1;
    CHECK(signed_distance(offsets, p) == doctest::Approx(away - 0.5));
    CHECK(signed_distance(transforms, p) == doctest::Approx(glm::distance(p, {0, 0, 1}) - 1));
    double least = away;
    for (const dvec3& c : centers) least = std::min(least, glm::distance(p, c) - 0.1);
    CHECK(signed_distance(unions, p) == doctest::Approx(least));
    CHECK(signed_distance(met, p) == doctest::Approx(least));
    const double s = signed_distance(smooth, p);
    CHECK(s <= least);
    CHECK(s > least - 0.1);
    CHECK(std::isfinite(signed_distance(mixed, p)));
    CHECK(glm::length(gradient(smooth, p)) == doctest::Approx(1));
    CHECK(glm::length(gradient(transforms, p)) == doctest::Approx(1));
    CHECK(signed_distance(smooth, p, -1e-9, 1e-9) * s >= 0);
  }
  // deep and shallow evaluation agree
  sdf shallow = ball, deep = ball;
  for (int i = 0; i < 100; ++i) {
    const sdf small = sdf_sphere(centers[static_cast<std::size_t>(i)], 0.3);
    deep = i % 3 == 0   ? sdf_difference(two(deep, small))
           : i % 3 == 1 ? sdf_offset(sdf_smooth_union(two(small, deep), 0.1), -1e-3)
                        : sdf_union(two(sdf_transform(frame, deep), small));
    if (i < 40) shallow = deep;
  }
  // by hand, from where recursion can
  const auto by_hand = [&](const dvec3& at) {
    struct {
      const std::vector<dvec3>& centers;
      const sdf& base;
      const glm::dmat4x3& frame;
      double operator()(int i, const dvec3& p) const {
        if (i < 40) return signed_distance(base, p);
        const double s = glm::distance(p, centers[static_cast<std::size_t>(i)]) - 0.3;
        if (i % 3 == 0) return std::max((*this)(i - 1, p), -s);
        if (i % 3 == 1) {
          const double d = (*this)(i - 1, p), h = std::max(0.1 - std::abs(d - s), 0.0);
          return std::min(d, s) - h * h / 0.4 + 1e-3;
        }
        const dvec3 q = p - frame[3];
        const glm::dmat3 axes(frame[0], frame[1], frame[2]);
        return std::min((*this)(i - 1, q * axes), s);
      }
    } const f{centers, shallow, frame};
    return f(99, at);
  };
  int different = 0;
  for (int i = 0; i < 100 * rounds; ++i) {
    const dvec3 p = random_point(rng, 3);
    const double v = signed_distance(deep, p);
    // differences are bounded by boxes too
    different += !(std::abs(v - by_hand(p)) < 1e-9) && !(v > by_hand(p) && v > 0);
    const double w = signed_distance(deep, p, -0.05, 0.05);
    different += !(std::abs(std::clamp(v, -0.05, 0.05) - std::clamp(w, -0.05, 0.05)) < 1e-12);
    if (v < 0) different += !contains(properties(deep).bounds, p);
  }
  CHECK(different == 0);
}

TEST_CASE("geometry: the deepest solids are freed without recursion") {
  double before = 0, after = 0;
  std::thread([&] {  // whose stack is small
    const sdf small = sdf_sphere({3, 0, 0}, 0.1);
    sdf deep = sdf_sphere({0, 0, 0}, 1);
    for (int i = 0; i < 100000; ++i) {
      deep = sdf_smooth_union(std::vector<sdf>{deep, small}, i % 2 == 0 ? 1e-6 : 2e-6);
    }
    before = signed_distance(deep, {-3, 0, 0});
    sdf other = sdf_complement(deep);
    deep = small;
    after = signed_distance(other, {-3, 0, 0});
    other = small;
  })
      .join();
  CHECK(before == 2);
  CHECK(after == -2);
}

TEST_CASE("geometry: deep operands count as others do") {
  rng_state rng = make_rng(41);
  std::vector<sdf> operands;
  for (int k = 0; k < 4; ++k) {
    const dvec3 center = random_point(rng, 1);
    sdf deep = sdf_sphere(center, 0.2);
    for (int i = 0; i < 90; ++i) {
      const sdf small = sdf_sphere(center + random_point(rng, 0.2), 0.02);
      deep = sdf_smooth_union(std::vector<sdf>{deep, small}, 0.002);
    }
    operands.push_back(deep);
    operands.push_back(sdf_sphere(random_point(rng, 1), 0.3));
  }
  const double k = 0.4;
  const sdf smooth = sdf_smooth_union(operands, k), sharp = sdf_union(operands);
  const sdf met = sdf_intersection(operands);
  int wrong = 0, near = 0;
  for (int i = 0; i < 200 * rounds; ++i) {
    const dvec3 p = random_point(rng, 1.5);
    std::vector<double> v;
    for (const sdf& s : operands) v.push_back(signed_distance(s, p));
    std::sort(v.begin(), v.end());
    double folded = v[0];
    for (std::size_t j = 1; j < v.size(); ++j) {
      const double h = std::max(k - std::abs(folded - v[j]), 0.0);
      folded = std::min(folded, v[j]) - h * h / (4 * k);
      near += j > 1 && h > 0;
    }
    wrong += !(std::abs(signed_distance(smooth, p) - folded) < 1e-12);
    wrong += signed_distance(sharp, p) != v[0];
    const double most = std::max(v.back(), distance(properties(met).bounds, p));
    wrong += signed_distance(met, p) != most;
  }
  CHECK(wrong == 0);
  CHECK(near > 100);
}

TEST_CASE("geometry: deep solids may be freed and read on several threads") {
  rng_state rng = make_rng(2);
  sdf deep = sdf_sphere({0, 0, 0}, 1);
  for (int i = 0; i < 3000; ++i) {
    deep = sdf_smooth_union(std::vector<sdf>{deep, sdf_sphere(random_point(rng, 2), 0.1)}, 0.01);
  }
  const dvec3 p = {0.3, 1.5, -0.4};
  const double expected = signed_distance(deep, p);
  std::vector<double> values(4);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < values.size(); ++i) {
    threads.emplace_back([copy = deep, &values, i, p]() mutable {
      values[i] = signed_distance(copy, p);
      copy = sdf();
    });
  }
  deep = sdf();
  for (std::thread& t : threads) t.join();
  for (const double v : values) CHECK(v == expected);
}

TEST_CASE("geometry: chains of maps are one and undo each other") {
  const sdf s = sdf_box({0.2, 0.1, 0}, {0.5, 0.3, 0.2});
  const glm::dmat4x3 frame = {0, 2, 0, -2, 0, 0, 0, 0, 2, 1, 2, 3};
  const glm::dmat4x3 back = {0, -0.5, 0, 0.5, 0, 0, 0, 0, 0.5, -1, 0.5, -1.5};
  const sdf same = sdf_transform(back, sdf_transform(frame, s));
  const sdf twice = sdf_complement(sdf_complement(s));
  const sdf there = sdf_offset(sdf_complement(sdf_offset(sdf_complement(s), 0.1)), 0.1);
  CHECK(properties(twice).bounds.max.x == 0.7);
  CHECK(is_finite(properties(there).bounds));
  // an offset within a scale is scaled
  const sdf grown = sdf_transform(frame, sdf_offset(s, 0.1));
  CHECK(properties(grown).exact_outside);
  CHECK_FALSE(properties(grown).exact_inside);
  // and its box stretched with it
  const sdf tall =
      sdf_transform({1, 0, 0, 0, 1, 0, 0, 0, 10, 0, 0, 0}, sdf_offset(sdf_sphere({0, 0, 0}, 1), 1));
  CHECK(properties(tall).bounds.max.z >= 20);
  CHECK(signed_distance(tall, {0, 0, 19.9}) < 0);
  CHECK(signed_distance(tall, {0, 0, 20.1}) > 0);
  rng_state rng = make_rng(6);
  for (int i = 0; i < 1000; ++i) {
    const dvec3 p = random_point(rng, 2);
    const double v = signed_distance(s, p);
    REQUIRE(std::abs(signed_distance(same, p) - v) < 1e-14);
    REQUIRE(signed_distance(twice, p) == v);
    REQUIRE(std::abs(signed_distance(there, p) - v) < 1e-14);
    const dvec3 q = dvec3{-2 * p.y, 2 * p.x, 2 * p.z} + dvec3{1, 2, 3};
    REQUIRE(std::abs(signed_distance(grown, q) - 2 * (v - 0.1)) < 1e-13);
  }
}

TEST_CASE("geometry: frames that are nearly flat keep bounds safe") {
  rng_state rng = make_rng(14);
  for (const double thin : {1e-3, 1e-6, 1e-9}) {
    // a ball pressed flat along a direction that is no axis, by shearing
    const dvec3 n = glm::normalize(dvec3{1, 2, 3});
    const glm::dmat3 press = glm::dmat3(1.0) - (1 - thin) * glm::outerProduct(n, n);
    const sdf flat =
        sdf_transform({press[0], press[1], press[2], dvec3{1, 1, 1}}, sdf_sphere({0, 0, 0}, 1));
    const double v = signed_distance(flat, {1, 1, 1});
    CHECK(v < 0);
    CHECK(v >= -thin * (1 + 1e-6));
    CHECK(v <= -thin * 0.99);
    for (int i = 0; i < 1000; ++i) {
      const dvec3 p = random_point(rng, 3);
      dvec3 on = random_point(rng, 1);
      on = dvec3{1, 1, 1} + press * glm::normalize(on);
      REQUIRE(std::abs(signed_distance(flat, p)) <= glm::distance(p, on) + 1e-12);
    }
  }
}

TEST_CASE("geometry: solids with nothing and with everything in them") {
  const sdf nothing = sdf_empty(), all = sdf_complement(nothing), s = sdf_sphere({0, 0, 0}, 1);
  const auto at = [](const sdf& solid) { return signed_distance(solid, {3, 0, 0}); };
  const double inf = std::numeric_limits<double>::infinity();
  const auto of = [](const sdf& a, const sdf& b) { return std::vector<sdf>{a, b}; };
  CHECK(at(all) == -inf);
  CHECK(at(sdf_union(of(nothing, s))) == 2);
  CHECK(at(sdf_union(of(nothing, nothing))) == inf);
  CHECK(at(sdf_union(of(all, s))) == -inf);
  CHECK(at(sdf_smooth_union(of(all, s), 1)) == -inf);
  CHECK(at(sdf_smooth_union(of(nothing, s), 1)) == 2);
  CHECK(at(sdf_intersection(of(all, s))) == 2);
  CHECK(properties(sdf_intersection(of(all, s))).exact_outside);
  CHECK(at(sdf_intersection(of(nothing, s))) == inf);
  CHECK(at(sdf_intersection(of(all, all))) == -inf);
  CHECK(at(sdf_difference(of(s, nothing))) == 2);
  CHECK(at(sdf_difference(of(s, all))) == inf);
  CHECK(at(sdf_difference(of(all, s))) == -2);
  CHECK(at(sdf_smooth_difference(of(all, s), 1)) == -2);
  CHECK(at(sdf_smooth_intersection(of(s, nothing), 1)) == inf);
  CHECK(at(sdf_offset(nothing, 5)) == inf);
  CHECK(at(sdf_transform({2, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0}, nothing)) == inf);
  CHECK(is_empty(properties(sdf_offset(nothing, 5)).bounds));
  // balls apart have nothing in common
  const sdf apart = sdf_intersection(of(s, sdf_sphere({5, 0, 0}, 1)));
  CHECK(at(apart) > 0);
  CHECK(is_empty(properties(apart).bounds));
  CHECK(distance_bound(nothing, {0, 0, 0}) == inf);
  CHECK(distance_bound(s, {0, 0, 0}) == 1);
  CHECK(distance_bound(s, {NAN, 0, 0}) == 0);
  const auto nan = [](const dvec3&) { return std::nan(""); };
  CHECK(distance_bound(sdf_function(nan, {dvec3{-1}, dvec3{1}}), {0, 0, 0}) == 0);
}

TEST_CASE("geometry: primitives have values and normals wherever one looks") {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double offset : {0.0, 1e5}) {
      const dvec3 o = dvec3{offset, offset, -offset} * scale;
      const double k = scale, error = 4e-16 * (offset + 1) * scale * 8;
      const sdf solids[] = {
          sdf_sphere(o, 2 * k),
          sdf_box(o, dvec3{2, 1, 1} * k),
          sdf_rounded_box(o, dvec3{2, 1, 1} * k, k / 2),
          sdf_torus(o, {0, 0, 1}, 2 * k, k),
          sdf_capsule(o - dvec3{k, 0, 0}, o + dvec3{k, 0, 0}, k),
          sdf_cylinder(o - dvec3{k, 0, 0}, o + dvec3{k, 0, 0}, k),
          sdf_cone(o - dvec3{k, 0, 0}, o + dvec3{k, 0, 0}, 2 * k, 0),
          sdf_plane(o, {1, 0, 0}),
          sdf_ellipsoid(o, dvec3{3, 2, 1} * k),
          sdf_ellipsoid(o, dvec3{1, 1, 1} * k),
          sdf_ellipsoid(o, dvec3{2, 2, 1} * k),
      };
      // along x from each
      const double ends[] = {2, 2, 2, 3, 2, 1, 1, 0, 3, 1, 2};
      for (std::size_t i = 0; i < std::size(solids); ++i) {
        CAPTURE(i);
        for (const double far : {1.0, 10.0, 1e6}) {
          const dvec3 p = o + dvec3{ends[i] + far, 0, 0} * k;
          REQUIRE(std::abs(signed_distance(solids[i], p) - far * k) <= error + 1e-15 * far * k);
          REQUIRE(glm::distance(gradient(solids[i], p), {1, 0, 0}) < 1e-4);
        }
        for (const dvec3& d : {dvec3{0, 0, 0}, dvec3{1, 0, 0}, dvec3{-1, 0, 0}, dvec3{0, 1, 0},
                               dvec3{0, 0, 1}, dvec3{0, 2, 0}, dvec3{1, 1, 1}, dvec3{2, 0, 0}}) {
          REQUIRE(std::isfinite(signed_distance(solids[i], o + d * k)));
          REQUIRE(glm::length(gradient(solids[i], o + d * k)) == doctest::Approx(1));
        }
      }
    }
  }
}

TEST_CASE("geometry: ellipsoids are exact next to their middle and for any proportions") {
  // next to the plane of the two longer axes, where the closest point is up the third
  const dvec3 e = {3, 2, 1};
  const sdf s = sdf_ellipsoid({0, 0, 0}, e);
  for (const double height : {0.0, 1e-300, 1e-18, 1e-12, 1e-8, 1e-4}) {
    for (const dvec2& xy :
         {dvec2{0.2, 0.3}, dvec2{1, 0}, dvec2{0, 1}, dvec2{0, 0}, dvec2{2, 0.5}}) {
      const dvec3 p = {xy.x, xy.y, height};
      // from the multiplier of the closest point, which for height 0 is 1
      const dvec2 q = {xy.x * 9 / 8, xy.y * 4 / 3};
      const double z = std::sqrt(1 - q.x * q.x / 9 - q.y * q.y / 4);
      const double expected = glm::distance(p, {q.x, q.y, z});
      REQUIRE(std::abs(-signed_distance(s, p) - expected) <= 1e-14 + height * height);
    }
  }
  rng_state rng = make_rng(1);
  for (const double thin : {1e-3, 1e-5, 1e-8}) {
    for (const dvec3& r :
         {dvec3{1, 1, thin}, dvec3{1, thin, thin}, dvec3{1, std::sqrt(thin), thin}}) {
      const sdf flat = sdf_ellipsoid({0, 0, 0}, r);
      for (int i = 0; i < 2000; ++i) {
        // a point over a point of the surface, no farther than its curvature lets it be closest
        const double z = uniform(rng, -1, 1), a = uniform(rng, 0, 6.3), w = std::sqrt(1 - z * z);
        const dvec3 m = {w * std::cos(a), w * std::sin(a), z};
        const dvec3 on = r * m, n = glm::normalize(m / r);
        const double out = std::pow(10.0, uniform(rng, -6, 3));
        REQUIRE(signed_distance(flat, on + out * n) == doctest::Approx(out).epsilon(1e-9));
        REQUIRE(glm::distance(gradient(flat, on + out * n), n) < 1e-6);
        const dvec3 q = r * random_point(rng, 1);
        REQUIRE(signed_distance(flat, q) * (glm::length(q / r) - 1) >= 0);
        REQUIRE(std::abs(signed_distance(flat, q)) <= glm::distance(q, on) + 1e-15);
      }
    }
  }
}
