#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

#include "data_meshes.h"
#include "wisp/geometry/fast_winding.h"
#include "wisp/geometry/solid_angle.h"

using namespace wisp;

namespace {

constexpr double tau = 6.283185307179586477;

struct mesh {
  std::vector<ivec3> triangles;
  std::vector<dvec3> positions;
};

// A bumpy torus, counter-clockwise outside; without the last `gap` of its rings it is
// open.
mesh make_torus(int rings, int sides, int gap = 0) {
  mesh m;
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sides; ++j) {
      const double u = tau * i / rings, v = tau * j / sides;
      const double r = 0.35 + 0.05 * std::sin(5 * u) * std::cos(3 * v);
      const double x = 1 + r * std::cos(v);
      m.positions.emplace_back(x * std::cos(u), x * std::sin(u), r * std::sin(v));
    }
  }
  const auto at = [&](int i, int j) { return (i % rings) * sides + j % sides; };
  for (int i = 0; i < rings - gap; ++i) {
    for (int j = 0; j < sides; ++j) {
      m.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      m.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return m;
}

mesh make_soup(int count) {
  mesh m;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int i = 0; i < count; ++i) {
    const dvec3 c{u(random), u(random), u(random)};
    for (int k = 0; k < 3; ++k) {
      m.positions.push_back(c + 0.1 * dvec3{u(random), u(random), u(random)});
    }
    m.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return m;
}

std::vector<dvec3> random_points(int count, double size, unsigned seed = 7) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-size, size);
  std::vector<dvec3> points;
  for (int i = 0; i < count; ++i) points.emplace_back(u(random), u(random), u(random));
  return points;
}

double largest_error(const mesh& m, const fast_winding& fast, const std::vector<dvec3>& points,
                     double beta) {
  double error = 0;
  for (const dvec3& p : points) {
    const double w = fast_winding_number(fast, p, beta);
    REQUIRE(std::isfinite(w));
    error = std::max(error, std::abs(w - winding_number_sum(m.triangles, m.positions, p)));
  }
  return error;
}

}  // namespace

TEST_CASE("geometry: fast winding numbers of closed and open meshes and soups") {
  const std::vector<mesh> meshes = {make_torus(96, 40), make_torus(96, 40, 11), make_soup(4000)};
  const std::vector<dvec3> points = random_points(300, 1.3);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    CAPTURE(i);
    const mesh& m = meshes[i];
    const bvh tree = make_bvh(m.triangles, m.positions);
    double last = 1;
    for (int order = 1; order <= 3; ++order) {
      CAPTURE(order);
      const fast_winding fast = make_fast_winding(tree, {order, 1});
      CHECK(fast.order() == order);
      const double error = largest_error(m, fast, points, 2.3);
      CHECK(error < last);
      last = error;
      CHECK(largest_error(m, fast, points, 6) < 0.6 * error);
      // what is left is single precision
      CHECK(largest_error(m, fast, points, std::numeric_limits<double>::infinity()) < 2e-5);
    }
    CHECK(last < 0.005);
  }
}

TEST_CASE("geometry: fast winding numbers are whole near a closed mesh") {
  const mesh m = make_torus(96, 40);
  const bvh tree = make_bvh(m.triangles, m.positions);
  const fast_winding fast = make_fast_winding(tree);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u;
  double error = 0;
  for (const double h : {1e-1, 1e-3, 1e-5, 1e-8}) {
    for (int i = 0; i < 300; ++i) {
      const ivec3& t = m.triangles[static_cast<std::size_t>(u(random) * 7680)];
      const auto corner = [&](int k) { return m.positions[static_cast<std::size_t>(t[k])]; };
      const dvec3 a = corner(0), b = corner(1), c = corner(2);
      const dvec3 n = glm::normalize(glm::cross(b - a, c - a));
      const double v = u(random);
      const dvec3 on = a + v * (b - a) + (1 - v) * u(random) * (c - a);
      error = std::max(error, std::abs(fast_winding_number(fast, on + h * n)));
      error = std::max(error, std::abs(fast_winding_number(fast, on - h * n) - 1));
    }
  }
  CHECK(error < 0.01);
}

