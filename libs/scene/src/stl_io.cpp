// STL (3D Systems, "StereoLithography Interface Specification", 1989): triangles
// without topology, as text or as records of 50 bytes. Vertices at the same
// place become one, so that the mesh is connected; facet normals are not read,
// since they follow from the vertices.

#include <fmt/format.h>

#include <bit>
#include <limits>

#include "hair_bytes.h"
#include "shape_build.h"
#include "shape_formats.h"
#include "text_cursor.h"
#include "text_words.h"
#include "weld_table.h"

namespace wisp {

namespace {

constexpr std::size_t header_size = 84, record_size = 50;

int vertex_at(weld_table& table, vec3 p) {
  p += vec3{0, 0, 0};  // -0 is 0
  return weld(table, std::bit_cast<weld_table::key_type>(p));
}

// Binary files may begin with "solid", too, so that the size decides first, then
// whether there are bytes that no text has.
bool is_text(std::span<const uint8_t> bytes) {
  if (bytes.size() >= header_size &&
      bytes.size() == header_size + record_size * uint64_t{get_u32(bytes, 80)}) {
    return false;
  }
  text_words words = words_of(bytes);
  const std::string_view first = next_word(words);
  if (first != "solid" && first != "SOLID" && first != "Solid") return false;
  for (uint8_t c : bytes.first(std::min<std::size_t>(bytes.size(), 512))) {
    if (c < ' ' && !(c >= '\t' && c <= '\r')) return false;
  }
  return true;
}

bool same_word(std::string_view word, std::string_view lower) {
  return std::equal(word.begin(), word.end(), lower.begin(), lower.end(), [](char a, char b) {
    return (a >= 'A' && a <= 'Z' ? static_cast<char>(a + ('a' - 'A')) : a) == b;
  });
}

void read_text(std::span<const uint8_t> bytes, const std::string& file, weld_table& table,
               face_builder& faces) {
  text_words words = words_of(bytes);
  auto fail = [&](const std::string& reason) { throw file_error(file, line_place(words), reason); };
  std::vector<int> loop;
  bool in_loop = false;
  while (true) {
    const std::string_view word = next_word(words);
    if (word.empty()) break;
    if (same_word(word, "vertex")) {
      if (!in_loop) fail("a vertex must be within outer loop and endloop");
      vec3 p;
      for (int c = 0; c < 3; ++c) {
        const std::string_view number = next_word(words);
        if (!parse_float(number, p[c])) {
          fail(fmt::format("expected a number, not {}", quote_word(number)));
        }
      }
      loop.push_back(vertex_at(table, p));
    } else if (same_word(word, "outer")) {
      if (!same_word(next_word(words), "loop")) fail("expected loop after outer");
      if (in_loop) fail("a loop begins before the last has ended");
      in_loop = true;
      loop.clear();
    } else if (same_word(word, "endloop")) {
      if (!in_loop) fail("endloop without outer loop");
      in_loop = false;
      // STL holds triangles; some writers have quads
      for (std::size_t i = 2; i < loop.size(); ++i) {
        add_polygon(faces, std::array<int, 3>{loop[0], loop[i - 1], loop[i]});
      }
      if (loop.size() < 3) faces.too_small++;
    } else if (same_word(word, "facet") || same_word(word, "solid") ||
               same_word(word, "endsolid")) {
      skip_line(words);  // a normal or a name
    } else if (!same_word(word, "endfacet")) {
      fail(fmt::format("{} is no word of an STL file", quote_word(word)));
    }
  }
  if (in_loop) fail("the file ends within a loop; is it cut short?");
}

void read_binary(std::span<const uint8_t> bytes, const std::string& file, warning_list& warnings,
                 weld_table& table, face_builder& faces) {
  if (bytes.size() < header_size) {
    throw file_error(file, "",
                     fmt::format("is {} bytes long, but a binary STL file begins with a header of "
                                 "{} bytes, and one of text with solid",
                                 bytes.size(), header_size));
  }
  const uint64_t count = get_u32(bytes, 80);
  const uint64_t room = (bytes.size() - header_size) / record_size;
  if (count > room) {
    throw file_error(file, "byte 80",
                     fmt::format("the header announces {} triangles, but there are bytes for {}; "
                                 "is the file cut short?",
                                 count, room));
  }
  if (bytes.size() != header_size + record_size * count) {
    warnings.push_back(fmt::format("{}: {} bytes after the last triangle were ignored", file,
                                   bytes.size() - header_size - record_size * count));
  }
  faces.quads.reserve(static_cast<std::size_t>(count));
  for (uint64_t k = 0; k < count; ++k) {
    const uint64_t at = header_size + record_size * k + 12;  // after the normal
    std::array<int, 3> triangle = {};
    for (std::size_t c = 0; c < 3; ++c) {
      triangle[c] = vertex_at(table, get_vec3(bytes, at + 12 * c));
    }
    add_polygon(faces, triangle);
  }
}

}  // namespace

shape_data read_stl(std::span<const uint8_t> bytes, const std::string& file,
                    warning_list& warnings) {
  weld_table table;
  face_builder faces;
  if (is_text(bytes)) {
    read_text(bytes, file, table, faces);
  } else {
    read_binary(bytes, file, warnings, table, faces);
  }
  if (faces.too_small > 0) {
    warnings.push_back(fmt::format("{}: {} facets with fewer than three vertices were left out",
                                   file, faces.too_small));
  }
  shape_data shape;
  shape.positions.reserve(table.keys.size());
  for (const auto& key : table.keys) shape.positions.push_back(std::bit_cast<vec3>(key));
  finish_faces(faces, shape);
  return shape;
}

std::string write_stl(const shape_data& shape, const std::string& file, warning_list& warnings) {
  if (!shape.strands.empty() || !shape.points.empty()) {
    throw file_error(file, "",
                     "STL holds faces, but the shape has strands or points; .ply and .obj hold "
                     "them all");
  }
  std::vector<ivec3> triangles = shape.triangles;
  for (const ivec4& q : shape.quads) {
    triangles.push_back({q.x, q.y, q.z});
    if (q.z != q.w) triangles.push_back({q.z, q.w, q.x});
  }
  if (triangles.size() > std::numeric_limits<uint32_t>::max()) {
    throw file_error(file, "", "STL cannot count so many triangles; .ply can");
  }
  if (!shape.normals.empty() || !shape.texcoords.empty() || !shape.colors.empty()) {
    warnings.push_back(fmt::format(
        "{}: STL holds positions only; normals, texture coordinates and colours are left out",
        file));
  }
  std::string out = "binary STL written by wisp";  // must not begin with solid
  out.resize(header_size - 4, ' ');
  out.reserve(header_size + record_size * triangles.size());
  put_u32(out, static_cast<uint32_t>(triangles.size()));
  for (const ivec3& t : triangles) {
    auto at = [&](int c) { return shape.positions[static_cast<std::size_t>(t[c])]; };
    put_vec3(out, normalize_or_zero(glm::cross(at(1) - at(0), at(2) - at(0))));
    for (int c = 0; c < 3; ++c) put_vec3(out, at(c));
    put_u16(out, 0);
  }
  return out;
}

}  // namespace wisp
