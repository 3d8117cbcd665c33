#pragma once

// From a hit to what shading needs.

#include "accel.h"
#include "wisp/render/material.h"
#include "wisp/render/render_scene.h"

namespace wisp {

// A point on a surface, point sphere or strand.
struct surface_point {
  int instance = invalid_id;
  int material = invalid_id;
  element_kind kind = element_kind::triangle;
  vec3 position = {0, 0, 0};
  vec3 geometric_normal = {0, 0, 0};  // outwards, unit
  vec3 normal = {0, 0, 0};            // for shading, see material.h
  vec3 tangent = {0, 0, 0};           // along the strand, unit; zero for surfaces
  float h = 0;                        // across the strand, see hair/bsdf.h
  vec3 across = {0, 0, 0};            // h points along this, unit
  float radius = 0;                   // of the strand here, world units
  vec2 texcoord = {0, 0};
  vec4 color = {1, 1, 1, 1};
  bool unlit = false;          // shows its colour, see surface_paint
  float strand_number = 0.5f;  // of the strand, in [0, 1); where its material varies by it
  vec2 roughness = {1, 1};     // factors of hair's beta_m and beta_n
};

surface_point eval_surface(const render_scene& scene, const ray3& ray, const ray_hit& hit);

// Material with its textures at the point.
inline material_point eval_material(const render_scene& scene, const surface_point& point) {
  material_point m = eval_material(scene.scene.materials[static_cast<std::size_t>(point.material)],
                                   scene.scene.textures, point.texcoord, point.color);
  if (point.unlit) {
    m.type = material_type::matte;
    m.emission = vec3(point.color);
    m.color = {0, 0, 0};
  }
  return m;
}

// A ray that leaves the point: its start is moved off the surface by the
// rounding of the position, to the side that `towards` points to; on a strand,
// which is left as if from the axis, it begins where it has left the fibre.
ray3 spawn_ray(const surface_point& point, const vec3& direction, const vec3& towards,
               float tmax = infinity);

}  // namespace wisp
