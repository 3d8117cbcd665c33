// Materials and textures of glTF 2.0 (section 3.9) as wisp's: metallic-roughness
// is `gltfpbr`, and extensions that turn a surface into something else choose
// another type.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>

#include "gltf_internal.h"
#include "wisp/render/image.h"

namespace wisp::gltf_detail {

namespace {

using tinygltf::Value;

const Value* find_extension(const tinygltf::ExtensionMap& extensions, const char* name) {
  auto it = extensions.find(name);
  return it != extensions.end() && it->second.IsObject() ? &it->second : nullptr;
}

// A number of the file; larger ones than any sensible are cut, since a float
// could not hold them.
float to_float(const Value& value) {
  return static_cast<float>(std::clamp(value.GetNumberAsDouble(), -1e30, 1e30));
}

vec2 get_vec2(const Value& object, const char* key, const vec2& otherwise) {
  if (!object.Has(key)) return otherwise;
  const auto& list = object.Get(key);
  if (list.ArrayLen() != 2 || !list.Get(0).IsNumber() || !list.Get(1).IsNumber()) return otherwise;
  return {to_float(list.Get(0)), to_float(list.Get(1))};
}

vec3 get_vec3(const Value& object, const char* key, const vec3& otherwise) {
  if (!object.Has(key)) return otherwise;
  const auto& list = object.Get(key);
  vec3 result = otherwise;
  if (list.ArrayLen() == 3)
    for (int c = 0; c < 3; c++)
      if (list.Get(c).IsNumber()) result[c] = to_float(list.Get(c));
  return result;
}

// A factor of a material: finite, and within a range.
float factor(double value, float low, float high) {
  return std::isfinite(value) ? static_cast<float>(std::clamp<double>(value, low, high)) : low;
}

vec3 color_factor(const std::vector<double>& values, float high) {
  vec3 result = {1, 1, 1};
  for (std::size_t c = 0; c < 3 && c < values.size(); c++)
    result[static_cast<int>(c)] = factor(values[c], 0, high);
  return result;
}

// Whether an encoded image may have an alpha channel, by its first bytes.
bool may_have_alpha(std::span<const uint8_t> head) {
  if (head.size() < 26) return true;
  if (head[0] == 0xff && head[1] == 0xd8) return false;  // JPEG never has
  bool png = head[0] == 0x89 && head[1] == 'P' && head[2] == 'N' && head[3] == 'G';
  constexpr uint8_t grey = 0, rgb = 2;
  return !(png && (head[25] == grey || head[25] == rgb));
}

// Makes a texture opaque. Alpha is only seen in pixels, so that these are
// loaded at once where the file may have it.
void drop_alpha(texture_data& texture) {
  std::array<uint8_t, 26> head = {};
  std::size_t have = std::min(head.size(), texture.encoded.size());
  if (!texture.encoded.empty()) {
    std::copy_n(texture.encoded.begin(), have, head.begin());
  } else {
    std::ifstream in(texture.path, std::ios::binary);
    in.read(reinterpret_cast<char*>(head.data()), head.size());
    have = static_cast<std::size_t>(in.gcount());
    if (have == 0) return;  // missing: reported when something needs its pixels
  }
  if (!may_have_alpha({head.data(), have})) return;
  try {
    load_texture(texture);
  } catch (const file_error&) {
    return;  // reported when something needs its pixels
  }
  bool changed = false;
  for (auto& p : texture.pixelsb) changed |= std::exchange(p.w, uint8_t{255}) != 255;
  for (auto& p : texture.pixelsf) changed |= std::exchange(p.w, 1.0f) != 1.0f;
  if (changed) {
    texture.encoded = {};
  } else {
    texture.pixelsb = {};
    texture.pixelsf = {};
    texture.width = texture.height = 0;
  }
}

int image_source(const tinygltf::Texture& texture) {
  if (auto webp = find_extension(texture.extensions, "EXT_texture_webp");
      webp && webp->Has("source") && webp->Get("source").IsInt())
    return webp->Get("source").GetNumberAsInt();
  return texture.source;
}

// The scene's texture for a glTF texture, made on first use.
int get_texture(gltf_loader& loader, int index, bool opaque, const std::string& place) {
  if (index < 0) return invalid_id;
  const auto& file = loader.file;
  const auto& model = file.model;
  if (static_cast<std::size_t>(index) >= model.textures.size())
    fail(file, place,
         fmt::format("texture {} does not exist; the file has {}", index, model.textures.size()));
  const auto& texture = model.textures[static_cast<std::size_t>(index)];
  auto where = fmt::format("textures[{}]", index);
  int source = image_source(texture);
  if (source < 0) {
    warn(loader, where, "has no image of a supported format; it is left out");
    return invalid_id;
  }
  if (static_cast<std::size_t>(source) >= file.images.size())
    fail(file, where + ".source",
         fmt::format("image {} does not exist; the file has {}", source, file.images.size()));

  texture_data result;
  if (texture.sampler >= 0) {
    if (static_cast<std::size_t>(texture.sampler) >= model.samplers.size())
      fail(file, where + ".sampler", fmt::format("sampler {} does not exist", texture.sampler));
    const auto& sampler = model.samplers[static_cast<std::size_t>(texture.sampler)];
    result.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    result.clamp_s = sampler.wrapS == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    result.clamp_t = sampler.wrapT == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    if (sampler.wrapS == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ||
        sampler.wrapT == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT)
      warn(loader, where, "mirrored repetition is not supported; the texture repeats plainly");
  }
  auto key = std::tuple{source, result.nearest, result.clamp_s, result.clamp_t, opaque};
  if (auto it = loader.textures.find(key); it != loader.textures.end()) return it->second;

  const auto& image = file.images[static_cast<std::size_t>(source)];
  auto image_place = fmt::format("images[{}]", source);
  result.name = !image.name.empty()     ? image.name
                : !texture.name.empty() ? texture.name
                                        : fmt::format("image{}", source);
  if (image.buffer_view >= 0) {
    auto bytes = view_bytes(file, image.buffer_view, image_place + ".bufferView");
    if (bytes.empty()) fail(file, image_place, "holds no bytes");
    result.encoded.assign(bytes.begin(), bytes.end());
    result.path = file.path;
  } else if (is_data_uri(image.uri)) {
    auto bytes = decode_data_uri(image.uri);
    if (!bytes || bytes->empty()) fail(file, image_place + ".uri", "is no valid base64 data URI");
    result.encoded = std::move(*bytes);
    result.path = file.path;
  } else if (!image.uri.empty()) {
    result.path = resolve_uri(file, image.uri, image_place + ".uri");
  } else {
    fail(file, image_place, "has neither a uri nor a bufferView");
  }
  if (opaque) drop_alpha(result);
  int id = static_cast<int>(loader.scene.textures.size());
  loader.scene.textures.push_back(std::move(result));
  loader.textures[key] = id;
  return id;
}

const tinygltf::Material& get_gltf_material(const gltf_loader& loader, int index) {
  return loader.file.model.materials[static_cast<std::size_t>(index)];
}

texcoord_mapping mapping_of(int set, const tinygltf::ExtensionMap& extensions) {
  texcoord_mapping mapping;
  mapping.set = set;
  if (auto transform = find_extension(extensions, "KHR_texture_transform")) {
    mapping.offset = get_vec2(*transform, "offset", mapping.offset);
    mapping.scale = get_vec2(*transform, "scale", mapping.scale);
    mapping.rotation = factor(get_number(*transform, "rotation", 0), -1e6f, 1e6f);
    if (transform->Has("texCoord") && transform->Get("texCoord").IsInt())
      mapping.set = transform->Get("texCoord").GetNumberAsInt();
  }
  return mapping;
}

// The mappings of all textures of a material that are used.
std::vector<texcoord_mapping> texture_mappings(const tinygltf::Material& material) {
  std::vector<texcoord_mapping> result;
  auto add = [&](const auto& info) {
    if (info.index >= 0) result.push_back(mapping_of(info.texCoord, info.extensions));
  };
  add(material.pbrMetallicRoughness.baseColorTexture);
  add(material.pbrMetallicRoughness.metallicRoughnessTexture);
  add(material.normalTexture);
  add(material.emissiveTexture);
  return result;
}

// Glass: a thin sheet, or with KHR_materials_volume a solid body.
void apply_transmission(gltf_loader& loader, const tinygltf::Material& from, material_data& to,
                        const std::string& place) {
  auto transmission = find_extension(from.extensions, "KHR_materials_transmission");
  if (!transmission) return;
  double amount = get_number(*transmission, "transmissionFactor", 0);
  if (amount <= 0) return;
  if (transmission->Has("transmissionTexture"))
    warn(loader, place, "the texture of its transmission is not supported; the factor is used");
  if (amount <= 0.5) {
    warn(loader, place, "its transmission of at most a half is left out");
    return;
  }
  if (amount < 1) warn(loader, place, "its partial transmission is taken as full");
  auto volume = find_extension(from.extensions, "KHR_materials_volume");
  if (!volume || get_number(*volume, "thicknessFactor", 0) <= 0) {
    to.type = material_type::transparent;
    return;
  }
  to.type = material_type::refractive;
  if (to.color != vec3{1, 1, 1} || to.color_tex != invalid_id)
    warn(loader, place, "the colour of its surface is left out, since it is a body of glass");
  to.color_tex = invalid_id;
  to.color = glm::clamp(get_vec3(*volume, "attenuationColor", {1, 1, 1}), vec3{0}, vec3{1});
  double distance = get_number(*volume, "attenuationDistance", 0);
  if (distance > 0)
    to.trdepth = factor(distance, 1e-20f, 1e20f);
  else
    to.color = {1, 1, 1};  // infinitely far: nothing is absorbed
}

material_data convert_surface(gltf_loader& loader, int index) {
  material_data to;
  to.type = material_type::gltfpbr;
  if (index == invalid_id) {  // the default material of glTF
    to.name = "default";
    to.color = {1, 1, 1};
    to.metallic = 1;
    to.roughness = 1;
    return to;
  }
  const auto& from = get_gltf_material(loader, index);
  const auto& pbr = from.pbrMetallicRoughness;
  auto place = fmt::format("materials[{}]", index);
  to.name = from.name.empty() ? fmt::format("material{}", index) : from.name;

  bool opaque = from.alphaMode != "BLEND" && from.alphaMode != "MASK";
  to.color = color_factor(pbr.baseColorFactor, 1);
  to.color_tex =
      get_texture(loader, pbr.baseColorTexture.index, opaque, place + ".baseColorTexture");
  float alpha = pbr.baseColorFactor.size() == 4 ? factor(pbr.baseColorFactor[3], 0, 1) : 1;
  if (from.alphaMode == "BLEND") to.opacity = alpha;
  if (from.alphaMode == "MASK") {
    if (to.color_tex == invalid_id)
      to.opacity = alpha >= from.alphaCutoff ? 1.0f : 0.0f;
    else
      warn(loader, place, "alphaMode MASK is approximated: alpha blends and is not cut off");
  }
  to.metallic = factor(pbr.metallicFactor, 0, 1);
  to.roughness = factor(pbr.roughnessFactor, 0, 1);
  to.roughness_tex = get_texture(loader, pbr.metallicRoughnessTexture.index, false,
                                 place + ".metallicRoughnessTexture");
  to.normal_tex = get_texture(loader, from.normalTexture.index, false, place + ".normalTexture");
  if (to.normal_tex != invalid_id && from.normalTexture.scale != 1)
    warn(loader, place, "the scale of its normal texture is not supported; 1 is used");

  to.emission = color_factor(from.emissiveFactor, 1e20f);
  if (auto strength = find_extension(from.extensions, "KHR_materials_emissive_strength"))
    to.emission *= factor(get_number(*strength, "emissiveStrength", 1), 0, 1e20f);
  to.emission_tex =
      get_texture(loader, from.emissiveTexture.index, false, place + ".emissiveTexture");

  if (auto ior = find_extension(from.extensions, "KHR_materials_ior")) {
    double value = get_number(*ior, "ior", 1.5);
    if (value >= 1 && value < 100)
      to.ior = static_cast<float>(value);
    else
      warn(loader, place, "its index of refraction is below 1; 1.5 is used");
  }
  apply_transmission(loader, from, to, place);

  if (find_extension(from.extensions, "KHR_materials_unlit")) {
    // Shown as it is: it shines with its colour and reflects nothing.
    to.type = material_type::matte;
    to.emission = to.color;
    to.emission_tex = to.color_tex;
    to.color = {0, 0, 0};
  }
  auto mappings = texture_mappings(from);
  if (std::adjacent_find(mappings.begin(), mappings.end(), std::not_equal_to{}) != mappings.end())
    warn(loader, place,
         "its textures have texture coordinates or transforms of their own; all use those of the "
         "first");
  return to;
}

// Hair of the material's colour, or brown when it has none.
material_data convert_strands(gltf_loader& loader, int index) {
  material_data to;
  to.name = "hair";
  to.type = material_type::hair;
  if (index == invalid_id) return to;
  const auto& from = get_gltf_material(loader, index);
  to.name = from.name.empty() ? fmt::format("hair{}", index) : from.name;
  vec3 color = color_factor(from.pbrMetallicRoughness.baseColorFactor, 1);
  if (color != vec3{1, 1, 1}) to.hair.color = glm::clamp(color, vec3{0.001f}, vec3{0.999f});
  if (from.pbrMetallicRoughness.baseColorTexture.index >= 0)
    warn(loader, fmt::format("materials[{}]", index), "textures are left out for strands");
  return to;
}

}  // namespace

double get_number(const Value& object, const std::string& key, double otherwise) {
  if (!object.Has(key)) return otherwise;
  const auto& value = object.Get(key);
  return value.IsNumber() ? value.GetNumberAsDouble() : otherwise;
}

int get_material(gltf_loader& loader, int index, bool strands) {
  if (index >= 0 && static_cast<std::size_t>(index) >= loader.file.model.materials.size())
    fail(loader.file, "meshes",
         fmt::format("material {} does not exist; the file has {}", index,
                     loader.file.model.materials.size()));
  if (index < 0) index = invalid_id;
  auto key = std::pair{index, strands};
  if (auto it = loader.materials.find(key); it != loader.materials.end()) return it->second;
  auto material = strands ? convert_strands(loader, index) : convert_surface(loader, index);
  int id = static_cast<int>(loader.scene.materials.size());
  loader.scene.materials.push_back(std::move(material));
  loader.materials[key] = id;
  return id;
}

texcoord_mapping get_texcoord_mapping(const gltf_loader& loader, int material) {
  const auto& materials = loader.file.model.materials;
  if (material < 0 || static_cast<std::size_t>(material) >= materials.size()) return {};
  auto mappings = texture_mappings(materials[static_cast<std::size_t>(material)]);
  return mappings.empty() ? texcoord_mapping{} : mappings.front();
}

}  // namespace wisp::gltf_detail
