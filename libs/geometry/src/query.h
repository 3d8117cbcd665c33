#pragma once

// What the vector code of closest_point.cpp and the code around it share.
//
// Bounds in single precision: a distance that is computed in normalized coordinates
// for a point p with |p| <= far_from differs from the true one by less than
// margin(p), leaves' slack apart. `reach` is a distance within which the closest
// element is sure to be found: what is computed to be farther than reach can be left
// out.

#include <array>
#include <cstdint>

#include "bvh_data.h"
#include "wisp/geometry/closest_point.h"

namespace wisp {

// Points farther from the center than this (in half sizes of the tree) are queried
// in double.
inline constexpr float far_from = 8;

// A node or leaf that waits to be opened, at least so far away. A wide tree is no
// deeper than a binary one, of at most 40 levels of splits and 32 of halves; each
// level leaves seven behind.
struct waiting {
  uint32_t child;
  float distance2;
};
inline constexpr std::size_t stack_size = bvh_width + (bvh_width - 1) * 72 + bvh_width;

struct query_stack {
  std::size_t top;
  uint32_t child[stack_size];
  float distance2[stack_size];

  void start() {
    child[0] = 0;
    distance2[0] = 0;
    top = 1;
  }
  waiting pop() {
    --top;
    return {child[top], distance2[top]};
  }
};

// An element that may be the closest, by its slot.
struct candidate {
  uint32_t slot;
  float distance2, slack;
};

struct nearest_query {
  const bvh_data* data;
  vec3 p;        // normalized
  float shrink;  // 1 - tolerance
  float margin;
  float reach;
  float surely;          // what is found nearer than this is within max_distance
  float limit2;          // of what has to be opened
  float least_left_out;  // of the nodes that the tolerance left out, squared

  // Candidates that come to be too many are looked at in between, by whoever asked.
  static constexpr std::size_t room = 64;
  std::array<candidate, room> candidates;
  std::size_t count;
  void (*look_at)(nearest_query& q);
  void* best;
  void* user;

  query_stack stack;
};

struct bounds_query {
  const bvh_data* data;
  vec3 p;
  float shrink2;
  float limit2, upper2, least_left_out;
  uint32_t index;
  query_stack stack;
};

// Queries of a batch take turns: while one waits for memory or for a result, the
// others go on.
inline constexpr std::size_t query_turns = 3;
template <typename Query>
struct query_source {
  void* user;
  bool (*next)(void* user, Query& q);  // starts the next one, if there is one
  void (*done)(void* user, const Query& q);
};

// The vector code, by the processor: closest_point-inl.h says what each does.
void run_nearest(nearest_query& q);
void run_bounds(bounds_query& q);
int run_any(nearest_query& q, float surely);
void run_all_nearest(const query_source<nearest_query>& source, bool with_tolerance);
void run_all_bounds(const query_source<bounds_query>& source);

inline float margin_of(const vec3& p) {
  const float size = std::max({1.0f, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  return 32 * bvh_ulp * size;
}

}  // namespace wisp