TEST_CASE("geometry: expansions of each order converge as they should") {
  // one leaf, a curved piece: its error is that of one expansion
  mesh piece;
  for (int i = 0; i < 5; ++i) {
    piece.positions.emplace_back(0.3 * i, 0, 0.2 * std::sin(1.0 * i));
    piece.positions.emplace_back(0.3 * i, 0.5 + 0.1 * i, 0.1 * i);
  }
  for (int i = 0; i < 4; ++i) {
    piece.triangles.emplace_back(2 * i, 2 * i + 2, 2 * i + 1);
    piece.triangles.emplace_back(2 * i + 1, 2 * i + 2, 2 * i + 3);
  }
  // and many, whose moments are put together
  for (const mesh& m : {piece, make_torus(64, 32, 32), make_soup(1500)}) {
    CAPTURE(m.triangles.size());
    const bvh tree = make_bvh(m.triangles, m.positions);
    const dvec3 middle = 0.5 * (tree.min() + tree.max());
    for (int order = 1; order <= 3; ++order) {
      CAPTURE(order);
      const fast_winding fast = make_fast_winding(tree, {order, 1});
      double errors[2] = {0, 0};
      for (int far = 0; far < 2; ++far) {
        for (dvec3 direction : random_points(50, 1)) {
          direction = glm::normalize(direction);
          const dvec3 p = middle + (far == 0 ? 3.0 : 6.0) * direction;
          const double w = fast_winding_number(fast, p, 0.01);
          const double exact = winding_number_sum(m.triangles, m.positions, p);
          errors[far] = std::max(errors[far], std::abs(w - exact));
        }
      }
      // like distance^-(order + 2), until single precision ends it
      const double exponent = std::log2(errors[0] / errors[1]);
      CHECK(exponent > order + 1.7);
      CHECK(exponent < order + 3.2);
    }
  }
}

TEST_CASE("geometry: expansions are the Taylor series of their triangles") {
  // eight triangles are one leaf
  const mesh m = make_soup(8);
  double area = 0;
  dvec3 c{0, 0, 0};
  struct sample {
    dvec3 x, n;
  };
  std::vector<sample> samples;  // exact for squares: the vertices and the middle
  for (std::size_t i = 0; i < 8; ++i) {
    const dvec3* v = &m.positions[3 * i];
    const dvec3 n = 0.5 * glm::cross(v[1] - v[0], v[2] - v[0]), middle = (v[0] + v[1] + v[2]) / 3.0;
    area += glm::length(n);
    c += glm::length(n) * middle;
    for (int k = 0; k < 3; ++k) samples.push_back({v[k], n / 12.0});
    samples.push_back({middle, 0.75 * n});
  }
  c /= area;
  for (int order = 1; order <= 3; ++order) {
    CAPTURE(order);
    const fast_winding fast = make_fast_winding(make_bvh(m.triangles, m.positions), {order, 1});
    for (const dvec3& p : random_points(50, 3)) {
      const dvec3 q = c - p;
      const double d = glm::length(q), d3 = d * d * d, d5 = d3 * d * d;
      double w = 0;
      for (const sample& s : samples) {
        const dvec3 y = s.x - c;
        const double qn = glm::dot(q, s.n), yn = glm::dot(y, s.n), qy = glm::dot(q, y);
        w += qn / d3;
        if (order > 1) w += yn / d3 - 3 * qn * qy / d5;
        if (order > 2) {
          w += (-3 * yn * qy + qn * (7.5 * qy * qy / (d * d) - 1.5 * glm::dot(y, y))) / d5;
        }
      }
      const double size = area / (2 * tau * d * d) * (1 + std::pow(2 / d, order - 1));
      CHECK(std::abs(fast_winding_number(fast, p, 1e-9) - w / (2 * tau)) < 3e-6 * size);
    }
  }
}

