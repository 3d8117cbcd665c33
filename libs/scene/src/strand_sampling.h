#pragma once

// Strands of any basis as polylines or as Bezier pieces, for formats that hold
// only those.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "wisp/scene/scene.h"

namespace wisp {

// A point on a strand: the weights of four consecutive vertices, of which the
// last ones may be zero and point at no vertex (their index is then `first`).
struct strand_sample {
  std::array<uint32_t, 4> vertex = {};
  std::array<float, 4> weight = {};
};

template <typename T>
T blend(std::span<const T> values, const strand_sample& s) {
  T sum = values[s.vertex[0]] * s.weight[0];
  for (std::size_t i = 1; i < 4; ++i) {
    if (s.weight[i] != 0) sum += values[s.vertex[i]] * s.weight[i];
  }
  return sum;
}

// Points of strand k that make a faithful polyline: its own vertices for the
// linear basis, otherwise `per_piece` points on each piece and the end. Empty
// when the number of vertices does not fit the basis.
std::vector<strand_sample> sample_strand(const shape_data& shape, std::size_t k,
                                         uint32_t per_piece);

// The cubic Bezier control points, xyz and radius, of each piece of strand k;
// neighbours share ends bit by bit. Radius 0 where the shape has none.
std::vector<std::array<vec4, 4>> bezier_pieces(const shape_data& shape, std::size_t k);

}  // namespace wisp
