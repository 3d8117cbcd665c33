#include "wisp/geometry/distance_grid.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace wisp {

namespace {

constexpr int brick_bits = 3;
constexpr std::size_t brick_cells = std::size_t{1} << (3 * brick_bits);
// Cells along the longest side of the coarsest grid, at least, and how much finer each
// next one is.
constexpr int coarsest = 32, finer = 4;
// Cells hold lower bounds of this tolerance.
constexpr double cell_tolerance = 0.02;

// A cell holds the logarithm of a bound, so that it takes a byte: 0 has not been asked
// for, n means least_bound * bound_ratio^(n - 1) cells, and 255 that or more.
using cell_code = std::atomic<std::uint8_t>;
using brick = std::array<cell_code, brick_cells>;
constexpr double least_bound = 0.25, bound_ratio = 1.022;

// Rounded down; bounds too small to be of use become the least of all.
std::uint8_t encode(double cells) {
  const double steps = std::floor(std::log(cells / least_bound) / std::log(bound_ratio));
  return static_cast<std::uint8_t>(steps > 0 ? std::min(steps + 1, 255.0) : 1);
}
std::array<double, 256> decoded_bounds() {
  std::array<double, 256> bounds = {};
  for (std::size_t n = 2; n < bounds.size(); ++n) {
    bounds[n] = least_bound * std::pow(bound_ratio, static_cast<double>(n) - 1) * (1 - 1e-9);
  }
  return bounds;
}

struct grid_level {
  double cell = 1, per_cell = 1;
  ivec3 size = {0, 0, 0};    // in cells
  ivec3 bricks = {0, 0, 0};  // in bricks
  std::vector<std::atomic<brick*>> table = {};
};

}  // namespace

struct distance_grid_data {
  dvec3 min = {0, 0, 0};
  double rounding = 0;                                // of coordinates in the grid
  double noise = 0;                                   // of bounds of the tree
  std::array<double, 256> bounds = decoded_bounds();  // by code, in cells
  std::vector<grid_level> levels = {};

  distance_grid_data() = default;
  distance_grid_data(const distance_grid_data&) = delete;
  distance_grid_data& operator=(const distance_grid_data&) = delete;
  ~distance_grid_data() {
    for (grid_level& level : levels) {
      for (auto& b : level.table) delete b.load();
    }
  }

  static std::atomic<brick*>& brick_of(grid_level& level, const ivec3& i) {
    return level.table[static_cast<std::size_t>(
        (i.x >> brick_bits) +
        level.bricks.x * ((i.y >> brick_bits) + level.bricks.y * (i.z >> brick_bits)))];
  }
  static cell_code& cell_at(grid_level& level, const ivec3& i);
};

cell_code& distance_grid_data::cell_at(grid_level& level, const ivec3& i) {
  std::atomic<brick*>& entry = brick_of(level, i);
  brick* cells = entry.load(std::memory_order_acquire);
  if (cells == nullptr) {
    auto made = std::make_unique<brick>();
    if (entry.compare_exchange_strong(cells, made.get(), std::memory_order_acq_rel)) {
      cells = made.release();
    }
  }
  constexpr int mask = (1 << brick_bits) - 1;
  return (*cells)[static_cast<std::size_t>(((i.z & mask) << (2 * brick_bits)) |
                                           ((i.y & mask) << brick_bits) | (i.x & mask))];
}

distance_grid::distance_grid(const bvh& tree, const distance_grid_options& options) : tree_(tree) {
  if (options.resolution < 1 || options.resolution > 4096) {
    throw std::invalid_argument("distance_grid: resolution is " +
                                std::to_string(options.resolution) + "; it should be 1 to 4096");
  }
  if (!(options.margin >= 0) || !std::isfinite(options.margin)) {
    throw std::invalid_argument("distance_grid: margin should be finite and not negative");
  }
  if (tree.empty()) return;
  const dvec3 extent = tree.max() - tree.min();
  const double longest = std::max({extent.x, extent.y, extent.z});
  const double margin = longest * options.margin;
  const double grown = longest + 2 * margin;
  if (!(grown > 0) || !std::isfinite(grown) || !(grown / options.resolution > 0) ||
      !std::isfinite(options.resolution / grown)) {
    return;
  }
  auto data = std::make_shared<distance_grid_data>();
  data->min = tree.min() - margin;
  const dvec3 reach = glm::max(glm::abs(data->min), glm::abs(tree.max() + margin));
  data->rounding = 4e-16 * std::max({reach.x, reach.y, reach.z});
  data->noise = 2e-6 * longest;
  std::vector<int> resolutions = {options.resolution};
  while (resolutions.back() >= finer * coarsest) resolutions.push_back(resolutions.back() / finer);
  for (auto r = resolutions.rbegin(); r != resolutions.rend(); ++r) {
    grid_level level;
    level.cell = grown / *r;
    level.per_cell = *r / grown;
    std::size_t count = 1;
    for (int a = 0; a < 3; ++a) {
      const double cells = (extent[a] + 2 * margin) * level.per_cell;
      level.size[a] = std::clamp(static_cast<int>(std::ceil(cells)), 1, *r);
      level.bricks[a] = ((level.size[a] - 1) >> brick_bits) + 1;
      count *= static_cast<std::size_t>(level.bricks[a]);
    }
    level.table = std::vector<std::atomic<brick*>>(count);
    data->levels.push_back(std::move(level));
  }
  data_ = std::move(data);
}

int distance_grid::levels() const { return data_ ? static_cast<int>(data_->levels.size()) : 0; }

