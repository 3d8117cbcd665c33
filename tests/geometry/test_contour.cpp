#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/geometry/contour.h"

using namespace wisp;

namespace {

using solid = std::function<double(const dvec3&)>;

solid sphere(const dvec3& o, double r) {
  return [=](const dvec3& p) { return glm::length(p - o) - r; };
}
solid torus(double big, double small) {
  return [=](const dvec3& p) {
    return glm::length(dvec2{glm::length(dvec2{p.x, p.y}) - big, p.z}) - small;
  };
}
solid box(const dvec3& o, const dvec3& half) {
  return [=](const dvec3& p) {
    dvec3 q = glm::abs(p - o) - half;
    return glm::length(glm::max(q, dvec3{0, 0, 0})) + std::min(std::max({q.x, q.y, q.z}), 0.0);
  };
}
solid either(const solid& a, const solid& b) {
  return [=](const dvec3& p) { return std::min(a(p), b(p)); };
}
solid minus(const solid& a, const solid& b) {
  return [=](const dvec3& p) { return std::max(a(p), -b(p)); };
}

dvec3 at(const contour_mesh& m, int i) { return m.positions[static_cast<std::size_t>(i)]; }

double volume(const contour_mesh& m) {
  double sum = 0;
  for (const ivec3& t : m.triangles)
    sum += glm::dot(at(m, t.x), glm::cross(at(m, t.y), at(m, t.z))) / 6;
  return sum;
}

using edge_map = std::map<std::pair<int, int>, int>;
edge_map directed_edges(const contour_mesh& m) {
  edge_map edges;
  for (const ivec3& t : m.triangles)
    for (int k = 0; k < 3; k++) edges[{t[k], t[(k + 1) % 3]}]++;
  return edges;
}

// Each directed edge once, with its opposite; the triangles round each vertex in
// one ring; every vertex used and every index in range.
bool is_manifold(const contour_mesh& m) {
  auto count = static_cast<int>(m.positions.size());
  for (const ivec3& t : m.triangles)
    for (int k = 0; k < 3; k++)
      if (t[k] < 0 || t[k] >= count || t[k] == t[(k + 1) % 3]) return false;
  edge_map edges = directed_edges(m);
  for (const auto& [edge, uses] : edges)
    if (uses != 1 || !edges.contains({edge.second, edge.first})) return false;
  std::vector<std::map<int, int>> next(m.positions.size());
  for (const ivec3& t : m.triangles)
    for (int k = 0; k < 3; k++)
      next[static_cast<std::size_t>(t[k])][t[(k + 1) % 3]] = t[(k + 2) % 3];
  for (const auto& ring : next) {
    if (ring.empty()) return false;
    std::size_t steps = 0;
    int v = ring.begin()->first;
    do {
      auto found = ring.find(v);
      if (found == ring.end()) return false;
      v = found->second;
      steps++;
    } while (v != ring.begin()->first && steps <= ring.size());
    if (steps != ring.size()) return false;
  }
  return true;
}

int euler(const contour_mesh& m) {
  return static_cast<int>(m.positions.size()) - static_cast<int>(directed_edges(m).size() / 2) +
         static_cast<int>(m.triangles.size());
}

contour_options at_resolution(int n) {
  contour_options options;
  options.resolution = n;
  return options;
}

double farthest(const contour_mesh& m, const solid& f) {
  double worst = 0;
  for (const dvec3& p : m.positions) worst = std::max(worst, std::abs(f(p)));
  return worst;
}

double nearest_vertex(const contour_mesh& m, const dvec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const dvec3& q : m.positions) best = std::min(best, glm::length(p - q));
  return best;
}

}  // namespace

