#pragma once

// Fresnel terms and the GGX microfacet distribution.
//
// Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR
// 2007. Heitz, Sampling the GGX Distribution of Visible Normals, JCGT 2018.
// Dupuy and Benyoub, Sampling Visible GGX Normals with Spherical Caps, 2023.
// Lagarde, Memo on Fresnel Equations, 2013.
//
// Cosines are those of unit vectors. alpha is the width of GGX, in (0, 1].

#include <algorithm>
#include <cmath>

#include "wisp/core/math.h"

namespace wisp {

// Reflectance of a dielectric, unpolarised. eta: index behind the surface over
// the index before it; cosine >= 0 on the side before. 1 under total internal
// reflection.
inline float fresnel_dielectric(float eta, float cosine) {
  if (eta == 1) return 0;
  // 1 - sin^2 / eta^2, written such that nothing cancels near eta = 1
  float cos2_t = ((eta - 1) * (eta + 1) + cosine * cosine) / (eta * eta);
  if (cos2_t <= 0) return 1;
  float cosine_t = std::sqrt(cos2_t);
  float rs = (cosine - eta * cosine_t) / (cosine + eta * cosine_t);
  float rp = (cosine_t - eta * cosine) / (cosine_t + eta * cosine);
  return (rs * rs + rp * rp) / 2;
}

// Reflectance of a dielectric at normal incidence.
inline float eta_to_reflectivity(float eta) {
  float r = (eta - 1) / (eta + 1);
  return r * r;
}

// Reflectance of a metal as Yocto/GL models it: for each channel a dielectric
// whose reflectance at normal incidence is the colour. Yocto/GL stops at 0.99;
// here white loses nothing.
inline vec3 fresnel_metal(const vec3& color, float cosine) {
  vec3 result;
  for (int c = 0; c < 3; c++) {
    float root = std::sqrt(std::max(color[c], 0.0f));
    result[c] = root < 1 ? fresnel_dielectric((1 + root) / (1 - root), cosine) : 1;
  }
  return result;
}

// Schlick's approximation. What reflects nothing straight on reflects nothing.
inline vec3 fresnel_schlick(const vec3& reflectivity, float cosine) {
  if (reflectivity == vec3{0, 0, 0}) return {0, 0, 0};
  float x = std::clamp(1 - cosine, 0.0f, 1.0f);
  float x2 = x * x;
  return reflectivity + (1.0f - reflectivity) * (x2 * x2 * x);
}

// D, Walter's equation 33. The squared sine comes from a cross product, since
// 1 - cos^2 has no digits left within a narrow lobe.
inline float ggx_distribution(float alpha, const vec3& normal, const vec3& halfway) {
  float cosine = glm::dot(normal, halfway);
  if (cosine <= 0) return 0;
  vec3 s = glm::cross(normal, halfway);
  float a2 = alpha * alpha;
  float d = cosine * cosine * a2 + glm::dot(s, s);
  return a2 / (pi * d * d);
}

// G1 / cosine, Walter's equation 34 without the division; cosine >= 0.
inline float smith_g1_over_cosine(float alpha, float cosine) {
  float a2 = alpha * alpha;
  return 2 / (cosine + std::sqrt(a2 + (1 - a2) * cosine * cosine));
}
inline float smith_g1(float alpha, float cosine) {
  return smith_g1_over_cosine(alpha, cosine) * cosine;
}

// A microfacet normal as seen from `outgoing`, which lies on the side of
// `normal`. Its density by solid angle is D G1(o) (o . h) / (n . o).
inline vec3 sample_visible_normal(float alpha, const vec3& normal, const vec3& outgoing,
                                  const vec2& u) {
  mat3 frame = basis_from_z(normal);
  vec3 o = outgoing * frame;  // transpose(frame) * outgoing
  // Stretched, GGX becomes the hemisphere, and mirror directions of its visible
  // normals are uniform over the cap z > -o.z of the sphere.
  o = glm::normalize(vec3{alpha * o.x, alpha * o.y, std::max(o.z, 0.0f)});
  float phi = 2 * pi * u.x;
  float height = (1 - u.y) * (1 + o.z);  // above the cap's rim
  // The mirror direction has z = height - o.z; (1 - z) (1 + z) without cancelling.
  float radius = std::sqrt(std::max(0.0f, u.y * (1 + o.z) * (height + (1 - o.z))));
  vec3 h = {radius * std::cos(phi) + o.x, radius * std::sin(phi) + o.y, height};
  return glm::normalize(frame * glm::normalize(vec3{alpha * h.x, alpha * h.y, h.z}));
}

// Mirrors v at a plane, keeping the side: the law of reflection.
inline vec3 reflect_at(const vec3& v, const vec3& normal) {
  return glm::normalize(normal * (2 * glm::dot(normal, v)) - v);
}

// Snell's law for a direction `v` before the surface, cosine = n . v > 0; eta as
// in fresnel_dielectric. The zero vector under total internal reflection.
inline vec3 refract_at(const vec3& v, const vec3& normal, float eta) {
  float cosine = glm::dot(normal, v);
  float cos2_t = ((eta - 1) * (eta + 1) + cosine * cosine) / (eta * eta);
  if (cos2_t <= 0) return {0, 0, 0};
  return glm::normalize(normal * (cosine / eta - std::sqrt(cos2_t)) - v / eta);
}

// Reflection off microfacets: the density with which a visible normal mirrors
// `outgoing` to `incoming`, both on the side of `normal`. The value of the lobe,
// cosine included, is this times the Fresnel term times G1 of `incoming`.
inline float reflection_pdf(float alpha, const vec3& normal, const vec3& halfway, float cos_o) {
  // D G1(o) (o . h) / (n . o) / (4 (o . h))
  return ggx_distribution(alpha, normal, halfway) * smith_g1_over_cosine(alpha, cos_o) / 4;
}

// Refraction through microfacets, Walter's section 4.2.
struct refraction {
  float pdf = 0;    // of a visible normal's refraction, Fresnel term left out
  float cos_h = 0;  // between `outgoing` and the microfacet
};

// `outgoing` lies on the side of `normal`, `incoming` on the other.
inline refraction eval_refraction(float alpha, float eta, const vec3& normal, const vec3& outgoing,
                                  const vec3& incoming, float cos_o) {
  vec3 sum = incoming * eta + outgoing;
  float length2 = glm::dot(sum, sum);
  if (!(length2 > 0)) return {};
  vec3 halfway = sum / std::sqrt(length2);
  if (glm::dot(halfway, normal) < 0) halfway = -halfway;
  float oh = glm::dot(outgoing, halfway), ih = glm::dot(incoming, halfway);
  if (oh <= 0 || ih >= 0) return {};  // no microfacet bends light that way
  // Density of the visible normal times the Jacobian, equation 17 from the
  // viewer's side: eta^2 |i . h| / (eta (i . h) + o . h)^2. The sum is parallel
  // to h, so that the denominator is its squared length.
  float visible =
      ggx_distribution(alpha, normal, halfway) * smith_g1_over_cosine(alpha, cos_o) * oh;
  return {visible * eta * eta * -ih / length2, oh};
}

}  // namespace wisp
