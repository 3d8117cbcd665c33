// All shape formats: endings, round trips, cleaning, files that are broken in
// any way, and well-known meshes.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <set>
#include <string>

#include "shape_files.h"

namespace {

using namespace wisp;
using namespace wisp::test;
namespace fs = std::filesystem;

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

shape_data round_trip(const shape_data& shape, const std::string& name) {
  const scratch_folder folder;
  warning_list warnings;
  save_shape(folder.path / name, shape, warnings);
  shape_data again = load_shape(folder.path / name, warnings);
  CHECK_MESSAGE(warnings.empty(), (warnings.empty() ? "" : warnings[0]));
  // nothing but the file is left
  CHECK(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()) == 1);
  return again;
}

// Saving does not check what is finite, so that these files can be made.
shape_data reload(const shape_data& shape, warning_list& warnings) {
  const scratch_folder folder;
  warning_list none;
  save_shape(folder.path / "a.ply", shape, none);
  return load_shape(folder.path / "a.ply", warnings);
}

std::string save_error(const std::string& name, const shape_data& shape) {
  const scratch_folder folder;
  warning_list warnings;
  try {
    save_shape(folder.path / name, shape, warnings);
  } catch (const file_error& error) {
    CHECK(fs::is_empty(folder.path));
    return error.reason;
  }
  return "saved";
}

std::string saved_bytes(const shape_data& shape, const std::string& name) {
  const scratch_folder folder;
  warning_list warnings;
  save_shape(folder.path / name, shape, warnings);
  return get_file(folder.path / name);
}

shape_data faces_and_strands() {
  shape_data shape = two_strands(curve_basis::linear);
  shape.triangles = {{0, 4, 8}};
  shape.points = {2};
  return shape;
}

}  // namespace

TEST_CASE("shape_io: endings, whatever their case") {
  for (const char* name : {"a.ply", "a.OBJ", "a.Stl", "a.hair", "a.tfx", "a.tfxmesh", "a.pbrt"}) {
    CHECK(can_load_shape(name));
    CHECK(can_save_shape(name) == (std::string(name) != "a.tfxmesh"));
  }
  for (const char* name : {"ply", "a.gltf", "a.ply.gz", "a", ""}) {
    CHECK_FALSE(can_load_shape(name));
    CHECK_FALSE(can_save_shape(name));
  }
  warning_list warnings;
  CHECK_THROWS_AS(load_shape("a.xyz", warnings), file_error);
  CHECK_THROWS_AS(load_shape("no/such/file.ply", warnings), file_error);
  CHECK(contains(save_error("a.xyz", full_mesh()), "ending"));
  CHECK(contains(save_error("no/such/folder/a.ply", full_mesh()), "there is no folder"));
  const scratch_folder folder;
  fs::create_directory(folder.path / "a.ply");
  CHECK_THROWS_AS(load_shape(folder.path / "a.ply", warnings), file_error);
  CHECK_THROWS_AS(save_shape(folder.path / "a.ply", full_mesh(), warnings), file_error);
}

TEST_CASE("shape_io: a mesh comes back from .ply and .obj") {
  const shape_data shape = full_mesh();
  for (const char* name : {"a.ply", "a.obj"}) {
    const shape_data again = round_trip(shape, name);
    CHECK(again.quads == shape.quads);
    CHECK(again.positions == shape.positions);
    CHECK(again.normals == shape.normals);
    CHECK(again.texcoords == shape.texcoords);
  }
  shape_data coloured = full_mesh();
  coloured.colors.assign(5, vec4{0.1f, 0.2f, 0.3f, 1});
  coloured.colors[2] = {7, 0, 1e-9f, 1};
  CHECK(round_trip(coloured, "a.ply").colors == coloured.colors);
  CHECK(round_trip(coloured, "a.obj").colors == coloured.colors);
  coloured.tangents.assign(5, vec4{1, 0, 0, -1});
  coloured.colors[0].w = 0.5f;
  CHECK(round_trip(coloured, "a.ply").tangents == coloured.tangents);
  CHECK(round_trip(coloured, "a.ply").colors == coloured.colors);
}

TEST_CASE("shape_io: triangles come back from .stl") {
  shape_data shape = full_mesh();
  shape.normals.clear();
  shape.texcoords.clear();
  const shape_data again = round_trip(shape, "a.stl");
  CHECK(again.positions == shape.positions);
  CHECK(again.triangles == std::vector<ivec3>{{0, 1, 2}, {2, 3, 0}, {3, 2, 4}});
  CHECK(contains(save_error("a.stl", faces_and_strands()), "STL holds faces"));
}

