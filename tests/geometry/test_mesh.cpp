#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/geometry/mesh.h"

using namespace wisp;

TEST_CASE("geometry mesh: quads split into the two triangles of the contract") {
  std::vector<ivec4> quads = {{0, 1, 2, 3}, {4, 5, 6, 6}};
  auto triangles = quads_to_triangles(quads);
  REQUIRE(triangles.size() == 3);
  CHECK(triangles[0] == ivec3{0, 1, 3});
  CHECK(triangles[1] == ivec3{2, 3, 1});
  CHECK(triangles[2] == ivec3{4, 5, 6});
}

TEST_CASE("geometry mesh: vertex normals are weighted by area and have unit length") {
  // Two triangles at a right angle along the x axis, one of three times the area.
  std::vector<vec3> p = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -3}, {9, 9, 9}};
  std::vector<ivec3> t = {{0, 1, 2}, {0, 1, 3}};
  auto n = vertex_normals(t, {}, p);
  REQUIRE(n.size() == 5);
  vec3 expected = glm::normalize(vec3{0, 3, 1});
  CHECK(glm::length(n[0] - expected) < 1e-6f);
  CHECK(glm::length(n[2] - vec3{0, 0, 1}) < 1e-6f);
  CHECK(n[4] == vec3{0, 0, 0});  // of no face
}

TEST_CASE("geometry mesh: vertex normals of quads do not depend on how they split") {
  std::vector<vec3> p = {{0, 0, 0}, {1, 0, 0.1f}, {1, 1, 0}, {0, 1, 0.1f}};
  std::vector<ivec4> a = {{0, 1, 2, 3}}, b = {{1, 2, 3, 0}};
  auto na = vertex_normals({}, a, p), nb = vertex_normals({}, b, p);
  for (std::size_t i = 0; i < 4; i++) CHECK(glm::length(na[i] - nb[i]) < 1e-6f);
  CHECK(na[0].z > 0.9f);
}

TEST_CASE("geometry mesh: normals at extreme scales, of bad faces and bad vertices") {
  for (float scale : {1e-18f, 1.0f, 1e18f}) {
    std::vector<vec3> p = {{0, 0, 0}, {scale, 0, 0}, {0, scale, 0}};
    std::vector<ivec3> t = {{0, 1, 2}};
    CHECK(glm::length(vertex_normals(t, {}, p)[0] - vec3{0, 0, 1}) < 1e-6f);
  }
  float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<vec3> p = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {nan, 0, 0}};
  std::vector<ivec3> t = {{0, 1, 2}, {0, 1, 3}, {0, 0, 0}, {0, 1, 7}, {-1, 1, 2}};
  std::vector<ivec4> q = {{0, 1, 2, 9}};
  auto n = vertex_normals(t, q, p);
  CHECK(n[0] == vec3{0, 0, 1});
  CHECK(n[3] == vec3{0, 0, 0});
}

TEST_CASE("geometry mesh: areas are sampled in proportion and uniformly within a triangle") {
  std::vector<vec3> p = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 3, 0}};
  std::vector<ivec3> t = {{0, 1, 2}, {0, 0, 0}, {0, 1, 3}, {1, 1, 1}};  // areas 1/2, 0, 3/2, 0
  auto sampler = make_area_sampler(t, p);
  REQUIRE(sampler.cdf.size() == 4);
  CHECK(sampler.cdf.back() == doctest::Approx(2.0));
  int count[4] = {};
  dvec2 sum = {0, 0};
  constexpr int samples = 40000;
  rng_state rng = make_rng(1);
  for (int i = 0; i < samples; i++) {
    auto s = sample_area(sampler, rand1f(rng), {rand1f(rng), rand1f(rng)});
    REQUIRE(s.triangle >= 0);
    REQUIRE(s.triangle < 4);
    CHECK(s.uv.x >= 0);
    CHECK(s.uv.y >= 0);
    CHECK(s.uv.x + s.uv.y <= 1.000001f);
    count[s.triangle]++;
    sum += dvec2(s.uv);
  }
  CHECK(count[1] == 0);
  CHECK(count[3] == 0);
  // Five standard deviations of a binomial count.
  CHECK(std::abs(count[0] - samples * 0.25) < 5 * std::sqrt(samples * 0.25 * 0.75));
  // The centroid has barycentrics 1/3; the variance of each is 1/18.
  double tolerance = 5 * std::sqrt(1.0 / 18 / samples);
  CHECK(std::abs(sum.x / samples - 1.0 / 3) < tolerance);
  CHECK(std::abs(sum.y / samples - 1.0 / 3) < tolerance);
}

TEST_CASE("geometry mesh: area sampling at its ends and of nothing") {
  std::vector<vec3> p = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  std::vector<ivec3> t = {{0, 0, 0}, {0, 1, 2}, {0, 0, 1}};
  auto sampler = make_area_sampler(t, p);
  CHECK(sample_area(sampler, 0, {0, 0}).triangle == 1);
  CHECK(sample_area(sampler, 0x1.fffffep-1f, {0, 0}).triangle == 1);
  CHECK(sample_area(sampler, 1, {0, 0}).triangle == 1);  // outside [0, 1), and still harmless
  CHECK(sample_area(make_area_sampler({}, p), 0.5f, {0, 0}).triangle == -1);
  std::vector<ivec3> flat = {{0, 0, 1}};
  CHECK(sample_area(make_area_sampler(flat, p), 0.5f, {0, 0}).triangle == -1);
}
