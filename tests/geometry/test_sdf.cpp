#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "random_points.h"
#include "wisp/geometry/sdf.h"

using namespace wisp;
using wisp::test::random_point;
using wisp::test::rounds;
using wisp::test::uniform;

namespace {

// A solid, and by other means whether a point is inside. What follows from a value
// that is 1-Lipschitz, 0 where the solid ends, and of the right sign: it is nowhere
// above the distance. If the gradient leads from p to a point of value 0 at a distance
// of |value|, it is the distance.
struct specimen {
  std::string name;
  sdf solid;
  std::function<bool(const dvec3&)> inside;
};

std::vector<specimen> primitives() {
  const dvec3 c = {0.1, -0.2, 0.15}, axis = glm::normalize(dvec3{1, 2, -0.5});
  const dvec3 a = {-0.4, -0.3, 0.1}, b = {0.5, 0.2, -0.2};
  const auto along = [=](const dvec3& p) {  // radius and height about the axis of a and b
    const dvec3 n = glm::normalize(b - a);
    const double h = glm::dot(p - a, n);
    return dvec2{glm::length(p - a - h * n), h};
  };
  const double l = glm::length(b - a);
  std::vector<specimen> s;
  s.push_back({"sphere", sdf_sphere(c, 0.6),
               [=](const dvec3& p) { return glm::dot(p - c, p - c) < 0.36; }});
  const dvec3 half = {0.5, 0.3, 0.2};
  s.push_back({"box", sdf_box(c, half), [=](const dvec3& p) {
                 const dvec3 q = glm::abs(p - c);
                 return q.x < half.x && q.y < half.y && q.z < half.z;
               }});
  s.push_back({"rounded box", sdf_rounded_box(c, half, 0.1), [=](const dvec3& p) {
                 const dvec3 q = glm::max(glm::abs(p - c) - (half - 0.1), dvec3{0});
                 return glm::dot(q, q) < 0.01;
               }});
  s.push_back({"torus", sdf_torus(c, axis, 0.5, 0.2), [=](const dvec3& p) {
                 const dvec3 q = p - c;
                 const double h = glm::dot(q, axis), r = glm::length(q - h * axis) - 0.5;
                 return r * r + h * h < 0.04;
               }});
  s.push_back({"spindle torus", sdf_torus(c, axis, 0.2, 0.4), [=](const dvec3& p) {
                 const dvec3 q = p - c;
                 const double h = glm::dot(q, axis), r = glm::length(q - h * axis) - 0.2;
                 return r * r + h * h < 0.16;
               }});
  s.push_back({"capsule", sdf_capsule(a, b, 0.2), [=](const dvec3& p) {
                 const dvec3 q = a + std::clamp(along(p).y / l, 0.0, 1.0) * (b - a);
                 return glm::dot(p - q, p - q) < 0.04;
               }});
  s.push_back({"cylinder", sdf_cylinder(a, b, 0.3), [=](const dvec3& p) {
                 const dvec2 q = along(p);
                 return q.x < 0.3 && q.y > 0 && q.y < l;
               }});
  s.push_back({"cone", sdf_cone(a, b, 0.1, 0.5), [=](const dvec3& p) {
                 const dvec2 q = along(p);
                 return q.y > 0 && q.y < l && q.x < 0.1 + 0.4 * q.y / l;
               }});
  s.push_back({"pointed cone", sdf_cone(a, b, 0.4, 0), [=](const dvec3& p) {
                 const dvec2 q = along(p);
                 return q.y > 0 && q.y < l && q.x < 0.4 * (1 - q.y / l);
               }});
  s.push_back({"plane", sdf_plane(c, axis * 3.0),
               [=](const dvec3& p) { return glm::dot(p - c, axis) < 0; }});
  for (const dvec3& e :
       {dvec3{0.6, 0.3, 0.2}, dvec3{0.2, 0.2, 0.7}, dvec3{0.5, 0.5, 0.5}, dvec3{0.02, 0.6, 0.3}}) {
    s.push_back({"ellipsoid", sdf_ellipsoid(c, e), [=](const dvec3& p) {
                   const dvec3 q = (p - c) / e;
                   return glm::dot(q, q) < 1;
                 }});
  }
  return s;
}

specimen combine(const std::string& name, const std::vector<specimen>& of,
                 const std::function<sdf(std::span<const sdf>)>& make,
                 const std::function<bool(const std::vector<bool>&)>& inside) {
  std::vector<sdf> solids;
  for (const specimen& s : of) solids.push_back(s.solid);
  return {name, make(solids), [=](const dvec3& p) {
            std::vector<bool> in;
            for (const specimen& s : of) in.push_back(s.inside(p));
            return inside(in);
          }};
}

bool any(const std::vector<bool>& in) { return std::find(in.begin(), in.end(), true) != in.end(); }
bool all(const std::vector<bool>& in) { return std::find(in.begin(), in.end(), false) == in.end(); }
bool first_only(const std::vector<bool>& in) {
  return in[0] && std::find(in.begin() + 1, in.end(), true) == in.end();
}

std::vector<specimen> combinations() {
  const auto p = primitives();
  std::vector<specimen> s;
  s.push_back(combine("union", p, sdf_union, any));
  s.push_back(combine("intersection", {p[0], p[1], p[5]}, sdf_intersection, all));
  s.push_back(combine("difference", {p[0], p[3], p[6]}, sdf_difference, first_only));
  const specimen moved = {
      "transform", sdf_transform({0, 0.5, 0, -0.5, 0, 0, 0, 0, 0.5, 0.1, 0.2, 0.3}, p[1].solid),
      [in = p[1].inside](const dvec3& x) {
        const dvec3 q = x - dvec3{0.1, 0.2, 0.3};
        return in({2 * q.y, -2 * q.x, 2 * q.z});
      }};
  s.push_back(moved);
  s.push_back({"stretched", sdf_transform({0.5, 0, 0, 0.3, 1.5, 0, 0, 0, 0.8, 0, 0, 0}, p[3].solid),
               [in = p[3].inside](const dvec3& x) {
                 return in({(x.x - 0.3 * x.y / 1.5) / 0.5, x.y / 1.5, x.z / 0.8});
               }});
  s.push_back({"complement", sdf_complement(p[3].solid),
               [in = p[3].inside](const dvec3& x) { return !in(x); }});
  s.push_back(combine("nested", {s[0], s[1], s[2], moved}, sdf_union, any));
  return s;
}

void check_safe(const specimen& s, int count) {
  CAPTURE(s.name);
  rng_state rng = make_rng(17);
  const sdf_properties about = properties(s.solid);
  int wrong_sign = 0, steep = 0, out_of_box = 0, surface_in_ball = 0;
  for (int i = 0; i < count; ++i) {
    const dvec3 p = random_point(rng, i % 3 == 0 ? 4 : 1);
    const dvec3 q = p + random_point(rng, std::pow(10.0, uniform(rng, -6, 0)));
    const double v = signed_distance(s.solid, p), w = signed_distance(s.solid, q);
    steep += !(std::abs(v - w) <= glm::distance(p, q) * (1 + 1e-9) + 1e-14);
    wrong_sign += std::abs(v) > 1e-12 && (v < 0) != s.inside(p);
    out_of_box += v < 0 && !contains(about.bounds, p);
    out_of_box += !(v >= distance(about.bounds, p) - 1e-12) && !contains(about.bounds, p);
    // nothing in the ball is on the other side
    const dvec3 way = random_point(rng, 1);
    const double radius = (std::abs(v) - 1e-12) * (i % 2 == 0 ? 1 : rand1d(rng));
    surface_in_ball += radius > 0 && s.inside(p + way * (radius / glm::length(way))) != (v < 0);
  }
  CHECK(wrong_sign == 0);
  CHECK(surface_in_ball == 0);
  CHECK(steep == 0);
  CHECK(out_of_box == 0);
}

}  // namespace

