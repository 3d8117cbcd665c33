// PLY: its three encodings, the names in use, lines, edges, strips, and files
// that are wrong.

#include <string>

#include "shape_files.h"

namespace {

using namespace wisp;
using namespace wisp::test;

const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
const std::string indices = "property list uchar int vertex_indices\n";

std::string ascii_header(const std::string& rest) { return "ply\nformat ascii 1.0\n" + rest; }

// n vertices (i, i^2, 0) and more elements.
std::string ascii_ply(int n, const std::string& elements, const std::string& rows) {
  std::string text =
      ascii_header("element vertex " + std::to_string(n) + "\n" + xyz + elements + "end_header\n");
  for (int i = 0; i < n; ++i) {
    text += std::to_string(i) + " " + std::to_string(i * i) + " 0\n";
  }
  return text + rows;
}

// The same content in binary, with properties of many types and things to skip.
std::string mixed_binary(bool big) {
  std::string s = "ply\r\nformat binary_" + std::string(big ? "big" : "little") +
                  "_endian 1.0\r\ncomment a comment\r\nobj_info some info\r\n"
                  "element camera 1\r\nproperty float view\r\nproperty list uchar short ids\r\n"
                  "element vertex 4\r\nproperty double x\r\nproperty float y\r\n"
                  "property short z\r\nproperty uchar red\r\nproperty uchar green\r\n"
                  "property uchar blue\r\nproperty ushort alpha\r\n"
                  "property list uint double junk\r\nproperty float s\r\nproperty float t\r\n"
                  "property float radius\r\n"
                  "element face 2\r\nproperty uchar material\r\n"
                  "property list ushort uint vertex_index\r\nend_header\r\n";
  s += raw(1.0f, big) + raw(uint8_t{2}) + raw(int16_t{7}, big) + raw(int16_t{8}, big);
  for (int i = 0; i < 4; ++i) {
    const auto f = static_cast<float>(i);
    s += raw(static_cast<double>(f), big) + raw(f * 0.5f, big) + raw(static_cast<int16_t>(-i), big);
    s += raw(uint8_t{255}) + raw(uint8_t{0}) + raw(uint8_t{51}) + raw(uint16_t{65535}, big);
    s += raw(uint32_t{1}, big) + raw(1e300, big);
    s += raw(0.25f, big) + raw(0.75f, big) + raw(0.125f, big);
  }
  s += raw(uint8_t{9}) + raw(uint16_t{3}, big);
  for (uint32_t v : {0u, 1u, 2u}) s += raw(v, big);
  s += raw(uint8_t{9}) + raw(uint16_t{3}, big);
  for (uint32_t v : {0u, 2u, 3u}) s += raw(v, big);
  return s;
}

}  // namespace

TEST_CASE("ply: binary of both endiannesses with types of all kinds") {
  for (bool big : {false, true}) {
    warning_list warnings;
    const shape_data shape = load_bytes("a.ply", mixed_binary(big), warnings);
    CHECK(warnings.empty());
    CHECK(shape.triangles == std::vector<ivec3>{{0, 1, 2}, {0, 2, 3}});
    CHECK(shape.quads.empty());
    REQUIRE(shape.positions.size() == 4);
    CHECK(shape.positions[3] == vec3{3, 1.5f, -3});
    CHECK(shape.colors[1].x == doctest::Approx(1));
    CHECK(shape.colors[1].y == 0);
    CHECK(shape.colors[1].z == doctest::Approx(0.2));
    CHECK(shape.colors[1].w == doctest::Approx(1));
    CHECK(shape.texcoords[0] == vec2{0.25f, 0.25f});
    CHECK(shape.radius[2] == 0.125f);
    warning_list none;
    const shape_data unflipped = load_bytes("a.PLY", mixed_binary(big), none, {.flip_v = false});
    CHECK(unflipped.texcoords[0] == vec2{0.25f, 0.75f});
  }
}

