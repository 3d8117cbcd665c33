#pragma once

// The parameters of a hair material, and Chiang's maps from roughness to the
// widths of the lobes, both ways. The functions are pure and safe to call from any thread.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "wisp/hair/math.h"

namespace wisp::hair {

// The largest p_max: lobes 0 .. p_max - 1 are exact, lobe p_max gathers the rest.
inline constexpr int max_p_max = 6;
// Roughness below this is taken as this: at it a lobe is 7e-5 radians wide.
inline constexpr double min_roughness = 1e-4;

template <typename T>
struct hair_parameters {
  T eta = T(1.55);    // index of refraction, >= 1
  T beta_m = T(0.3);  // longitudinal roughness, [0, 1]; clamped to [min_roughness, 1]
  T beta_n = T(0.3);  // azimuthal roughness, [0, 1]; clamped to [min_roughness, 1]
  T alpha = T(2);     // tilt of the scales, degrees, with the sign of pbrt
  int p_max = 3;      // [1, max_p_max]

  // Beyond the paper. R, TT, TRT are entries 0, 1, 2.
  T coat = 0;  // [0, 1]: a coat that narrows R; its beta_m is multiplied by 1 - coat
  // Strength of a lobe for each colour channel, >= 0; above 1 energy is made.
  // The lobes after TRT have TRT's.
  std::array<glm::vec<3, T>, 3> strength = {glm::vec<3, T>(1), glm::vec<3, T>(1),
                                            glm::vec<3, T>(1)};
  // beta_m and beta_n of a lobe of its own, for which it is as wide as R is for
  // these; negative: what follows from beta_m and beta_n (TT half as wide along
  // the fibre as R, TRT twice). The lobes after TRT are as wide as TRT.
  std::array<glm::vec<2, T>, 3> roughness = {glm::vec<2, T>(-1), glm::vec<2, T>(-1),
                                             glm::vec<2, T>(-1)};
};

// The same parameters with numbers of another type: convert<double>(k). From float to
// double they are kept exactly; from double to float each is rounded to the nearest.
template <typename To, typename From>
inline hair_parameters<To> convert(const hair_parameters<From>& from) {
  hair_parameters<To> to;
  to.eta = static_cast<To>(from.eta);
  to.beta_m = static_cast<To>(from.beta_m);
  to.beta_n = static_cast<To>(from.beta_n);
  to.alpha = static_cast<To>(from.alpha);
  to.p_max = from.p_max;
  to.coat = static_cast<To>(from.coat);
  for (std::size_t i = 0; i < 3; i++) {
    to.strength[i] = glm::vec<3, To>(from.strength[i]);
    to.roughness[i] = glm::vec<2, To>(from.roughness[i]);
  }
  return to;
}

// Longitudinal variance v of R for a roughness beta_m (Chiang et al. 2016, equation 7).
template <typename T>
inline T longitudinal_variance(T beta_m) {
  T b = beta_m;
  return sqr(T(0.726) * b + T(0.812) * b * b + T(3.7) * std::pow(b, T(20)));
}
// Scale s of the logistic for a roughness beta_n (Chiang et al. 2016, equation 8).
template <typename T>
inline T logistic_scale(T beta_n) {
  T b = beta_n;
  return T(0.626657069) * (T(0.265) * b + T(1.194) * b * b + T(5.372) * std::pow(b, T(22)));
}

namespace detail {

// The b in [0, 1] at which the rising polynomial c1 b + c2 b^2 + c3 b^power is
// y; its ends where y lies outside of what it reaches. In double, since the
// last step of Newton's method divides what is left of a difference.
inline double invert_roughness_map(double y, double c1, double c2, double c3, int power) {
  if (!(y > 0)) return 0;
  if (y >= c1 + c2 + c3) return 1;
  double low = 0, high = 1, b = std::min(1.0, y / c1);
  for (int i = 0; i < 100; i++) {
    double t = c3 * std::pow(b, power - 1);
    double f = b * (c1 + c2 * b + t) - y;
    (f > 0 ? high : low) = b;
    double next = b - f / (c1 + 2 * c2 * b + power * t);
    if (!(next > low && next < high)) next = (low + high) / 2;
    if (std::abs(next - b) <= 1e-16 * b) break;
    b = next;
  }
  return b;
}

}  // namespace detail

// The inverse maps: the roughness, in [0, 1], whose variance is v, and whose
// scale is s; 1 for larger ones.
template <typename T>
inline T beta_m_from_variance(T v) {
  double y = std::sqrt(std::max(0.0, static_cast<double>(v)));
  return static_cast<T>(detail::invert_roughness_map(y, 0.726, 0.812, 3.7, 20));
}
template <typename T>
inline T beta_n_from_scale(T s) {
  double y = static_cast<double>(s) / 0.626657069;
  return static_cast<T>(detail::invert_roughness_map(y, 0.265, 1.194, 5.372, 22));
}

}  // namespace wisp::hair
