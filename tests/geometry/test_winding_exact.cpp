#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "geometry/mesh_files.h"
#include "wisp/geometry/closest_point.h"
#include "wisp/geometry/solid_angle.h"
#include "wisp/geometry/winding_number.h"

using namespace wisp;
using namespace wisp::test_meshes;

namespace {

constexpr double nan_double = std::numeric_limits<double>::quiet_NaN();
constexpr double inf_double = std::numeric_limits<double>::infinity();

double sum_at(const mesh& m, const dvec3& p) {
  return winding_number_sum(m.triangles, m.positions, p);
}

winding make(const mesh& m, double tolerance = 0, bool grid = true) {
  return make_winding(m.tree(), {.tolerance = tolerance, .grid = grid, .threads = 1});
}

// Where either side's number is right.
bool on_surface(const winding& w, const dvec3& p) {
  const dvec3 size = w.tree().max() - w.tree().min();
  return closer_than(w.tree(), p, 1e-13 * std::max({size.x, size.y, size.z}));
}

// The largest difference from the sum over triangles.
double worst(const mesh& m, const winding& w, const std::vector<dvec3>& points) {
  double most = 0;
  for (const dvec3& p : points) {
    const double x = winding_number(w, p), e = std::abs(x - sum_at(m, p));
    if (std::isfinite(x) && on_surface(w, p)) continue;
    most = e > most || std::isnan(e) ? e : most;
    if (std::isnan(most)) return most;
  }
  return most;
}

// The number of points where the winding number is not a whole one, or, off the
// surface, not that which the sum over triangles is near to.
int wrong(const mesh& m, const winding& w, const std::vector<dvec3>& points) {
  int n = 0;
  for (const dvec3& p : points) {
    const double exact = sum_at(m, p), whole = std::nearbyint(exact);
    const double x = winding_number(w, p);
    if (x != std::nearbyint(x)) ++n;
    if (on_surface(w, p)) continue;
    if (std::abs(exact - whole) > 1e-9 || x != whole) ++n;
  }
  return n;
}

// A disc in the plane z = 0 with a rim that waves.
mesh wavy_disc(int edges) {
  mesh m;
  m.positions.push_back({0, 0, 0.3});
  for (int i = 0; i < edges; ++i) {
    const double a = 2 * std::numbers::pi * i / edges;
    const double r = 1 + 0.1 * std::sin(7 * a) + 0.01 * std::sin(61 * a);
    m.positions.push_back({r * std::cos(a), r * std::sin(a), 0.1 * std::cos(5 * a)});
    m.triangles.push_back({0, i + 1, (i + 1) % edges + 1});
  }
  return m;
}

}  // namespace

TEST_CASE("geometry: solid angles of known triangles") {
  constexpr double pi_double = std::numbers::pi;
  const dvec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, o{0, 0, 0};
  // counter-clockwise seen from (1, 1, 1): an octant, from inside
  CHECK(solid_angle(o, x, y, z) == doctest::Approx(pi_double / 2).epsilon(1e-15));
  CHECK(solid_angle(o, x, z, y) == doctest::Approx(-pi_double / 2).epsilon(1e-15));
  CHECK(solid_angle(o, y, z, x) == doctest::Approx(pi_double / 2).epsilon(1e-15));
  // half of the face of a cube
  CHECK(solid_angle(o, {1, -1, -1}, {1, 1, -1}, {1, 1, 1}) ==
        doctest::Approx(pi_double / 3).epsilon(1e-15));
  for (const double s : {1e-300, 1e-200, 1e-100, 1e100, 1e200, 1e290}) {
    CHECK(solid_angle(o, s * x, s * y, s * z) == doctest::Approx(pi_double / 2).epsilon(1e-14));
  }
  // far away: area times cosine over the squared distance
  const double far = 1e9;
  CHECK(solid_angle({0, 0, -far}, o, x, y) * far * far == doctest::Approx(0.5).epsilon(1e-8));
  CHECK(std::isfinite(solid_angle(x, x, y, z)));
  CHECK(std::isfinite(solid_angle((x + y) / 2.0, x, y, z)));
  CHECK(solid_angle({2, 3, 0}, o, x, y) == 0);
  CHECK(solid_angle(o, x, x, y) == 0);
}

