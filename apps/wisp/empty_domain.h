#pragma once

// Domains that have no inside at all.

#include <span>

#include "wisp/core/math.h"
#include "wisp/pde/domain.h"
#include "wisp/pde/solve.h"

// Whether a point of the solution was inside of the domain.
bool has_inside(const wisp::solution& solution);

// Whether the triangles lie in one plane, up to rounding, and so have no inside.
bool is_flat(std::span<const wisp::ivec3> triangles, std::span<const wisp::vec3> positions);

// Whether it is proved that nothing is in the domain: balls that hold no boundary and are
// outside cover its bounds. False where that cannot be shown with some 100,000 balls, as
// for meshes, and for exterior domains.
bool is_surely_empty(const wisp::pde_domain& domain);
