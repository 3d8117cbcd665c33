#pragma once

// Walks from given points: the first ball of each, what the rest of the walk tells about
// the sphere around it, and sums over walks.

#include <cstdint>
#include <vector>

#include "tally.h"
#include "walker.h"

namespace wisp {

// Throws std::invalid_argument for options that are not valid.
void check_options(const solve_options& options);

// Where a point lies, and the ball around it.
struct point_place {
  point_status status = point_status::ok;
  double radius = 0;
  dvec4 value = {0, 0, 0, 0};  // of a point on the boundary
};
point_place place_point(const walk_context& context, const dvec3& p);

struct walk_sums {
  tally<dvec4> value = {};  // of blocks of walks
  std::uint64_t walks = 0, steps = 0, unfinished = 0, undefined = 0;
  sphere_moments seen = {};     // of u on the sphere, summed
  sphere_moments learned = {};  // the mean of that, as of the last round

  void merge(const walk_sums& b);
  void learn();
};

struct gradient_sums {
  std::array<tally<dvec3>, max_channels> channel = {};
  sphere_moments seen = {}, learned = {};  // of what the gradient is the first moment of

  void merge(const gradient_sums& b);
  void learn();
};

// Walks `first` .. `first` + count - 1 of a point.
struct walk_run {
  std::size_t point = 0;
  std::uint64_t first = 0, count = 0;
};
using walk_chunk = std::vector<walk_run>;

// What a run starts from and what comes of it.
struct chunk_sums {
  dvec3 at = {0, 0, 0};
  point_place place = {};
  sphere_moments learned = {}, learned_slope = {};
  walk_sums sums = {};
  gradient_sums gradient = {};
};

// Walks in blocks of 1, 2 (opposite first directions) or 16 (evenly spread ones).
void walk_from_points(const walk_context& context, const walk_chunk& chunk, int block,
                      std::vector<chunk_sums>& sums);

// `count` directions, each uniform on the sphere: one, a pair of opposite ones, or a
// lattice turned at random.
void block_directions(rng_state& rng, std::span<dvec3> directions);

}  // namespace wisp
