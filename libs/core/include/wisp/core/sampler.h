#pragma once

// Owen-scrambled Sobol samples, four dimensions at a time, for any number of
// dimensions and samples: Burley, "Practical Hash-based Owen Scrambling", JCGT
// 9(4), 2020. Each set of four dimensions is a Sobol sequence in an order of its
// own (its index is Owen-scrambled too) and with scrambles of its own, so that
// sets are independent of each other while each is stratified over any aligned
// block of 2^k samples. The functions are pure and safe to call from any thread.

#include <cstdint>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/core/rng.h"

namespace wisp {

// Names sample `index` of a stream. Streams with different seeds are unrelated.
struct sample_state {
  uint32_t seed = 0;
  uint32_t index = 0;
};

// The seed of a pixel's stream.
inline uint32_t pixel_seed(uint64_t seed, uint32_t x, uint32_t y) {
  uint64_t h = hash64(seed + 0x9e3779b97f4a7c15ull);
  h = hash64(h ^ ((static_cast<uint64_t>(y) << 32) | x));
  return static_cast<uint32_t>(h ^ (h >> 32));
}

// Four numbers in [0, 1) for the dimensions 4 set .. 4 set + 3. Pure; about 20 ns.
WISP_API vec4 sample_4d(const sample_state& state, uint32_t set);

}  // namespace wisp
