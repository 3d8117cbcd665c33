#include "wisp/geometry/sdf.h"

#include <stdexcept>
#include <string>
#include <utility>

#include "sdf_node.h"

namespace wisp {

namespace {

struct empty_node final : sdf_node {
  double at(const dvec3&, double, double) const override { return unbounded; }
  dvec3 gradient(const dvec3&) const override { return {0, 0, 0}; }
};

struct leaf_node final : sdf_node {
  std::shared_ptr<const sdf_leaf_base> leaf;
  double lipschitz;
  explicit leaf_node(std::shared_ptr<const sdf_leaf_base> l) : leaf(std::move(l)) {
    about = leaf->properties();
    lipschitz = about.lipschitz;
    check_positive(lipschitz, "sdf leaf: lipschitz");
    for (int a = 0; a < 3; ++a) {
      if (std::isnan(about.bounds.min[a]) || std::isnan(about.bounds.max[a])) {
        throw std::invalid_argument("sdf leaf: bounds are not numbers");
      }
    }
    about.lipschitz = 1;
    if (lipschitz > 1) about.exact_inside = about.exact_outside = false;
  }
  double at(const dvec3& p, double low, double high) const override {
    const double away = distance(about.bounds, p);
    // beyond the box it is not negative, and how low does not matter
    const double within = away > 0 ? std::max(high, 0.0) : std::max({-low, high, 0.0});
    const double v = leaf->distance(p, within * lipschitz) / lipschitz;
    return away > 0 && !about.exact_outside ? std::max(v, away) : v;
  }
  dvec3 gradient(const dvec3& p) const override { return leaf->gradient(p); }
};

struct function_leaf final : sdf_leaf_base {
  std::function<double(const dvec3&)> f;
  double lipschitz;
  sdf_properties about;
  double distance(const dvec3& p, double) const override { return f(p) / lipschitz; }
  sdf_properties properties() const override { return about; }
};

bool is_finite(const dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

// Nodes waiting for the values of deep operands, the innermost last.
double deep_value(const sdf_request& first) {
  std::vector<sdf_task> waiting(1);
  waiting.reserve(static_cast<std::size_t>(std::min(first.node->depth, 4096)));
  waiting.back().asked = first;
  double answer = 0;
  const double* operand = nullptr;
  while (true) {
    sdf_task& task = waiting.back();
    double own = 0;
    const auto next = task.asked.node->resume(task, operand, own);
    if (next) {
      waiting.emplace_back().asked = *next;
      operand = nullptr;
    } else {
      answer = own;
      operand = &answer;
      waiting.pop_back();
      if (waiting.empty()) return answer;
    }
  }
}

// The point between a and b where the value, of different signs at them, vanishes.
dvec3 between(const sdf_node& node, dvec3 a, double at_a, dvec3 b) {
  for (int i = 0; i < 200; ++i) {
    const dvec3 middle = a + 0.5 * (b - a);
    if (middle == a || middle == b) break;
    const double v = value(node, middle);
    if (v == 0) return middle;
    ((v < 0) == (at_a < 0) ? a : b) = middle;
  }
  return a;
}

// Whether there are points of the other side around x, where the value vanishes: not
// where two parts of a union touch. x was reached along `way`.
bool changes_sign(const sdf_node& node, const dvec3& x, const dvec3& way, bool inside, double h) {
  const double l = glm::length(way);
  const auto other = [&](const dvec3& d) {
    const double v = value(node, x + h * d);
    return inside ? v > 0 : v < 0;
  };
  if (l > 0 && other(way / l)) return true;
  const dvec3 g = gradient_of(node, x);
  if (other(inside ? g : -g)) return true;
  for (int a = 0; a < 3; ++a) {
    dvec3 d{0};
    d[a] = 1;
    if (other(d) || other(-d)) return true;
  }
  return false;
}

}  // namespace

double value(const sdf_node& node, const dvec3& p, double low, double high) {
  return node.depth <= recursion_limit ? node.at(p, low, high) : deep_value({&node, p, low, high});
}

dvec3 gradient_of(const sdf_node& node, const dvec3& p) {
  if (node.depth <= recursion_limit) return node.gradient(p);
  const auto f = [&](const dvec3& q) { return value(node, q); };
  return difference_gradient(f, p, bend_of(node.about.bounds, p));
}

void release(node_ptr&& operand) {
  if (!operand || operand->depth < recursion_limit) return operand.reset();
  // A tree's own nodes are freed one after the other: those that come to be freed
  // while one is being freed wait here.
  thread_local std::vector<node_ptr>* waiting = nullptr;
  if (waiting != nullptr) return waiting->push_back(std::move(operand));
  std::vector<node_ptr> all;
  waiting = &all;
  all.push_back(std::move(operand));
  while (!all.empty()) {
    const node_ptr last = std::move(all.back());
    all.pop_back();
  }
  waiting = nullptr;
}

sdf_leaf_base::~sdf_leaf_base() = default;

dvec3 sdf_leaf_base::gradient(const dvec3& p) const {
  return difference_gradient([this](const dvec3& q) { return distance(q, unbounded); }, p,
                             bend_of(properties().bounds, p));
}

sdf::sdf() : node_(std::make_shared<empty_node>()) {}
sdf sdf_empty() { return {}; }

sdf sdf_leaf(std::shared_ptr<const sdf_leaf_base> leaf) {
  if (!leaf) throw std::invalid_argument("sdf leaf: there is none");
  return sdf(std::make_shared<leaf_node>(std::move(leaf)));
}

sdf sdf_function(std::function<double(const dvec3&)> f, const dbox3& bounds, double lipschitz,
                 bool exact) {
  if (!f) throw std::invalid_argument("sdf function: there is none");
  check_positive(lipschitz, "sdf function: lipschitz");
  auto leaf = std::make_shared<function_leaf>();
  leaf->f = std::move(f);
  leaf->lipschitz = lipschitz;
  leaf->about = {exact, exact, 1, bounds};
  return sdf_leaf(std::move(leaf));
}

sdf_properties properties(const sdf& solid) { return solid.node().about; }

double signed_distance(const sdf& solid, const dvec3& p) {
  return signed_distance(solid, p, -unbounded, unbounded);
}

double signed_distance(const sdf& solid, const dvec3& p, double low, double high) {
  if (!is_finite(p)) return std::numeric_limits<double>::quiet_NaN();
  return value(solid.node(), p, low, high);
}

double distance_bound(const sdf& solid, const dvec3& p) {
  const double v = std::abs(signed_distance(solid, p));
  return std::isnan(v) ? 0 : v;
}

dvec3 gradient(const sdf& solid, const dvec3& p) {
  if (!is_finite(p)) return {0, 0, 0};
  return gradient_of(solid.node(), p);
}

std::optional<sdf_surface_point> project(const sdf& solid, const dvec3& p,
                                         const project_options& options) {
  if (!(options.tolerance > 0 && options.tolerance < 1)) {
    throw std::invalid_argument("project: tolerance should be between 0 and 1");
  }
  if (!is_finite(p)) return {};
  const sdf_node& node = solid.node();
  const double first = value(node, p);
  if (!std::isfinite(first)) return {};
  const double reach = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const double tolerance = std::max(
      {options.tolerance * std::max(std::abs(first), size_of(node.about.bounds)), 1e-15 * reach});

  // Steps of |value| never pass the surface. Where the value shrinks by less than a
  // step, it is a bound that is less than the distance by some factor: as Newton's
  // method does, steps are stretched by that, and cut where they pass the surface.
  dvec3 x = p;
  double v = first, stretch = 1;
  for (int i = 0; i < options.max_steps && !(std::abs(v) <= tolerance); ++i) {
    const dvec3 g = gradient_of(node, x);
    if (g == dvec3{0, 0, 0}) return {};
    dvec3 next = x - stretch * v * g;
    double w = value(node, next);
    if (!std::isfinite(w)) return {};
    if ((w < 0) != (v < 0) && std::abs(w) > tolerance) {
      next = between(node, x, v, next);
      w = value(node, next);
    }
    const double slope = (v - w) / (stretch * v);
    stretch = slope > 0 ? std::clamp(1 / slope, 1.0, 1000.0) : 1;
    x = next;
    v = w;
  }
  if (!(std::abs(v) <= tolerance)) return {};
  const bool exact = first < 0 ? node.about.exact_inside : node.about.exact_outside;
  if (!exact && first != 0 && !changes_sign(node, x, x - p, first < 0, 4 * tolerance)) return {};
  sdf_surface_point result{x, glm::distance(p, x), std::abs(v), std::abs(first)};
  result.closest = result.distance <= result.bound + 2 * tolerance;
  return result;
}

}  // namespace wisp
