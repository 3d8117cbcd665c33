#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "wisp/geometry/mesh.h"
#include "wisp/geometry/subdivide.h"

using namespace wisp;

namespace {

quad_mesh<vec3> make_cube() {
  return {{{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}},
          {{-1, -1, -1},
           {1, -1, -1},
           {1, 1, -1},
           {-1, 1, -1},
           {-1, -1, 1},
           {1, -1, 1},
           {1, 1, 1},
           {-1, 1, 1}}};
}

// A flat grid of n x n quads over [0, n]^2.
quad_mesh<vec3> make_grid(int n) {
  quad_mesh<vec3> mesh;
  for (int j = 0; j <= n; j++)
    for (int i = 0; i <= n; i++) mesh.vertices.push_back({i, j, 0});
  for (int j = 0; j < n; j++)
    for (int i = 0; i < n; i++) {
      int a = j * (n + 1) + i;
      mesh.quads.push_back({a, a + 1, a + n + 2, a + n + 1});
    }
  return mesh;
}

// Each edge of a closed, consistently turned mesh is used once in each direction.
bool is_closed(const std::vector<ivec4>& quads) {
  std::map<std::pair<int, int>, int> uses;
  for (const auto& q : quads)
    for (int k = 0; k < 4; k++) uses[{q[k], q[(k + 1) % 4]}]++;
  for (const auto& [edge, count] : uses)
    if (count != 1 || uses.count({edge.second, edge.first}) != 1) return false;
  return true;
}

}  // namespace

TEST_CASE("geometry subdivide: a cube after one step, by hand") {
  auto mesh = subdivide_catmullclark(make_cube(), false);
  CHECK(mesh.quads.size() == 24);
  REQUIRE(mesh.vertices.size() == 8 + 12 + 6);
  CHECK(is_closed(mesh.quads));
  // Corner: F = (1/3)(1,1,1), E = (2/3)(1,1,1), n = 3: (F + 2 E) / 3 = 5/9.
  CHECK(glm::length(mesh.vertices[6] - vec3{5.0f / 9}) < 1e-6f);
  // The edge from (-1,-1,-1) to (-1,1,-1): mean of its ends and two face points.
  CHECK(glm::length(mesh.vertices[8] - vec3{-0.75f, 0, -0.75f}) < 1e-6f);
  // The first face's middle.
  CHECK(glm::length(mesh.vertices[20] - vec3{0, 0, -1}) < 1e-6f);
}

TEST_CASE("geometry subdivide: Euler's formula, orientation and convergence of a cube") {
  auto mesh = make_cube();
  for (int level = 0; level < 5; level++) mesh = subdivide_catmullclark(mesh, false);
  CHECK(mesh.quads.size() == 6 * 1024);
  CHECK(mesh.vertices.size() == mesh.quads.size() + 2);  // V - E + F = 2 with E = 2 F
  CHECK(is_closed(mesh.quads));
  // Faces point outwards as those of the cube do, and the surface is smooth:
  // its extent lies strictly inside the cube.
  auto normals = vertex_normals({}, mesh.quads, mesh.vertices);
  float largest = 0;
  for (std::size_t i = 0; i < normals.size(); i++) {
    CHECK(glm::dot(normals[i], mesh.vertices[i]) > 0);
    largest = std::max(largest, std::abs(mesh.vertices[i].x));
  }
  CHECK(largest > 0.6f);
  CHECK(largest < 0.9f);
}

