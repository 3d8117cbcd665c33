#pragma once

#include "wisp/pde/section.h"

namespace wisp {

// Whether walks from the centers of balls can serve the points around them.
bool can_share(const pde_problem& problem, const solve_options& options);
solution solve_shared(const pde_problem& problem, const section_grid& grid,
                      const solve_options& options);

}  // namespace wisp
