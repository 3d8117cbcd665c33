// Chooses the vector code of closest_point-inl.h for the processor.

// Vectors whose size the compiler does not know are no wider than what NEON has.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/closest_kernels.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include "src/closest_point-inl.h"

#if HWY_ONCE
namespace wisp {
namespace {

HWY_EXPORT(find_nearest);
HWY_EXPORT(find_bounds);
HWY_EXPORT(find_any);
HWY_EXPORT(find_all_nearest);
HWY_EXPORT(find_all_bounds);
HWY_EXPORT(target_name);

}  // namespace

void run_nearest(nearest_query& q) { HWY_DYNAMIC_DISPATCH(find_nearest)(q); }
void run_bounds(bounds_query& q) { HWY_DYNAMIC_DISPATCH(find_bounds)(q); }
int run_any(nearest_query& q, float surely) { return HWY_DYNAMIC_DISPATCH(find_any)(q, surely); }
void run_all_nearest(const query_source<nearest_query>& source, bool with_tolerance) {
  HWY_DYNAMIC_DISPATCH(find_all_nearest)(source, with_tolerance);
}
void run_all_bounds(const query_source<bounds_query>& source) {
  HWY_DYNAMIC_DISPATCH(find_all_bounds)(source);
}
const char* geometry_target() { return HWY_DYNAMIC_DISPATCH(target_name)(); }

}  // namespace wisp
#endif  // HWY_ONCE
