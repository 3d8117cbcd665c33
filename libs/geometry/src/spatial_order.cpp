#include "wisp/geometry/spatial_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "wisp/core/parallel.h"

namespace wisp {

namespace {

// The 21 low bits of x with two zeros after each.
uint64_t spread(uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffffull;
  x = (x | x << 16) & 0x001f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  x = (x | x << 2) & 0x1249249249249249ull;
  return x;
}

}  // namespace

std::vector<uint32_t> spatial_order(std::span<const dvec3> points, int threads) {
  dvec3 low{std::numeric_limits<double>::infinity()}, high = -low;
  for (const dvec3& p : points) {
    for (int a = 0; a < 3; ++a) {
      if (!std::isfinite(p[a])) continue;
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
  }
  struct key {
    uint64_t code;
    uint32_t index;
  };
  std::vector<key> keys(points.size());
  parallel_for(
      points.size(), threads,
      [&](std::size_t i) {
        uint64_t code = 0;
        for (int a = 0; a < 3; ++a) {
          // halves, as the difference of finite numbers may be infinite
          const double extent = high[a] / 2 - low[a] / 2;
          const double at = extent > 0 ? (points[i][a] / 2 - low[a] / 2) / extent : 0;
          const double cell = at >= 0 ? std::min(at, 1.0) * 0x1fffff : 0.0;  // NaN: 0
          code |= spread(static_cast<uint64_t>(cell)) << a;
        }
        keys[i] = {code, static_cast<uint32_t>(i)};
      },
      4096);
  // A radix sort: the high bits are order enough, fewer of them where there are few points.
  const bool few = keys.size() < 4096;
  const int bits = few ? 8 : 11, passes = few ? 2 : 3;
  const std::size_t buckets = std::size_t{1} << bits;
  std::vector<key> sorted(keys.size());
  std::vector<std::size_t> first(buckets + 1);
  for (int pass = 0; pass < passes; ++pass) {
    const int shift = 63 - bits * (passes - pass);
    const auto digit = [&](const key& k) {
      return static_cast<std::size_t>(k.code >> shift) & (buckets - 1);
    };
    std::fill(first.begin(), first.end(), 0);
    for (const key& k : keys) ++first[digit(k) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    for (const key& k : keys) sorted[first[digit(k)]++] = k;
    keys.swap(sorted);
  }
  std::vector<uint32_t> order(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) order[i] = keys[i].index;
  return order;
}

}  // namespace wisp