TEST_CASE("ply: polygons become triangles, or quads where there is one") {
  warning_list warnings;
  const shape_data fan = load_bytes(
      "a.ply", ascii_ply(6, "element face 3\n" + indices, "5 0 1 2 3 4\n3 5 4 3\n2 0 1\n"),
      warnings);
  CHECK(fan.triangles == std::vector<ivec3>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {5, 4, 3}});
  REQUIRE(warnings.size() == 1);
  CHECK(contains(warnings[0], "1 faces with fewer than three"));
  const shape_data mixed = load_bytes(
      "a.ply", ascii_ply(6, "element face 2\n" + indices, "3 5 4 3\n4 0 1 2 3\n"), warnings);
  CHECK(mixed.triangles.empty());
  CHECK(mixed.quads == std::vector<ivec4>{{5, 4, 3, 3}, {0, 1, 2, 3}});
}

TEST_CASE("ply: triangle strips turn every other triangle") {
  warning_list warnings;
  const shape_data shape =
      load_bytes("a.ply",
                 ascii_ply(6, "element tristrips 1\nproperty list int int vertex_indices\n",
                           "9 0 1 2 3 -1 2 4 4 5\n"),
                 warnings);
  // 2 4 4 and 4 4 5 have no area
  CHECK(shape.triangles == std::vector<ivec3>{{0, 1, 2}, {2, 1, 3}});
}

TEST_CASE("ply: lines become strands") {
  warning_list warnings;
  SUBCASE("segments in a chain, as Yocto/GL writes them") {
    const shape_data shape = load_bytes(
        "a.ply", ascii_ply(5, "element line 3\n" + indices, "2 0 1\n2 1 2\n2 3 4\n"), warnings);
    CHECK(shape.strands == std::vector<uint32_t>{0, 3, 5});
    CHECK(shape.positions[4] == vec3{4, 16, 0});
  }
  SUBCASE("whole lines that share vertices repeat them") {
    const shape_data shape =
        load_bytes("a.ply",
                   ascii_ply(5, "element line 2\n" + indices + "element face 1\n" + indices,
                             "3 4 1 2\n3 2 0 1\n3 0 1 3\n"),
                   warnings);
    CHECK(shape.strands == std::vector<uint32_t>{0, 3, 6});
    REQUIRE(shape.positions.size() == 9);
    CHECK(shape.positions[0].x == 4);
    CHECK(shape.positions[3].x == 2);
    REQUIRE(shape.triangles.size() == 1);
    for (int c = 0; c < 3; ++c) {
      const float expected[] = {0, 1, 3};
      CHECK(shape.positions[static_cast<std::size_t>(shape.triangles[0][c])].x == expected[c]);
    }
  }
  SUBCASE("loose edges in any order and direction, with a branch and a ring") {
    // 0-1-2-3 with a branch 2-4, and the ring 5-6-7
    const shape_data shape =
        load_bytes("a.ply",
                   ascii_ply(8, "element edge 7\nproperty int vertex1\nproperty int vertex2\n",
                             "2 1\n3 2\n0 1\n2 4\n6 5\n6 7\n7 5\n"),
                   warnings);
    CHECK(shape.strands == std::vector<uint32_t>{0, 3, 5, 7, 11});
    const float expected[] = {0, 1, 2, 2, 3, 2, 4, 5, 6, 7, 5};
    REQUIRE(shape.positions.size() == 11);
    for (std::size_t i = 0; i < 11; ++i) CHECK(shape.positions[i].x == expected[i]);
  }
  SUBCASE("edges that are sides of faces are no hair") {
    const shape_data shape =
        load_bytes("a.ply",
                   ascii_ply(4,
                             "element face 1\n" + indices +
                                 "element edge 4\nproperty int vertex1\nproperty int vertex2\n",
                             "3 0 1 2\n0 1\n1 2\n0 2\n2 3\n"),
                   warnings);
    CHECK(strand_count(shape) == 1);
    CHECK(shape.triangles.size() == 1);
  }
  SUBCASE("the comments of wisp tell the basis") {
    std::string text = ascii_ply(4, "element line 1\n" + indices, "4 0 1 2 3\n");
    text.insert(text.find("element vertex"),
                "comment wisp basis bspline\ncomment wisp profile round\n");
    const shape_data shape = load_bytes("a.ply", text, warnings);
    CHECK(shape.basis == curve_basis::bspline);
    CHECK(shape.profile == curve_profile::round);
  }
  CHECK(warnings.empty());
}

