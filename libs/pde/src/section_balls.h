#pragma once

// The balls whose walks serve the cells of a section, and how many walks each makes.

#include <cstdint>
#include <vector>

#include "ball_kernels.h"
#include "point_walks.h"
#include "wisp/pde/section.h"

namespace wisp {

struct section_ball {
  std::uint32_t center = 0;  // the point
  double radius = 0;
  kernel_ball kernel = {};
  std::size_t walks = 1;  // in a pass
};

struct section_balls {
  std::vector<point_place> places = {};  // of the points
  std::vector<section_ball> balls = {};
  // Those that serve point i are serving[first[i]] .. serving[first[i + 1] - 1].
  std::vector<std::uint32_t> first = {}, serving = {};
};

// Most walks of a ball in a pass.
inline constexpr std::size_t max_block = 512;

section_balls make_balls(const walk_context& context, const section_grid& grid,
                         ball_kernel_type type, int threads);
// Gives each ball its walks in a pass, at the cost of `block` for each.
void share_out(section_balls& balls, const section_grid& grid, std::size_t block);

// Of what the walks of a ball tell of a point in it, y from its center: one over its
// variance, about.
double ball_weight(const section_ball& ball, const dvec3& y);

// Whether screened balls are so small that each cell would have its own.
bool are_small(double k, const section_grid& grid);

}  // namespace wisp
