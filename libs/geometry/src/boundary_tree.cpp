// The tree over the edges of a boundary: eight consecutive edges to a leaf, eight
// consecutive clusters to a cluster.
//
// A run of edges far from p is its chord and what lies between: with any surface S
// that run and chord bound, the solid angles of the fans over the run and over the
// chord differ by that of S, if the ray does not cross S. S is the fan of the run
// and the chord around the cluster's center; with r from p to the center,
//   w_S(p) = 1/(4 pi) int n.(r + y) / |r + y|^3 dA, y relative to the center,
// is expanded in y: the moments int n, int n y^T and int n y y^T, of which only the
// symmetric part counts, as what is expanded is a gradient.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "boundary.h"
#include "wisp/core/parallel.h"

namespace wisp {

namespace {

// A range of the edges in the order of the loops. It may begin and end within a run.
struct edge_sequence {
  const boundary_loops& loops;
  std::vector<uint32_t> loop_of = {};  // by edge

  explicit edge_sequence(const boundary_loops& l) : loops(l), loop_of(l.points.size()) {
    for (uint32_t i = 0; i < loops.count(); ++i) {
      std::fill(loop_of.begin() + loops.starts[i], loop_of.begin() + loops.starts[i + 1], i);
    }
  }
  std::size_t size() const { return loops.points.size(); }
  const dvec3& from(std::size_t e) const { return loops.points[e]; }
  const dvec3& to(std::size_t e) const {
    const uint32_t l = loop_of[e];
    return loops.points[e + 1 < loops.starts[l + 1] ? e + 1 : loops.starts[l]];
  }
};

struct chord_ends {
  dvec3 a, b;
};
struct chord_list {
  chord_ends ends[2] = {};
  uint32_t count = 0;
};

// The straight edges that close what edges first to last - 1 leave open.
chord_list chords_of(const edge_sequence& s, std::size_t first, std::size_t last) {
  chord_list chords;
  const auto add = [&](std::size_t begin, std::size_t end) {
    const dvec3 a = s.from(begin), b = s.to(end - 1);
    if (begin < end && a != b) chords.ends[chords.count++] = {a, b};
  };
  const std::size_t first_end = s.loops.starts[s.loop_of[first] + 1];
  const std::size_t last_start = s.loops.starts[s.loop_of[last - 1]];
  add(first, std::min(first_end, last));
  if (last_start > first) add(last_start, last);
  return chords;
}

struct moments {
  dvec3 dipole = {0, 0, 0};
  double quadrupole[6] = {};
  double octupole[10] = {};
  double fourth = 0;  // >= int |y|^3 dA

  // Adds the triangle 0, p, q.
  void add(const dvec3& p, const dvec3& q) {
    const dvec3 n = 0.5 * glm::cross(p, q), sum = p + q;
    dipole += n;
    const auto first = [&](int i, int j) { return n[i] * sum[j] / 3; };
    constexpr int pairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
    for (int t = 0; t < 6; ++t) {
      const auto [i, j] = pairs[t];
      quadrupole[t] += (first(i, j) + first(j, i)) / 2;
    }
    const auto second = [&](int i, int j, int k) {
      return n[i] * (sum[j] * sum[k] + p[j] * p[k] + q[j] * q[k]) / 12;
    };
    constexpr int triples[10][3] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {0, 0, 1}, {0, 0, 2},
                                    {1, 1, 0}, {1, 1, 2}, {2, 2, 0}, {2, 2, 1}, {0, 1, 2}};
    for (int t = 0; t < 10; ++t) {
      const auto [i, j, k] = triples[t];
      octupole[t] += (second(i, j, k) + second(j, k, i) + second(k, i, j)) / 3;
    }
    const double far = std::sqrt(std::max(glm::dot(p, p), glm::dot(q, q)));
    fourth += 0.4 * glm::length(n) * far * far * far;
  }
};

// How far away the series is good enough: what it leaves out is the sum over l >= 3 of
// (l + 1) / (4 pi d^(l + 2)) int |y|^l dA, as (l + 1) bounds the gradient of the l-th
// Legendre term on the unit sphere.
double far_enough(double fourth, double radius, double tolerance) {
  if (!(tolerance > 0)) return std::numeric_limits<double>::infinity();
  const double k = 4 * fourth / (4 * std::numbers::pi * tolerance);
  double low = radius, high = 2 * radius + std::pow(k, 0.2) * 2;
  for (int i = 0; i < 50; ++i) {
    const double d = (low + high) / 2;
    (d * d * d * (d - radius) * (d - radius) < k ? low : high) = d;
  }
  return high * (1 + 1e-6);
}

void fill(boundary_group& g, int i, const edge_sequence& s, std::size_t first, std::size_t last,
          double tolerance) {
  dvec3 low = s.from(first), high = low, center{0, 0, 0};
  double length = 0;
  for (std::size_t e = first; e < last; ++e) {
    const dvec3 &a = s.from(e), &b = s.to(e);
    low = glm::min(low, glm::min(a, b));
    high = glm::max(high, glm::max(a, b));
    const double l = glm::distance(a, b);
    length += l;
    center += l * 0.5 * (a - s.from(first) + b - s.from(first));
  }
  center = s.from(first) + (length > 0 ? center / length : dvec3{0});
  center = glm::clamp(center, low, high);
  const chord_list chords = chords_of(s, first, last);
  moments m;
  double radius2 = 0;
  for (std::size_t e = first; e < last; ++e) {
    const dvec3 a = s.from(e) - center, b = s.to(e) - center;
    m.add(a, b);
    radius2 = std::max({radius2, glm::dot(a, a), glm::dot(b, b)});
  }
  g.chords[i] = 0;
  for (uint32_t c = 0; c < chords.count; ++c) {
    const chord_ends& ends = chords.ends[c];
    m.add(ends.b - center, ends.a - center);
    g.chords[i] |= 1u << c;
    for (int k = 0; k < 3; ++k) {
      g.chord[c][k][i] = ends.a[k];
      g.chord[c][k + 3][i] = ends.b[k];
    }
  }
  for (int k = 0; k < 3; ++k) {
    g.center[k][i] = center[k];
    g.min[k][i] = low[k];
    g.max[k][i] = high[k];
    g.dipole[k][i] = m.dipole[k];
  }
  for (int k = 0; k < 6; ++k) g.quadrupole[k][i] = m.quadrupole[k];
  for (int k = 0; k < 10; ++k) g.octupole[k][i] = m.octupole[k];
  const double far = far_enough(m.fourth, std::sqrt(radius2), tolerance);
  g.far2[i] = far * far;
}

void fill_leaf(boundary_leaf& leaf, const edge_sequence& s, std::size_t first) {
  for (std::size_t i = 0; i < boundary_width; ++i) {
    const std::size_t e = std::min(first + i, s.size() - 1);
    const dvec3 a = s.from(e), b = first + i < s.size() ? s.to(e) : a;
    for (int k = 0; k < 3; ++k) {
      leaf.a[k][i] = a[k];
      leaf.b[k][i] = b[k];
    }
  }
}

}  // namespace

