// Writes PLY as Yocto/GL reads it: binary, little endian, with strands as
// segments in the element line. The basis of strands goes into a comment.

#include <fmt/format.h>

#include "hair_bytes.h"
#include "shape_build.h"
#include "shape_formats.h"

namespace wisp {

namespace {

void put_index_list(std::string& out, std::initializer_list<int> indices) {
  out.push_back(static_cast<char>(indices.size()));
  for (int i : indices) put_u32(out, static_cast<uint32_t>(i));
}

std::size_t line_count(const shape_data& shape) {
  std::size_t count = 0;
  for (std::size_t k = 0; k < strand_count(shape); ++k) {
    const uint32_t vertices = shape.strands[k + 1] - shape.strands[k];
    count += vertices > 0 ? vertices - 1 : 0;
  }
  return count;
}

std::string header_of(const shape_data& shape) {
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment Written by wisp\n";
  for (const std::string& comment : strand_comments(shape)) out += "comment " + comment + "\n";
  out += fmt::format("element vertex {}\n", shape.positions.size());
  auto properties = [&](bool present, std::initializer_list<const char*> names) {
    for (const char* name : names) {
      if (present) out += fmt::format("property float {}\n", name);
    }
  };
  properties(true, {"x", "y", "z"});
  properties(!shape.normals.empty(), {"nx", "ny", "nz"});
  properties(!shape.texcoords.empty(), {"u", "v"});
  properties(!shape.colors.empty(), {"red", "green", "blue", "alpha"});
  properties(!shape.radius.empty(), {"radius"});
  properties(!shape.tangents.empty(), {"tx", "ty", "tz", "tw"});
  properties(!shape.roughness.empty(), {"beta_m", "beta_n"});
  auto lists = [&](const char* name, std::size_t count) {
    if (count == 0) return;
    out += fmt::format("element {} {}\nproperty list uchar int vertex_indices\n", name, count);
  };
  lists("face", shape.triangles.size() + shape.quads.size());
  lists("line", line_count(shape));
  lists("point", shape.points.size());
  return out + "end_header\n";
}

}  // namespace

std::string write_ply(const shape_data& shape, const std::string&, warning_list&) {
  std::string out = header_of(shape);
  out.reserve(out.size() + shape.positions.size() * 80 +
              (shape.triangles.size() + shape.quads.size() + shape.points.size()) * 17 +
              line_count(shape) * 9);
  for (std::size_t v = 0; v < shape.positions.size(); ++v) {
    put_vec3(out, shape.positions[v]);
    if (!shape.normals.empty()) put_vec3(out, shape.normals[v]);
    if (!shape.texcoords.empty()) {
      put_f32(out, shape.texcoords[v].x);
      put_f32(out, 1 - shape.texcoords[v].y);  // files count v from the bottom
    }
    if (!shape.colors.empty()) {
      for (int c = 0; c < 4; ++c) put_f32(out, shape.colors[v][c]);
    }
    if (!shape.radius.empty()) put_f32(out, shape.radius[v]);
    if (!shape.tangents.empty()) {
      for (int c = 0; c < 4; ++c) put_f32(out, shape.tangents[v][c]);
    }
    if (!shape.roughness.empty()) {
      put_f32(out, shape.roughness[v].x);
      put_f32(out, shape.roughness[v].y);
    }
  }
  for (const ivec3& t : shape.triangles) put_index_list(out, {t.x, t.y, t.z});
  for (const ivec4& q : shape.quads) {
    if (q.z == q.w) {
      put_index_list(out, {q.x, q.y, q.z});
    } else {
      put_index_list(out, {q.x, q.y, q.z, q.w});
    }
  }
  for (std::size_t k = 0; k < strand_count(shape); ++k) {
    for (uint32_t i = shape.strands[k]; i + 1 < shape.strands[k + 1]; ++i) {
      put_index_list(out, {static_cast<int>(i), static_cast<int>(i + 1)});
    }
  }
  for (int p : shape.points) put_index_list(out, {p});
  return out;
}

}  // namespace wisp
