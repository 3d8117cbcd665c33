#include "wisp/geometry/distance_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>

namespace wisp {

struct distance_grid_data {
  dvec3 min = {0, 0, 0};
  double cell = 1;
  double per_cell = 1;
  ivec3 size = {0, 0, 0};
  std::size_t count = 0;
  // A distance is not 0 here; a cell that is has not been asked for. calloc's pages
  // are taken when they are written to.
  struct release {
    void operator()(void* p) const { std::free(p); }
  };
  std::unique_ptr<float, release> cells = {};
};

distance_grid::distance_grid(const bvh& tree, const distance_grid_options& options) : tree_(tree) {
  if (options.resolution < 1 || options.resolution > 1024) {
    throw std::invalid_argument("distance_grid: resolution is " +
                                std::to_string(options.resolution) + "; it should be 1 to 1024");
  }
  if (!(options.margin >= 0) || !std::isfinite(options.margin)) {
    throw std::invalid_argument("distance_grid: margin should be finite and not negative");
  }
  if (tree.empty()) return;
  const dvec3 extent = tree.max() - tree.min();
  const double longest = std::max({extent.x, extent.y, extent.z});
  const double grown = longest * (1 + 2 * options.margin);
  if (!(grown > 0) || !std::isfinite(grown)) return;
  auto data = std::make_shared<distance_grid_data>();
  data->cell = grown / options.resolution;
  data->per_cell = options.resolution / grown;
  if (!(data->cell > 0) || !std::isfinite(data->per_cell)) return;
  data->min = tree.min() - longest * options.margin;
  for (int a = 0; a < 3; ++a) {
    const double cells = (extent[a] + 2 * longest * options.margin) * data->per_cell;
    data->size[a] = std::clamp(static_cast<int>(std::ceil(cells)), 1, options.resolution);
  }
  data->count = static_cast<std::size_t>(data->size.x) * static_cast<std::size_t>(data->size.y) *
                static_cast<std::size_t>(data->size.z);
  data->cells.reset(static_cast<float*>(std::calloc(data->count, sizeof(float))));
  if (!data->cells) throw std::bad_alloc();
  data_ = std::move(data);
}

std::size_t distance_grid::cells() const { return data_ ? data_->count : 0; }

std::size_t distance_grid::filled() const {
  std::size_t n = 0;
  for (std::size_t i = 0; i < cells(); ++i) {
    n += std::atomic_ref<float>(data_->cells.get()[i]).load(std::memory_order_relaxed) != 0;
  }
  return n;
}

distance_bounds distance_grid::bound_distance(const dvec3& p, double tolerance) const {
  if (!data_) return wisp::bound_distance(tree_, p, tolerance);
  const dvec3 at = (p - data_->min) * data_->per_cell;
  for (int a = 0; a < 3; ++a) {
    if (!(at[a] >= 0 && at[a] < data_->size[a])) return wisp::bound_distance(tree_, p, tolerance);
  }
  const ivec3 i(at);
  const std::size_t index =
      static_cast<std::size_t>(i.x) +
      static_cast<std::size_t>(data_->size.x) *
          (static_cast<std::size_t>(i.y) +
           static_cast<std::size_t>(data_->size.y) * static_cast<std::size_t>(i.z));
  const dvec3 center = data_->min + (dvec3(i) + 0.5) * data_->cell;
  std::atomic_ref<float> cell(data_->cells.get()[index]);
  float d = cell.load(std::memory_order_relaxed);
  if (d == 0) {
    d = static_cast<float>(closest_point(tree_, center).distance * data_->per_cell);
    d = std::clamp(d, 1e-30f, 1e30f);
    cell.store(d, std::memory_order_relaxed);
  }
  // d is rounded, and so is the center where coordinates are large
  const double distance = d * data_->cell, away = glm::length(p - center);
  const dvec3 size = glm::max(glm::abs(p), glm::abs(data_->min));
  const double slack = 1e-7 * distance + 4e-16 * std::max({size.x, size.y, size.z});
  const distance_bounds bounds = {distance - away - slack, distance + away + slack};
  if (bounds.lower >= (1 - tolerance) * bounds.upper) return bounds;
  return wisp::bound_distance(tree_, p, tolerance);
}

}  // namespace wisp
