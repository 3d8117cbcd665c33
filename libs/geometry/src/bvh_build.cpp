// Top-down binned SAH, then the cheapest set of eight children for each node: the
// papers are named in bvh.h.

#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "bvh_data.h"
#include "wisp/core/memory.h"
#include "wisp/core/parallel.h"

namespace wisp {

namespace {

constexpr int leaf_size = bvh_width;
constexpr int bins = 16;
// A split by the SAH may peel off a few elements at a time; from this depth on
// halves bound the depth, and with it the stack of a query.
constexpr int deepest_sah = 40;
constexpr uint32_t parallel_from = 4096;

// Boxes are what building a tree computes with, and GLM has no vector code for three
// floats: four lanes of the compiler's own, the last one unused.
using float4 = float __attribute__((vector_size(16)));
using int4 = int __attribute__((vector_size(16)));
float4 min4(const float4& a, const float4& b) { return a < b ? a : b; }
float4 max4(const float4& a, const float4& b) { return a > b ? a : b; }
float4 all4(float x) { return float4{x, x, x, x}; }

struct float_box {
  float4 min = all4(infinity);
  float4 max = all4(-infinity);
  void add(const float_box& b) {
    min = min4(min, b.min);
    max = max4(max, b.max);
  }
  void add(const float4& p) {
    min = min4(min, p);
    max = max4(max, p);
  }
  float half_area() const {
    const float4 d = max - min;
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
  }
};

struct primitive {
  float_box box = {};
  // Which one it is lies in the lane that is left, where it must not be computed
  // with: small numbers are subnormal floats.
  float4 twice_center() const {
    const int4 keep = {-1, -1, -1, 0};
    return std::bit_cast<float4>(std::bit_cast<int4>(box.min) & keep) + box.max;
  }
  uint32_t triangle() const { return std::bit_cast<uint32_t>(static_cast<float>(box.min[3])); }
  void set_triangle(uint32_t i) {
    box.min[3] = std::bit_cast<float>(i);
    box.max[3] = 0;
  }
};

// A node of the binary tree over primitives [first, first + count).
struct binary_node {
  float_box box = {};
  uint32_t first = 0, count = 0;
  uint32_t left = 0;  // the right one follows; 0: a leaf
  // The cheapest way to stand for this subtree by at most i wide children takes
  // split[i] of them from the left one; 0: the node itself.
  std::array<uint8_t, bvh_width + 1> split = {};
};

struct builder {
  bvh_data& data;
  std::vector<primitive> primitives = {};
  std::unique_ptr<binary_node[]> nodes = {};  // pages are touched as nodes are made
  std::atomic<uint32_t> used = 0;

  explicit builder(bvh_data& d) : data(d) {}

