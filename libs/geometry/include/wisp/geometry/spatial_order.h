#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "wisp/core/export.h"
#include "wisp/core/math.h"

namespace wisp {

// The indices of points in the order of a curve through space (Morton 1966): queries that
// follow one another near each other find in the caches what the last one needed. Points
// with coordinates that are not finite come anywhere. `threads`: 0 for all.
// Safe to call from any thread.
WISP_API std::vector<uint32_t> spatial_order(std::span<const dvec3> points, int threads = 1);

}  // namespace wisp
