#pragma once

// What the other commands take from wisp::render. render_component.cpp hands it on; a
// wisp that is built without it has render_component_none.cpp instead, which says so.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "wisp/core/error.h"
#include "wisp/core/report.h"
#include "wisp/scene/scene.h"

inline constexpr bool has_render = WISP_HAS_RENDER;

// The sentence of a wisp without it, for `what` cannot be had.
inline std::string needs_render(const std::string& what) {
  return what +
         " needs the render component; this wisp is built without it (configure with "
         "-DWISP_BUILD_RENDER=ON to have it)";
}

// A scene by its ending, or a bare shape. Throws wisp::file_error.
wisp::scene_data load_any_scene(const std::filesystem::path& path, wisp::warning_list& warnings);
wisp::scene_data load_gltf(const std::filesystem::path& path, wisp::warning_list& warnings);

// What rendering the scene would build and leave out; puts solids in the place of
// sections. Nothing where there is no renderer.
std::vector<wisp::part_report> plan_render(wisp::scene_data& scene);

// The colours of a texture's image, which is read now. `bytes` grows by its pixels, and
// `place` is what in the scene asks for it. Throws wisp::file_error.
using image_lookup = std::function<wisp::vec4(const wisp::vec2&)>;
image_lookup load_image_lookup(wisp::scene_data& scene, int texture, int threads,
                               const std::string& place, std::size_t& bytes);