  struct range {
    float_box box = {};
    float_box centers = {};
  };
  range bounds(uint32_t first, uint32_t count) const;
  uint32_t split(uint32_t first, uint32_t count, const range& bounds, int depth);
  using costs = std::array<float, bvh_width + 1>;
  costs build(uint32_t node, uint32_t first, uint32_t count, int depth);
  void children(uint32_t node, int at_most, std::vector<uint32_t>& out) const;
  void widen();
};

builder::range builder::bounds(uint32_t first, uint32_t count) const {
  range r;
  for (uint32_t i = first; i < first + count; ++i) {
    r.box.add(primitives[i].box);
    r.centers.add(primitives[i].twice_center());
  }
  return r;
}

// Leaves are tested whole, so that what counts is how many a side needs.
float leaf_tests(uint32_t count) { return static_cast<float>((count + leaf_size - 1) / leaf_size); }

// Parts the range in two and returns the first of the second part.
uint32_t builder::split(uint32_t first, uint32_t count, const range& bounds, int depth) {
  const float4 low = bounds.centers.min, extent = bounds.centers.max - low;
  const auto begin = primitives.begin() + first, end = begin + count;
  const auto halve = [&] {
    int axis = 0;
    for (int a = 1; a < 3; ++a) axis = extent[a] > extent[axis] ? a : axis;
    std::nth_element(begin, begin + count / 2, end, [&](const primitive& a, const primitive& b) {
      const float ca = a.twice_center()[axis], cb = b.twice_center()[axis];
      return ca != cb ? ca < cb : a.triangle() < b.triangle();
    });
    return first + count / 2;
  };
  if (depth >= deepest_sah) return halve();

  float4 factor = all4(0);
  for (int a = 0; a < 3; ++a) {
    // a bin of a subnormal extent has no number
    factor[a] = extent[a] > 1e-30f ? static_cast<float>(bins) * 0.9999f / extent[a] : 0.0f;
  }
  struct bin {
    float_box box = {};
    uint32_t count = 0;
  };
  bin binned[3][bins];
  for (auto p = begin; p != end; ++p) {
    const int4 at = __builtin_convertvector((p->twice_center() - low) * factor, int4);
    for (int a = 0; a < 3; ++a) {
      bin& b = binned[a][at[a]];
      b.box.add(p->box);
      ++b.count;
    }
  }
  float best = std::numeric_limits<float>::infinity();
  int best_axis = -1, best_bin = 0;
  for (int a = 0; a < 3; ++a) {
    if (factor[a] == 0) continue;
    std::array<float, bins> right_cost;
    float_box box;
    uint32_t n = 0;
    for (int i = bins - 1; i > 0; --i) {
      box.add(binned[a][i].box);
      n += binned[a][i].count;
      right_cost[static_cast<std::size_t>(i)] = n > 0 ? box.half_area() * leaf_tests(n) : -1;
    }
    box = {};
    n = 0;
    for (int i = 0; i < bins - 1; ++i) {
      box.add(binned[a][i].box);
      n += binned[a][i].count;
      const float right = right_cost[static_cast<std::size_t>(i + 1)];
      if (n == 0 || right < 0) continue;
      const float cost = box.half_area() * leaf_tests(n) + right;
      if (cost < best) {
        best = cost;
        best_axis = a;
        best_bin = i;
      }
    }
  }
  if (best_axis < 0) return halve();
  const auto middle = std::partition(begin, end, [&](const primitive& p) {
    const float at = (p.twice_center()[best_axis] - low[best_axis]) * factor[best_axis];
    return static_cast<int>(at) <= best_bin;
  });
  return first + static_cast<uint32_t>(middle - begin);
}

// Returns what the subtree costs, stood for by at most i wide children: the area of
// what a query has to open, as a node or as a leaf.
builder::costs builder::build(uint32_t node, uint32_t first, uint32_t count, int depth) {
  const range r = bounds(first, count);
  binary_node& n = nodes[node];
  n = {.box = r.box, .first = first, .count = count};
  costs c;
  const float area = r.box.half_area();
  if (count <= leaf_size) {
    c.fill(area);
    return c;
  }
  const uint32_t middle = split(first, count, r, depth);
  const uint32_t left = used.fetch_add(2);
  n.left = left;
  costs cl, cr;
  const auto build_left = [&] { cl = build(left, first, middle - first, depth + 1); };
  const auto build_right = [&] { cr = build(left + 1, middle, first + count - middle, depth + 1); };
  if (count >= parallel_from) {
    tbb::parallel_invoke(build_left, build_right);
  } else {
    build_left();
    build_right();
  }
  costs together;
  for (std::size_t i = 2; i <= bvh_width; ++i) {
    together[i] = std::numeric_limits<float>::infinity();
    for (std::size_t k = 1; k < i; ++k) {
      const float cost = cl[k] + cr[i - k];
      if (cost < together[i]) {
        together[i] = cost;
        n.split[i] = static_cast<uint8_t>(k);
      }
    }
  }
  c[0] = 0;
  c[1] = area + together[bvh_width];
  // split[1] is how the node itself is opened
  n.split[1] = n.split[bvh_width];
  for (std::size_t i = 2; i <= bvh_width; ++i) {
    c[i] = std::min(c[i - 1], together[i]);
    if (c[i] != together[i]) n.split[i] = 0;
  }
  return c;
}

// The nodes that stand for the subtree, from left to right.
void builder::children(uint32_t node, int at_most, std::vector<uint32_t>& out) const {
  const binary_node& n = nodes[node];
  while (at_most > 1 && n.split[static_cast<std::size_t>(at_most)] == 0) --at_most;
  if (at_most == 1 || n.left == 0) {
    out.push_back(node);
    return;
  }
  const int k = n.split[static_cast<std::size_t>(at_most)];
  children(n.left, k, out);
  children(n.left + 1, at_most - k, out);
}

void builder::widen() {
  struct open {
    uint32_t binary, wide;
  };
  data.nodes.push_back({});
  std::vector<open> stack{{0, 0}};
  std::vector<uint32_t> slots;
  while (!stack.empty()) {
    const open o = stack.back();
    stack.pop_back();
    slots.clear();
    const binary_node& n = nodes[o.binary];
    if (n.left == 0) {
      slots.push_back(o.binary);  // a root that is a leaf
    } else {
      const int k = n.split[1];
      children(n.left, k, slots);
      children(n.left + 1, bvh_width - k, slots);
    }
    const std::size_t base = stack.size();
    for (std::size_t i = 0; i < bvh_width; ++i) {
      uint32_t& child = data.nodes[o.wide].child[i];
      child = bvh_no_child;
      if (i >= slots.size()) continue;
      const binary_node& c = nodes[slots[i]];
      if (c.left == 0) {
        child = bvh_leaf_bit | static_cast<uint32_t>(data.leaves.size());
        bvh_leaf& leaf = data.leaves.emplace_back();
        leaf.first = c.first;
        leaf.count = c.count;
      } else {
        child = static_cast<uint32_t>(data.nodes.size());
        stack.push_back({slots[i], child});
        data.nodes.push_back({});
      }
    }
    std::reverse(stack.begin() + static_cast<std::ptrdiff_t>(base), stack.end());
  }
}

// Puts elements in the order of the leaves, and vertices in that of first use.
void reorder(bvh_data& data, const std::vector<primitive>& primitives) {
  std::vector<ivec3> triangles(primitives.size());
  std::vector<uint32_t> elements(primitives.size());
  std::vector<dvec3> positions;
  std::vector<int> moved(data.positions.size(), -1);
  positions.reserve(data.positions.size());
  data.vertices.clear();
  data.vertices.reserve(data.positions.size());
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    const uint32_t slot = primitives[i].triangle();
    elements[i] = data.elements[slot];
    for (int k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(data.triangles[slot][k]);
      if (moved[v] < 0) {
        moved[v] = static_cast<int>(positions.size());
        positions.push_back(data.positions[v]);
        data.vertices.push_back(static_cast<uint32_t>(v));
      }
      triangles[i][k] = moved[v];
    }
  }
  data.triangles = std::move(triangles);
  data.elements = std::move(elements);
  data.positions = std::move(positions);
  data.positions.shrink_to_fit();
  data.compact_positions();
  data.vertices.shrink_to_fit();
}

void check_indices(const bvh_data& data) {
  if (data.triangles.size() >= bvh_leaf_bit) {
    throw std::length_error("bvh: 2^31 elements or more; at most 2147483647 are possible");
  }
  const auto n = static_cast<std::ptrdiff_t>(data.positions.size());
  for (std::size_t i = 0; i < data.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const int v = data.triangles[i][k];
      if (v < 0 || v >= n) {
        throw std::invalid_argument("bvh: element " + std::to_string(i) + " has vertex " +
                                    std::to_string(v) + "; there are " + std::to_string(n));
      }
    }
  }
}