TEST_CASE("geometry: winding numbers of closed meshes are whole and those of the sum") {
  mesh two = sphere(3);
  append(two, moved(sphere(3), 0.7, {0.8, 0.1, 0.05}));
  append(two, moved(torus(1, 0.3, 24, 12), 1, {0.1, 0.2, 0.3}));
  append(two, moved(inverted(sphere(2)), 0.4, {-0.2, 0, 0}));
  const mesh meshes[] = {tetrahedron(),       sphere(2),           torus(2, 0.7, 40, 20),
                         inverted(sphere(2)), unshared(sphere(3)), two};
  for (const mesh& m : meshes) {
    for (const bool grid : {false, true}) {
      const winding w = make(m, 1e-6, grid);
      CHECK(w.closed());
      CHECK(w.boundary_loops() == 0);
      if (m.triangles.size() > 1000) CHECK((w.grid_cells() > 0) == grid);
      CHECK(wrong(m, w, points_around(m, 1500, 1)) == 0);
    }
  }
  // nested, doubled and turned inside out
  CHECK(winding_number(make(two), {0.5, 0.1, 0}) == 2);
  mesh doubled = sphere(2);
  append(doubled, sphere(2));
  CHECK(winding_number(make(doubled), {0.1, 0.2, 0.3}) == 2);
  CHECK(winding_number(make(inverted(doubled)), {0.1, 0.2, 0.3}) == -2);
}

TEST_CASE("geometry: rays through edges and vertices of a lattice are counted once") {
  std::mt19937_64 g(3);
  for (const int side : {1, 2, 5}) {
    for (int round = 0; round < 6; ++round) {
      voxels v{side, std::vector<char>(static_cast<std::size_t>(side * side * side))};
      for (char& f : v.full) f = round == 0 || g() % 3 != 0;
      const mesh m = surface(v);
      if (m.triangles.empty()) continue;
      for (const bool grid : {false, true}) {
        const winding w = make(m, 1e-6, grid);
        REQUIRE(w.closed());
        int bad = 0;
        const int n = 4 * (side + 2);
        for (int i = 0; i <= n * n * n; ++i) {
          const ivec3 quarter = ivec3{i % n, i / n % n, i / n / n} - 4;
          const dvec3 p = dvec3(quarter) / 4.0;
          // the cubes that p touches
          bool any = false, all = true;
          for (int c = 0; c < 8; ++c) {
            ivec3 cube;
            for (int a = 0; a < 3; ++a) {
              const bool between = quarter[a] % 4 == 0;
              cube[a] = static_cast<int>(std::floor(p[a])) - (between && (c >> a & 1) != 0 ? 1 : 0);
            }
            const bool full = v.at(cube.x, cube.y, cube.z);
            any = any || full;
            all = all && full;
          }
          const double x = winding_number(w, p);
          if (x != 0 && x != 1) ++bad;
          if (any == all && x != (all ? 1 : 0)) ++bad;
        }
        CHECK(bad == 0);
      }
    }
  }
}

TEST_CASE("geometry: winding numbers at points in line with vertices and middles of edges") {
  mesh m = sphere(3);
  std::mt19937_64 g(5);
  std::uniform_real_distribution<double> u(-0.02, 0.02), at(-1.1, 1.1);
  for (dvec3& p : m.positions) p += dvec3{u(g), u(g), u(g)};
  for (const bool grid : {false, true}) {
    const winding w = make(m, 1e-6, grid);
    std::vector<dvec3> points;
    for (const ivec3& t : m.triangles) {
      const dvec3 a = m.positions[static_cast<std::size_t>(t.x)];
      const dvec3 b = m.positions[static_cast<std::size_t>(t.y)];
      for (dvec3 p : {a, 0.5 * (a + b), 0.25 * a + 0.75 * b}) {
        p[static_cast<int>(g() % 3)] = at(g);
        points.push_back(p);
      }
    }
    CHECK(wrong(m, w, points) == 0);
  }
}

