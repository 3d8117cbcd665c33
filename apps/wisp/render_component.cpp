#include "render_component.h"

#include <memory>

#include "section_render.h"
#include "wisp/render/gltf.h"
#include "wisp/render/image.h"
#include "wisp/render/render_scene.h"

wisp::scene_data load_any_scene(const std::filesystem::path& path, wisp::warning_list& warnings) {
  return wisp::load_scene(path, warnings);
}

wisp::scene_data load_gltf(const std::filesystem::path& path, wisp::warning_list& warnings) {
  return wisp::load_gltf_scene(path, warnings);
}

std::vector<wisp::part_report> plan_render(wisp::scene_data& scene) {
  std::vector<wisp::part_report> sections;
  plan_sections(scene, sections);  // before the rest, as it changes the scene
  auto parts = wisp::plan_parts(scene);
  parts.insert(parts.end(), sections.begin(), sections.end());
  return parts;
}

image_lookup load_image_lookup(wisp::scene_data& scene, int texture, int threads,
                               const std::string&, std::size_t& bytes) {
  const auto index = static_cast<std::size_t>(texture);
  std::vector<bool> used(scene.textures.size(), false);
  used[index] = true;
  bytes += wisp::load_textures(scene, used, threads);
  const auto image = std::make_shared<const wisp::texture_data>(scene.textures[index]);
  return [image](const wisp::vec2& uv) { return wisp::eval_texture(*image, uv, false); };
}
