#pragma once

// Scattering at surfaces and in interiors: the material types of Yocto/GL.
// The triples eval / sample / pdf stand side by side with one argument order.
// All of them include the cosine |n . incoming| in the value, take directions
// that point away from the surface, in world space, of unit length, and random
// numbers in [0, 1).
//
// `normal` is the shading normal. For materials without transmission it faces
// the viewer; for refractive, subsurface and volumetric it is the outer normal
// of the solid, so that the side of `outgoing` tells inside from outside.
//
// Refraction changes radiance by the square of the relative index, as in
// Yocto/GL: a path that enters glass of index n weighs 1 / n^2 inside and gets the
// factor back where it leaves. Russian roulette should leave that factor out.
//
// The functions are pure and safe to call from any thread.
//
// Where a density is 0 the value is 0. Weights value / pdf of pure microfacet
// lobes are at most 1 (for refraction: times that factor).

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/scene/scene.h"

namespace wisp {

// A material with its textures looked up at a point.
struct material_point {
  material_type type = material_type::matte;
  vec3 emission = {0, 0, 0};
  vec3 color = {0, 0, 0};
  float opacity = 1;
  float roughness = 0;  // GGX alpha (already squared); 0: a delta
  float metallic = 0;
  float ior = 1;
  vec3 density = {0, 0, 0};     // extinction of the interior, 1 / scene unit
  vec3 scattering = {0, 0, 0};  // single-scattering albedo
  float scanisotropy = 0;
};

// Looks a material up at a texture coordinate with an interpolated vertex
// colour (white where there is none). `textures` are those of the scene.
WISP_API material_point eval_material(const material_data& material,
                                      const std::vector<texture_data>& textures,
                                      const vec2& texcoord, const vec4& color);

// Radiance that leaves the surface towards `outgoing`. Surfaces shine on both
// sides, as light sampling takes for granted (in Yocto/GL too, where normals of
// opaque surfaces face the viewer).
WISP_API vec3 eval_emission(const material_point& m, const vec3& normal, const vec3& outgoing);

// Only delta scattering (mirrors, smooth glass, boundaries of volumes).
WISP_API bool is_delta(const material_point& m);
// Has an interior that absorbs or scatters.
WISP_API bool is_volumetric(const material_point& m);
// Light goes through: the outer normal matters.
WISP_API bool is_transmissive(material_type type);

// BSDF times cosine, rgb; 0 for delta materials.
WISP_API vec3 eval_bsdf(const material_point& m, const vec3& normal, const vec3& outgoing,
                        const vec3& incoming);
// Draws incoming; the zero vector when nothing can be drawn.
WISP_API vec3 sample_bsdf(const material_point& m, const vec3& normal, const vec3& outgoing,
                          float rnl, const vec2& rn);
// Density of sample_bsdf by solid angle.
WISP_API float sample_bsdf_pdf(const material_point& m, const vec3& normal, const vec3& outgoing,
                               const vec3& incoming);

// The same for the delta part; the value is to be divided by the probability.
WISP_API vec3 eval_delta(const material_point& m, const vec3& normal, const vec3& outgoing,
                         const vec3& incoming);
WISP_API vec3 sample_delta(const material_point& m, const vec3& normal, const vec3& outgoing,
                           float rnl);
WISP_API float sample_delta_pdf(const material_point& m, const vec3& normal, const vec3& outgoing,
                                const vec3& incoming);

// Henyey-Greenstein phase function times albedo and density, its sampling and density.
WISP_API vec3 eval_scattering(const material_point& m, const vec3& outgoing, const vec3& incoming);
WISP_API vec3 sample_scattering(const material_point& m, const vec3& outgoing, const vec2& rn);
WISP_API float sample_scattering_pdf(const material_point& m, const vec3& outgoing,
                                     const vec3& incoming);

// Transmittance over a distance; sampling of a free-flight distance by one
// channel, at most max_distance, and the matching density (or probability of
// reaching max_distance).
WISP_API vec3 eval_transmittance(const vec3& density, float distance);
WISP_API float sample_transmittance(const vec3& density, float max_distance, float rl, float rd);
WISP_API float sample_transmittance_pdf(const vec3& density, float distance, float max_distance);

}  // namespace wisp