TEST_CASE("geometry: fast winding numbers of large and of deep trees") {
  const double inf = std::numeric_limits<double>::infinity();
  const mesh large = make_torus(300, 120, 7);
  fast_winding fast = make_fast_winding(make_bvh(large.triangles, large.positions));
  CHECK(largest_error(large, fast, random_points(12, 1.2), inf) < 3e-5);
  CHECK(largest_error(large, fast, random_points(12, 1.2), 30) < 3e-5);
  // ever smaller around a point
  mesh deep;
  std::vector<dvec3> points = random_points(40, 1.2);
  const dvec3 directions[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (double r = 1; r > 1e-12; r *= 0.7) {
    for (const dvec3& u : directions) {
      const dvec3 v{u.y, u.z, u.x}, w{u.z, u.x, u.y};
      const int n = static_cast<int>(deep.positions.size());
      for (const dvec3& x : {u, u + 0.3 * v, u + 0.3 * w}) deep.positions.push_back(r * x);
      deep.triangles.emplace_back(n, n + 1, n + 2);
      deep.triangles.emplace_back(n, n + 1, n + 2);
    }
    points.push_back(0.9 * r * points[0]);
  }
  fast = make_fast_winding(make_bvh(deep.triangles, deep.positions));
  CHECK(largest_error(deep, fast, points, inf) < 3e-5);
  CHECK(largest_error(deep, fast, points, 2.35) < 0.01);  // all is there twice
}

TEST_CASE("geometry: fast winding numbers of meshes from files") {
  if (!test::data_mesh("rabbit.obj")) {
    MESSAGE("skipped: WISP_TEST_DATA is not set to a folder with meshes");
    return;
  }
  for (const char* name :
       {"stanford-bunny.obj", "rabbit.obj", "quadknot.obj", "soup.stl", "busted.STL", "teapot.stl",
        "degenerated.obj", "cube_with_fold.ply", "joined_tetrahedra.obj", "sliver_tet.ply"}) {
    CAPTURE(name);
    const auto given = test::data_mesh(name);
    REQUIRE(given);
    const mesh m{given->triangles, given->positions};
    const bvh tree = make_bvh(m.triangles, m.positions);
    const dvec3 center = 0.5 * (tree.min() + tree.max()), half = 0.55 * (tree.max() - tree.min());
    std::vector<dvec3> points = random_points(60, 1);
    for (dvec3& p : points) p = center + half * p;
    CHECK(largest_error(m, make_fast_winding(tree), points, 2.35) < 0.0045);
    CHECK(largest_error(m, make_fast_winding(tree), points, 4) < 0.0006);
  }
}

TEST_CASE("geometry: fast winding numbers do not depend on units or place") {
  const mesh m = make_torus(48, 20, 5);
  const fast_winding fast = make_fast_winding(make_bvh(m.triangles, m.positions));
  const std::vector<dvec3> points = random_points(200, 1.5);
  struct change {
    double scale;
    dvec3 offset;
  };
  for (const change& c :
       {change{1e-6, {0, 0, 0}}, change{1e6, {0, 0, 0}}, change{1e-100, {0, 0, 0}},
        change{1e100, {0, 0, 0}}, change{1, {1e5, -2e5, 3e5}}}) {
    CAPTURE(c.scale);
    mesh moved = m;
    for (dvec3& x : moved.positions) x = x * c.scale + c.offset;
    const fast_winding there = make_fast_winding(make_bvh(moved.triangles, moved.positions));
    for (const dvec3& p : points) {
      const double w = fast_winding_number(there, p * c.scale + c.offset);
      // other trees, other errors
      CHECK(std::abs(w - fast_winding_number(fast, p)) < 0.01);
    }
  }
}

TEST_CASE("geometry: fast winding numbers of a batch are those of its points") {
  std::vector<dvec3> points = random_points(3000, 1.4);
  points[17].y = std::numeric_limits<double>::quiet_NaN();
  points[18].x = std::numeric_limits<double>::infinity();
  points[19] = {1e200, -1e250, 3};
  // batches of large meshes have an order of their own
  for (const mesh& m : {make_torus(96, 40, 3), make_torus(450, 190, 3)}) {
    CAPTURE(m.triangles.size());
    const fast_winding fast = make_fast_winding(make_bvh(m.triangles, m.positions));
    std::vector<double> expected;
    for (const dvec3& p : points) expected.push_back(fast_winding_number(fast, p, 2));
    for (const int threads : {1, 2, 0}) {
      for (const std::size_t count : {std::size_t{0}, std::size_t{30}, points.size()}) {
        std::vector<double> results(count, 77);
        fast_winding_numbers(fast, std::span(points).first(count), results, 2, threads);
        for (std::size_t i = 0; i < count; ++i) {
          const double w = expected[i];
          CHECK((results[i] == w || (std::isnan(w) && std::isnan(results[i]))));
        }
      }
    }
    std::vector<double> few(2);
    CHECK_THROWS_AS(fast_winding_numbers(fast, points, few), std::invalid_argument);
  }
}

TEST_CASE("geometry: moments do not depend on the threads that build them") {
  const mesh m = make_torus(150, 60);
  const bvh tree = make_bvh(m.triangles, m.positions);
  const fast_winding one = make_fast_winding(tree, {3, 1}), all = make_fast_winding(tree, {3, 0});
  CHECK(one.bytes() == all.bytes());
  CHECK(make_fast_winding(tree, {1, 1}).bytes() < 0.5 * static_cast<double>(one.bytes()));
  for (const dvec3& p : random_points(200, 1.5)) {
    CHECK(fast_winding_number(one, p) == fast_winding_number(all, p));
  }
}

TEST_CASE("geometry: fast winding numbers of little and of nothing") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const fast_winding none;
  CHECK(none.bytes() == 0);
  CHECK(none.order() == 0);
  CHECK(fast_winding_number(none, {1, 2, 3}) == 0);
  CHECK(std::isnan(fast_winding_number(none, {1, nan, 3})));
  std::vector<dvec3> points = {{1, 2, 3}, {nan, 0, 0}};
  std::vector<double> results(2);
  fast_winding_numbers(none, points, results);
  CHECK(results[0] == 0);
  CHECK(std::isnan(results[1]));
  const fast_winding empty = make_fast_winding(make_bvh({}, std::span<const dvec3>{}));
  CHECK(fast_winding_number(empty, {0, 0, 0}) == 0);

  mesh one{{{0, 1, 2}}, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  fast_winding fast = make_fast_winding(make_bvh(one.triangles, one.positions));
  for (const dvec3& p : random_points(200, 3)) {
    CHECK(fast_winding_number(fast, p, inf) ==
          doctest::Approx(winding_number_sum(one.triangles, one.positions, p)).epsilon(1e-4));
    CHECK(std::abs(fast_winding_number(fast, p) -
                   winding_number_sum(one.triangles, one.positions, p)) < 2e-3);
  }
  CHECK(fast_winding_number(fast, {0.2, 0.2, -1e-9}) == doctest::Approx(0.5));
  CHECK(fast_winding_number(fast, {0.2, 0.2, 1e-9}) == doctest::Approx(-0.5));
  CHECK(fast_winding_number(fast, {0, 0, 0}) == 0);
  CHECK(fast_winding_number(fast, {0.5, 0, 0}) == 0);
  CHECK(fast_winding_number(fast, {5, 5, 0}) == doctest::Approx(0));
  CHECK(std::isnan(fast_winding_number(fast, {0, 0, nan})));
  CHECK(std::isnan(fast_winding_number(fast, {0, -inf, 0})));
  // below it, ever farther: area / (4 pi d^2)
  for (double d = 1e2; d < 1e150; d *= 1e3) {
    const double w = fast_winding_number(fast, {1.0 / 3, 1.0 / 3, -d});
    CHECK(w * d * d * 2 * tau == doctest::Approx(0.5).epsilon(1e-3));
  }
  for (const double d : {1e200, 1e300, 1.7e308}) {
    CHECK(std::abs(fast_winding_number(fast, {d, -d, d})) < 1e-300);
  }

  // points, segments and a triangle given twice, one time the other way around
  mesh flat{{{0, 0, 0}, {0, 1, 1}, {0, 1, 3}, {0, 1, 2}, {2, 1, 0}},
            {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}}};
  fast = make_fast_winding(make_bvh(flat.triangles, flat.positions));
  for (const dvec3& p : random_points(100, 2)) CHECK(std::abs(fast_winding_number(fast, p)) < 1e-6);
  for (const dvec3& p : flat.positions) CHECK(std::isfinite(fast_winding_number(fast, p)));
  const mesh dots{{{0, 0, 0}, {0, 0, 0}}, {{1, 1, 1}}};
  fast = make_fast_winding(make_bvh(dots.triangles, dots.positions));
  CHECK(fast_winding_number(fast, {1, 1, 1}) == 0);
  CHECK(fast_winding_number(fast, {2, 1, 1}) == 0);

  // a mesh twice is twice around
  mesh twice = make_torus(40, 20);
  const std::size_t count = twice.triangles.size();
  for (std::size_t i = 0; i < count; ++i) twice.triangles.push_back(twice.triangles[i]);
  fast = make_fast_winding(make_bvh(twice.triangles, twice.positions));
  CHECK(fast_winding_number(fast, {1, 0, 0}) == doctest::Approx(2).epsilon(0.01));
  CHECK(std::abs(fast_winding_number(fast, {0, 0, 0})) < 0.01);
}

TEST_CASE("geometry: wrong options of fast winding numbers are refused") {
  const mesh m = make_torus(10, 8);
  const bvh tree = make_bvh(m.triangles, m.positions);
  CHECK_THROWS_AS(make_fast_winding(tree, {0, 1}), std::invalid_argument);
  CHECK_THROWS_AS(make_fast_winding(tree, {4, 1}), std::invalid_argument);
  CHECK_THROWS_AS(make_fast_winding(make_point_bvh(m.positions)), std::invalid_argument);
  const fast_winding fast = make_fast_winding(tree);
  const dvec3 p{0, 0, 0};
  CHECK_THROWS_AS(fast_winding_number(fast, p, 0), std::invalid_argument);
  CHECK_THROWS_AS(fast_winding_number(fast, p, -1), std::invalid_argument);
  CHECK_THROWS_AS(fast_winding_number(fast, p, std::nan("")), std::invalid_argument);
  CHECK(std::isfinite(fast_winding_number(fast, p, 1e-300)));
  CHECK(std::abs(fast_winding_number(fast, p, 1e300)) < 1e-5);
}
