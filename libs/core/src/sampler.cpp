#include "wisp/core/sampler.h"

#include <array>

namespace wisp {

namespace {

constexpr uint32_t reverse_bits(uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  return (x >> 16) | (x << 16);
}

// Sobol numbers of dimensions 1 to 3 (Joe and Kuo 2008: degrees 1, 2, 3), for
// each byte of the index, with their bits reversed as the scramble wants them.
using byte_table = std::array<std::array<uint32_t, 256>, 4>;

constexpr byte_table make_table(int degree, uint32_t a, std::array<uint32_t, 3> m) {
  std::array<uint32_t, 32> v = {};
  for (int i = 0; i < 32; i++) {
    if (i < degree) {
      v[static_cast<std::size_t>(i)] = m[static_cast<std::size_t>(i)] << (31 - i);
    } else {
      auto at = [&](int k) { return v[static_cast<std::size_t>(i - k)]; };
      uint32_t x = at(degree) ^ (at(degree) >> degree);
      for (int k = 1; k < degree; k++)
        if ((a >> (degree - 1 - k)) & 1u) x ^= at(k);
      v[static_cast<std::size_t>(i)] = x;
    }
  }
  byte_table table = {};
  for (std::size_t byte = 0; byte < 4; byte++)
    for (std::size_t b = 0; b < 256; b++) {
      uint32_t x = 0;
      for (std::size_t bit = 0; bit < 8; bit++)
        if ((b >> bit) & 1u) x ^= v[byte * 8 + bit];
      table[byte][b] = reverse_bits(x);
    }
  return table;
}

constexpr byte_table sobol_1 = make_table(1, 0, {1, 0, 0});
constexpr byte_table sobol_2 = make_table(2, 1, {1, 3, 0});
constexpr byte_table sobol_3 = make_table(3, 1, {1, 3, 1});

uint32_t lookup(const byte_table& t, uint32_t i) {
  return t[0][i & 255u] ^ t[1][(i >> 8) & 255u] ^ t[2][(i >> 16) & 255u] ^ t[3][i >> 24];
}

// Owen scrambling of a number whose bits are reversed: each bit depends on the
// lower bits only (Laine and Karras 2011, with Vegdahl's constants).
uint32_t scramble_reversed(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

}  // namespace

vec4 sample_4d(const sample_state& state, uint32_t set) {
  uint32_t seed = hash_combine(state.seed, set);
  uint32_t index = reverse_bits(scramble_reversed(reverse_bits(state.index), seed));
  // Dimension 0 is the van der Corput sequence: the reversed index, reversed.
  uint32_t x = scramble_reversed(index, hash32(seed + 0x9e3779b9u));
  uint32_t y = scramble_reversed(lookup(sobol_1, index), hash32(seed + 0x3c6ef372u));
  uint32_t z = scramble_reversed(lookup(sobol_2, index), hash32(seed + 0xdaa66d2bu));
  uint32_t w = scramble_reversed(lookup(sobol_3, index), hash32(seed + 0x78dde6e4u));
  return {to_unit_float(reverse_bits(x)), to_unit_float(reverse_bits(y)),
          to_unit_float(reverse_bits(z)), to_unit_float(reverse_bits(w))};
}

}  // namespace wisp
