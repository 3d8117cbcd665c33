// Wavefront OBJ: polygons (f), lines (l) and points (p) of vertices (v, with the
// colours that MeshLab appends), texture coordinates (vt) and normals (vn).
// Groups, smoothing and materials are read over: one file is one shape.

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "obj_parse.h"
#include "shape_build.h"
#include "shape_formats.h"
#include "weld_table.h"

namespace wisp {

namespace {

// Whether all corners of all elements say about `member` what their position
// says: the same index, or nothing anywhere.
bool follows_positions(const obj_content& content, int obj_corner::*member, std::size_t count) {
  bool any = false, all = true;
  auto look = [&](const obj_elements& elements, bool may_lack) {
    for (const obj_corner& c : elements.corners) {
      const bool none = c.*member < 0;
      any |= !none;
      all &= none ? may_lack : c.*member == c.position;
    }
  };
  look(content.faces, false);
  look(content.lines, true);
  look(content.points, true);
  return !any || (all && count == content.positions.size());
}

bool any_corner_has(const obj_content& content, int obj_corner::*member) {
  auto look = [&](const obj_elements& elements) {
    return std::any_of(elements.corners.begin(), elements.corners.end(),
                       [&](const obj_corner& c) { return c.*member >= 0; });
  };
  return look(content.faces) || look(content.lines) || look(content.points);
}

// Normals of faces, weighted by area, for corners that name none while others do.
void fill_normals(shape_data& shape, const std::vector<obj_corner>& vertices) {
  std::vector<bool> lacks(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) lacks[v] = vertices[v].normal < 0;
  auto add = [&](int a, int b, int c) {
    auto at = [&](int v) { return shape.positions[static_cast<std::size_t>(v)]; };
    const vec3 normal = glm::cross(at(b) - at(a), at(c) - at(a));
    for (int v : {a, b, c}) {
      if (lacks[static_cast<std::size_t>(v)]) shape.normals[static_cast<std::size_t>(v)] += normal;
    }
  };
  for (const ivec3& t : shape.triangles) add(t.x, t.y, t.z);
  for (const ivec4& q : shape.quads) {
    add(q.x, q.y, q.z);
    add(q.z, q.w, q.x);  // without area where z == w
  }
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (lacks[v]) shape.normals[v] = normalize_or_zero(shape.normals[v]);
  }
}

// Elements with the vertex that `vertex` gives each corner.
void build_elements(const obj_content& content, shape_data& shape, strand_builder& strands,
                    const std::string& file, warning_list& warnings, const auto& vertex) {
  face_builder faces;
  std::vector<int> indices;
  auto read = [&](const obj_elements& elements, std::size_t k) -> std::span<const int> {
    indices.clear();
    for (const obj_corner& c : obj_element(elements, k)) indices.push_back(vertex(c));
    return indices;
  };
  for (std::size_t k = 0; k < content.faces.ends.size(); ++k) {
    add_polygon(faces, read(content.faces, k));
  }
  bool open = false;
  for (std::size_t k = 0; k < content.lines.ends.size(); ++k) {
    add_line(strands, read(content.lines, k), open);
  }
  for (std::size_t k = 0; k < content.points.ends.size(); ++k) {
    for (int v : read(content.points, k)) shape.points.push_back(v);
  }
  finish_faces(faces, shape);
  if (faces.too_small > 0) {
    warnings.push_back(fmt::format("{}: {} faces with fewer than three vertices were left out",
                                   file, faces.too_small));
  }
}

}  // namespace