TEST_CASE("geometry: winding numbers of open meshes are those of the sum") {
  std::mt19937_64 g(7);
  mesh holes = without(sphere(3), [&](std::size_t) { return g() % 9 == 0; });
  const mesh half = without(torus(2, 0.7, 40, 20), [](std::size_t i) { return i < 600; });
  const mesh one = {{{0.1, 0.2, 0.3}, {1, 0.1, 0.2}, {0.3, 1.1, 0.7}}, {{0, 1, 2}}};
  mesh fins = sphere(2);  // three faces at an edge, and a face twice
  fins.positions.push_back({2, 0.5, 0.25});
  fins.triangles.push_back({0, 2, 18});
  fins.triangles.push_back({0, 2, 18});
  fins.triangles.push_back(fins.triangles[5]);
  const mesh meshes[] = {
      one, half, holes, fins, wavy_disc(700), soup(100, 0.6, 1), soup(600, 0.2, 2)};
  for (const mesh& m : meshes) {
    const auto points = points_around(m, 1500, 2);
    for (const bool grid : {false, true}) {
      const winding exact = make(m, 0, grid);
      CHECK(!exact.closed());
      CHECK(worst(m, exact, points) < 1e-11);
      CHECK(worst(m, make(m, 1e-6, grid), points) < 1e-6);
      CHECK(worst(m, make(m, 1e-3, grid), points) < 1e-3);
    }
  }
  CHECK(make(one).boundary_edges() == 3);
  CHECK(make(one).boundary_loops() == 1);
  CHECK(make(fins).boundary_edges() == 9);  // the fin's twice
  CHECK(make(half).boundary_edges() == 40);
  CHECK(make(half).boundary_loops() == 2);
}

TEST_CASE("geometry: the winding number does not jump behind an open boundary") {
  // Lines that pass through the shadow of the rim, its chords and its clusters
  const mesh m = wavy_disc(2000);
  for (const double tolerance : {0.0, 1e-6, 1e-4}) {
    const winding w = make(m, tolerance, false);
    std::mt19937_64 g(11);
    std::uniform_real_distribution<double> u(-1.3, 1.3);
    double most = 0;
    for (int line = 0; line < 60; ++line) {
      dvec3 from{u(g), u(g), u(g)}, to{u(g), u(g), u(g)};
      if (line % 2 == 0) from[line % 3] = to[line % 3] = 0.0;
      for (int i = 0; i < 20; ++i) {
        const dvec3 p = from + (to - from) * (i / 20.0);
        most = std::max(most, std::abs(winding_number(w, p) - sum_at(m, p)));
      }
    }
    CHECK(most < std::max(tolerance, 1e-11));
  }
  // and all around the rim, seen along each axis
  const winding w = make(m, 1e-6), exact = make(m, 0);
  double most = 0;
  for (std::size_t i = 1; i < m.positions.size(); ++i) {
    for (int a = 0; a < 3; ++a) {
      for (const double off : {0.0, 1e-12, -1e-6, 1e-3}) {
        dvec3 p = m.positions[i];
        p[a] -= 0.2;
        p[(a + 1) % 3] += off;
        most = std::max(most, std::abs(winding_number(w, p) - winding_number(exact, p)));
      }
    }
  }
  CHECK(most < 1e-6);
}

TEST_CASE("geometry: edges that cancel and vertices that are welded close a mesh") {
  mesh m = unshared(sphere(2));
  for (std::size_t i = 0; i < m.positions.size(); i += 2) {
    for (int a = 0; a < 3; ++a) {
      if (m.positions[i][a] == 0) m.positions[i][a] = -0.0;
    }
  }
  m.triangles.push_back({0, 0, 1});  // without area
  m.triangles.push_back({0, 1, 1});
  m.triangles.push_back({5, 5, 5});
  CHECK(make(m).closed());
  CHECK(wrong(m, make(m), points_around(m, 500, 3)) == 0);
  // a face and the same face turned around cancel
  m.triangles.push_back({0, 4, 8});
  CHECK(make(m).boundary_edges() == 3);
  m.triangles.push_back({8, 4, 0});
  CHECK(make(m).closed());
  CHECK(winding_number(make(m), {0.1, 0.1, 0.1}) == 1);
  // an edge twice in the same direction does not
  const mesh twice = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 1, 2}}};
  CHECK(make(twice).boundary_edges() == 6);
  CHECK(worst(twice, make(twice), points_around(twice, 300, 4, 1.0)) < 1e-12);
}