TEST_CASE("shape_io: strands of every basis come back from .ply and .obj") {
  for (curve_basis basis :
       {curve_basis::linear, curve_basis::bspline, curve_basis::catmull_rom, curve_basis::bezier}) {
    shape_data shape = two_strands(basis);
    if (basis == curve_basis::bezier) {
      shape.strands = {0, 4, 8};
      shape.positions.pop_back();
      shape.radius.pop_back();
    }
    shape.profile = curve_profile::round;
    const shape_data again = round_trip(shape, "a.ply");
    CHECK(again.strands == shape.strands);
    CHECK(again.basis == basis);
    CHECK(again.profile == curve_profile::round);
    CHECK(again.positions == shape.positions);
    CHECK(again.radius == shape.radius);
    shape.radius.clear();
    const shape_data text = round_trip(shape, "a.obj");
    CHECK(text.strands == shape.strands);
    CHECK(text.basis == basis);
    CHECK(text.positions == shape.positions);
  }
}

TEST_CASE("shape_io: faces, strands and points together") {
  const shape_data shape = faces_and_strands();
  const shape_data again = round_trip(shape, "a.ply");
  CHECK(again.triangles == shape.triangles);
  CHECK(again.strands == shape.strands);
  CHECK(again.points == shape.points);
  CHECK(again.radius == shape.radius);
}

TEST_CASE("shape_io: strand formats are dispatched") {
  for (const char* name : {"a.hair", "a.pbrt"}) {
    const scratch_folder folder;
    warning_list warnings;
    save_shape(folder.path / name, two_strands(curve_basis::linear), warnings);
    CHECK(strand_count(load_shape(folder.path / name, warnings)) >= 2);
    CHECK(save_error(name, full_mesh()) != "saved");
  }
}

TEST_CASE("shape_io: a file is replaced as a whole or stays") {
  const scratch_folder folder;
  const fs::path path = folder.path / "a.ply";
  put_file(path, "old");
  warning_list warnings;
  shape_data wrong = full_mesh();
  wrong.quads.push_back({0, 1, 2, 5});
  CHECK_THROWS_AS(save_shape(path, wrong, warnings), file_error);
  CHECK(get_file(path) == "old");
  wrong = full_mesh();
  wrong.normals.pop_back();
  CHECK_THROWS_AS(save_shape(path, wrong, warnings), file_error);
  CHECK_THROWS_AS(save_shape(path, shape_data{}, warnings), file_error);
  CHECK(get_file(path) == "old");
  fs::create_symlink("a.ply", folder.path / "link.ply");
  put_file(folder.path / "a.ply.0.part", "somebody else's");
  save_shape(folder.path / "link.ply", full_mesh(), warnings);
  CHECK(fs::is_symlink(folder.path / "link.ply"));
  CHECK(load_shape(path, warnings).quads.size() == 2);
  CHECK(get_file(folder.path / "a.ply.0.part") == "somebody else's");
}

TEST_CASE("shape_io: elements with vertices that are not finite go, with a warning") {
  shape_data shape = full_mesh();
  shape.positions[4].y = not_a_number;
  shape.normals[1] = {not_a_number, 0, 0};
  warning_list warnings;
  const shape_data again = reload(shape, warnings);
  CHECK(again.quads == std::vector<ivec4>{{0, 1, 2, 3}});
  CHECK(again.positions.size() == 4);
  CHECK(again.normals[1] == vec3{0, 0, 0});
  REQUIRE(warnings.size() == 2);
  CHECK(contains(warnings[0], "1 quad left out"));
  CHECK(contains(warnings[1], "1 vertex with a normal"));
  shape.positions[1].x = infinity;
  CHECK_THROWS_AS(reload(shape, warnings), file_error);
}

TEST_CASE("shape_io: strands lose vertices that are not finite, or go") {
  shape_data shape = two_strands(curve_basis::linear);
  shape.positions[1].x = not_a_number;  // of 0..3: three are left
  shape.triangles = {{4, 5, 6}};
  warning_list warnings;
  shape_data again = reload(shape, warnings);
  CHECK(again.strands == std::vector<uint32_t>{0, 3, 8});
  REQUIRE(again.triangles.size() == 1);
  CHECK(again.triangles[0] == ivec3{3, 4, 5});
  CHECK(again.positions[3] == shape.positions[4]);
  REQUIRE(warnings.size() == 1);
  CHECK(contains(warnings[0], "1 strand cut short"));

  shape.basis = curve_basis::bspline;  // three do not make a B-spline
  warnings.clear();
  again = reload(shape, warnings);
  CHECK(again.strands == std::vector<uint32_t>{0, 5});
  REQUIRE(warnings.size() == 1);
  CHECK(contains(warnings[0], "1 strand left out for vertices that are not finite"));
  CHECK(contains(warnings[0], "strand 0"));
}

TEST_CASE("shape_io: strands without length go, but not the vertices that faces use") {
  shape_data shape = two_strands(curve_basis::linear);
  for (std::size_t i = 0; i < 4; ++i) shape.positions[i] = {1, 2, 3};
  shape.triangles = {{0, 4, 8}};
  warning_list warnings;
  const shape_data again = reload(shape, warnings);
  CHECK(again.strands == std::vector<uint32_t>{0, 5});
  REQUIRE(again.triangles.size() == 1);
  CHECK(again.positions[static_cast<std::size_t>(again.triangles[0].x)] == vec3{1, 2, 3});
  CHECK(again.positions.size() == 6);
  REQUIRE(warnings.size() == 1);
  CHECK(contains(warnings[0], "no length"));
}