TEST_CASE("geometry subdivide: triangles become three quads") {
  quad_mesh<vec3> tetrahedron{{{0, 2, 1, 1}, {0, 1, 3, 3}, {1, 2, 3, 3}, {2, 0, 3, 3}},
                              {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (auto mesh : {subdivide_catmullclark(tetrahedron, false), subdivide_linear(tetrahedron)}) {
    CHECK(mesh.quads.size() == 12);
    CHECK(mesh.vertices.size() == 4 + 6 + 4);
    CHECK(is_closed(mesh.quads));
    for (const auto& q : mesh.quads) CHECK(q.z != q.w);
  }
}

TEST_CASE("geometry subdivide: a regular grid keeps its plane and its boundary curve is a spline") {
  auto mesh = subdivide_catmullclark(make_grid(3), false);
  CHECK(mesh.quads.size() == 36);
  for (const auto& v : mesh.vertices) CHECK(v.z == 0);
  // Inside, a regular grid reproduces itself.
  CHECK(glm::length(mesh.vertices[5] - vec3{1, 1, 0}) < 1e-6f);
  // A boundary vertex in the middle of a straight side stays; the corner moves
  // to (1/8)(1,0) + (1/8)(0,1) + (3/4)(0,0).
  CHECK(glm::length(mesh.vertices[1] - vec3{1, 0, 0}) < 1e-6f);
  CHECK(glm::length(mesh.vertices[0] - vec3{0.125f, 0.125f, 0}) < 1e-6f);
}

TEST_CASE("geometry subdivide: a locked boundary stays where it is") {
  auto grid = make_grid(2);
  grid.vertices[4].z = 1;  // the middle, which moves
  auto mesh = subdivide_catmullclark(grid, true);
  for (std::size_t v = 0; v < 9; v++) {
    if (v == 4)
      CHECK(mesh.vertices[v].z < 0.9f);
    else
      CHECK(mesh.vertices[v] == grid.vertices[v]);
  }
  std::vector<vec2> texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  auto uv = subdivide_catmullclark(quad_mesh<vec2>{{{0, 1, 2, 3}}, texcoords}, true);
  for (std::size_t v = 0; v < 4; v++) CHECK(uv.vertices[v] == texcoords[v]);
  CHECK(uv.vertices[4] == vec2{0.5f, 0});
}

TEST_CASE("geometry subdivide: linear subdivision keeps the shape") {
  auto cube = make_cube();
  auto mesh = subdivide_linear(cube);
  for (std::size_t v = 0; v < 8; v++) CHECK(mesh.vertices[v] == cube.vertices[v]);
  for (const auto& v : mesh.vertices)
    CHECK(std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) == doctest::Approx(1));
  quad_mesh<vec4> colors{{{0, 1, 2, 3}}, {vec4{0}, vec4{1}, vec4{0}, vec4{1}}};
  CHECK(subdivide_linear(colors).vertices.back() == vec4{0.5f});
}

TEST_CASE("geometry subdivide: non-manifold and degenerate meshes stay finite") {
  // Three sheets along one edge.
  quad_mesh<vec3> fan{{{0, 1, 3, 2}, {0, 1, 5, 4}, {0, 1, 7, 6}},
                      {{0, 0, 0},
                       {1, 0, 0},
                       {0, 1, 0},
                       {1, 1, 0},
                       {0, -1, 1},
                       {1, -1, 1},
                       {0, -1, -1},
                       {1, -1, -1}}};
  auto mesh = subdivide_catmullclark(fan, false);
  CHECK(mesh.quads.size() == 12);
  CHECK(mesh.vertices[8] == vec3{0.5f, 0, 0});  // the shared edge is sharp
  // Collapsed sides, faces used twice, a face turned over, vertices of no face.
  quad_mesh<vec3> bad{
      {{0, 0, 1, 2}, {0, 1, 0, 1}, {3, 3, 3, 3}, {0, 1, 2, 3}, {0, 1, 2, 3}, {3, 2, 1, 0}},
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {7, 7, 7}}};
  for (int level = 0; level < 3; level++) {
    bad = subdivide_catmullclark(bad, false);
    for (const auto& v : bad.vertices) CHECK(is_finite(v));
    for (const auto& q : bad.quads)
      for (int k = 0; k < 4; k++) {
        CHECK(q[k] >= 0);
        CHECK(q[k] < static_cast<int>(bad.vertices.size()));
      }
  }
  CHECK(bad.vertices[4] == vec3{7, 7, 7});
}

TEST_CASE("geometry subdivide: empty meshes and bad indices") {
  CHECK(subdivide_catmullclark(quad_mesh<vec3>{}, false).quads.empty());
  quad_mesh<vec3> bad{{{0, 1, 2, 3}}, {{0, 0, 0}}};
  CHECK_THROWS_AS(subdivide_catmullclark(bad, false), std::invalid_argument);
  CHECK_THROWS_AS(subdivide_linear(bad), std::invalid_argument);
  bad.quads = {{-1, 0, 0, 0}};
  CHECK_THROWS_AS(subdivide_linear(bad), std::invalid_argument);
}
