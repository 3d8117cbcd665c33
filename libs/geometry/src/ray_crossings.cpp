// Crossings of an axis-parallel segment with the triangles of a bvh. In single
// precision where that is sure of its answer, which is nearly always; in exact
// arithmetic where it is not.
//
// A box is missed or met by comparisons alone, as the projections of the segment are
// its coordinates. Of the triangles of a leaf, eight at a time, the projected edge
// functions and the sides of p and q are computed with bounds of their errors.

#include <algorithm>
#include <bit>
#include <cmath>

#include "src/orient2d.h"
#include "src/query.h"
#include "src/winding_exact.h"

// Vectors whose size the compiler does not know are no wider than what NEON has.
#ifndef HWY_DISABLED_TARGETS
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/ray_crossings.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

#include "src/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace wisp::HWY_NAMESPACE {

// Bit i: the segment may meet the box of child i.
template <typename Push>
HWY_INLINE void open_node(const bvh_node& n, const float_segment& s, const Push& push) {
  const lanes d;
  const auto low_u = hn::Set(d, s.low[0]), high_u = hn::Set(d, s.high[0]);
  const auto low_v = hn::Set(d, s.low[1]), high_v = hn::Set(d, s.high[1]);
  const auto low_k = hn::Set(d, s.low[2]), high_k = hn::Set(d, s.high[2]);
  for (std::size_t i = 0; i < bvh_width; i += hn::Lanes(d)) {
    const auto in_u = hn::And(hn::Le(hn::Load(d, n.min[s.u] + i), high_u),
                              hn::Ge(hn::Load(d, n.max[s.u] + i), low_u));
    const auto in_v = hn::And(hn::Le(hn::Load(d, n.min[s.v] + i), high_v),
                              hn::Ge(hn::Load(d, n.max[s.v] + i), low_v));
    const auto in_k = hn::And(hn::Le(hn::Load(d, n.min[s.k] + i), high_k),
                              hn::Ge(hn::Load(d, n.max[s.k] + i), low_k));
    push(i, hn::And(hn::And(in_u, in_v), in_k));
  }
}

struct leaf_crossings {
  int sum = 0;
  uint32_t unsure = 0;  // lanes
};

// u = 2^-24; coordinates of vertices and p have errors of u / 2, |p - a| <= 2 and
// |q - p| <= 4. With L the sum of the absolute components of both edges, edge functions
// are wrong by less than 25 u L; with S the product of the sums of each, p's volume by
// 17 u S and q's by 49 u S. Rounded up, and away from where floats are subnormal.
HWY_INLINE leaf_crossings cross_leaf(const bvh_leaf& leaf, const float_segment& s) {
  const lanes d;
  const auto zero = hn::Zero(d), least = hn::Set(d, 1e-35f);
  leaf_crossings r;
  for (std::size_t i = 0; i < bvh_width; i += hn::Lanes(d)) {
    const auto pu = hn::Sub(hn::Set(d, s.p[0]), hn::Load(d, leaf.a[s.u] + i));
    const auto pv = hn::Sub(hn::Set(d, s.p[1]), hn::Load(d, leaf.a[s.v] + i));
    const auto bu = hn::Load(d, leaf.ab[s.u] + i), bv = hn::Load(d, leaf.ab[s.v] + i);
    const auto cu = hn::Load(d, leaf.ac[s.u] + i), cv = hn::Load(d, leaf.ac[s.v] + i);
    const auto cross = [](floats ax, floats ay, floats bx, floats by) {
      return hn::MulSub(ax, by, hn::Mul(ay, bx));
    };
    const auto area = cross(bu, bv, cu, cv);
    const auto on_ab = cross(bu, bv, pu, pv), on_ca = cross(pu, pv, cu, cv);
    const auto on_bc = hn::Sub(hn::Sub(area, on_ab), on_ca);
    const auto b1 = hn::Add(hn::Abs(bu), hn::Abs(bv)), c1 = hn::Add(hn::Abs(cu), hn::Abs(cv));
    const auto error = hn::MulAdd(hn::Add(b1, c1), hn::Set(d, 32 * bvh_ulp), least);
    const auto low = hn::Min(hn::Min(on_ab, on_ca), on_bc);
    const auto high = hn::Max(hn::Max(on_ab, on_ca), on_bc);
    const auto maybe = hn::Or(hn::Ge(low, hn::Neg(error)), hn::Le(high, error));
    if (hn::AllFalse(d, maybe)) continue;

    const auto pk = hn::Sub(hn::Set(d, s.p[2]), hn::Load(d, leaf.a[s.k] + i));
    const auto bk = hn::Load(d, leaf.ab[s.k] + i), ck = hn::Load(d, leaf.ac[s.k] + i);
    const auto normal_u = cross(bv, bk, cv, ck), normal_v = cross(bk, bu, ck, cu);
    const auto at_p = dot(normal_u, normal_v, area, pu, pv, pk);
    const auto at_q = hn::MulAdd(area, hn::Set(d, s.to_q), at_p);
    const auto volume = hn::Mul(hn::Add(b1, hn::Abs(bk)), hn::Add(c1, hn::Abs(ck)));
    const auto sure_p = hn::Gt(hn::Abs(at_p), hn::MulAdd(volume, hn::Set(d, 32 * bvh_ulp), least));
    const auto sure_q = hn::Gt(hn::Abs(at_q), hn::MulAdd(volume, hn::Set(d, 64 * bvh_ulp), least));

    const uint32_t valid = ((1u << leaf.count) - 1) >> i;
    const uint32_t candidates = mask_bits(maybe) & valid;
    const uint32_t up = mask_bits(hn::Gt(low, error));
    const uint32_t down = mask_bits(hn::Lt(high, hn::Neg(error)));
    const uint32_t sides = mask_bits(hn::And(sure_p, sure_q));
    const uint32_t parted = mask_bits(hn::Gt(at_p, zero)) ^ mask_bits(hn::Gt(at_q, zero));
    const uint32_t crossed = candidates & sides & parted;
    r.sum += std::popcount(crossed & up) - std::popcount(crossed & down);
    // sure of both sides and not parted: not crossed, wherever the edges are
    r.unsure |= (candidates & ~(sides & (~parted | up | down))) << i;
  }
  return r;
}

