#pragma once

// Scattering by a hair fibre: the near-field model of Marschner et al. 2003,
// d'Eon et al. 2011 and Chiang et al. 2016, as written out by Pharr, "The
// Implementation of a Hair Scattering Model" (2016; [P] below).
//
// Conventions
//   - Local frame of a fibre: x along it from root to tip, y and z across it,
//     right-handed. Directions have unit length and point away from the fibre.
//     wo is where the light goes (the viewer), wi where it comes from.
//   - h in [-1, 1] is where the ray meets the fibre's width: the offset from the
//     axis, over the radius, along +y when z faces the viewer, so that
//     gamma_o = asin(h).
//   - sigma_a is the absorption per unit fibre radius.
//   - eval_hair gives f |cos(theta_i)|: the cosine is included.
//   - alpha, the tilt of the scales, is in degrees at the interface.
//   - theta is the angle to the plane across the fibre, phi the angle around it.
//
// The work is split by how often it changes: hair_bsdf holds what follows from
// the material, hair_hit what follows from the viewing direction, h and the
// absorption, and a call of eval or sample does the rest. Everything is a
// template over float (for renderers) and double (for tests and tables). All
// functions are pure and safe to call from any thread.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

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
  T alpha = T(2);     // tilt of the scales, degrees
  int p_max = 3;      // [1, max_p_max]
};

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

// What follows from the material alone.
template <typename T>
struct hair_bsdf {
  T eta = T(1.55);
  int p_max = 3;
  T s = 0;               // logistic scale
  T logistic_norm = 0;   // 1 / (s * probability of [-pi, pi])
  T logistic_cdf_a = 0;  // cdf at -pi
  // For each lobe: variance, 1 / (2 v), exp(-2 / v), 1 / (v (1 - exp(-2 / v))),
  // sine and cosine of the tilt.
  std::array<T, max_p_max + 1> v = {}, half_over_v = {}, exp_m2_over_v = {}, mp_norm = {};
  std::array<T, max_p_max + 1> sin_tilt = {}, cos_tilt = {};
};

template <typename T>
inline hair_bsdf<T> make_hair_bsdf(const hair_parameters<T>& parameters) {
  hair_bsdf<T> bsdf;
  bsdf.eta = std::max(T(1), parameters.eta);
  bsdf.p_max = std::clamp(parameters.p_max, 1, max_p_max);
  T lowest = static_cast<T>(min_roughness);
  T v = longitudinal_variance(std::clamp(parameters.beta_m, lowest, T(1)));
  bsdf.s = logistic_scale(std::clamp(parameters.beta_n, lowest, T(1)));
  T e = std::exp(-pi_v<T> / bsdf.s);
  bsdf.logistic_cdf_a = e / (1 + e);
  bsdf.logistic_norm = (1 + e) / (bsdf.s * (1 - e));
  T alpha = parameters.alpha * (pi_v<T> / 180);
  for (int p = 0; p <= bsdf.p_max; p++) {
    auto i = static_cast<std::size_t>(p);
    // [P] section 3.1: TT is narrower, TRT and beyond are wider.
    bsdf.v[i] = p == 0 ? v : p == 1 ? v / 4 : 4 * v;
    bsdf.half_over_v[i] = 1 / (2 * bsdf.v[i]);
    bsdf.exp_m2_over_v[i] = std::exp(-2 / bsdf.v[i]);
    bsdf.mp_norm[i] = -1 / (bsdf.v[i] * std::expm1(-2 / bsdf.v[i]));
    // [P] section 3.4: scales turn R by -2 alpha, TT by alpha, TRT by 4 alpha;
    // later lobes and the residual stay.
    T tilt = p == bsdf.p_max ? T(0)
             : p == 0        ? -2 * alpha
             : p == 1        ? alpha
             : p == 2        ? 4 * alpha
                             : T(0);
    bsdf.sin_tilt[i] = std::sin(tilt);
    bsdf.cos_tilt[i] = std::cos(tilt);
  }
  return bsdf;
}

