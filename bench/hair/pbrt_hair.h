#pragma once

// The hair BSDF of pbrt, written out plainly from the published text, as the
// baseline that wisp::hair is measured against:
//   Pharr, "The Implementation of a Hair Scattering Model", 2016;
//   Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th ed., section 9.9.
// It keeps the book's structure: f(), PDF() and Sample_f() each start from wo, the
// tilt of the scales is written out for each lobe, A_p is found anew in each of
// them, and Sample_f() ends with f(). Two things differ: colours are RGB, and the
// value is not divided by the cosine that every caller multiplies it with, so that
// it is the lobe sum of eval_hair().
//
// The Bessel function is the book's, inexact: ten terms of the series, and above
// 12 its logarithm with half of the correction 1/(8 x). A policy selects an exact
// one, or a fast exponential as in the book's 4th edition.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <type_traits>

namespace wisp_bench {

// As published in 2016 (and in pbrt-v3).
struct pbrt_published {
  static constexpr bool exact_bessel = false;
  static constexpr bool fast_exp = false;
};
// As published in the 4th edition: the exponential of M_p is a fast one.
struct pbrt_fast_exp {
  static constexpr bool exact_bessel = false;
  static constexpr bool fast_exp = true;
};
// The formulas themselves: what the two above approximate.
struct pbrt_exact {
  static constexpr bool exact_bessel = true;
  static constexpr bool fast_exp = false;
};

// How A_p becomes the probability of a lobe: pbrt-v3 takes the luminance, pbrt-v4
// the average over the wavelengths, of which there are three here.
struct weigh_by_luminance {
  template <typename T>
  static T weigh(const glm::vec<3, T>& a) {
    return T(0.212671) * a.x + T(0.715160) * a.y + T(0.072169) * a.z;
  }
};
struct weigh_by_average {
  template <typename T>
  static T weigh(const glm::vec<3, T>& a) {
    return (a.x + a.y + a.z) * (T(1) / T(3));
  }
};

inline constexpr int pbrt_p_max = 3;
template <typename T>
inline constexpr T pbrt_pi = static_cast<T>(3.14159265358979323846L);

template <typename T>
struct pbrt_hair {
  T h = 0, gamma_o = 0, eta = 0;
  glm::vec<3, T> sigma_a = {};
  std::array<T, pbrt_p_max + 1> v = {};
  T s = 0;
  std::array<T, 3> sin_2k_alpha = {}, cos_2k_alpha = {};
};
template <typename T>
struct pbrt_hair_sample {
  glm::vec<3, T> wi = {};
  glm::vec<3, T> f = {};
  T pdf = 0;
};

namespace pbrt {

template <typename T>
inline T sqr(T x) {
  return x * x;
}
template <int n, typename T>
inline T power(T x) {
  if constexpr (n == 0)
    return T(1);
  else if constexpr (n % 2 == 0)
    return sqr(power<n / 2>(x));
  else
    return x * power<n - 1>(x);
}
template <typename T>
inline T safe_sqrt(T x) {
  return std::sqrt(std::max(T(0), x));
}
template <typename T>
inline T safe_asin(T x) {
  return std::asin(std::clamp(x, T(-1), T(1)));
}

// exp(x) as 2 to a whole power, by its bits, times a cubic for the rest: within
// 1e-4 of exp. Only for float.
inline float fast_exp(float x) {
  float y = x * 1.44269504f;
  if (y < -126) return 0;
  if (y >= 128) return std::numeric_limits<float>::infinity();
  // The floor, without a call into the library where there is no SSE 4.1.
  auto whole = static_cast<std::int32_t>(y);
  whole -= static_cast<float>(whole) > y;
  float r = y - static_cast<float>(whole);
  float two_to_r = 0.999925195f + r * (0.695833627f + r * (0.226067267f + r * 0.078024275f));
  auto shift = static_cast<std::uint32_t>(whole) << 23;
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(two_to_r) + shift);
}
template <typename Policy, typename T>
inline T exponential(T x) {
  if constexpr (Policy::fast_exp && std::is_same_v<T, float>)
    return fast_exp(x);
  else
    return std::exp(x);
}

// I0, for x < 12 if it is not the exact one.
template <typename Policy, typename T>
inline T bessel_i0(T x) {
  if constexpr (Policy::exact_bessel) {
    // Every term is positive: summed until they no longer count.
    T term = 1, sum = 1;
    for (int i = 1; term > sum * (std::numeric_limits<T>::epsilon() / 8); i++) {
      term *= sqr(x / (2 * static_cast<T>(i)));
      sum += term;
    }
    return sum;
  } else {
    T sum = 0, x2i = 1;
    std::int64_t factorial = 1, four_to_i = 1;
    for (int i = 0; i < 10; i++) {
      if (i > 1) factorial *= i;
      sum += x2i / static_cast<T>(four_to_i * sqr(factorial));
      x2i *= x * x;
      four_to_i *= 4;
    }
    return sum;
  }
}
template <typename Policy, typename T>
inline T log_bessel_i0(T x) {
  if constexpr (Policy::exact_bessel) {
    if (x <= 30) return std::log(bessel_i0<Policy>(x));
    // The asymptotic series (Abramowitz and Stegun 9.7.1), down to its last
    // digit: at x = 30 its terms shrink to 1e-26 before they grow.
    T term = 1, sum = 1;
    for (int i = 1; term > sum * (std::numeric_limits<T>::epsilon() / 8); i++) {
      term *= sqr(2 * static_cast<T>(i) - 1) / (8 * x * static_cast<T>(i));
      sum += term;
    }
    return x + std::log(sum) - std::log(2 * pbrt_pi<T> * x) / 2;
  } else {
    constexpr T two_pi = 2 * pbrt_pi<T>;
    if (x > 12) return x + T(0.5) * (-std::log(two_pi) + std::log(1 / x) + 1 / (8 * x));
    return std::log(bessel_i0<Policy>(x));
  }
}

template <typename Policy, typename T>
inline T mp(T cos_theta_i, T cos_theta_o, T sin_theta_i, T sin_theta_o, T v) {
  T a = cos_theta_i * cos_theta_o / v;
  T b = sin_theta_i * sin_theta_o / v;
  if (v > T(0.1))
    return exponential<Policy>(-b) * bessel_i0<Policy>(a) / (std::sinh(1 / v) * 2 * v);
  if constexpr (Policy::exact_bessel)
    return std::exp(log_bessel_i0<Policy>(a) - b - 1 / v - std::log1p(-std::exp(-2 / v))) / v;
  else
    return exponential<Policy>(log_bessel_i0<Policy>(a) - b - 1 / v + T(0.6931) +
                               std::log(1 / (2 * v)));
}

template <typename T>
inline T fresnel_dielectric(T cos_theta_i, T eta) {
  cos_theta_i = std::clamp(cos_theta_i, T(0), T(1));
  T sin2_theta_t = (1 - sqr(cos_theta_i)) / sqr(eta);
  if (sin2_theta_t >= 1) return T(1);
  T cos_theta_t = std::sqrt(1 - sin2_theta_t);
  T parallel = (eta * cos_theta_i - cos_theta_t) / (eta * cos_theta_i + cos_theta_t);
  T perpendicular = (cos_theta_i - eta * cos_theta_t) / (cos_theta_i + eta * cos_theta_t);
  return (sqr(parallel) + sqr(perpendicular)) / 2;
}

template <typename T>
inline std::array<glm::vec<3, T>, pbrt_p_max + 1> ap(T cos_theta_o, T eta, T h,
                                                     const glm::vec<3, T>& transmittance) {
  std::array<glm::vec<3, T>, pbrt_p_max + 1> a;
  T cos_gamma_o = safe_sqrt(1 - h * h);
  T fresnel = fresnel_dielectric(cos_theta_o * cos_gamma_o, eta);
  a[0] = glm::vec<3, T>(fresnel);
  a[1] = sqr(1 - fresnel) * transmittance;
  for (std::size_t p = 2; p < pbrt_p_max; p++) a[p] = a[p - 1] * transmittance * fresnel;
  a[pbrt_p_max] = a[pbrt_p_max - 1] * fresnel * transmittance / (T(1) - transmittance * fresnel);
  return a;
}

// Refraction into the fibre.
template <typename T>
inline T sin_gamma_t(const pbrt_hair<T>& hair, T sin_theta_o, T cos_theta_o) {
  T etap = safe_sqrt(sqr(hair.eta) - sqr(sin_theta_o)) / cos_theta_o;
  return hair.h / etap;
}
template <typename T>
inline glm::vec<3, T> transmittance(const pbrt_hair<T>& hair, T sin_theta_o, T sin_gamma_t) {
  T cos_theta_t = safe_sqrt(1 - sqr(sin_theta_o / hair.eta));
  T cos_gamma_t = safe_sqrt(1 - sqr(sin_gamma_t));
  T path = 2 * cos_gamma_t / cos_theta_t;
  return {std::exp(-hair.sigma_a.x * path), std::exp(-hair.sigma_a.y * path),
          std::exp(-hair.sigma_a.z * path)};
}

template <typename T>
inline T phi_exit(int p, T gamma_o, T gamma_t) {
  return 2 * static_cast<T>(p) * gamma_t - 2 * gamma_o + static_cast<T>(p) * pbrt_pi<T>;
}
template <typename T>
inline T logistic(T x, T s) {
  T e = std::exp(-std::abs(x) / s);
  return e / (s * sqr(1 + e));
}
template <typename T>
inline T logistic_cdf(T x, T s) {
  return 1 / (1 + std::exp(-x / s));
}
template <typename T>
inline T trimmed_logistic(T x, T s, T a, T b) {
  return logistic(x, s) / (logistic_cdf(b, s) - logistic_cdf(a, s));
}
template <typename T>
inline T sample_trimmed_logistic(T u, T s, T a, T b) {
  T k = logistic_cdf(b, s) - logistic_cdf(a, s);
  T x = -s * std::log(1 / (u * k + logistic_cdf(a, s)) - 1);
  return std::clamp(x, a, b);
}
template <typename T>
inline T np(T phi, int p, T s, T gamma_o, T gamma_t) {
  T dphi = phi - phi_exit(p, gamma_o, gamma_t);
  while (dphi > pbrt_pi<T>) dphi -= 2 * pbrt_pi<T>;
  while (dphi < -pbrt_pi<T>) dphi += 2 * pbrt_pi<T>;
  return trimmed_logistic(dphi, s, -pbrt_pi<T>, pbrt_pi<T>);
}

// sin and cos of theta_o turned by the tilt of the scales for lobe p. The cosine
// may be negative.
template <typename T>
inline glm::vec<2, T> tilted(const pbrt_hair<T>& hair, int p, T sin_theta_o, T cos_theta_o) {
  const auto& s = hair.sin_2k_alpha;
  const auto& c = hair.cos_2k_alpha;
  if (p == 0)
    return {sin_theta_o * c[1] - cos_theta_o * s[1], cos_theta_o * c[1] + sin_theta_o * s[1]};
  if (p == 1)
    return {sin_theta_o * c[0] + cos_theta_o * s[0], cos_theta_o * c[0] - sin_theta_o * s[0]};
  if (p == 2)
    return {sin_theta_o * c[2] + cos_theta_o * s[2], cos_theta_o * c[2] - sin_theta_o * s[2]};
  return {sin_theta_o, cos_theta_o};
}

template <typename Weight, typename T>
inline std::array<T, pbrt_p_max + 1> ap_pdf(const pbrt_hair<T>& hair, T cos_theta_o) {
  T sin_theta_o = safe_sqrt(1 - sqr(cos_theta_o));
  T sin_gt = sin_gamma_t(hair, sin_theta_o, cos_theta_o);
  auto a = ap(cos_theta_o, hair.eta, hair.h, transmittance(hair, sin_theta_o, sin_gt));
  T sum = 0;
  for (const auto& x : a) sum += Weight::weigh(x);
  std::array<T, pbrt_p_max + 1> pdf;
  for (std::size_t p = 0; p <= pbrt_p_max; p++) pdf[p] = Weight::weigh(a[p]) / sum;
  return pdf;
}

// The sum over the lobes of their probability times M_p N_p.
template <typename Policy, typename T>
inline T pdf_sum(const pbrt_hair<T>& hair, const std::array<T, pbrt_p_max + 1>& lobe_pdf,
                 T sin_theta_o, T cos_theta_o, T sin_theta_i, T cos_theta_i, T phi, T gamma_t) {
  T pdf = 0;
  for (int p = 0; p < pbrt_p_max; p++) {
    auto i = static_cast<std::size_t>(p);
    auto t = tilted(hair, p, sin_theta_o, cos_theta_o);
    pdf += mp<Policy>(cos_theta_i, std::abs(t.y), sin_theta_i, t.x, hair.v[i]) * lobe_pdf[i] *
           np(phi, p, hair.s, hair.gamma_o, gamma_t);
  }
  return pdf + mp<Policy>(cos_theta_i, cos_theta_o, sin_theta_i, sin_theta_o, hair.v[pbrt_p_max]) *
                   lobe_pdf[pbrt_p_max] * (1 / (2 * pbrt_pi<T>));
}

}  // namespace pbrt

