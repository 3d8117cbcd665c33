#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "shape_build.h"
#include "shape_formats.h"

namespace wisp {

namespace {

// Counts what is amiss, for one warning.
struct tally {
  std::size_t count = 0;
  std::size_t first = 0;
};
void note(tally& t, std::size_t index) {
  if (t.count++ == 0) t.first = index;
}
// "FILE: 3 faces REASON (the first is face 12, counted from 0)".
void report(const tally& t, const std::string& one, const char* reason, const std::string& file,
            warning_list& warnings) {
  if (t.count == 0) return;
  const std::string many = one == "vertex" ? "vertices" : one + "s";
  warnings.push_back(t.count == 1 ? fmt::format("{}: 1 {} {} (it is {} {}, counted from 0)", file,
                                                one, reason, one, t.first)
                                  : fmt::format("{}: {} {} {} (the first is {} {}, counted from 0)",
                                                file, t.count, many, reason, one, t.first));
}

template <glm::length_t N>
bool finite(const glm::vec<N, float>& v) {
  for (glm::length_t c = 0; c < N; ++c) {
    if (!std::isfinite(v[c])) return false;
  }
  return true;
}

void check_lengths(const shape_data& shape, const std::string& file) {
  auto check = [&](std::size_t count, const char* what) {
    if (count == 0 || count == shape.positions.size()) return;
    throw file_error(file, "",
                     fmt::format("has {} {} for {} vertices; there must be as many, or "
                                 "none",
                                 count, what, shape.positions.size()));
  };
  check(shape.normals.size(), "normals");
  check(shape.texcoords.size(), "texture coordinates");
  check(shape.colors.size(), "colours");
  check(shape.radius.size(), "radii");
  check(shape.tangents.size(), "tangents");
  check(shape.roughness.size(), "roughness factors");
}

void check_indices(const shape_data& shape, const std::string& file) {
  const std::size_t count = shape.positions.size();
  auto check = [&](int v, const char* what, std::size_t k) {
    if (v >= 0 && static_cast<std::size_t>(v) < count) return;
    throw file_error(file, fmt::format("{} {}", what, k),
                     fmt::format("refers to vertex {}, but there are {}", v, count));
  };
  for (std::size_t k = 0; k < shape.points.size(); ++k) check(shape.points[k], "point", k);
  for (std::size_t k = 0; k < shape.triangles.size(); ++k) {
    for (int c = 0; c < 3; ++c) check(shape.triangles[k][c], "triangle", k);
  }
  for (std::size_t k = 0; k < shape.quads.size(); ++k) {
    for (int c = 0; c < 4; ++c) check(shape.quads[k][c], "quad", k);
  }
  uint32_t last = 0;
  for (std::size_t k = 0; k < shape.strands.size(); ++k) {
    if (shape.strands[k] < last || shape.strands[k] > count || (k == 0 && shape.strands[0] != 0)) {
      throw file_error(file, fmt::format("strand {}", k),
                       fmt::format("begins at vertex {}, but strands must begin at 0, follow each "
                                   "other and end within the {} vertices",
                                   shape.strands[k], count));
    }
    last = shape.strands[k];
  }
}

// Whether all of the vertices are at one place.
bool is_without_length(const shape_data& shape, std::span<const uint32_t> vertices) {
  return std::all_of(vertices.begin(), vertices.end(), [&](uint32_t v) {
    return shape.positions[v] == shape.positions[vertices.front()];
  });
}

// Attributes that are not finite become harmless ones.
template <typename T>
void clean_values(std::vector<T>& values, const T& harmless, const char* what,
                  const std::string& file, warning_list& warnings) {
  tally bad;
  for (std::size_t v = 0; v < values.size(); ++v) {
    if (finite(values[v])) continue;
    note(bad, v);
    values[v] = harmless;
  }
  report(bad, "vertex", what, file, warnings);
}

void clean_radius(std::vector<float>& radius, const std::string& file, warning_list& warnings) {
  constexpr float default_radius = 0.001f;  // as in Yocto/GL
  tally bad;
  for (std::size_t v = 0; v < radius.size(); ++v) {
    if (std::isfinite(radius[v]) && radius[v] >= 0) continue;
    note(bad, v);
    radius[v] = default_radius;
  }
  report(bad, "vertex", "with a radius below zero or not finite, which became 0.001", file,
         warnings);
}

void clean_roughness(std::vector<vec2>& roughness, const std::string& file,
                     warning_list& warnings) {
  tally bad;
  for (std::size_t v = 0; v < roughness.size(); ++v) {
    if (finite(roughness[v]) && roughness[v].x >= 0 && roughness[v].y >= 0) continue;
    note(bad, v);
    roughness[v] = {1, 1};
  }
  report(bad, "vertex", "with a factor beta_m or beta_n below zero or not finite, which became 1",
         file, warnings);
}

// Keeps the elements for which bad(element) is false.
template <typename T, typename F>
void drop_elements(std::vector<T>& elements, const F& bad, const char* one, const std::string& file,
                   warning_list& warnings) {
  tally dropped;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < elements.size(); ++k) {
    if (bad(elements[k])) {
      note(dropped, k);
    } else {
      elements[kept++] = elements[k];
    }
  }
  elements.resize(kept);
  report(dropped, one, "left out for vertices that are not finite", file, warnings);
}

// The vertices of the strands that stay, strand by strand.
struct kept_strands {
  std::vector<uint32_t> starts = {};
  std::vector<uint32_t> vertices = {};
};

kept_strands keep_strands(const shape_data& shape, const std::vector<bool>& is_finite,
                          const std::string& file, warning_list& warnings) {
  kept_strands kept;
  if (shape.strands.empty()) return kept;
  tally cut, lost, misfit, flat;
  kept.starts.push_back(0);
  kept.vertices.reserve(shape.strands.back());
  for (std::size_t k = 0; k < strand_count(shape); ++k) {
    const std::size_t begin = kept.vertices.size();
    const uint32_t count = shape.strands[k + 1] - shape.strands[k];
    for (uint32_t v = shape.strands[k]; v < shape.strands[k + 1]; ++v) {
      if (is_finite[v]) kept.vertices.push_back(v);
    }
    const auto left = static_cast<uint32_t>(kept.vertices.size() - begin);
    const bool fits = segment_count(shape.basis, left) > 0;
    const bool no_length =
        fits && is_without_length(shape, std::span(kept.vertices).subspan(begin));
    if (fits && !no_length) {
      if (left < count) note(cut, k);
      kept.starts.push_back(static_cast<uint32_t>(kept.vertices.size()));
      continue;
    }
    kept.vertices.resize(begin);
    note(no_length ? flat : segment_count(shape.basis, count) > 0 ? lost : misfit, k);
  }
  report(cut, "strand", "cut short by vertices that are not finite", file, warnings);
  report(lost, "strand", "left out for vertices that are not finite", file, warnings);
  report(misfit, "strand",
         shape.basis == curve_basis::linear ? "left out for having fewer than two points"
         : shape.basis == curve_basis::bezier
             ? "left out for not having 3 n + 1 points, as Bezier curves do"
             : "left out for having fewer than four points",
         file, warnings);
  report(flat, "strand", "left out for having no length", file, warnings);
  return kept;
}

// Removes vertices that are not finite or of strands that are gone, unless a
// face or a point uses them.
void compact_vertices(shape_data& shape, const kept_strands& kept,
                      const std::vector<bool>& is_finite) {
  const std::size_t strand_vertices = shape.strands.empty() ? 0 : shape.strands.back();
  std::vector<bool> wanted = is_finite;
  std::fill_n(wanted.begin(), strand_vertices, false);
  auto want = [&](int v) { wanted[static_cast<std::size_t>(v)] = true; };
  for (int p : shape.points) want(p);
  for (const ivec3& t : shape.triangles) {
    for (int c = 0; c < 3; ++c) want(t[c]);
  }
  for (const ivec4& q : shape.quads) {
    for (int c = 0; c < 4; ++c) want(q[c]);
  }

  constexpr uint32_t gone = std::numeric_limits<uint32_t>::max();
  std::vector<uint32_t> order = kept.vertices;
  std::vector<uint32_t> moved(shape.positions.size(), gone);
  for (std::size_t i = 0; i < order.size(); ++i) moved[order[i]] = static_cast<uint32_t>(i);
  for (std::size_t v = 0; v < wanted.size(); ++v) {
    if (!wanted[v] || moved[v] != gone) continue;
    moved[v] = static_cast<uint32_t>(order.size());
    order.push_back(static_cast<uint32_t>(v));
  }
  auto move = [&](int& v) { v = static_cast<int>(moved[static_cast<std::size_t>(v)]); };
  for (int& p : shape.points) move(p);
  for (ivec3& t : shape.triangles) {
    for (int c = 0; c < 3; ++c) move(t[c]);
  }
  for (ivec4& q : shape.quads) {
    for (int c = 0; c < 4; ++c) move(q[c]);
  }
  gather_vertices(shape, order);
}

std::size_t element_count(const shape_data& shape) {
  return shape.points.size() + shape.triangles.size() + shape.quads.size() + strand_count(shape);
}

}  // namespace

