// OBJ and STL.

#include <string>

#include "shape_files.h"

namespace {

using namespace wisp;
using namespace wisp::test;

const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

// Records of a binary STL file.
std::string binary_stl(const std::string& header, const std::vector<std::array<vec3, 3>>& faces) {
  std::string s = header;
  s.resize(80, ' ');
  s += raw(static_cast<uint32_t>(faces.size()));
  for (const auto& face : faces) {
    s += std::string(12, '\0');
    for (const vec3& p : face) s += raw(p.x) + raw(p.y) + raw(p.z);
    s += std::string(2, '\0');
  }
  return s;
}

const std::vector<std::array<vec3, 3>> two_faces = {{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}},
                                                    {{{1, 1, 0}, {0, 1, 0}, {-0.0f, 0, 0}}}};

}  // namespace

TEST_CASE("obj: vertices without attributes stay as they are") {
  warning_list warnings;
  const shape_data shape = load_bytes("a.obj",
                                      "# comment\nmtllib a.mtl\no thing\n" + square +
                                          "v 9 9 9\ng all\nusemtl red\ns off\n"
                                          "f 1 2 3 # the first\nf -5 -3 -2\n",
                                      warnings);
  CHECK(warnings.empty());
  CHECK(shape.name == "a");
  CHECK(shape.triangles == std::vector<ivec3>{{0, 1, 2}, {0, 2, 3}});
  CHECK(shape.positions.size() == 5);
  CHECK(shape.normals.empty());
  CHECK(shape.texcoords.empty());
}

TEST_CASE("obj: corners with other attributes become other vertices") {
  warning_list warnings;
  const shape_data shape = load_bytes("a.obj",
                                      square +
                                          "vt 0 0\nvt 1 0.25\nvn 0 0 1\nvn 0 1 0\n"
                                          "f 1/1/1 2/2/1 3/1/1 4/1/1\r\nf 1/1/1 2/1/2 3/1/1\r\n",
                                      warnings);
  CHECK(shape.quads == std::vector<ivec4>{{0, 1, 2, 3}, {0, 4, 2, 2}});
  REQUIRE(shape.positions.size() == 5);
  CHECK(shape.positions[4] == vec3{1, 0, 0});
  CHECK(shape.texcoords[1] == vec2{1, 0.75f});
  CHECK(shape.normals[4] == vec3{0, 1, 0});
}

TEST_CASE("obj: normals that some corners lack follow from the faces") {
  warning_list warnings;
  const shape_data shape =
      load_bytes("a.obj", square + "vn 1 0 0\nf 1//1 2//1 3//1\nf 1 3 4\n", warnings);
  REQUIRE(shape.triangles.size() == 2);
  const auto last = static_cast<std::size_t>(shape.triangles[1].z);
  CHECK(shape.normals[last] == vec3{0, 0, 1});
}

TEST_CASE("obj: long lines, polygons, lines, points and colours") {
  warning_list warnings;
  const shape_data shape = load_bytes(
      "a.obj",
      "v 0 0 0 1 0.5 0\nv 1 0 0\nv 1 1 0 0 0 1\nv 0 1 0\nv -1 \\\n0.5 0\nf 1 2 \\\r\n3 4 \\\n5\n"
      "l 1 2 3\nl 4 5\nl 5 1\np 1 2 \\\n 3",
      warnings);
  CHECK(shape.triangles.size() == 3);
  CHECK(shape.strands == std::vector<uint32_t>{0, 3, 6});
  CHECK(shape.points.size() == 3);
  CHECK(shape.colors[0] == vec4{1, 0.5f, 0, 1});
  CHECK(shape.colors[1] == vec4{1, 1, 1, 1});
  REQUIRE(shape.positions.size() == 11);  // strands first, then what faces and points use
  CHECK(shape.positions[4] == vec3{-1, 0.5f, 0});
}

TEST_CASE("obj: line endings of every system") {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    std::string text = square + "f 1 2 3 4\n";
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos;) {
      text.replace(at, 1, end);
      at += std::strlen(end);
    }
    warning_list warnings;
    CHECK(load_bytes("a.obj", text, warnings).quads.size() == 1);
  }
}

