#pragma once

// Random points for the tests of solids.

#include "wisp/core/math.h"
#include "wisp/core/rng.h"

namespace wisp::test {

// Fewer where a sanitizer makes each of them slow.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr int rounds = 1;
#else
inline constexpr int rounds = 10;
#endif

inline double uniform(rng_state& rng, double low, double high) {
  return low + (high - low) * rand1d(rng);
}
inline dvec3 random_point(rng_state& rng, double size) {
  const double x = uniform(rng, -size, size), y = uniform(rng, -size, size);
  return {x, y, uniform(rng, -size, size)};
}

}  // namespace wisp::test
