#pragma once

// What a bvh is made of. Coordinates of nodes and leaves are normalized:
// (x - center) * scale, so that all lie in [-1, 1], rounded to float.

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "wisp/core/math.h"
#include "wisp/geometry/bvh.h"

namespace wisp {

inline constexpr int bvh_width = 8;

// Of what a float in a normalized coordinate may be wrong by rounding.
inline constexpr float bvh_ulp = 0x1p-24f;

// Where a child is: nothing, a leaf, or a node.
inline constexpr uint32_t bvh_no_child = 0xffffffffu;
inline constexpr uint32_t bvh_leaf_bit = 0x80000000u;

// The bounds of eight children: what a child holds lies in its box, and in its flat
// cylinder around the box's centre c: z = n.(x - c) in [z_min, z_max] and
// |x - c - z n| <= radius. n is a unit vector, or zero where no cylinder was worth
// it (z_min <= 0 <= z_max; radius the box's). A child that is not there has a box
// that is far away from everything.
struct alignas(32) bvh_node {
  float min[3][bvh_width];
  float max[3][bvh_width];
  float normal[3][bvh_width];
  float z_min[bvh_width];
  float z_max[bvh_width];
  float radius[bvh_width];
  uint32_t child[bvh_width];
};

// Eight elements as triangles: a vertex and the two edges from it, counter-clockwise
// as given, turned so that the longest edge lies opposite of a. Segments and points
// have edges of no length. Lanes behind the last repeat it.
struct alignas(32) bvh_leaf {
  float a[3][bvh_width];
  float ab[3][bvh_width];
  float ac[3][bvh_width];
  uint32_t first;  // its elements have the slots first to first + count - 1
  uint32_t count;
  // What a squared distance in single precision may have taken too far, as a
  // length: small but for slivers.
  float slack;
};

struct bvh_data {
  bvh_element element = bvh_element::triangle;
  std::size_t left_out = 0;

  // Elements in the order of the leaves, and their vertices in the order of first
  // use, so that what is close in space is close in memory. Slots are indices here.
  std::vector<ivec3> triangles = {};  // of segments and points: vertices repeat
  std::vector<dvec3> positions = {};
  std::vector<vec3> single_positions = {};  // in their place, where all are floats
  std::vector<uint32_t> elements = {};      // what element a slot was given as
  std::vector<uint32_t> vertices = {};      // and what vertex a position
  std::size_t vertex_count = 0;             // of those given

  dvec3 min = dvec3{std::numeric_limits<double>::infinity()};
  dvec3 max = -min;
  dvec3 center = {0, 0, 0};
  double scale = 1;  // a power of two
  double unit = 1;   // 1 / scale

  std::vector<bvh_node> nodes = {};  // the first is the root; parents before children
  std::vector<bvh_leaf> leaves = {};

  dvec3 position(std::size_t i) const {
    return single_positions.empty() ? positions[i] : dvec3(single_positions[i]);
  }
  std::size_t position_count() const { return positions.size() + single_positions.size(); }
  // Moves positions that are floats to single_positions.
  void compact_positions();

  std::array<dvec3, 3> corners(uint32_t slot) const {
    const ivec3& t = triangles[slot];
    return {position(static_cast<std::size_t>(t.x)), position(static_cast<std::size_t>(t.y)),
            position(static_cast<std::size_t>(t.z))};
  }
  dvec3 normalized(const dvec3& p) const { return (p - center) * scale; }
};

// Fills leaves and the bounds of nodes from positions, triangles and the links of
// the nodes.
void fit_bvh(bvh_data& data, int threads);

}  // namespace wisp