TEST_CASE("geometry: primitives are exact distances of the right sign") {
  for (const specimen& s : primitives()) {
    check_safe(s, 45000 * rounds);
    CAPTURE(s.name);
    const sdf_properties about = properties(s.solid);
    CHECK(about.exact_outside);
    rng_state rng = make_rng(3);
    int misses = 0, tried = 0;
    for (int i = 0; i < 2000 * rounds; ++i) {
      const dvec3 p = random_point(rng, 1.5);
      const double v = signed_distance(s.solid, p);
      if (v < 0 ? !about.exact_inside : !about.exact_outside) continue;
      const dvec3 g = gradient(s.solid, p);
      if (std::abs(glm::length(g) - 1) > 1e-6) continue;
      ++tried;
      misses += std::abs(signed_distance(s.solid, p - v * g)) > 2e-8;
    }
    CHECK(tried > 1000 * rounds);
    // a step of central differences that crosses a crease, where the gradient jumps
    CHECK(misses <= tried / 1000);
  }
}

TEST_CASE("geometry: operations keep values safe") {
  for (const specimen& s : combinations()) check_safe(s, 45000 * rounds);
}

TEST_CASE("geometry: smooth operations keep values safe and hold what they blend") {
  const auto p = primitives();
  std::vector<sdf> few = {p[0].solid, p[1].solid, p[3].solid, p[6].solid};
  for (const double blend : {0.01, 0.2, 1.0}) {
    const auto always = [](const dvec3&) { return true; };
    const specimen joined{"smooth union", sdf_smooth_union(few, blend), always};
    const specimen met{"smooth intersection", sdf_smooth_intersection(few, blend), always};
    const specimen cut{"smooth difference", sdf_smooth_difference(few, blend), always};
    const sdf sharp_union = sdf_union(few), sharp_met = sdf_intersection(few);
    rng_state rng = make_rng(29);
    int wrong = 0;
    for (int i = 0; i < 20000 * rounds; ++i) {
      const dvec3 x = random_point(rng, 1.2);
      const dvec3 y = x + random_point(rng, 0.01);
      for (const specimen* s : {&joined, &met, &cut}) {
        const double v = signed_distance(s->solid, x), w = signed_distance(s->solid, y);
        wrong += !(std::abs(v - w) <= glm::distance(x, y) * (1 + 1e-9) + 1e-14);
        wrong += v < 0 && !contains(properties(s->solid).bounds, x);
      }
      const double v = signed_distance(joined.solid, x), u = signed_distance(sharp_union, x);
      wrong += !(v <= u && v >= u - blend);
      const double w = signed_distance(met.solid, x), m = signed_distance(sharp_met, x);
      wrong += !(w >= m && w <= m + blend);
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("geometry: a smooth union is its formula and knows no order") {
  const std::vector<sdf> two = {sdf_sphere({0, 0, 0}, 1), sdf_sphere({1.5, 0, 0}, 0.8)};
  const double k = 0.4;
  rng_state rng = make_rng(1);
  for (int i = 0; i < 1000; ++i) {
    const dvec3 p = random_point(rng, 2);
    const double a = signed_distance(two[0], p), b = signed_distance(two[1], p);
    const double h = std::max(k - std::abs(a - b), 0.0);
    const double expected = std::min(a, b) - h * h / (4 * k);
    REQUIRE(signed_distance(sdf_smooth_union(two, k), p) == doctest::Approx(expected));
    const double largest = std::max(a, b) + h * h / (4 * k);
    REQUIRE(signed_distance(sdf_smooth_intersection(two, k), p) == doctest::Approx(largest));
  }
  std::vector<sdf> many;
  for (int i = 0; i < 80; ++i) many.push_back(sdf_sphere(random_point(rng, 0.3), 0.5));
  const sdf one = sdf_smooth_union(many, k);
  std::vector<sdf> turned(many.rbegin(), many.rend());
  const sdf other = sdf_smooth_union(turned, k);
  for (int i = 0; i < 500; ++i) {
    const dvec3 p = random_point(rng, 2);
    std::vector<double> v;
    for (const sdf& s : many) v.push_back(signed_distance(s, p));
    std::sort(v.begin(), v.end());
    double folded = v[0];
    for (std::size_t j = 1; j < v.size(); ++j) {
      const double h = std::max(k - std::abs(folded - v[j]), 0.0);
      folded = std::min(folded, v[j]) - h * h / (4 * k);
    }
    // those farther than the blend from the least are left out of both
    REQUIRE(signed_distance(one, p) == signed_distance(other, p));
    REQUIRE(signed_distance(one, p) >= folded - 1e-12);
    REQUIRE(signed_distance(one, p) <= v[0]);
  }
}

namespace {

struct counting_sphere final : sdf_leaf_base {
  dvec3 center;
  double radius;
  long* count;
  counting_sphere(const dvec3& c, double r, long* n) : center(c), radius(r), count(n) {}
  double distance(const dvec3& p, double) const override {
    ++*count;
    return glm::distance(p, center) - radius;
  }
  sdf_properties properties() const override {
    return {true, true, 1, {center - radius, center + radius}};
  }
};

}  // namespace

TEST_CASE("geometry: a union of a thousand spheres evaluates few of them") {
  rng_state rng = make_rng(8);
  long count = 0;
  std::vector<sdf> spheres;
  for (int i = 0; i < 1000; ++i) {
    spheres.push_back(
        sdf_leaf(std::make_shared<counting_sphere>(random_point(rng, 1), 0.05, &count)));
  }
  const sdf all_of = sdf_union(spheres);
  const sdf smooth = sdf_smooth_union(spheres, 0.02);
  std::vector<dvec3> points;
  for (int i = 0; i < 1000; ++i) points.push_back(random_point(rng, 1.3));
  std::vector<double> values;
  for (const dvec3& p : points) values.push_back(signed_distance(all_of, p));
  CHECK(count < 12 * 1000);
  count = 0;
  for (const dvec3& p : points) signed_distance(smooth, p);
  CHECK(count < 16 * 1000);
  for (std::size_t i = 0; i < points.size(); ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (const sdf& s : spheres) least = std::min(least, signed_distance(s, points[i]));
    REQUIRE(values[i] == least);
  }
}

TEST_CASE("geometry: a value is what it is within the limits asked for and safe beyond") {
  auto specimens = combinations();
  const auto p = primitives();
  std::vector<sdf> few = {p[0].solid, p[1].solid, p[3].solid};
  specimens.push_back({"smooth", sdf_smooth_union(few, 0.3), {}});
  specimens.push_back({"smooth", sdf_smooth_difference(few, 0.3), {}});
  specimens.push_back({"offset", sdf_offset(specimens[0].solid, -0.1), {}});
  rng_state rng = make_rng(5);
  for (const specimen& s : specimens) {
    CAPTURE(s.name);
    int wrong = 0;
    for (int i = 0; i < 5000 * rounds; ++i) {
      const dvec3 x = random_point(rng, 1.5);
      const double low = uniform(rng, -0.3, 0.1), high = low + uniform(rng, 0, 0.4);
      const double v = signed_distance(s.solid, x), w = signed_distance(s.solid, x, low, high);
      const double slack = 1e-12;
      if (v > high) {
        wrong += !(w >= high - slack && w <= v + slack);
      } else if (v < low) {
        wrong += !(w <= low + slack && w >= v - slack);
      } else {
        wrong += !(std::abs(v - w) <= slack);
      }
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("geometry: which values are exact") {
  const sdf a = sdf_sphere({0, 0, 0}, 1), b = sdf_box({1, 0, 0}, {1, 1, 1});
  const std::vector<sdf> both = {a, b};
  const auto flags = [](const sdf& s) {
    return std::pair(properties(s).exact_outside, properties(s).exact_inside);
  };
  using pair = std::pair<bool, bool>;
  CHECK(flags(a) == pair{true, true});
  CHECK(flags(sdf_union(both)) == pair{true, false});
  CHECK(flags(sdf_intersection(both)) == pair{false, true});
  CHECK(flags(sdf_difference(both)) == pair{false, true});
  CHECK(flags(sdf_complement(sdf_union(both))) == pair{false, true});
  CHECK(flags(sdf_offset(b, 0.1)) == pair{true, false});
  CHECK(flags(sdf_offset(b, -0.1)) == pair{false, true});
  CHECK(flags(sdf_smooth_union(both, 0.1)) == pair{false, false});
  CHECK(flags(sdf_transform({0, 2, 0, -2, 0, 0, 0, 0, 2, 1, 1, 1}, a)) == pair{true, true});
  CHECK(flags(sdf_transform({1, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0}, a)) == pair{false, false});
  CHECK(flags(sdf_torus({0, 0, 0}, {0, 1, 0}, 1, 2)) == pair{true, false});
  // a union that says so is exact outside
  rng_state rng = make_rng(2);
  const sdf u = sdf_union(both);
  for (int i = 0; i < 1000; ++i) {
    const dvec3 p = random_point(rng, 3);
    const double v = signed_distance(u, p);
    if (v < 0) continue;
    REQUIRE(std::abs(signed_distance(u, p - v * gradient(u, p))) < 1e-7);
  }
}

TEST_CASE("geometry: functions are scaled to be safe and may promise to be exact") {
  const dbox3 box = {dvec3{-1}, dvec3{1}};
  const auto f = [](const dvec3& p) { return 5 * (glm::length(p) - 1); };
  const sdf s = sdf_function(f, box, 5, true);
  CHECK(signed_distance(s, {3, 0, 0}) == doctest::Approx(2));
  CHECK(properties(s).exact_inside);
  // |p|^2 - 1 is 4-Lipschitz in the ball of radius 2: values grow less than distances,
  // and a union does not lose sight of it for that
  const sdf weak = sdf_function([](const dvec3& p) { return glm::dot(p, p) - 1; }, box, 4);
  const std::vector<sdf> both = {weak, sdf_sphere({5, 0, 0}, 1)};
  const sdf joined = sdf_union(both);
  CHECK(signed_distance(joined, {1.5, 0, 0}) == doctest::Approx(0.5));
  CHECK(signed_distance(joined, {0.5, 0, 0}) == doctest::Approx(-0.1875));
}

TEST_CASE("geometry: solids of any size and place") {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double offset : {0.0, 1e5}) {
      const dvec3 o = dvec3{offset, -offset, offset} * scale;
      const sdf s = sdf_ellipsoid(o, dvec3{3, 2, 1} * scale);
      const sdf t = sdf_torus(o, {0, 0, 1}, 3 * scale, scale);
      CHECK(signed_distance(s, o + dvec3{5, 0, 0} * scale) ==
            doctest::Approx(2 * scale).epsilon(1e-9));
      CHECK(signed_distance(s, o) == doctest::Approx(-scale).epsilon(1e-9));
      CHECK(signed_distance(t, o) == doctest::Approx(2 * scale).epsilon(1e-9));
      CHECK(signed_distance(t, o + dvec3{0, 3, 0} * scale) ==
            doctest::Approx(-scale).epsilon(1e-9));
      const double far = signed_distance(s, o + dvec3{0, 0, 1e6} * scale);
      CHECK(far == doctest::Approx((1e6 - 1) * scale).epsilon(1e-9));
      const dvec3 g = gradient(t, o + dvec3{0, 3, 2} * scale);
      CHECK(g.z == doctest::Approx(1).epsilon(1e-6));
    }
  }
  CHECK(std::isnan(signed_distance(sdf_sphere({0, 0, 0}, 1), {NAN, 0, 0})));
  CHECK(std::isnan(signed_distance(sdf_sphere({0, 0, 0}, 1), {INFINITY, 0, 0})));
  const sdf nothing;
  CHECK(signed_distance(nothing, {1, 2, 3}) == std::numeric_limits<double>::infinity());
  CHECK(is_empty(properties(nothing).bounds));
  CHECK(gradient(nothing, {0, 0, 0}) == dvec3{0, 0, 0});
}

TEST_CASE("geometry: projection lands on the surface or says that it did not") {
  auto specimens = primitives();
  for (const specimen& s : combinations()) specimens.push_back(s);
  rng_state rng = make_rng(77);
  for (const specimen& s : specimens) {
    CAPTURE(s.name);
    int landed = 0;
    for (int i = 0; i < 500; ++i) {
      const dvec3 p = random_point(rng, 1.5);
      const auto q = project(s.solid, p);
      if (!q) continue;
      ++landed;
      REQUIRE(std::abs(signed_distance(s.solid, q->point)) < 1e-8);
      REQUIRE(q->distance == doctest::Approx(glm::distance(p, q->point)));
      REQUIRE(q->distance >= std::abs(signed_distance(s.solid, p)) - 1e-8);
    }
    CHECK(landed > 450);
  }
  CHECK_FALSE(project(sdf_empty(), {0, 0, 0}));
  CHECK_FALSE(project(sdf_sphere({0, 0, 0}, 1), {NAN, 0, 0}));
}

TEST_CASE("geometry: solids refuse what they cannot be") {
  using bad = std::invalid_argument;
  CHECK_THROWS_AS(sdf_sphere({0, 0, 0}, 0), bad);
  CHECK_THROWS_AS(sdf_sphere({NAN, 0, 0}, 1), bad);
  CHECK_THROWS_AS(sdf_box({0, 0, 0}, {1, -1, 1}), bad);
  CHECK_THROWS_AS(sdf_rounded_box({0, 0, 0}, {1, 1, 1}, 1.5), bad);
  CHECK_THROWS_AS(sdf_torus({0, 0, 0}, {0, 0, 0}, 1, 0.1), bad);
  CHECK_THROWS_AS(sdf_cylinder({1, 1, 1}, {1, 1, 1}, 1), bad);
  CHECK_THROWS_AS(sdf_cone({0, 0, 0}, {1, 0, 0}, 0, 0), bad);
  CHECK_THROWS_AS(sdf_plane({0, 0, 0}, {0, 0, 0}), bad);
  CHECK_THROWS_AS(sdf_ellipsoid({0, 0, 0}, {1, 0, 1}), bad);
  CHECK_THROWS_AS(sdf_union({}), bad);
  CHECK_THROWS_AS(sdf_transform({1, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0}, sdf_sphere({0, 0, 0}, 1)),
                  bad);
  CHECK_THROWS_AS(sdf_leaf(nullptr), bad);
  const std::vector<sdf> one = {sdf_sphere({0, 0, 0}, 1)};
  CHECK_THROWS_AS(sdf_smooth_union(one, 0), bad);
  CHECK_THROWS_AS(sdf_smooth_union(one, -1), bad);
  CHECK_THROWS_AS(sdf_smooth_union(one, NAN), bad);
  CHECK_THROWS_AS(sdf_smooth_difference({}, 1), bad);
  CHECK_THROWS_AS(sdf_intersection({}), bad);
  CHECK_THROWS_AS(sdf_difference({}), bad);
  CHECK_THROWS_AS(sdf_torus({0, 0, 0}, {0, 0, 1}, 1, -0.1), bad);
  CHECK_THROWS_AS(sdf_capsule({0, 0, 0}, {0, 0, INFINITY}, 1), bad);
  CHECK_THROWS_AS(sdf_cone({0, 0, 0}, {1, 0, 0}, -1, 2), bad);
  CHECK_THROWS_AS(sdf_ellipsoid({0, 0, 0}, {1, 1e-10, 1}), bad);
  CHECK_THROWS_AS(sdf_offset(one[0], NAN), bad);
  CHECK_THROWS_AS(sdf_transform({NAN, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, one[0]), bad);
  const auto f = [](const dvec3& p) { return p.x; };
  CHECK_THROWS_AS(sdf_function(nullptr, infinite_box), bad);
  CHECK_THROWS_AS(sdf_function(f, infinite_box, 0), bad);
  CHECK_THROWS_AS(sdf_function(f, {dvec3{NAN}, dvec3{1}}), bad);
  CHECK_THROWS_AS(project(one[0], {1, 2, 3}, {.tolerance = 0}), bad);
}
