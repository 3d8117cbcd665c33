#include <fmt/format.h>

#include <system_error>

#include "commands.h"
#include "render_component.h"
#include "study_subjects.h"
#include "wisp/scene/io.h"

namespace fs = std::filesystem;

wisp::scene_data load_any_scene(const fs::path& path, wisp::warning_list& warnings) {
  std::error_code error;
  const auto status = fs::status(path, error);
  if (!fs::exists(status)) throw wisp::file_error(path.string(), "", "file not found");
  if (fs::is_directory(status))
    throw wisp::file_error(path.string(), "", "is a folder; give the scene file in it");
  if (wisp::can_load_shape(path)) return wisp::load_shape_scene(path, warnings);
  std::string ending = path.extension().string();
  for (auto& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (ending == ".json") return wisp::load_json_scene(path, warnings);
  if (ending == ".gltf" || ending == ".glb") return load_gltf(path, warnings);
  throw wisp::file_error(path.string(), "",
                         fmt::format("the ending '{}' is not known; scenes are .json, shapes "
                                     ".ply, .obj, .stl, .hair, .tfx, .tfxmesh or .pbrt",
                                     ending));
}

wisp::scene_data load_gltf(const fs::path& path, wisp::warning_list&) {
  throw wisp::file_error(path.string(), "", needs_render("is glTF, which"));
}

std::vector<wisp::part_report> plan_render(wisp::scene_data&) { return {}; }

image_lookup load_image_lookup(wisp::scene_data& scene, int texture, int, const std::string& place,
                               std::size_t&) {
  const auto& data = scene.textures[static_cast<std::size_t>(texture)];
  throw wisp::file_error(scene.path.string(), place,
                         needs_render(fmt::format("the image of the texture '{}'", data.name)));
}

study_subject make_picture_subject(const study_arguments& args, const study_watch&,
                                   wisp::warning_list&) {
  throw usage_error(needs_render(fmt::format("'{}': the study of a picture", args.solve.scene)) +
                    "; problems can be studied");
}