void check_shape(const shape_data& shape, const std::string& file) {
  check_lengths(shape, file);
  check_indices(shape, file);
  if (element_count(shape) == 0) throw file_error(file, "", "holds no faces, points or strands");
}

void clean_shape(shape_data& shape, const std::string& file, warning_list& warnings) {
  check_shape(shape, file);

  std::vector<bool> is_finite(shape.positions.size());
  for (std::size_t v = 0; v < is_finite.size(); ++v) is_finite[v] = finite(shape.positions[v]);
  auto bad = [&](int v) { return !is_finite[static_cast<std::size_t>(v)]; };
  drop_elements(shape.points, bad, "point", file, warnings);
  drop_elements(
      shape.triangles, [&](const ivec3& t) { return bad(t.x) || bad(t.y) || bad(t.z); }, "triangle",
      file, warnings);
  drop_elements(
      shape.quads, [&](const ivec4& q) { return bad(q.x) || bad(q.y) || bad(q.z) || bad(q.w); },
      "quad", file, warnings);

  kept_strands kept = keep_strands(shape, is_finite, file, warnings);
  const bool all_finite = std::find(is_finite.begin(), is_finite.end(), false) == is_finite.end();
  const bool all_kept = shape.strands.empty() || kept.vertices.size() == shape.strands.back();
  if (!all_finite || !all_kept) compact_vertices(shape, kept, is_finite);
  shape.strands = std::move(kept.starts);
  if (strand_count(shape) == 0) shape.strands.clear();

  clean_radius(shape.radius, file, warnings);
  clean_values(shape.normals, vec3{0, 0, 0}, "with a normal that is not finite, which became zero",
               file, warnings);
  clean_values(shape.texcoords, vec2{0, 0},
               "with a texture coordinate that is not finite, which became zero", file, warnings);
  clean_values(shape.colors, vec4{1, 1, 1, 1},
               "with a colour that is not finite, which became white", file, warnings);
  clean_values(shape.tangents, vec4{0, 0, 0, 1},
               "with a tangent that is not finite, which became zero", file, warnings);
  clean_roughness(shape.roughness, file, warnings);
  if (element_count(shape) == 0) {
    throw file_error(file, "",
                     "holds no faces, points or strands that can be used: all have vertices that "
                     "are not finite or, if strands, no length or too few points");
  }
}

