#pragma once

// Running means and variances of vectors, and what is learned of the sphere around a
// point while walks go on.

#include <array>
#include <cmath>
#include <cstdint>

#include "wisp/pde/problem.h"

namespace wisp {

inline bool all_finite(const dvec4& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z) && std::isfinite(v.w);
}

// Welford's method, and Chan's to join two, component by component.
template <typename V>
struct tally {
  std::uint64_t count = 0;
  V mean = V(0.0);
  V m2 = V(0.0);

  void add(const V& x) {
    ++count;
    const V d = x - mean;
    mean += d / static_cast<double>(count);
    m2 += d * (x - mean);
  }
  void merge(const tally& b) {
    if (b.count == 0) return;
    const V d = b.mean - mean;
    const auto n = static_cast<double>(count), m = static_cast<double>(b.count);
    mean += d * (m / (n + m));
    m2 += b.m2 + d * d * (n * m / (n + m));
    count += b.count;
  }
  // Of the mean; NaN where there are less than two samples.
  V standard_error() const {
    const double n = static_cast<double>(count);
    V result;
    for (int i = 0; i < V::length(); ++i) {
      result[i] = count > 1 ? std::sqrt(std::max(m2[i], 0.0) / (n * (n - 1)))
                            : std::numeric_limits<double>::quiet_NaN();
    }
    return result;
  }
};

using channel_vectors = std::array<dvec3, max_channels>;

// The first two moments of a function on the sphere: f(nu) is about mean + slope * nu.
struct sphere_moments {
  dvec4 mean = {0, 0, 0, 0};
  channel_vectors slope = {};
  dvec3 nu = {0, 0, 0};  // of sums: that of the directions
  double weight = 0;

  dvec4 at(const dvec3& nu) const {
    dvec4 v = mean;
    for (int c = 0; c < max_channels; ++c) v[c] += glm::dot(slope[static_cast<std::size_t>(c)], nu);
    return v;
  }
  void add(const dvec4& f, const dvec3& direction) {
    mean += f;
    for (int c = 0; c < max_channels; ++c) {
      slope[static_cast<std::size_t>(c)] += 3 * f[c] * direction;
    }
    nu += direction;
    weight += 1;
  }
};

// Sums divided by their weight; the slope of what is left without the mean, so that that of
// a constant is 0 however uneven the directions are.
inline sphere_moments averaged(const sphere_moments& sum) {
  sphere_moments mean = sum;
  if (!(sum.weight > 0)) return mean;
  mean.mean /= sum.weight;
  for (int c = 0; c < max_channels; ++c) {
    dvec3& s = mean.slope[static_cast<std::size_t>(c)];
    s = (s - 3 * mean.mean[c] * sum.nu) / sum.weight;
  }
  return mean;
}

}  // namespace wisp
