// Strand formats: .hair, .tfx, .tfxmesh and the curves of .pbrt.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "wisp/core/rng.h"
#include "wisp/scene/io.h"

namespace {

using namespace wisp;
namespace fs = std::filesystem;

// A folder of this test's own that goes away with it.
struct temporary_folder {
  fs::path path;
  temporary_folder() {
    std::random_device device;
    path = fs::temp_directory_path() /
           ("wisp_hair_io_" + std::to_string(device()) + "_" + std::to_string(device()));
    fs::create_directories(path);
  }
  temporary_folder(const temporary_folder&) = delete;
  temporary_folder& operator=(const temporary_folder&) = delete;
  ~temporary_folder() {
    std::error_code error;
    fs::remove_all(path, error);
  }
};

void write_file(const fs::path& path, const std::string& content) {
  std::ofstream stream(path, std::ios::binary | std::ios::trunc);
  stream.write(content.data(), static_cast<std::streamsize>(content.size()));
  REQUIRE(stream.good());
}
std::string read_file(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

shape_data load_text(const std::string& content, const std::string& name, warning_list& warnings) {
  temporary_folder folder;
  write_file(folder.path / name, content);
  return load_shape(folder.path / name, warnings);
}
shape_data load_text(const std::string& content, const std::string& name) {
  warning_list warnings;
  return load_text(content, name, warnings);
}
shape_data save_and_load(const shape_data& shape, const std::string& name) {
  temporary_folder folder;
  warning_list warnings;
  save_shape(folder.path / name, shape, warnings);
  return load_shape(folder.path / name, warnings);
}
std::string saved(const shape_data& shape, const std::string& name) {
  temporary_folder folder;
  warning_list warnings;
  save_shape(folder.path / name, shape, warnings);
  return read_file(folder.path / name);
}

bool mentions(const warning_list& warnings, const std::string& text) {
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

void put(std::string& out, uint32_t v) {
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<char>((v >> (8 * i)) & 0xff));
}
void put(std::string& out, float v) { put(out, std::bit_cast<uint32_t>(v)); }
void put(std::string& out, const vec3& v) {
  for (int i = 0; i < 3; ++i) put(out, v[i]);
}

// Random strands with all that the formats can hold.
shape_data make_strands(std::initializer_list<uint32_t> counts, curve_basis basis, bool all) {
  shape_data shape;
  shape.basis = basis;
  shape.strands = {0};
  rng_state rng = make_rng(11);
  for (uint32_t count : counts) {
    vec3 p = {rand1f(rng), rand1f(rng), rand1f(rng)};
    for (uint32_t i = 0; i < count; ++i) {
      p += vec3{rand1f(rng), rand1f(rng), rand1f(rng)};
      shape.positions.push_back(p);
      if (!all) continue;
      shape.radius.push_back(0.01f + 0.01f * rand1f(rng));
      shape.colors.push_back({rand1f(rng), rand1f(rng), rand1f(rng), 1.0f});
    }
    shape.strands.push_back(static_cast<uint32_t>(shape.positions.size()));
  }
  return shape;
}

template <typename T>
float largest_difference(const std::vector<T>& a, const std::vector<T>& b) {
  if (a.size() != b.size()) return infinity;
  float largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if constexpr (std::is_same_v<T, float>) {
      largest = std::max(largest, std::abs(a[i] - b[i]));
    } else {
      largest = std::max(largest, glm::length(a[i] - b[i]));
    }
  }
  return largest;
}

// Position and radius on a piece of a strand.
vec4 eval_curve(const shape_data& s, std::size_t strand, uint32_t piece, float u) {
  const uint32_t step = s.basis == curve_basis::bezier ? 3 : 1;
  const uint32_t first = s.strands[strand] + piece * step;
  const float v = 1 - u;
  std::array<float, 4> w = {v * v * v, 3 * v * v * u, 3 * v * u * u, u * u * u};
  if (s.basis == curve_basis::bspline) {
    w = {v * v * v / 6, (3 * u * u * u - 6 * u * u + 4) / 6,
         (-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6, u * u * u / 6};
  } else if (s.basis == curve_basis::catmull_rom) {
    w = {-u * v * v / 2, (3 * u * u * u - 5 * u * u + 2) / 2, (-3 * u * u * u + 4 * u * u + u) / 2,
         -u * u * v / 2};
  } else if (s.basis == curve_basis::linear) {
    w = {v, u, 0, 0};
  }
  vec4 sum = {0, 0, 0, 0};
  for (uint32_t i = 0; i < 4; ++i) {
    if (w[i] == 0) continue;
    const float r = s.radius.empty() ? 0 : s.radius[first + i];
    sum += w[i] * vec4(s.positions[first + i], r);
  }
  return sum;
}

bool near(const vec4& a, const vec4& b, float tolerance = 1e-5f) {
  return glm::length(a - b) <= tolerance;
}

std::string hair_header(uint32_t strands, uint32_t points, uint32_t flags, uint32_t segments) {
  std::string out = "HAIR";
  put(out, strands);
  put(out, points);
  put(out, flags);
  put(out, segments);
  put(out, 0.25f);                   // thickness
  put(out, 0.5f);                    // transparency
  put(out, vec3{0.5f, 0.4f, 0.3f});  // colour
  out.resize(128, '\0');
  return out;
}

void check_damage(const std::string& good, const std::string& name) {
  temporary_folder folder;
  const fs::path path = folder.path / name;
  auto attempt = [&](const std::string& bytes) {
    write_file(path, bytes);
    warning_list warnings;
    try {
      const shape_data shape = load_shape(path, warnings);
      for (uint32_t end : shape.strands) REQUIRE(end <= shape.positions.size());
      return true;
    } catch (const file_error& e) {
      REQUIRE(!e.reason.empty());
      return false;
    }
  };
  CHECK(attempt(good));
  std::size_t refused = 0;
  for (std::size_t length = 0; length < good.size(); length += 1 + good.size() / 200) {
    refused += !attempt(good.substr(0, length));
  }
  CHECK(refused > 0);
  rng_state rng = make_rng(5);
  for (int i = 0; i < 600; ++i) {
    std::string bad = good;
    for (int k = 0; k <= i % 3; ++k) {
      // mostly in the header, where it hurts
      const auto range =
          static_cast<uint32_t>(i % 2 ? bad.size() : std::min<std::size_t>(bad.size(), 48));
      bad[rand_index(rng, range)] ^= static_cast<char>(1u << rand_index(rng, 8));
    }
    attempt(bad);
  }
}

}  // namespace

TEST_CASE("hair io: .hair keeps strands, radii and colours") {
  for (bool all : {false, true}) {
    for (auto counts : {std::initializer_list<uint32_t>{5, 5, 5}, {2, 7, 3}}) {
      CAPTURE(all);
      const shape_data shape = make_strands(counts, curve_basis::linear, all);
      const shape_data back = save_and_load(shape, "a.hair");
      CHECK(back.basis == curve_basis::linear);
      CHECK(back.strands == shape.strands);
      CHECK(largest_difference(back.positions, shape.positions) == 0);
      if (all) {
        CHECK(largest_difference(back.radius, shape.radius) == 0);
        CHECK(largest_difference(back.colors, shape.colors) == 0);
      } else {
        CHECK(back.colors.empty());
      }
    }
  }
}

TEST_CASE("hair io: .hair keeps transparency as alpha") {
  shape_data shape = make_strands({4, 4}, curve_basis::linear, true);
  shape.colors[3].w = 0.25f;
  const shape_data back = save_and_load(shape, "a.hair");
  CHECK(largest_difference(back.colors, shape.colors) < 1e-6f);
}

TEST_CASE("hair io: .hair with every combination of arrays") {
  for (uint32_t flags = 0; flags < 32; ++flags) {
    CAPTURE(flags);
    const bool segments = flags & 1, points = flags & 2, thickness = flags & 4,
               transparency = flags & 8, colors = flags & 16;
    // strands of 3 and 2 points, or twice 2 and a point too many
    std::string file = hair_header(2, 5, flags, segments ? 0 : 1);
    if (segments) file += std::string("\2\0\1\0", 4);
    if (points) {
      for (int i = 0; i < 5; ++i) put(file, vec3{static_cast<float>(i), 1, 2});
    }
    if (thickness) {
      for (int i = 0; i < 5; ++i) put(file, 0.5f * static_cast<float>(i + 1));
    }
    if (transparency) {
      for (int i = 0; i < 5; ++i) put(file, 0.125f * static_cast<float>(i));
    }
    if (colors) {
      for (int i = 0; i < 5; ++i) put(file, vec3{0.1f * static_cast<float>(i), 0, 1});
    }
    warning_list warnings;
    if (!points) {
      CHECK_THROWS_AS(load_text(file, "a.hair", warnings), file_error);
      continue;
    }
    const shape_data shape = load_text(file, "a.hair", warnings);
    const uint32_t count = segments ? 5 : 4;
    CHECK(shape.strands ==
          (segments ? std::vector<uint32_t>{0, 3, 5} : std::vector<uint32_t>{0, 2, 4}));
    REQUIRE(shape.positions.size() == count);
    CHECK(shape.positions[3] == vec3{3, 1, 2});
    CHECK(mentions(warnings, "after the last strand") == !segments);
    REQUIRE(shape.radius.size() == count);
    CHECK(shape.radius[3] == (thickness ? 1.0f : 0.125f));  // half of 2 and of 0.25
    REQUIRE(shape.colors.size() == count);
    const vec3 color = colors ? vec3{0.1f * 3, 0, 1} : vec3{0.5f, 0.4f, 0.3f};
    CHECK(vec3(shape.colors[3]) == color);
    CHECK(shape.colors[3].w == (transparency ? 1 - 0.375f : 1.0f));
  }
}

TEST_CASE("hair io: .hair refuses headers that the file cannot hold") {
  std::string points;
  for (int i = 0; i < 4; ++i) put(points, vec3{static_cast<float>(i), 0, 0});
  CHECK_NOTHROW(load_text(hair_header(2, 4, 2, 1) + points, "a.hair"));
  CHECK_THROWS_AS(load_text("HAIR", "a.hair"), file_error);
  CHECK_THROWS_AS(load_text("hair" + hair_header(2, 4, 2, 1).substr(4) + points, "a.hair"),
                  file_error);
  CHECK_THROWS_AS(load_text(hair_header(2, 5, 2, 1) + points, "a.hair"), file_error);
  CHECK_THROWS_AS(load_text(hair_header(2, 4, 2, 2) + points, "a.hair"), file_error);
  CHECK_THROWS_AS(load_text(hair_header(2, 4, 6, 1) + points, "a.hair"), file_error);
  CHECK_THROWS_AS(load_text(hair_header(0xffffffffu, 4, 2, 0xffffffffu) + points, "a.hair"),
                  file_error);
  CHECK_THROWS_AS(load_text(hair_header(0xffffffffu, 0xffffffffu, 31, 0) + points, "a.hair"),
                  file_error);
  // segments of the second strand run past the points
  CHECK_THROWS_AS(
      load_text(hair_header(2, 4, 3, 0) + std::string("\1\0\2\0", 4) + points, "a.hair"),
      file_error);
}

TEST_CASE("hair io: curves become polylines that lie on them") {
  const shape_data shape = make_strands({7, 9}, curve_basis::bspline, true);
  const shape_data back = save_and_load(shape, "a.hair");
  REQUIRE(strand_count(back) == 2);
  const uint32_t pieces = segment_count(shape.basis, 9);
  const uint32_t points = back.strands[2] - back.strands[1];
  REQUIRE((points - 1) % pieces == 0);
  const uint32_t per_piece = (points - 1) / pieces;
  for (uint32_t i = 0; i < points; ++i) {
    const uint32_t piece = std::min(i / per_piece, pieces - 1);
    const float u = static_cast<float>(i - piece * per_piece) / static_cast<float>(per_piece);
    const uint32_t at = back.strands[1] + i;
    CHECK(near(vec4(back.positions[at], back.radius[at]), eval_curve(shape, 1, piece, u)));
  }
}

TEST_CASE("hair io: .tfx keeps strands, colours, texture coordinates and root thickness") {
  shape_data shape = make_strands({8, 8, 8}, curve_basis::linear, true);
  for (std::size_t i = 0; i < shape.positions.size(); ++i) {
    shape.radius[i] = 0.01f * static_cast<float>(1 + i / 8);
    shape.texcoords.push_back({static_cast<float>(i / 8) * 0.25f, 0.5f});
  }
  const shape_data back = save_and_load(shape, "a.tfx");
  CHECK(back.strands == shape.strands);
  CHECK(largest_difference(back.positions, shape.positions) == 0);
  CHECK(largest_difference(back.radius, shape.radius) == 0);
  CHECK(largest_difference(back.colors, shape.colors) == 0);
  CHECK(largest_difference(back.texcoords, shape.texcoords) == 0);
  CHECK_THROWS_AS(saved(make_strands({3, 4}, curve_basis::linear, false), "a.tfx"), file_error);
}

TEST_CASE("hair io: .tfx of TressFX 3") {
  std::string file;
  put(file, 3.0f);
  put(file, 2u);
  put(file, 3u);
  file.resize(144, '\0');
  for (uint32_t offset : {296u, 0u, 296u + 72u, 0u, 0u, 0u}) put(file, offset);
  file.resize(296, '\0');
  for (int i = 0; i < 6; ++i) put(file, vec3{static_cast<float>(i), 2, 3});
  for (float uv : {0.1f, 0.2f, 0.3f, 0.4f}) put(file, uv);
  const shape_data shape = load_text(file, "a.tfx");
  CHECK(shape.strands == std::vector<uint32_t>{0, 3, 6});
  CHECK(shape.positions[4] == vec3{4, 2, 3});
  CHECK(shape.texcoords[4] == vec2{0.3f, 0.4f});
  CHECK_THROWS_AS(load_text(file.substr(0, 360), "a.tfx"), file_error);
  CHECK_THROWS_AS(load_text(file.substr(0, 370), "a.tfx"), file_error);
}

TEST_CASE("hair io: text .tfx") {
  const std::string text =
      "numStrands 2\nis sorted 1\nstrand 0 numVerts 3 texcoord 0.5 0.25\n0 0 0\n0 1 0\n0 2 0\n"
      "strand 1 numVerts 2 texcoord 0.1 0.2\n1 0 0\n1 1e-1 0\n";
  const shape_data shape = load_text(text, "a.tfx");
  CHECK(shape.strands == std::vector<uint32_t>{0, 3, 5});
  CHECK(shape.positions[4] == vec3{1, 0.1f, 0});
  CHECK(shape.texcoords[2] == vec2{0.5f, 0.25f});
  CHECK_THROWS_AS(load_text(text.substr(0, text.size() - 10), "a.tfx"), file_error);
  CHECK_THROWS_AS(load_text("numStrands 3" + text.substr(12), "a.tfx"), file_error);
}

TEST_CASE("hair io: .tfxmesh") {
  const std::string text =
      "# made by hand\nnumOfBones 1\n0 root\nnumOfVertices 3\n"
      "0 0 0 0 0 0 1 0 0 0 0 1 0 0 0\n1 1 0 0 0 0 1 0 0 0 0 1 0 0 0\n"
      "2 0 1 0 0 0 1 0 0 0 0 1 0 0 0\nnumOfTriangles 1\n0 0 1 ";
  const shape_data shape = load_text(text + "2\n", "a.tfxmesh");
  REQUIRE(shape.triangles.size() == 1);
  CHECK(shape.triangles[0] == ivec3{0, 1, 2});
  CHECK(shape.positions[1] == vec3{1, 0, 0});
  CHECK(shape.normals[2] == vec3{0, 0, 1});
  CHECK_THROWS_AS(load_text(text + "3\n", "a.tfxmesh"), file_error);
  CHECK_THROWS_AS(load_text(text, "a.tfxmesh"), file_error);
}

TEST_CASE("hair io: pbrt quadratic curves become exact cubics") {
  const std::array<vec3, 5> p = {vec3{0, 0, 0}, {1, 2, 0}, {3, 1, 1}, {4, 4, 2}, {6, 0, 1}};
  std::string points;
  for (const vec3& q : p) {
    for (int c = 0; c < 3; ++c) points += std::to_string(q[c]) + " ";
  }
  auto quadratic = [](const vec3& a, const vec3& b, const vec3& c, float u) {
    return (1 - u) * (1 - u) * a + 2 * u * (1 - u) * b + u * u * c;
  };
  const std::string head =
      "Shape \"curve\" \"integer degree\" [2] \"float width0\" 2 "
      "\"float width1\" 1 \"point3 P\" [ " +
      points + "]";
  const shape_data bezier = load_text(head, "a.pbrt");
  REQUIRE(bezier.basis == curve_basis::bezier);
  REQUIRE(bezier.positions.size() == 7);
  const shape_data spline = load_text(head + " \"string basis\" \"bspline\"", "a.pbrt");
  REQUIRE(spline.basis == curve_basis::bezier);
  REQUIRE(spline.positions.size() == 10);
  for (int i = 0; i <= 20; ++i) {
    const float u = static_cast<float>(i) / 20;
    for (uint32_t piece = 0; piece < 2; ++piece) {
      const vec3 q = quadratic(p[2 * piece], p[2 * piece + 1], p[2 * piece + 2], u);
      const float r = 1 - 0.5f * (static_cast<float>(piece) + u) / 2;  // radius 1 to 0.5
      CHECK(near(eval_curve(bezier, 0, piece, u), vec4(q, r)));
    }
    for (uint32_t piece = 0; piece < 3; ++piece) {
      const vec3 q = quadratic((p[piece] + p[piece + 1]) / 2.0f, p[piece + 1],
                               (p[piece + 1] + p[piece + 2]) / 2.0f, u);
      const float r = 1 - 0.5f * (static_cast<float>(piece) + u) / 3;
      CHECK(near(eval_curve(spline, 0, piece, u), vec4(q, r)));
    }
  }
}

TEST_CASE("hair io: pbrt B-splines keep their basis and taper linearly") {
  const std::string curve =
      "Shape \"curve\" \"string basis\" \"bspline\" "
      "\"point P\" [0 0 0 1 0 0 2 1 0 3 3 0 4 0 0 6 1 1] ";
  const shape_data shape = load_text(curve + "\"float width0\" 0.8 \"float width1\" 0.4", "a.pbrt");
  REQUIRE(shape.basis == curve_basis::bspline);
  const shape_data pointed = load_text(curve + "\"float width0\" 0.8 \"float width1\" 0", "a.pbrt");
  REQUIRE(pointed.basis == curve_basis::bezier);  // control radii would fall below 0
  for (uint32_t piece = 0; piece < 3; ++piece) {
    for (int i = 0; i <= 10; ++i) {
      const float u = static_cast<float>(i) / 10, s = (static_cast<float>(piece) + u) / 3;
      const vec4 p = eval_curve(shape, 0, piece, u), q = eval_curve(pointed, 0, piece, u);
      CHECK(p.w == doctest::Approx(0.4f - 0.2f * s));
      CHECK(q.w == doctest::Approx(0.4f - 0.4f * s).epsilon(1e-4));
      CHECK(near(vec4(vec3(p), 0), vec4(vec3(q), 0)));
    }
  }
  // one Bezier curve beside it and all are
  warning_list warnings;
  const shape_data mixed = load_text(
      curve + "Shape \"curve\" \"point3 P\" [9 0 0 9 1 0 9 2 0 9 3 0]", "a.pbrt", warnings);
  CHECK(mixed.basis == curve_basis::bezier);
  CHECK(mixed.strands == std::vector<uint32_t>{0, 10, 14});
  CHECK(mixed.radius[12] == 0.5f);  // the default width is 1
}

TEST_CASE("hair io: pbrt curves that continue each other are one strand") {
  const std::string a =
      "Shape \"curve\" \"float width0\" 0.2 \"float width1\" 0.1 "
      "\"point3 P\" [0 0 0 0 1 0 0 2 0 0 3 0]\n";
  const std::string b =
      "Shape \"curve\" \"float width0\" 0.1 \"float width1\" 0.05 "
      "\"point3 P\" [0 3 0 0 4 0 0 5 0 0 6 0]\n";
  const std::string c =
      "Shape \"curve\" \"float width\" 0.1 \"point3 P\" "
      "[0 6 0 0 7 0 0 8 0 0 9 0]\n";
  const shape_data shape = load_text(a + b + c, "a.pbrt");
  CHECK(shape.strands == std::vector<uint32_t>{0, 7, 11});  // widths differ before c
  CHECK(shape.positions[3] == vec3{0, 3, 0});
  CHECK(shape.positions[4] == vec3{0, 4, 0});
}

TEST_CASE("hair io: pbrt transformations") {
  // The curve's first point is (1, 2, 3), its widths 2.
  const std::string curve =
      " Shape \"curve\" \"float width\" 2 \"string type\" \"cylinder\" "
      "\"point3 P\" [1 2 3 0 0 0 1 1 1 2 2 2]\n";
  auto first = [&](const std::string& before, const std::string& after = "") {
    const shape_data s = load_text(before + curve + after, "a.pbrt");
    CHECK(s.profile == curve_profile::round);
    return vec4(s.positions[0], s.radius[0]);
  };
  CHECK(near(first(""), {1, 2, 3, 1}));
  CHECK(near(first("Translate 1 0 -1"), {2, 2, 2, 1}));
  CHECK(near(first("Scale 2 2 2 Translate 1 0 0"), {4, 4, 6, 2}));
  CHECK(near(first("Translate 1 0 0 Scale 2 2 2"), {3, 4, 6, 2}));
  CHECK(near(first("Rotate 90 0 0 1"), {-2, 1, 3, 1}));
  CHECK(near(first("Rotate 120 1 1 1"), {3, 1, 2, 1}));
  CHECK(near(first("Transform [1 0 0 0  0 0 1 0  0 1 0 0  5 6 7 1]"), {6, 9, 9, 1}));
  CHECK(near(first("Translate 1 0 0 Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1]"), {1, 2, 3, 1}));
  CHECK(near(first("Translate 1 0 0 ConcatTransform [2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1]"),
             {3, 4, 6, 2}));
  // from (0, 0, 5) towards the origin: camera z is 5 - z, camera x turns over
  CHECK(near(first("LookAt 0 0 5 0 0 0 0 1 0"), {-1, 2, 2, 1}));
  CHECK(near(first("LookAt 0 0 5 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" [30] WorldBegin"),
             {1, 2, 3, 1}));
  CHECK(near(first("AttributeBegin Translate 9 9 9 AttributeEnd"), {1, 2, 3, 1}));
  CHECK(near(first("TransformBegin Translate 9 9 9 TransformEnd Translate 0 1 0"), {1, 3, 3, 1}));
  CHECK(near(first("Translate 1 1 1 CoordinateSystem \"here\" Identity CoordSysTransform \"here\""),
             {2, 3, 4, 1}));
  CHECK(near(first("ObjectBegin \"hair\" Translate 1 0 0",
                   "ObjectEnd Translate 0 0 10 Scale 3 3 3 ObjectInstance \"hair\""),
             {6, 6, 19, 3}));
  CHECK_THROWS_AS(first("AttributeEnd"), file_error);
  CHECK_THROWS_AS(first("Transform [1 2 3]"), file_error);
  CHECK_THROWS_AS(first("CoordSysTransform \"nowhere\""), file_error);

  warning_list warnings;
  const shape_data stretched = load_text("Scale 2 1 0.5" + curve, "a.pbrt", warnings);
  CHECK(stretched.radius[0] == doctest::Approx(1));
  CHECK(mentions(warnings, "stretched"));
}

TEST_CASE("hair io: pbrt directives that are no curves are passed over") {
  warning_list warnings;
  const std::string text =
      "# a comment with \"quotes\" [ and brackets\n"
      "Film \"rgb\" \"string filename\" \"a # b.exr\" \"integer xresolution\" [ 400 ]\n"
      "ColorSpace \"srgb\"\nOption \"bool disablepixeljitter\" true\nWorldBegin\n"
      "MakeNamedMaterial \"hair\" \"string type\" \"hair\" \"rgb color\" [ .1 .2 .3 ]\n"
      "Attribute \"shape\" \"bool alpha\" false\nReverseOrientation\n"
      "ActiveTransform StartTime\n"
      "Shape \"sphere\" \"float radius\" 3 Shape \"trianglemesh\" \"integer indices\" [0 1 2]\n"
      "Shape \"curve\" \"string type\" [ \"ribbon\" ] \"normal N\" [0 0 1 0 1 0]\n"
      "  \"integer splitdepth\" 3 # between parameters\n"
      "  \"point3 P\" [ 0 0 0 +1 -.5 1e-1 2 2 2 3 3 3 ]";
  const shape_data shape = load_text(text, "a.pbrt", warnings);
  REQUIRE(shape.positions.size() == 4);
  CHECK(shape.positions[1] == vec3{1, -0.5f, 0.1f});
  CHECK(shape.profile == curve_profile::flat);
  CHECK(mentions(warnings, "2 shapes that are not curves"));
  CHECK(mentions(warnings, "1 ribbons"));
  const std::string p = "\"point3 P\" [0 0 0 1 1 1 2 2 2 3 3 3]";
  CHECK_THROWS_AS(load_text("Shape \"sphere\"", "a.pbrt"), file_error);
  CHECK_THROWS_AS(load_text("Shape \"curve\" \"integer degree\" 4 " + p, "a.pbrt"), file_error);
  CHECK_THROWS_AS(load_text("Shape \"curve\" \"string basis\" \"x\" " + p, "a.pbrt"), file_error);
  CHECK_THROWS_AS(load_text("Shape \"curve\" \"string type\" \"x\" " + p, "a.pbrt"), file_error);
  CHECK_THROWS_AS(load_text("Shape \"curve\" \"point3 P\" [0 0 0 1 1 1 2 2 2]", "a.pbrt"),
                  file_error);
  CHECK_THROWS_AS(load_text("Shape \"curve\" \"point3 P\" [0 0 0 1 1", "a.pbrt"), file_error);
  CHECK_THROWS_AS(load_text("Shape \"curve", "a.pbrt"), file_error);
  CHECK_THROWS_AS(load_text("Translate 1 1.2.3 1", "a.pbrt"), file_error);
}

TEST_CASE("hair io: pbrt includes are relative and cannot go round") {
  temporary_folder folder;
  warning_list warnings;
  fs::create_directories(folder.path / "geometry");
  write_file(folder.path / "geometry" / "hair.pbrt",
             "Shape \"curve\" \"point3 P\" [1 0 0 1 1 1 2 2 2 3 3 3]");
  write_file(folder.path / "scene.pbrt",
             "AttributeBegin Translate 1 0 0 Include \"geometry/hair.pbrt\" AttributeEnd");
  CHECK(load_shape(folder.path / "scene.pbrt", warnings).positions[0] == vec3{2, 0, 0});
  write_file(folder.path / "round.pbrt", "Include \"round.pbrt\"");
  CHECK_THROWS_AS(load_shape(folder.path / "round.pbrt", warnings), file_error);
  write_file(folder.path / "missing.pbrt", "Include \"nothing.pbrt\"");
  CHECK_THROWS_AS(load_shape(folder.path / "missing.pbrt", warnings), file_error);
}

TEST_CASE("hair io: pbrt writer is exact for every basis") {
  for (curve_basis basis :
       {curve_basis::linear, curve_basis::bezier, curve_basis::bspline, curve_basis::catmull_rom}) {
    for (bool straight : {false, true}) {
      CAPTURE(static_cast<int>(basis));
      CAPTURE(straight);
      shape_data shape = make_strands({7, 10}, basis, true);
      shape.profile = curve_profile::round;
      for (std::size_t k = 0; k < 2; ++k) {
        for (uint32_t i = shape.strands[k]; straight && i < shape.strands[k + 1]; ++i) {
          shape.radius[i] = 0.5f - 0.02f * static_cast<float>(i - shape.strands[k]);
        }
      }
      const shape_data back = save_and_load(shape, "a.pbrt");
      CHECK(back.profile == curve_profile::round);
      CHECK((back.basis == curve_basis::bspline) == (straight && basis == curve_basis::bspline));
      REQUIRE(strand_count(back) == 2);
      for (std::size_t k = 0; k < 2; ++k) {
        const uint32_t pieces = segment_count(basis, shape.strands[k + 1] - shape.strands[k]);
        REQUIRE(segment_count(back.basis, back.strands[k + 1] - back.strands[k]) == pieces);
        for (uint32_t piece = 0; piece < pieces; ++piece) {
          for (int i = 0; i <= 8; ++i) {
            const float u = static_cast<float>(i) / 8;
            vec4 a = eval_curve(shape, k, piece, u), b = eval_curve(back, k, piece, u);
            if (!straight && i % 8 != 0) a.w = b.w = 0;  // widths in between are lost
            CHECK(near(a, b, 2e-5f));
          }
        }
      }
    }
  }
}

TEST_CASE("hair io: faces cannot be written as strands") {
  shape_data mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  for (const char* name : {"a.hair", "a.tfx", "a.pbrt"}) {
    CHECK_THROWS_AS(saved(mesh, name), file_error);
  }
}

TEST_CASE("hair io: damaged files are refused or read, never worse") {
  const shape_data even = make_strands({4, 4, 4}, curve_basis::linear, true);
  check_damage(saved(make_strands({3, 5, 2}, curve_basis::linear, true), "a.hair"), "b.hair");
  check_damage(saved(even, "a.hair"), "b.hair");
  check_damage(saved(even, "a.tfx"), "b.tfx");
  check_damage(saved(make_strands({4, 7}, curve_basis::bspline, true), "a.pbrt"), "b.pbrt");
  check_damage("numStrands 1\nis sorted 1\nstrand 0 numVerts 2 texcoord 0 0\n0 0 0\n1 1 1\n",
               "b.tfx");
  check_damage("numOfVertices 1\n0 0 0 0 0 0 1 0 0 0 0 1 0 0 0\nnumOfTriangles 1\n0 0 0 0\n",
               "b.tfxmesh");
}

TEST_CASE("hair io: models from the world") {
  const char* data = std::getenv("WISP_TEST_DATA");
  if (data == nullptr) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  struct model {
    const char* path;
    std::size_t strands, positions, triangles;
  };
  for (const model& m :
       {model{"yuksel-straight/straight.hair", 10000, 160000, 0},
        model{"sintel/SintelHairOriginal-sintel_hair.16points.tfx", 11400, 182400, 0},
        model{"ratboy-mohawk/Ratboy_mohawk.tfx", 2228, 71296, 0},
        model{"ratboy-mohawk/Ratboy_body.tfxmesh", 0, 12909, 25814}}) {
    const fs::path path = fs::path(data) / "hair" / m.path;
    CAPTURE(path.string());
    REQUIRE(fs::exists(path));
    warning_list warnings;
    const shape_data shape = load_shape(path, warnings);
    CHECK(strand_count(shape) == m.strands);
    CHECK(shape.positions.size() == m.positions);
    CHECK(shape.triangles.size() == m.triangles);
    if (m.strands != 0) {
      CHECK(largest_difference(save_and_load(shape, "a.hair").positions, shape.positions) == 0);
    }
  }
}