// M_p: the longitudinal lobe of variance v around the mirror direction, with
// respect to cos(theta_i) d theta_i (d'Eon et al. 2011, equation 7):
//   exp(-sin_i sin_o / v) I0(cos_i cos_o / v) / (2 v sinh(1 / v)).
// With 1 / sinh written as an exponential and I0 as exp times I0e the exponents
// join to -(1 + sin_i sin_o - cos_i cos_o) / v, half a sum of squares over v:
// nothing overflows or cancels for any v > 0. mp_norm = 1 / (v (1 - exp(-2 / v))).
template <typename T>
inline T longitudinal_mp(T sin_theta_i, T cos_theta_i, T sin_theta_o, T cos_theta_o, T half_over_v,
                         T mp_norm) {
  T d = sqr(sin_theta_i + sin_theta_o) + sqr(cos_theta_i - cos_theta_o);
  T a = cos_theta_i * cos_theta_o * 2 * half_over_v;
  return bessel_i0e(a) * std::exp(-d * half_over_v) * mp_norm;
}

// Phi(p, h): the azimuth by which light of mode p leaves ([P] section 3.3).
template <typename T>
inline T exit_azimuth_phi(int p, T gamma_o, T gamma_t) {
  T fp = static_cast<T>(p);
  return 2 * fp * gamma_t - 2 * gamma_o + fp * pi_v<T>;
}

// N_p: the logistic distribution around Phi(p, h), trimmed to [-pi, pi]. `dphi`
// is phi - Phi, of any size.
template <typename T>
inline T azimuthal_np(T dphi, T s, T logistic_norm) {
  T e = std::exp(-std::abs(wrap_angle(dphi)) / s);
  return e * logistic_norm / sqr(1 + e);
}

// Reflectance of a smooth dielectric seen from outside under the cosine c >= 0.
template <typename T>
inline T fresnel_dielectric(T c, T eta) {
  T g = safe_sqrt(eta * eta - 1 + c * c);  // eta cos_t
  if (g + c <= 0) return T(1);
  T n2 = eta * eta;
  T perpendicular = (c - g) / (c + g);
  T parallel = (n2 * c - g) / (n2 * c + g);
  return std::clamp((sqr(perpendicular) + sqr(parallel)) / 2, T(0), T(1));
}

// A_p: the part of the light in each mode, [P] section 3.2: Fresnel, and the
// transmittance of each pass through the fibre; entry p_max is the sum of all
// later modes.
template <typename T>
inline std::array<glm::vec<3, T>, max_p_max + 1> attenuation_ap(T fresnel,
                                                                const glm::vec<3, T>& transmittance,
                                                                int p_max) {
  std::array<glm::vec<3, T>, max_p_max + 1> ap = {};
  ap[0] = glm::vec<3, T>(fresnel);
  glm::vec<3, T> tf = transmittance * fresnel;
  glm::vec<3, T> a = sqr(1 - fresnel) * transmittance;
  for (int p = 1; p < p_max; p++) {
    ap[static_cast<std::size_t>(p)] = a;
    a *= tf;
  }
  // The geometric series; at F = T = 1 nothing enters and 0 / 0 is 0.
  auto last = static_cast<std::size_t>(p_max);
  for (int k = 0; k < 3; k++) {
    T rest = 1 - tf[k];
    ap[last][k] = rest > 0 ? a[k] / rest : T(0);
  }
  return ap;
}

// What follows from wo, h and the absorption.
template <typename T>
struct hair_hit {
  T sin_theta_o = 0, cos_theta_o = 1;
  // (cos, sin) of phi_o, so that phi of another direction needs one atan2.
  T cos_phi_o = 1, sin_phi_o = 0;
  T gamma_o = 0, gamma_t = 0;
  std::array<glm::vec<3, T>, max_p_max + 1> ap = {};
  std::array<T, max_p_max + 1> lobe_probability = {};
  std::array<T, max_p_max + 1> sin_theta_op = {}, cos_theta_op = {};  // tilted
};

// Rec. 709 luminance, the default measure by which lobes are chosen.
template <typename T>
inline constexpr glm::vec<3, T> luminance_weight = {T(0.2126), T(0.7152), T(0.0722)};

