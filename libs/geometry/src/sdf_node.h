#pragma once

// What solids are made of: nodes that never change once they are made.

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "wisp/geometry/sdf.h"

namespace wisp {

inline constexpr double unbounded = std::numeric_limits<double>::infinity();
// Evaluation and destruction recurse into trees no deeper than this; what is deeper
// is worked on from a list, so that no tree overflows the stack.
inline constexpr int recursion_limit = 64;

struct sdf_node;
using node_ptr = std::shared_ptr<const sdf_node>;
struct near_values;

// A value that is asked for: see sdf_node::at.
struct sdf_request {
  const sdf_node* node = nullptr;
  dvec3 p = {0, 0, 0};
  double low = -unbounded, high = unbounded;
};
// How far a node has come with one.
struct sdf_task {
  sdf_request asked = {};
  std::size_t next = 0;  // the operand whose turn it is
  double best = 0;
  std::shared_ptr<near_values> near = {};  // of smooth operations
};

struct sdf_node {
  sdf_properties about = {};
  int depth = 0;

  sdf_node() = default;
  sdf_node(const sdf_node&) = delete;
  sdf_node& operator=(const sdf_node&) = delete;
  virtual ~sdf_node() = default;
  // The value where it lies in [low, high]; else between the nearer of the two and
  // the value. Outside of about.bounds no less than the distance from them. Only for
  // nodes within the recursion limit.
  virtual double at(const dvec3& p, double low, double high) const = 0;
  virtual dvec3 gradient(const dvec3& p) const;
  // The same as `at` for nodes of any depth: asks for the value of an operand that is
  // too deep to recurse into, and is called again with it; or has the answer.
  virtual std::optional<sdf_request> resume(sdf_task& task, const double* operand,
                                            double& answer) const {
    (void)operand;
    answer = at(task.asked.p, task.asked.low, task.asked.high);
    return {};
  }
};

// The value, as `at` has it.
double value(const sdf_node& node, const dvec3& p, double low = -unbounded,
             double high = unbounded);
dvec3 gradient_of(const sdf_node& node, const dvec3& p);

// Frees operands of a tree that is too deep to be freed by recursion.
void release(node_ptr&& operand);

// The gradient of a function of a point by central differences, for a function that
// bends over a length of `size`. The step is where rounding, which grows with the
// coordinates, and curvature cost the same.
template <typename Function>
dvec3 difference_gradient(const Function& f, const dvec3& p, double size) {
  const double reach = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z), size, 1e-100});
  const double bend = size > 0 ? size : reach;
  const double h = bend * std::cbrt(2.2e-16 * (reach / bend));
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

// The longest side of a box, 0 where it has none or an infinite one.
inline double size_of(const dbox3& b) {
  if (is_empty(b) || !is_finite(b)) return 0;
  const dvec3 extent = b.max - b.min;
  return std::max({extent.x, extent.y, extent.z});
}
// The length over which a solid in a box may bend, seen from p.
inline double bend_of(const dbox3& b, const dvec3& p) {
  if (is_empty(b) || !is_finite(b)) return 0;
  const dvec3 d = glm::abs(p - (b.min + b.max) / 2.0);
  return std::max({size_of(b) / 2, d.x, d.y, d.z});
}

// v or, outside of the box, the distance from it, if that is more.
inline double no_less_than_box(const dbox3& box, const dvec3& p, double v) {
  const double d = distance(box, p);
  return d > 0 ? std::max(v, d) : v;
}

inline dvec3 direction_from(const dbox3& box, const dvec3& p) {
  return glm::normalize(p - glm::clamp(p, box.min, box.max));
}

// Throws std::invalid_argument where x is not finite.
void check_finite(double x, const char* what);
void check_finite(const dvec3& v, const char* what);
void check_positive(double x, const char* what);

}  // namespace wisp