std::size_t boundary_tree::bytes() const {
  std::size_t n = leaves.capacity() * sizeof(boundary_leaf);
  for (const auto& level : levels) n += level.capacity() * sizeof(boundary_group);
  return n;
}

boundary_tree make_boundary_tree(const boundary_loops& loops, double tolerance, int threads) {
  boundary_tree tree;
  tree.edges = loops.points.size();
  tree.loops = loops.count();
  if (tree.edges == 0) return tree;
  const edge_sequence s(loops);
  constexpr std::size_t width = boundary_width;
  const auto groups_of = [](std::size_t n) { return (n + width - 1) / width; };
  tree.leaves.resize(groups_of(s.size()));
  parallel_for(
      tree.leaves.size(), threads, [&](std::size_t i) { fill_leaf(tree.leaves[i], s, i * width); },
      64);
  // Errors of the clusters that stand for the boundary seldom add up, and are far below
  // their bounds: of the some tens that curves need, all together are below a third of
  // one bound. Boundaries that fill space need more.
  const double leaves = static_cast<double>(tree.leaves.size());
  const double of_one = tolerance / std::sqrt(1 + leaves / 1000);
  std::size_t clusters = tree.leaves.size();
  for (std::size_t edges = width;; edges *= width) {
    auto& level = tree.levels.emplace_back(groups_of(clusters));
    parallel_for(
        level.size(), threads,
        [&](std::size_t i) {
          boundary_group& g = level[i];
          g = {};
          std::fill_n(g.far2, width, std::numeric_limits<double>::infinity());
          g.count = static_cast<uint32_t>(std::min(width, clusters - i * width));
          for (std::size_t k = 0; k < g.count; ++k) {
            const std::size_t first = (i * width + k) * edges;
            fill(g, static_cast<int>(k), s, first, std::min(first + edges, s.size()), of_one);
          }
        },
        8);
    if (level.size() == 1) return tree;
    clusters = level.size();
  }
}

double boundary_cost(const boundary_tree& tree, const dvec3& low, const dvec3& high) {
  if (tree.edges == 0) return 0;
  constexpr int side = 4;
  struct open_group {
    std::size_t level, group;
  };
  std::vector<open_group> stack;
  std::size_t cost = 0;
  for (int i = 0; i < side * side * side; ++i) {
    const dvec3 at = dvec3{i % side, i / side % side, i / side / side} + 0.5;
    const dvec3 p = low + (high - low) * at / static_cast<double>(side);
    stack.assign(1, {tree.levels.size() - 1, 0});
    while (!stack.empty()) {
      const open_group o = stack.back();
      stack.pop_back();
      const boundary_group& g = tree.levels[o.level][o.group];
      ++cost;
      for (std::size_t k = 0; k < g.count; ++k) {
        const dvec3 r = dvec3{g.center[0][k], g.center[1][k], g.center[2][k]} - p;
        if (glm::dot(r, r) > g.far2[k]) continue;
        ++cost;
        if (o.level > 0) stack.push_back({o.level - 1, o.group * boundary_width + k});
      }
    }
  }
  return static_cast<double>(cost) / (side * side * side);
}

}  // namespace wisp
