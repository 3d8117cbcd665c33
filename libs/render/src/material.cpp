// The surface materials of Yocto/GL (Pellacini et al., yocto_shading.h), with
// visible-normal sampling of microfacets and the transmission density of Walter
// et al. 2007. The weights value / pdf of rough lobes are then at most the
// Fresnel term (and the change of radiance, below), at any angle.
//
// What is Yocto/GL's choice and is kept:
//  - Shadowing and masking are separable, and there is no multiple scattering
//    between microfacets: rough surfaces lose some energy.
//  - The diffuse base of glossy and gltfpbr is weighted by 1 - F of the outgoing
//    direction alone, so that it is not reciprocal; white ones may exceed an
//    albedo of 1 by about a percent.
//  - Radiance is divided by the square of the relative index as light is
//    followed into denser matter, by delta and rough refraction alike, and
//    multiplied again on the way out (Veach 1997, section 5.2).
//
// What is mended: a smooth subsurface boundary is a delta and not black; an index
// of 1 lets light straight through at any roughness; metals of colour 1 are
// perfect mirrors; the density of rough refraction is exact.

#include "wisp/render/material.h"

#include <algorithm>
#include <cmath>

#include "microfacet.h"
#include "wisp/core/sampling.h"
#include "wisp/render/image.h"