TEST_CASE("geometry: contours of smooth solids are closed and of the right genus") {
  for (bool sharp : {true, false}) {
    contour_options options = at_resolution(40);
    options.sharp = sharp;
    auto ball = contour(sphere({0.01, 0.02, -0.03}, 0.7), options);
    CHECK(is_manifold(ball));
    CHECK(euler(ball) == 2);
    CHECK(volume(ball) > 0);
    auto ring = contour(torus(0.6, 0.2), options);
    CHECK(is_manifold(ring));
    CHECK(euler(ring) == 0);
    auto two = contour(either(sphere({-0.5, 0, 0}, 0.3), sphere({0.5, 0, 0}, 0.35)), options);
    CHECK(is_manifold(two));
    CHECK(euler(two) == 4);
    // A cavity: its triangles face it.
    auto shell = contour(minus(sphere({0, 0, 0}, 0.8), sphere({0, 0, 0}, 0.5)), options);
    CHECK(is_manifold(shell));
    CHECK(euler(shell) == 4);
    CHECK(volume(shell) == doctest::Approx(4.0 / 3 * 3.14159265 * (0.512 - 0.125)).epsilon(0.01));
  }
}

TEST_CASE("geometry: contours converge to the volume at second order") {
  const double pi_d = 3.14159265358979323846;
  for (bool sharp : {true, false}) {
    for (auto [f, exact] : {std::pair{sphere({0.013, 0.007, 0.003}, 0.7), 4 * pi_d / 3 * 0.343},
                            std::pair{torus(0.6, 0.22), 2 * pi_d * pi_d * 0.6 * 0.0484}}) {
      contour_options options = at_resolution(24);
      options.sharp = sharp;
      double coarse = std::abs(volume(contour(f, options)) - exact);
      options.resolution = 96;
      double fine = std::abs(volume(contour(f, options)) - exact);
      CHECK(fine < exact * 4e-3);  // curvature over a cell; 16 below for second order
      CHECK(fine < coarse / 10);
    }
  }
}

TEST_CASE("geometry: contour vertices lie on the surface and triangles face outwards") {
  auto f = torus(0.6, 0.25);
  contour_options options = at_resolution(64);
  options.normals = true;
  auto m = contour(f, options);
  double cell = 2.0 / 64;
  CHECK(farthest(m, f) < cell * cell * 2);
  REQUIRE(m.normals.size() == m.positions.size());
  for (const ivec3& t : m.triangles) {
    dvec3 n = glm::cross(at(m, t.y) - at(m, t.x), at(m, t.z) - at(m, t.x));
    if (glm::length(n) < 1e-9) continue;
    dvec3 p = (at(m, t.x) + at(m, t.y) + at(m, t.z)) / 3.0;
    dvec2 ring = glm::normalize(dvec2{p.x, p.y}) * 0.6;
    dvec3 out = p - dvec3{ring.x, ring.y, 0};
    REQUIRE(glm::dot(n, out) > 0);
    REQUIRE(glm::dot(m.normals[static_cast<std::size_t>(t.x)], out) > 0);
  }
}

TEST_CASE("geometry: contours keep the edges and corners of a box") {
  dvec3 half = {0.513, 0.377, 0.641};
  auto f = box({0.011, -0.017, 0.023}, half);
  auto options = at_resolution(32);
  auto m = contour(f, options);
  CHECK(is_manifold(m));
  CHECK(farthest(m, f) < 1e-8);
  CHECK(volume(m) == doctest::Approx(8 * half.x * half.y * half.z).epsilon(1e-7));
  for (int i = 0; i < 8; i++) {
    dvec3 corner = half * dvec3{i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1};
    CHECK(nearest_vertex(m, dvec3{0.011, -0.017, 0.023} + corner) < 1e-7);
  }
  options.sharp = false;
  CHECK(farthest(contour(f, options), f) > 1e-3);  // the test can tell
}

