#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "query_files.h"
#include "query_meshes.h"
#include "wisp/geometry/bvh.h"
#include "wisp/geometry/closest_point.h"
#include "wisp/geometry/solid_angle.h"
#include "wisp/geometry/winding_number.h"

using namespace wisp;
using namespace wisp_test;

namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr std::size_t fewer = 6;
#else
constexpr std::size_t fewer = 1;
#endif

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double tau = 6.283185307179586477;

winding winding_of(const tri_mesh& m, const winding_options& options = {}) {
  return make_winding(make_bvh(m.triangles, m.positions), options);
}
double sum_of(const tri_mesh& m, const dvec3& p) {
  return winding_number_sum(m.triangles, m.positions, p);
}

// Winding numbers against the sum: whole ones have to be it, rounded; with a boundary
// and without its expansions, within the rounding of the sum; with them, as asked.
void check(const std::string& name, const tri_mesh& m, const std::vector<dvec3>& points,
           bool closed) {
  INFO(name);
  const bvh tree = make_bvh(m.triangles, m.positions);
  const double size = box_of(m.positions).size();
  for (const bool grid : {false, true}) {
    CAPTURE(grid);
    const winding exact = make_winding(tree, {.tolerance = 0, .grid = grid});
    CHECK(exact.closed() == closed);
    CHECK((exact.boundary_edges() == 0) == closed);
    CHECK((exact.boundary_loops() == 0) == closed);
    struct rough {
      double tolerance;
      winding w;
    };
    std::vector<rough> roughs;
    if (!closed) {
      for (const double t : {1e-2, 1e-4, 1e-6, 1e-8}) {
        roughs.push_back({t, make_winding(tree, {.tolerance = t, .grid = grid})});
      }
    }
    std::size_t wrong = 0;
    for (const dvec3& p : points) {
      const double sum = sum_of(m, p), w = winding_number(exact, p);
      // on the surface the sum says nothing
      const bool sure = !closer_than(tree, p, 1e-10 * size);
      if (!closed && !sure) continue;
      if (closed) {
        if (w != std::round(w) || (sure && w != std::round(sum))) {
          ++wrong;
        }
      } else if (!(std::abs(w - sum) < 1e-11)) {
        ++wrong;
      }
      if (wrong == 1) {
        CAPTURE(p.x);
        CAPTURE(p.y);
        CAPTURE(p.z);
        CAPTURE(sum);
        CAPTURE(w);
        CHECK_MESSAGE(false, "winding number");
        wrong = 2;
      }
      for (const rough& r : roughs) {
        const double rw = winding_number(r.w, p);
        if (std::abs(rw - sum) <= r.tolerance + 1e-11) continue;
        ++wrong;
        if (wrong == 1) {
          CHECK_MESSAGE(false, "tolerance " << r.tolerance << ", off by " << rw - sum);
          wrong = 2;
        }
      }
    }
    CHECK(wrong == 0);
  }
}

// In and around the box, and far away; not on the surface, where it has two sides.
std::vector<dvec3> free_points(const tri_mesh& m, std::size_t n, uint64_t seed) {
  random_numbers random(seed);
  const bounding_box box = box_of(m.positions);
  const double size = box.size() > 0 ? box.size() : 1;
  std::vector<dvec3> points;
  for (std::size_t i = 0; i < n / fewer; ++i) {
    constexpr double reach[] = {0.5, 0.5, 0.5, 0.6, 2, 10, 1e3, 1e6};
    points.push_back(box.center() + reach[i % 8] * size * random.in_cube());
  }
  // straight below and beside vertices, so that rays meet them
  for (std::size_t i = 0; i < n / fewer / 2 && !m.positions.empty(); ++i) {
    dvec3 p = m.positions[random.below(m.positions.size())];
    if (!all_finite(p)) continue;
    p[static_cast<int>(i % 3)] += random(-0.5, 0.5) * size;
    points.push_back(p);
  }
  return points;
}

voxels random_voxels(int n, double density, uint64_t seed) {
  random_numbers random(seed);
  voxels v(n);
  for (std::size_t i = 0; i < v.full.size(); ++i) v.full[i] = random() < density;
  return v;
}