namespace wisp {

namespace {

constexpr float min_roughness = 0.03f * 0.03f;
constexpr float min_trdepth = 1e-20f;

const texture_data* find_texture(const std::vector<texture_data>& textures, int index) {
  // invalid_id is beyond any size once unsigned
  std::size_t i = static_cast<std::size_t>(index);
  return i < textures.size() ? &textures[i] : nullptr;
}

bool is_refractive(const material_point& m) {
  return m.type == material_type::refractive || m.type == material_type::subsurface;
}

// Both indices are as good as the same: nothing bends and nothing is reflected.
bool is_index_matched(const material_point& m) { return std::abs(m.ior - 1) < 1e-3f; }

// The directions against the side of the surface that is seen.
struct shading_side {
  vec3 up = {0, 0, 1};  // the normal on the side of `outgoing`
  float cos_o = 0;      // >= 0
  float eta = 1;        // index behind over index before, for refractive materials
};

shading_side find_side(const material_point& m, const vec3& normal, const vec3& outgoing) {
  float cosine = glm::dot(normal, outgoing);
  return cosine >= 0 ? shading_side{normal, cosine, m.ior}
                     : shading_side{-normal, -cosine, 1 / m.ior};
}

// Glossy and gltfpbr: a microfacet coat on a diffuse base.
struct coated_lobes {
  vec3 reflectivity = {0, 0, 0};   // gltfpbr: at normal incidence
  vec3 diffuse = {0, 0, 0};        // albedo of the base as seen through the coat
  float specular_probability = 0;  // of drawing from the coat
};

coated_lobes make_coated(const material_point& m, float cos_o) {
  coated_lobes lobes;
  float specular = 0;
  if (m.type == material_type::glossy) {
    specular = fresnel_dielectric(m.ior, cos_o);
    lobes.diffuse = m.color * (1 - specular);
  } else {
    lobes.reflectivity = glm::mix(vec3(eta_to_reflectivity(m.ior)), m.color, m.metallic);
    vec3 f = fresnel_schlick(lobes.reflectivity, cos_o);
    specular = max_component(f);
    lobes.diffuse = m.color * (1 - m.metallic) * glm::max(1.0f - f, vec3{0, 0, 0});
  }
  float total = specular + max_component(lobes.diffuse);
  lobes.specular_probability = total > 0 ? specular / total : 0;
  // A base so dark that rounding never draws from it has no value either.
  if (lobes.specular_probability >= 1) lobes.diffuse = {0, 0, 0};
  return lobes;
}

vec3 coat_fresnel(const material_point& m, const coated_lobes& lobes, float cosine) {
  return m.type == material_type::glossy ? vec3(fresnel_dielectric(m.ior, cosine))
                                         : fresnel_schlick(lobes.reflectivity, cosine);
}

// The microfacet that mirrors one direction to the other.
struct mirror_facet {
  vec3 normal = {0, 0, 0};
  float cosine = 0;  // with either direction: half the length of their sum
};

mirror_facet find_facet(const vec3& outgoing, const vec3& incoming) {
  vec3 sum = outgoing + incoming;
  float length = glm::length(sum);
  return length > 0 ? mirror_facet{sum / length, std::min(length / 2, 1.0f)} : mirror_facet{};
}

vec3 sample_cosine(const vec3& up, const vec2& rn) {
  return glm::normalize(basis_from_z(up) * sample_hemisphere_cos(rn));
}

// Drawn directions that rounding or a microfacet sent to the wrong side are none.
vec3 keep_above(const vec3& up, const vec3& incoming) {
  return glm::dot(up, incoming) > 0 ? incoming : vec3{0, 0, 0};
}
vec3 keep_below(const vec3& up, const vec3& incoming) {
  return glm::dot(up, incoming) < 0 ? incoming : vec3{0, 0, 0};
}

// Through the plane of the surface, for sheets that do not bend light.
vec3 mirror_through(const vec3& v, const vec3& up) {
  return glm::normalize(v - up * (2 * glm::dot(up, v)));
}

}  // namespace

// ---------------------------------------------------------------------------
// Materials at a point
// ---------------------------------------------------------------------------

material_point eval_material(const material_data& material,
                             const std::vector<texture_data>& textures, const vec2& texcoord,
                             const vec4& color) {
  material_point m;
  m.type = material.type;
  m.emission = material.emission;
  m.color = material.color * vec3(color);
  m.opacity = material.opacity * color.w;
  m.ior = std::clamp(material.ior, 1e-4f, 1e4f);  // squares stay finite
  if (m.emission != vec3{0, 0, 0})
    if (auto texture = find_texture(textures, material.emission_tex))
      m.emission *= vec3(eval_texture(*texture, texcoord, false));
  if (auto texture = find_texture(textures, material.color_tex)) {
    vec4 value = eval_texture(*texture, texcoord, false);
    m.color *= vec3(value);
    m.opacity *= value.w;
  }
  m.opacity = std::clamp(m.opacity, 0.0f, 1.0f);

  using enum material_type;
  if (m.type == hair || m.type == matte) return m;

  if (m.type != volumetric) {
    float roughness = material.roughness;
    m.metallic = material.metallic;
    if (auto texture = find_texture(textures, material.roughness_tex)) {
      vec4 value = eval_texture(*texture, texcoord, true);
      roughness *= value.y;
      m.metallic *= value.z;
    }
    m.metallic = std::clamp(m.metallic, 0.0f, 1.0f);
    m.roughness = std::min(roughness * roughness, 1.0f);
    if (m.type == glossy || m.type == gltfpbr)
      m.roughness = std::max(m.roughness, min_roughness);
    else if (m.roughness < min_roughness)
      m.roughness = 0;
  }
  if (is_transmissive(m.type)) {
    m.scattering = material.scattering;
    m.scanisotropy = material.scanisotropy;
    if (auto texture = find_texture(textures, material.scattering_tex))
      m.scattering *= vec3(eval_texture(*texture, texcoord, false));
    // Beer and Lambert: `color` is left after the distance trdepth.
    if (m.color != vec3{1, 1, 1}) {
      vec3 transmitted = glm::clamp(m.color, 0.0001f, 1.0f);
      m.density =
          vec3{-std::log(transmitted.x), -std::log(transmitted.y), -std::log(transmitted.z)} /
          std::max(material.trdepth, min_trdepth);
    }
  }
  return m;
}

vec3 eval_emission(const material_point& m, const vec3& /*normal*/, const vec3& /*outgoing*/) {
  return m.emission;
}

bool is_delta(const material_point& m) {
  switch (m.type) {
    case material_type::reflective:
    case material_type::transparent:
      return m.roughness == 0;
    case material_type::refractive:
    case material_type::subsurface:
      return m.roughness == 0 || is_index_matched(m);
    case material_type::volumetric:
      return true;
    default:
      return false;
  }
}

bool is_volumetric(const material_point& m) { return is_transmissive(m.type); }

bool is_transmissive(material_type type) {
  return type == material_type::refractive || type == material_type::subsurface ||
         type == material_type::volumetric;
}

// ---------------------------------------------------------------------------
// Rough scattering
// ---------------------------------------------------------------------------

vec3 eval_bsdf(const material_point& m, const vec3& normal, const vec3& outgoing,
               const vec3& incoming) {
  if (is_delta(m)) return {0, 0, 0};
  shading_side side = find_side(m, normal, outgoing);
  float cos_i = glm::dot(side.up, incoming);
  if (side.cos_o == 0 || cos_i == 0) return {0, 0, 0};

  if (m.type == material_type::matte) return cos_i > 0 ? m.color * (cos_i / pi) : vec3{0, 0, 0};
  float alpha = m.roughness;
  if (is_refractive(m) && cos_i < 0) {
    refraction r = eval_refraction(alpha, side.eta, side.up, outgoing, incoming, side.cos_o);
    float value = (1 - fresnel_dielectric(side.eta, r.cos_h)) * r.pdf * smith_g1(alpha, -cos_i);
    return vec3(value / (side.eta * side.eta));
  }
  bool thin_transmission = m.type == material_type::transparent && cos_i < 0;
  if (cos_i < 0 && !thin_transmission) return {0, 0, 0};

  vec3 mirrored = thin_transmission ? mirror_through(incoming, side.up) : incoming;
  mirror_facet facet = find_facet(outgoing, mirrored);
  float cos_h = facet.cosine;
  float facets =
      reflection_pdf(alpha, side.up, facet.normal, side.cos_o) * smith_g1(alpha, std::abs(cos_i));
  switch (m.type) {
    case material_type::glossy:
    case material_type::gltfpbr: {
      coated_lobes lobes = make_coated(m, side.cos_o);
      return lobes.diffuse * (cos_i / pi) + coat_fresnel(m, lobes, cos_h) * facets;
    }
    case material_type::reflective:
      return fresnel_metal(m.color, cos_h) * facets;
    case material_type::transparent: {
      float f = fresnel_dielectric(m.ior, cos_h);
      return thin_transmission ? m.color * ((1 - f) * facets) : vec3(f * facets);
    }
    case material_type::refractive:
    case material_type::subsurface:
      return vec3(fresnel_dielectric(side.eta, cos_h) * facets);
    default:
      return {0, 0, 0};
  }
}

vec3 sample_bsdf(const material_point& m, const vec3& normal, const vec3& outgoing, float rnl,
                 const vec2& rn) {
  if (is_delta(m) || m.type == material_type::hair) return {0, 0, 0};
  shading_side side = find_side(m, normal, outgoing);
  if (side.cos_o == 0) return {0, 0, 0};

  if (m.type == material_type::matte) return keep_above(side.up, sample_cosine(side.up, rn));
  if (m.type == material_type::glossy || m.type == material_type::gltfpbr)
    if (rnl >= make_coated(m, side.cos_o).specular_probability)
      return keep_above(side.up, sample_cosine(side.up, rn));

  vec3 halfway = sample_visible_normal(m.roughness, side.up, outgoing, rn);
  float cos_h = glm::dot(outgoing, halfway);
  if (cos_h <= 0) return {0, 0, 0};
  vec3 reflected = keep_above(side.up, reflect_at(outgoing, halfway));
  if (m.type == material_type::transparent) {
    if (rnl < fresnel_dielectric(m.ior, cos_h) || reflected == vec3{0, 0, 0}) return reflected;
    return keep_below(side.up, mirror_through(reflected, side.up));
  }
  if (is_refractive(m) && rnl >= fresnel_dielectric(side.eta, cos_h))
    return keep_below(side.up, refract_at(outgoing, halfway, side.eta));
  return reflected;
}

float sample_bsdf_pdf(const material_point& m, const vec3& normal, const vec3& outgoing,
                      const vec3& incoming) {
  if (is_delta(m) || m.type == material_type::hair) return 0;
  shading_side side = find_side(m, normal, outgoing);
  float cos_i = glm::dot(side.up, incoming);
  if (side.cos_o == 0 || cos_i == 0) return 0;

  if (m.type == material_type::matte) return std::max(cos_i, 0.0f) / pi;
  if (is_refractive(m) && cos_i < 0) {
    refraction r = eval_refraction(m.roughness, side.eta, side.up, outgoing, incoming, side.cos_o);
    return (1 - fresnel_dielectric(side.eta, r.cos_h)) * r.pdf;
  }
  bool thin_transmission = m.type == material_type::transparent && cos_i < 0;
  if (cos_i < 0 && !thin_transmission) return 0;

  vec3 mirrored = thin_transmission ? mirror_through(incoming, side.up) : incoming;
  mirror_facet facet = find_facet(outgoing, mirrored);
  float cos_h = facet.cosine;
  float facets = reflection_pdf(m.roughness, side.up, facet.normal, side.cos_o);
  switch (m.type) {
    case material_type::glossy:
    case material_type::gltfpbr: {
      float p = make_coated(m, side.cos_o).specular_probability;
      return p * facets + (1 - p) * cos_i / pi;
    }
    case material_type::transparent: {
      float f = fresnel_dielectric(m.ior, cos_h);
      return (thin_transmission ? 1 - f : f) * facets;
    }
    case material_type::refractive:
    case material_type::subsurface:
      return fresnel_dielectric(side.eta, cos_h) * facets;
    default:
      return facets;
  }
}

// ---------------------------------------------------------------------------
// Delta scattering
// ---------------------------------------------------------------------------

vec3 eval_delta(const material_point& m, const vec3& normal, const vec3& outgoing,
                const vec3& incoming) {
  if (!is_delta(m)) return {0, 0, 0};
  shading_side side = find_side(m, normal, outgoing);
  float cos_i = glm::dot(side.up, incoming);
  bool straight = m.type == material_type::volumetric || (is_refractive(m) && is_index_matched(m));
  if (straight) return vec3(cos_i <= 0 ? 1.0f : 0.0f);
  if (side.cos_o == 0 || cos_i == 0) return {0, 0, 0};

  if (m.type == material_type::reflective)
    return cos_i > 0 ? fresnel_metal(m.color, side.cos_o) : vec3{0, 0, 0};
  bool thin = m.type == material_type::transparent;
  float f = fresnel_dielectric(thin ? m.ior : side.eta, side.cos_o);
  if (cos_i > 0) return vec3(f);
  return thin ? m.color * (1 - f) : vec3((1 - f) / (side.eta * side.eta));
}

vec3 sample_delta(const material_point& m, const vec3& normal, const vec3& outgoing, float rnl) {
  if (!is_delta(m)) return {0, 0, 0};
  if (m.type == material_type::volumetric || (is_refractive(m) && is_index_matched(m)))
    return -outgoing;
  shading_side side = find_side(m, normal, outgoing);
  if (side.cos_o == 0) return {0, 0, 0};

  bool thin = m.type == material_type::transparent;
  float f = fresnel_dielectric(thin ? m.ior : side.eta, side.cos_o);
  if (m.type == material_type::reflective || rnl < f)
    return keep_above(side.up, reflect_at(outgoing, side.up));
  return keep_below(side.up, thin ? -outgoing : refract_at(outgoing, side.up, side.eta));
}

float sample_delta_pdf(const material_point& m, const vec3& normal, const vec3& outgoing,
                       const vec3& incoming) {
  if (!is_delta(m)) return 0;
  shading_side side = find_side(m, normal, outgoing);
  float cos_i = glm::dot(side.up, incoming);
  if (m.type == material_type::volumetric || (is_refractive(m) && is_index_matched(m)))
    return cos_i <= 0 ? 1.0f : 0.0f;
  if (side.cos_o == 0 || cos_i == 0) return 0;

  if (m.type == material_type::reflective) return cos_i > 0 ? 1.0f : 0.0f;
  float f = fresnel_dielectric(m.type == material_type::transparent ? m.ior : side.eta, side.cos_o);
  return cos_i > 0 ? f : 1 - f;
}

// ---------------------------------------------------------------------------
// Interiors
// ---------------------------------------------------------------------------

namespace {

// g = +-1 would scatter into a single direction.
float anisotropy(const material_point& m) { return std::clamp(m.scanisotropy, -0.999f, 0.999f); }

// Henyey and Greenstein 1941, equation 2; g > 0 goes on, that is, towards
// -outgoing. 1 + g^2 - 2 g cos is written as (1 - |g|)^2 + |g| |o + i sign(g)|^2,
// which does not cancel in the peak.
float eval_phase_function(float g, const vec3& outgoing, const vec3& incoming) {
  vec3 v = outgoing + incoming * (g < 0 ? -1.0f : 1.0f);
  float rest = 1 - std::abs(g);
  float d = rest * rest + std::abs(g) * glm::dot(v, v);
  return (1 - g * g) / (4 * pi * d * std::sqrt(d));
}

}  // namespace

vec3 eval_scattering(const material_point& m, const vec3& outgoing, const vec3& incoming) {
  return m.scattering * m.density * eval_phase_function(anisotropy(m), outgoing, incoming);
}

vec3 sample_scattering(const material_point& m, const vec3& outgoing, const vec2& rn) {
  float g = anisotropy(m);
  // The usual inversion, arranged so that it neither divides by g nor cancels.
  float c = 1 - 2 * rn.y;
  float s = (1 - g * g) / (1 + g * c);
  float cosine = std::clamp((g + (c + g) * (1 + s) / (1 + g * c)) / 2, -1.0f, 1.0f);
  float sine = std::sqrt((1 - cosine) * (1 + cosine));
  float phi = 2 * pi * rn.x;
  return glm::normalize(basis_from_z(-outgoing) *
                        vec3{sine * std::cos(phi), sine * std::sin(phi), cosine});
}

float sample_scattering_pdf(const material_point& m, const vec3& outgoing, const vec3& incoming) {
  return eval_phase_function(anisotropy(m), outgoing, incoming);
}

vec3 eval_transmittance(const vec3& density, float distance) {
  // Where there is nothing, an infinite distance absorbs nothing either.
  auto channel = [&](float d) { return d > 0 ? std::exp(-d * distance) : 1.0f; };
  return {channel(density.x), channel(density.y), channel(density.z)};
}

float sample_transmittance(const vec3& density, float max_distance, float rl, float rd) {
  float d = density[std::clamp(static_cast<int>(rl * 3), 0, 2)];
  return d > 0 ? std::min(-std::log1p(-rd) / d, max_distance) : max_distance;
}

float sample_transmittance_pdf(const vec3& density, float distance, float max_distance) {
  vec3 t = eval_transmittance(density, std::min(distance, max_distance));
  if (distance < max_distance) t *= density;
  return (t.x + t.y + t.z) / 3;
}

}  // namespace wisp
