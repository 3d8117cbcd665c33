// The meaning of PLY files: which elements and properties make a shape. Names
// are those of Yocto/GL, MeshLab, Blender, PyMesh and pbrt.
//   vertex    x y z, nx ny nz, u v | s t | texture_u texture_v, red green blue
//             alpha, radius, tx ty tz tw, beta_m beta_n (factors of hair; ours)
//   face      list vertex_indices | vertex_index
//   tristrips list vertex_indices, -1 begins another strip
//   line      list vertex_indices, segments or whole lines
//   edge      vertex1 vertex2
//   point     list vertex_indices
// Elements and properties of other names are read over.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <unordered_set>

#include "ply_file.h"
#include "shape_build.h"
#include "shape_formats.h"

namespace wisp {

namespace {

constexpr std::size_t none = static_cast<std::size_t>(-1);

// Index of the first property with one of these names, or none.
std::size_t find_property(const ply_element& element, bool is_list,
                          std::initializer_list<std::string_view> names) {
  for (std::string_view name : names) {
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      if (element.properties[k].name == name && element.properties[k].is_list == is_list) return k;
    }
  }
  return none;
}

// Integer colours run from 0 to the largest of their type.
float color_scale(ply_type type) {
  switch (type) {
    case ply_type::i8:
      return 1.0f / 127;
    case ply_type::u8:
      return 1.0f / 255;
    case ply_type::i16:
      return 1.0f / 32767;
    case ply_type::u16:
      return 1.0f / 65535;
    case ply_type::i32:
      return 1.0f / 2147483647.0f;
    case ply_type::u32:
      return 1.0f / 4294967295.0f;
    default:
      return 1;
  }
}

// Lets `sinks` fill `values`, whose elements are structs of N floats, from N
// properties; `required` of them must be there.
template <std::size_t N, typename T>
void fill_from(const ply_element& element, std::vector<ply_sink>& sinks, std::vector<T>& values,
               const std::array<std::size_t, N>& properties, std::size_t required,
               const T& fallback, bool is_color = false) {
  static_assert(sizeof(T) == N * sizeof(float));
  for (std::size_t c = 0; c < required; ++c) {
    if (properties[c] == none) return;
  }
  values.assign(static_cast<std::size_t>(element.count), fallback);
  if (values.empty()) return;
  for (std::size_t c = 0; c < N; ++c) {
    if (properties[c] == none) continue;
    float* floats = reinterpret_cast<float*>(values.data()) + c;
    const float scale = is_color ? color_scale(element.properties[properties[c]].type) : 1;
    sinks[properties[c]] = {floats, N, scale};
  }
}

void read_vertices(ply_body& body, const ply_element& element, shape_data& shape,
                   const std::string& file) {
  if (element.count > static_cast<uint64_t>(std::numeric_limits<int>::max())) {
    throw file_error(file, "",
                     fmt::format("has {} vertices, more than the {} that fit", element.count,
                                 std::numeric_limits<int>::max()));
  }
  auto scalar = [&](std::initializer_list<std::string_view> names) {
    return find_property(element, false, names);
  };
  const std::array<std::size_t, 3> position = {scalar({"x"}), scalar({"y"}), scalar({"z"})};
  if (std::find(position.begin(), position.end(), none) != position.end()) {
    throw file_error(file, "", "the element vertex needs the properties x, y and z");
  }
  body.check_room(element);
  std::vector<ply_sink> sinks(element.properties.size());
  fill_from<3>(element, sinks, shape.positions, position, 3, vec3{0, 0, 0});
  fill_from<3>(element, sinks, shape.normals, {scalar({"nx"}), scalar({"ny"}), scalar({"nz"})}, 3,
               vec3{0, 0, 0});
  fill_from<2>(element, sinks, shape.texcoords,
               {scalar({"u", "s", "texture_u"}), scalar({"v", "t", "texture_v"})}, 2, vec2{0, 0});
  fill_from<4>(element, sinks, shape.colors,
               {scalar({"red"}), scalar({"green"}), scalar({"blue"}), scalar({"alpha"})}, 3,
               vec4{1, 1, 1, 1}, true);
  fill_from<1>(element, sinks, shape.radius, {scalar({"radius"})}, 1, 0.0f);
  fill_from<4>(element, sinks, shape.tangents,
               {scalar({"tx"}), scalar({"ty"}), scalar({"tz"}), scalar({"tw"})}, 4,
               vec4{0, 0, 0, 1});
  const std::array<std::size_t, 2> roughness = {scalar({"beta_m"}), scalar({"beta_n"})};
  if (roughness[0] != none || roughness[1] != none) {
    fill_from<2>(element, sinks, shape.roughness, roughness, 0, vec2{1, 1});
  }
  body.read(element, sinks);
}

// Lists and edges as they are in the file.
struct ply_content {
  shape_data vertices = {};
  ply_lists faces = {}, strips = {}, lines = {}, points = {};
  std::vector<int64_t> edge_from = {}, edge_to = {};
};

void read_lists(ply_body& body, const ply_element& element, ply_lists& lists,
                const std::string& file) {
  std::vector<ply_sink> sinks(element.properties.size());
  const std::size_t indices = find_property(element, true, {"vertex_indices", "vertex_index"});
  if (indices != none) {
    sinks[indices].lists = &lists;
  } else if (element.count > 0) {
    throw file_error(
        file, "",
        fmt::format("the element {} needs the property list vertex_indices", element.name));
  }
  body.read(element, sinks);
}

void read_edges(ply_body& body, const ply_element& element, ply_content& content,
                const std::string& file) {
  std::vector<ply_sink> sinks(element.properties.size());
  const std::size_t from = find_property(element, false, {"vertex1"});
  const std::size_t to = find_property(element, false, {"vertex2"});
  if (from != none && to != none) {
    sinks[from].integers = &content.edge_from;
    sinks[to].integers = &content.edge_to;
  } else if (element.count > 0) {
    throw file_error(file, "", "the element edge needs the properties vertex1 and vertex2");
  }
  body.read(element, sinks);
}

ply_content read_content(std::span<const uint8_t> bytes, const std::string& file,
                         warning_list& warnings) {
  const ply_header header = read_ply_header(bytes, file);
  ply_content content;
  ply_body body(bytes, header, file);
  std::set<std::string_view> seen;
  for (const ply_element& element : header.elements) {
    if (!seen.insert(element.name).second) {
      throw file_error(file, "",
                       fmt::format("declares the element {} twice", quote_word(element.name)));
    }
    if (element.name == "vertex") {
      read_vertices(body, element, content.vertices, file);
    } else if (element.name == "face") {
      read_lists(body, element, content.faces, file);
      if (find_property(element, true, {"texcoord"}) != none) {
        warnings.push_back(fmt::format(
            "{}: texture coordinates of faces (property texcoord) are not read, only those of "
            "vertices (u and v)",
            file));
      }
    } else if (element.name == "tristrips") {
      read_lists(body, element, content.strips, file);
    } else if (element.name == "line") {
      read_lists(body, element, content.lines, file);
    } else if (element.name == "point") {
      read_lists(body, element, content.points, file);
    } else if (element.name == "edge") {
      read_edges(body, element, content, file);
    } else {
      body.read(element, std::vector<ply_sink>(element.properties.size()));
    }
  }
  for (const std::string& comment : header.comments) apply_comment(content.vertices, comment);
  return content;
}

// The index as one of `vertices`; throws where there is none such.
struct index_check {
  std::size_t vertices = 0;
  const std::string& file;