// channel_weight >= 0 says how much each colour channel matters when a lobe is
// drawn: the luminance by default; a path tracer may pass the path's throughput.
// sigma_a >= 0; non-finite or negative absorption is the caller's error.
template <typename T>
inline hair_hit<T> make_hair_hit(const hair_bsdf<T>& bsdf, const glm::vec<3, T>& sigma_a, T h,
                                 const glm::vec<3, T>& wo,
                                 const glm::vec<3, T>& channel_weight = luminance_weight<T>) {
  hair_hit<T> hit;
  h = std::clamp(h, T(-1), T(1));
  hit.sin_theta_o = std::clamp(wo.x, T(-1), T(1));
  T across = std::sqrt(wo.y * wo.y + wo.z * wo.z);
  hit.cos_theta_o = std::min(across, T(1));
  if (across > 0) {
    hit.cos_phi_o = wo.y / across;
    hit.sin_phi_o = wo.z / across;
  }
  hit.gamma_o = safe_asin(h);

  // Refraction into the fibre: theta_t along it, gamma_t across it with the
  // modified index eta' = sqrt(eta^2 - sin^2 theta_o) / cos theta_o.
  T sin_theta_t = hit.sin_theta_o / bsdf.eta;
  T cos_theta_t = safe_sqrt(1 - sqr(sin_theta_t));
  T eta_cos = safe_sqrt(sqr(bsdf.eta) - sqr(hit.sin_theta_o));  // eta' cos theta_o
  T sin_gamma_t = eta_cos > 0 ? std::clamp(h * hit.cos_theta_o / eta_cos, T(-1), T(1)) : T(0);
  T cos_gamma_t = safe_sqrt(1 - sqr(sin_gamma_t));
  hit.gamma_t = safe_asin(sin_gamma_t);

  T cos_gamma_o = safe_sqrt((1 - h) * (1 + h));
  T fresnel = fresnel_dielectric(hit.cos_theta_o * cos_gamma_o, bsdf.eta);
  T path = cos_theta_t > 0 ? 2 * cos_gamma_t / cos_theta_t : T(0);
  glm::vec<3, T> transmittance = {std::exp(-sigma_a.x * path), std::exp(-sigma_a.y * path),
                                  std::exp(-sigma_a.z * path)};
  hit.ap = attenuation_ap(fresnel, transmittance, bsdf.p_max);

  T sum = 0;
  for (int p = 0; p <= bsdf.p_max; p++) {
    auto i = static_cast<std::size_t>(p);
    hit.sin_theta_op[i] = hit.sin_theta_o * bsdf.cos_tilt[i] + hit.cos_theta_o * bsdf.sin_tilt[i];
    hit.cos_theta_op[i] =
        std::abs(hit.cos_theta_o * bsdf.cos_tilt[i] - hit.sin_theta_o * bsdf.sin_tilt[i]);
    hit.lobe_probability[i] = glm::dot(hit.ap[i], channel_weight);
    sum += hit.lobe_probability[i];
  }
  if (sum > 0) {
    for (int p = 0; p <= bsdf.p_max; p++) hit.lobe_probability[static_cast<std::size_t>(p)] /= sum;
  } else {  // a weight of zero where there is light: all lobes alike
    for (int p = 0; p <= bsdf.p_max; p++)
      hit.lobe_probability[static_cast<std::size_t>(p)] = 1 / static_cast<T>(bsdf.p_max + 1);
  }
  return hit;
}

template <typename T>
struct hair_value {
  glm::vec<3, T> value = {0, 0, 0};  // f |cos(theta_i)|
  T pdf = 0;                         // by solid angle
};

// Value and density together; they share all but the weights.
template <typename T>
inline hair_value<T> eval_hair_with_pdf(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                        const glm::vec<3, T>& wi) {
  T sin_theta_i = std::clamp(wi.x, T(-1), T(1));
  T cos_theta_i = std::min(std::sqrt(wi.y * wi.y + wi.z * wi.z), T(1));
  T phi = std::atan2(wi.z * hit.cos_phi_o - wi.y * hit.sin_phi_o,
                     wi.y * hit.cos_phi_o + wi.z * hit.sin_phi_o);
  hair_value<T> result;
  for (int p = 0; p <= bsdf.p_max; p++) {
    auto i = static_cast<std::size_t>(p);
    T mp = longitudinal_mp(sin_theta_i, cos_theta_i, hit.sin_theta_op[i], hit.cos_theta_op[i],
                           bsdf.half_over_v[i], bsdf.mp_norm[i]);
    T np = p == bsdf.p_max ? 1 / (2 * pi_v<T>)
                           : azimuthal_np(phi - exit_azimuth_phi(p, hit.gamma_o, hit.gamma_t),
                                          bsdf.s, bsdf.logistic_norm);
    result.value += hit.ap[i] * (mp * np);
    result.pdf += hit.lobe_probability[i] * (mp * np);
  }
  return result;
}

// f |cos(theta_i)|, [P] equation 1: the sum over p of M_p A_p N_p.
template <typename T>
inline glm::vec<3, T> eval_hair(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                const glm::vec<3, T>& wi) {
  return eval_hair_with_pdf(bsdf, hit, wi).value;
}

