// The vector code of closest_point.h: depth-first, nearest child first, eight
// children or elements at a time.

#if defined(WISP_CLOSEST_POINT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef WISP_CLOSEST_POINT_INL_H
#undef WISP_CLOSEST_POINT_INL_H
#else
#define WISP_CLOSEST_POINT_INL_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "src/lanes-inl.h"
#include "src/query.h"

HWY_BEFORE_NAMESPACE();
namespace wisp::HWY_NAMESPACE {

// Squared lower bounds of the distances of p to the children from lane i on, and,
// where upper2 is given, squared upper bounds: the box's farthest corner, and the
// cylinder's.
HWY_INLINE floats child_distance2(const bvh_node& n, std::size_t i, floats px, floats py, floats pz,
                                  floats* upper2) {
  const lanes d;
  const floats zero = hn::Zero(d), half = hn::Set(d, 0.5f);
  const floats x0 = hn::Load(d, n.min[0] + i), x1 = hn::Load(d, n.max[0] + i);
  const floats y0 = hn::Load(d, n.min[1] + i), y1 = hn::Load(d, n.max[1] + i);
  const floats z0 = hn::Load(d, n.min[2] + i), z1 = hn::Load(d, n.max[2] + i);
  const floats bx = hn::Max(hn::Max(hn::Sub(x0, px), hn::Sub(px, x1)), zero);
  const floats by = hn::Max(hn::Max(hn::Sub(y0, py), hn::Sub(py, y1)), zero);
  const floats bz = hn::Max(hn::Max(hn::Sub(z0, pz), hn::Sub(pz, z1)), zero);
  const floats box2 = dot(bx, by, bz, bx, by, bz);

  const floats qx = hn::Sub(px, hn::Mul(half, hn::Add(x0, x1)));
  const floats qy = hn::Sub(py, hn::Mul(half, hn::Add(y0, y1)));
  const floats qz = hn::Sub(pz, hn::Mul(half, hn::Add(z0, z1)));
  const floats nx = hn::Load(d, n.normal[0] + i);
  const floats ny = hn::Load(d, n.normal[1] + i);
  const floats nz = hn::Load(d, n.normal[2] + i);
  const floats z = dot(qx, qy, qz, nx, ny, nz);
  const floats lx = hn::NegMulAdd(z, nx, qx);
  const floats ly = hn::NegMulAdd(z, ny, qy);
  const floats lz = hn::NegMulAdd(z, nz, qz);
  const floats l = hn::Sqrt(dot(lx, ly, lz, lx, ly, lz));
  const floats z_min = hn::Load(d, n.z_min + i), z_max = hn::Load(d, n.z_max + i);
  const floats radius = hn::Load(d, n.radius + i);
  const floats over = hn::Max(hn::Max(hn::Sub(z_min, z), hn::Sub(z, z_max)), zero);
  const floats beside = hn::Max(hn::Sub(l, radius), zero);
  const floats cylinder2 = hn::MulAdd(over, over, hn::Mul(beside, beside));

  if (upper2 != nullptr) {
    const floats fx = hn::Max(hn::Sub(px, x0), hn::Sub(x1, px));
    const floats fy = hn::Max(hn::Sub(py, y0), hn::Sub(y1, py));
    const floats fz = hn::Max(hn::Sub(pz, z0), hn::Sub(z1, pz));
    const floats corner2 = dot(fx, fy, fz, fx, fy, fz);
    const floats height = hn::Max(hn::Sub(z, z_min), hn::Sub(z_max, z));
    const floats width = hn::Add(l, radius);
    // without a normal there is no cylinder but a ball
    const floats rim2 = hn::MulAdd(height, height, hn::Mul(width, width));
    *upper2 = hn::Min(corner2, rim2);
  }
  return hn::Max(box2, cylinder2);
}

// Squared distance of (x, y, z), relative to a vertex, to the edge e from it, whose
// squared length is e2.
HWY_INLINE floats edge_distance2(floats x, floats y, floats z, floats ex, floats ey, floats ez,
                                 floats e2, floats along) {
  const lanes d;
  const floats t = hn::Min(hn::Max(hn::Div(along, hn::Max(e2, hn::Set(d, 1e-37f))), hn::Zero(d)),
                           hn::Set(d, 1.0f));
  const floats rx = hn::NegMulAdd(t, ex, x);
  const floats ry = hn::NegMulAdd(t, ey, y);
  const floats rz = hn::NegMulAdd(t, ez, z);
  return dot(rx, ry, rz, rx, ry, rz);
}

// Squared distances to the elements of a leaf from lane i on: each that of a point
// of the element, so that it is not too small; not too large by more than slack.
HWY_INLINE floats leaf_distance2(const bvh_leaf& leaf, std::size_t i, floats px, floats py,
                                 floats pz) {
  const lanes d;
  const floats x = hn::Sub(px, hn::Load(d, leaf.a[0] + i));
  const floats y = hn::Sub(py, hn::Load(d, leaf.a[1] + i));
  const floats z = hn::Sub(pz, hn::Load(d, leaf.a[2] + i));
  const floats bx = hn::Load(d, leaf.ab[0] + i);
  const floats by = hn::Load(d, leaf.ab[1] + i);
  const floats bz = hn::Load(d, leaf.ab[2] + i);
  const floats cx = hn::Load(d, leaf.ac[0] + i);
  const floats cy = hn::Load(d, leaf.ac[1] + i);
  const floats cz = hn::Load(d, leaf.ac[2] + i);
  const floats bb = dot(bx, by, bz, bx, by, bz);
  const floats bc = dot(bx, by, bz, cx, cy, cz);
  const floats cc = dot(cx, cy, cz, cx, cy, cz);
  const floats b = dot(bx, by, bz, x, y, z);
  const floats c = dot(cx, cy, cz, x, y, z);
  const floats on_ab = edge_distance2(x, y, z, bx, by, bz, bb, b);
  const floats on_ac = edge_distance2(x, y, z, cx, cy, cz, cc, c);
  const floats ex = hn::Sub(cx, bx), ey = hn::Sub(cy, by), ez = hn::Sub(cz, bz);
  const floats fx = hn::Sub(x, bx), fy = hn::Sub(y, by), fz = hn::Sub(z, bz);
  const floats on_bc = edge_distance2(fx, fy, fz, ex, ey, ez, dot(ex, ey, ez, ex, ey, ez),
                                      dot(ex, ey, ez, fx, fy, fz));
  const floats edges = hn::Min(hn::Min(on_ab, on_ac), on_bc);

  const floats det = hn::Sub(hn::Mul(bb, cc), hn::Mul(bc, bc));
  const floats tiny = hn::Set(d, 1e-30f);
  const floats inv = hn::Div(hn::Set(d, 1.0f), hn::Max(det, tiny));
  const floats v = hn::Mul(inv, hn::Sub(hn::Mul(cc, b), hn::Mul(bc, c)));
  const floats w = hn::Mul(inv, hn::Sub(hn::Mul(bb, c), hn::Mul(bc, b)));
  const floats u = hn::Sub(hn::Sub(hn::Set(d, 1.0f), v), w);
  const floats rx = hn::NegMulAdd(w, cx, hn::NegMulAdd(v, bx, x));
  const floats ry = hn::NegMulAdd(w, cy, hn::NegMulAdd(v, by, y));
  const floats rz = hn::NegMulAdd(w, cz, hn::NegMulAdd(v, bz, z));
  const floats face = dot(rx, ry, rz, rx, ry, rz);
  const auto inside = hn::And(hn::Ge(hn::Min(u, hn::Min(v, w)), hn::Zero(d)), hn::Gt(det, tiny));
  return hn::IfThenElse(inside, hn::Min(face, edges), edges);
}

// Puts the children that are no farther than `limit2` on the stack, the nearest on
// top and the others as they come: to sort them all costs more than it saves.
// Without a branch, which no processor could predict.
HWY_INLINE void push(query_stack& stack, const bvh_node& node, const float* HWY_RESTRICT lower,
                     float limit2) {
  const lanes d;
  const hn::RebindToUnsigned<lanes> du;
  floats least = hn::Set(d, infinity);
  for (std::size_t i = 0; i < bvh_width; i += hn::Lanes(d)) {
    least = hn::Min(least, hn::Load(d, lower + i));
  }
  least = hn::MinOfLanes(d, least);
  uint32_t equal = 0;
  for (std::size_t i = 0; i < bvh_width; i += hn::Lanes(d)) {
    equal |= mask_bits(hn::Eq(hn::Load(d, lower + i), least)) << i;
  }
  const auto nearest = static_cast<uint32_t>(std::countr_zero(equal));
  std::size_t top = stack.top;
  for (std::size_t i = 0; i < bvh_width; i += hn::Lanes(d)) {
    const floats l = hn::Load(d, lower + i);
    const auto lane = hn::Iota(du, static_cast<uint32_t>(i));
    const auto other = hn::RebindMask(d, hn::Ne(lane, hn::Set(du, nearest)));
    const auto near = hn::And(hn::Le(l, hn::Set(d, limit2)), other);
    hn::StoreU(hn::Compress(l, near), d, stack.distance2 + top);
    hn::StoreU(hn::Compress(hn::Load(du, node.child + i), hn::RebindMask(du, near)), du,
               stack.child + top);
    top += hn::CountTrue(d, near);
  }
  stack.distance2[top] = lower[nearest];
  stack.child[top] = node.child[nearest];
  stack.top = top + (lower[nearest] <= limit2 ? 1 : 0);
}

// What will be opened next, if nothing changes. Queries take turns, so that there is
// time for it to come from memory.
HWY_INLINE void prefetch_top(const bvh_data& data, const query_stack& stack) {
  if (stack.top == 0) return;
  const uint32_t child = stack.child[stack.top - 1];
  const char* p;
  std::size_t size;
  if ((child & bvh_leaf_bit) == 0) {
    p = reinterpret_cast<const char*>(&data.nodes[child]);
    size = sizeof(bvh_node);
  } else {
    p = reinterpret_cast<const char*>(&data.leaves[child & ~bvh_leaf_bit]);
    size = sizeof(bvh_leaf);
  }
  for (std::size_t i = 0; i < size; i += 64) hwy::Prefetch(p + i);
}

// Squared lower bounds of the distances to the children of a node, and the least
// upper bound.
template <bool with_upper>
struct child_bounds {
  HWY_ALIGN float lower[bvh_width];
  float least_upper = infinity;