TEST_CASE("obj: subdivs keep face-varying indices") {
  warning_list warnings;
  const subdiv_data subdiv = load_subdiv_bytes(
      "a.obj",
      square + "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/1/1\nf 4/3/1 2/2/1 1/1/1\n",
      warnings);
  CHECK(warnings.empty());
  CHECK(subdiv.name == "a");
  CHECK(subdiv.quadspos == std::vector<ivec4>{{0, 1, 2, 3}, {3, 1, 0, 0}});
  CHECK(subdiv.quadstexcoord == std::vector<ivec4>{{0, 1, 2, 0}, {2, 1, 0, 0}});
  CHECK(subdiv.quadsnorm == std::vector<ivec4>{{0, 0, 0, 0}, {0, 0, 0, 0}});
  CHECK(subdiv.texcoords[2] == vec2{1, 0});
  const subdiv_data partial =
      load_subdiv_bytes("a.obj", square + "vt 0 0\nf 1/1 2/1 3/1\nf 1 3 4\n", warnings);
  CHECK(partial.quadstexcoord.empty());
  CHECK(warnings.size() == 1);
  CHECK_THROWS_AS(load_subdiv_bytes("a.stl", binary_stl("", two_faces), warnings), file_error);
  CHECK_THROWS_AS(load_subdiv_bytes("a.obj", square, warnings), file_error);
}

TEST_CASE("obj: what is wrong is said with its line") {
  CHECK(contains(load_error("a.obj", square + "f 1 2 5\n"),
                 "line 5: refers to vertex 5, but there are 4"));
  CHECK(contains(load_error("a.obj", square + "\n\nf 1 2 0\n"), "line 7: vertex 0"));
  CHECK(contains(load_error("a.obj", square + "f -1 -2 -5\n"), "line 5"));
  CHECK(contains(load_error("a.obj", square + "f 1/1 2/1 3/1\n"), "texture coordinate 1"));
  CHECK(contains(load_error("a.obj", square + "f 1//9 2//9 3//9\n"), "normal 9"));
  CHECK(
      contains(load_error("a.obj", square + "f 1 2 99999999999999999999\n"), "expected the index"));
  CHECK(contains(load_error("a.obj", square + "f 1 2 9999999999\n"), "line 5"));
  CHECK(contains(load_error("a.obj", square + "f 1/2/3/4 2 3\n"), "at most three indices"));
  CHECK(contains(load_error("a.obj", square + "f a b c\n"), "expected the index of a vertex"));
  CHECK(contains(load_error("a.obj", square + "f\n"), "no vertices"));
  CHECK(contains(load_error("a.obj", "v 0 0\n"), "line 1: a vertex (v) needs three"));
  CHECK(contains(load_error("a.obj", "v 0 zero 0\n"), "expected a number, not \"zero\""));
  CHECK(contains(load_error("a.obj", "# nothing\n"), "holds no faces"));
  CHECK(contains(load_error("a.obj", std::string("v 0 0 0\n\0", 9)), "no text"));
}

TEST_CASE("stl: vertices at one place are one") {
  const std::string text =
      "solid a b c\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n"
      "   vertex 1 1 0\n  endloop\n endfacet\n FACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 1 1 0\n"
      "vertex 0 1 0\nvertex -0 0 0\nendloop\nendfacet\nendsolid a b c\n";
  for (const std::string& bytes :
       {text, binary_stl("", two_faces), binary_stl("solid but binary", two_faces)}) {
    warning_list warnings;
    const shape_data shape = load_bytes("a.stl", bytes, warnings);
    CHECK(warnings.empty());
    CHECK(shape.positions.size() == 4);
    CHECK(shape.triangles == std::vector<ivec3>{{0, 1, 2}, {2, 3, 0}});
  }
}

TEST_CASE("stl: many vertices weld, and bytes after the last triangle are told of") {
  std::vector<std::array<vec3, 3>> grid;
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 60; ++x) {
      const vec3 p{x, y, 0}, dx{1, 0, 0}, dy{0, 1, 0};
      grid.push_back({p, p + dx, p + dy});
      grid.push_back({p + dx, p + dx + dy, p + dy});
    }
  }
  warning_list warnings;
  const shape_data shape = load_bytes("a.STL", binary_stl("", grid) + "tail", warnings);
  CHECK(shape.positions.size() == 61 * 61);
  CHECK(shape.triangles.size() == 7200);
  REQUIRE(warnings.size() == 1);
  CHECK(contains(warnings[0], "4 bytes after the last triangle"));
}

TEST_CASE("stl: what is wrong is said") {
  const std::string whole = binary_stl("", two_faces);
  CHECK(contains(load_error("a.stl", whole.substr(0, 83)), "83 bytes long"));
  CHECK(contains(load_error("a.stl", whole.substr(0, whole.size() - 1)),
                 "announces 2 triangles, but there are bytes for 1"));
  CHECK(contains(load_error("a.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n"),
                 "expected a number"));
  CHECK(contains(load_error("a.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"),
                 "cut short"));
  CHECK(contains(load_error("a.stl", "solid\nvertex 0 0 0\n"), "line 2: a vertex must be within"));
  CHECK(contains(load_error("a.stl", "solid\nbox 0 0 0\n"), "\"box\" is no word"));
  CHECK(contains(load_error("a.stl", "solid empty\nendsolid empty\n"), "holds no faces"));
}