void clean_subdiv(subdiv_data& subdiv, const std::string& file, warning_list& warnings) {
  std::vector<bool> keep(subdiv.quadspos.size());
  tally dropped;
  for (std::size_t k = 0; k < keep.size(); ++k) {
    keep[k] = true;
    for (int c = 0; c < 4; ++c) {
      keep[k] =
          keep[k] && finite(subdiv.positions[static_cast<std::size_t>(subdiv.quadspos[k][c])]);
    }
    if (!keep[k]) note(dropped, k);
  }
  report(dropped, "quad", "left out for vertices that are not finite", file, warnings);
  for (auto* quads : {&subdiv.quadspos, &subdiv.quadsnorm, &subdiv.quadstexcoord}) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < quads->size(); ++k) {
      if (keep[k]) (*quads)[kept++] = (*quads)[k];
    }
    quads->resize(kept);
  }
  // Nothing uses these any more, but code that looks at all vertices may stumble.
  for (vec3& p : subdiv.positions) {
    if (!finite(p)) p = {0, 0, 0};
  }
  clean_values(subdiv.normals, vec3{0, 0, 0}, "with a normal that is not finite, which became zero",
               file, warnings);
  clean_values(subdiv.texcoords, vec2{0, 0},
               "with a texture coordinate that is not finite, which became zero", file, warnings);
  if (subdiv.quadspos.empty()) {
    throw file_error(file, "", "holds no faces, which a subdiv needs");
  }
}

}  // namespace wisp
