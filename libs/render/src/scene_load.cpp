// Scenes by the ending of their file.

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
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
    scene.cameras.push_back(default_camera(scene));
    if (scene.cameras.back().name.empty()) scene.cameras.back().name = "default";
    warnings.push_back(path.string() + ": has no camera; one that sees all of it is added");
  }
  if (!has_light(scene)) {
    environment_data sky;
    sky.name = "sky";
    sky.emission = vec3{1};
    scene.environments.push_back(sky);
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
