// The moments of the parts of a mesh: those of leaves by their elements, those of nodes
// by moving their children's to the common centroid. All in double.

#include <algorithm>
#include <bit>
#include <cmath>

#include "fast_winding_data.h"
#include "wisp/core/parallel.h"

namespace wisp {

namespace {

// Integrals over a part, y relative to its centroid: of n, y_i n_j and y_i y_j n_k, ij
// in the order of `pairs`.
struct moments {
  dvec3 center{0, 0, 0};
  double area = 0;
  dvec3 first{0, 0, 0};
  std::array<dvec3, 3> second{};
  std::array<dvec3, 6> third{};
};

constexpr std::array<std::array<int, 2>, 6> pairs = {
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
constexpr int pair_of[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};

void add_at(moments& m, const dvec3& y, const dvec3& n) {
  for (int i = 0; i < 3; ++i) m.second[static_cast<std::size_t>(i)] += y[i] * n;
}
void add_square_at(moments& m, const dvec3& y, const dvec3& n) {
  for (std::size_t k = 0; k < 6; ++k) m.third[k] += y[pairs[k][0]] * y[pairs[k][1]] * n;
}

// Adds a part that has its own centroid.
void add(moments& m, const moments& part) {
  const dvec3 t = part.center - m.center;
  m.first += part.first;
  for (std::size_t i = 0; i < 3; ++i) m.second[i] += part.second[i];
  add_at(m, t, part.first);
  for (std::size_t k = 0; k < 6; ++k) {
    const int i = pairs[k][0], j = pairs[k][1];
    m.third[k] += part.third[k] + t[i] * part.second[static_cast<std::size_t>(j)] +
                  t[j] * part.second[static_cast<std::size_t>(i)];
  }
  add_square_at(m, t, part.first);
}

struct slot_range {
  uint32_t first = 0, last = 0;
};

// A centroid for parts without area, whose moments are zero.
dvec3 middle(const bvh_data& data, const slot_range& r) {
  dvec3 low{std::numeric_limits<double>::infinity()}, high = -low;
  for (uint32_t i = r.first; i < r.last; ++i) {
    for (const dvec3& x : data.corners(i)) {
      low = glm::min(low, data.normalized(x));
      high = glm::max(high, data.normalized(x));
    }
  }
  return 0.5 * (low + high);
}

moments moments_of_leaf(const fast_winding_data& fast, const slot_range& r,
                        const std::vector<dvec3>& areas) {
  const bvh_data& data = *fast.tree.data();
  struct piece {
    std::array<dvec3, 3> v;
    dvec3 n;
    double area;
  };
  std::array<piece, bvh_width> pieces;
  const std::size_t count = r.last - r.first;
  moments m;
  for (std::size_t i = 0; i < count; ++i) {
    piece& t = pieces[i];
    const auto slot = static_cast<uint32_t>(r.first + i);
    t.v = data.corners(slot);
    for (dvec3& x : t.v) x = data.normalized(x);
    t.n = fast.points ? areas[slot] : 0.5 * glm::cross(t.v[1] - t.v[0], t.v[2] - t.v[0]);
    t.area = glm::length(t.n);
    m.area += t.area;
    m.center += t.area / 3 * (t.v[0] + t.v[1] + t.v[2]);
  }
  if (!(m.area > 0)) {
    m.area = 0;
    m.center = middle(data, r);
    return m;
  }
  m.center /= m.area;
  for (std::size_t i = 0; i < count; ++i) {
    const piece& t = pieces[i];
    const dvec3 a = t.v[0] - m.center, b = t.v[1] - m.center, c = t.v[2] - m.center;
    m.first += t.n;
    add_at(m, (a + b + c) / 3.0, t.n);
    if (fast.points) {
      add_square_at(m, a, t.n);
      continue;
    }
    // the middles of the edges are exact for squares
    for (const dvec3& e : {0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)}) {
      add_square_at(m, e, t.n / 3.0);
    }
  }
  return m;
}

// The squared distance of the farthest vertex from c.
double radius2_of(const bvh_data& data, const slot_range& r, const dvec3& c) {
  double radius2 = 0;
  for (uint32_t i = r.first; i < r.last; ++i) {
    for (const dvec3& x : data.corners(i)) {
      const dvec3 y = data.normalized(x) - c;
      radius2 = std::max(radius2, glm::dot(y, y));
    }
  }
  return radius2;
}

void write_missing(eight_floats* rows, int order, std::size_t k) {
  for (std::size_t i = 0; i < rows_of(order); ++i) rows[i].v[k] = 0;
  for (std::size_t a = 0; a < 3; ++a) rows[row_center + a].v[k] = 1e9f;
  rows[row_radius2].v[k] = -1;
  rows[row_child].v[k] = std::bit_cast<float>(uint32_t{0});
}

void write_child(eight_floats* rows, int order, std::size_t k, uint32_t child, const moments& m,
                 double radius2) {
  const auto put = [&](std::size_t row, double x) { rows[row].v[k] = static_cast<float>(x); };
  for (int a = 0; a < 3; ++a) put(row_center + static_cast<std::size_t>(a), m.center[a]);
  put(row_radius2, radius2);
  rows[row_child].v[k] = std::bit_cast<float>(child);
  constexpr double f = -1 / 12.566370614359172954;
  for (int a = 0; a < 3; ++a) put(row_first + static_cast<std::size_t>(a), f * m.first[a]);
  if (order < 2) return;
  const auto& s = m.second;
  const double trace = s[0][0] + s[1][1] + s[2][2];
  put(row_second, f * (3 * s[0][0] - trace));
  put(row_second + 1, f * (3 * s[1][1] - trace));
  put(row_second + 2, f * 3 * (s[0][1] + s[1][0]));
  put(row_second + 3, f * 3 * (s[0][2] + s[2][0]));
  put(row_second + 4, f * 3 * (s[1][2] + s[2][1]));
  if (order < 3) return;
  const auto third = [&](int i, int j, int l) {
    return m.third[static_cast<std::size_t>(pair_of[i][j])][l];
  };
  std::size_t row = row_third;
  for (int i = 0; i < 3; ++i) {
    double u = 0, v = 0;
    for (int j = 0; j < 3; ++j) {
      u += third(i, j, j);
      v += third(j, j, i);
    }
    for (int j = 0; j < 3; ++j) {
      if (j == i) continue;
      put(row++, f * (7.5 * (third(j, j, i) + 2 * third(i, j, j)) - 3 * u - 1.5 * v));
    }
  }
  put(row, f * 15 * (third(0, 1, 2) + third(0, 2, 1) + third(1, 2, 0)));
}

}  // namespace

void build_moments(fast_winding_data& fast, const std::vector<dvec3>& areas, int threads) {
  const bvh_data& data = *fast.tree.data();
  const std::size_t count = data.nodes.size(), stride = rows_of(fast.order);
  fast.rows.resize(count * stride);
  std::vector<moments> all(count);
  std::vector<slot_range> ranges(count);
  const auto range_of = [&](uint32_t child) {
    if ((child & bvh_leaf_bit) == 0) return ranges[child];
    const bvh_leaf& leaf = data.leaves[child & ~bvh_leaf_bit];
    return slot_range{leaf.first, leaf.first + leaf.count};
  };

  // Leaves, and at first the sums of a node's leaves about their centroid.
  parallel_for(
      count, threads,
      [&](std::size_t n) {
        std::array<moments, bvh_width> leaves;
        std::size_t leaf_count = 0;
        moments& sum = all[n];
        for (std::size_t k = 0; k < bvh_width; ++k) {
          const uint32_t child = data.nodes[n].child[k];
          if (child == bvh_no_child) {
            write_missing(&fast.rows[n * stride], fast.order, k);
            continue;
          }
          if ((child & bvh_leaf_bit) == 0) continue;
          moments& m = leaves[leaf_count++];
          const slot_range r = range_of(child);
          m = moments_of_leaf(fast, r, areas);
          write_child(&fast.rows[n * stride], fast.order, k, child, m,
                      radius2_of(data, r, m.center));
          sum.area += m.area;
          sum.center += m.area * m.center;
        }
        if (sum.area > 0) sum.center /= sum.area;
        for (std::size_t i = 0; i < leaf_count; ++i) add(sum, leaves[i]);
      },
      64);

  // Nodes come before their children.
  for (std::size_t n = count; n-- > 0;) {
    const bvh_node& node = data.nodes[n];
    moments sum;
    const auto each_part = [&](const auto& use) {
      use(all[n]);
      for (const uint32_t child : node.child) {
        if ((child & bvh_leaf_bit) == 0) use(all[child]);
      }
    };
    each_part([&](const moments& m) {
      sum.area += m.area;
      sum.center += m.area * m.center;
    });
    std::size_t last = bvh_width - 1;
    while (last > 0 && node.child[last] == bvh_no_child) --last;
    ranges[n] = {range_of(node.child[0]).first, range_of(node.child[last]).last};
    if (sum.area > 0) {
      sum.center /= sum.area;
    } else {
      sum.center = middle(data, ranges[n]);
    }
    each_part([&](const moments& m) { add(sum, m); });
    all[n] = sum;
  }
  fast.total = all[0].first;

  parallel_for(
      count, threads,
      [&](std::size_t n) {
        for (std::size_t k = 0; k < bvh_width; ++k) {
          const uint32_t child = data.nodes[n].child[k];
          if ((child & bvh_leaf_bit) != 0) continue;
          const moments& m = all[child];
          write_child(&fast.rows[n * stride], fast.order, k, child, m,
                      radius2_of(data, ranges[child], m.center));
        }
      },
      16);
}

}  // namespace wisp