TEST_CASE("geometry: contours keep the sharp edge of a box minus a sphere") {
  dvec3 o = {0.5, 0.5, 0.5};
  auto f = minus(box({0, 0, 0}, {0.5, 0.5, 0.5}), sphere(o, 0.6));
  auto options = at_resolution(50);
  auto m = contour(f, options);
  CHECK(is_manifold(m));
  CHECK(euler(m) == 2);
  double cell = 2.0 / 50;
  CHECK(farthest(m, f) < 0.05 * cell);
  for (int i = 0; i < 60; i++) {  // the circle that the sphere cuts into the side z = 0.5
    double a = 3.1415926535 * (1 + (i + 0.5) / 120);
    dvec3 p = {0.5 + 0.6 * std::cos(a), 0.5 + 0.6 * std::sin(a), 0.5};
    CHECK(nearest_vertex(m, p) < 0.8 * cell);
  }
  // Vertices of the rim's cells are on the rim, but for the curvature of the
  // sphere over a cell (1/30 of a cell here).
  int rim = 0;
  for (const dvec3& p : m.positions) {
    double side = std::abs(p.z - 0.5), ball = std::abs(glm::length(p - o) - 0.6);
    if (side < 0.05 * cell && ball < 0.05 * cell && p.x < 0.49 && p.y < 0.49) rim++;
  }
  CHECK(rim > 20);
}

TEST_CASE("geometry: contours of thin and touching parts are manifolds") {
  auto options = at_resolution(20);
  CHECK(is_manifold(contour(box({0, 0, 0.01}, {0.7, 0.6, 0.02}), options)));
  CHECK(is_manifold(contour(minus(sphere({0, 0, 0}, 0.8), sphere({0, 0, 0}, 0.76)), options)));
  // Two boxes that meet in an edge, and in a corner.
  auto a = box({-0.3, -0.3, 0}, {0.3, 0.3, 0.3});
  CHECK(is_manifold(contour(either(a, box({0.3, 0.3, 0}, {0.3, 0.3, 0.3})), options)));
  CHECK(is_manifold(contour(either(a, box({0.3, 0.3, 0.6}, {0.3, 0.3, 0.3})), options)));
  // Nothing that a cell can see.
  auto speck = contour(sphere({0.003, 0.002, 0.001}, 1e-5), at_resolution(7));
  CHECK((speck.triangles.empty() || is_manifold(speck)));
}

TEST_CASE("geometry: contours take zeros at the corners of cells") {
  for (int n : {8, 9, 16})
    for (bool close : {true, false})
      for (bool sharp : {true, false}) {
        auto options = at_resolution(n);
        options.close_at_box = close;
        options.sharp = sharp;
        for (double r : {0.5, 0.25, 0.75}) {
          CHECK(is_manifold(contour(sphere({0, 0, 0}, r), options)));
          auto cube = contour(box({0, 0, 0}, {r, r, r}), options);
          CHECK(is_manifold(cube));
          auto l1 = [=](const dvec3& p) {
            return (std::abs(p.x) + std::abs(p.y) + std::abs(p.z) - r) / std::sqrt(3.0);
          };
          CHECK(is_manifold(contour(l1, options)));
        }
      }
  // Zero everywhere is outside; minus zero too.
  CHECK(contour([](const dvec3&) { return 0.0; }, at_resolution(4)).triangles.empty());
  CHECK(contour([](const dvec3&) { return -0.0; }, at_resolution(4)).triangles.empty());
}

TEST_CASE("geometry: contours close solids at the box or end there") {
  contour_options options = at_resolution(20);
  options.min = {-1, -0.5, 0};
  options.max = {1, 0.55, 0.7};
  // It fills the box: the mesh is the box.
  auto full = contour([](const dvec3&) { return -1.0; }, options);
  CHECK(is_manifold(full));
  CHECK(euler(full) == 2);
  CHECK(volume(full) == doctest::Approx(2 * 1.05 * 0.7).epsilon(1e-8));
  // A half space is a prism.
  auto half = contour([](const dvec3& p) { return p.x - 0.123; }, options);
  CHECK(is_manifold(half));
  CHECK(volume(half) == doctest::Approx(1.123 * 1.05 * 0.7).epsilon(1e-8));
  // A box whose sides are those of the box.
  auto same = contour(box({0, 0.025, 0.35}, {1, 0.525, 0.35}), options);
  CHECK(is_manifold(same));
  CHECK(volume(same) == doctest::Approx(2 * 1.05 * 0.7).epsilon(1e-8));
  auto ball = contour(sphere({1, 0.5, 0}, 0.5), options);
  CHECK(is_manifold(ball));
  CHECK(euler(ball) == 2);

  options.close_at_box = false;
  CHECK(contour([](const dvec3&) { return -1.0; }, options).triangles.empty());
  auto open = contour([](const dvec3& p) { return p.x - 0.123; }, options);
  CHECK_FALSE(open.triangles.empty());
  double cell = 0.1;
  edge_map edges = directed_edges(open);
  for (const auto& [edge, uses] : edges) {
    REQUIRE(uses == 1);
    if (edges.contains({edge.second, edge.first})) continue;
    dvec3 p = at(open, edge.first);  // the end of the mesh is within a cell of the box
    double d = std::min({p.y + 0.5, 0.55 - p.y, p.z, 0.7 - p.z});
    REQUIRE(d < cell);
  }
}

