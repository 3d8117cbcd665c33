#pragma once

// Rays against solids by sphere tracing (Hart 1996), with over-relaxed steps that are
// taken back where the balls of two steps do not meet (Keinert et al., Enhanced Sphere
// Tracing, 2014), as long as the distances so far make likely that they do (Ban and
// Valasek, Automatic Step Size Relaxation in Sphere Tracing, 2023).

#include <limits>
#include <optional>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/sdf.h"

namespace wisp {

// Distances along the ray are in units of |direction|.
struct sdf_ray {
  dvec3 origin = {0, 0, 0};
  dvec3 direction = {0, 0, 1};  // not zero
};

struct trace_options {
  double t_min = 0;
  double t_max = std::numeric_limits<double>::infinity();
  // A hit is where the surface is nearer than tolerance times the size of the solid
  // (of its box, and the distance of the ray's origin), or than cone times the
  // distance travelled: the radius of a pixel's cone at a distance of 1, for
  // pictures that need no more.
  double tolerance = 1e-9;
  double cone = 0;
  double relaxation = 0.3;  // weight of the last step in what is expected, [0, 1); 0: none
  int max_steps = 4096;
};

enum struct trace_end { hit, miss, step_limit };

struct trace_hit {
  double t = 0;
  dvec3 point = {0, 0, 0};
  dvec3 normal = {0, 0, 0};  // outward, unit
  bool from_inside = false;  // the ray met the surface from within the solid
  int plane = -1;            // the cut plane that was hit, if it was one
};

struct trace_result {
  trace_end end = trace_end::miss;
  trace_hit at = {};  // of a hit
  int steps = 0;
};

// The first point of the ray on the surface of the solid, entering or leaving it. A ray
// that starts on the surface, within the tolerance, leaves it first. A ray along the
// surface nearer than the tolerance hits. Throws std::invalid_argument for options out
// of range; a ray that is not finite, or without direction, misses.
WISP_API trace_result sphere_trace(const sdf& solid, const sdf_ray& ray,
                                   const trace_options& options = {});

// What lies in front of a plane is cut away: the solid is seen cut open.
struct cut_plane {
  dvec3 point = {0, 0, 0};
  dvec3 normal = {0, 0, 1};  // towards what is cut away; any length
};
WISP_API trace_result sphere_trace(const sdf& solid, std::span<const cut_plane> cuts,
                                   const sdf_ray& ray, const trace_options& options = {});

}  // namespace wisp
