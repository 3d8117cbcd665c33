#include "wisp/geometry/sdf.h"

#include <stdexcept>
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
  explicit leaf_node(std::shared_ptr<const sdf_leaf_base> l) : leaf(std::move(l)) {
    about = leaf->properties();
    about.lipschitz = 1;
  }
  double at(const dvec3& p, double low, double high) const override {
    return leaf->distance(p, std::max({-low, high, 0.0}));
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

double size_of(const sdf_properties& about) {
  if (!wisp::is_finite(about.bounds)) return 0;
  const dvec3 extent = about.bounds.max - about.bounds.min;
  return std::max({extent.x, extent.y, extent.z});
}

}  // namespace

sdf_leaf_base::~sdf_leaf_base() = default;

dvec3 sdf_leaf_base::gradient(const dvec3& p) const {
  return difference_gradient([this](const dvec3& q) { return distance(q, unbounded); }, p,
                             size_of(properties()));
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
  return solid.node().at(p, low, high);
}

dvec3 gradient(const sdf& solid, const dvec3& p) {
  if (!is_finite(p)) return {0, 0, 0};
  return solid.node().gradient(p);
}

std::optional<sdf_surface_point> project(const sdf& solid, const dvec3& p,
                                         const project_options& options) {
  if (!is_finite(p)) return {};
  const sdf_node& node = solid.node();
  const double first = value(node, p);
  if (!std::isfinite(first)) return {};
  const double tolerance =
      options.tolerance * std::max(std::min(std::abs(first), 1e300), size_of(node.about));
  dvec3 x = p;
  double v = first;
  for (int i = 0; i < options.max_steps; ++i) {
    if (std::abs(v) <= tolerance) return sdf_surface_point{x, glm::distance(p, x), std::abs(v)};
    const dvec3 g = node.gradient(x);
    if (g == dvec3{0, 0, 0}) return {};
    const dvec3 next = x - v * g;
    const double w = value(node, next);
    if (!std::isfinite(w)) return {};
    x = next;
    v = w;
  }
  return {};
}

}  // namespace wisp