  int operator()(int64_t index, std::string_view element, std::size_t k) const {
    if (index >= 0 && static_cast<uint64_t>(index) < vertices) return static_cast<int>(index);
    throw file_error(file, fmt::format("{} {}", element, k),
                     index == ply_not_an_index
                         ? "refers to a vertex by something that is no whole number"
                         : fmt::format("refers to vertex {}, but there are {} (counted from 0)",
                                       index, vertices));
  }
};

void build_strips(const ply_lists& strips, const index_check& check, face_builder& faces) {
  for (std::size_t k = 0; k < strips.ends.size(); ++k) {
    std::size_t length = 0;
    int a = 0, b = 0;
    for (int64_t value : ply_list(strips, k)) {
      if (value == -1) {
        length = 0;
        continue;
      }
      const int c = check(value, "tristrips", k);
      // strips turn corners by repeating vertices
      if (length >= 2 && a != b && b != c && c != a) {
        const bool odd = length % 2 != 0;
        add_polygon(faces, std::array<int, 3>{odd ? b : a, odd ? a : b, c});
      }
      a = b;
      b = c;
      length++;
    }
  }
}

void build_faces(const ply_content& content, const index_check& check, face_builder& faces) {
  std::vector<int> polygon;
  for (std::size_t k = 0; k < content.faces.ends.size(); ++k) {
    polygon.clear();
    for (int64_t value : ply_list(content.faces, k)) {
      polygon.push_back(check(value, "face", k));
    }
    add_polygon(faces, polygon);
  }
  build_strips(content.strips, check, faces);
}

void warn_small(const face_builder& faces, const std::string& file, warning_list& warnings) {
  if (faces.too_small == 0) return;
  warnings.push_back(fmt::format("{}: {} faces with fewer than three vertices were left out", file,
                                 faces.too_small));
}

uint64_t edge_key(int a, int b) {
  return (static_cast<uint64_t>(std::min(a, b)) << 32) | static_cast<uint32_t>(std::max(a, b));
}

// Edges that are not a side of a face: files of meshes may list those, too.
std::vector<std::array<int, 2>> loose_edges(const ply_content& content, const index_check& check,
                                            std::span<const ivec4> faces) {
  std::vector<std::array<int, 2>> edges;
  if (content.edge_from.empty()) return edges;
  std::unordered_set<uint64_t> sides;
  sides.reserve(faces.size() * 2);
  for (const ivec4& f : faces) {
    for (int c = 0; c < 4; ++c) sides.insert(edge_key(f[c], f[(c + 1) % 4]));
  }
  for (std::size_t k = 0; k < content.edge_from.size(); ++k) {
    const int a = check(content.edge_from[k], "edge", k);
    const int b = check(content.edge_to[k], "edge", k);
    if (a != b && !sides.contains(edge_key(a, b))) edges.push_back({a, b});
  }
  return edges;
}

}  // namespace

