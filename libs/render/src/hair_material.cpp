#include "hair_material.h"

#include <fmt/format.h>

#include <algorithm>

#include "wisp/core/rng.h"
#include "wisp/hair/absorption.h"
#include "wisp/render/image.h"

namespace wisp {

namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// What strands, vertices and roughness textures change.
void vary(const render_scene& scene, const surface_point& p, const material_data& material,
          const hair_material& hair, hair_look& look, bool lobes) {
  vec2 factor = p.roughness;
  if (hair.has_roughness_tex)
    factor *= glm::max(
        vec2(eval_texture(scene.scene.textures[at(material.roughness_tex)], p.texcoord, true)),
        0.0f);
  bool rougher = hair.roughness_varies || factor != vec2{1, 1};
  if (!rougher && !hair.color_varies) return;
  auto own = hair_on_strand(material.hair, p.strand_number, factor);
  look.sigma_a = own.sigma_a;
  if (!rougher) return;
  look.beta_n = own.parameters.beta_n;
  if (!lobes) return;
  look.own = hair::make_hair_bsdf(own.parameters);
  look.bsdf = &*look.own;
}

}  // namespace

hair_material make_hair_material(const material_data& material) {
  hair_material result;
  if (material.type != material_type::hair) return result;
  auto plain = hair_on_strand(material.hair);
  result.used = true;
  result.color_varies = color_varies(material.hair);
  result.roughness_varies = roughness_varies(material.hair);
  result.has_roughness_tex = material.roughness_tex != invalid_id;
  result.bsdf = hair::make_hair_bsdf(plain.parameters);
  result.sigma_a = plain.sigma_a;
  result.beta_n = plain.parameters.beta_n;
  return result;
}

float strand_number(uint32_t copy, uint32_t strand, uint32_t stream) {
  uint64_t x = hash64((static_cast<uint64_t>(copy) << 32 | strand) + 0x9e3779b97f4a7c15ull);
  x = hash64(x + stream);
  return static_cast<float>(x >> 40) * 0x1p-24f;
}

void find_hair_look(const render_scene& scene, const surface_point& p, hair_look& look,
                    bool lobes) {
  const auto& material = scene.scene.materials[at(p.material)];
  const hair_material& hair = scene.hair[at(p.material)];
  look.bsdf = &hair.bsdf;
  look.sigma_a = hair.sigma_a;
  look.beta_n = hair.beta_n;
  if (hair.color_varies || hair.roughness_varies || hair.has_roughness_tex ||
      p.roughness != vec2{1, 1})
    vary(scene, p, material, hair, look, lobes);
  if (material.sigma_a_tex != invalid_id)
    look.sigma_a *= glm::max(
        vec3(eval_texture(scene.scene.textures[at(material.sigma_a_tex)], p.texcoord, true)), 0.0f);
  if (material.color_tex != invalid_id || p.color != vec4{1, 1, 1, 1}) {
    // A texture and vertex colours tint the hair's own colour.
    vec3 tint = vec3(p.color);
    if (material.color_tex != invalid_id)
      tint *= vec3(eval_texture(scene.scene.textures[at(material.color_tex)], p.texcoord, false));
    vec3 base = hair::color_from_sigma_a(look.sigma_a, look.beta_n);
    look.sigma_a = hair::sigma_a_from_color(base * tint, look.beta_n);
  }
}

part_report hair_part(const scene_data& scene) {
  std::size_t count = 0, by_strand = 0, by_texture = 0;
  for (const auto& m : scene.materials) {
    if (m.type != material_type::hair) continue;
    count++;
    if (color_varies(m.hair) || roughness_varies(m.hair)) by_strand++;
    if (m.color_tex != invalid_id || m.roughness_tex != invalid_id || m.sigma_a_tex != invalid_id)
      by_texture++;
  }
  if (count == 0) return {"hair lobes", false, "no hair material", 0, 0};
  std::string why = fmt::format("{} hair materials", count);
  if (by_strand > 0)
    why += fmt::format(", {} {} by strand", by_strand, by_strand == 1 ? "varies" : "vary");
  if (by_texture > 0)
    why += fmt::format(", {} {} by texture", by_texture, by_texture == 1 ? "varies" : "vary");
  return {"hair lobes", true, why, 0, 0};
}

void clamp_strand_textures(scene_data& scene) {
  // Materials that are seen on strands alone, and there from root to tip.
  enum struct look { unseen, along, other };
  std::vector<look> looks(scene.materials.size(), look::unseen);
  for (const auto& instance : scene.instances) {
    const auto& shape = scene.shapes[at(instance.shape)];
    const auto& m = scene.materials[at(instance.material)];
    bool along = strand_count(shape) > 0 && shape.triangles.empty() && shape.quads.empty() &&
                 shape.points.empty() &&
                 (shape.texcoords.empty() || (m.type == material_type::hair && m.hair.strand_uv));
    look& l = looks[at(instance.material)];
    l = along && l != look::other ? look::along : look::other;
  }
  std::vector<bool> other(scene.textures.size(), false);
  auto indices = [](material_data& m) {
    return std::array<int*, 6>{&m.emission_tex,   &m.color_tex,  &m.roughness_tex,
                               &m.scattering_tex, &m.normal_tex, &m.sigma_a_tex};
  };
  for (std::size_t i = 0; i < looks.size(); i++)
    if (looks[i] == look::other)
      for (int* t : indices(scene.materials[i]))
        if (*t != invalid_id) other[at(*t)] = true;
  for (const auto& environment : scene.environments)
    if (environment.emission_tex != invalid_id) other[at(environment.emission_tex)] = true;
  for (const auto& subdiv : scene.subdivs)
    if (subdiv.displacement_tex != invalid_id) other[at(subdiv.displacement_tex)] = true;

  std::vector<int> copies(scene.textures.size(), invalid_id);
  for (std::size_t i = 0; i < looks.size(); i++) {
    if (looks[i] != look::along) continue;
    for (int* t : indices(scene.materials[i])) {
      if (*t == invalid_id || scene.textures[at(*t)].clamp_s) continue;
      if (!other[at(*t)]) {
        scene.textures[at(*t)].clamp_s = true;
        continue;
      }
      if (at(*t) >= copies.size()) continue;  // is a copy
      int& copy = copies[at(*t)];
      if (copy == invalid_id) {
        copy = static_cast<int>(scene.textures.size());
        texture_data texture = scene.textures[at(*t)];
        texture.clamp_s = true;
        scene.textures.push_back(std::move(texture));
      }
      *t = copy;
    }
  }
}

}  // namespace wisp
