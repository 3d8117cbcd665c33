// Uniform cubic B-splines and Catmull-Rom splines in Bezier form: Farin,
// Curves and Surfaces for CAGD, 5th edition, chapters 8 and 9.

#include "strand_sampling.h"

namespace wisp {

namespace {

// Weights of the four control points of a piece at parameter u in [0, 1].
std::array<float, 4> basis_weights(curve_basis basis, float u) {
  const float v = 1 - u, u2 = u * u, u3 = u2 * u;
  switch (basis) {
    case curve_basis::bezier:
      return {v * v * v, 3 * v * v * u, 3 * v * u2, u3};
    case curve_basis::bspline:
      return {v * v * v / 6, (3 * u3 - 6 * u2 + 4) / 6, (-3 * u3 + 3 * u2 + 3 * u + 1) / 6, u3 / 6};
    case curve_basis::catmull_rom:
      return {(-u3 + 2 * u2 - u) / 2, (3 * u3 - 5 * u2 + 2) / 2, (-3 * u3 + 4 * u2 + u) / 2,
              (u3 - u2) / 2};
    default:
      return {v, u, 0, 0};
  }
}

vec4 control_point(const shape_data& shape, std::size_t i) {
  return vec4(shape.positions[i], shape.radius.empty() ? 0.0f : shape.radius[i]);
}

std::array<vec4, 4> to_bezier(curve_basis basis, const std::array<vec4, 4>& p) {
  switch (basis) {
    case curve_basis::bspline:
      return {(p[0] + 4.0f * p[1] + p[2]) / 6.0f, (2.0f * p[1] + p[2]) / 3.0f,
              (p[1] + 2.0f * p[2]) / 3.0f, (p[1] + 4.0f * p[2] + p[3]) / 6.0f};
    case curve_basis::catmull_rom:
      return {p[1], p[1] + (p[2] - p[0]) / 6.0f, p[2] - (p[3] - p[1]) / 6.0f, p[2]};
    case curve_basis::bezier:
      return p;
    default:
      return {p[0], (2.0f * p[0] + p[1]) / 3.0f, (p[0] + 2.0f * p[1]) / 3.0f, p[1]};
  }
}

}  // namespace

std::vector<strand_sample> sample_strand(const shape_data& shape, std::size_t k,
                                         uint32_t per_piece) {
  const uint32_t begin = shape.strands[k], count = shape.strands[k + 1] - begin;
  const uint32_t pieces = segment_count(shape.basis, count);
  std::vector<strand_sample> samples;
  if (pieces == 0) return samples;
  if (shape.basis == curve_basis::linear) {
    for (uint32_t i = 0; i < count; ++i) {
      samples.push_back({{begin + i, begin + i, begin + i, begin + i}, {1, 0, 0, 0}});
    }
    return samples;
  }
  const uint32_t step = shape.basis == curve_basis::bezier ? 3 : 1;
  for (uint32_t piece = 0; piece < pieces; ++piece) {
    const uint32_t first = begin + piece * step;
    // the end of a piece is the beginning of the next one
    const uint32_t last = piece + 1 == pieces ? per_piece : per_piece - 1;
    for (uint32_t i = 0; i <= last; ++i) {
      const float u = static_cast<float>(i) / static_cast<float>(per_piece);
      samples.push_back({{first, first + 1, first + 2, first + 3}, basis_weights(shape.basis, u)});
    }
  }
  return samples;
}

std::vector<std::array<vec4, 4>> bezier_pieces(const shape_data& shape, std::size_t k) {
  const uint32_t begin = shape.strands[k], count = shape.strands[k + 1] - begin;
  const uint32_t pieces = segment_count(shape.basis, count);
  const uint32_t step = shape.basis == curve_basis::bezier ? 3 : 1;
  const uint32_t order = shape.basis == curve_basis::linear ? 2 : 4;
  std::vector<std::array<vec4, 4>> result;
  result.reserve(pieces);
  for (uint32_t piece = 0; piece < pieces; ++piece) {
    std::array<vec4, 4> p = {};
    for (uint32_t i = 0; i < order; ++i) {
      p[i] = control_point(shape, begin + piece * step + i);
    }
    result.push_back(to_bezier(shape.basis, p));
  }
  // The two formulas for a joint round differently; one of them wins.
  for (std::size_t i = 1; i < result.size(); ++i) result[i][0] = result[i - 1][3];
  return result;
}

}  // namespace wisp
