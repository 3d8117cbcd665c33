// What the vector code of this library shares.

#if defined(WISP_GEOMETRY_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef WISP_GEOMETRY_LANES_INL_H
#undef WISP_GEOMETRY_LANES_INL_H
#else
#define WISP_GEOMETRY_LANES_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "src/bvh_data.h"

HWY_BEFORE_NAMESPACE();
namespace wisp::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
// The children of a node, and the elements of a leaf.
using lanes = hn::CappedTag<float, bvh_width>;
using floats = hn::Vec<lanes>;

// Bit i: lane i of at most eight.
template <typename D>
HWY_INLINE uint32_t mask_bits(D d, hn::Mask<D> m) {
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, m, bytes);
  return bytes[0];
}
HWY_INLINE uint32_t mask_bits(hn::Mask<lanes> m) { return mask_bits(lanes(), m); }

HWY_INLINE floats dot(floats ax, floats ay, floats az, floats bx, floats by, floats bz) {
  return hn::MulAdd(ax, bx, hn::MulAdd(ay, by, hn::Mul(az, bz)));
}

}  // namespace wisp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
