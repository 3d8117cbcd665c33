#pragma once

// From what artists know (a colour, a concentration of melanin) to the
// absorption coefficient of the fibre's interior, and back. The functions are pure and safe
// to call from any thread.

#include <algorithm>
#include <cmath>
#include <glm/vec3.hpp>

namespace wisp::hair {

// Absorption of one unit of eumelanin and of pheomelanin, per unit fibre
// radius, for red, green and blue.
template <typename T>
struct pigment_absorption {
  glm::vec<3, T> eumelanin;
  glm::vec<3, T> pheomelanin;
};

// pbrt-v3 and v4, HairBxDF::SigmaAFromConcentration (after d'Eon et al. 2011).
template <typename T>
inline constexpr pigment_absorption<T> pbrt_pigment = {{T(0.419), T(0.697), T(1.37)},
                                                       {T(0.187), T(0.4), T(1.05)}};
// Cycles, Principled Hair BSDF.
template <typename T>
inline constexpr pigment_absorption<T> cycles_pigment = {{T(0.506), T(0.841), T(1.653)},
                                                         {T(0.343), T(0.733), T(1.924)}};
// MaterialX, chiang_hair_absorption_from_melanin: minus the logarithm of its
// default colours (0.657704, 0.498077, 0.254107) and (0.829444, 0.67032, 0.349938).
template <typename T>
inline constexpr pigment_absorption<T> materialx_pigment = {
    {T(0.41900033), T(0.69700056), T(1.36999985)}, {T(0.18699967), T(0.40000007), T(1.04999929)}};

// Absorption of concentrations >= 0.
template <typename T>
inline glm::vec<3, T> sigma_a_from_melanin(T eumelanin, T pheomelanin,
                                           const pigment_absorption<T>& pigment = pbrt_pigment<T>) {
  return eumelanin * pigment.eumelanin + pheomelanin * pigment.pheomelanin;
}

// The polynomial in beta_n of Chiang et al. 2016, equation 9.
template <typename T>
inline T color_polynomial(T beta_n) {
  T b = beta_n;
  return T(5.969) +
         b * (T(-0.215) + b * (T(2.532) + b * (T(-10.73) + b * (T(5.574) + b * T(0.245)))));
}

// The absorption with which a thick mass of hair of azimuthal roughness beta_n
// shows about `color` under white light (Chiang et al. 2016, equation 9).
// Colours are clamped to [1e-5, 1], so that black stays finite.
template <typename T>
inline glm::vec<3, T> sigma_a_from_color(const glm::vec<3, T>& color, T beta_n) {
  T k = 1 / color_polynomial(beta_n);
  auto one = [k](T c) {
    T l = std::log(std::clamp(c, T(1e-5), T(1))) * k;
    return l * l;
  };
  return {one(color.x), one(color.y), one(color.z)};
}

// The inverse: the colour that an absorption gives.
template <typename T>
inline glm::vec<3, T> color_from_sigma_a(const glm::vec<3, T>& sigma_a, T beta_n) {
  T k = color_polynomial(beta_n);
  auto one = [k](T s) { return std::exp(-std::sqrt(std::max(T(0), s)) * k); };
  return {one(sigma_a.x), one(sigma_a.y), one(sigma_a.z)};
}

}  // namespace wisp::hair