// Of each point of the lattice of halves: whole, and that of the cells around it; on
// the surface, of one of them.
std::size_t wrong_on_lattice(const voxels& v, const winding& w, double scale, const dvec3& offset) {
  std::size_t wrong = 0;
  for (int z = -1; z <= 2 * v.size + 1; ++z) {
    for (int y = -1; y <= 2 * v.size + 1; ++y) {
      for (int x = -1; x <= 2 * v.size + 1; ++x) {
        const ivec3 twice = {x, y, z};
        double least = 1, most = 0;
        for (int corner = 0; corner < 8; ++corner) {
          ivec3 cell;
          for (int a = 0; a < 3; ++a) {
            // an odd coordinate is within a cell, an even one between two
            const int low = (twice[a] + 2) / 2 - 1;
            const bool between = (twice[a] & 1) == 0;
            cell[a] = between && ((corner >> a) & 1) == 0 ? low - 1 : low;
          }
          const double here = v.at(cell) ? 1 : 0;
          least = std::min(least, here);
          most = std::max(most, here);
        }
        const dvec3 p = dvec3(twice) / 2.0 * scale + offset;
        const double n = winding_number(w, p);
        wrong += !(n == std::round(n) && n >= least && n <= most);
      }
    }
  }
  return wrong;
}

}  // namespace

TEST_CASE("geometry: solid angles that are known") {
  const dvec3 x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1}, o = {0, 0, 0};
  CHECK(solid_angle(o, x, y, z) == doctest::Approx(tau / 4).epsilon(1e-15));
  CHECK(solid_angle(o, y, x, z) == doctest::Approx(-tau / 4).epsilon(1e-15));
  CHECK(solid_angle(o, x, y, -z) == doctest::Approx(-tau / 4).epsilon(1e-15));
  // a face of a cube from its center, by halves
  CHECK(solid_angle(o, {1, -1, -1}, {1, 1, -1}, {1, 1, 1}) ==
        doctest::Approx(tau / 6).epsilon(1e-15));
  // a face of a tetrahedron from its center
  CHECK(std::abs(solid_angle(o, {1, 1, 1}, {1, -1, -1}, {-1, 1, -1})) ==
        doctest::Approx(tau / 2).epsilon(1e-15));
  // in the plane: outside and inside
  CHECK(solid_angle({2, 2, 0}, o, x, y) == 0);
  CHECK(std::abs(solid_angle({0.25, 0.25, 0}, o, x, y)) == doctest::Approx(tau));
  CHECK(solid_angle({0.25, 0.25, 1e-12}, o, x, y) == doctest::Approx(-tau).epsilon(1e-10));
  CHECK(solid_angle({0.25, 0.25, -1e-12}, o, x, y) == doctest::Approx(tau).epsilon(1e-10));
  // degenerate ones
  CHECK(solid_angle({1, 2, 3}, x, x, y) == 0);
  CHECK(solid_angle({1, 2, 3}, x, x, x) == 0);
  CHECK(solid_angle(o, o, o, o) == 0);
  CHECK(std::isnan(solid_angle({not_a_number, 0, 0}, x, y, z)));
  // far away it is the projected area by the square of the distance
  for (const double d : {1e3, 1e6, 1e9, 1e12}) {
    CHECK(solid_angle({0.3, 0.3, -d}, o, x, y) ==
          doctest::Approx(0.5 / (d * d)).epsilon(d < 1e4 ? 1e-5 : 1e-11));
  }
  // at any scale
  for (const double s : {1e-280, 1e-200, 1e-30, 1e30, 1e200, 1e280}) {
    CHECK(solid_angle(o, s * x, s * y, s * z) == doctest::Approx(tau / 4).epsilon(1e-14));
  }
}

