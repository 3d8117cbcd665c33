#pragma once

// From subdivision surfaces to the meshes that rays are traced against. Of one scene,
// tesselate_subdivs is called by one thread, which no other reads beside.

#include <cstdint>

#include "wisp/core/export.h"
#include "wisp/scene/scene.h"

namespace wisp {

// The most faces that tesselate_subdivs makes of one subdiv.
inline constexpr int64_t max_subdiv_faces = 100'000'000;

// Refines each subdiv whose shape an instance uses and replaces that shape's
// contents; where several subdivs name one shape, the last one counts. Positions,
// normals and texture coordinates, which a subdiv indexes apart, become one set
// of vertices. The order of faces and vertices depends on the subdiv alone.
//
// Displacement moves each vertex along its normal by the mean of the texture's
// red, green and blue, minus 1/2 for 8-bit files (which are not decoded from
// sRGB), times subdiv.displacement. The texture must be loaded already.
//
// Throws file_error, with the place subdivs[i], when a subdiv would have more
// than max_subdiv_faces, when a displacement texture is not loaded or meets a
// mesh without texture coordinates, and when an index is out of range.
WISP_API void tesselate_subdivs(scene_data& scene);

// The number of faces of a subdiv after its subdivisions, without making them;
// more than max_subdiv_faces means too many.
WISP_API int64_t count_subdiv_faces(const subdiv_data& subdiv);

}  // namespace wisp