shape_data read_ply(std::span<const uint8_t> bytes, const std::string& file, warning_list& warnings,
                    const shape_read_options& options) {
  ply_content content = read_content(bytes, file, warnings);
  shape_data& shape = content.vertices;
  const index_check check{shape.positions.size(), file};
  if (options.flip_v) {
    for (vec2& t : shape.texcoords) t.y = 1 - t.y;
  }

  face_builder faces;
  build_faces(content, check, faces);
  warn_small(faces, file, warnings);

  strand_builder strands;
  std::vector<int> line;
  bool open = false;
  for (std::size_t k = 0; k < content.lines.ends.size(); ++k) {
    line.clear();
    for (int64_t value : ply_list(content.lines, k)) line.push_back(check(value, "line", k));
    add_line(strands, line, open);
  }
  const auto edges = loose_edges(content, check, faces.quads);
  if (!edges.empty()) add_edges(strands, edges, shape.positions.size());

  for (std::size_t k = 0; k < content.points.ends.size(); ++k) {
    for (int64_t value : ply_list(content.points, k)) {
      shape.points.push_back(check(value, "point", k));
    }
  }
  finish_faces(faces, shape);
  finish_strands(strands, shape, file);
  points_of_bare_vertices(shape);
  return std::move(content.vertices);
}

subdiv_data read_ply_subdiv(std::span<const uint8_t> bytes, const std::string& file,
                            warning_list& warnings) {
  ply_content content = read_content(bytes, file, warnings);
  face_builder faces;
  build_faces(content, index_check{content.vertices.positions.size(), file}, faces);
  warn_small(faces, file, warnings);
  subdiv_data subdiv;
  subdiv.quadspos = std::move(faces.quads);
  subdiv.positions = std::move(content.vertices.positions);
  subdiv.normals = std::move(content.vertices.normals);
  subdiv.texcoords = std::move(content.vertices.texcoords);
  for (vec2& t : subdiv.texcoords) t.y = 1 - t.y;
  if (!subdiv.normals.empty()) subdiv.quadsnorm = subdiv.quadspos;
  if (!subdiv.texcoords.empty()) subdiv.quadstexcoord = subdiv.quadspos;
  return subdiv;
}

}  // namespace wisp
