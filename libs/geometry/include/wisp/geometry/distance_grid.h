#pragma once

// Lower bounds of distances from the centers of cells, each computed when it is first
// asked for. They bound the distance of any other point of the cell well enough for a
// walk on spheres, at the cost of reading a few numbers.
//
// There are grids of several resolutions, each four times as fine as the last. A point asks
// them from the coarsest to the first whose cell is small beside the distance, so that
// fine cells are only made next to the surface. A cell takes a byte. Cells are held in bricks of 8
// x 8 x 8, made when one of theirs is asked for.

#include <cstddef>
#include <memory>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/bvh.h"
#include "wisp/geometry/closest_point.h"

namespace wisp {

struct distance_grid_options {
  int resolution = 1024;  // of the finest grid, cells along the longest side, 1 to 4096
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
  // Allocates a pointer for each brick and no cells. Throws std::invalid_argument for
  // options out of range.
  explicit distance_grid(const bvh& tree, const distance_grid_options& options = {});

  const bvh& tree() const { return tree_; }
  // Grids; 0 for an empty tree or one without extent.
  int levels() const;
  // Cells that have been asked for, of all grids.
  std::size_t filled() const;
  // Memory held: bricks, and pointers to them.
  std::size_t bytes() const;

  // A lower bound of the distance of p that is no less than (1 - tolerance) times the
  // distance, from a cell alone; 0 where no cell has one.
  double lower_bound(const dvec3& p, double tolerance) const;

  // The same for each of `points`, many at once. The spans must have one size
  // (std::invalid_argument).
  void lower_bounds(std::span<const dvec3> points, std::span<double> bounds,
                    double tolerance) const;

  // What bound_distance of the tree promises: from a cell where one is good enough, else
  // from the tree.
  distance_bounds bound_distance(const dvec3& p, double tolerance) const;

 private:
  bvh tree_ = {};
  std::shared_ptr<distance_grid_data> data_ = {};
};

inline distance_bounds bound_distance(const distance_grid& grid, const dvec3& p, double tolerance) {
  return grid.bound_distance(p, tolerance);
}

}  // namespace wisp
