#pragma once

// What exact winding numbers are made of.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "boundary.h"
#include "bvh_data.h"
#include "wisp/geometry/winding_number.h"

namespace wisp {

// The part of an axis-parallel line between p and a point q that is on no triangle.
struct crossing_query {
  const bvh_data* data;
  int axis;
  bool towards_max;  // the direction from p to q
  bool endless;      // q lies outside of the box of all triangles
  dvec3 p;           // as given
  dvec3 x;           // normalized
  double q;          // the coordinate of q along axis, normalized; not if endless
};

// The sum of sign((q - p).n) over the triangles with normal n that lie between p and q,
// p in the box of all triangles: the difference of their winding numbers, if the mesh
// is closed. ray_crossings.cpp
int count_crossings(const crossing_query& query);

// The segment in single precision, its coordinates in the order u, v, k, k along it:
// rounded to compute with, and rounded outwards for boxes.
struct float_segment {
  int u, v, k;
  float p[3], low[3], high[3];
  float to_q;
};

// What one triangle adds, in exact arithmetic.
int exact_crossing(const crossing_query& query, uint32_t slot);

// A grid over the box of a tree, in normalized coordinates. Where no triangle touches
// a cell, the crossings of a ray are one number in all of it; of an open mesh, that of
// rays in one direction, if no such ray from the cell meets the boundary.
struct crossing_grid {
  int size[3] = {0, 0, 0};
  dvec3 low = {0, 0, 0};
  double cell = 0, per_cell = 0;  // edge length of a cell, and 1 / it
  int direction = -1;             // 2 * axis + (towards the maximum); -1: any
  // The number; or, where there is none, where to find the next cell that has one.
  std::vector<int16_t> cells = {};

  static constexpr int most = 1 << 13;  // of |number|, exclusive
  static constexpr int unknown = 1 << 14;
  static int16_t way(int direction, int steps) {
    return static_cast<int16_t>(unknown | direction << 10 | steps);
  }
  static constexpr int most_steps = (1 << 10) - 1;

  bool empty() const { return cells.empty(); }
  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(x);
  }
};

struct winding_data {
  bvh tree = {};
  boundary_tree boundary = {};
  crossing_grid grid = {};
  std::size_t edges = 0, loops = 0;
  int direction = 0;  // of rays from within the box of an open mesh, as in the grid
};

// With the edges that open_edges() found.
winding make_winding(const bvh& tree, std::span<const directed_edge> edges,
                     const winding_options& options);

// The direction in which the boundary casts the least shadow: 2 * axis + (towards max).
int least_shadow(const bvh_data& data, const boundary_loops& loops);

// Empty where a grid would not pay.
crossing_grid make_crossing_grid(const bvh_data& data, const boundary_loops& loops, int direction);

}  // namespace wisp