bool is_finite(const dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

// Puts the frame of the normalized coordinates where the elements are.
void place(bvh_data& data) {
  data.min = dvec3{std::numeric_limits<double>::infinity()};
  data.max = -data.min;
  for (uint32_t i = 0; i < data.triangles.size(); ++i) {
    for (const dvec3& v : data.corners(i)) {
      data.min = glm::min(data.min, v);
      data.max = glm::max(data.max, v);
    }
  }
  // halves first: the sum of two finite numbers may not be one
  data.center = data.min / 2.0 + data.max / 2.0;
  const dvec3 half = data.max / 2.0 - data.min / 2.0;
  const double size = std::max({half.x, half.y, half.z});
  data.scale = data.unit = 1;
  if (size > 0) {
    const int exponent = std::clamp(std::ilogb(size) + 1, -1000, 1000);
    data.scale = std::ldexp(1.0, -exponent);
    data.unit = std::ldexp(1.0, exponent);
  }
}

bvh make(std::shared_ptr<bvh_data> data, const bvh_options& options) {
  check_indices(*data);
  data->vertex_count = data->positions.size();
  const std::size_t given = data->triangles.size();
  data->elements.reserve(given);
  for (std::size_t i = 0; i < given; ++i) {
    const auto v = data->corners(static_cast<uint32_t>(i));
    if (!is_finite(v[0]) || !is_finite(v[1]) || !is_finite(v[2])) continue;
    data->triangles[data->elements.size()] = data->triangles[i];
    data->elements.push_back(static_cast<uint32_t>(i));
  }
  data->triangles.resize(data->elements.size());
  data->left_out = given - data->elements.size();
  if (data->elements.empty()) return bvh(std::move(data));
  place(*data);

  const int threads = thread_count(options.threads);
  builder b(*data);
  const auto count = static_cast<uint32_t>(data->elements.size());
  b.primitives.resize(count);
  parallel_for(
      count, threads,
      [&](std::size_t i) {
        primitive& p = b.primitives[i];
        for (const dvec3& v : data->corners(static_cast<uint32_t>(i))) {
          const vec3 x(data->normalized(v));
          p.box.add(float4{x.x, x.y, x.z, 0});
        }
        p.set_triangle(static_cast<uint32_t>(i));
      },
      4096);
  b.nodes = std::make_unique_for_overwrite<binary_node[]>(2 * static_cast<std::size_t>(count));
  b.used = 1;
  tbb::task_arena arena(threads);
  arena.execute([&] { b.build(0, 0, count, 0); });
  reorder(*data, b.primitives);
  release(b.primitives);
  b.widen();
  b.nodes.reset();
  data->nodes.shrink_to_fit();
  data->leaves.shrink_to_fit();
  fit_bvh(*data, threads);
  return bvh(std::move(data));
}

}  // namespace

