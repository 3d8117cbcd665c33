// Scenes by the ending of their file; a bare shape gets what it needs to be
// seen: a camera, light and a material.

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <system_error>

#include "wisp/render/gltf.h"
#include "wisp/scene/io.h"

namespace wisp {

namespace fs = std::filesystem;

namespace {

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (auto& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

void add_sky(scene_data& scene, float radiance) {
  environment_data sky;
  sky.name = "sky";
  sky.emission = vec3{radiance};
  scene.environments.push_back(sky);
}

void add_camera(scene_data& scene) {
  scene.cameras.push_back(default_camera(scene));
  if (scene.cameras.back().name.empty()) scene.cameras.back().name = "default";
}

int add_material(scene_data& scene, material_data material) {
  scene.materials.push_back(std::move(material));
  return static_cast<int>(scene.materials.size()) - 1;
}

void add_shape(scene_data& scene, shape_data shape, int material, const frame3& frame) {
  instance_data instance;
  instance.name = shape.name;
  instance.frame = frame;
  instance.shape = static_cast<int>(scene.shapes.size());
  instance.material = material;
  scene.shapes.push_back(std::move(shape));
  scene.instances.push_back(std::move(instance));
}

// A square lamp above the left shoulder of whoever looks from +z, out of the
// default camera's view, its size and distance in proportion to the scene.
void add_key_light(scene_data& scene) {
  auto [low, high] = scene_bounds(scene);
  if (!(low.x <= high.x)) return;
  vec3 center = (low + high) / 2.0f;
  float diagonal = glm::length(high - low);
  if (!(diagonal > 0) || !std::isfinite(diagonal)) return;
  material_data material;
  material.name = "key light";
  material.emission = vec3{10};
  shape_data quad;
  quad.name = "key light";
  float half = 0.4f * diagonal;
  quad.positions = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
  quad.normals.assign(4, vec3{0, 0, 1});
  quad.texcoords = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  quad.quads = {{0, 1, 2, 3}};
  vec3 offset = vec3{-0.8f, 1.1f, 0.95f} * diagonal;
  mat3 axes = basis_from_z(normalize_or_zero(-offset));
  int id = add_material(scene, material);
  add_shape(scene, std::move(quad), id, {axes[0], axes[1], axes[2], center + offset});
}

// Faces and points in matte grey, strands as brown hair.
scene_data load_shape_scene(const fs::path& path, warning_list& warnings) {
  scene_data scene;
  scene.path = path;
  auto shape = load_shape(path, warnings);
  if (shape.name.empty()) shape.name = path.stem().string();
  bool has_faces = !shape.triangles.empty() || !shape.quads.empty() || !shape.points.empty();
  if (!has_faces && strand_count(shape) == 0)
    throw file_error{path.string(), "", "holds no faces, points or strands to show"};
  if (strand_count(shape) > 0) {
    material_data hair;
    hair.name = "hair";
    hair.type = material_type::hair;
    auto strands = shape;
    strands.points = {};
    strands.triangles = {};
    strands.quads = {};
    if (has_faces) strands.name += " strands";
    add_shape(scene, std::move(strands), add_material(scene, hair), identity_frame);
  }
  if (has_faces) {
    material_data grey;
    grey.name = "grey";
    grey.color = vec3{0.7f};
    shape.strands = {};
    add_shape(scene, std::move(shape), add_material(scene, grey), identity_frame);
  }
  add_camera(scene);  // before the lamp, which it need not see
  add_key_light(scene);
  add_sky(scene, 1);
  return scene;
}

bool has_light(const scene_data& scene) {
  auto shines = [](const auto& item) { return max_component(item.emission) > 0; };
  if (!scene.lights.empty()) return true;
  if (std::any_of(scene.environments.begin(), scene.environments.end(), shines)) return true;
  return std::any_of(scene.instances.begin(), scene.instances.end(), [&](const auto& instance) {
    return instance.material >= 0 &&
           shines(scene.materials[static_cast<std::size_t>(instance.material)]);
  });
}

// glTF files leave camera and light to the viewer when they have none.
scene_data load_gltf_for_viewing(const fs::path& path, warning_list& warnings) {
  auto scene = load_gltf_scene(path, warnings);
  if (scene.cameras.empty()) {
    add_camera(scene);
    warnings.push_back(path.string() + ": has no camera; one that sees all of it is added");
  }
  if (!has_light(scene)) {
    add_sky(scene, 1);
    warnings.push_back(path.string() + ": has no light; a white sky is added");
  }
  return scene;
}

}  // namespace

scene_data load_scene(const fs::path& path, warning_list& warnings) {
  std::error_code error;
  auto status = fs::status(path, error);
  if (!fs::exists(status)) throw file_error{path.string(), "", "file not found"};
  if (fs::is_directory(status))
    throw file_error{path.string(), "", "is a folder; give the scene file in it"};
  auto extension = lower_extension(path);
  if (extension == ".json") return load_json_scene(path, warnings);
  if (extension == ".gltf" || extension == ".glb") return load_gltf_for_viewing(path, warnings);
  if (can_load_shape(path)) return load_shape_scene(path, warnings);
  throw file_error{path.string(), "",
                   fmt::format("the ending '{}' is not known; scenes are .json, .gltf or .glb, "
                               "shapes .ply, .obj, .stl, .hair, .tfx, .tfxmesh or .pbrt",
                               extension)};
}

}  // namespace wisp
