#pragma once

// Rays against solids by sphere tracing (Hart 1996), with over-relaxed steps that are
// taken back where the balls of two steps do not meet (Keinert et al., Enhanced Sphere
// Tracing, 2014), as long as the distances so far make likely that they do (Ban and
// Valasek, Automatic Step Size Relaxation in Sphere Tracing, 2023). Any number of threads
// may trace one solid at once.

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

struct sphere_trace_options {
  double t_min = 0;
  double t_max = std::numeric_limits<double>::infinity();
  // The surface is met where it is nearer than tolerance times the size of the solid
  // (the longest side of its box; of an infinite one, 1e-3 times the distance
  // travelled), than rounding of the coordinates, or than cone times the distance
  // travelled: the radius of a pixel's cone at a distance of 1, for pictures that need
  // no more. With cone 0, where the ray crosses the surface is then found to 1e-13 of
  // the size, or to rounding.
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
  trace_hit at = {};  // of a hit; t and point also of the step limit: free so far
  int steps = 0;      // evaluations, about
};

// The first point of the ray on the surface of the solid, entering or leaving it. A ray
// that starts on the surface, within the tolerance, leaves it first. A ray that touches
// the surface and stays on its side goes on, unless it is nearer than the tolerance for
// a thousand tolerances: then it hits. What is thinner than a few tolerances may be
// missed. Throws std::invalid_argument for options out of
// range; a ray that is not finite, or without direction, misses.
WISP_API trace_result sphere_trace(const sdf& solid, const sdf_ray& ray,
                                   const sphere_trace_options& options = {});

// What lies in front of a plane is cut away: the solid is seen cut open. Planes are met
// where they are, without steps; a ray that starts on one, within the tolerance, starts
// on the side that it goes to.
struct cut_plane {
  dvec3 point = {0, 0, 0};
  dvec3 normal = {0, 0, 1};  // towards what is cut away; any length
};
WISP_API trace_result sphere_trace(const sdf& solid, std::span<const cut_plane> cuts,
                                   const sdf_ray& ray, const sphere_trace_options& options = {});

}  // namespace wisp
