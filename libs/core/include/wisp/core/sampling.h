#pragma once

// Warps from the unit square and discrete distributions. Inputs are in [0, 1). The
// functions are pure: any number of threads may draw from one distribution at once.

#include <span>
#include <vector>

#include "wisp/core/export.h"
#include "wisp/core/math.h"

namespace wisp {

// Uniform over the unit sphere; density 1 / (4 pi).
inline vec3 sample_sphere(const vec2& u) {
  float z = 1 - 2 * u.y;
  float r = std::sqrt(std::max(0.0f, 1 - z * z));
  float phi = 2 * pi * u.x;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

// Uniform over the unit disk, keeping strata (Shirley and Chiu 1997).
inline vec2 sample_disk(const vec2& u) {
  float a = 2 * u.x - 1, b = 2 * u.y - 1;
  if (a == 0 && b == 0) return {0, 0};
  if (std::abs(a) > std::abs(b)) {
    float phi = pi / 4 * (b / a);
    return {a * std::cos(phi), a * std::sin(phi)};
  }
  float phi = pi / 2 - pi / 4 * (a / b);
  return {b * std::cos(phi), b * std::sin(phi)};
}

// Cosine-weighted over the hemisphere around z; density cos / pi.
inline vec3 sample_hemisphere_cos(const vec2& u) {
  vec2 d = sample_disk(u);
  return {d.x, d.y, std::sqrt(std::max(0.0f, 1 - d.x * d.x - d.y * d.y))};
}

// Barycentrics (of the second and third vertex) uniform over a triangle.
inline vec2 sample_triangle(const vec2& u) {
  float s = std::sqrt(u.x);
  return {1 - s, u.y * s};
}

// A discrete distribution over 0 .. n-1, sampled by inversion so that strata are kept.
struct discrete_distribution {
  std::vector<float> cdf = {};  // cdf[i]: probability of 0..i; the last is 1
};
// Weights >= 0 (others count as 0); an empty result when they sum to 0.
WISP_API discrete_distribution make_discrete(std::span<const float> weights);
// Draws an index, -1 from an empty one; *remapped (if given) is u within its bin, again in [0, 1).
WISP_API int sample_discrete(const discrete_distribution& d, float u, float* remapped = nullptr);
// The probability of an index, 0 for one that is not there.
WISP_API float discrete_pdf(const discrete_distribution& d, int index);

// A density over [0, 1)^2, constant in each cell of a grid (Pharr et al.,
// Physically Based Rendering, 4th ed., A.5.7).
struct distribution_2d {
  int width = 0;
  int height = 0;
  std::vector<float> rows = {};   // cdf over rows
  std::vector<float> cells = {};  // cdf within each row
};
// Weights, row by row, >= 0 (others count as 0); empty when they sum to 0 or are not
// width * height.
WISP_API distribution_2d make_distribution_2d(std::span<const float> weights, int width,
                                              int height);
// A point of [0, 1)^2; the origin from an empty one.
WISP_API vec2 sample_2d(const distribution_2d& d, const vec2& u);
// Density with respect to the area of the unit square; 0 for an empty one. Points outside
// have that of the nearest cell.
WISP_API float distribution_pdf(const distribution_2d& d, const vec2& p);

}  // namespace wisp