TEST_CASE("geometry: the plain sum of solid angles") {
  const tri_mesh m = box_grid(2);
  CHECK(sum_of(m, {0.9, 1.1, 1}) == doctest::Approx(1).epsilon(1e-14));
  CHECK(std::abs(sum_of(m, {-0.1, 1, 1})) < 1e-14);
  CHECK(sum_of(flipped(m), {1, 1, 0.5}) == doctest::Approx(-1).epsilon(1e-14));
  CHECK(std::isnan(sum_of(m, {not_a_number, 1, 1})));
  tri_mesh with_bad = m;
  with_bad.positions.push_back({not_a_number, 0, 0});
  with_bad.triangles.push_back({0, 1, static_cast<int>(with_bad.positions.size()) - 1});
  CHECK(sum_of(with_bad, {1, 1, 0.5}) == doctest::Approx(1).epsilon(1e-14));
  CHECK(sum_of({}, {1, 2, 3}) == 0);
  for (const int bad : {-1, 999}) {
    CHECK_THROWS_AS(winding_number_sum(std::vector<ivec3>{{0, 1, bad}}, m.positions, {0, 0, 0}),
                    std::invalid_argument);
  }
}

TEST_CASE("geometry: winding numbers on lattices are exact through any tie") {
  int seed = 0;
  for (const double density : {1.0, 0.5, 0.15, 0.85}) {
    const voxels v = random_voxels(fewer == 1 ? 7 : 4, density, static_cast<uint64_t>(++seed));
    const tri_mesh m = voxel_surface(v);
    struct place {
      double scale;
      dvec3 offset;
    };
    for (const place& at : {place{1, {0, 0, 0}}, place{0x1p-60, {0, 0, 0}}, place{1e-30, {0, 0, 0}},
                            place{1e6, {-3.3e6, 1e5, 7e5}}, place{1e30, {0, 0, 0}},
                            place{1, {1e5, -2e5, 3e5}}, place{0.1, {-0.35, -0.35, -0.35}}}) {
      CAPTURE(density);
      CAPTURE(at.scale);
      for (const bool grid : {false, true}) {
        const winding w = winding_of(moved(m, at.scale, at.offset), {.grid = grid});
        CHECK(w.closed());
        CHECK(wrong_on_lattice(v, w, at.scale, at.offset) == 0);
      }
    }
    CHECK(wrong_on_lattice(v, winding_of(unwelded(m)), 1, {0, 0, 0}) == 0);
    CHECK(winding_of(unwelded(m)).closed());
  }
}

TEST_CASE("geometry: winding numbers of closed meshes are whole and right") {
  const tri_mesh body = bumpy_body(3), ring_mesh = ring(24, 12), box = box_grid(3);
  for (const tri_mesh& m : {body, ring_mesh, box}) {
    const auto points = free_points(m, 400, 3);
    check("closed", m, points, true);
    check("inverted", flipped(m), points, true);
    check("twice", joined(m, m), points, true);
    check("with its inverse", joined(m, flipped(m)), points, true);
    check("nested", joined(m, moved(m, 0.5, 0.25 * box_of(m.positions).center())), points, true);
    check("a hollow", joined(m, flipped(moved(m, 0.5))), points, true);
    check("overlapping", joined(m, moved(m, 1, {0.3, 0.1, 0.2})), points, true);
    check("seams", unwelded(m), points, true);
  }
  check("coarse and fine", joined(ball(0), moved(ball(3), 1.7)), free_points(ball(1), 500, 4),
        true);
  // three times, and one of them inverted
  const tri_mesh b = ball(2);
  const winding w = winding_of(joined(joined(b, b), flipped(b)));
  CHECK(winding_number(w, {0.1, 0.2, 0.3}) == 1);
  CHECK(winding_number(winding_of(joined(b, b)), {0.1, 0.2, 0.3}) == 2);
  CHECK(winding_number(winding_of(flipped(b)), {0.1, 0.2, 0.3}) == -1);
}

TEST_CASE("geometry: winding numbers at and next to the surface of a closed mesh are whole") {
  for (const tri_mesh& m : {ball(3), bumpy_body(3), box_grid(3), ring(30, 15)}) {
    const winding w = winding_of(m);
    random_numbers random(5);
    std::size_t wrong = 0, wrong_side = 0;
    for (std::size_t i = 0; i < 4000 / fewer; ++i) {
      const auto v = m.corners(random.below(m.triangles.size()));
      double s = random(), t = random() * (1 - s);
      if (i % 4 == 0) s = t = 0;
      if (i % 4 == 1) t = 0;
      dvec3 p = v[0] + s * (v[1] - v[0]) + t * (v[2] - v[0]);
      if (i % 3 == 0)
        p[static_cast<int>(i % 7 % 3)] = std::nextafter(p[static_cast<int>(i % 7 % 3)], 9);
      const double n = winding_number(w, p);
      wrong += n != 0 && n != 1;
      // a little off a face it is what it is there
      if (i % 4 < 2) continue;
      const dvec3 normal = glm::normalize(glm::cross(v[1] - v[0], v[2] - v[0]));
      const double inside = std::min({s, t, 1 - s - t});
      if (inside < 0.05) continue;
      const double off = std::pow(10.0, -random(4, 13));
      wrong_side += winding_number(w, p + off * normal) != 0;
      wrong_side += winding_number(w, p - off * normal) != 1;
    }
    CHECK(wrong == 0);
    CHECK(wrong_side == 0);
  }
}