// alpha is in degrees.
template <typename T>
inline pbrt_hair<T> make_pbrt_hair(T h, T eta, const glm::vec<3, T>& sigma_a, T beta_m, T beta_n,
                                   T alpha) {
  using namespace pbrt;
  pbrt_hair<T> hair;
  hair.h = h;
  hair.gamma_o = safe_asin(h);
  hair.eta = eta;
  hair.sigma_a = sigma_a;
  hair.v[0] = sqr(T(0.726) * beta_m + T(0.812) * sqr(beta_m) + T(3.7) * power<20>(beta_m));
  hair.v[1] = T(0.25) * hair.v[0];
  hair.v[2] = 4 * hair.v[0];
  hair.v[3] = hair.v[2];
  hair.s =
      T(0.626657069) * (T(0.265) * beta_n + T(1.194) * sqr(beta_n) + T(5.372) * power<22>(beta_n));
  hair.sin_2k_alpha[0] = std::sin(alpha * (pbrt_pi<T> / 180));
  hair.cos_2k_alpha[0] = safe_sqrt(1 - sqr(hair.sin_2k_alpha[0]));
  for (std::size_t i = 1; i < 3; i++) {
    hair.sin_2k_alpha[i] = 2 * hair.cos_2k_alpha[i - 1] * hair.sin_2k_alpha[i - 1];
    hair.cos_2k_alpha[i] = sqr(hair.cos_2k_alpha[i - 1]) - sqr(hair.sin_2k_alpha[i - 1]);
  }
  return hair;
}

