#pragma once

// Distances from the centers of a grid's cells, each computed when it is first
// asked for. Far from the surface they bound the distance of any other point of the
// cell well enough for a walk on spheres, at the cost of reading one number.

#include <cstddef>
#include <memory>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/bvh.h"
#include "wisp/geometry/closest_point.h"

namespace wisp {

struct distance_grid_options {
  int resolution = 64;  // cells along the longest side, 1 to 1024
  // By how much the grid is larger than the tree, on each side, as a part of the
  // tree's longest side. >= 0.
  double margin = 0.1;
};

struct distance_grid_data;  // within the library

// Copies share their cells. Any number of threads may query one at once: what a
// cell holds does not depend on who asked first.
class WISP_API distance_grid {
 public:
  distance_grid() = default;
  // Costs no more than to reserve the memory, of which only what is used is taken.
  // Throws std::invalid_argument for options out of range.
  explicit distance_grid(const bvh& tree, const distance_grid_options& options = {});

  const bvh& tree() const { return tree_; }
  // Cells in all, and those that have been asked for.
  std::size_t cells() const;
  std::size_t filled() const;

  // What bound_distance of the tree promises: from the cell where that is good
  // enough, else from the tree.
  distance_bounds bound_distance(const dvec3& p, double tolerance) const;

 private:
  bvh tree_ = {};
  std::shared_ptr<distance_grid_data> data_ = {};
};

inline distance_bounds bound_distance(const distance_grid& grid, const dvec3& p, double tolerance) {
  return grid.bound_distance(p, tolerance);
}

}  // namespace wisp
