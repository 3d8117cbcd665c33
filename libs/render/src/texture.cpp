// Texture lookups.
//
// sRGB: IEC 61966-2-1. Texels are decoded before they are interpolated, so that
// what is mixed is light and not its encoding.

#include <algorithm>
#include <array>
#include <cmath>

#include "wisp/render/image.h"

namespace wisp {

namespace {

// The fifth root of x in (0, 1], by Newton's method: std::pow is not constexpr.
// From above, the iterates fall until rounding stops them.
constexpr double fifth_root(double x) {
  double r = 1;
  for (int i = 0; i < 100; i++) {
    double next = (4 * r + x / (r * r * r * r)) / 5;
    if (!(next < r)) break;
    r = next;
  }
  return r;
}

constexpr std::array<float, 256> make_srgb_table() {
  std::array<float, 256> table = {};
  for (std::size_t i = 0; i < table.size(); i++) {
    double c = static_cast<double>(i) / 255;
    double b = (c + 0.055) / 1.055;
    // b^2.4 = b^2 b^(2/5)
    table[i] = static_cast<float>(c <= 0.04045 ? c / 12.92 : b * b * fifth_root(b * b));
  }
  return table;
}
constexpr std::array<float, 256> srgb_to_linear_table = make_srgb_table();

vec4 decode(const u8vec4& texel, bool as_linear) {
  constexpr float scale = 1.0f / 255;
  if (as_linear) return vec4(texel) * scale;
  return {srgb_to_linear_table[texel.x], srgb_to_linear_table[texel.y],
          srgb_to_linear_table[texel.z], static_cast<float>(texel.w) * scale};
}

// A coordinate brought into [0, 1]. Others than finite ones mean 0.
float wrap_coordinate(float u, bool clamp) {
  if (!std::isfinite(u)) return 0;
  return clamp ? std::clamp(u, 0.0f, 1.0f) : u - std::floor(u);
}

// The two texels on the sides of a coordinate, and how much the second counts.
struct texel_pair {
  int first = 0;
  int second = 0;
  float weight = 0;
};

texel_pair find_texels(float u, int size, bool clamp) {
  float s = wrap_coordinate(u, clamp) * static_cast<float>(size) - 0.5f;
  float floor = std::floor(s);
  int i = std::min(static_cast<int>(floor), size - 1);  // >= -1
  texel_pair pair{i, i + 1, s - floor};
  if (pair.first < 0) pair.first = clamp ? 0 : size - 1;
  if (pair.second >= size) pair.second = clamp ? size - 1 : 0;
  return pair;
}

int find_nearest(float u, int size, bool clamp) {
  return std::min(static_cast<int>(wrap_coordinate(u, clamp) * static_cast<float>(size)), size - 1);
}

}  // namespace

vec4 eval_texture(const texture_data& texture, const vec2& uv, bool as_linear) {
  // A texture without its pixels counts as none.
  int w = texture.width, h = texture.height;
  if (w <= 0 || h <= 0) return {1, 1, 1, 1};
  std::size_t count = static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
  bool is_float = !texture.pixelsf.empty();
  if ((is_float ? texture.pixelsf.size() : texture.pixelsb.size()) < count) return {1, 1, 1, 1};

  auto texel = [&](int i, int j) {
    std::size_t k =
        static_cast<std::size_t>(j) * static_cast<std::size_t>(w) + static_cast<std::size_t>(i);
    return is_float ? texture.pixelsf[k] : decode(texture.pixelsb[k], as_linear);
  };
  if (texture.nearest)
    return texel(find_nearest(uv.x, w, texture.clamp_s), find_nearest(uv.y, h, texture.clamp_t));
  texel_pair s = find_texels(uv.x, w, texture.clamp_s);
  texel_pair t = find_texels(uv.y, h, texture.clamp_t);
  vec4 top = texel(s.first, t.first) * (1 - s.weight) + texel(s.second, t.first) * s.weight;
  vec4 bottom = texel(s.first, t.second) * (1 - s.weight) + texel(s.second, t.second) * s.weight;
  return top * (1 - t.weight) + bottom * t.weight;
}

}  // namespace wisp
