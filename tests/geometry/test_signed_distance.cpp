#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "geometry/mesh_files.h"
#include "wisp/geometry/sdf.h"
#include "wisp/geometry/signed_distance.h"
#include "wisp/geometry/solid_angle.h"

using namespace wisp;
using namespace wisp::test_meshes;

namespace {

constexpr double nan_double = std::numeric_limits<double>::quiet_NaN();
constexpr double inf_double = std::numeric_limits<double>::infinity();

mesh_solid make(const mesh& m, fill_rule rule = fill_rule::nonzero) {
  return mesh_solid(m.tree(), {.rule = rule, .threads = 1});
}

// The box [-1, 1]^3.
mesh box() { return moved(surface({1, {1}}), 2, {-1, -1, -1}); }
double box_distance(const dvec3& p) {
  const dvec3 q = glm::abs(p) - 1.0;
  return glm::length(glm::max(q, dvec3{0})) + std::min(0.0, std::max({q.x, q.y, q.z}));
}

// By all triangles, and the sum of their solid angles.
double slow_distance(const mesh& m, const dvec3& p) {
  double least = inf_double;
  for (const ivec3& t : m.triangles) {
    const auto at = [&](int i) { return m.positions[static_cast<std::size_t>(i)]; };
    least = std::min(
        least, glm::distance(p, closest_point_on_triangle(p, at(t.x), at(t.y), at(t.z)).point));
  }
  return std::abs(winding_number_sum(m.triangles, m.positions, p)) >= 0.5 ? -least : least;
}

}  // namespace

TEST_CASE("geometry: signed distances of a box") {
  const mesh_solid solid = make(box());
  std::mt19937_64 g(1);
  std::uniform_real_distribution<double> u(-2, 2);
  int bad = 0;
  for (int i = 0; i < 20000; ++i) {
    dvec3 p{u(g), u(g), u(g)};
    if (i % 2 == 0) p = glm::round(4.0 * p) / 4.0;  // edges, faces and vertices among them
    const double d = signed_distance(solid, p), expected = box_distance(p);
    if (std::abs(d - expected) > 1e-15) ++bad;
    if (expected == 0 && d != 0) ++bad;
    const double within = std::abs(u(g));
    if (signed_distance(solid, p, within) != (std::abs(d) <= within ? d
                                              : d < 0               ? -within
                                                                    : within)) {
      ++bad;
    }
  }
  CHECK(bad == 0);
}

TEST_CASE("geometry: signed distances in meshes of any state") {
  const mesh ball = sphere(3);
  mesh doubled = ball, crossed = ball, hollow = ball;
  append(doubled, ball);
  append(crossed, moved(ball, 0.8, {0.7, 0, 0}));
  append(hollow, moved(inverted(ball), 0.5, {0, 0, 0}));
  const mesh open = without(ball, [](std::size_t i) { return i % 20 == 0; });
  const mesh meshes[] = {ball, inverted(ball), doubled, crossed, hollow, open, soup(60, 0.8, 5)};
  for (const mesh& m : meshes) {
    const mesh_solid solid = make(m);
    int bad = 0, inner = 0;
    for (const dvec3& p : points_around(m, 600, 6)) {
      const double d = signed_distance(solid, p), slow = slow_distance(m, p);
      if (std::abs(std::abs(d) - std::abs(slow)) > 1e-14) ++bad;
      const double w = winding_number_sum(m.triangles, m.positions, p);
      if (std::abs(std::abs(w) - 0.5) > 1e-5 && std::abs(d) > 1e-12 && (d < 0) != (slow < 0)) ++bad;
      inner += d < 0;
      const signed_distance_result r = find_signed_distance(solid, p);
      if (r.distance != d || r.closest.distance != std::abs(d) || !r.closest) ++bad;
      if (r.side.inside != (d < 0) && d != 0) ++bad;
    }
    CHECK(bad == 0);
    CHECK(inner > 10);
  }
  CHECK(signed_distance(make(inverted(ball), fill_rule::positive), {0, 0, 0}) > 0.9);
  CHECK(signed_distance(make(inverted(ball)), {0, 0, 0}) < -0.9);
}

TEST_CASE("geometry: signed distances are 0 on vertices") {
  const mesh m = torus(1, 0.4, 20, 12);
  const mesh open = without(m, [](std::size_t i) { return i % 9 == 0; });
  for (const mesh* x : {&m, &open}) {
    const mesh_solid solid = make(*x);
    for (const dvec3& p : x->positions) {
      const double d = signed_distance(solid, p);
      CHECK(d == 0);
      CHECK(!std::signbit(d));
    }
  }
}

