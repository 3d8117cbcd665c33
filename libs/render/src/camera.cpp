#include "wisp/render/camera.h"

namespace wisp {

camera_ray eval_camera(const camera_data& camera, const vec2& uv, const vec2& lens) {
  vec2 film = camera.aspect >= 1 ? vec2{camera.film, camera.film / camera.aspect}
                                 : vec2{camera.film * camera.aspect, camera.film};
  vec2 offset = {film.x * (uv.x - 0.5f), film.y * (0.5f - uv.y)};  // right and up
  vec3 origin, target;
  vec2 on_lens = lens * (camera.aperture / 2);
  if (camera.orthographic) {
    // The film, enlarged so that a lens of 1 shows `film` units.
    offset /= camera.lens;
    origin = vec3(offset + on_lens, 0);
    target = vec3(offset, -camera.focus);
  } else {
    origin = vec3(on_lens, 0);
    target = vec3(offset.x, offset.y, -camera.lens) * (camera.focus / camera.lens);
  }
  // normalize_or_zero: a focus or a lens at the ends of float's range has no direction.
  return {transform_point(camera.frame, origin),
          normalize_or_zero(transform_vector(camera.frame, target - origin))};
}

}  // namespace wisp
