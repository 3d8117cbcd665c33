#pragma once

// What the mesh readers have in common: polygons become triangles or quads,
// lines become strands, and vertices move. Indices given here are in range.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "wisp/scene/scene.h"

namespace wisp {

// Polygons as quads, in which z == w is a triangle. More than four sides are cut
// into a fan from the first vertex, which is right for convex polygons.
struct face_builder {
  std::vector<ivec4> quads = {};
  bool has_quads = false;
  std::size_t too_small = 0;  // polygons of fewer than three vertices, left out
};
void add_polygon(face_builder& faces, std::span<const int> polygon);
// Triangles when there is nothing else, or else quads.
void finish_faces(face_builder& faces, shape_data& shape);

// Lines as lists of vertices.
struct strand_builder {
  std::vector<int> vertices = {};
  std::vector<std::size_t> ends = {};
};
// A line through the vertices. A line of two goes on where a line of two ended,
// since many writers know only segments.
void add_line(strand_builder& strands, std::span<const int> line, bool& open);
// Loose edges in any order: maximal chains without a branch, from the end with
// the lower index, then rings.
void add_edges(strand_builder& strands, std::span<const std::array<int, 2>> edges,
               std::size_t vertices);
// Makes the vertices of each strand consecutive. Where that moves them, vertices
// that nothing uses are dropped and those that faces, points or several strands
// share are repeated.
// Throws file_error for `file` when there are more vertices than an int counts.
void finish_strands(strand_builder& strands, shape_data& shape, const std::string& file);

// All vertices as points when the shape has no element at all.
void points_of_bare_vertices(shape_data& shape);

// Replaces the vertices by those at `order`, in that order.
void gather_vertices(shape_data& shape, std::span<const uint32_t> order);

// Comments that PLY and OBJ files of ours carry, "wisp basis bspline" and
// "wisp profile round"; others are ignored.
void apply_comment(shape_data& shape, std::string_view comment);
// Those that are not the default.
std::vector<std::string> strand_comments(const shape_data& shape);

}  // namespace wisp
