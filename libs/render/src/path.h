#pragma once

#include "accel.h"
#include "wisp/core/sampler.h"
#include "wisp/render/trace.h"

namespace wisp {

// What the first surface of a path shows, for the auxiliary images.
struct first_hit {
  bool found = false;
  vec3 albedo = {0, 0, 0};
  vec3 normal = {0, 0, 0};
  vec3 tangent = {0, 0, 0};
  float depth = 0;  // along the ray
};

struct path_result {
  vec3 radiance = {0, 0, 0};
  bool covered = false;  // the pixel shows something other than a hidden sky
};

// One path from the camera. `first` may be null. `brightness` is what the picture
// shows on average: samples of lights that could add much less are left to chance.
path_result trace_path(const render_scene& scene, ray3 ray, const sample_state& sampler,
                       const trace_options& options, float brightness, first_hit* first);

}  // namespace wisp