// f |cos|: the lobe sum.
template <typename Policy = pbrt_published, typename T>
inline glm::vec<3, T> pbrt_f(const pbrt_hair<T>& hair, const glm::vec<3, T>& wo,
                             const glm::vec<3, T>& wi) {
  using namespace pbrt;
  T sin_theta_o = wo.x;
  T cos_theta_o = safe_sqrt(1 - sqr(sin_theta_o));
  T phi_o = std::atan2(wo.z, wo.y);
  T sin_theta_i = wi.x;
  T cos_theta_i = safe_sqrt(1 - sqr(sin_theta_i));
  T phi_i = std::atan2(wi.z, wi.y);

  T sin_gt = sin_gamma_t(hair, sin_theta_o, cos_theta_o);
  T gamma_t = safe_asin(sin_gt);
  auto a = ap(cos_theta_o, hair.eta, hair.h, transmittance(hair, sin_theta_o, sin_gt));

  T phi = phi_i - phi_o;
  glm::vec<3, T> sum = {0, 0, 0};
  for (int p = 0; p < pbrt_p_max; p++) {
    auto i = static_cast<std::size_t>(p);
    auto t = tilted(hair, p, sin_theta_o, cos_theta_o);
    sum += mp<Policy>(cos_theta_i, std::abs(t.y), sin_theta_i, t.x, hair.v[i]) * a[i] *
           np(phi, p, hair.s, hair.gamma_o, gamma_t);
  }
  sum += mp<Policy>(cos_theta_i, cos_theta_o, sin_theta_i, sin_theta_o, hair.v[pbrt_p_max]) *
         a[pbrt_p_max] / (2 * pbrt_pi<T>);
  return sum;
}

