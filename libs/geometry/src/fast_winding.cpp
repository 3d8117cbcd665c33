#include "wisp/geometry/fast_winding.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "fast_winding_data.h"
#include "wisp/core/parallel.h"
#include "wisp/geometry/point_cloud.h"
#include "wisp/geometry/spatial_order.h"

namespace wisp {

namespace {

constexpr double full = 12.566370614359172954;  // 4 pi

// Farther away all is one dipole, in double: its next term is smaller by this.
constexpr double very_far = 1e6;

bool is_finite(const dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

void check(const fast_winding_options& options) {
  if (options.order < 1 || options.order > 3) {
    throw std::invalid_argument("make_fast_winding: the order should be 1, 2 or 3, not " +
                                std::to_string(options.order));
  }
}

void check_beta(double beta) {
  if (!(beta > 0)) throw std::invalid_argument("fast_winding_number: beta should be above 0");
}

double evaluate(const fast_winding_data& fast, const dvec3& x, float beta2) {
  if (!is_finite(x)) return std::numeric_limits<double>::quiet_NaN();
  const bvh_data& data = *fast.tree.data();
  const dvec3 p = data.normalized(x);
  const double size = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  if (!(size < very_far)) {
    if (!std::isfinite(size)) return 0;
    const dvec3 q = p / size;
    const double l = glm::length(q);
    return -glm::dot(fast.total, q / l) / full / (size * l) / (size * l);
  }
  fast_query q;
  q.data = &fast;
  q.p = p;
  q.beta2 = beta2;
  q.sum = 0;
  run_fast_winding(q);
  return q.sum;
}

float squared(double beta) {
  // a finite beta may be too large for a float, and one squared too small
  return std::max(static_cast<float>(std::min(beta * beta, 1e30)), 1e-30f);
}

float beta2_of(double beta) { return std::isinf(beta) ? infinity : squared(beta); }

}  // namespace

double half_angle(const fast_winding_data& fast, uint32_t slot, const dvec3& p) {
  const bvh_data& data = *fast.tree.data();
  std::array<dvec3, 3> v = data.corners(slot);
  for (dvec3& x : v) x = data.normalized(x) - p;
  const double a = glm::length(v[0]), b = glm::length(v[1]), c = glm::length(v[2]);
  const double sine = glm::dot(v[0], glm::cross(v[1] - v[0], v[2] - v[0]));
  if (sine == 0) return 0;  // in its plane
  const double cosine =
      a * b * c + glm::dot(v[0], v[1]) * c + glm::dot(v[1], v[2]) * a + glm::dot(v[2], v[0]) * b;
  return std::atan2(sine, cosine);
}

std::size_t fast_winding::bytes() const {
  if (!data_) return 0;
  return sizeof(fast_winding_data) +
         (data_->rows.capacity() + data_->areas.capacity()) * sizeof(eight_floats) +
         (data_->points ? data_->tree.bytes() : 0);
}

int fast_winding::order() const { return data_ ? data_->order : 0; }

fast_winding make_fast_winding(const bvh& tree, const fast_winding_options& options) {
  check(options);
  if (!tree.empty() && tree.element() != bvh_element::triangle) {
    throw std::invalid_argument("make_fast_winding: the tree should be of triangles");
  }
  auto fast = std::make_shared<fast_winding_data>();
  fast->tree = tree;
  fast->order = options.order;
  if (!tree.empty()) build_moments(*fast, {}, options.threads);
  return fast_winding(std::move(fast));
}

fast_winding make_fast_winding(std::span<const dvec3> points, std::span<const dvec3> normals,
                               std::span<const double> areas, const fast_winding_options& options) {
  check(options);
  if (normals.size() != points.size() || (!areas.empty() && areas.size() != points.size())) {
    throw std::invalid_argument(
        "make_fast_winding: there should be as many normals, and areas if any, as points");
  }
  for (const double a : areas) {
    if (!(a >= 0) || std::isinf(a)) {
      throw std::invalid_argument("make_fast_winding: areas should be finite and not negative");
    }
  }
  auto fast = std::make_shared<fast_winding_data>();
  fast->tree = make_point_bvh(points, {options.threads});
  fast->order = options.order;
  fast->points = true;
  if (fast->tree.empty()) return fast_winding(std::move(fast));

  std::vector<double> estimated;
  if (areas.empty()) {
    estimated = estimate_areas(fast->tree, points, normals, 12, options.threads);
    areas = estimated;
  }
  const bvh_data& data = *fast->tree.data();
  std::vector<dvec3> vectors(data.elements.size(), dvec3{0, 0, 0});
  for (std::size_t slot = 0; slot < vectors.size(); ++slot) {
    const uint32_t i = data.elements[slot];
    const dvec3& n = normals[i];
    const double size = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
    if (!is_finite(n) || size == 0) continue;
    // finite whatever the units are
    vectors[slot] = glm::normalize(n / size) * (areas[i] * data.scale * data.scale);
    if (!is_finite(vectors[slot])) {
      throw std::invalid_argument("make_fast_winding: an area is too large for the points");
    }
  }
  fast->areas.resize(3 * data.leaves.size(), eight_floats{});
  for (std::size_t l = 0; l < data.leaves.size(); ++l) {
    for (uint32_t i = 0; i < data.leaves[l].count; ++i) {
      const dvec3 v = vectors[data.leaves[l].first + i] / full;
      for (int a = 0; a < 3; ++a) {
        fast->areas[3 * l + static_cast<std::size_t>(a)].v[i] = static_cast<float>(v[a]);
      }
    }
  }
  build_moments(*fast, vectors, options.threads);
  return fast_winding(std::move(fast));
}

double fast_winding_number(const fast_winding& fast, const dvec3& p, double beta) {
  check_beta(beta);
  if (!is_finite(p)) return std::numeric_limits<double>::quiet_NaN();
  if (fast.data() == nullptr || fast.data()->tree.empty()) return 0;
  return evaluate(*fast.data(), p, beta2_of(beta));
}

void fast_winding_numbers(const fast_winding& fast, std::span<const dvec3> points,
                          std::span<double> results, double beta, int threads) {
  if (points.size() != results.size()) {
    throw std::invalid_argument(
        "fast_winding_numbers: there should be as many results as there are points");
  }
  check_beta(beta);
  if (fast.data() == nullptr || fast.data()->tree.empty()) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      results[i] = is_finite(points[i]) ? 0 : std::numeric_limits<double>::quiet_NaN();
    }
    return;
  }
  const float beta2 = beta2_of(beta);
  constexpr std::size_t grain = 256;
  std::vector<uint32_t> order;
  // to sort the points takes longer than it saves where caches hold most of the tree
  constexpr std::size_t large = std::size_t{1} << 21;
  if (fast.bytes() > large && points.size() >= grain && points.size() < 0xffffffffu) {
    order = spatial_order(points, threads);
  }
  const std::size_t groups = (points.size() + grain - 1) / grain;
  parallel_for(groups, threads, [&](std::size_t g) {
    const std::size_t last = std::min((g + 1) * grain, points.size());
    for (std::size_t k = g * grain; k < last; ++k) {
      const std::size_t i = order.empty() ? k : order[k];
      results[i] = evaluate(*fast.data(), points[i], beta2);
    }
  });
}

}  // namespace wisp