  HWY_INLINE child_bounds(const bvh_node& node, const vec3& p) {
    const lanes d;
    const floats px = hn::Set(d, p.x), py = hn::Set(d, p.y), pz = hn::Set(d, p.z);
    floats least = hn::Set(d, infinity);
    for (std::size_t i = 0; i < bvh_width; i += hn::Lanes(d)) {
      floats upper;
      hn::Store(child_distance2(node, i, px, py, pz, with_upper ? &upper : nullptr), d, lower + i);
      if constexpr (with_upper) least = hn::Min(least, upper);
    }
    if constexpr (with_upper) least_upper = hn::GetLane(hn::MinOfLanes(d, least));
  }

  // The least lower bound of those beyond the limit.
  float least_beyond(float limit2) const {
    float beyond = infinity;
    for (const float l : lower) beyond = std::min(beyond, l > limit2 ? l : infinity);
    return beyond;
  }
};

struct leaf_distances {
  HWY_ALIGN float distance2[bvh_width];
  float least;

  HWY_INLINE leaf_distances(const bvh_leaf& leaf, const vec3& p) {
    const lanes d;
    const floats px = hn::Set(d, p.x), py = hn::Set(d, p.y), pz = hn::Set(d, p.z);
    floats all = hn::Set(d, infinity);
    for (std::size_t i = 0; i < bvh_width; i += hn::Lanes(d)) {
      const floats d2 = leaf_distance2(leaf, i, px, py, pz);
      hn::Store(d2, d, distance2 + i);
      all = hn::Min(all, d2);
    }
    least = hn::GetLane(hn::MinOfLanes(d, all));
  }
};

// Opens one node or leaf. False once all that may be the closest is in q.
template <bool with_tolerance>
HWY_INLINE bool step(nearest_query& q) {
  const bvh_data& data = *q.data;
  const auto limit_of = [&q] {
    const float limit = with_tolerance && q.reach < q.surely ? q.reach * q.shrink : q.reach;
    return limit * limit;
  };
  waiting w;
  do {
    if (q.stack.top == 0) return false;
    w = q.stack.pop();
    if (with_tolerance && w.distance2 > q.limit2) {
      q.least_left_out = std::min(q.least_left_out, w.distance2);
    }
  } while (w.distance2 > q.limit2);

  if ((w.child & bvh_leaf_bit) == 0) {
    const bvh_node& node = data.nodes[w.child];
    const child_bounds<false> c(node, q.p);
    if (with_tolerance) q.least_left_out = std::min(q.least_left_out, c.least_beyond(q.limit2));
    push(q.stack, node, c.lower, q.limit2);
    return true;
  }
  const uint32_t index = w.child & ~bvh_leaf_bit;
  const bvh_leaf& leaf = data.leaves[index];
  const leaf_distances found(leaf, q.p);
  const float near = std::sqrt(found.least) + 2 * q.margin;
  if (near < q.reach) {
    q.reach = near;
    q.limit2 = limit_of();
  }
  const float within = q.reach + leaf.slack, within2 = within * within;
  if (found.least > within2) return true;
  for (uint32_t i = 0; i < leaf.count; ++i) {
    if (found.distance2[i] > within2) continue;
    if (q.count == q.room) {
      q.look_at(q);
      q.limit2 = limit_of();
    }
    q.candidates[q.count++] = {leaf.first + i, found.distance2[i], leaf.slack};
    hwy::Prefetch(&data.triangles[leaf.first + i]);
  }
  return true;
}

// Opens one node or leaf. False once the bounds are close enough.
HWY_INLINE bool step(bounds_query& q) {
  waiting w;
  do {
    if (q.stack.top == 0) return false;
    w = q.stack.pop();
    if (w.distance2 > q.limit2) q.least_left_out = std::min(q.least_left_out, w.distance2);
  } while (w.distance2 > q.limit2);

  const bvh_data& data = *q.data;
  if ((w.child & bvh_leaf_bit) == 0) {
    const bvh_node& node = data.nodes[w.child];
    const child_bounds<true> c(node, q.p);
    q.upper2 = std::min(q.upper2, c.least_upper);
    q.limit2 = std::min(q.limit2, q.upper2 * q.shrink2);
    q.least_left_out = std::min(q.least_left_out, c.least_beyond(q.limit2));
    push(q.stack, node, c.lower, q.limit2);
    return true;
  }
  const bvh_leaf& leaf = data.leaves[w.child & ~bvh_leaf_bit];
  const leaf_distances found(leaf, q.p);
  q.upper2 = std::min(q.upper2, found.least);
  q.limit2 = std::min(q.limit2, q.upper2 * q.shrink2);
  const float low = std::max(std::sqrt(found.least) - leaf.slack, 0.0f);
  q.least_left_out = std::min(q.least_left_out, low * low);
  return true;
}

template <typename Query, bool (*one_step)(Query&)>
HWY_INLINE void take_turns(const query_source<Query>& source) {
  Query queries[query_turns];
  std::size_t active = 0;
  while (active < query_turns && source.next(source.user, queries[active])) ++active;
  while (active > 0) {
    for (std::size_t i = 0; i < active;) {
      Query& q = queries[i];
      if (one_step(q)) {
        prefetch_top(*q.data, q.stack);
        ++i;
        continue;
      }
      source.done(source.user, q);
      if (source.next(source.user, q)) {
        ++i;
      } else if (--active > i) {
        q = queries[active];
      }
    }
  }
}

void find_nearest(nearest_query& q) {
  if (q.shrink < 1) {
    while (step<true>(q)) {
    }
  } else {
    while (step<false>(q)) {
    }
  }
}
void find_bounds(bounds_query& q) {
  while (step(q)) {
  }
}
void find_all_nearest(const query_source<nearest_query>& source, bool with_tolerance) {
  if (with_tolerance) {
    take_turns<nearest_query, step<true>>(source);
  } else {
    take_turns<nearest_query, step<false>>(source);
  }
}
void find_all_bounds(const query_source<bounds_query>& source) {
  take_turns<bounds_query, step>(source);
}

// Whether an element is surely nearer than `surely` (1), or none is nearer than
// q.reach (0), or the candidates in q have to be looked at (-1).
int find_any(nearest_query& q, float surely) {
  const bvh_data& data = *q.data;
  const float limit2 = q.reach * q.reach, surely2 = surely > 0 ? surely * surely : -1;
  while (q.stack.top > 0) {
    const uint32_t child = q.stack.pop().child;
    if ((child & bvh_leaf_bit) == 0) {
      const bvh_node& node = data.nodes[child];
      const child_bounds<true> c(node, q.p);
      if (c.least_upper < surely2) return 1;
      push(q.stack, node, c.lower, limit2);
      continue;
    }
    const bvh_leaf& leaf = data.leaves[child & ~bvh_leaf_bit];
    const leaf_distances found(leaf, q.p);
    if (found.least < surely2) return 1;
    const float within = q.reach + leaf.slack, within2 = within * within;
    for (uint32_t i = 0; i < leaf.count; ++i) {
      if (found.distance2[i] > within2) continue;
      if (q.count == q.room) {
        q.look_at(q);
        if (q.reach < 0) return 1;
      }
      q.candidates[q.count++] = {leaf.first + i, found.distance2[i], leaf.slack};
    }
  }
  return q.count > 0 ? -1 : 0;
}

const char* target_name() { return hwy::TargetName(HWY_TARGET); }

}  // namespace wisp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
