// The lattice of contour() and the function on it.

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "contour_grid.h"

namespace wisp::contouring {

namespace {

[[noreturn]] void reject(const std::string& reason) {
  throw std::invalid_argument("contour: " + reason);
}

void check(const std::function<double(const dvec3&)>& f, const contour_options& options) {
  if (!f) reject("f is empty; it must be a function of a point");
  if (options.resolution < 2 || options.resolution > 4096)
    reject("resolution is " + std::to_string(options.resolution) +
           "; it must be from 2 to 4096 cells");
  if (!(options.lipschitz > 0) || !std::isfinite(options.lipschitz))
    reject("lipschitz is " + std::to_string(options.lipschitz) +
           "; it must be a finite number above 0");
  if (options.threads < 0)
    reject("threads is " + std::to_string(options.threads) + "; it must be 0 (all) or more");
  dvec3 size = options.max - options.min;
  double largest = 0, side = std::max({size.x, size.y, size.z});
  for (int k = 0; k < 3; k++) {
    std::string axis(1, "xyz"[k]);
    if (!std::isfinite(options.min[k]) || !std::isfinite(options.max[k]) || !std::isfinite(size[k]))
      reject("the box is not finite along " + axis);
    if (!(size[k] > 0)) reject("the box is empty along " + axis + "; max must be above min");
    largest = std::max({largest, std::abs(options.min[k]), std::abs(options.max[k])});
  }
  // Every side, too: a cell must be many steps of a double.
  double smallest = std::min({size.x, size.y, size.z, side / options.resolution});
  if (!(smallest > largest * 1e-12))
    reject("the cells are too small for where the box is; move it to the origin or make it larger");
}

}  // namespace

lattice make_lattice(const std::function<double(const dvec3&)>& f, const contour_options& options) {
  check(f, options);
  lattice grid;
  grid.f = &f;
  grid.box_min = options.min;
  grid.box_max = options.max;
  grid.lipschitz = options.lipschitz;
  grid.closed = options.close_at_box;
  dvec3 size = options.max - options.min;
  double step = std::max({size.x, size.y, size.z}) / options.resolution;
  for (int k = 0; k < 3; k++) {
    double count = std::clamp(std::ceil(size[k] / step - 1e-6), 1.0, double(options.resolution));
    grid.cells[k] = static_cast<int>(count);
    grid.cell[k] = size[k] / count;
    grid.origin[k] = options.min[k];
    // The sides of the box cut cells in half, so that the solid is closed by
    // vertices on them and no corner of the lattice is on a side.
    if (grid.closed) {
      grid.origin[k] -= grid.cell[k] / 2;
      grid.cells[k]++;
    }
  }
  return grid;
}

// Closed, this is max(f at the nearest point of the box, lipschitz times the
// greatest excess over a side), which is Lipschitz everywhere as f is.
double evaluate(const lattice& grid, const dvec3& p) {
  double value = (*grid.f)(glm::clamp(p, grid.box_min, grid.box_max));
  if (!grid.closed) return value;
  dvec3 over = glm::max(grid.box_min - p, p - grid.box_max);
  double excess = std::max({over.x, over.y, over.z}) * grid.lipschitz;
  if (std::isnan(value)) return excess >= 0 ? excess : value;
  return std::max(value, excess);
}

dvec3 gradient(const lattice& grid, const dvec3& p) {
  dvec3 low = grid.origin, high = grid.origin + grid.cell * dvec3(grid.cells);
  dvec3 slope;
  for (int k = 0; k < 3; k++) {
    // Wide enough for six digits of f far from the origin, and within the grid.
    double step = std::max(grid.cell[k] * 1e-4, std::abs(p[k]) * 1e-9);
    dvec3 a = p, b = p;
    a[k] = std::max(p[k] - step, low[k]);
    b[k] = std::min(p[k] + step, high[k]);
    slope[k] = (evaluate(grid, b) - evaluate(grid, a)) / (b[k] - a[k]);
  }
  double size = std::max({std::abs(slope.x), std::abs(slope.y), std::abs(slope.z)});
  if (!(size > 0) || !std::isfinite(size)) return {0, 0, 0};
  slope /= size;
  return std::isfinite(slope.x + slope.y + slope.z) ? glm::normalize(slope) : dvec3{0, 0, 0};
}

}  // namespace wisp::contouring
