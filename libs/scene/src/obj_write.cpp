#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "shape_build.h"
#include "shape_formats.h"

namespace wisp {

namespace {

// The vertex as v, v/vt, v//vn or v/vt/vn; texture coordinates and normals have
// the indices of positions.
void put_corner(std::string& out, const shape_data& shape, int vertex) {
  const int64_t v = int64_t{vertex} + 1;
  auto to = std::back_inserter(out);
  if (shape.texcoords.empty() && shape.normals.empty()) {
    fmt::format_to(to, " {}", v);
  } else if (shape.normals.empty()) {
    fmt::format_to(to, " {0}/{0}", v);
  } else if (shape.texcoords.empty()) {
    fmt::format_to(to, " {0}//{0}", v);
  } else {
    fmt::format_to(to, " {0}/{0}/{0}", v);
  }
}

void put_face(std::string& out, const shape_data& shape, std::initializer_list<int> corners) {
  out += 'f';
  for (int v : corners) put_corner(out, shape, v);
  out += '\n';
}

}  // namespace

std::string write_obj(const shape_data& shape, const std::string& file, warning_list& warnings) {
  auto lose = [&](bool lost, const char* what) {
    if (lost) {
      warnings.push_back(
          fmt::format("{}: OBJ cannot hold {}, which are left out; .ply can", file, what));
    }
  };
  lose(!shape.radius.empty(), "radii");
  lose(!shape.tangents.empty(), "tangents");
  lose(!shape.roughness.empty(), "the roughness of hair");
  lose(
      std::any_of(shape.colors.begin(), shape.colors.end(), [](const vec4& c) { return c.w != 1; }),
      "the alpha of colours");
  lose(!shape.normals.empty() && (!shape.strands.empty() || !shape.points.empty()),
       "normals of strands and points");

  std::string out = "# Written by wisp\n";
  for (const std::string& comment : strand_comments(shape)) out += "# " + comment + "\n";
  auto to = std::back_inserter(out);
  for (std::size_t v = 0; v < shape.positions.size(); ++v) {
    const vec3& p = shape.positions[v];
    fmt::format_to(to, "v {} {} {}", p.x, p.y, p.z);
    if (!shape.colors.empty()) {
      const vec4& c = shape.colors[v];
      fmt::format_to(to, " {} {} {}", c.x, c.y, c.z);
    }
    out += '\n';
  }
  for (const vec2& t : shape.texcoords) {
    fmt::format_to(to, "vt {} {}\n", t.x, 1 - t.y);  // files count v from the bottom
  }
  for (const vec3& n : shape.normals) fmt::format_to(to, "vn {} {} {}\n", n.x, n.y, n.z);

  for (const ivec3& t : shape.triangles) put_face(out, shape, {t.x, t.y, t.z});
  for (const ivec4& q : shape.quads) {
    if (q.z == q.w) {
      put_face(out, shape, {q.x, q.y, q.z});
    } else {
      put_face(out, shape, {q.x, q.y, q.z, q.w});
    }
  }
  for (std::size_t k = 0; k < strand_count(shape); ++k) {
    if (shape.strands[k + 1] - shape.strands[k] < 2) continue;
    out += 'l';
    for (uint32_t i = shape.strands[k]; i < shape.strands[k + 1]; ++i) {
      if (shape.texcoords.empty()) {
        fmt::format_to(to, " {}", i + 1);
      } else {
        fmt::format_to(to, " {0}/{0}", i + 1);
      }
    }
    out += '\n';
  }
  for (int p : shape.points) fmt::format_to(to, "p {}\n", p + 1);
  return out;
}

}  // namespace wisp
