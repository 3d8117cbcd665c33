#include "shape_build.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <type_traits>
#include <utility>

#include "wisp/core/error.h"

namespace wisp {

void add_polygon(face_builder& faces, std::span<const int> polygon) {
  if (polygon.size() < 3) {
    faces.too_small++;
  } else if (polygon.size() == 4) {
    faces.quads.push_back({polygon[0], polygon[1], polygon[2], polygon[3]});
    faces.has_quads = true;
  } else {
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      faces.quads.push_back({polygon[0], polygon[i - 1], polygon[i], polygon[i]});
    }
  }
}

void finish_faces(face_builder& faces, shape_data& shape) {
  if (faces.has_quads) {
    shape.quads = std::move(faces.quads);
    return;
  }
  shape.triangles.reserve(faces.quads.size());
  for (const ivec4& q : faces.quads) shape.triangles.push_back({q.x, q.y, q.z});
  faces.quads = {};
}

void add_line(strand_builder& strands, std::span<const int> line, bool& open) {
  if (line.size() < 2) return;
  const bool segment = line.size() == 2;
  if (segment && open && strands.vertices.back() == line[0]) {
    strands.vertices.push_back(line[1]);
    strands.ends.back()++;
  } else {
    strands.vertices.insert(strands.vertices.end(), line.begin(), line.end());
    strands.ends.push_back(strands.vertices.size());
  }
  open = segment;
}

void add_edges(strand_builder& strands, std::span<const std::array<int, 2>> edges,
               std::size_t vertices) {
  // The edges at vertex v are around[first[v]] .. around[first[v + 1] - 1].
  std::vector<std::size_t> first(vertices + 1, 0);
  for (const auto& e : edges) {
    first[static_cast<std::size_t>(e[0]) + 1]++;
    first[static_cast<std::size_t>(e[1]) + 1]++;
  }
  for (std::size_t v = 0; v < vertices; ++v) first[v + 1] += first[v];
  std::vector<std::size_t> around(first.back());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    for (int v : edges[e]) around[next[static_cast<std::size_t>(v)]++] = e;
  }
  std::vector<bool> used(edges.size(), false);
  auto degree = [&](std::size_t v) { return first[v + 1] - first[v]; };

  auto walk = [&](std::size_t vertex, std::size_t edge) {
    strands.vertices.push_back(static_cast<int>(vertex));
    while (true) {
      used[edge] = true;
      const auto& e = edges[edge];
      vertex = static_cast<std::size_t>(static_cast<std::size_t>(e[0]) == vertex ? e[1] : e[0]);
      strands.vertices.push_back(static_cast<int>(vertex));
      if (degree(vertex) != 2) break;
      const std::size_t a = around[first[vertex]], b = around[first[vertex] + 1];
      if (used[a] && used[b]) break;
      edge = used[a] ? b : a;
    }
    strands.ends.push_back(strands.vertices.size());
  };
  auto walk_from = [&](std::size_t v) {
    for (std::size_t i = first[v]; i < first[v + 1]; ++i) {
      if (!used[around[i]]) walk(v, around[i]);
    }
  };
  for (std::size_t v = 0; v < vertices; ++v) {
    if (degree(v) != 2) walk_from(v);
  }
  for (std::size_t v = 0; v < vertices; ++v) walk_from(v);  // rings
}

void finish_strands(strand_builder& strands, shape_data& shape, const std::string& file) {
  if (strands.ends.empty()) return;
  constexpr std::size_t most = std::numeric_limits<int>::max();
  if (strands.vertices.size() > most - std::min(most, shape.positions.size())) {
    throw file_error(file, "", fmt::format("has more vertices than the {} that fit", most));
  }
  shape.strands.reserve(strands.ends.size() + 1);
  shape.strands.push_back(0);
  for (std::size_t end : strands.ends) shape.strands.push_back(static_cast<uint32_t>(end));

  bool in_place = true;
  for (std::size_t i = 0; i < strands.vertices.size() && in_place; ++i) {
    in_place = strands.vertices[i] == static_cast<int>(i);
  }
  if (in_place) return;

  std::vector<uint32_t> order(strands.vertices.begin(), strands.vertices.end());
  std::vector<int> moved(shape.positions.size(), -1);
  auto move = [&](int& vertex) {
    int& to = moved[static_cast<std::size_t>(vertex)];
    if (to < 0) {
      to = static_cast<int>(order.size());
      order.push_back(static_cast<uint32_t>(vertex));
    }
    vertex = to;
  };
  for (int& p : shape.points) move(p);
  for (ivec3& t : shape.triangles) {
    for (int c = 0; c < 3; ++c) move(t[c]);
  }
  for (ivec4& q : shape.quads) {
    for (int c = 0; c < 4; ++c) move(q[c]);
  }
  gather_vertices(shape, order);
}

void points_of_bare_vertices(shape_data& shape) {
  if (!shape.points.empty() || !shape.triangles.empty() || !shape.quads.empty() ||
      !shape.strands.empty()) {
    return;
  }
  shape.points.resize(shape.positions.size());
  for (std::size_t i = 0; i < shape.points.size(); ++i) shape.points[i] = static_cast<int>(i);
}

void gather_vertices(shape_data& shape, std::span<const uint32_t> order) {
  auto gather = [&](auto& values) {
    if (values.empty()) return;
    std::remove_reference_t<decltype(values)> gathered;
    gathered.reserve(order.size());
    for (uint32_t i : order) gathered.push_back(values[i]);
    values = std::move(gathered);
  };
  gather(shape.positions);
  gather(shape.normals);
  gather(shape.texcoords);
  gather(shape.colors);
  gather(shape.radius);
  gather(shape.tangents);
  gather(shape.roughness);
}

void apply_comment(shape_data& shape, std::string_view comment) {
  while (!comment.empty() && (comment.back() == ' ' || comment.back() == '\r')) {
    comment.remove_suffix(1);
  }
  while (!comment.empty() && comment.front() == ' ') comment.remove_prefix(1);
  if (comment == "wisp basis linear") shape.basis = curve_basis::linear;
  if (comment == "wisp basis bezier") shape.basis = curve_basis::bezier;
  if (comment == "wisp basis bspline") shape.basis = curve_basis::bspline;
  if (comment == "wisp basis catmull_rom") shape.basis = curve_basis::catmull_rom;
  if (comment == "wisp profile flat") shape.profile = curve_profile::flat;
  if (comment == "wisp profile round") shape.profile = curve_profile::round;
}

std::vector<std::string> strand_comments(const shape_data& shape) {
  std::vector<std::string> comments;
  if (strand_count(shape) == 0) return comments;
  switch (shape.basis) {
    case curve_basis::linear:
      break;
    case curve_basis::bezier:
      comments.emplace_back("wisp basis bezier");
      break;
    case curve_basis::bspline:
      comments.emplace_back("wisp basis bspline");
      break;
    case curve_basis::catmull_rom:
      comments.emplace_back("wisp basis catmull_rom");
      break;
  }
  if (shape.profile == curve_profile::round) comments.emplace_back("wisp profile round");
  return comments;
}

}  // namespace wisp