TEST_CASE("geometry: the side of a slanted face is exact to the last bit") {
  // the octahedron |x| + |y| + |z| <= 1, where no sum below is rounded
  const winding w = winding_of(ball(0));
  random_numbers random(6);
  std::size_t wrong = 0;
  for (int i = 0; i < 4000; ++i) {
    const double x = static_cast<double>(1 + random.below(500)) / 1024;
    const double y = static_cast<double>(1 + random.below(500)) / 1024;
    const double on = 1 - x - y;
    double z = on;
    const std::size_t steps = 1 + random.below(4);
    for (std::size_t k = 0; k < steps; ++k) z = std::nextafter(z, i % 2 == 0 ? 0 : 1);
    dvec3 p = {x, y, z};
    for (int a = 0; a < 3; ++a) p[a] *= random() < 0.5 ? -1 : 1;
    for (std::size_t k = random.below(3); k > 0; --k) p = {p.y, p.z, p.x};
    wrong += winding_number(w, p) != (z < on ? 1 : 0);
  }
  CHECK(wrong == 0);
}

TEST_CASE("geometry: winding numbers of open meshes are the sum of their solid angles") {
  random_numbers random(8);
  const auto holes = [&](const tri_mesh& m, double share) {
    return without(m, [&](std::size_t) { return random() < share; });
  };
  for (const tri_mesh& m : {bumpy_body(3), ring(24, 12), box_grid(3)}) {
    check("half",
          without(m, [&](std::size_t t) { return t % 2 == 0 && t > m.triangles.size() / 2; }),
          free_points(m, 200, 9), false);
    check("a few holes", holes(m, 0.03), free_points(m, 200, 10), false);
    check("many holes", holes(m, 0.4), free_points(m, 150, 11), false);
    check("one triangle missing", without(m, [](std::size_t t) { return t == 5; }),
          free_points(m, 300, 12), false);
    const tri_mesh open = holes(m, 0.1);
    check("open twice", joined(open, open), free_points(m, 150, 13), false);
    check("open seams", unwelded(open), free_points(m, 150, 14), false);
    check("open with a turned part", joined(open, flipped(moved(m, 0.7))), free_points(m, 150, 15),
          false);
  }
  check("soup", random_soup(200, 0.3, 16), free_points(box_grid(1), 300, 17), false);
  check("soup of large ones", random_soup(60, 2, 18), free_points(box_grid(1), 300, 19), false);
  const tri_mesh some = random_soup(100, 0.4, 20);
  check("soup twice", joined(some, some), free_points(some, 200, 21), false);
  check("one triangle", random_soup(1, 1, 22), free_points(random_soup(1, 1, 22), 500, 23), false);
  // triangles that do not agree on which side is out
  tri_mesh turned = bumpy_body(2);
  for (std::size_t t = 0; t < turned.triangles.size(); t += 5) {
    std::swap(turned.triangles[t].y, turned.triangles[t].z);
  }
  check("turned triangles", turned, free_points(turned, 300, 24), false);
  // a long row of triangles at an edge
  tri_mesh pages;
  pages.positions = {{0, 0, -1}, {0, 0, 1}};
  for (int i = 0; i < 40; ++i) {
    pages.positions.push_back({std::cos(0.1 * i), std::sin(0.1 * i), 0.02 * i});
    pages.triangles.push_back({0, 1, i + 2});
  }
  check("pages", pages, free_points(pages, 300, 25), false);
}