template <typename Policy = pbrt_published, typename Weight = weigh_by_average, typename T>
inline T pbrt_pdf(const pbrt_hair<T>& hair, const glm::vec<3, T>& wo, const glm::vec<3, T>& wi) {
  using namespace pbrt;
  T sin_theta_o = wo.x;
  T cos_theta_o = safe_sqrt(1 - sqr(sin_theta_o));
  T phi_o = std::atan2(wo.z, wo.y);
  T sin_theta_i = wi.x;
  T cos_theta_i = safe_sqrt(1 - sqr(sin_theta_i));
  T phi_i = std::atan2(wi.z, wi.y);
  T gamma_t = safe_asin(sin_gamma_t(hair, sin_theta_o, cos_theta_o));
  auto lobe_pdf = ap_pdf<Weight>(hair, cos_theta_o);
  return pdf_sum<Policy>(hair, lobe_pdf, sin_theta_o, cos_theta_o, sin_theta_i, cos_theta_i,
                         phi_i - phi_o, gamma_t);
}

namespace pbrt {

// What the two choices of random numbers share: lobe p is chosen, u_theta drives
// the longitudinal angle and u_phi the azimuth.
template <typename Policy, typename T>
inline pbrt_hair_sample<T> sample_lobe(const pbrt_hair<T>& hair, const glm::vec<3, T>& wo,
                                       const std::array<T, pbrt_p_max + 1>& lobe_pdf, int p,
                                       const glm::vec<2, T>& u_theta, T u_phi) {
  T sin_theta_o = wo.x;
  T cos_theta_o = safe_sqrt(1 - sqr(sin_theta_o));
  T phi_o = std::atan2(wo.z, wo.y);
  T v = hair.v[static_cast<std::size_t>(p)];

  auto t = tilted(hair, p, sin_theta_o, cos_theta_o);
  T cos_theta = 1 + v * std::log(std::max(u_theta.x, T(1e-5)) + (1 - u_theta.x) * std::exp(-2 / v));
  T sin_theta = safe_sqrt(1 - sqr(cos_theta));
  T cos_phi = std::cos(2 * pbrt_pi<T> * u_theta.y);
  T sin_theta_i = -cos_theta * t.x + sin_theta * cos_phi * t.y;
  T cos_theta_i = safe_sqrt(1 - sqr(sin_theta_i));

  T gamma_t = safe_asin(sin_gamma_t(hair, sin_theta_o, cos_theta_o));
  T dphi = p < pbrt_p_max ? phi_exit(p, hair.gamma_o, gamma_t) +
                                sample_trimmed_logistic(u_phi, hair.s, -pbrt_pi<T>, pbrt_pi<T>)
                          : 2 * pbrt_pi<T> * u_phi;
  T phi_i = phi_o + dphi;

  pbrt_hair_sample<T> sample;
  sample.wi = {sin_theta_i, cos_theta_i * std::cos(phi_i), cos_theta_i * std::sin(phi_i)};
  sample.pdf = pdf_sum<Policy>(hair, lobe_pdf, sin_theta_o, cos_theta_o, sin_theta_i, cos_theta_i,
                               dphi, gamma_t);
  sample.f = pbrt_f<Policy>(hair, wo, sample.wi);
  return sample;
}

// Two numbers out of one: its even bits and its odd bits.
template <typename T>
inline glm::vec<2, T> demux(T x) {
  auto compact = [](std::uint64_t b) {
    b &= 0x55555555;
    b = (b ^ (b >> 1)) & 0x33333333;
    b = (b ^ (b >> 2)) & 0x0f0f0f0f;
    b = (b ^ (b >> 4)) & 0x00ff00ff;
    return (b ^ (b >> 8)) & 0x0000ffff;
  };
  auto bits = static_cast<std::uint64_t>(x * T(4294967296));
  return {static_cast<T>(compact(bits)) / 65536, static_cast<T>(compact(bits >> 1)) / 65536};
}

}  // namespace pbrt

