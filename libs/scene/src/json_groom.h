#pragma once

#include "json_scene.h"

namespace wisp {

// Reads the "groom" object at `place`; `radius` is that of the shape, for a
// groom without one. `on` becomes the index of the shape that hair grows on.
groom_params read_groom(const json_tree& tree, const std::string& place,
                        const json_scene_file& file, const std::optional<vec2>& radius,
                        groom_ground& on);

// Grows the groom of `source`; what grow_groom finds wrong becomes a file_error.
shape_data grow_shape(const json_context& context, const json_shape& source,
                      const shape_data& mesh);

}  // namespace wisp
