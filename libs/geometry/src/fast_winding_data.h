#pragma once

// What fast winding numbers are computed from, and what their vector code and the code
// around it share. Lengths are normalized as those of the tree are.

#include <array>
#include <cstdint>
#include <vector>

#include "bvh_data.h"
#include "query.h"
#include "wisp/geometry/fast_winding.h"

namespace wisp {

// A number of each of eight children or elements.
struct alignas(32) eight_floats {
  float v[bvh_width];
};

// The rows of a node: where its children are and from where on they are expanded,
// which children they are, and their moments, times -1/(4 pi).
enum fast_row : std::size_t {
  row_center = 0,  // x, y, z: area-weighted centroid
  row_radius2 = 3,
  row_child = 4,   // bits of bvh_node's; those that are not there are far away
  row_first = 5,   // coefficients of x, y, z,
  row_second = 8,  // of x^2 - z^2, y^2 - z^2, xy, xz, yz,
  row_third = 13,  // x (y^2 - x^2/3), x (z^2 - x^2/3), those of y, z; xyz
  row_end = 20
};
constexpr std::size_t rows_of(int order) {
  return order == 1 ? row_second : order == 2 ? row_third : row_end;
}

struct fast_winding_data {
  bvh tree = {};
  bool points = false;
  int order = 3;
  dvec3 total = {0, 0, 0};               // area vector of all
  std::vector<eight_floats> rows = {};   // rows_of(order) to each node of the tree
  std::vector<eight_floats> areas = {};  // of points: area vectors / (4 pi), 3 to a leaf
};

struct fast_query {
  const fast_winding_data* data;
  dvec3 p;  // normalized
  float beta2;
  double sum;
};

// The vector code: adds up what the tree holds.
void run_fast_winding(fast_query& q);

// Half the solid angle of a triangle in double, p normalized.
double half_angle(const fast_winding_data& fast, uint32_t slot, const dvec3& p);

// Fills rows and total. `areas`: the area vector of each slot, for points.
void build_moments(fast_winding_data& fast, const std::vector<dvec3>& areas, int threads);

}  // namespace wisp
