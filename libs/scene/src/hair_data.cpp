// Hair materials as the fibre's parameters.

#include <algorithm>

#include "wisp/hair/absorption.h"
#include "wisp/hair/materials.h"
#include "wisp/scene/scene.h"

namespace wisp {

namespace {

const hair::pigment_absorption<float>& absorption_of(hair_pigment pigment) {
  switch (pigment) {
    case hair_pigment::cycles:
      return hair::cycles_pigment<float>;
    case hair_pigment::materialx:
      return hair::materialx_pigment<float>;
    default:
      return hair::pbrt_pigment<float>;
  }
}

}  // namespace

hair::material<float> hair_on_strand(const hair_data& h, float r, const vec2& factor) {
  if (h.random) r = *h.random;
  if (h.principled) {
    hair::principled_hair<float> p = *h.principled;
    p.random = r;
    p.roughness *= factor.x;
    p.radial_roughness *= factor.y;
    return hair::convert(p);
  }
  vec2 scale = factor * hair::variation_factor(r, h.random_roughness);
  auto scaled = [&](const vec2& beta) { return glm::clamp(beta * scale, 0.0f, 1.0f); };

  hair::material<float> result;
  hair::hair_parameters<float>& p = result.parameters;
  vec2 beta = scaled({h.beta_m, h.beta_n});
  p.eta = h.eta;
  p.beta_m = beta.x;
  p.beta_n = beta.y;
  p.alpha = h.alpha;
  p.p_max = h.p_max;
  p.coat = h.coat;
  p.strength = h.strength;
  for (std::size_t i = 0; i < h.roughness.size(); i++) {
    vec2 own = h.roughness[i];
    p.roughness[i] = {own.x >= 0 ? scaled(own).x : own.x, own.y >= 0 ? scaled(own).y : own.y};
  }
  if (h.sigma_a)
    result.sigma_a = *h.sigma_a;
  else if (h.color)
    result.sigma_a = hair::sigma_a_from_color(*h.color, beta.y);
  else
    result.sigma_a =
        hair::sigma_a_from_melanin(h.eumelanin, h.pheomelanin, absorption_of(h.pigment));
  result.sigma_a *= hair::variation_factor(r, h.random_color);
  return result;
}

bool color_varies(const hair_data& h) {
  if (h.random) return false;
  if (!h.principled) return h.random_color > 0;
  return h.principled->random_color > 0 &&
         h.principled->parametrization == hair::hair_parametrization::melanin;
}

bool roughness_varies(const hair_data& h) {
  if (h.random) return false;
  return (h.principled ? h.principled->random_roughness : h.random_roughness) > 0;
}

}  // namespace wisp
