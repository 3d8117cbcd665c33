#pragma once

// Walks on spheres, many at once: each step asks for the distances of all of them, so
// that grids and trees answer in batches.

#include <cstdint>
#include <span>
#include <vector>

#include "domain_data.h"
#include "sources.h"
#include "wisp/core/rng.h"
#include "wisp/pde/greens.h"
#include "wisp/pde/solve.h"

namespace wisp {

// What all walks of a solve share.
struct walk_context {
  const pde_problem& problem;
  const solve_options& options;
  const domain_data& domain;
  source_set sources;
  double k = 0;  // sqrt of the screening
  double epsilon = 0;
  bool has_source = false;  // that walks sample
  // Balls are no larger: uniform samples of a large ball would miss what a screened
  // equation sees of the source.
  double max_radius = std::numeric_limits<double>::infinity();
  // The sphere around the boundary, of exterior problems and of interior ones that a
  // walk may leave through a hole.
  double far_radius = 0;

  walk_context(const pde_problem& p, const solve_options& o);
  bool biharmonic() const { return problem.equation == pde_equation::biharmonic; }
  bool exterior() const { return domain.side == domain_side::exterior; }
  // g, with the fields of point sources taken out.
  dvec4 boundary_value(const boundary_point& at) const;
};

// A walk from x, and what it found: an estimate of u(x), of the Laplacian of it where the
// problem is biharmonic, and the number of balls.
struct walk {
  dvec3 x = {0, 0, 0};
  rng_state rng = {};
  // filled by run_walks
  dvec4 u = {0, 0, 0, 0};
  dvec4 laplacian = {0, 0, 0, 0};
  std::uint32_t steps = 0;
  bool unfinished = false;

  // within run_walks
  double weight = 1;            // product of mean value factors
  bool returned = false;        // from beyond the sphere around the boundary
  double held = 0;              // of the biharmonic equation: sum of ball masses, with kernels
  bool only_laplacian = false;  // a walk for the Laplacian at its start
  std::uint32_t parent = none;  // that takes what it finds
  double parent_weight = 0;
  static constexpr std::uint32_t none = ~std::uint32_t{0};
};

// The walks' results do not depend on each other.
void run_walks(const walk_context& context, std::vector<walk>& walks);

}  // namespace wisp
