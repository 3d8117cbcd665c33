// Materials of a JSON scene.

#include "json_scene.h"

namespace wisp {

namespace {

int number(material_type type) { return static_cast<int>(type); }
// A hair material by another renderer's names, beyond the material types.
int number(hair_kind kind) { return 1000 + static_cast<int>(kind); }

// The types of Yocto/GL under all the names that its versions gave them, and hair.
material_type read_type(json_object& object, hair_kind& kind) {
  using enum material_type;
  int type = number(matte);
  object.get_word("type", type,
                  {{"matte", number(matte)},
                   {"glossy", number(glossy)},
                   {"plastic", number(glossy)},
                   {"reflective", number(reflective)},
                   {"metallic", number(reflective)},
                   {"metal", number(reflective)},
                   {"transparent", number(transparent)},
                   {"thinglass", number(transparent)},
                   {"refractive", number(refractive)},
                   {"glass", number(refractive)},
                   {"subsurface", number(subsurface)},
                   {"volumetric", number(volumetric)},
                   {"volume", number(volumetric)},
                   {"gltfpbr", number(gltfpbr)},
                   {"principled", number(gltfpbr)},
                   {"hair", number(hair)},
                   {"pbrt_hair", number(hair)},
                   {"principled_hair", number(hair_kind::principled)},
                   {"chiang_hair_bsdf", number(hair_kind::chiang)}});
  if (type < 1000) return static_cast<material_type>(type);
  kind = static_cast<hair_kind>(type - 1000);
  return hair;
}

void read_surface(json_object& object, const json_scene_file& file, material_data& material) {
  object.get("color", material.color, not_negative);
  if (max_component(material.color) > 1.001f && material.type != material_type::gltfpbr)
    object.warn("color",
                "has a component above 1: more light leaves than arrives, and pictures "
                "may never become free of noise");
  object.get("roughness", material.roughness, unit_interval);
  object.get("metallic", material.metallic, unit_interval);
  object.get("ior", material.ior, positive);
  object.get("scattering", material.scattering, unit_interval);
  object.get("scanisotropy", material.scanisotropy, {-1, 1, true, true});
  bool has_depth = object.get("trdepth", material.trdepth, not_negative);
  if (has_depth && material.trdepth == 0) {
    using enum material_type;
    if (material.type == refractive || material.type == subsurface || material.type == volumetric)
      object.fail("trdepth", "is 0; it is a distance in the interior and must be greater than 0");
    material.trdepth = material_data{}.trdepth;
  }
  get_reference(object, "roughness_tex", file.textures, material.roughness_tex);
  get_reference(object, "scattering_tex", file.textures, material.scattering_tex);
  get_reference(object, "normal_tex", file.textures, material.normal_tex);
  object.ignore({"sigma_a", "eumelanin", "pheomelanin", "pigment", "reflectance", "eta", "beta_m",
                 "beta_n", "alpha", "p_max", "coat", "lobes", "random_color", "random_roughness",
                 "random", "strand_uv", "sigma_a_tex"},
                "only materials of type \"hair\" use it; ignored");
}

}  // namespace

std::vector<material_data> read_materials(const json_scene_file& file) {
  std::vector<material_data> result;
  for (const auto& element : file.materials.elements) {
    json_object object(file.context, *element.tree, element.place, "materials");
    material_data material;
    material.name = element.name;
    object.get("name", material.name);
    hair_kind kind = hair_kind::own;
    material.type = read_type(object, kind);
    if (material.type == material_type::hair)
      read_hair(object, file, kind, material);
    else
      read_surface(object, file, material);
    object.get("emission", material.emission, not_negative);
    object.get("opacity", material.opacity, unit_interval);
    get_reference(object, "emission_tex", file.textures, material.emission_tex);
    get_reference(object, "color_tex", file.textures, material.color_tex);
    object.finish();
    result.push_back(std::move(material));
  }
  return result;
}

}  // namespace wisp
