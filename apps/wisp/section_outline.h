#pragma once

#include <vector>

#include "wisp/pde/section.h"

// For each cell of a grid the signed distance of its center from the boundary of the
// domain, positive inside, in scene units: right where it is below two cells, elsewhere
// two cells with its sign. What section_image::distance takes.
std::vector<double> section_distances(const wisp::pde_domain& domain,
                                      const wisp::section_grid& grid, int threads = 0);
