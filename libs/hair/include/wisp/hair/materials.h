#pragma once

// The hair materials of other renderers, by the names of their own parameters
// and with their own defaults, and what they are here.
//
//   pbrt_hair        pbrt-v3 and v4, "hair"
//   principled_hair  Cycles, Principled Hair BSDF, model Chiang
//   chiang_hair      MaterialX 1.39, chiang_hair_bsdf and its three helper nodes
//
// All three have the lobes of hair_bsdf with p_max = 3. What differs beyond the
// parameters: Cycles and MaterialX add the tilt to theta_i and pbrt adds it to
// theta_o, so that lobes peak at the same place and differ slightly elsewhere,
// and all evaluate I0 by a short series (see longitudinal_mp).
//
// The functions are pure and safe to call from any thread.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>

#include "wisp/hair/absorption.h"
#include "wisp/hair/math.h"
#include "wisp/hair/parameters.h"

namespace wisp::hair {

// What make_hair_bsdf and make_hair_hit take.
template <typename T>
struct material {
  hair_parameters<T> parameters = {};
  glm::vec<3, T> sigma_a = {0, 0, 0};
};

// The factor 1 + 2 (random - 1/2) amount, in [0, 2], by which Cycles varies a
// value from strand to strand. random and amount in [0, 1].
template <typename T>
inline T variation_factor(T random, T amount) {
  return 1 + 2 * (random - T(0.5)) * amount;
}

// ---- pbrt

// The absorption is the first given of sigma_a, color, the pigments; with none,
// eumelanin 1.3.
template <typename T>
struct pbrt_hair {
  std::optional<glm::vec<3, T>> sigma_a = {};
  std::optional<glm::vec<3, T>> color = {};  // "reflectance" in v4
  std::optional<T> eumelanin = {}, pheomelanin = {};
  T eta = T(1.55);
  T beta_m = T(0.3), beta_n = T(0.3);
  T alpha = T(2);  // degrees
};

template <typename T>
inline material<T> convert(const pbrt_hair<T>& from) {
  material<T> to;
  to.parameters.eta = from.eta;
  to.parameters.beta_m = from.beta_m;
  to.parameters.beta_n = from.beta_n;
  to.parameters.alpha = from.alpha;
  if (from.sigma_a)
    to.sigma_a = *from.sigma_a;
  else if (from.color)
    to.sigma_a = sigma_a_from_color(*from.color, from.beta_n);
  else if (from.eumelanin || from.pheomelanin)
    to.sigma_a =
        sigma_a_from_melanin(from.eumelanin.value_or(T(0)), from.pheomelanin.value_or(T(0)));
  else
    to.sigma_a = sigma_a_from_melanin(T(1.3), T(0));
  return to;
}

// ---- Cycles

// Cycles' names: Direct Coloring, Melanin Concentration, Absorption Coefficient.
enum struct hair_parametrization { color, melanin, absorption };

// The smallest roughness of Cycles and MaterialX.
template <typename T>
inline constexpr T other_min_roughness = T(0.001);

// -log(1 - melanin): an amount of pigment from a number in [0, 1] that changes
// the look evenly; at most 9.2.
template <typename T>
inline T melanin_amount(T melanin) {
  return -std::log(std::max(1 - melanin, T(1e-4)));
}

template <typename T>
struct principled_hair {
  hair_parametrization parametrization = hair_parametrization::color;
  glm::vec<3, T> color = {T(0.017513), T(0.005763), T(0.002059)};
  T melanin = T(0.8), melanin_redness = T(1);  // [0, 1]
  glm::vec<3, T> tint = {1, 1, 1};             // with melanin only
  glm::vec<3, T> absorption_coefficient = {T(0.245531), T(0.52), T(1.365)};
  T roughness = T(0.3), radial_roughness = T(0.3), coat = 0;  // [0, 1]
  T ior = T(1.55);
  T offset = T(2);         // degrees, as Blender shows it; its files hold radians
  T random_color = 0;      // [0, 1], of melanin only
  T random_roughness = 0;  // [0, 1]
  T random = T(0.5);       // [0, 1], the strand's number
};

template <typename T>
inline material<T> convert(const principled_hair<T>& from) {
  constexpr T least = other_min_roughness<T>;
  material<T> to;
  T factor = variation_factor(from.random, from.random_roughness);
  T roughness = from.roughness * factor;
  T radial = from.radial_roughness * factor;  // colours are mapped with it before it is limited
  switch (from.parametrization) {
    case hair_parametrization::absorption:
      to.sigma_a = from.absorption_coefficient;
      break;
    case hair_parametrization::melanin: {
      T amount = melanin_amount(from.melanin * variation_factor(from.random, from.random_color));
      to.sigma_a = sigma_a_from_melanin(amount * (1 - from.melanin_redness),
                                        amount * from.melanin_redness, cycles_pigment<T>) +
                   sigma_a_from_color(from.tint, radial);
      break;
    }
    default:
      to.sigma_a = sigma_a_from_color(from.color, radial);
      break;
  }
  hair_parameters<T>& p = to.parameters;
  p.eta = from.ior;
  p.beta_m = std::clamp(roughness, least, T(1));
  p.beta_n = std::clamp(radial, least, T(1));
  // Towards the root for offset > 0, where ours with pbrt's sign turns R to the tip.
  p.alpha = -from.offset;
  T coat = 1 - std::clamp(from.coat, T(0), T(1));
  if (coat < 1) p.roughness[0].x = std::clamp(coat * p.beta_m, least, T(1));
  return to;
}

// ---- MaterialX

// The roughness pairs are the longitudinal variance, and the scale of the
// logistic before the factor sqrt(pi / 8) of Chiang et al. 2016.
template <typename T>
struct chiang_hair {
  glm::vec<3, T> tint_R = {1, 1, 1}, tint_TT = {1, 1, 1}, tint_TRT = {1, 1, 1};
  T ior = T(1.55);
  glm::vec<2, T> roughness_R = {T(0.1), T(0.1)};
  glm::vec<2, T> roughness_TT = {T(0.05), T(0.05)};
  glm::vec<2, T> roughness_TRT = {T(0.2), T(0.2)};
  T cuticle_angle = T(0.5);  // [0, 1] for -90 to 90 degrees
  glm::vec<3, T> absorption_coefficient = {0, 0, 0};
};

template <typename T>
inline material<T> convert(const chiang_hair<T>& from) {
  auto limited = [](T x) { return std::clamp(x, other_min_roughness<T>, T(1)); };
  auto roughness = [&](const glm::vec<2, T>& pair) {
    return glm::vec<2, T>(beta_m_from_variance(limited(pair.x)),
                          beta_n_from_scale(limited(pair.y) * T(0.626657069)));
  };
  auto tint = [](const glm::vec<3, T>& c) {
    return glm::vec<3, T>(std::max(c.x, T(0)), std::max(c.y, T(0)), std::max(c.z, T(0)));
  };
  material<T> to;
  hair_parameters<T>& p = to.parameters;
  p.eta = from.ior;
  p.roughness = {roughness(from.roughness_R), roughness(from.roughness_TT),
                 roughness(from.roughness_TRT)};
  p.beta_m = p.roughness[0].x;
  p.beta_n = p.roughness[0].y;
  p.strength = {tint(from.tint_R), tint(from.tint_TT), tint(from.tint_TRT)};
  p.alpha = 90 - 180 * from.cuticle_angle;
  to.sigma_a = from.absorption_coefficient;
  return to;
}

// The node chiang_hair_roughness: the pairs for R, TT and TRT.
template <typename T>
inline std::array<glm::vec<2, T>, 3> chiang_hair_roughness(T longitudinal = T(0.1),
                                                           T azimuthal = T(0.2),
                                                           T scale_TT = T(0.5),
                                                           T scale_TRT = T(2)) {
  auto limited = [](T x) { return std::clamp(x, other_min_roughness<T>, T(1)); };
  T v = longitudinal_variance(limited(longitudinal));
  T s = logistic_scale(limited(azimuthal)) / T(0.626657069);
  return {glm::vec<2, T>(v, s), glm::vec<2, T>(v * sqr(scale_TT), s),
          glm::vec<2, T>(v * sqr(scale_TRT), s)};
}

// The node deon_hair_absorption_from_melanin. Its colours are those of light
// that has passed one unit of a pigment.
template <typename T>
inline glm::vec<3, T> deon_hair_absorption_from_melanin(
    T melanin_concentration = T(0.25), T melanin_redness = T(0.5),
    const glm::vec<3, T>& eumelanin_color = {T(0.657704), T(0.498077), T(0.254107)},
    const glm::vec<3, T>& pheomelanin_color = {T(0.829444), T(0.67032), T(0.349938)}) {
  T amount = melanin_amount(melanin_concentration);
  auto absorbed = [](T color) { return -std::log(std::max(color, std::numeric_limits<T>::min())); };
  glm::vec<3, T> sigma_a;
  for (int k = 0; k < 3; k++)
    sigma_a[k] = std::max(T(0), amount * ((1 - melanin_redness) * absorbed(eumelanin_color[k]) +
                                          melanin_redness * absorbed(pheomelanin_color[k])));
  return sigma_a;
}

// The node chiang_hair_absorption_from_color.
template <typename T>
inline glm::vec<3, T> chiang_hair_absorption_from_color(const glm::vec<3, T>& color = {1, 1, 1},
                                                        T azimuthal_roughness = T(0.2)) {
  auto limited = [](T c) { return std::clamp(c, T(0.001), T(1)); };
  return sigma_a_from_color<T>({limited(color.x), limited(color.y), limited(color.z)},
                               azimuthal_roughness);
}

}  // namespace wisp::hair
