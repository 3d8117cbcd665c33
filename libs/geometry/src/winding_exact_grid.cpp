// The grid of crossing numbers: cells that a triangle may touch are marked, as are, of
// an open mesh, those that the boundary casts a shadow on, against the direction of the
// rays. In each connected part of what is left one ray finds the number.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "winding_exact.h"

namespace wisp {

namespace {

constexpr int16_t not_yet = std::numeric_limits<int16_t>::min();
constexpr int16_t marked = crossing_grid::unknown;

struct cell_box {
  int low[3], high[3];  // both of it
  int64_t count() const {
    int64_t n = 1;
    for (int a = 0; a < 3; ++a) n *= high[a] - low[a] + 1;
    return n;
  }
};

// The cells that a box may touch, with room for rounding.
cell_box cells_of(const crossing_grid& g, const dvec3& low, const dvec3& high) {
  constexpr double room = 1e-4;
  cell_box b;
  for (int a = 0; a < 3; ++a) {
    const double l = (low[a] - g.low[a]) * g.per_cell - room;
    const double h = (high[a] - g.low[a]) * g.per_cell + room;
    b.low[a] = std::clamp(static_cast<int>(l), 0, g.size[a] - 1);
    b.high[a] = std::clamp(static_cast<int>(h), 0, g.size[a] - 1);
  }
  return b;
}

cell_box cells_of(const crossing_grid& g, const bvh_data& data, uint32_t slot) {
  const auto v = data.corners(slot);
  return cells_of(g, data.normalized(glm::min(v[0], glm::min(v[1], v[2]))),
                  data.normalized(glm::max(v[0], glm::max(v[1], v[2]))));
}

cell_box shadow_of(const crossing_grid& g, const dvec3& low, const dvec3& high, int direction) {
  cell_box b = cells_of(g, low, high);
  const int a = direction / 2;
  (direction % 2 != 0 ? b.low : b.high)[a] = direction % 2 != 0 ? 0 : g.size[a] - 1;
  return b;
}

// Calls body(low, high) with the normalized box of each boundary edge.
template <typename Body>
void for_each_edge(const bvh_data& data, const boundary_loops& loops, const Body& body) {
  const dvec3 center = data.center * data.scale;
  for (std::size_t i = 0; i < loops.count(); ++i) {
    for (uint32_t j = loops.starts[i]; j < loops.starts[i + 1]; ++j) {
      const uint32_t next = j + 1 < loops.starts[i + 1] ? j + 1 : loops.starts[i];
      const dvec3 a = loops.points[j] - center, b = loops.points[next] - center;
      body(glm::min(a, b), glm::max(a, b));
    }
  }
}

void mark(crossing_grid& g, const cell_box& b) {
  for (int z = b.low[2]; z <= b.high[2]; ++z) {
    for (int y = b.low[1]; y <= b.high[1]; ++y) {
      const auto row = g.cells.begin() + static_cast<std::ptrdiff_t>(g.index(0, y, z));
      std::fill(row + b.low[0], row + b.high[0] + 1, marked);
    }
  }
}

// A grid of about `cells` cells over the box of the data.
crossing_grid place_grid(const bvh_data& data, double cells) {
  crossing_grid g;
  const dvec3 low = data.normalized(data.min), high = data.normalized(data.max);
  const dvec3 extent = glm::max(high - low, dvec3{1e-3});
  g.cell = std::cbrt(extent.x * extent.y * extent.z / cells);
  g.cell = std::max(g.cell, std::max({extent.x, extent.y, extent.z}) / 1000);
  g.per_cell = 1 / g.cell;
  for (int a = 0; a < 3; ++a) {
    g.size[a] = static_cast<int>(extent[a] * g.per_cell + 1.01);
    g.low[a] = (low[a] + high[a]) / 2 - 0.5 * g.size[a] * g.cell;
  }
  return g;
}

std::size_t cell_count(const crossing_grid& g) {
  std::size_t n = 1;
  for (const int s : g.size) n *= static_cast<std::size_t>(s);
  return n;
}

int16_t number_at(const bvh_data& data, const crossing_grid& g, const std::array<int, 3>& at) {
  crossing_query q;
  q.data = &data;
  q.endless = true;
  q.q = 0;
  int direction = g.direction;
  if (direction < 0) {
    int least = std::numeric_limits<int>::max();
    for (int a = 0; a < 3; ++a) {
      const std::size_t i = static_cast<std::size_t>(a);
      const int ways[2] = {at[i], g.size[a] - 1 - at[i]};
      for (int side = 0; side < 2; ++side) {
        if (ways[side] < least) direction = 2 * a + side;
        least = std::min(least, ways[side]);
      }
    }
  }
  q.axis = direction / 2;
  q.towards_max = direction % 2 != 0;
  for (int a = 0; a < 3; ++a) {
    q.x[a] = g.low[a] + (at[static_cast<std::size_t>(a)] + 0.5) * g.cell;
  }
  q.p = data.center + q.x * data.unit;
  q.x = data.normalized(q.p);
  // the middle of an outermost cell may lie out of the box
  for (int a = 0; a < 3; ++a) {
    if (q.p[a] < data.min[a] || q.p[a] > data.max[a]) {
      if (g.direction < 0) return 0;
      if (a != q.axis || (q.p[a] > data.max[a]) == q.towards_max) return 0;
    }
  }
  const int n = count_crossings(q);
  return std::abs(n) < g.most ? static_cast<int16_t>(n) : marked;
}

// Gives all cells that are connected to `from` its number: row by row.
void fill_part(crossing_grid& g, const std::array<int, 3>& from, int16_t number,
               std::vector<std::array<int, 3>>& stack) {
  stack.assign(1, from);
  while (!stack.empty()) {
    const auto [x, y, z] = stack.back();
    stack.pop_back();
    int16_t* row = &g.cells[g.index(0, y, z)];
    if (row[x] != not_yet) continue;
    int first = x, last = x;
    while (first > 0 && row[first - 1] == not_yet) --first;
    while (last + 1 < g.size[0] && row[last + 1] == not_yet) ++last;
    std::fill(row + first, row + last + 1, number);
    const int beside[4][2] = {{y - 1, z}, {y + 1, z}, {y, z - 1}, {y, z + 1}};
    for (const auto& [v, w] : beside) {
      if (v < 0 || w < 0 || v >= g.size[1] || w >= g.size[2]) continue;
      const int16_t* other = &g.cells[g.index(0, v, w)];
      for (int i = first; i <= last; ++i) {
        if (other[i] == not_yet && (i == first || other[i - 1] != not_yet)) {
          stack.push_back({i, v, w});
        }
      }
    }
  }
}

// Where the next cell with a number is from one that has none.
int16_t way_from(const crossing_grid& g, const std::array<int, 3>& at) {
  const std::ptrdiff_t stride[3] = {1, g.size[0],
                                    static_cast<std::ptrdiff_t>(g.size[0]) * g.size[1]};
  const int16_t* cell = &g.cells[g.index(at[0], at[1], at[2])];
  for (int steps = 1; steps < g.most_steps; ++steps) {
    for (int direction = 0; direction < 6; ++direction) {
      if (g.direction >= 0 && direction != g.direction) continue;
      const int a = direction / 2, way = direction % 2 != 0 ? steps : -steps;
      const int to = at[static_cast<std::size_t>(a)] + way;
      const bool out = to < 0 || to >= g.size[a];
      if (out || std::abs(cell[way * stride[a]]) < g.most) return g.way(direction, steps);
    }
  }
  return g.way(std::max(g.direction, 0), g.most_steps);  // out of any grid
}

template <typename Body>
void for_each_cell(const crossing_grid& g, const Body& body) {
  for (int z = 0; z < g.size[2]; ++z) {
    for (int y = 0; y < g.size[1]; ++y) {
      const std::size_t row = g.index(0, y, z);
      for (int x = 0; x < g.size[0]; ++x) {
        body(row + static_cast<std::size_t>(x), std::array<int, 3>{x, y, z});
      }
    }
  }
}

}  // namespace

int least_shadow(const bvh_data& data, const boundary_loops& loops) {
  const crossing_grid g = place_grid(data, 32 * 32 * 32);
  std::array<int64_t, 6> shadow = {};
  for_each_edge(data, loops, [&](const dvec3& low, const dvec3& high) {
    for (int d = 0; d < 6; ++d) {
      shadow[static_cast<std::size_t>(d)] += shadow_of(g, low, high, d).count();
    }
  });
  return static_cast<int>(std::min_element(shadow.begin(), shadow.end()) - shadow.begin());
}

crossing_grid make_crossing_grid(const bvh_data& data, const boundary_loops& loops, int direction) {
  const std::size_t triangles = data.triangles.size();
  // so far from the origin that cells could not be told apart
  const dvec3 most = glm::max(glm::abs(data.min), glm::abs(data.max)) * data.scale;
  if (triangles < 64 || std::max({most.x, most.y, most.z}) > 1e9) return {};
  const std::size_t edges = loops.points.size();
  if (edges > triangles / 8) return {};
  crossing_grid g;
  for (double cells = std::clamp(4.0 * static_cast<double>(triangles), 4096.0, 0x1p22);;
       cells /= 8) {
    if (cells < 64) return {};
    g = place_grid(data, cells);
    // large triangles mark more cells than they touch
    int64_t marks = 0;
    for (uint32_t i = 0; i < triangles; ++i) marks += cells_of(g, data, i).count();
    for_each_edge(data, loops, [&](const dvec3& low, const dvec3& high) {
      marks += shadow_of(g, low, high, direction).count();
    });
    if (marks <= static_cast<int64_t>(6 * cell_count(g))) break;
  }
  if (edges > 0) g.direction = direction;
  g.cells.assign(cell_count(g), not_yet);
  for (uint32_t i = 0; i < triangles; ++i) mark(g, cells_of(g, data, i));
  for_each_edge(data, loops, [&](const dvec3& low, const dvec3& high) {
    mark(g, shadow_of(g, low, high, direction));
  });
  std::size_t without = 0;
  std::vector<std::array<int, 3>> stack;
  for_each_cell(g, [&](std::size_t i, const std::array<int, 3>& at) {
    if (g.cells[i] == not_yet) fill_part(g, at, number_at(data, g, at), stack);
    without += std::abs(g.cells[i]) >= g.most ? 1 : 0;
  });
  if (without > g.cells.size() / 4 * 3) return {};
  for_each_cell(g, [&](std::size_t i, const std::array<int, 3>& at) {
    if (std::abs(g.cells[i]) >= g.most) g.cells[i] = way_from(g, at);
  });
  return g;
}

}  // namespace wisp