// Draws wi with density sample_hair_pdf. u in [0, 1)^4: u.x picks the lobe, u.y
// and u.z the longitudinal angle, u.w the azimuth.
template <typename T>
inline glm::vec<3, T> sample_hair(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                  const glm::vec<4, T>& u) {
  int p = 0;
  T rest = u.x;
  while (p < bsdf.p_max && rest >= hit.lobe_probability[static_cast<std::size_t>(p)]) {
    rest -= hit.lobe_probability[static_cast<std::size_t>(p)];
    p++;
  }
  auto i = static_cast<std::size_t>(p);

  // M_p ([P] section 4): with t = 1 - cos(theta') = -v log(u + (1 - u) exp(-2 / v)) the
  // sine squared is t (2 - t), which does not cancel near the mirror direction.
  T t = -bsdf.v[i] *
        std::log(std::max(u.y + (1 - u.y) * bsdf.exp_m2_over_v[i], std::numeric_limits<T>::min()));
  t = std::clamp(t, T(0), T(2));
  T cos_theta = 1 - t;
  T sin_theta = safe_sqrt(t * (2 - t));
  T cos_turn = std::cos(2 * pi_v<T> * u.z);
  T sin_turn = std::sin(2 * pi_v<T> * u.z);
  T sin_theta_i = std::clamp(
      -cos_theta * hit.sin_theta_op[i] + sin_theta * cos_turn * hit.cos_theta_op[i], T(-1), T(1));
  // The same vector's part across the fibre: exact where sin_theta_i is near 1.
  T cos_theta_i = std::min(
      std::sqrt(sqr(cos_theta * hit.cos_theta_op[i] + sin_theta * cos_turn * hit.sin_theta_op[i]) +
                sqr(sin_theta * sin_turn)),
      T(1));

  T dphi;
  if (p == bsdf.p_max) {
    dphi = 2 * pi_v<T> * u.w;
  } else {
    // The inverse of the trimmed logistic's distribution function, by symmetry
    // from the nearer end so that the tails keep their digits.
    T w = u.w < T(0.5) ? u.w : 1 - u.w;
    T c = bsdf.logistic_cdf_a + w * (1 - 2 * bsdf.logistic_cdf_a);
    T x = bsdf.s * std::log(std::max(c, std::numeric_limits<T>::min()) / (1 - c));
    x = std::clamp(u.w < T(0.5) ? x : -x, -pi_v<T>, pi_v<T>);
    dphi = exit_azimuth_phi(p, hit.gamma_o, hit.gamma_t) + x;
  }
  T cos_dphi = std::cos(dphi), sin_dphi = std::sin(dphi);
  return {sin_theta_i, cos_theta_i * (hit.cos_phi_o * cos_dphi - hit.sin_phi_o * sin_dphi),
          cos_theta_i * (hit.sin_phi_o * cos_dphi + hit.cos_phi_o * sin_dphi)};
}

// The same from two numbers: each is split into its even and odd bits ([P] 4).
template <typename T>
inline glm::vec<3, T> sample_hair(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                  const glm::vec<2, T>& u) {
  auto split = [](T x) {
    auto bits = static_cast<unsigned long long>(static_cast<double>(x) * 0x1p52);
    auto gather = [](unsigned long long b) {  // even bits to the low half
      b &= 0x5555555555555555ull;
      b = (b | (b >> 1)) & 0x3333333333333333ull;
      b = (b | (b >> 2)) & 0x0f0f0f0f0f0f0f0full;
      b = (b | (b >> 4)) & 0x00ff00ff00ff00ffull;
      b = (b | (b >> 8)) & 0x0000ffff0000ffffull;
      return (b | (b >> 16)) & 0xffffffffull;
    };
    T lowest_one = 1 - std::numeric_limits<T>::epsilon() / 2;
    return glm::vec<2, T>(
        std::min(static_cast<T>(static_cast<double>(gather(bits >> 1)) * 0x1p-26), lowest_one),
        std::min(static_cast<T>(static_cast<double>(gather(bits)) * 0x1p-26), lowest_one));
  };
  auto a = split(u.x), b = split(u.y);
  return sample_hair(bsdf, hit, glm::vec<4, T>(a.x, b.x, b.y, a.y));
}

// The density of sample_hair by solid angle.
template <typename T>
inline T sample_hair_pdf(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                         const glm::vec<3, T>& wi) {
  return eval_hair_with_pdf(bsdf, hit, wi).pdf;
}

}  // namespace wisp::hair