TEST_CASE("geometry: contour calls f within the box only") {
  for (bool close : {true, false}) {
    contour_options options = at_resolution(17);
    options.min = {-0.4, -0.3, 0.1};
    options.max = {0.5, 0.3, 1.3};
    options.close_at_box = close;
    std::atomic<int> bad = 0;
    contour(
        [&](const dvec3& p) {
          for (int k = 0; k < 3; k++)
            if (p[k] < options.min[k] - 1e-12 || p[k] > options.max[k] + 1e-12) bad++;
          return glm::length(p) - 0.45;
        },
        options);
    CHECK(bad == 0);
  }
}

TEST_CASE("geometry: contours are the same at any thread count") {
  auto f = minus(either(torus(0.6, 0.25), box({0, 0, 0}, {0.5, 0.2, 0.7})),
                 sphere({0.5, 0.1, 0.3}, 0.4));
  auto options = at_resolution(60);
  options.normals = true;
  options.threads = 1;
  auto one = contour(f, options);
  options.threads = 2;
  auto two = contour(f, options);
  CHECK(is_manifold(one));
  CHECK(one.positions == two.positions);
  CHECK(one.triangles == two.triangles);
  CHECK(one.normals == two.normals);
}

TEST_CASE("geometry: contour cost grows with the surface") {
  auto calls = [](int n) {
    std::atomic<int64_t> count = 0;
    auto f = torus(0.6, 0.2);
    contour(
        [&](const dvec3& p) {
          count++;
          return f(p);
        },
        at_resolution(n));
    return static_cast<double>(count);
  };
  double coarse = calls(48), fine = calls(192);
  CHECK(fine / coarse < 18);  // 16 for the square of the resolution
  CHECK(fine / coarse > 12);
}

TEST_CASE("geometry: contours of random unions and differences are manifolds") {
  auto random = make_rng(7, 3);
  auto in = [&](double a, double b) { return a + (b - a) * rand1d(random); };
  for (int i = 0; i < 60; i++) {
    auto point = [&](double r) { return dvec3{in(-r, r), in(-r, r), in(-r, r)}; };
    solid f = sphere(point(0.3), in(0.3, 0.7));
    for (int k = 0; k < 7; k++) {
      dvec3 size = {in(0.02, 0.5), in(0.02, 0.5), in(0.02, 0.5)};
      solid g = in(0, 1) < 0.5 ? sphere(point(1), in(0.05, 0.6)) : box(point(1), size);
      f = in(0, 1) < 0.5 ? either(f, g) : minus(f, g);
    }
    auto options = at_resolution(6 + i % 14);
    options.sharp = i % 3 != 0;
    auto m = contour(f, options);
    REQUIRE((m.triangles.empty() || is_manifold(m)));
    REQUIRE(volume(m) >= 0);
  }
}

