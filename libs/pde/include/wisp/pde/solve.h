#pragma once

// Solutions of boundary value problems at points, by walks on spheres (Muller 1956;
// Sawhney and Crane, Monte Carlo Geometry Processing, 2020).

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/pde/problem.h"

namespace wisp {

// How points of a ball are drawn for the source: in proportion to the Green's function
// of the equation, or uniformly.
enum struct source_sampling { greens, uniform };

// Point sources: by the Green's function of each ball that holds them, or by taking
// their field in free space out of the problem and adding it at the end. The second has
// less variance, next to a source by far.
enum struct point_source_estimator { fundamental, balls };

// The biharmonic equation (see docs/pde.md): lap u at a sample of each ball by walks of
// its own; by the walk itself, from the sample to the walk's next point with the Poisson
// kernel; or in closed form, without samples.
enum struct biharmonic_estimator { one_walk, tree, nested };

// How walks outside of a bounded boundary come back: from wherever they are in one jump
// to a sphere around it, or never; or by steps, ending with a probability.
enum struct exterior_estimator { sphere, roulette };

// The directions of the first steps: one at random for each walk; in opposite pairs; or
// in blocks of 16 that fill the sphere evenly. A number of walks that is no multiple of
// 16 is done in pairs, an odd one at random.
enum struct first_directions { independent, antithetic, stratified };

struct solve_options {
  std::uint64_t walks = 64;  // for each point, > 0; what a budget below leaves of them
  // Width of the shell at the boundary in which walks end, > 0; 0: 1e-4 of the size of
  // the domain.
  double epsilon = 0;
  int max_steps = 1024;  // > 0. Walks that come so far are counted as unfinished
  bool gradient = false;
  std::uint64_t seed = 0;
  int threads = 0;  // 0: all

  // Budgets. With an error, walks go on until the standard error of each point and
  // channel is below it; with a time, until that many seconds have gone by. Either lets
  // points with a larger error have more walks, at least `walks` / 4 each, and lifts
  // `walks` to max_walks, which none exceeds.
  double error = 0;
  double seconds = std::numeric_limits<double>::infinity();
  std::uint64_t max_walks = std::uint64_t{1} << 40;  // > 0

  source_sampling sampling = source_sampling::greens;
  point_source_estimator point_sources = point_source_estimator::fundamental;
  biharmonic_estimator biharmonic = biharmonic_estimator::one_walk;
  int nested_walks = 1;  // for each sample, of the nested estimator
  exterior_estimator exterior = exterior_estimator::sphere;
  // Of the roulette: a walk farther than roulette_radius times the radius of the sphere
  // around the boundary goes on with this probability.
  double roulette_continue = 0.95, roulette_radius = 2;
  first_directions directions = first_directions::antithetic;
  // Take the running estimates of value and gradient out of each walk's estimate.
  bool control_variates = true;
  // A ball may be smaller than the largest by this factor, where that is cheaper.
  double tolerance = 0.3;  // in (0, 1)

  // Called between rounds from the calling thread, with walks done and planned (0: not
  // known) and the root mean square of standard errors; false stops.
  struct progress {
    std::uint64_t walks = 0, planned = 0;
    double error = 0;
    double seconds = 0;
  };
  std::function<bool(const progress&)> on_progress = {};
};

enum struct point_status {
  ok,
  boundary,  // on it: values are those of the boundary, without a walk
  outside,   // of the domain, or not finite; walks is 0 and values are NaN
  singular,  // at a point source, where u is infinite; the same
  undefined  // data there, or that a walk met, is not a finite number; values are NaN
};

// Channels beyond those of the problem are 0.
struct estimate {
  point_status status = point_status::ok;
  dvec4 mean = dvec4{std::numeric_limits<double>::quiet_NaN()};
  // Of the mean, from the spread of the walks that were made; NaN where they are a single
  // one, pair or block of 16, which has no spread.
  dvec4 standard_error = dvec4{std::numeric_limits<double>::quiet_NaN()};
  std::uint64_t walks = 0;
  double mean_steps = 0;         // of a walk
  std::uint64_t unfinished = 0;  // of the walks: step limit met, or lost
};

// Of each channel, in units of u over those of length; NaN where `status` is not ok.
struct gradient_estimate {
  std::array<dvec3, max_channels> mean = {};
  std::array<dvec3, max_channels> standard_error = {};
};

struct solution {
  std::vector<estimate> values = {};                   // one for each point
  std::vector<gradient_estimate> gradients = {};       // the same, or none
  std::uint64_t walks = 0, steps = 0, unfinished = 0;  // in all
  double seconds = 0;                                  // that it took
  bool stopped = false;                                // by on_progress
};

// Estimates u, and its gradient if asked for, at each of `points`. The same numbers for
// a seed at any number of threads, but with a budget of time. Memory does not grow with
// walks. Throws std::invalid_argument for a problem or options that are not valid, and
// what a function of the problem throws. Calls from several threads do not disturb each
// other, on one problem or on several.
WISP_API solution solve(const pde_problem& problem, std::span<const dvec3> points,
                        const solve_options& options = {});

}  // namespace wisp