TEST_CASE("geometry: winding numbers of open lattices where rays meet edges and vertices") {
  for (const uint64_t seed : {1u, 2u, 3u}) {
    const voxels v = random_voxels(4, 0.6, seed);
    random_numbers random(seed + 40);
    const tri_mesh m = without(voxel_surface(v), [&](std::size_t) { return random() < 0.15; });
    std::vector<dvec3> points;
    for (int i = 0; i < 11 * 11 * 11; ++i) {
      const ivec3 twice = ivec3{i % 11, i / 11 % 11, i / 121} - 1;
      // within cells, so that all rays through vertices' planes are, and no surface is
      if ((twice.x & 1) != 0 && (twice.y & 1) != 0 && (twice.z & 1) != 0) {
        points.push_back(dvec3(twice) / 2.0);
      }
    }
    for (int i = 0; i < 300; ++i) {  // on the lattice, but for one coordinate out of the box
      ivec3 c = {static_cast<int>(random.below(5)), static_cast<int>(random.below(5)),
                 static_cast<int>(random.below(5))};
      c[i % 3] = i % 2 == 0 ? -2 : 7;
      points.push_back(dvec3(c));
    }
    check("open lattice", m, points, false);
    for (const double s : {0x1p-70, 1e-30, 1e30}) {
      std::vector<dvec3> there;
      for (const dvec3& p : points) there.push_back(p * s);
      check("open lattice, scaled", moved(m, s), there, false);
    }
  }
}

TEST_CASE("geometry: boundaries are counted") {
  const winding one = winding_of(random_soup(1, 1, 3));
  CHECK(one.boundary_edges() == 3);
  CHECK(one.boundary_loops() == 1);
  CHECK_FALSE(one.closed());
  const tri_mesh box = box_grid(3);
  // without its top
  const tri_mesh open = without(box, [&](std::size_t t) {
    const auto v = box.corners(t);
    return v[0].z == 3 && v[1].z == 3 && v[2].z == 3;
  });
  const winding w = winding_of(open);
  CHECK(w.boundary_edges() == 12);
  CHECK(w.boundary_loops() == 1);
  CHECK(winding_of(unwelded(open)).boundary_edges() == 12);
  CHECK(winding_of(joined(open, open)).boundary_edges() == 24);
  CHECK(winding_of(joined(open, flipped(open))).boundary_edges() == 0);
  CHECK(winding_of(box).boundary_edges() == 0);
  CHECK(winding_of(random_soup(50, 0.1, 3)).boundary_edges() == 150);
  CHECK(winding_of(random_soup(50, 0.1, 3)).boundary_loops() == 50);
  tri_mesh flat;  // no area: no boundary that anything could see
  flat.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  flat.triangles = {{0, 1, 1}, {2, 2, 2}, {0, 0, 1}};
  CHECK(winding_of(flat).closed());
  CHECK(winding_number(winding_of(flat), {0.2, 0.1, 0}) == 0);
}

TEST_CASE("geometry: winding numbers at any scale and place") {
  random_numbers random(50);
  const tri_mesh closed = bumpy_body(2);
  const tri_mesh open = without(closed, [&](std::size_t) { return random() < 0.1; });
  for (const double s : {1e-100, 1e-30, 1e-6, 1e6, 1e30, 1e100}) {
    CAPTURE(s);
    for (const dvec3& offset : {dvec3{0, 0, 0}, dvec3{1e5, -2e5, 3e5}}) {
      const tri_mesh a = moved(closed, s, s * offset), b = moved(open, s, s * offset);
      check("closed", a, free_points(a, 120, 51), true);
      check("open", b, free_points(b, 120, 52), false);
    }
  }
  const winding w = winding_of(open), c = winding_of(closed);
  for (const double far : {1e6, 1e12, 1e100, 1e300}) {
    CHECK(std::abs(winding_number(w, {far, 0.1 * far, 0})) < 1e-6 + 10 / far / far);
    CHECK(winding_number(c, {far, 0.1 * far, 0}) == 0);
  }
}