TEST_CASE("geometry: contours of noise are manifolds") {
  // A sign for every point, by hash: all the configurations of cells, and values
  // that break the Lipschitz bound.
  for (uint64_t seed = 0; seed < 10; seed++)
    for (double level : {-0.6, -0.2, 0.0, 0.3, 0.7}) {
      auto f = [=](const dvec3& p) {
        ivec3 i = ivec3(glm::round(p * 8.0));  // a cell is 0.25 wide: corners and face centres
        uint64_t h = hash64(seed ^ hash64(static_cast<uint64_t>(i.x + 64) +
                                          (static_cast<uint64_t>(i.y + 64) << 16) +
                                          (static_cast<uint64_t>(i.z + 64) << 32)));
        return static_cast<double>(h >> 11) * 0x1p-52 - 1 + level;
      };
      auto options = at_resolution(8);
      options.lipschitz = 20;
      options.sharp = (seed & 1) != 0;
      auto m = contour(f, options);
      REQUIRE(!m.triangles.empty());
      REQUIRE(is_manifold(m));
      // Too small a constant loses parts, but tears none.
      options.lipschitz = 1e-3;
      options.resolution = 16;
      m = contour(f, options);
      REQUIRE((m.triangles.empty() || is_manifold(m)));
      options.close_at_box = false;
      options.lipschitz = 20;
      m = contour(f, options);
      std::vector<char> used(m.positions.size(), 0);
      for (const ivec3& t : m.triangles)
        for (int k = 0; k < 3; k++) used[static_cast<std::size_t>(t[k])] = 1;
      REQUIRE(std::count(used.begin(), used.end(), 0) == 0);
      for (const auto& [edge, uses] : directed_edges(m)) REQUIRE(uses == 1);
    }
}

TEST_CASE("geometry: contours take NaN and infinite values") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  auto options = at_resolution(24);
  CHECK(contour([=](const dvec3&) { return nan; }, options).triangles.empty());
  CHECK(contour([=](const dvec3&) { return inf; }, options).triangles.empty());
  auto f = sphere({0, 0, 0}, 0.7);
  auto cut = contour([=](const dvec3& p) { return p.x > 0.1 ? nan : f(p); }, options);
  CHECK(is_manifold(cut));
  CHECK(volume(cut) > 0.5);
  CHECK(std::all_of(cut.positions.begin(), cut.positions.end(), [](const dvec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  }));
  options.lipschitz = 1e6;
  auto step = contour([=](const dvec3& p) { return f(p) < 0 ? -1.0 : 1.0; }, options);
  CHECK(is_manifold(step));
  CHECK(euler(step) == 2);
  CHECK(volume(contour([=](const dvec3&) { return -inf; }, options)) == doctest::Approx(8));
}

TEST_CASE("geometry: contours scale and move with the box") {
  for (double scale : {1e-6, 1.0, 1e6}) {
    dvec3 o = dvec3{3, -2, 5} * scale;
    contour_options options = at_resolution(30);
    options.min = o - scale;
    options.max = o + scale * dvec3{1, 1.3, 1.1};
    auto m = contour(box(o, dvec3{0.4, 0.5, 0.6} * scale), options);
    CHECK(is_manifold(m));
    CHECK(farthest(m, box(o, dvec3{0.4, 0.5, 0.6} * scale)) < 1e-6 * scale);
  }
}

TEST_CASE("geometry: contour rejects options out of range and lets exceptions through") {
  auto f = sphere({0, 0, 0}, 0.5);
  auto bad = [&](auto change) {
    contour_options options = at_resolution(8);
    change(options);
    CHECK_THROWS_AS(contour(f, options), std::invalid_argument);
  };
  bad([](auto& o) { o.resolution = 1; });
  bad([](auto& o) { o.resolution = 4097; });
  bad([](auto& o) { o.lipschitz = 0; });
  bad([](auto& o) { o.lipschitz = std::numeric_limits<double>::quiet_NaN(); });
  bad([](auto& o) { o.threads = -1; });
  bad([](auto& o) { o.max.y = -1; });
  bad([](auto& o) { o.min.x = std::numeric_limits<double>::quiet_NaN(); });
  bad([](auto& o) { o.min.x = -std::numeric_limits<double>::infinity(); });
  bad([](auto& o) { o.min = dvec3{1e15}, o.max = dvec3{1e15 + 1}; });
  CHECK_THROWS_AS(contour(solid{}, at_resolution(8)), std::invalid_argument);
  struct failure {};
  for (int threads : {1, 2}) {
    contour_options options = at_resolution(16);
    options.threads = threads;
    auto throws = [&](const dvec3& p) {
      if (p.x > 0.3) throw failure{};
      return f(p);
    };
    CHECK_THROWS_AS(contour(throws, options), failure);
  }
}
