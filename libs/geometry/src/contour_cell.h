#pragma once

// The sheets of surface in one cell of contour(), and their vertices.

#include <array>
#include <span>

#include "wisp/geometry/contour.h"

namespace wisp::contouring {

// The edges of face (axis, side) of a cell in a ring: edge i joins the face's
// corners i and i + 1, which are (0,0) (1,0) (1,1) (0,1) along axes axis + 1 and
// axis + 2.
std::array<int, 4> face_edges(int axis, int side);
// The corners of that face, as corners of the cell.
std::array<int, 4> face_corners(int axis, int side);
// The corners of the face alternate in sign.
bool is_ambiguous(int signs, int axis, int side);

// A face with alternating signs holds two arcs of the surface, each of which
// cuts off a corner. True if corners 0 and 2 are cut off: edges 3, 0 and 1, 2
// of the ring are joined; otherwise 0, 1 and 2, 3.
bool cuts_first(int signs, int axis, int side, bool centre_inside);
// The arc (0 or 1) of ring edge i.
inline int arc_of(bool first, int i) { return first ? ((i + 1) & 3) >> 1 : i >> 1; }

// The closed curves in which the surface meets the faces of a cell: each is the
// border of one sheet. A cell has at most four.
struct cell_sheets {
  int count = 0;
  std::array<int, 12> of = {};  // sheet of each edge, -1 where it doesn't cross
};
// first[2 * axis + side]: cuts_first of the ambiguous faces.
cell_sheets find_sheets(int signs, const std::array<bool, 6>& first);

// The point of the box [0, size] that fits the tangent planes best; where they
// don't say, as near the mean of the points as can be.
struct tangent_plane {
  dvec3 point = {0, 0, 0};
  dvec3 normal = {0, 0, 0};  // may be zero: only the point counts
};
dvec3 fit_vertex(std::span<const tangent_plane> planes, const dvec3& size, bool sharp);

}  // namespace wisp::contouring
