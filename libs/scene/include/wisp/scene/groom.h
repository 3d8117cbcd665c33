#pragma once

#include <cstdint>
#include <optional>

#include "wisp/core/error.h"
#include "wisp/core/export.h"
#include "wisp/scene/scene.h"

namespace wisp {

// Grows strands of hair on the faces of a mesh. Lengths are in scene units.
struct groom_params {
  int strands = 10000;               // number of strands, >= 1
  int points = 16;                   // control points of each, 4 to 4096
  vec2 length = {0.2f, 0.3f};        // shortest and longest, > 0, of the strand without its curl
  vec2 radius = {0.0004f, 0.0001f};  // at root and tip
  float taper = 1;                   // 1: radius falls linearly; > 1: stays thick longer
  float curl_radius = 0;             // of the helix around the strand
  float curl_turns = 0;              // full turns over a strand, at most (points - 3) / 2.5
  float curl_randomness = 0.3f;      // [0, 1] of phase, pitch and radius; near 0 neighbours wave
                                     // together, near 1 each clump has its own curls
  float clump = 0;                   // [0, 1] how far strands follow their clump's guide
  float clump_size = 0;              // distance between guides; 0: from strands (about 40 each)
  float gravity = 0;                 // [0, ...) bend of a strand towards `down`; 1 is limp
  vec3 down = {0, -1, 0};            // need not have unit length
  float noise = 0;                   // amplitude of slow wander at the tip
  float frizz = 0;                   // amplitude of fast wander; a few strands have much more
  float lift = 0.6f;                 // [0, 1] 1: leave along the normal; 0: lie on the surface
  vec3 comb = {0, 0, 0};             // direction to lie towards, zero for none
  std::optional<vec4> part = {};     // a parting, the plane xyz . p = w: strands that do not grow
                                     // on a slope too steep lie away from it
  float volume = 0;                  // thickness of the coat: strands rest up to this far above
                                     // the surface instead of on it

  // Where hair grows: roots that pass all of these.
  vec3 region_min = {-infinity, -infinity, -infinity};
  vec3 region_max = {infinity, infinity, infinity};
  std::optional<vec4> density_axis = {};  // xyz direction, w cosine: only where n . xyz >= w
  std::optional<vec4> region_plane = {};  // only on the side xyz . p >= w, a hairline
  float region_fade = 0;                  // distance behind region_plane over which hair gets
                                          // as dense and as long as elsewhere

  uint32_t seed = 0;
  int threads = 0;  // 0: all of the machine's; the result does not depend on it
};

// Strands with area-weighted roots as uniform cubic B-splines, with `radius`,
// `texcoords` (of the root, where the mesh has them) and no normals. Each curve
// begins at its root on the surface and ends at its tip: the first and the last
// control points are phantoms. Deterministic for params.seed at any thread
// count. Strands do not enter the mesh: points below its surface near the
// root are pushed out, which wants a mesh whose faces point outwards. Time is
// O(strands points log faces). Throws std::invalid_argument for a mesh without
// faces of positive area in the region or parameters out of range, naming the
// parameter. Safe to call from any thread.
WISP_API shape_data grow_groom(const shape_data& mesh, const groom_params& params);

}  // namespace wisp