shape_data read_obj(std::span<const uint8_t> bytes, const std::string& file, warning_list& warnings,
                    const shape_read_options& options) {
  obj_content content = parse_obj(bytes, file, warnings);
  if (options.flip_v) {
    for (vec2& t : content.texcoords) t.y = 1 - t.y;
  }
  const bool has_texcoords = any_corner_has(content, &obj_corner::texcoord);
  const bool has_normals = any_corner_has(content, &obj_corner::normal);
  shape_data shape;
  for (const std::string& comment : content.comments) apply_comment(shape, comment);

  strand_builder strands;
  if (follows_positions(content, &obj_corner::texcoord, content.texcoords.size()) &&
      follows_positions(content, &obj_corner::normal, content.normals.size())) {
    // Vertices stay as they are in the file, unused ones, too.
    build_elements(content, shape, strands, file, warnings,
                   [](const obj_corner& c) { return c.position; });
    shape.positions = std::move(content.positions);
    shape.colors = std::move(content.colors);
    if (has_texcoords) shape.texcoords = std::move(content.texcoords);
    if (has_normals) shape.normals = std::move(content.normals);
  } else {
    // Each different corner becomes a vertex.
    weld_table table;
    build_elements(content, shape, strands, file, warnings, [&](const obj_corner& c) {
      return weld(table, std::bit_cast<weld_table::key_type>(c));
    });
    std::vector<obj_corner> vertices;
    for (const auto& key : table.keys) vertices.push_back(std::bit_cast<obj_corner>(key));
    for (const obj_corner& c : vertices) {
      const auto position = static_cast<std::size_t>(c.position);
      shape.positions.push_back(content.positions[position]);
      if (!content.colors.empty()) shape.colors.push_back(content.colors[position]);
      if (has_texcoords) {
        shape.texcoords.push_back(
            c.texcoord < 0 ? vec2{0, 0} : content.texcoords[static_cast<std::size_t>(c.texcoord)]);
      }
      if (has_normals) {
        shape.normals.push_back(c.normal < 0 ? vec3{0, 0, 0}
                                             : content.normals[static_cast<std::size_t>(c.normal)]);
      }
    }
    if (has_normals) fill_normals(shape, vertices);
  }
  finish_strands(strands, shape, file);
  points_of_bare_vertices(shape);
  return shape;
}

subdiv_data read_obj_subdiv(std::span<const uint8_t> bytes, const std::string& file,
                            warning_list& warnings) {
  obj_content content = parse_obj(bytes, file, warnings);
  if (!content.lines.ends.empty() || !content.points.ends.empty()) {
    warnings.push_back(fmt::format("{}: lines and points are no part of a subdiv", file));
  }
  std::size_t too_small = 0;
  auto quads = [&](int obj_corner::*member) {
    face_builder faces;
    std::vector<int> indices;
    for (std::size_t k = 0; k < content.faces.ends.size(); ++k) {
      indices.clear();
      for (const obj_corner& c : obj_element(content.faces, k)) indices.push_back(c.*member);
      add_polygon(faces, indices);
    }
    too_small = faces.too_small;
    return std::move(faces.quads);
  };
  auto all_have = [&](int obj_corner::*member, const char* what) {
    std::size_t having = 0;
    for (const obj_corner& c : content.faces.corners) having += c.*member >= 0;
    if (having > 0 && having < content.faces.corners.size()) {
      warnings.push_back(
          fmt::format("{}: {} are ignored, since only some of the faces have them", file, what));
    }
    return having > 0 && having == content.faces.corners.size();
  };
  subdiv_data subdiv;
  subdiv.quadspos = quads(&obj_corner::position);
  subdiv.positions = std::move(content.positions);
  if (all_have(&obj_corner::texcoord, "texture coordinates")) {
    subdiv.quadstexcoord = quads(&obj_corner::texcoord);
    subdiv.texcoords = std::move(content.texcoords);
    for (vec2& t : subdiv.texcoords) t.y = 1 - t.y;
  }
  if (all_have(&obj_corner::normal, "normals")) {
    subdiv.quadsnorm = quads(&obj_corner::normal);
    subdiv.normals = std::move(content.normals);
  }
  if (too_small > 0) {
    warnings.push_back(
        fmt::format("{}: {} faces with fewer than three vertices were left out", file, too_small));
  }
  return subdiv;
}

}  // namespace wisp