TEST_CASE("geometry: winding numbers on vertices edges and faces") {
  std::mt19937_64 g(13);
  const mesh closed = torus(1, 0.4, 20, 12);
  const mesh open = without(closed, [&](std::size_t) { return g() % 5 == 0; });
  for (const mesh* m : {&closed, &open}) {
    for (const bool grid : {false, true}) {
      const winding w = make(*m, 1e-6, grid);
      int bad = 0;
      for (const ivec3& t : m->triangles) {
        const dvec3 a = m->positions[static_cast<std::size_t>(t.x)];
        const dvec3 b = m->positions[static_cast<std::size_t>(t.y)];
        const dvec3 c = m->positions[static_cast<std::size_t>(t.z)];
        for (const dvec3& p : {a, (a + b) / 2.0, (a + b + c) / 3.0}) {
          const double x = winding_number(w, p);
          if (m == &closed ? x != 0 && x != 1 : !(x > -0.6 && x < 1.6)) ++bad;
        }
      }
      CHECK(bad == 0);
    }
  }
}

TEST_CASE("geometry: winding numbers far away at an offset and at any scale") {
  std::mt19937_64 g(17);
  const mesh ball = sphere(3);
  const mesh open = without(ball, [&](std::size_t) { return g() % 12 == 0; });
  for (const double scale : {1e-200, 1e-100, 1e-6, 1.0, 1e6, 1e100, 1e200}) {
    const mesh m = moved(ball, scale, {0, 0, 0}), o = moved(open, scale, {0, 0, 0});
    const winding w = make(m), wo = make(o);
    CHECK(w.closed());
    CHECK(wrong(m, w, points_around(m, 300, 5)) == 0);
    CHECK(worst(o, wo, points_around(o, 300, 6)) < 1e-11);
    // 1e6 boxes away, where what is left is the vector area over the squared distance
    for (const dvec3& p : {dvec3{2e6, 1e5, 3}, dvec3{-1e6, -1e6, 1e6}, dvec3{0, 0, -1e6}}) {
      CHECK(winding_number(w, scale * p) == 0);
      CHECK(std::abs(winding_number(wo, scale * p) - sum_at(o, scale * p)) < 1e-13);
    }
  }
  for (const double boxes : {1e5, 1e7}) {
    const dvec3 by = boxes * dvec3{1, -0.7, 0.3};
    const mesh m = moved(ball, 1, by), o = moved(open, 1, by);
    CHECK(make(m).closed());
    CHECK(wrong(m, make(m), points_around(m, 1000, 7)) == 0);
    CHECK(worst(o, make(o), points_around(o, 1000, 8)) < 1e-11);
  }
  for (const double far : {1e30, 1e90, 1e200, 1e308}) {
    CHECK(std::abs(winding_number(make(open), {far, -far, 0})) < 1e-12);
  }
}

TEST_CASE(
    "geometry: winding numbers of nothing of one triangle and of vertices that are not finite") {
  CHECK(winding_number(winding(), {0, 0, 0}) == 0);
  CHECK(winding_number(make(mesh{}), {0, 0, 0}) == 0);
  CHECK(make(mesh{}).closed());
  const mesh point = {{{1, 2, 3}}, {{0, 0, 0}}};
  CHECK(winding_number(make(point), {1, 2, 3}) == 0);

  mesh m = sphere(2);
  m.positions[7] = {nan_double, 0, 0};
  const winding w = make(m);
  CHECK(!w.closed());
  CHECK(w.tree().left_out() > 0);
  CHECK(worst(m, w, points_around(m, 300, 9)) < 1e-11);

  CHECK(std::isnan(winding_number(w, {0, nan_double, 0})));
  CHECK(winding_number(w, {0, inf_double, 0}) == 0);
  CHECK(std::isnan(sum_at(m, {0, nan_double, 0})));
}

