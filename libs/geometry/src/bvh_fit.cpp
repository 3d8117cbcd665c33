// The bounds of nodes and the contents of leaves. All is computed in double and
// rounded so that a bound holds what it bounds.

#include <algorithm>
#include <cmath>

#include "bvh_data.h"
#include "wisp/core/parallel.h"

namespace wisp {

namespace {

// Above so many elements the parts of a closed surface face all ways, and a
// cylinder is no better than the box.
constexpr uint32_t most_in_cylinder = 1 << 14;

// Slots first to last - 1.
struct element_range {
  uint32_t first = 0, last = 0;
};

float round_down(double x) {
  const auto f = static_cast<float>(x);
  return f > x ? std::nextafter(f, -infinity) : f;
}
float round_up(double x) { return -round_down(-x); }

void fit_leaf(const bvh_data& data, bvh_leaf& leaf) {
  leaf.slack = 0;
  for (uint32_t i = 0; i < bvh_width; ++i) {
    std::array<dvec3, 3> v = data.corners(leaf.first + std::min(i, leaf.count - 1));
    for (dvec3& x : v) x = data.normalized(x);
    const auto edge = [&](std::size_t k) { return v[(k + 2) % 3] - v[(k + 1) % 3]; };
    std::size_t a = 0;  // opposite of the longest edge
    for (std::size_t k = 1; k < 3; ++k) {
      if (glm::dot(edge(k), edge(k)) > glm::dot(edge(a), edge(a))) a = k;
    }
    const dvec3 ab = v[(a + 1) % 3] - v[a], ac = v[(a + 2) % 3] - v[a];
    for (int k = 0; k < 3; ++k) {
      leaf.a[k][i] = static_cast<float>(v[a][k]);
      leaf.ab[k][i] = static_cast<float>(ab[k]);
      leaf.ac[k][i] = static_cast<float>(ac[k]);
    }
    // The foot of the perpendicular, found from the normal equations in single
    // precision, strays in the plane by eps (l / h)^2 (l + d), l the longest edge, h
    // the height over it and d the distance; one within the triangle is at most h / 2
    // nearer than the edges are.
    const double l = glm::length(edge(a));
    const double h = l > 0 ? glm::length(glm::cross(ab, ac)) / l : 0;
    if (h > 0) {
      constexpr double eps = 8 * bvh_ulp, farthest = 32;
      const double stray = eps * (l / h) * (l / h);
      const double excess = std::min(h / 2, 2 * stray * l + stray * stray * farthest / 2);
      leaf.slack = std::max(leaf.slack, round_up(excess));
    }
  }
}

void fit_child(const bvh_data& data, bvh_node& node, int k, const element_range& range) {
  dvec3 low{std::numeric_limits<double>::infinity()}, high = -low;
  dvec3 area{0, 0, 0};
  for (uint32_t i = range.first; i < range.last; ++i) {
    std::array<dvec3, 3> v = data.corners(i);
    for (dvec3& x : v) {
      x = data.normalized(x);
      low = glm::min(low, x);
      high = glm::max(high, x);
    }
    area += glm::cross(v[1] - v[0], v[2] - v[0]);
  }
  dvec3 center;
  for (int a = 0; a < 3; ++a) {
    node.min[a][k] = round_down(low[a]);
    node.max[a][k] = round_up(high[a]);
    center[a] = 0.5f * (node.min[a][k] + node.max[a][k]);  // as a query computes it
  }
  const double length = glm::length(area);
  dvec3 n{0, 0, 0};
  if (range.last - range.first <= most_in_cylinder && length > 0) n = area / length;
  for (int a = 0; a < 3; ++a) {
    node.normal[a][k] = static_cast<float>(n[a]);
    n[a] = node.normal[a][k];
  }
  double z_min = 0, z_max = 0, radius2 = 0;
  if (n != dvec3{0, 0, 0}) {
    z_min = std::numeric_limits<double>::infinity();
    z_max = -z_min;
    for (uint32_t i = range.first; i < range.last; ++i) {
      for (const dvec3& x : data.corners(i)) {
        const dvec3 q = data.normalized(x) - center;
        const double z = glm::dot(q, n);
        const dvec3 across = q - z * n;
        z_min = std::min(z_min, z);
        z_max = std::max(z_max, z);
        radius2 = std::max(radius2, glm::dot(across, across));
      }
    }
  } else {
    const dvec3 half = glm::max(high - center, center - low);
    radius2 = glm::dot(half, half);
  }
  node.z_min[k] = round_down(z_min);
  node.z_max[k] = round_up(z_max);
  node.radius[k] = round_up(std::sqrt(radius2) * (1 + 1e-12));
}

void fit_missing(bvh_node& node, int k) {
  for (int a = 0; a < 3; ++a) {
    node.min[a][k] = node.max[a][k] = 1e15f;
    node.normal[a][k] = 0;
  }
  node.z_min[k] = node.z_max[k] = node.radius[k] = 0;
}

}  // namespace

void fit_bvh(bvh_data& data, int threads) {
  // parents come before their children, and children of a node are in order
  std::vector<element_range> ranges(data.nodes.size());
  const auto range_of = [&](uint32_t child) {
    if ((child & bvh_leaf_bit) == 0) return ranges[child];
    const bvh_leaf& leaf = data.leaves[child & ~bvh_leaf_bit];
    return element_range{leaf.first, leaf.first + leaf.count};
  };
  for (std::size_t i = data.nodes.size(); i-- > 0;) {
    const bvh_node& node = data.nodes[i];
    int last = bvh_width - 1;
    while (last > 0 && node.child[last] == bvh_no_child) --last;
    ranges[i] = {range_of(node.child[0]).first, range_of(node.child[last]).last};
  }
  parallel_for(
      data.leaves.size(), threads, [&](std::size_t i) { fit_leaf(data, data.leaves[i]); }, 256);
  parallel_for(
      data.nodes.size(), threads,
      [&](std::size_t i) {
        bvh_node& node = data.nodes[i];
        for (int k = 0; k < bvh_width; ++k) {
          if (node.child[k] == bvh_no_child) {
            fit_missing(node, k);
          } else {
            fit_child(data, node, k, range_of(node.child[k]));
          }
        }
      },
      16);
}

}  // namespace wisp
