#pragma once

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/scene/scene.h"

namespace wisp {

struct camera_ray {
  vec3 origin;
  vec3 direction;  // unit
};

// The ray of an image point uv (0, 0 is the top left, 1, 1 the bottom right)
// through a point of the lens, uniform over the unit disk. Thin lens focused at
// camera.focus, as in Yocto/GL. Pure, safe to call from any thread.
WISP_API camera_ray eval_camera(const camera_data& camera, const vec2& uv, const vec2& lens);

}  // namespace wisp
