#pragma once

#include "wisp/pde/section.h"

namespace wisp {

// Whether walks from the centers of balls can serve the points around them, and balls are
// not so small that each cell would have its own.
bool can_share(const pde_problem& problem, const section_grid& grid, const solve_options& options);
solution solve_shared(const pde_problem& problem, const section_grid& grid,
                      const solve_options& options);

}  // namespace wisp
