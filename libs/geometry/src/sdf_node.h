#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "wisp/geometry/sdf.h"

namespace wisp {

inline constexpr double unbounded = std::numeric_limits<double>::infinity();

struct sdf_node {
  sdf_properties about = {};
  int depth = 0;

  virtual ~sdf_node() = default;
  // The value where it lies in [low, high]; else between the nearer of the two and
  // the value.
  virtual double at(const dvec3& p, double low, double high) const = 0;
  virtual dvec3 gradient(const dvec3& p) const;
};

inline double value(const sdf_node& node, const dvec3& p) {
  return node.at(p, -unbounded, unbounded);
}

// The gradient of a function of a point by central differences of a step that suits
// the point and a size.
template <typename Function>
dvec3 difference_gradient(const Function& f, const dvec3& p, double size) {
  const double h = 6e-6 * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z), size, 1e-100});
  dvec3 g;
  for (int a = 0; a < 3; ++a) {
    dvec3 lower = p, upper = p;
    lower[a] -= h;
    upper[a] += h;
    g[a] = f(upper) - f(lower);
  }
  const double length = glm::length(g);
  return length > 0 && std::isfinite(length) ? g / length : dvec3{0, 0, 0};
}

// Throws std::invalid_argument where x is not finite.
void check_finite(double x, const char* what);
void check_finite(const dvec3& v, const char* what);
void check_positive(double x, const char* what);

}  // namespace wisp
