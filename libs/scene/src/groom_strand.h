#pragma once

// The growth of single strands: where a fibre of a given length falls under
// gravity over a surface, and what curls, wander and frizz add to it.

#include <cstdint>
#include <span>
#include <vector>

#include "groom_surface.h"
#include "wisp/core/rng.h"

namespace wisp {

// What sets a strand apart, all from (seed, strand).
struct strand_traits {
  groom_root root = {};
  float length = 0;
  float layer = 0;  // [0, 1] height within the coat
  float clump = 0;  // [0, 1] how far it follows its guide
  float turns = 0;  // of its curl
  float curl_radius = 0;
  float phase = 0;         // of its curl, radians
  float jitter_angle = 0;  // of its first direction, radians
  float jitter_turn = 0;
  float frizz = 0;          // amplitude, scene units
  uint32_t clump_seed = 0;  // wander that the clump shares
  uint32_t own_seed = 0;
};

// Points at equal arc lengths, the root first.
using strand_path = std::vector<vec3>;

// Simulates a strand of `length` in `steps` steps: it leaves its root between
// comb and normal, turns towards `down` and slides over the surface.
strand_path grow_path(const groom_surface& surface, const groom_params& params,
                      const strand_traits& traits, float length, int steps);

// The strand's path drawn towards its guide's, with the same arc length as
// before and outside the surface. guide_step is the arc length of a step of
// `guide`.
strand_path follow_guide(const groom_surface& surface, const groom_params& params,
                         const strand_traits& traits, const strand_path& own,
                         const strand_path& guide, float guide_step);

// Adds curl, noise and frizz to the points of a path, `stride` of its steps
// apart, and pushes the result out of the surface. `reference` orients the curl.
strand_path add_detail(const groom_surface& surface, const groom_params& params,
                       const strand_traits& traits, const strand_path& path, int stride,
                       const vec3& reference);

// Control points of the uniform cubic B-spline that runs through the points,
// from the first to the last one, with no curvature at its ends.
std::vector<vec3> interpolate_bspline(std::span<const vec3> points);

}  // namespace wisp
