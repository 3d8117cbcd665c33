// Materials of a JSON scene.

#include <fmt/format.h>

#include "json_scene.h"

namespace wisp {

namespace {

int number(material_type type) { return static_cast<int>(type); }

// The types of Yocto/GL under all the names that its versions gave them, and hair.
material_type read_type(json_object& object) {
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
                   {"hair", number(hair)}});
  return static_cast<material_type>(type);
}

void read_hair(json_object& object, hair_data& hair) {
  vec3 color;
  if (object.get("sigma_a", color, not_negative)) hair.sigma_a = color;
  if (object.get("color", color, unit_interval)) hair.color = color;
  bool has_eumelanin = object.get("eumelanin", hair.eumelanin, not_negative);
  bool has_pheomelanin = object.get("pheomelanin", hair.pheomelanin, not_negative);
  // Red hair has pheomelanin alone: the brown default is for "neither".
  if (has_pheomelanin && !has_eumelanin) hair.eumelanin = 0;
  int pigment = 0;
  object.get_word("pigment", pigment, {{"pbrt", 0}, {"cycles", 1}, {"materialx", 2}});
  hair.pigment = static_cast<hair_pigment>(pigment);
  if (hair.sigma_a && hair.color) object.warn("color", "has no effect, since \"sigma_a\" is given");
  if ((hair.sigma_a || hair.color) && (has_eumelanin || has_pheomelanin))
    object.warn(
        has_eumelanin ? "eumelanin" : "pheomelanin",
        fmt::format("has no effect, since \"{}\" is given", hair.sigma_a ? "sigma_a" : "color"));
  object.get("eta", hair.eta, {1, 10});
  object.get("beta_m", hair.beta_m, unit_interval);
  object.get("beta_n", hair.beta_n, unit_interval);
  object.get("alpha", hair.alpha, {-45, 45});
  object.ignore({"ior"}, "a hair material has \"eta\" instead; ignored");
  object.ignore({"roughness"}, "a hair material has \"beta_m\" and \"beta_n\" instead; ignored");
  object.ignore({"metallic", "scattering", "scanisotropy", "trdepth", "roughness_tex",
                 "scattering_tex", "normal_tex"},
                "has no meaning for a hair material; ignored");
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
  object.ignore(
      {"sigma_a", "eumelanin", "pheomelanin", "pigment", "eta", "beta_m", "beta_n", "alpha"},
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
    material.type = read_type(object);
    if (material.type == material_type::hair)
      read_hair(object, material.hair);
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
