// Finds the open boundary: vertices are welded where their positions are equal, the
// directed edges that no opposite one cancels are sorted out by their lower vertex, and
// walked along until they close. They always do: what a triangle adds to the boundary
// enters each vertex as often as it leaves it.

#include "boundary.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <stdexcept>

#include "query.h"
#include "wisp/core/parallel.h"
#include "wisp/geometry/spatial_order.h"

namespace wisp {

namespace {

uint64_t hash_of(const dvec3& p) {
  uint64_t h = 0;
  for (int a = 0; a < 3; ++a) {
    h = (h ^ std::bit_cast<uint64_t>(p[a] + 0.0)) * 0x9e3779b97f4a7c15u;  // -0 + 0 is 0
    h ^= h >> 32;
  }
  return h;
}

// For each vertex the first one at the same position.
std::vector<uint32_t> weld(const bvh_data& data) {
  std::vector<uint32_t> same(data.position_count());
  std::vector<uint32_t> table(std::bit_ceil(2 * same.size() + 1), bvh_no_child);
  const std::size_t mask = table.size() - 1;
  for (std::size_t i = 0; i < same.size(); ++i) {
    const dvec3 p = data.position(i);
    std::size_t at = hash_of(p) & mask;
    while (table[at] != bvh_no_child && data.position(table[at]) != p) at = (at + 1) & mask;
    if (table[at] == bvh_no_child) table[at] = static_cast<uint32_t>(i);
    same[i] = table[at];
  }
  return same;
}

// Calls body(lower vertex, the other one, whether it starts from the other one).
template <typename Body>
void for_each_edge(const bvh_data& data, const std::vector<uint32_t>& same, const Body& body) {
  for (const ivec3& t : data.triangles) {
    const uint32_t v[3] = {same[static_cast<std::size_t>(t.x)], same[static_cast<std::size_t>(t.y)],
                           same[static_cast<std::size_t>(t.z)]};
    for (int i = 0; i < 3; ++i) {
      const uint32_t a = v[i], b = v[(i + 1) % 3];
      if (a == b) continue;
      body(std::min(a, b), std::max(a, b), a > b);
    }
  }
}

}  // namespace

std::vector<directed_edge> open_edges(const bvh_data& data, int threads) {
  const std::vector<uint32_t> same = weld(data);
  if (data.triangles.size() > 0xffffffffu / 3) {
    throw std::length_error("winding number: more than 1431655765 triangles");
  }
  std::vector<uint32_t> first(data.position_count() + 1, 0);
  for_each_edge(data, same, [&](uint32_t low, uint32_t, bool) { ++first[low + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<uint32_t> others(first.back());
  std::vector<uint32_t> at(first.begin(), first.end() - 1);
  for_each_edge(data, same, [&](uint32_t low, uint32_t high, bool backwards) {
    others[at[low]++] = high << 1 | static_cast<uint32_t>(backwards);
  });
  at = {};
  constexpr std::size_t grain = 1 << 14;
  const std::size_t parts = (data.position_count() + grain - 1) / grain;
  std::vector<std::vector<directed_edge>> found(parts);
  parallel_for(parts, threads, [&](std::size_t part) {
    const std::size_t end = std::min((part + 1) * grain, data.position_count());
    for (std::size_t low = part * grain; low < end; ++low) {
      const auto begin = others.begin() + first[low], stop = others.begin() + first[low + 1];
      std::sort(begin, stop);
      for (auto i = begin; i != stop;) {
        const uint32_t high = *i >> 1;
        std::ptrdiff_t open = 0;
        for (; i != stop && *i >> 1 == high; ++i) open += (*i & 1) != 0 ? -1 : 1;
        const auto v = static_cast<uint32_t>(low);
        for (; open > 0; --open) found[part].push_back({v, high});
        for (; open < 0; ++open) found[part].push_back({high, v});
      }
    }
  });
  std::vector<directed_edge> edges;
  for (const auto& f : found) edges.insert(edges.end(), f.begin(), f.end());
  return edges;
}

boundary_loops chain_edges(const bvh_data& data, std::span<const directed_edge> edges,
                           int threads) {
  boundary_loops loops;
  if (edges.empty()) return loops;
  // targets[next[v]] to targets[first[v + 1] - 1]: where edges from v lead that have not
  // been walked
  std::vector<uint32_t> first(data.position_count() + 1, 0);
  for (const directed_edge& e : edges) ++first[e.from + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<uint32_t> next(first.begin(), first.end() - 1);
  std::vector<uint32_t> targets(edges.size());
  for (const directed_edge& e : edges) targets[next[e.from]++] = e.to;
  std::copy(first.begin(), first.end() - 1, next.begin());
  std::vector<dvec3> points;
  std::vector<uint32_t> starts;
  points.reserve(edges.size());
  for (uint32_t v = 0; v < next.size(); ++v) {
    while (next[v] < first[v + 1]) {
      starts.push_back(static_cast<uint32_t>(points.size()));
      for (uint32_t at = v; next[at] < first[at + 1]; at = targets[next[at]++]) {
        points.push_back(data.position(at) * data.scale);
      }
    }
  }
  starts.push_back(static_cast<uint32_t>(points.size()));

  // loops that are near each other next to each other
  std::vector<dvec3> middles(starts.size() - 1);
  for (std::size_t i = 0; i + 1 < starts.size(); ++i) {
    dvec3 low = points[starts[i]], high = low;
    for (uint32_t j = starts[i]; j < starts[i + 1]; ++j) {
      low = glm::min(low, points[j]);
      high = glm::max(high, points[j]);
    }
    middles[i] = low / 2.0 + high / 2.0;
  }
  loops.points.reserve(points.size());
  for (const uint32_t i : spatial_order(middles, threads)) {
    loops.points.insert(loops.points.end(), points.begin() + starts[i],
                        points.begin() + starts[i + 1]);
    loops.starts.push_back(static_cast<uint32_t>(loops.points.size()));
  }
  return loops;
}

}  // namespace wisp
