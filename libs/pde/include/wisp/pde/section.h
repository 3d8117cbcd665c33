#pragma once

// Planes cut through a domain, and solutions on a grid over them. Any number of threads
// may call these at once, on one domain, problem and grid or on several.

#include <cstdint>
#include <span>
#include <vector>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/pde/problem.h"
#include "wisp/pde/solve.h"

namespace wisp {

struct section_plane {
  dvec3 origin = {0, 0, 0};
  dvec3 normal = {0, 0, 1};  // towards the viewer; any length
  dvec3 up = {0, 0, 0};      // upwards in pictures; zero: y, or -z for a normal along y
  // Width and height around the origin; 0: what holds the part of the domain's bounds
  // in the plane, grown by half for exterior domains.
  dvec2 size = {0, 0};
  int resolution = 256;  // cells along the longer side, 2 to 16384
};

// Cells of a plane, row by row from the top left as a picture's; what is asked for are
// their centers.
struct section_grid {
  int width = 0, height = 0;
  dvec3 corner = {0, 0, 0};                    // top left
  dvec3 right = {1, 0, 0}, down = {0, -1, 0};  // of unit length
  dvec3 normal = {0, 0, 1};
  double cell = 1;                        // side of a cell
  std::vector<dvec3> points = {};         // centers of cells in the domain
  std::vector<std::uint32_t> cells = {};  // their places, row * width + column
};
inline dvec3 cell_center(const section_grid& g, int x, int y) {
  return g.corner + g.cell * ((x + 0.5) * g.right + (y + 0.5) * g.down);
}

// Throws std::invalid_argument for a plane that is not one, an infinite domain without a
// size, a section that misses the domain, and one so large or far away, in sizes of the
// domain, or so small, that places on it cannot be told apart in double precision.
WISP_API section_grid make_section_grid(const pde_domain& domain, const section_plane& plane,
                                        int threads = 0);

struct section_options {
  solve_options solve = {};
  // Walks from the centers of balls serve all cells within them (see docs/pde.md): the
  // solution in a ball follows from its values on the sphere by the Poisson kernel. Balls
  // make four times `walks`, 32 at least, at an average by cost: more where they serve
  // many cells or lie far from the boundary, half of that at least. All together are
  // still a fraction of what cells would need by themselves.
  // Unbiased; the errors of neighbours are not independent. Off: walks of its own for
  // each cell, as solve() does. Gradients, and the biharmonic equation by tree or nested
  // walks, have walks of their own in any case.
  bool share = true;
};

// A solution at the points of a grid, in their order. With shared walks, `walks` of an
// estimate are those of the balls that serve it. Throws what solve() does, and
// std::invalid_argument for a grid that make_section_grid would not make.
WISP_API solution solve_section(const pde_problem& problem, const section_grid& grid,
                                const section_options& options = {});

}  // namespace wisp