TEST_CASE("geometry: signed distances of nothing and of points that are not finite") {
  const mesh_solid solid = make(box());
  for (int a = 0; a < 3; ++a) {
    dvec3 p{0, 0, 0};
    p[a] = nan_double;
    CHECK(std::isnan(signed_distance(solid, p)));
    CHECK(std::isnan(signed_distance(mesh_solid(), p)));
    p[a] = -inf_double;
    CHECK(signed_distance(solid, p) == inf_double);
  }
  CHECK(signed_distance(mesh_solid(), {0, 0, 0}) == inf_double);
  CHECK(signed_distance(make(mesh{}), {0, 0, 0}) == inf_double);
  CHECK(!find_signed_distance(mesh_solid(), {0, 0, 0}).closest);
  const mesh one = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  CHECK(signed_distance(make(one), {0, 0, 2}) == 2);
  CHECK(signed_distance(solid, {0, 0, 0}, 0.5) == -0.5);
  CHECK(signed_distance(solid, {0, 0, 0}, -3) == 0);
  CHECK(signed_distance(solid, {5, 0, 0}, 0.5) == 0.5);
}

TEST_CASE("geometry: signed distances far from the origin and at any scale") {
  for (const double scale : {1e-150, 1e-6, 1e6, 1e150}) {
    const mesh_solid solid = make(moved(box(), scale, {0, 0, 0}));
    CHECK(signed_distance(solid, {0, 0, 0}) == doctest::Approx(-scale).epsilon(1e-14));
    CHECK(signed_distance(solid, {3 * scale, 0, 0}) == doctest::Approx(2 * scale).epsilon(1e-14));
  }
  for (const double far : {0x1p17, 0x1p24}) {  // boxes: no digit of the corners is lost
    const dvec3 by{far, -far, far};
    const mesh_solid solid = make(moved(box(), 1, by));
    std::mt19937_64 g(2);
    std::uniform_real_distribution<double> u(-2, 2);
    int bad = 0;
    for (int i = 0; i < 2000; ++i) {
      const dvec3 p = dvec3{u(g), u(g), u(g)} + by;
      bad += std::abs(signed_distance(solid, p) - box_distance(p - by)) > 1e-14 * far;
    }
    CHECK(bad == 0);
  }
}

TEST_CASE("geometry: batches of signed distances are those of single points") {
  const mesh m = without(torus(2, 0.7, 60, 30), [](std::size_t i) { return i % 301 == 0; });
  const mesh_solid solid = make(m);
  const auto points = points_around(m, 3000, 10);
  std::vector<double> results(points.size());
  for (const int threads : {1, 2}) {
    signed_distances(solid, points, results, threads);
    int bad = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      bad += results[i] != signed_distance(solid, points[i]);
    }
    CHECK(bad == 0);
  }
  results.pop_back();
  CHECK_THROWS_AS(signed_distances(solid, points, results), std::invalid_argument);
}

TEST_CASE("geometry: a mesh as a leaf of a tree of solids") {
  const sdf solid = sdf_mesh(make(box()));
  CHECK(signed_distance(solid, {0, 0, 0}) == -1);
  CHECK(signed_distance(solid, {3, 0, 0}) == 2);
  const sdf parts[] = {solid, sdf_sphere({1, 0, 0}, 0.5)};
  const sdf cut = sdf_difference(parts);
  CHECK(signed_distance(cut, {0.9, 0, 0}) == doctest::Approx(0.4));
  CHECK(glm::distance(gradient(solid, {1.5, 0.1, 0.2}), dvec3{1, 0, 0}) < 1e-9);
  CHECK(glm::distance(gradient(solid, {0.1, -0.8, 0.2}), dvec3{0, -1, 0}) < 1e-9);
  // on the surface there is no direction to the closest point
  CHECK(glm::distance(gradient(solid, {0.1, 0.3, 1.0}), dvec3{0, 0, 1}) < 1e-6);
  CHECK(glm::distance(gradient(solid, {0.1, 0.3, 1.0 - 1e-13}), dvec3{0, 0, 1}) < 1e-6);
  const sdf_properties about = properties(solid);
  CHECK(about.bounds.min == dvec3{-1, -1, -1});
  CHECK(about.bounds.max == dvec3{1, 1, 1});
  CHECK(signed_distance(sdf_mesh(mesh_solid()), {0, 0, 0}) == inf_double);
}

TEST_CASE("geometry: signed distances of meshes from files") {
  const auto folder = data_folder();
  if (!folder) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  for (const char* name : {"cube_with_fold.ply", "rabbit.obj", "joined_tetrahedra.obj",
                           "degenerated.obj", "soup.stl", "cycloidal.ply"}) {
    CAPTURE(std::string(name));
    const mesh m = read(*folder + name);
    const mesh_solid solid = make(m);
    int bad = 0;
    for (const dvec3& p : points_around(m, m.triangles.size() > 10000 ? 40 : 300, 12)) {
      const double d = signed_distance(solid, p), slow = slow_distance(m, p);
      const double size = std::abs(slow) + glm::length(p);
      if (std::abs(std::abs(d) - std::abs(slow)) > 1e-13 * size) ++bad;
      const double w = winding_number_sum(m.triangles, m.positions, p);
      if (std::abs(std::abs(w) - 0.5) > 1e-5 && std::abs(d) > 1e-12 * size && d * slow < 0) ++bad;
    }
    CHECK(bad == 0);
  }
}
