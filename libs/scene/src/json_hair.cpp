// Hair materials of a JSON scene, by wisp's and pbrt's names, Cycles' and
// MaterialX's.

#include <fmt/format.h>

#include <algorithm>

#include "json_scene.h"
#include "wisp/hair/materials.h"

namespace wisp {

namespace {

// Of several ways to say one thing the first counts, and the keys of the others
// get a warning.
struct alternative {
  const char* name;  // in warnings
  std::vector<const char*> keys;
};
// The index of the first alternative of which a key is there, or -1.
int choose(json_object& object, const std::vector<alternative>& all) {
  int chosen = -1;
  for (std::size_t i = 0; i < all.size(); i++)
    for (const char* key : all[i].keys) {
      if (!object.has(key)) continue;
      if (chosen < 0) chosen = static_cast<int>(i);
      if (chosen != static_cast<int>(i))
        object.warn(key, fmt::format("has no effect, since {} is given",
                                     all[static_cast<std::size_t>(chosen)].name));
    }
  return chosen;
}

void warn_above_one(const json_object& object, const char* key, const vec3& strength) {
  if (max_component(strength) > 1.001f)
    object.warn(key,
                "has a component above 1: more light leaves than arrives, and pictures may never "
                "become free of noise");
}

// A number for all channels, or three.
bool get_strength(json_object& object, const char* key, vec3& strength) {
  const json_tree* tree = object.find(key);
  if (tree == nullptr) return false;
  if (tree->is_number()) {
    float value = 1;
    object.get(key, value, not_negative);
    strength = vec3{value};
  } else {
    if (!tree->is_array() || tree->size() != 3)
      object.fail(key, "must be a number or an array of 3 numbers");
    object.get(key, strength, not_negative);
  }
  warn_above_one(object, key, strength);
  return true;
}

void read_lobes(json_object& object, hair_data& hair) {
  const json_tree* tree = object.find("lobes");
  if (tree == nullptr) return;
  json_object lobes(object.context(), *tree, object.place_of("lobes"), "lobes");
  const char* names[] = {"R", "TT", "TRT"};
  for (std::size_t i = 0; i < 3; i++) {
    const json_tree* entry = lobes.find(names[i]);
    if (entry == nullptr) continue;
    json_object lobe(object.context(), *entry, lobes.place_of(names[i]), "lobes");
    get_strength(lobe, "strength", hair.strength[i]);
    lobe.get("beta_m", hair.roughness[i].x, unit_interval);
    lobe.get("beta_n", hair.roughness[i].y, unit_interval);
    lobe.finish();
  }
  lobes.finish();
}

void read_own(json_object& object, hair_data& hair) {
  int chosen = choose(object, {{"\"sigma_a\"", {"sigma_a"}},
                               {"\"color\"", {"color"}},
                               {"\"reflectance\"", {"reflectance"}},
                               {"the concentration of pigments", {"eumelanin", "pheomelanin"}}});
  vec3 value;
  if (object.get("sigma_a", value, not_negative)) hair.sigma_a = value;
  if (object.get("reflectance", value, unit_interval)) hair.color = value;
  if (object.get("color", value, unit_interval)) hair.color = value;
  bool has_eumelanin = object.get("eumelanin", hair.eumelanin, not_negative);
  bool has_pheomelanin = object.get("pheomelanin", hair.pheomelanin, not_negative);
  // Red hair has pheomelanin alone: the brown default is for "neither".
  if (has_pheomelanin && !has_eumelanin) hair.eumelanin = 0;
  int pigment = 0;
  bool has_pigment =
      object.get_word("pigment", pigment, {{"pbrt", 0}, {"cycles", 1}, {"materialx", 2}});
  hair.pigment = static_cast<hair_pigment>(pigment);
  if (has_pigment && chosen >= 0 && chosen < 3)
    object.warn("pigment", "has no effect, since the absorption is not given by pigments");
  object.get("eta", hair.eta, {1, 10});
  object.get("beta_m", hair.beta_m, unit_interval);
  object.get("beta_n", hair.beta_n, unit_interval);
  object.get("alpha", hair.alpha, {-45, 45});
  object.get("p_max", hair.p_max, 1, hair::max_p_max);
  object.get("coat", hair.coat, unit_interval);
  object.get("random_color", hair.random_color, unit_interval);
  object.get("random_roughness", hair.random_roughness, unit_interval);
  read_lobes(object, hair);
  object.ignore({"ior"}, "a hair material has \"eta\" instead; ignored");
  object.ignore({"roughness"}, "a hair material has \"beta_m\" and \"beta_n\" instead; ignored");
}

// Cycles' Principled Hair BSDF.
void read_principled(json_object& object, hair_data& hair) {
  using enum hair::hair_parametrization;
  hair::principled_hair<float> p;
  auto number = [](hair::hair_parametrization x) { return static_cast<int>(x); };
  int chosen = number(color);
  bool given = object.get_word("parametrization", chosen,
                               {{"Direct Coloring", number(color)},
                                {"COLOR", number(color)},
                                {"Melanin Concentration", number(melanin)},
                                {"MELANIN", number(melanin)},
                                {"Absorption Coefficient", number(absorption)},
                                {"ABSORPTION", number(absorption)}});
  std::vector<alternative> ways = {{"\"absorption_coefficient\"", {"absorption_coefficient"}},
                                   {"\"color\"", {"color"}},
                                   {"melanin", {"melanin", "melanin_redness", "tint"}}};
  const hair::hair_parametrization order[] = {absorption, color, melanin};
  if (given) {
    for (std::size_t i = 0; i < 3; i++)
      for (const char* key : ways[i].keys)
        if (number(order[i]) != chosen && object.has(key))
          object.warn(key, "has no effect for this \"parametrization\"");
    p.parametrization = static_cast<hair::hair_parametrization>(chosen);
  } else if (int way = choose(object, ways); way >= 0) {
    p.parametrization = order[way];
  }
  object.get("absorption_coefficient", p.absorption_coefficient, not_negative);
  if (object.get("color", p.color, unit_interval)) hair.color = p.color;
  object.get("melanin", p.melanin, unit_interval);
  object.get("melanin_redness", p.melanin_redness, unit_interval);
  object.get("tint", p.tint, unit_interval);
  object.get("roughness", p.roughness, unit_interval);
  object.get("radial_roughness", p.radial_roughness, unit_interval);
  object.get("coat", p.coat, unit_interval);
  object.get("ior", p.ior, {1, 10});
  object.get("offset", p.offset, {-90, 90});
  if (object.get("random_color", p.random_color, unit_interval) && p.parametrization != melanin)
    object.warn("random_color", "has no effect without melanin");
  object.get("random_roughness", p.random_roughness, unit_interval);
  int model = 0;
  object.get_word("model", model, {{"CHIANG", 0}, {"Chiang", 0}});
  hair.principled = p;
}

// MaterialX' chiang_hair_bsdf with the inputs of its helper nodes.
void read_chiang(json_object& object, hair_data& hair) {
  hair::chiang_hair<float> from;
  get_strength(object, "tint_R", from.tint_R);
  get_strength(object, "tint_TT", from.tint_TT);
  get_strength(object, "tint_TRT", from.tint_TRT);
  object.get("ior", from.ior, {1, 10});
  object.get("cuticle_angle", from.cuticle_angle, unit_interval);

  // chiang_hair_roughness, if one of its inputs is there; a pair that is given counts.
  float longitudinal = 0.1f, azimuthal = 0.2f, scale_TT = 0.5f, scale_TRT = 2;
  int given = 0, helpers = 0;
  helpers += object.get("longitudinal", longitudinal, unit_interval) ? 1 : 0;
  helpers += object.get("azimuthal", azimuthal, unit_interval) ? 1 : 0;
  helpers += object.get("scale_TT", scale_TT, not_negative) ? 1 : 0;
  helpers += object.get("scale_TRT", scale_TRT, not_negative) ? 1 : 0;
  if (helpers > 0) {
    auto pairs = hair::chiang_hair_roughness(longitudinal, azimuthal, scale_TT, scale_TRT);
    from.roughness_R = pairs[0];
    from.roughness_TT = pairs[1];
    from.roughness_TRT = pairs[2];
  }
  given += object.get_pair("roughness_R", from.roughness_R, unit_interval) ? 1 : 0;
  given += object.get_pair("roughness_TT", from.roughness_TT, unit_interval) ? 1 : 0;
  given += object.get_pair("roughness_TRT", from.roughness_TRT, unit_interval) ? 1 : 0;
  if (given == 3)
    for (const char* key : {"longitudinal", "azimuthal", "scale_TT", "scale_TRT"})
      if (object.has(key))
        object.warn(key,
                    "has no effect, since \"roughness_R\", \"roughness_TT\" and "
                    "\"roughness_TRT\" are given");

  int way = choose(
      object,
      {{"\"absorption_coefficient\"", {"absorption_coefficient"}},
       {"\"color\"", {"color"}},
       {"melanin",
        {"melanin_concentration", "melanin_redness", "eumelanin_color", "pheomelanin_color"}}});
  object.get("absorption_coefficient", from.absorption_coefficient, not_negative);
  vec3 color = {1, 1, 1};
  float azimuthal_roughness = 0.2f;
  if (object.get("color", color, unit_interval)) hair.color = color;
  if (object.get("azimuthal_roughness", azimuthal_roughness, unit_interval) && way != 1)
    object.warn("azimuthal_roughness",
                "has no effect, since the absorption does not follow from a "
                "\"color\"");
  float concentration = 0.25f, redness = 0.5f;
  vec3 eumelanin = {0.657704f, 0.498077f, 0.254107f},
       pheomelanin = {0.829444f, 0.67032f, 0.349938f};
  const json_range above_zero = {0, 1, true};
  object.get("melanin_concentration", concentration, unit_interval);
  object.get("melanin_redness", redness, unit_interval);
  object.get("eumelanin_color", eumelanin, above_zero);
  object.get("pheomelanin_color", pheomelanin, above_zero);
  if (way == 1)
    from.absorption_coefficient =
        hair::chiang_hair_absorption_from_color(color, azimuthal_roughness);
  if (way == 2)
    from.absorption_coefficient =
        hair::deon_hair_absorption_from_melanin(concentration, redness, eumelanin, pheomelanin);

  auto to = hair::convert(from);
  hair.sigma_a = to.sigma_a;
  hair.eta = to.parameters.eta;
  hair.beta_m = to.parameters.beta_m;
  hair.beta_n = to.parameters.beta_n;
  hair.alpha = to.parameters.alpha;
  hair.strength = to.parameters.strength;
  hair.roughness = to.parameters.roughness;
}

}  // namespace

void read_hair(json_object& object, const json_scene_file& file, hair_kind kind,
               material_data& material) {
  switch (kind) {
    case hair_kind::own:
      read_own(object, material.hair);
      break;
    case hair_kind::principled:
      read_principled(object, material.hair);
      break;
    case hair_kind::chiang:
      read_chiang(object, material.hair);
      break;
  }
  if (kind != hair_kind::chiang) {
    float random = 0.5f;
    if (object.get("random", random, unit_interval)) material.hair.random = random;
  }
  object.get("strand_uv", material.hair.strand_uv);
  get_reference(object, "roughness_tex", file.textures, material.roughness_tex);
  get_reference(object, "sigma_a_tex", file.textures, material.sigma_a_tex);
  object.ignore(
      {"metallic", "scattering", "scanisotropy", "trdepth", "scattering_tex", "normal_tex"},
      "has no meaning for a hair material; ignored");
}

}  // namespace wisp