TEST_CASE("shape_io: radii below zero or not finite become the default") {
  shape_data shape = two_strands(curve_basis::linear);
  shape.radius[3] = -1;
  shape.radius[5] = not_a_number;
  warning_list warnings;
  const shape_data again = reload(shape, warnings);
  CHECK(again.radius[3] == 0.001f);
  CHECK(again.radius[5] == 0.001f);
  CHECK(again.radius[4] == shape.radius[4]);
  REQUIRE(warnings.size() == 1);
  CHECK(contains(warnings[0], "2 vertices with a radius"));
  CHECK(contains(warnings[0], "vertex 3"));
}

// Every file cut at every byte, and with every byte changed, must load or throw
// file_error: nothing else, no crash, and what loads is sound.
TEST_CASE("shape_io: broken files throw or load") {
  const scratch_folder folder;
  std::size_t loaded = 0, refused = 0;
  auto attempt = [&](const std::string& name, const std::string& bytes) {
    put_file(folder.path / name, bytes);
    warning_list warnings;
    try {
      const shape_data shape = load_shape(folder.path / name, warnings);
      loaded++;
      for (const vec3& p : shape.positions) REQUIRE(is_finite(p));
      REQUIRE((shape.strands.empty() || shape.strands.back() <= shape.positions.size()));
    } catch (const file_error&) {
      refused++;
    }
  };
  shape_data mesh = full_mesh();
  mesh.colors.assign(5, vec4{1, 1, 1, 1});
  shape_data strands = faces_and_strands();
  std::mt19937 random(1);
  for (const char* name : {"a.ply", "a.obj", "a.stl", "b.ply", "b.obj"}) {
    const std::string bytes = saved_bytes(name[0] == 'a' ? mesh : strands, name);
    for (std::size_t n = 0; n < bytes.size(); ++n) attempt(name, bytes.substr(0, n));
    for (std::size_t n = 0; n < bytes.size(); ++n) {
      std::string changed = bytes;
      changed[n] = static_cast<char>(changed[n] ^ (1u << (random() % 8)));
      attempt(name, changed);
      changed[n] = static_cast<char>(random());
      attempt(name, changed);
      changed.insert(n, 1, bytes[random() % bytes.size()]);
      attempt(name, changed);
    }
  }
  CHECK(loaded > 100);
  CHECK(refused > 1000);
}

TEST_CASE("shape_io: well-known meshes") {
  const char* data = std::getenv("WISP_TEST_DATA");
  if (!data) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  struct expectation {
    const char* file;
    std::size_t vertices;  // that faces use, at different places
    std::size_t triangles;
  };
  // Counted by another program.
  constexpr std::array<expectation, 16> expected = {{
      {"meshes/armadillo.obj", 43243, 86482},
      {"meshes/bunny_closed.obj", 34839, 69674},
      {"meshes/stanford-bunny.obj", 34834, 69451},
      {"meshes/cube_with_fold.ply", 26, 48},
      {"meshes/degenerated.obj", 7, 24},
      {"meshes/sliver_tet.ply", 0, 4},
      {"meshes/soup.stl", 300, 100},
      {"meshes/cycloidal.ply", 21384, 43368},
      {"meshes/rabbit.obj", 644, 1252},
      {"meshes/joined_tetrahedra.obj", 5, 8},
      {"meshes/quadknot.obj", 1440, 2880},
      {"hair/sintel/sintel.obj", 3046, 5952},
      {"hair/lee-perry-smith/LeePerrySmith.obj", 8839, 17684},
      {"yocto/features1/shapes/bunny.ply", 0, 144046},
      {"yocto/shapes1/shapes/sphere.ply", 0, 12288},
      {"yocto/shapes1/shapes/uvcylinder.ply", 0, 6144},
  }};
  for (const expectation& e : expected) {
    CAPTURE(std::string(e.file));
    warning_list warnings;
    const shape_data shape = load_shape(fs::path(data) / e.file, warnings);
    CHECK(warnings.empty());
    std::size_t triangles = shape.triangles.size();
    std::set<std::array<float, 3>> places;
    auto use = [&](int v) {
      const vec3& p = shape.positions[static_cast<std::size_t>(v)];
      places.insert({p.x, p.y, p.z});
    };
    for (const ivec3& t : shape.triangles) {
      for (int c = 0; c < 3; ++c) use(t[c]);
    }
    for (const ivec4& q : shape.quads) {
      triangles += q.z == q.w ? 1 : 2;
      for (int c = 0; c < 4; ++c) use(q[c]);
    }
    if (e.triangles > 0) CHECK(triangles == e.triangles);
    if (e.vertices > 0) CHECK(places.size() == e.vertices);
  }
}
