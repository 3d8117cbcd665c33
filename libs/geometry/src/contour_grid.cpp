#include "contour_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "wisp/core/parallel.h"

namespace wisp::contouring {

namespace {

uint64_t block_key(const ivec3& at) {
  return (static_cast<uint64_t>(at.z) << 40) | (static_cast<uint64_t>(at.y) << 20) |
         static_cast<uint64_t>(at.x);
}

// The blocks hold corners 0 to cells, so one more than the cells may need.
ivec3 block_counts(const lattice& grid) {
  return {grid.cells.x / block_cells + 1, grid.cells.y / block_cells + 1,
          grid.cells.z / block_cells + 1};
}

// No part of the surface is in a cube of `size` blocks, by the Lipschitz bound.
bool is_empty(const lattice& grid, const ivec3& at, int size) {
  dvec3 low, high;
  for (int k = 0; k < 3; k++) {
    low[k] = at[k] * block_cells;
    high[k] = std::min((at[k] + size) * block_cells, grid.cells[k]);
  }
  double radius = glm::length((high - low) * grid.cell) / 2;
  double value = evaluate(grid, lattice_point(grid, (low + high) * 0.5));
  return std::abs(value) > grid.lipschitz * radius * (1 + 1e-9);  // false for NaN
}

// Blocks that may touch the surface, from the whole grid down.
std::vector<ivec3> find_blocks(const lattice& grid, int threads) {
  ivec3 counts = block_counts(grid);
  int size = 1;
  while (size < std::max({counts.x, counts.y, counts.z})) size *= 2;
  std::vector<ivec3> nodes = {{0, 0, 0}};
  for (;; size /= 2) {
    std::vector<char> empty(nodes.size(), 0);
    parallel_for(
        nodes.size(), threads, [&](std::size_t i) { empty[i] = is_empty(grid, nodes[i], size); },
        16);
    std::vector<ivec3> next;
    for (std::size_t i = 0; i < nodes.size(); i++) {
      if (empty[i]) continue;
      if (size == 1) {
        next.push_back(nodes[i]);
        continue;
      }
      for (int c = 0; c < 8; c++) {
        ivec3 at = nodes[i] + (size / 2) * ivec3{c & 1, (c >> 1) & 1, c >> 2};
        if (at.x < counts.x && at.y < counts.y && at.z < counts.z) next.push_back(at);
      }
    }
    nodes = std::move(next);
    if (size == 1) return nodes;
  }
}

// The root on an edge of length 1 with a sign change, to 1e-10: Illinois (Dowell
// and Jarratt 1971), pushed off the ends of the bracket so that both close in,
// and bisection when that is slow or a value is not finite.
template <typename F>
double find_root(const F& f, double low_value, double high_value) {
  constexpr double tolerance = 1e-10;
  bool low_inside = low_value < 0;
  double low = 0, high = 1, last_width = 2;
  int side = 0;
  for (int i = 0; high - low > tolerance; i++) {
    double t = low - low_value * (high - low) / (high_value - low_value);
    bool slow = i % 4 == 3 && high - low > last_width / 4;
    if (i % 4 == 3) last_width = high - low;
    if (slow || !std::isfinite(t) || i > 60) t = (low + high) / 2;
    t = std::clamp(t, low + 0.4 * tolerance, high - 0.4 * tolerance);
    double value = f(t);
    if ((value < 0) == low_inside) {
      low = t;
      low_value = value;
      if (side < 0) high_value /= 2;
      side = -1;
    } else {
      high = t;
      high_value = value;
      if (side > 0) low_value /= 2;
      side = 1;
    }
  }
  return (low + high) / 2;
}

void sample_block(const lattice& grid, block& b) {
  constexpr int n = block_corners;
  std::array<double, n * n * n> values;
  ivec3 base = b.at * block_cells;
  for (int i = 0; i < n * n * n; i++) {
    ivec3 corner = base + ivec3{i % n, i / n % n, i / (n * n)};
    auto k = static_cast<std::size_t>(i);
    values[k] = std::numeric_limits<double>::infinity();
    if (corner.x > grid.cells.x || corner.y > grid.cells.y || corner.z > grid.cells.z) continue;
    values[k] = evaluate(grid, lattice_point(grid, dvec3(corner)));
    if (values[k] < 0) b.inside[k >> 6] |= uint64_t{1} << (k & 63);
  }
  if ((b.inside[0] | b.inside[1]) == 0) return;

  for (int i = 0; i < 64; i++) {
    ivec3 cell = base + local_cell(i);
    if (cell.x >= grid.cells.x || cell.y >= grid.cells.y || cell.z >= grid.cells.z) continue;
    int signs = cell_signs(b, local_cell(i));
    if (signs != 0 && signs != 255) b.surface |= uint64_t{1} << i;
  }
  constexpr std::array<int, 3> stride = {1, n, n * n};
  for (int axis = 0; axis < 3; axis++)
    for (int i = 0; i < 64; i++) {
      ivec3 low = local_cell(i), corner = base + low;
      if (corner[axis] >= grid.cells[axis]) continue;
      if (glm::any(glm::greaterThan(corner, grid.cells))) continue;
      if (inside_at(b, low) == inside_at(b, low + axis_offset(axis))) continue;
      auto k = static_cast<std::size_t>(low.x + n * (low.y + n * low.z));
      auto at = [&](double t) {
        dvec3 p = dvec3(corner);
        p[axis] += t;
        return lattice_point(grid, p);
      };
      crossing c;
      c.t = find_root([&](double t) { return evaluate(grid, at(t)); }, values[k],
                      values[k + static_cast<std::size_t>(stride[static_cast<std::size_t>(axis)])]);
      c.normal = gradient(grid, at(c.t));
      b.edges[static_cast<std::size_t>(axis)] |= uint64_t{1} << i;
      b.crossings.push_back(c);
    }
}

// Calls visit(at) for the other blocks that hold a cell at a crossing edge of b.
template <typename F>
void for_neighbours(const lattice& grid, const block& b, const F& visit) {
  ivec3 counts = block_counts(grid);
  uint32_t wanted = 0;  // of the 27 blocks around
  for (int axis = 0; axis < 3; axis++) {
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int i = 0; i < block_cells; i++)
      for (int j = 0; j < block_corners; j++)
        for (int k = 0; k < block_corners; k++) {
          bool border = j == 0 || j == block_cells || k == 0 || k == block_cells;
          if (!border) continue;
          ivec3 low = {0, 0, 0};
          low[axis] = i;
          low[u] = j;
          low[v] = k;
          if ((b.at * block_cells + low)[axis] >= grid.cells[axis]) continue;
          if (glm::any(glm::greaterThan(b.at * block_cells + low, grid.cells))) continue;
          if (inside_at(b, low) == inside_at(b, low + axis_offset(axis))) continue;
          int du = j == 0 ? -1 : j == block_cells ? 1 : 0;
          int dv = k == 0 ? -1 : k == block_cells ? 1 : 0;
          for (int way = 1; way < 4; way++) {
            ivec3 d = {0, 0, 0};
            d[u] = (way & 1) ? du : 0;
            d[v] = (way & 2) ? dv : 0;
            wanted |= 1u << (d.x + 1 + 3 * (d.y + 1) + 9 * (d.z + 1));
          }
        }
  }
  for (int i = 0; i < 27; i++) {
    ivec3 at = b.at + ivec3{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
    if (((wanted >> i) & 1) == 0 || i == 13) continue;
    if (glm::any(glm::lessThan(at, ivec3{0, 0, 0}))) continue;
    if (glm::any(glm::greaterThanEqual(at, counts))) continue;
    visit(at);
  }
}

}  // namespace

int cell_signs(const block& b, const ivec3& cell) {
  int signs = 0;
  for (int c = 0; c < 8; c++)
    if (inside_at(b, cell + ivec3{c & 1, (c >> 1) & 1, c >> 2})) signs |= 1 << c;
  return signs;
}

sparse_grid sample_surface(const lattice& grid, int threads) {
  sparse_grid surface;
  surface.grid = grid;
  auto add = [&](const ivec3& at) {
    if (!surface.index.emplace(block_key(at), surface.blocks.size()).second) return;
    surface.blocks.emplace_back();
    surface.blocks.back().at = at;
  };
  for (const ivec3& at : find_blocks(grid, threads)) add(at);
  // Blocks found through a neighbour are there only when lipschitz is too small
  // or by rounding; without them the mesh would have holes.
  for (std::size_t begin = 0; begin < surface.blocks.size();) {
    std::size_t end = surface.blocks.size();
    parallel_for(
        end - begin, threads, [&](std::size_t i) { sample_block(grid, surface.blocks[begin + i]); },
        4);
    for (std::size_t i = begin; i < end; i++) {
      std::vector<ivec3> wanted;  // add() moves the blocks
      for_neighbours(grid, surface.blocks[i], [&](const ivec3& at) { wanted.push_back(at); });
      for (const ivec3& at : wanted) add(at);
    }
    begin = end;
  }
  std::erase_if(surface.blocks,
                [](const block& b) { return b.surface == 0 && b.crossings.empty(); });
  std::sort(surface.blocks.begin(), surface.blocks.end(),
            [](const block& a, const block& b) { return block_key(a.at) < block_key(b.at); });
  surface.index.clear();
  for (std::size_t i = 0; i < surface.blocks.size(); i++)
    surface.index.emplace(block_key(surface.blocks[i].at), i);
  return surface;
}

const block* find_block(const sparse_grid& surface, const ivec3& cell) {
  if (cell.x < 0 || cell.y < 0 || cell.z < 0) return nullptr;
  auto found = surface.index.find(block_key(cell / block_cells));
  return found == surface.index.end() ? nullptr : &surface.blocks[found->second];
}

const crossing& find_crossing(const sparse_grid& surface, const ivec3& cell, int edge) {
  ivec3 corner = cell + edge_offset(edge);
  const block* b = find_block(surface, corner);
  auto axis = static_cast<std::size_t>(edge / 4);
  int i = local_index(corner - corner / block_cells * block_cells);
  if (!b || ((b->edges[axis] >> i) & 1) == 0)
    throw std::invalid_argument(
        "contour: f gave two values at the same point; it must depend on the point alone");
  int place = rank(b->edges[axis], i);
  for (std::size_t a = 0; a < axis; a++) place += std::popcount(b->edges[a]);
  return b->crossings[static_cast<std::size_t>(place)];
}

}  // namespace wisp::contouring