TEST_CASE("geometry: winding numbers refuse what makes no sense") {
  const mesh m = sphere(1);
  CHECK_THROWS_AS(make(m, -1), std::invalid_argument);
  CHECK_THROWS_AS(make(m, nan_double), std::invalid_argument);
  const bvh points = make_point_bvh(m.positions, {.threads = 1});
  CHECK_THROWS_AS(make_winding(points), std::invalid_argument);
  std::vector<double> results(2);
  CHECK_THROWS_AS(winding_numbers(make(m), m.positions, results), std::invalid_argument);
  const std::vector<ivec3> bad = {{0, 1, 99}};
  CHECK_THROWS_AS(winding_number_sum(bad, m.positions, {0, 0, 0}), std::invalid_argument);
}

TEST_CASE("geometry: batches of winding numbers are those of single points") {
  const mesh m = without(torus(2, 0.7, 60, 30), [](std::size_t i) { return i % 301 == 0; });
  const winding w = make(m, 1e-6);
  const auto points = points_around(m, 5000, 10);
  std::vector<double> one(points.size()), two(points.size());
  winding_numbers(w, points, one, 1);
  winding_numbers(w, points, two, 2);
  int bad = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    bad += one[i] != winding_number(w, points[i]) || two[i] != one[i];
  }
  CHECK(bad == 0);
}

TEST_CASE("geometry: the grid of crossings changes nothing") {
  mesh closed = torus(1, 0.4, 200, 100);
  append(closed, moved(torus(1, 0.4, 100, 100), 0.8, {0.5, 0.5, 0.1}));
  const mesh open = without(closed, [](std::size_t i) { return i % 9000 < 3; });
  const mesh meshes[] = {closed, open};
  for (const mesh& m : meshes) {
    const bvh tree = m.tree();
    const winding with = make_winding(tree, {.threads = 1});
    const winding none = make_winding(tree, {.grid = false, .threads = 1});
    REQUIRE(with.grid_cells() > 0);
    REQUIRE(none.grid_cells() == 0);
    int bad = 0;
    for (const dvec3& p : points_around(m, 60000, 11, 0.05)) {
      bad += std::abs(winding_number(with, p) - winding_number(none, p)) > 1e-12;
    }
    CHECK(bad == 0);
  }
}

TEST_CASE("geometry: winding numbers of meshes from files") {
  const auto folder = data_folder();
  if (!folder) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  struct file {
    const char* name;
    bool closed;
    std::size_t edges;
    int points;
  };
  // edges as counted from the files by another program; 0: not known
  const file files[] = {
      {"cube_with_fold.ply", true, 0, 1000},    {"rabbit.obj", true, 0, 500},
      {"joined_tetrahedra.obj", true, 0, 1000}, {"degenerated.obj", true, 0, 500},
      {"sliver_tet.ply", true, 0, 500},         {"soup.stl", false, 300, 1000},
      {"quadknot.obj", true, 0, 300},           {"cycloidal.ply", true, 0, 60},
      {"bunny_closed.obj", true, 0, 40},        {"stanford-bunny.obj", false, 223, 40}};
  for (const file& f : files) {
    CAPTURE(std::string(f.name));
    const mesh m = read(*folder + f.name);
    REQUIRE(!m.triangles.empty());
    const winding w = make(m, 1e-6), exact = make(m, 0);
    MESSAGE(std::string(f.name) << ": " << m.triangles.size() << " triangles, boundary "
                                << w.boundary_edges());
    const auto points = points_around(m, f.points, 12);
    if (f.edges > 0) CHECK(w.boundary_edges() == f.edges);
    if (w.closed()) {
      CHECK(wrong(m, w, points) == 0);
    } else {
      CHECK(worst(m, exact, points) < 1e-11);
      CHECK(worst(m, w, points) < 1e-6);
    }
  }
}
