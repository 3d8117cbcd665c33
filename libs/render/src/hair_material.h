#pragma once

// Hair materials at render time. What does not vary is computed once for the
// material; at a hit only what its strand, its vertices or its textures change.

#include <optional>

#include "surface.h"
#include "wisp/hair/bsdf.h"
#include "wisp/render/render_scene.h"

namespace wisp {

struct hair_material {
  bool used = false;
  bool color_varies = false;      // from strand to strand
  bool roughness_varies = false;  // from strand to strand
  bool has_roughness_tex = false;
  hair::hair_bsdf<float> bsdf = {};
  vec3 sigma_a = {0, 0, 0};
  float beta_n = 0.3f;  // with which colours are mapped
};
hair_material make_hair_material(const material_data& material);

// A random number of a strand in [0, 1), the same for any number of threads and
// however its curve is cut. `copy` counts the instances of its shape, `stream`
// numbers that have nothing to do with each other.
float strand_number(uint32_t copy, uint32_t strand, uint32_t stream);
inline constexpr uint32_t variation_stream = 0, texcoord_stream = 1;

// The material on the strand of a hit.
struct hair_look {
  const hair::hair_bsdf<float>* bsdf = nullptr;  // of the material, or `own`
  vec3 sigma_a = {0, 0, 0};
  float beta_n = 0.3f;
  std::optional<hair::hair_bsdf<float>> own = {};

  hair_look() = default;
  hair_look(const hair_look&) = delete;
  hair_look& operator=(const hair_look&) = delete;
};
// `lobes` false leaves `bsdf` out: the absorption alone.
void find_hair_look(const render_scene& scene, const surface_point& point, hair_look& look,
                    bool lobes = true);

// How many hair materials there are and what makes them vary, for the report.
part_report hair_part(const scene_data& scene);

// Textures that are seen on strands from root to tip only do not go on from the
// tip with the root.
void clamp_strand_textures(scene_data& scene);

}  // namespace wisp