void bvh_data::compact_positions() {
  const auto is_single = [](const dvec3& p) { return dvec3(vec3(p)) == p; };
  if (!std::all_of(positions.begin(), positions.end(), is_single)) return;
  single_positions.assign(positions.begin(), positions.end());
  release(positions);
}

std::size_t bvh::size() const { return data_ ? data_->elements.size() : 0; }
bvh_element bvh::element() const { return data_ ? data_->element : bvh_element::triangle; }
std::size_t bvh::left_out() const { return data_ ? data_->left_out : 0; }
dvec3 bvh::min() const { return data_ ? data_->min : bvh_data{}.min; }
dvec3 bvh::max() const { return data_ ? data_->max : bvh_data{}.max; }
std::size_t bvh::bytes() const {
  if (!data_) return 0;
  const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return sizeof(bvh_data) + of(data_->positions) + of(data_->single_positions) +
         of(data_->triangles) + of(data_->nodes) + of(data_->leaves) + of(data_->elements) +
         of(data_->vertices);
}

bvh make_bvh(std::span<const ivec3> triangles, std::span<const dvec3> positions,
             const bvh_options& options) {
  auto data = std::make_shared<bvh_data>();
  data->triangles.assign(triangles.begin(), triangles.end());
  data->positions.assign(positions.begin(), positions.end());
  return make(std::move(data), options);
}

bvh make_bvh(std::span<const ivec3> triangles, std::span<const vec3> positions,
             const bvh_options& options) {
  auto data = std::make_shared<bvh_data>();
  data->triangles.assign(triangles.begin(), triangles.end());
  data->positions.assign(positions.begin(), positions.end());
  return make(std::move(data), options);
}

bvh make_segment_bvh(std::span<const ivec2> segments, std::span<const dvec3> positions,
                     const bvh_options& options) {
  auto data = std::make_shared<bvh_data>();
  data->element = bvh_element::segment;
  data->triangles.reserve(segments.size());
  for (const ivec2& s : segments) data->triangles.push_back({s.x, s.y, s.y});
  data->positions.assign(positions.begin(), positions.end());
  return make(std::move(data), options);
}

bvh make_point_bvh(std::span<const dvec3> points, const bvh_options& options) {
  auto data = std::make_shared<bvh_data>();
  data->element = bvh_element::point;
  if (points.size() >= bvh_leaf_bit) {
    throw std::length_error("bvh: 2^31 points or more; at most 2147483647 are possible");
  }
  data->triangles.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    data->triangles.push_back(ivec3{static_cast<int>(i)});
  }
  data->positions.assign(points.begin(), points.end());
  return make(std::move(data), options);
}

bvh refit(const bvh& tree, std::span<const dvec3> positions, const bvh_options& options) {
  if (tree.data() == nullptr) {
    if (positions.empty()) return tree;
    throw std::invalid_argument("refit: the tree is empty; it has no vertices to move");
  }
  if (positions.size() != tree.data()->vertex_count) {
    throw std::invalid_argument("refit: " + std::to_string(positions.size()) +
                                " positions; the tree was made of " +
                                std::to_string(tree.data()->vertex_count));
  }
  auto data = std::make_shared<bvh_data>(*tree.data());
  data->positions.resize(data->vertices.size());
  release(data->single_positions);
  for (std::size_t i = 0; i < data->positions.size(); ++i) {
    const uint32_t v = data->vertices[i];
    data->positions[i] = positions[v];
    if (!is_finite(positions[v])) {
      throw std::invalid_argument("refit: vertex " + std::to_string(v) + " is not finite");
    }
  }
  if (data->elements.empty()) return bvh(std::move(data));
  data->compact_positions();
  place(*data);
  fit_bvh(*data, thread_count(options.threads));
  return bvh(std::move(data));
}

}  // namespace wisp
