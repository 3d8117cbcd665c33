// wisp's hair behind Yocto/GL's functions of materials: what belongs between
// yocto_math.h and yocto_scene.h. stand_in/yocto_scene.h shows the rest: a member
// `hair` of material_point, and a case in each switch over material types.

#pragma once

#include <algorithm>

#include "stand_in/yocto_math.h"
#include "wisp/hair/bsdf.h"

namespace yocto {

// The hair's part of a material_point: all that follows from a ray's hit with a line.
struct hair_point {
  const wisp::hair::hair_bsdf<float>* bsdf = nullptr;  // the material's
  wisp::hair::hair_hit<float> hit = {};
  frame3f frame = {};  // x along the fibre, z towards the viewer
};

inline glm::vec3 to_hair(const frame3f& frame, const vec3f& w) {
  return {dot(w, frame.x), dot(w, frame.y), dot(w, frame.z)};
}

// For lines eval_position() gives a point of the axis and eval_normal() the tangent.
// Yocto's uv.y is the distance from the axis without its sign, so that h comes from the ray.
inline hair_point make_hair_point(const wisp::hair::hair_bsdf<float>& bsdf, const vec3f& sigma_a,
                                  const vec3f& axis, const vec3f& tangent, float radius,
                                  const ray3f& ray) {
  vec3f outgoing = -ray.d, across = cross(outgoing, tangent);
  hair_point point;
  point.bsdf = &bsdf;
  point.frame.x = tangent;
  point.frame.y = length(across) > 1e-6f ? normalize(across) : frame_fromz(axis, tangent).x;
  point.frame.z = cross(point.frame.x, point.frame.y);
  point.frame.o = axis;
  float h = std::clamp(dot(ray.o - axis, point.frame.y) / radius, -1.0f, 1.0f);
  point.hit = wisp::hair::make_hair_hit<float>(bsdf, {sigma_a.x, sigma_a.y, sigma_a.z}, h,
                                               to_hair(point.frame, outgoing));
  return point;
}

// As eval_matte() and its like: the cosine is included. The point knows `outgoing`
// already, and hair has no normal.
inline vec3f eval_hair(const hair_point& hair, const vec3f& incoming) {
  auto f = wisp::hair::eval_hair(*hair.bsdf, hair.hit, to_hair(hair.frame, incoming));
  return {f.x, f.y, f.z};
}
inline vec3f sample_hair(const hair_point& hair, float rnl, const vec2f& rn) {
  auto w = wisp::hair::sample_hair(*hair.bsdf, hair.hit, glm::vec4{rnl, rn.x, rn.y, 0.5f});
  return transform_direction(hair.frame, {w.x, w.y, w.z});
}
inline float sample_hair_pdf(const hair_point& hair, const vec3f& incoming) {
  return wisp::hair::sample_hair_pdf(*hair.bsdf, hair.hit, to_hair(hair.frame, incoming));
}

}  // namespace yocto