std::size_t distance_grid::filled() const {
  std::size_t n = 0;
  for (int l = 0; l < levels(); ++l) {
    for (const auto& b : data_->levels[static_cast<std::size_t>(l)].table) {
      const brick* cells = b.load(std::memory_order_acquire);
      if (cells == nullptr) continue;
      for (const auto& c : *cells) n += c.load(std::memory_order_relaxed) != 0;
    }
  }
  return n;
}

std::size_t distance_grid::bytes() const {
  std::size_t n = 0;
  for (int l = 0; l < levels(); ++l) {
    const grid_level& level = data_->levels[static_cast<std::size_t>(l)];
    n += level.table.size() * sizeof(level.table[0]);
    for (const auto& b : level.table) {
      if (b.load(std::memory_order_relaxed) != nullptr) n += sizeof(brick);
    }
  }
  return n;
}

namespace {

// Where a point lies in a grid.
struct grid_place {
  ivec3 cell = {0, 0, 0};
  bool within = false;
};
grid_place place_in(const grid_level& level, const dvec3& from) {
  const dvec3 at = from * level.per_cell;
  const bool within = at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x < level.size.x &&
                      at.y < level.size.y && at.z < level.size.z;
  return {within ? ivec3(at) : ivec3(0), within};
}

// The bound of a cell's center, in cells.
double ask_cell(const bvh& tree, const distance_grid_data& grid, const grid_level& level,
                cell_code& cell, const ivec3& i) {
  std::uint8_t code = cell.load(std::memory_order_relaxed);
  if (code == 0) {
    const dvec3 center = grid.min + (dvec3(i) + 0.5) * level.cell;
    code = encode(bound_distance(tree, center, cell_tolerance).lower * level.per_cell);
    cell.store(code, std::memory_order_relaxed);
  }
  return grid.bounds[code];
}

// From the bound that a cell holds, but the largest, to the most that the distance of its center
// may be.
constexpr double upper_ratio = bound_ratio / (1 - cell_tolerance) * (1 + 1e-6);

// What the bound d of a cell's center says for a point of it.
distance_bounds bounds_in_cell(const distance_grid_data& grid, const grid_level& level,
                               const ivec3& i, double d, const dvec3& from) {
  const dvec3 center = (dvec3(i) + 0.5) * level.cell;
  const double near = d * level.cell, away = glm::length(from - center) + grid.rounding;
  if (d == grid.bounds.back()) return {std::max(near - away, 0.0)};
  return {std::max(near - away, 0.0), near * upper_ratio + away + grid.noise};
}

// Bounds with lower >= (1 - tolerance) upper from the first grid that has them; else
// lower is 0.
distance_bounds grid_bounds(const bvh& tree, distance_grid_data& grid, const dvec3& p,
                            double tolerance) {
  const dvec3 from = p - grid.min;
  for (grid_level& level : grid.levels) {
    const grid_place place = place_in(level, from);
    if (!place.within) break;
    const double d = ask_cell(tree, grid, level, grid.cell_at(level, place.cell), place.cell);
    const distance_bounds bounds = bounds_in_cell(grid, level, place.cell, d, from);
    if (bounds.lower >= (1 - tolerance) * bounds.upper) return bounds;
  }
  return {};
}

}  // namespace

double distance_grid::lower_bound(const dvec3& p, double tolerance) const {
  return data_ ? grid_bounds(tree_, *data_, p, tolerance).lower : 0;
}

// Grid by grid, and some points at a time: memory is called for before it is read, as
// points lie anywhere.
void distance_grid::lower_bounds(std::span<const dvec3> points, std::span<double> bounds,
                                 double tolerance) const {
  if (points.size() != bounds.size()) {
    throw std::invalid_argument("lower_bounds: " + std::to_string(bounds.size()) + " bounds for " +
                                std::to_string(points.size()) + " points");
  }
  std::fill(bounds.begin(), bounds.end(), 0.0);
  if (!data_) return;
  constexpr std::size_t group = 64;
  for (std::size_t first = 0; first < points.size(); first += group) {
    std::array<std::uint32_t, group> open;
    std::array<ivec3, group> cells;
    std::array<cell_code*, group> values;
    std::size_t count = std::min(group, points.size() - first);
    for (std::size_t j = 0; j < count; ++j) open[j] = static_cast<std::uint32_t>(first + j);
    for (grid_level& level : data_->levels) {
      std::size_t within = 0;
      for (std::size_t j = 0; j < count; ++j) {
        const grid_place place = place_in(level, points[open[j]] - data_->min);
        open[within] = open[j];
        cells[within] = place.cell;
        within += place.within;
        hwy::Prefetch(&data_->brick_of(level, place.cell));
      }
      for (std::size_t j = 0; j < within; ++j) {
        values[j] = &data_->cell_at(level, cells[j]);
        hwy::Prefetch(values[j]);
      }
      count = 0;
      for (std::size_t j = 0; j < within; ++j) {
        const std::uint32_t i = open[j];
        const double d = ask_cell(tree_, *data_, level, *values[j], cells[j]);
        const distance_bounds b =
            bounds_in_cell(*data_, level, cells[j], d, points[i] - data_->min);
        const bool enough = b.lower >= (1 - tolerance) * b.upper;
        bounds[i] = enough ? b.lower : 0;
        open[count] = i;
        count += !enough;
      }
    }
  }
}

distance_bounds distance_grid::bound_distance(const dvec3& p, double tolerance) const {
  if (data_) {
    const distance_bounds bounds = grid_bounds(tree_, *data_, p, tolerance);
    if (bounds.lower > 0) return bounds;
  }
  return wisp::bound_distance(tree_, p, tolerance);
}

}  // namespace wisp
