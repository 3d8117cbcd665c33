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
// template over float (for renderers) and double (for tests and tables): within
// rounding_bound (rounding.h) of each other, and float works on the lobes at once.
// All functions are pure and safe to call from any thread. h, eta and roughness are
// clamped to their ranges; what is not finite, or a direction that does not have unit
// length, is the caller's error and gives numbers without meaning, NaN among them.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "wisp/hair/math.h"
#include "wisp/hair/parameters.h"

namespace wisp::hair {

// Lobes are worked on in fours, so that compilers make vector code of them:
// arrays over lobes have room for max_p_max + 1 in whole fours.
inline constexpr std::size_t lobe_room = 8;
template <typename T>
using lobe_array = std::array<T, lobe_room>;

// What follows from the material alone.
template <typename T>
struct hair_bsdf {
  T eta = T(1.55);
  int p_max = 3;
  bool has_strength = false;  // a strength is not 1
  // For each lobe, those past p_max being 0: variance, 1 / v, exp(-2 / v),
  // 1 / (v (1 - exp(-2 / v))), sine and cosine of the tilt;
  lobe_array<T> v = {}, inv_v = {}, exp_m2_over_v = {}, mp_norm = {}, sin_tilt = {}, cos_tilt = {};
  // scale s of the logistic, 1 / s, the density's norm and the distribution at
  // -pi. For lobe p_max, which is uniform, 1 / s = 0.
  lobe_array<T> s = {}, inv_s = {}, np_norm = {}, logistic_cdf_a = {};
  std::array<glm::vec<3, T>, 3> strength = {};
};

// Cost: about as much as ten calls of eval_hair_with_pdf. Non-finite parameters
// are the caller's error.
template <typename T>
inline hair_bsdf<T> make_hair_bsdf(const hair_parameters<T>& parameters) {
  hair_bsdf<T> bsdf;
  bsdf.eta = std::max(T(1), parameters.eta);
  bsdf.p_max = std::clamp(parameters.p_max, 1, max_p_max);
  bsdf.strength = parameters.strength;
  for (const auto& strength : bsdf.strength)
    if (strength != glm::vec<3, T>(1)) bsdf.has_strength = true;

  auto limited = [](T beta) { return std::clamp(beta, static_cast<T>(min_roughness), T(1)); };
  T coat = 1 - std::clamp(parameters.coat, T(0), T(1));
  T v = longitudinal_variance(limited(parameters.beta_m));
  T s = logistic_scale(limited(parameters.beta_n));
  T alpha = parameters.alpha * (pi_v<T> / 180);
  for (int p = 0; p <= bsdf.p_max; p++) {
    auto i = static_cast<std::size_t>(p);
    const glm::vec<2, T>& own = parameters.roughness[std::min(i, std::size_t(2))];
    // [P] section 3.1: TT is narrower, TRT and beyond are wider.
    T lobe_v = p == 0 ? v : p == 1 ? v / 4 : 4 * v;
    if (own.x >= 0) lobe_v = longitudinal_variance(limited(own.x));
    if (p == 0 && coat < 1)
      lobe_v = longitudinal_variance(limited(coat * (own.x >= 0 ? own.x : parameters.beta_m)));
    bsdf.v[i] = lobe_v;
    bsdf.inv_v[i] = 1 / lobe_v;
    bsdf.exp_m2_over_v[i] = std::exp(-2 / lobe_v);
    bsdf.mp_norm[i] = -1 / (lobe_v * std::expm1(-2 / lobe_v));
    if (p < bsdf.p_max) {
      T lobe_s = own.y >= 0 ? logistic_scale(limited(own.y)) : s;
      T e = std::exp(-pi_v<T> / lobe_s);
      bsdf.s[i] = lobe_s;
      bsdf.inv_s[i] = 1 / lobe_s;
      bsdf.logistic_cdf_a[i] = e / (1 + e);
      bsdf.np_norm[i] = (1 + e) / (lobe_s * (1 - e));
    } else {
      bsdf.np_norm[i] = 2 / pi_v<T>;  // with 1 / s = 0: uniform, 1 / (2 pi)
    }
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
inline T longitudinal_mp(T sin_theta_i, T cos_theta_i, T sin_theta_o, T cos_theta_o, T inv_v,
                         T mp_norm) {
  using S = detail::scalar_of<T>;
  T d = sqr(sin_theta_i + sin_theta_o) + sqr(cos_theta_i - cos_theta_o);
  T a = cos_theta_i * cos_theta_o * inv_v;
  return bessel_i0e<T>(a) * detail::exp_nonpositive<T>(S(-0.5) * d * inv_v) * mp_norm;
}

// Phi(p, h): the azimuth by which light of mode p leaves ([P] section 3.3).
template <typename T>
inline T exit_azimuth_phi(int p, T gamma_o, T gamma_t) {
  T fp = static_cast<T>(p);
  return 2 * fp * gamma_t - 2 * gamma_o + fp * pi_v<T>;
}

// N_p: the logistic distribution around Phi(p, h), trimmed to [-pi, pi]. `dphi`
// is phi - Phi, of any size. np_norm = 1 / (s * probability of [-pi, pi]).
template <typename T>
inline T azimuthal_np(T dphi, T inv_s, T np_norm) {
  using S = detail::scalar_of<T>;
  T e = detail::exp_nonpositive<T>(-detail::magnitude<T>(wrap_angle<T>(dphi)) * inv_s);
  T r = S(1) / (S(1) + e);
  return e * np_norm * r * r;
}

// What a smooth dielectric, seen from outside under the cosine c >= 0, reflects,
// and what it lets in: 1 - reflected. All differences are written as products,
// so that nothing cancels at grazing angles or where eta is near 1.
template <typename T>
struct fresnel_terms {
  T reflected = 1, transmitted = 0;
  T eta_cos_t = 0;  // eta times the cosine inside
};
template <typename T>
inline fresnel_terms<T> fresnel_dielectric(T c, T eta) {
  T n2 = eta * eta, above = (eta - 1) * (eta + 1);  // eta^2 - 1
  T g = std::sqrt(above + c * c);
  if (g + c <= 0) return {};
  T perpendicular = 1 / (c + g), parallel = 1 / (n2 * c + g);
  // c - g and n2 c - g by the difference of their squares.
  T reflected =
      (sqr(above * sqr(perpendicular)) + sqr(above * ((n2 + 1) * c * c - 1) * sqr(parallel))) / 2;
  T transmitted = 2 * c * g * (sqr(perpendicular) + n2 * sqr(parallel));
  return {std::min(reflected, T(1)), std::min(transmitted, T(1)), g};
}

// A_p: the part of the light in each mode, [P] section 3.2: Fresnel, and the
// transmittance of each pass through the fibre; entry p_max is the sum of all
// later modes.
template <typename T>
inline std::array<glm::vec<3, T>, max_p_max + 1> attenuation_ap(const fresnel_terms<T>& fresnel,
                                                                const glm::vec<3, T>& transmittance,
                                                                int p_max) {
  std::array<glm::vec<3, T>, max_p_max + 1> ap;
  ap[0] = glm::vec<3, T>(fresnel.reflected);
  glm::vec<3, T> tf = transmittance * fresnel.reflected;
  glm::vec<3, T> a = sqr(fresnel.transmitted) * transmittance;
  auto last = static_cast<std::size_t>(p_max);
  for (std::size_t p = 1; p < last; p++) {
    ap[p] = a;
    a *= tf;
  }
  // The geometric series; at F = T = 1 nothing enters and 0 / 0 is 0. Its
  // denominator 1 - T F is written as a sum of what is lost.
  for (int k = 0; k < 3; k++) {
    T rest = fresnel.transmitted + fresnel.reflected * (1 - transmittance[k]);
    ap[last][k] = rest > 0 ? a[k] / rest : T(0);
  }
  return ap;
}

// What follows from wo, h and the absorption.
template <typename T>
struct hair_hit {
  T sin_theta_o = 0, cos_theta_o = 1;
  // (cos, sin) of phi_o, so that phi of another direction needs one arc tangent.
  T cos_phi_o = 1, sin_phi_o = 0;
  // For each lobe: A_p, and in w the probability that it is drawn; sine and
  // cosine of theta_o with the lobe's tilt; Phi(p, h).
  // Entries past lobe p_max are not set.
  lobe_array<glm::vec<4, T>> ap;
  lobe_array<T> sin_theta_op, cos_theta_op, exit_phi;
};

// Lobe p is drawn with a probability in proportion to |channel_weight A_p|, the
// length of the product: of all weights it leaves the least variance to the sum
// over the channels. By default all channels count alike; a path tracer passes
// its path's throughput, so that lobes are drawn by what they add to the pixel.
// sigma_a >= 0; non-finite or negative absorption is the caller's error.
template <typename T>
inline hair_hit<T> make_hair_hit(const hair_bsdf<T>& bsdf, const glm::vec<3, T>& sigma_a, T h,
                                 const glm::vec<3, T>& wo,
                                 const glm::vec<3, T>& channel_weight = glm::vec<3, T>(1)) {
  hair_hit<T> hit;
  h = std::clamp(h, T(-1), T(1));
  hit.sin_theta_o = std::clamp(wo.x, T(-1), T(1));
  T across = std::sqrt(wo.y * wo.y + wo.z * wo.z);
  // Nearer to a pole squares and their inverses would lose digits or overflow.
  if (across < T(1e-15)) across = 0;
  hit.cos_theta_o = std::min(across, T(1));
  if (across > 0) {
    hit.cos_phi_o = wo.y / across;
    hit.sin_phi_o = wo.z / across;
  }

  // Refraction into the fibre: theta_t along it, gamma_t across it with the
  // modified index eta' = sqrt(eta^2 - sin^2 theta_o) / cos theta_o. With
  // eta^2 - 1 and cos theta_o in the place of eta and sin theta_o nothing
  // cancels: eta' cos theta_o = eta cos theta_t, and what Fresnel's equations
  // have as eta times their cosine inside is eta' cos theta_o cos gamma_t.
  T eta_cos = std::sqrt((bsdf.eta - 1) * (bsdf.eta + 1) + sqr(hit.cos_theta_o));
  T inv_eta_cos = eta_cos > 0 ? 1 / eta_cos : T(0);
  T cos_gamma_o = safe_sqrt((1 - h) * (1 + h));
  auto fresnel = fresnel_dielectric(hit.cos_theta_o * cos_gamma_o, bsdf.eta);
  T sin_gamma_t = std::clamp(h * hit.cos_theta_o * inv_eta_cos, T(-1), T(1));
  T cos_gamma_t = std::min(fresnel.eta_cos_t * inv_eta_cos, T(1));
  using four = std::array<T, 4>;
  four gamma =
      detail::in_lanes<T>([](auto s, auto c) { return detail::arc_sine(s, c); },
                          four{h, sin_gamma_t, 0, 0}, four{cos_gamma_o, cos_gamma_t, 1, 1});

  T path = -2 * bsdf.eta * cos_gamma_t * inv_eta_cos;
  auto transmittance =
      detail::in_lanes<T>([](auto x) { return detail::exp_nonpositive(x); },
                          four{sigma_a.x * path, sigma_a.y * path, sigma_a.z * path, 0});
  auto ap =
      attenuation_ap(fresnel, {transmittance[0], transmittance[1], transmittance[2]}, bsdf.p_max);

  T sum = 0;
  for (int p = 0; p <= bsdf.p_max; p++) {
    auto i = static_cast<std::size_t>(p);
    if (bsdf.has_strength) ap[i] *= bsdf.strength[std::min(i, std::size_t(2))];
    glm::vec<3, T> weighted = ap[i] * channel_weight;
    // The largest component stands in where squares are too small for T.
    T weight = std::max(std::sqrt(glm::dot(weighted, weighted)),
                        std::max(weighted.x, std::max(weighted.y, weighted.z)));
    hit.ap[i] = glm::vec<4, T>(ap[i], weight);
    sum += weight;
  }
  // A weight of zero where there may be light, or one whose inverse is no number:
  // all lobes alike.
  bool has_weight = sum > std::numeric_limits<T>::min();
  T scale = has_weight ? 1 / sum : T(0);
  T same = has_weight ? T(0) : 1 / static_cast<T>(bsdf.p_max + 1);
  for (int p = 0; p <= bsdf.p_max; p++) {
    T& probability = hit.ap[static_cast<std::size_t>(p)].w;
    probability = probability * scale + same;
  }
  std::size_t lobes = bsdf.p_max < 4 ? 4 : lobe_room;
  for (std::size_t first = 0; first < lobes; first += 4) {
    for (std::size_t k = 0; k < 4; k++) {
      std::size_t i = first + k;
      hit.sin_theta_op[i] = hit.sin_theta_o * bsdf.cos_tilt[i] + hit.cos_theta_o * bsdf.sin_tilt[i];
      hit.cos_theta_op[i] =
          std::abs(hit.cos_theta_o * bsdf.cos_tilt[i] - hit.sin_theta_o * bsdf.sin_tilt[i]);
      hit.exit_phi[i] = exit_azimuth_phi(static_cast<int>(i), gamma[0], gamma[1]);
    }
  }
  return hit;
}

template <typename T>
struct hair_value {
  glm::vec<3, T> value = {0, 0, 0};  // f |cos(theta_i)|
  T pdf = 0;                         // by solid angle
};

namespace detail {

// M_p N_p of the lobes from i on, of one or of as many as F holds, to mn.
template <typename F, typename T>
inline void eval_mn(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit, T sin_theta_i, T cos_theta_i,
                    T phi, std::size_t i, lobe_array<T>& mn) {
  auto load = [i](const lobe_array<T>& a) {
    F f;
    std::memcpy(&f, a.data() + i, sizeof(F));
    return f;
  };
  F mp = longitudinal_mp<F>(splat<F>(sin_theta_i), splat<F>(cos_theta_i), load(hit.sin_theta_op),
                            load(hit.cos_theta_op), load(bsdf.inv_v), load(bsdf.mp_norm));
  F np = azimuthal_np<F>(phi - load(hit.exit_phi), load(bsdf.inv_s), load(bsdf.np_norm));
  mp *= np;
  std::memcpy(mn.data() + i, &mp, sizeof(F));
}

template <typename T>
inline hair_value<T> eval_lobes(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit, T sin_theta_i,
                                T cos_theta_i, T phi) {
  lobe_array<T> mn;
  auto last = static_cast<std::size_t>(bsdf.p_max);
#if defined(WISP_HAIR_LANES)
  if constexpr (std::is_same_v<T, float>) {
    for (std::size_t i = 0; i <= last; i += WISP_HAIR_LANES)
      eval_mn<float_lanes>(bsdf, hit, sin_theta_i, cos_theta_i, phi, i, mn);
  } else
#endif
    for (std::size_t i = 0; i <= last; i++)
      eval_mn<T>(bsdf, hit, sin_theta_i, cos_theta_i, phi, i, mn);
  glm::vec<4, T> sum = hit.ap[0] * mn[0];
  for (std::size_t i = 1; i <= last; i++) sum += hit.ap[i] * mn[i];
  return {{sum.x, sum.y, sum.z}, sum.w};
}

}  // namespace detail

// Value and density together; they share all but the weights.
template <typename T>
inline hair_value<T> eval_hair_with_pdf(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                        const glm::vec<3, T>& wi) {
  T sin_theta_i = std::clamp(wi.x, T(-1), T(1));
  T cos_theta_i = std::min(std::sqrt(wi.y * wi.y + wi.z * wi.z), T(1));
  T phi = detail::angle_of(wi.z * hit.cos_phi_o - wi.y * hit.sin_phi_o,
                           wi.y * hit.cos_phi_o + wi.z * hit.sin_phi_o);
  return detail::eval_lobes(bsdf, hit, sin_theta_i, cos_theta_i, phi);
}

// f |cos(theta_i)|, [P] equation 1: the sum over p of M_p A_p N_p.
template <typename T>
inline glm::vec<3, T> eval_hair(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                const glm::vec<3, T>& wi) {
  return eval_hair_with_pdf(bsdf, hit, wi).value;
}

namespace detail {

// A direction by its angles: dphi is the azimuth against wo.
template <typename T>
struct hair_angles {
  T sin_theta = 0, cos_theta = 1, dphi = 0;
};

template <typename T>
inline hair_angles<T> sample_angles(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                    const glm::vec<4, T>& u) {
  // A lobe less likely than a step of u.x cannot be drawn as seldom as it should.
  constexpr T step = std::numeric_limits<T>::epsilon() / 2;
  std::size_t p = 0, last = static_cast<std::size_t>(bsdf.p_max);
  T rest = u.x;
  while (p < last && (rest >= hit.ap[p].w || hit.ap[p].w < step)) {
    rest -= hit.ap[p].w;
    p++;
  }
  // Rounding may leave a rest behind the last lobe that is drawn.
  while (p > 0 && hit.ap[p].w < step) p--;
  // What is left of u.x within the lobe's share is uniform and gives the
  // azimuth, so that the lobe and three dimensions need no more than three
  // numbers; u.w fills in the digits that u.x has lost to a small share.
  T u_phi = std::min((rest + u.w * step) / hit.ap[p].w, 1 - step);
  // Smaller numbers are taken as this: a sample so far out that its density is 0
  // would be worth nothing.
  constexpr T least = sqr(std::numeric_limits<T>::epsilon());

  // M_p ([P] section 4): with t = 1 - cos(theta') = -v log(u + (1 - u) exp(-2 / v)) the
  // sine squared is t (2 - t), which does not cancel near the mirror direction.
  T t = -bsdf.v[p] * std::log(std::max(u.y + (1 - u.y) * bsdf.exp_m2_over_v[p], least));
  t = std::clamp(t, T(0), T(2));
  T cos_theta = 1 - t;
  T sin_theta = safe_sqrt(t * (2 - t));
  auto turn = cos_sin_of(2 * pi_v<T> * u.z);
  T sin_o = hit.sin_theta_op[p], cos_o = hit.cos_theta_op[p];
  hair_angles<T> wi;
  wi.sin_theta = std::clamp(sin_theta * turn.cos * cos_o - cos_theta * sin_o, T(-1), T(1));
  // The same vector's part across the fibre: exact where the sine is near 1.
  wi.cos_theta = std::min(
      std::sqrt(sqr(cos_theta * cos_o + sin_theta * turn.cos * sin_o) + sqr(sin_theta * turn.sin)),
      T(1));

  if (p == last) {
    wi.dphi = 2 * pi_v<T> * u_phi;
  } else {
    // The inverse of the trimmed logistic's distribution function, by symmetry
    // from the nearer end so that the tails keep their digits.
    T w = u_phi < T(0.5) ? u_phi : 1 - u_phi;
    T c = bsdf.logistic_cdf_a[p] + w * (1 - 2 * bsdf.logistic_cdf_a[p]);
    T x = bsdf.s[p] * std::log(std::max(c, least) / (1 - c));
    wi.dphi = hit.exit_phi[p] + std::clamp(u_phi < T(0.5) ? x : -x, -pi_v<T>, pi_v<T>);
  }
  return wi;
}

template <typename T>
inline glm::vec<3, T> direction_of(const hair_hit<T>& hit, const hair_angles<T>& wi) {
  auto turn = cos_sin_of(wi.dphi);
  return {wi.sin_theta, wi.cos_theta * (hit.cos_phi_o * turn.cos - hit.sin_phi_o * turn.sin),
          wi.cos_theta * (hit.sin_phi_o * turn.cos + hit.cos_phi_o * turn.sin)};
}

}  // namespace detail

// Draws wi with density sample_hair_pdf. u in [0, 1)^4: u.x picks the lobe and
// the azimuth in it, u.y and u.z the longitudinal angle; u.w only fills in what
// u.x has no digits for, and may be 0.5 where just three numbers are at hand.
template <typename T>
inline glm::vec<3, T> sample_hair(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                  const glm::vec<4, T>& u) {
  return detail::direction_of(hit, detail::sample_angles(bsdf, hit, u));
}

template <typename T>
struct hair_sample {
  glm::vec<3, T> direction = {1, 0, 0};  // wi
  glm::vec<3, T> value = {0, 0, 0};      // f |cos(theta_i)|
  T pdf = 0;                             // by solid angle
};

// Draws wi and gives its value and density, from angles that are at hand.
template <typename T>
inline hair_sample<T> sample_hair_with_pdf(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                           const glm::vec<4, T>& u) {
  auto wi = detail::sample_angles(bsdf, hit, u);
  auto f = detail::eval_lobes(bsdf, hit, wi.sin_theta, wi.cos_theta, wi.dphi);
  return {detail::direction_of(hit, wi), f.value, f.pdf};
}

// Four numbers for sample_hair from two. The second is split into its even and
// odd bits ([P] 4), half of its digits each; the digits below come from a hash
// of all of them, or else the tails of the lobe would be steps.
template <typename T>
inline glm::vec<4, T> split_numbers(const glm::vec<2, T>& u) {
  constexpr int digits = std::numeric_limits<T>::digits / 2;  // of each half
  auto bits = static_cast<std::uint64_t>(static_cast<double>(u.y) *
                                         static_cast<double>(std::uint64_t(1) << (2 * digits)));
  auto even_bits = [](std::uint64_t b) {
    b &= 0x5555555555555555u;
    b = (b | (b >> 1)) & 0x3333333333333333u;
    b = (b | (b >> 2)) & 0x0f0f0f0f0f0f0f0fu;
    b = (b | (b >> 4)) & 0x00ff00ff00ff00ffu;
    b = (b | (b >> 8)) & 0x0000ffff0000ffffu;
    return (b | (b >> 16)) & 0xffffffffu;
  };
  std::uint64_t hash = (bits + 1) * 0x9e3779b97f4a7c15u;  // splitmix64
  hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9u;
  hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebu;
  hash ^= hash >> 31;
  auto number = [](std::uint64_t high, std::uint64_t low) {
    constexpr T below_one = 1 - std::numeric_limits<T>::epsilon() / 2;
    double x = std::ldexp(static_cast<double>(high) + static_cast<double>(low) * 0x1p-32, -digits);
    return std::min(static_cast<T>(x), below_one);
  };
  return {u.x, number(even_bits(bits >> 1), hash >> 32),
          number(even_bits(bits), hash & 0xffffffffu), T(0.5)};
}

// The same from two numbers.
template <typename T>
inline glm::vec<3, T> sample_hair(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                  const glm::vec<2, T>& u) {
  return sample_hair(bsdf, hit, split_numbers(u));
}
template <typename T>
inline hair_sample<T> sample_hair_with_pdf(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                                           const glm::vec<2, T>& u) {
  return sample_hair_with_pdf(bsdf, hit, split_numbers(u));
}

// The density of sample_hair by solid angle.
template <typename T>
inline T sample_hair_pdf(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit,
                         const glm::vec<3, T>& wi) {
  return eval_hair_with_pdf(bsdf, hit, wi).pdf;
}

}  // namespace wisp::hair