TEST_CASE("ply: points, and vertices alone are points") {
  warning_list warnings;
  CHECK(load_bytes("a.ply", ascii_ply(3, "element point 2\n" + indices, "1 2\n1 0\n"), warnings)
            .points == std::vector<int>{2, 0});
  CHECK(load_bytes("a.ply", ascii_ply(3, "", ""), warnings).points == std::vector<int>{0, 1, 2});
}

TEST_CASE("ply: subdivs keep quads and share indices") {
  warning_list warnings;
  const std::string text =
      ascii_header("element vertex 5\n" + xyz +
                   "property float u\nproperty float v\nelement face 2\n" + indices +
                   "end_header\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n0 2 0 0 1\n"
                   "4 0 1 2 3\n3 3 2 4\n");
  const subdiv_data subdiv = load_subdiv_bytes("a.ply", text, warnings);
  CHECK(subdiv.quadspos == std::vector<ivec4>{{0, 1, 2, 3}, {3, 2, 4, 4}});
  CHECK(subdiv.quadstexcoord == subdiv.quadspos);
  CHECK(subdiv.quadsnorm.empty());
  CHECK(subdiv.texcoords[0] == vec2{0, 1});
}

TEST_CASE("ply: what is wrong is said with its place") {
  const std::string face = "element face 1\n" + indices;
  CHECK(contains(load_error("a.ply", ""), "is empty"));
  CHECK(contains(load_error("a.ply", "plywood"), "no PLY file"));
  CHECK(contains(load_error("a.ply", "ply\nformat ascii 1.0\n"), "no end_header"));
  CHECK(contains(load_error("a.ply", "ply\nformat text 1.0\n"), "line 2: the format must be"));
  CHECK(contains(load_error("a.ply", "ply\nend_header\n"), "line 2: the header ends without"));
  CHECK(contains(load_error("a.ply", ascii_header("element vertex 1\nproperty half x\n")),
                 "line 4: \"half\" is no type"));
  CHECK(contains(load_error("a.ply", ascii_header("element vertex -1\n")), "whole number"));
  CHECK(contains(load_error("a.ply", ascii_header("element vertex 0\n" + xyz + "end_header\n")),
                 "holds no faces, points or strands"));
  CHECK(contains(
      load_error("a.ply", ascii_header("element vertex 1\nproperty float x\nend_header\n1\n")),
      "needs the properties x, y and z"));
  CHECK(contains(load_error("a.ply", ascii_ply(3, face, "3 0 1 3\n")),
                 "face 0: refers to vertex 3, but there are 3"));
  CHECK(contains(load_error("a.ply", ascii_ply(3, face, "3 0 1 -1\n")), "refers to vertex -1"));
  CHECK(contains(load_error("a.ply", ascii_ply(3, face, "3 0 1 0.5\n")), "no whole number"));
  CHECK(contains(load_error("a.ply", ascii_ply(3, face, "3 0 1 99999999999999999999\n")),
                 "refers to"));
  CHECK(contains(load_error("a.ply", ascii_ply(3, face, "3 0 1\n")), "cut short"));
  CHECK(contains(load_error("a.ply", ascii_ply(3, face, "3 0 one 2\n")),
                 "line 13: expected a number, not \"one\""));
  CHECK(contains(load_error("a.ply", ascii_ply(3, face, "-3 0 1 2\n")), "whole number >= 0"));
}

TEST_CASE("ply: counts beyond the file are refused before anything is allocated") {
  for (const char* count : {"1000000000000", "18446744073709551615", "2000000000"}) {
    for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
      const std::string head = std::string("ply\nformat ") + format + " 1.0\nelement vertex ";
      CHECK(load_error("a.ply", head + count + "\n" + xyz + "end_header\n0 0 0\n") != "loaded");
      CHECK(load_error("a.ply", head + "1\n" + xyz + "element face " + count + "\n" + indices +
                                    "end_header\n0 0 0 0000000000000") != "loaded");
    }
  }
  std::string list = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + xyz +
                     "element face 1\nproperty list uint int vertex_indices\nend_header\n" +
                     std::string(12, '\0') + raw(uint32_t{0xffffffff}) + std::string(64, '\0');
  CHECK(contains(load_error("a.ply", list), "a list of 4294967295 values"));
}