TEST_CASE("geometry: winding numbers of nothing and from nowhere") {
  const winding none;
  CHECK(none.closed());
  CHECK(none.boundary_edges() == 0);
  CHECK(none.boundary_loops() == 0);
  CHECK(none.grid_cells() == 0);
  CHECK(none.tree().empty());
  CHECK(winding_number(none, {1, 2, 3}) == 0);
  CHECK(std::isnan(winding_number(none, {not_a_number, 2, 3})));
  const winding of_empty = make_winding(bvh());
  CHECK(of_empty.closed());
  CHECK(winding_number(of_empty, {1, 2, 3}) == 0);

  for (const winding& w : {winding_of(ball(2)), winding_of(random_soup(20, 0.5, 1))}) {
    for (int a = 0; a < 3; ++a) {
      dvec3 p = {0.1, 0.1, 0.1};
      p[a] = not_a_number;
      CHECK(std::isnan(winding_number(w, p)));
      p[a] = inf;
      CHECK(winding_number(w, p) == 0);
      p[a] = -inf;
      CHECK(winding_number(w, p) == 0);
    }
  }
  const std::vector<dvec3> points = {{0, 0, 0}, {1, 0, 0}};
  CHECK_THROWS_AS(make_winding(make_segment_bvh(std::vector<ivec2>{{0, 1}}, points)),
                  std::invalid_argument);
  CHECK_THROWS_AS(make_winding(make_point_bvh(points)), std::invalid_argument);
  const bvh tree = make_bvh(ball(0).triangles, ball(0).positions);
  for (const double bad : {-1.0, not_a_number, -inf}) {
    CHECK_THROWS_AS(make_winding(tree, {.tolerance = bad}), std::invalid_argument);
  }
  // triangles that are left out open the mesh
  tri_mesh m = box_grid(2);
  m.positions[0].x = not_a_number;
  CHECK_FALSE(winding_of(m).closed());
  check("left out", m, free_points(box_grid(2), 200, 60), false);
}

TEST_CASE("geometry: batches of winding numbers are single ones at any number of threads") {
  random_numbers random(70);
  const tri_mesh closed = bumpy_body(3);
  const tri_mesh open = without(closed, [&](std::size_t) { return random() < 0.05; });
  for (const tri_mesh& m : {closed, open}) {
    const winding w = winding_of(m, {.threads = 1}), same = winding_of(m, {.threads = 2});
    std::vector<dvec3> points = free_points(m, 3000, 71);
    points.push_back({not_a_number, 0, 0});
    points.push_back({inf, 0, 0});
    std::vector<double> single;
    for (const dvec3& p : points) single.push_back(winding_number(w, p));
    const auto differences = [&](const std::vector<double>& r) {
      std::size_t n = 0;
      for (std::size_t i = 0; i < r.size(); ++i) {
        n += std::bit_cast<uint64_t>(r[i]) != std::bit_cast<uint64_t>(single[i]) &&
             !(std::isnan(r[i]) && std::isnan(single[i]));
      }
      return n;
    };
    for (const int threads : {1, 2, 3, 0}) {
      std::vector<double> batch(points.size());
      winding_numbers(w, points, batch, threads);
      CHECK(differences(batch) == 0);
      winding_numbers(same, points, batch, threads);
      CHECK(differences(batch) == 0);
    }
    std::vector<double> a(points.size()), b(points.size()), few(2);
    std::thread first([&] { winding_numbers(w, points, a); });
    std::thread second([&] { winding_numbers(w, points, b); });
    first.join();
    second.join();
    CHECK(differences(a) + differences(b) == 0);
    CHECK_THROWS_AS(winding_numbers(w, points, few), std::invalid_argument);
    std::vector<double> nothing;
    CHECK_NOTHROW(winding_numbers(w, {}, nothing));
  }
}

TEST_CASE("geometry: winding number sums of meshes from files") {
  for (const std::string& name : mesh_file_names()) {
    const auto m = mesh_of_file(name);
    if (!m) {
      MESSAGE("skipped: WISP_TEST_DATA has no " << name);
      continue;
    }
    const winding w = winding_of(*m);
    const std::size_t n = std::clamp<std::size_t>(3000000 / m->triangles.size(), 24, 400);
    check(name, *m, free_points(*m, n, 80), w.closed());
    if (name == "bunny_closed.obj") CHECK(w.closed());
    if (name == "stanford-bunny.obj") CHECK_FALSE(w.closed());
  }
}
