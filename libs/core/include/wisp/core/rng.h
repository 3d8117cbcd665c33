#pragma once

// Random numbers that follow from (seed, index), so that results do not depend
// on threads. PCG32 (O'Neill 2014) and integer hashes.

#include <cstdint>

namespace wisp {

// A full-avalanche hash of 32 bits (Wellons' "lowbias32").
inline constexpr uint32_t hash32(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}
inline constexpr uint32_t hash_combine(uint32_t seed, uint32_t v) {
  return hash32(seed ^ (v + 0x9e3779b9u + (seed << 6) + (seed >> 2)));
}
// The finaliser of splitmix64.
inline constexpr uint64_t hash64(uint64_t x) {
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9ull;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebull;
  x ^= x >> 31;
  return x;
}

// The float in [0, 1) with the 24 high bits of x.
inline constexpr float to_unit_float(uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24f; }
// The double in [0, 1) with the 53 high bits of x.
inline constexpr double to_unit_double(uint64_t x) {
  return static_cast<double>(x >> 11) * 0x1p-53;
}

// Each draw changes it: one thread at a time, or a generator for each.
struct rng_state {
  uint64_t state = 0x853c49e6748fea9bull;
  uint64_t inc = 0xda3e39cb94b95bdbull;
};

inline uint32_t next_uint(rng_state& rng) {
  uint64_t old = rng.state;
  rng.state = old * 6364136223846793005ull + rng.inc;
  auto xorshifted = static_cast<uint32_t>(((old >> 18u) ^ old) >> 27u);
  auto rot = static_cast<uint32_t>(old >> 59u);
  return (xorshifted >> rot) | (xorshifted << ((32u - rot) & 31u));
}

// The generator of stream `index` of `seed`: any two streams are unrelated.
inline rng_state make_rng(uint64_t seed, uint64_t index = 0) {
  rng_state rng{0, (hash64(index + 0x9e3779b97f4a7c15ull) << 1) | 1};
  next_uint(rng);
  rng.state += hash64(seed * 0x9e3779b97f4a7c15ull + index);
  next_uint(rng);
  return rng;
}

// Uniform in [0, 1).
inline float rand1f(rng_state& rng) { return to_unit_float(next_uint(rng)); }
inline double rand1d(rng_state& rng) {
  uint64_t hi = next_uint(rng);
  return to_unit_double((hi << 32) | next_uint(rng));
}
// Uniform in 0 .. n-1, n > 0 (Lemire's multiply-shift; bias below n/2^32).
inline uint32_t rand_index(rng_state& rng, uint32_t n) {
  return static_cast<uint32_t>((static_cast<uint64_t>(next_uint(rng)) * n) >> 32);
}

}  // namespace wisp