// The choice of 2016: four numbers taken from two by their bits, lobes weighted by
// luminance.
template <typename Policy = pbrt_published, typename Weight = weigh_by_luminance, typename T>
inline pbrt_hair_sample<T> pbrt_sample_v3(const pbrt_hair<T>& hair, const glm::vec<3, T>& wo,
                                          const glm::vec<2, T>& u) {
  using namespace pbrt;
  auto u0 = demux(u.x), u1 = demux(u.y);
  auto lobe_pdf = ap_pdf<Weight>(hair, safe_sqrt(1 - sqr(wo.x)));
  int p = 0;
  for (; p < pbrt_p_max; p++) {
    T probability = lobe_pdf[static_cast<std::size_t>(p)];
    if (u0.x < probability) break;
    u0.x -= probability;
  }
  return sample_lobe<Policy>(hair, wo, lobe_pdf, p, u1, u0.y);
}

// The choice of the 4th edition: uc picks the lobe and what is left of it the
// azimuth; lobes are weighted by the average.
template <typename Policy = pbrt_published, typename Weight = weigh_by_average, typename T>
inline pbrt_hair_sample<T> pbrt_sample_v4(const pbrt_hair<T>& hair, const glm::vec<3, T>& wo, T uc,
                                          const glm::vec<2, T>& u) {
  using namespace pbrt;
  auto lobe_pdf = ap_pdf<Weight>(hair, safe_sqrt(1 - sqr(wo.x)));
  T total = 0;
  for (T x : lobe_pdf) total += x;
  T up = uc * total;
  if (up == total) up = std::nextafter(up, T(0));
  std::size_t p = 0;
  T sum = 0;
  while (p < pbrt_p_max && sum + lobe_pdf[p] <= up) sum += lobe_pdf[p++];
  T rest = std::min((up - sum) / lobe_pdf[p], 1 - std::numeric_limits<T>::epsilon() / 2);
  return sample_lobe<Policy>(hair, wo, lobe_pdf, static_cast<int>(p), u, rest);
}

}  // namespace wisp_bench
