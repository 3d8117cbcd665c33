#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "wisp/core/error.h"
#include "wisp/core/export.h"
#include "wisp/core/report.h"
#include "wisp/scene/scene.h"

namespace wisp {

class ray_accel;
struct light_sampler;
struct hair_material;

struct prepare_options {
  int threads = 0;       // 0: all
  bool compact = false;  // smaller ray structures, somewhat slower
};

// A scene ready for rays: subdivs refined, the textures that it uses loaded, ray
// structures and light tables built. Each part is built only if the scene
// needs it; `parts` tells. Immutable once made: any number of threads may trace it at once,
// each into a state of its own.
struct render_scene {
  scene_data scene = {};
  std::vector<part_report> parts = {};

  // Internal structures of the renderer.
  std::unique_ptr<ray_accel> accel;
  std::unique_ptr<light_sampler> lights;
  std::vector<hair_material> hair;  // one for each material; empty without hair
  // For each instance how many before it show the same shape; empty where no
  // strand asks for it.
  std::vector<uint32_t> copies;
  bool has_transparency = false;  // some opacity is below 1

  WISP_API render_scene();
  WISP_API ~render_scene();
  WISP_API render_scene(render_scene&&) noexcept;
  WISP_API render_scene& operator=(render_scene&&) noexcept;
};

// Takes the scene over and prepares it. Throws file_error for textures that
// cannot be read, std::invalid_argument for a scene without instances that can
// be seen and without light, std::runtime_error when Embree fails. Threads may prepare
// several scenes at once.
WISP_API render_scene prepare_scene(scene_data&& scene, const prepare_options& options,
                                    warning_list& warnings);

// What prepare_scene would build and why, and what it would leave out; nothing
// is built and no texture is read.
WISP_API std::vector<part_report> plan_parts(const scene_data& scene);

}  // namespace wisp
