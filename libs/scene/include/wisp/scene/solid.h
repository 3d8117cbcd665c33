#pragma once

// Solids of a scene as signed distances, docs/scene-format.md. Any number of threads may
// call these at once on one scene, each with warnings and parts of its own.

#include <cstddef>

#include "wisp/core/error.h"
#include "wisp/core/export.h"
#include "wisp/geometry/bounds.h"
#include "wisp/geometry/sdf.h"
#include "wisp/scene/scene.h"

namespace wisp {

// What was built for the meshes of solids.
struct solid_parts {
  std::size_t meshes = 0, open_meshes = 0;
  std::size_t tree_bytes = 0, winding_bytes = 0;
};

// The signed distance of a solid, in its own coordinates. The distance trees and
// inside tests of its meshes are built by this call, on `threads` threads (0: all), and
// added to `parts`; the scene is not needed afterwards. Warns of open meshes. Throws
// std::invalid_argument for a solid that is not one: an operand that does not come
// before, a mesh without faces, a parameter out of range.
WISP_API sdf make_sdf(const scene_data& scene, const solid_data& solid, int threads,
                      warning_list& warnings, solid_parts* parts = nullptr);

// A box that holds the solid, without building anything; infinite for a solid that
// is. Throws as make_sdf.
WISP_API dbox3 solid_bounds(const scene_data& scene, const solid_data& solid);

// The surface of a solid as triangles, at the solid's resolution. Throws
// std::invalid_argument for a solid that is infinite or empty.
WISP_API shape_data tesselate_solid(const solid_data& solid, const sdf& surface, int threads);

}  // namespace wisp
