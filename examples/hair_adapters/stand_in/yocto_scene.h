// A stand-in for the parts of Yocto/GL that deal with materials (yocto_scene.h and
// yocto_trace.cpp): one other material, and the switches with their case for hair.

#pragma once

#include "../yocto_hair.h"
#include "yocto_math.h"

namespace yocto {

enum struct material_type { matte, hair };

struct material_point {
  material_type type = material_type::matte;
  vec3f color = {0, 0, 0};
  float roughness = 1;
  hair_point hair = {};
};

inline vec3f eval_bsdfcos(const material_point& material, const vec3f& normal,
                          const vec3f& outgoing, const vec3f& incoming) {
  if (material.roughness == 0) return {0, 0, 0};
  switch (material.type) {
    case material_type::matte:
      if (dot(normal, incoming) * dot(normal, outgoing) <= 0) return {0, 0, 0};
      return material.color * (std::abs(dot(normal, incoming)) / 3.14159265f);
    case material_type::hair:
      return eval_hair(material.hair, incoming);
  }
  return {0, 0, 0};
}

inline vec3f sample_bsdfcos(const material_point& material, const vec3f& normal,
                            const vec3f& outgoing, float rnl, const vec2f& rn) {
  if (material.roughness == 0) return {0, 0, 0};
  switch (material.type) {
    case material_type::matte: {
      frame3f frame = frame_fromz({0, 0, 0}, dot(normal, outgoing) < 0 ? -normal : normal);
      float r = std::sqrt(1 - rn.y), phi = 2 * 3.14159265f * rn.x;
      return transform_direction(frame, {r * std::cos(phi), r * std::sin(phi), std::sqrt(rn.y)});
    }
    case material_type::hair:
      return sample_hair(material.hair, rnl, rn);
  }
  return {0, 0, 0};
}

inline float sample_bsdfcos_pdf(const material_point& material, const vec3f& normal,
                                const vec3f& outgoing, const vec3f& incoming) {
  if (material.roughness == 0) return 0;
  switch (material.type) {
    case material_type::matte:
      if (dot(normal, incoming) * dot(normal, outgoing) <= 0) return 0;
      return std::abs(dot(normal, incoming)) / 3.14159265f;
    case material_type::hair:
      return sample_hair_pdf(material.hair, incoming);
  }
  return 0;
}

}  // namespace yocto