int cross_all(const crossing_query& query, const float_segment& s) {
  const bvh_data& data = *query.data;
  const lanes d;
  const hn::RebindToUnsigned<lanes> du;
  uint32_t stack[stack_size];
  std::size_t top = 1;
  stack[0] = 0;
  int up = 0, exact = 0;
  while (top > 0) {
    const uint32_t child = stack[--top];
    if ((child & bvh_leaf_bit) == 0) {
      const bvh_node& node = data.nodes[child];
      open_node(node, s, [&](std::size_t i, auto met) {
        const auto chosen = hn::RebindMask(du, met);
        hn::StoreU(hn::Compress(hn::Load(du, node.child + i), chosen), du, stack + top);
        top += hn::CountTrue(d, met);
      });
      continue;
    }
    const bvh_leaf& leaf = data.leaves[child & ~bvh_leaf_bit];
    leaf_crossings c = cross_leaf(leaf, s);
    up += c.sum;
    for (; c.unsure != 0; c.unsure &= c.unsure - 1) {
      const auto lane = static_cast<uint32_t>(std::countr_zero(c.unsure));
      exact += exact_crossing(query, leaf.first + lane);
    }
  }
  return (query.towards_max ? up : -up) + exact;
}

}  // namespace wisp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wisp {
namespace {

HWY_EXPORT(cross_all);

float round_down(double x) {
  const auto f = static_cast<float>(x);
  return f > x ? std::nextafter(f, -infinity) : f;
}
float round_up(double x) { return -round_down(-x); }

}  // namespace

int count_crossings(const crossing_query& query) {
  constexpr float endless = 4;
  float_segment s;
  s.k = query.axis;
  s.u = (s.k + 1) % 3;
  s.v = (s.k + 2) % 3;
  const int order[3] = {s.u, s.v, s.k};
  for (int i = 0; i < 3; ++i) {
    const double x = query.x[order[i]];
    s.p[i] = static_cast<float>(x);
    s.low[i] = round_down(x);
    s.high[i] = round_up(x);
  }
  if (query.endless) {
    s.to_q = query.towards_max ? endless : -endless;
    (query.towards_max ? s.high : s.low)[2] = s.to_q;
  } else {
    s.to_q = static_cast<float>(query.q - query.x[s.k]);
    (query.towards_max ? s.high : s.low)[2] = static_cast<float>(query.q);
  }
  return HWY_DYNAMIC_DISPATCH(cross_all)(query, s);
}

// All in coordinates times the tree's scale, a power of two: no digit changes, and no
// product overflows.
int exact_crossing(const crossing_query& query, uint32_t slot) {
  const bvh_data& data = *query.data;
  const int k = query.axis, u = (k + 1) % 3, v = (k + 2) % 3;
  const auto turned = [&](const dvec3& x) { return dvec3{x[u], x[v], x[k]} * data.scale; };
  const auto corners = data.corners(slot);
  const dvec3 a = turned(corners[0]), b = turned(corners[1]), c = turned(corners[2]);
  const dvec3 p = turned(query.p);
  const int up = orient2d_moved(a, b, p);
  if (up == 0 || orient2d_moved(b, c, p) != up || orient2d_moved(c, a, p) != up) return 0;

  // The side of p; in the plane, of p moved by (e, e^2, e^3).
  int side = orient3d(a, b, c, p);
  if (side == 0) side = orient2d(dvec2{b.y, b.z}, dvec2{c.y, c.z}, dvec2{a.y, a.z});
  if (side == 0) side = orient2d(dvec2{b.z, b.x}, dvec2{c.z, c.x}, dvec2{a.z, a.x});
  if (side == 0) side = up;

  const int towards = query.towards_max ? 1 : -1;
  int side_of_q = towards * up;
  if (!query.endless) {
    dvec3 q = p;
    q.z = (data.center[k] + query.q * data.unit) * data.scale;
    side_of_q = orient3d(a, b, c, q);
  }
  return side == side_of_q ? 0 : towards * up;
}

}  // namespace wisp
#endif  // HWY_ONCE
