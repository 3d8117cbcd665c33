#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "winding_exact.h"
#include "wisp/core/parallel.h"
#include "wisp/geometry/solid_angle.h"

namespace wisp {

namespace {

bool is_finite(const dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

// Crossings on the way from p, in the box of all triangles, out of it in a direction:
// 2 * axis + (towards the maximum).
int crossings_out(const bvh_data& data, const dvec3& p, const dvec3& x, int direction) {
  crossing_query q;
  q.data = &data;
  q.axis = direction / 2;
  q.towards_max = direction % 2 != 0;
  q.endless = true;
  q.p = p;
  q.x = x;
  q.q = 0;
  return count_crossings(q);
}

// The shortest way out of the box.
int way_out(const bvh_data& data, const dvec3& p) {
  int best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int direction = 0; direction < 6; ++direction) {
    const int a = direction / 2;
    const double way = direction % 2 != 0 ? data.max[a] - p[a] : p[a] - data.min[a];
    if (way < least) {
      least = way;
      best = direction;
    }
  }
  return best;
}

int crossings_from(const winding_data& w, const dvec3& p, const dvec3& x) {
  const bvh_data& data = *w.tree.data();
  const crossing_grid& grid = w.grid;
  if (grid.empty()) {
    const bool closed = w.boundary.edges == 0;
    return crossings_out(data, p, x, closed ? way_out(data, p) : w.direction);
  }
  int at[3];
  for (int a = 0; a < 3; ++a) {
    const int i = static_cast<int>((x[a] - grid.low[a]) * grid.per_cell);
    at[a] = std::clamp(i, 0, grid.size[a] - 1);
  }
  const int cell = grid.cells[grid.index(at[0], at[1], at[2])];
  if (std::abs(cell) < grid.most) return cell;
  const int direction = cell >> 10 & 7, steps = cell & grid.most_steps;
  const int a = direction / 2;
  at[a] += direction % 2 != 0 ? steps : -steps;
  if (at[a] < 0 || at[a] >= grid.size[a]) return crossings_out(data, p, x, direction);
  crossing_query q;
  q.data = &data;
  q.axis = a;
  q.towards_max = direction % 2 != 0;
  q.endless = false;
  q.p = p;
  q.x = x;
  q.q = grid.low[a] + (at[a] + 0.5) * grid.cell;
  return count_crossings(q) + grid.cells[grid.index(at[0], at[1], at[2])];
}

}  // namespace

double winding_number_sum(std::span<const ivec3> triangles, std::span<const dvec3> positions,
                          const dvec3& p) {
  if (!(p.x == p.x && p.y == p.y && p.z == p.z)) return std::numeric_limits<double>::quiet_NaN();
  if (!is_finite(p)) return 0;
  double sum = 0;
  for (const ivec3& t : triangles) {
    dvec3 v[3];
    for (int k = 0; k < 3; ++k) {
      if (t[k] < 0 || static_cast<std::size_t>(t[k]) >= positions.size()) {
        throw std::invalid_argument("winding number: vertex " + std::to_string(t[k]) +
                                    " of a triangle; there are " +
                                    std::to_string(positions.size()));
      }
      v[k] = positions[static_cast<std::size_t>(t[k])];
    }
    if (!is_finite(v[0]) || !is_finite(v[1]) || !is_finite(v[2])) continue;
    sum += solid_angle(p, v[0], v[1], v[2]);
  }
  return sum / (4 * std::numbers::pi);
}

std::size_t winding::boundary_edges() const { return data_ ? data_->edges : 0; }
std::size_t winding::boundary_loops() const { return data_ ? data_->loops : 0; }
std::size_t winding::grid_cells() const { return data_ ? data_->grid.cells.size() : 0; }
std::size_t winding::bytes() const {
  if (!data_) return 0;
  return sizeof(winding_data) + data_->boundary.bytes() +
         data_->grid.cells.capacity() * sizeof(int16_t);
}
const bvh& winding::tree() const {
  static const bvh none;
  return data_ ? data_->tree : none;
}

winding make_winding(const bvh& tree, std::span<const directed_edge> edges,
                     const winding_options& options) {
  auto w = std::make_shared<winding_data>();
  w->tree = tree;
  if (tree.empty()) return winding(std::move(w));
  const bvh_data& data = *tree.data();
  const auto loops = chain_edges(data, edges, options.threads);
  w->edges = edges.size();
  w->loops = loops.count();
  w->boundary = make_boundary_tree(loops, options.tolerance, options.threads);
  w->direction = least_shadow(data, loops);
  if (options.grid) w->grid = make_crossing_grid(data, loops, w->direction);
  return winding(std::move(w));
}

winding make_winding(const bvh& tree, const winding_options& options) {
  if (!(options.tolerance >= 0)) {
    throw std::invalid_argument("winding number: a tolerance of " +
                                std::to_string(options.tolerance) + "; it must be >= 0");
  }
  if (tree.empty()) return make_winding(tree, {}, options);
  if (tree.element() != bvh_element::triangle) {
    throw std::invalid_argument("winding number: of a tree that is not over triangles");
  }
  return make_winding(tree, open_edges(*tree.data(), options.threads), options);
}

double winding_number(const winding& handle, const dvec3& p) {
  if (!(p.x == p.x && p.y == p.y && p.z == p.z)) return std::numeric_limits<double>::quiet_NaN();
  if (!handle.data() || handle.data()->tree.empty()) return 0;
  const winding_data& w = *handle.data();
  const bvh_data& data = *w.tree.data();
  // out of the box there is a ray that crosses nothing
  int out = -1;
  double farthest = 0;
  for (int a = 0; a < 3; ++a) {
    const double below = data.min[a] - p[a], above = p[a] - data.max[a];
    if (below > farthest) {
      farthest = below;
      out = 2 * a;
    }
    if (above > farthest) {
      farthest = above;
      out = 2 * a + 1;
    }
  }
  if (out >= 0) {
    // the size of what is left is that of (1 / distance)^2
    if (w.edges == 0 || !(farthest * data.scale < 1e70)) return 0;
    return boundary_winding(w.boundary, p * data.scale, out / 2, out % 2 != 0 ? 1 : -1);
  }
  const int crossings = crossings_from(w, p, data.normalized(p));
  if (w.edges == 0) return crossings;
  const int direction = w.direction;
  return crossings +
         boundary_winding(w.boundary, p * data.scale, direction / 2, direction % 2 != 0 ? 1 : -1);
}

void winding_numbers(const winding& w, std::span<const dvec3> points, std::span<double> results,
                     int threads) {
  if (points.size() != results.size()) {
    throw std::invalid_argument("winding_numbers: " + std::to_string(results.size()) +
                                " results for " + std::to_string(points.size()) + " points");
  }
  // to put points in an order would cost more than most queries
  parallel_for(
      points.size(), thread_count(threads),
      [&](std::size_t i) { results[i] = winding_number(w, points[i]); }, 512);
}

}  // namespace wisp
