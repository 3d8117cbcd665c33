#include "wisp/geometry/inside.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "boundary.h"
#include "query.h"
#include "winding_exact.h"
#include "wisp/core/parallel.h"
#include "wisp/geometry/fast_winding.h"
#include "wisp/geometry/spatial_order.h"

namespace wisp {

struct inside_data {
  bvh tree = {};
  inside_options options = {};
  inside_method method = inside_method::nothing;
  std::size_t boundary_edges = 0;
  winding exact = {};
  fast_winding fast = {};
};

namespace {

// Fast winding numbers of soups, to about 5e-4.
constexpr double soup_beta = 3;

// So many edges are chained to loops in any case, to see how much they cost.
constexpr std::size_t few_edges = 512;

// A tree over curves takes time with the logarithm of their length. A boundary that
// fills space, as that of a soup does, takes time with its length, and there fast
// winding numbers know a cheaper way.
bool is_soup(std::size_t edges, std::size_t triangles) {
  return edges > few_edges && edges > triangles / 2;
}
bool is_costly(const winding_data& w) {
  constexpr double most = 150;  // groups of eight edges or clusters, some 20 ns each
  const bvh_data& data = *w.tree.data();
  return w.edges > few_edges &&
         boundary_cost(w.boundary, data.min * data.scale, data.max * data.scale) > most;
}

}  // namespace

inside_test::inside_test(const bvh& tree, const inside_options& options) {
  if (!tree.empty() && tree.element() != bvh_element::triangle) {
    throw std::invalid_argument("inside test: of a tree that is not over triangles");
  }
  auto data = std::make_shared<inside_data>();
  data->tree = tree;
  data->options = options;
  if (!tree.empty()) {
    const auto edges = open_edges(*tree.data(), options.threads);
    data->boundary_edges = edges.size();
    bool moments = is_soup(edges.size(), tree.size());
    if (!moments) {
      data->exact = make_winding(tree, edges, {.threads = options.threads});
      moments = is_costly(*data->exact.data());
    }
    if (moments) {
      data->exact = {};
      data->fast = make_fast_winding(tree, {.threads = options.threads});
    }
    data->method = moments         ? inside_method::moments
                   : edges.empty() ? inside_method::crossings
                                   : inside_method::boundary;
  }
  data_ = std::move(data);
}

const bvh& inside_test::tree() const {
  static const bvh none;
  return data_ ? data_->tree : none;
}
inside_method inside_test::method() const { return data_ ? data_->method : inside_method::nothing; }
const char* inside_test::reason() const {
  switch (method()) {
    case inside_method::nothing:
      return "there are no triangles";
    case inside_method::crossings:
      return "the mesh is closed: every edge is met by one that runs the other way";
    case inside_method::boundary:
      return "the mesh is open: some edges are not met by one that runs the other way";
    case inside_method::moments:
      return "the mesh is a soup, or as open as one: its boundary has too many edges";
  }
  return "";
}
fill_rule inside_test::rule() const { return data_ ? data_->options.rule : fill_rule::nonzero; }
std::size_t inside_test::boundary_edges() const { return data_ ? data_->boundary_edges : 0; }
std::size_t inside_test::bytes() const {
  return data_ ? sizeof(inside_data) + data_->exact.bytes() + data_->fast.bytes() : 0;
}

inside_result judge_winding(double w, fill_rule rule) {
  inside_result r;
  r.winding = w;
  if (std::isnan(w)) {
    r.confidence = 0;
    return r;
  }
  double from_change = 0;
  switch (rule) {
    case fill_rule::nonzero:
      r.inside = std::abs(w) >= 0.5;
      from_change = std::abs(std::abs(w) - 0.5);
      break;
    case fill_rule::positive:
      r.inside = w >= 0.5;
      from_change = std::abs(w - 0.5);
      break;
    case fill_rule::even_odd: {
      const double from_even = std::abs(w - 2 * std::nearbyint(w / 2));  // at most 1
      r.inside = from_even >= 0.5;
      from_change = std::abs(from_even - 0.5);
      break;
    }
  }
  r.confidence = std::min(1.0, 2 * from_change);
  return r;
}

inside_result inside(const inside_test& test, const dvec3& p) {
  double w = 0;
  if (std::isnan(p.x) || std::isnan(p.y) || std::isnan(p.z)) {
    w = std::numeric_limits<double>::quiet_NaN();
  } else if (const inside_data* data = test.data()) {
    if (data->method == inside_method::moments) {
      const bool finite = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
      w = finite ? fast_winding_number(data->fast, p, soup_beta) : 0;
    } else {
      w = winding_number(data->exact, p);
    }
  }
  return judge_winding(w, test.rule());
}

void inside_all(const inside_test& test, std::span<const dvec3> points,
                std::span<inside_result> results, int threads) {
  if (points.size() != results.size()) {
    throw std::invalid_argument("inside_all: " + std::to_string(results.size()) + " results for " +
                                std::to_string(points.size()) + " points");
  }
  const int n = thread_count(threads);
  if (test.method() != inside_method::moments) {
    // to put points in an order would cost more than most queries
    parallel_for(
        points.size(), n, [&](std::size_t i) { results[i] = inside(test, points[i]); }, 512);
    return;
  }
  const std::vector<uint32_t> order = spatial_order(points, n);
  parallel_for(
      points.size(), n, [&](std::size_t i) { results[order[i]] = inside(test, points[order[i]]); },
      512);
}

}  // namespace wisp
