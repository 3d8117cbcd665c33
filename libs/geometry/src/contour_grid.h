#pragma once

// The sparse grid of contour(): blocks of 4 x 4 x 4 cells near the surface, with
// the signs at their corners and the crossings of their edges.
//
// A cell has the name of its lowest corner. Corner c of a cell is at the offset
// (c & 1, c >> 1 & 1, c >> 2). Edge e of a cell runs along axis a = e / 4, at the
// offset e & 1 along axis (a + 1) % 3 and e >> 1 & 1 along axis (a + 2) % 3.

#include <array>
#include <bit>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "wisp/geometry/contour.h"

namespace wisp::contouring {

inline constexpr int block_cells = 4;
inline constexpr int block_corners = block_cells + 1;

// The lattice of cells and the function on it, closed by the box if asked.
struct lattice {
  const std::function<double(const dvec3&)>* f = nullptr;
  dvec3 box_min = {0, 0, 0}, box_max = {0, 0, 0};
  double lipschitz = 1;
  bool closed = true;
  dvec3 origin = {0, 0, 0}, cell = {0, 0, 0};
  ivec3 cells = {0, 0, 0};
};
// Throws std::invalid_argument.
lattice make_lattice(const std::function<double(const dvec3&)>& f, const contour_options& options);
double evaluate(const lattice& grid, const dvec3& p);
// Unit gradient by central differences; zero if there is none.
dvec3 gradient(const lattice& grid, const dvec3& p);
// The point at lattice coordinates; the same bits for the same coordinates.
inline dvec3 lattice_point(const lattice& grid, const dvec3& at) {
  return grid.origin + grid.cell * at;
}

// Where an edge crosses the surface.
struct crossing {
  double t = 0;  // from the lower end, in cells
  dvec3 normal = {0, 0, 0};
};

struct block {
  ivec3 at = {0, 0, 0};                       // in blocks
  std::array<uint64_t, 2> inside = {0, 0};    // signs of 5 x 5 x 5 corners
  std::array<uint64_t, 3> edges = {0, 0, 0};  // by axis: which of the 64 lowest edges cross
  std::vector<crossing> crossings = {};       // of these, by axis, then by corner
  uint64_t surface = 0;                       // cells that the surface passes
  std::size_t first_cell = 0;                 // of these, in the list of all
};

inline bool inside_at(const block& b, const ivec3& corner) {
  int i = corner.x + block_corners * (corner.y + block_corners * corner.z);
  return ((b.inside[static_cast<std::size_t>(i >> 6)] >> (i & 63)) & 1) != 0;
}
inline int local_index(const ivec3& cell) {
  return cell.x + block_cells * (cell.y + block_cells * cell.z);
}
inline ivec3 local_cell(int index) { return {index & 3, (index >> 2) & 3, index >> 4}; }
inline int rank(uint64_t bits, int i) { return std::popcount(bits & ((uint64_t{1} << i) - 1)); }
// Signs of the corners of a cell of a block, a bit each.
int cell_signs(const block& b, const ivec3& cell);

struct sparse_grid {
  lattice grid = {};
  std::vector<block> blocks = {};  // by z, then y, then x
  std::unordered_map<uint64_t, std::size_t> index = {};
};
// Finds every block near the surface, and every block that one of their
// crossing edges touches, so that the four cells round a crossing are there.
sparse_grid sample_surface(const lattice& grid, int threads);

// The block of a cell (or of a corner), null if there is none.
const block* find_block(const sparse_grid& surface, const ivec3& cell);
// Throws std::invalid_argument if the edge does not cross: f contradicted itself.
const crossing& find_crossing(const sparse_grid& surface, const ivec3& cell, int edge);

// Unit offset along an axis, and the offset of edge e of a cell.
inline ivec3 axis_offset(int axis) { return {axis == 0, axis == 1, axis == 2}; }
inline ivec3 edge_offset(int e) {
  int a = e / 4;
  return (e & 1) * axis_offset((a + 1) % 3) + ((e >> 1) & 1) * axis_offset((a + 2) % 3);
}

}  // namespace wisp::contouring
