// The vector code of fast_winding.h: eight expansions, solid angles or points at a time.

// Vectors whose size the compiler does not know are no wider than what NEON has.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/fast_winding_kernels.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <bit>

#include "src/fast_winding_data.h"
#include "src/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace wisp::HWY_NAMESPACE {

// atan2(y, x) within 2e-7; Abramowitz and Stegun, 1964, 4.4.49. 0 for y = x = 0.
HWY_INLINE floats angle_of(floats y, floats x) {
  const lanes d;
  const floats ay = hn::Abs(y), ax = hn::Abs(x);
  const floats q = hn::Div(hn::Min(ay, ax), hn::Max(hn::Max(ay, ax), hn::Set(d, 1e-37f)));
  const floats s = hn::Mul(q, q), s2 = hn::Mul(s, s), s4 = hn::Mul(s2, s2);
  const auto pair = [&](float a, float b) { return hn::MulAdd(s, hn::Set(d, b), hn::Set(d, a)); };
  const floats low = hn::MulAdd(s2, pair(0.1999355085f, -0.1420889944f), pair(1, -0.3333314528f));
  const floats high =
      hn::MulAdd(s2, pair(0.0429096138f, -0.0161657367f), pair(0.1065626393f, -0.0752896400f));
  const floats tail = hn::MulAdd(s4, hn::Set(d, 0.0028662257f), high);
  floats r = hn::Mul(q, hn::MulAdd(s4, tail, low));
  r = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(hn::Set(d, 1.57079632679f), r), r);
  r = hn::IfThenElse(hn::Lt(x, hn::Zero(d)), hn::Sub(hn::Set(d, 3.14159265359f), r), r);
  return hn::CopySign(r, y);
}

// Winding numbers of the children from lane i on whose expansions hold; `open`: of
// the others.
template <int order>
HWY_INLINE floats expand(const eight_floats* HWY_RESTRICT rows, std::size_t i, floats px, floats py,
                         floats pz, floats beta2, hn::Mask<lanes>& open) {
  const lanes d;
  const auto row = [&](std::size_t r) { return hn::Load(d, rows[r].v + i); };
  floats x = hn::Sub(px, row(row_center));
  floats y = hn::Sub(py, row(row_center + 1));
  floats z = hn::Sub(pz, row(row_center + 2));
  const floats d2 = dot(x, y, z, x, y, z);
  const auto far = hn::Gt(d2, hn::Mul(beta2, row(row_radius2)));
  open = hn::Not(far);
  const floats inv = hn::Div(hn::Set(d, 1.0f), hn::Sqrt(d2));
  x = hn::Mul(x, inv);
  y = hn::Mul(y, inv);
  z = hn::Mul(z, inv);
  floats sum = dot(x, y, z, row(row_first), row(row_first + 1), row(row_first + 2));
  if constexpr (order >= 2) {
    const floats xx = hn::Mul(x, x), yy = hn::Mul(y, y), zz = hn::Mul(z, z);
    floats second = hn::Mul(hn::Sub(xx, zz), row(row_second));
    second = hn::MulAdd(hn::Sub(yy, zz), row(row_second + 1), second);
    const floats of_x = hn::MulAdd(y, row(row_second + 2), hn::Mul(z, row(row_second + 3)));
    second = hn::MulAdd(x, of_x, second);
    second = hn::MulAdd(hn::Mul(y, z), row(row_second + 4), second);
    if constexpr (order >= 3) {
      const floats minus_third = hn::Set(d, -1.0f / 3);
      const auto axis = [&](std::size_t r, floats own, floats other, floats another) {
        return hn::MulAdd(hn::MulAdd(minus_third, own, other), row(r),
                          hn::Mul(hn::MulAdd(minus_third, own, another), row(r + 1)));
      };
      floats third = hn::Mul(x, axis(row_third, xx, yy, zz));
      third = hn::MulAdd(y, axis(row_third + 2, yy, xx, zz), third);
      const floats of_z =
          hn::MulAdd(hn::Mul(x, y), row(row_third + 6), axis(row_third + 4, zz, xx, yy));
      third = hn::MulAdd(z, of_z, third);
      second = hn::MulAdd(inv, third, second);
    }
    sum = hn::MulAdd(inv, second, sum);
  }
  return hn::IfThenElseZero(far, hn::Mul(hn::Mul(inv, inv), sum));
}

// Half the solid angles of the triangles from lane i on; `near`: of those that are too
// near to p for single precision.
HWY_INLINE floats half_angles(const bvh_leaf& leaf, std::size_t i, floats px, floats py, floats pz,
                              hn::Mask<lanes>& near) {
  const lanes d;
  const floats ax = hn::Sub(hn::Load(d, leaf.a[0] + i), px);
  const floats ay = hn::Sub(hn::Load(d, leaf.a[1] + i), py);
  const floats az = hn::Sub(hn::Load(d, leaf.a[2] + i), pz);
  const floats ux = hn::Load(d, leaf.ab[0] + i), vx = hn::Load(d, leaf.ac[0] + i);
  const floats uy = hn::Load(d, leaf.ab[1] + i), vy = hn::Load(d, leaf.ac[1] + i);
  const floats uz = hn::Load(d, leaf.ab[2] + i), vz = hn::Load(d, leaf.ac[2] + i);
  const floats bx = hn::Add(ax, ux), cx = hn::Add(ax, vx);
  const floats by = hn::Add(ay, uy), cy = hn::Add(ay, vy);
  const floats bz = hn::Add(az, uz), cz = hn::Add(az, vz);
  const floats a = hn::Sqrt(dot(ax, ay, az, ax, ay, az));
  const floats b = hn::Sqrt(dot(bx, by, bz, bx, by, bz));
  const floats c = hn::Sqrt(dot(cx, cy, cz, cx, cy, cz));
  const floats nx = hn::MulSub(uy, vz, hn::Mul(uz, vy));
  const floats ny = hn::MulSub(uz, vx, hn::Mul(ux, vz));
  const floats nz = hn::MulSub(ux, vy, hn::Mul(uy, vx));
  const floats sine = dot(ax, ay, az, nx, ny, nz);
  const floats product = hn::Mul(hn::Mul(a, b), c);
  floats cosine = hn::MulAdd(dot(ax, ay, az, bx, by, bz), c, product);
  cosine = hn::MulAdd(dot(bx, by, bz, cx, cy, cz), a, cosine);
  cosine = hn::MulAdd(dot(cx, cy, cz, ax, ay, az), b, cosine);
  // At an edge both vanish; at a face the angle is pi; at a vertex anything is near.
  // Rounding moves vertices by up to bvh_ulp, which must be little compared to the
  // distance, and that be seen in the angle.
  const floats abs_sine = hn::Abs(sine), abs_cosine = hn::Abs(cosine);
  const floats longest = hn::Max(hn::Max(a, b), c), shortest = hn::Min(hn::Min(a, b), c);
  const auto within = [&](float relative, float absolute) {
    return hn::MulAdd(hn::Set(d, relative), longest, hn::Set(d, absolute));
  };
  const auto at_edge = hn::Le(hn::Mul(hn::Max(abs_sine, abs_cosine), longest),
                              hn::Mul(product, within(0.02f, 2e-4f)));
  const auto at_face =
      hn::Le(hn::Mul(abs_sine, longest), hn::Neg(hn::Mul(cosine, within(1e-3f, 1e-4f))));
  const auto at_vertex = hn::Le(shortest, hn::Set(d, 1e-4f));
  const hn::RebindToUnsigned<lanes> du;
  const auto lane = hn::Iota(du, static_cast<uint32_t>(i));
  const auto there = hn::RebindMask(d, hn::Lt(lane, hn::Set(du, leaf.count)));
  near = hn::And(hn::Or(hn::Or(at_edge, at_face), at_vertex), there);
  return hn::IfThenElseZero(hn::AndNot(near, there), angle_of(sine, cosine));
}

// Winding numbers of the points from lane i on.
HWY_INLINE floats dipoles(const bvh_leaf& leaf, const eight_floats* areas, std::size_t i, floats px,
                          floats py, floats pz) {
  const lanes d;
  const floats x = hn::Sub(hn::Load(d, leaf.a[0] + i), px);
  const floats y = hn::Sub(hn::Load(d, leaf.a[1] + i), py);
  const floats z = hn::Sub(hn::Load(d, leaf.a[2] + i), pz);
  const floats d2 = dot(x, y, z, x, y, z);
  const floats inv = hn::Div(hn::Set(d, 1.0f), hn::Sqrt(d2));
  const floats along =
      dot(hn::Mul(x, inv), hn::Mul(y, inv), hn::Mul(z, inv), hn::Load(d, areas[0].v + i),
          hn::Load(d, areas[1].v + i), hn::Load(d, areas[2].v + i));
  return hn::IfThenElseZero(hn::Gt(d2, hn::Set(d, 1e-18f)), hn::Mul(along, hn::Mul(inv, inv)));
}

// Nodes wait in a queue rather than on a stack: the next ones are then known long before
// they are needed, so that a processor works on several at once. What a queue may have to
// hold grows with the tree; once it is full it is used as a stack, from its end, which
// needs no more room than stack_size. Leaves wait apart, so that what to do next need not
// be guessed.
struct waiting_parts {
  static constexpr std::size_t queue_size = 256, leaves_size = 64;
  std::size_t head = 0, tail = 0, leaf_count = 0;
  // stores are of whole vectors
  uint32_t nodes[queue_size + stack_size + bvh_width];
  uint32_t leaves[leaves_size + 2 * bvh_width];

  HWY_INLINE bool has_node() const { return head < tail; }
  HWY_INLINE bool has_room() const { return leaf_count < leaves_size; }
  HWY_INLINE uint32_t next() { return tail < queue_size ? nodes[head++] : nodes[--tail]; }
  HWY_INLINE void add(hn::Vec<hn::RebindToUnsigned<lanes>> children, hn::Mask<lanes> open) {
    const hn::RebindToUnsigned<lanes> du;
    const hn::RebindToSigned<lanes> di;
    const auto chosen = hn::RebindMask(du, open);
    const auto leaf = hn::RebindMask(du, hn::Lt(hn::BitCast(di, children), hn::Zero(di)));
    const auto open_nodes = hn::AndNot(leaf, chosen), open_leaves = hn::And(leaf, chosen);
    hn::StoreU(hn::Compress(children, open_nodes), du, nodes + tail);
    tail += hn::CountTrue(du, open_nodes);
    hn::StoreU(hn::Compress(children, open_leaves), du, leaves + leaf_count);
    leaf_count += hn::CountTrue(du, open_leaves);
  }
};

HWY_INLINE void prefetch(const bvh_leaf& leaf) {
  const char* const p = reinterpret_cast<const char*>(&leaf);
  for (std::size_t i = 0; i < sizeof(bvh_leaf); i += 64) hwy::Prefetch(p + i);
}

template <int order, bool points>
HWY_INLINE void add_all(fast_query& q) {
  const lanes d;
  const hn::RebindToUnsigned<lanes> du;
  const fast_winding_data& fast = *q.data;
  const bvh_data& data = *fast.tree.data();
  constexpr std::size_t stride = rows_of(order);
  const eight_floats* HWY_RESTRICT const rows = fast.rows.data();
  const floats px = hn::Set(d, static_cast<float>(q.p.x));
  const floats py = hn::Set(d, static_cast<float>(q.p.y));
  const floats pz = hn::Set(d, static_cast<float>(q.p.z));
  const floats beta2 = hn::Set(d, q.beta2);
  constexpr double turn = 6.283185307179586477;
  waiting_parts waiting;
  waiting.nodes[waiting.tail++] = 0;
  double sum = 0;  // of what has been taken from the lanes
  while (waiting.has_node()) {
    floats expanded = hn::Zero(d), angles = hn::Zero(d);
    // floats add up little enough before they lose digits
    for (int turns = 0; turns < 256 && waiting.has_node() && waiting.has_room(); ++turns) {
      const eight_floats* const node = rows + waiting.next() * stride;
      for (std::size_t i = 0; i < bvh_width; i += hn::Lanes(d)) {
        hn::Mask<lanes> open;
        expanded = hn::Add(expanded, expand<order>(node, i, px, py, pz, beta2, open));
        waiting.add(hn::BitCast(du, hn::Load(d, node[row_child].v + i)), open);
      }
    }
    const std::size_t count = waiting.leaf_count;
    const auto index_of = [&](std::size_t k) { return waiting.leaves[k] & ~bvh_leaf_bit; };
    for (std::size_t k = 0; k < count; ++k) {
      // of a large mesh, memory takes longer than what is done with it
      if (k + 2 < count) prefetch(data.leaves[index_of(k + 2)]);
      const uint32_t index = index_of(k);
      const bvh_leaf& leaf = data.leaves[index];
      for (std::size_t i = 0; i < bvh_width; i += hn::Lanes(d)) {
        if constexpr (points) {
          expanded = hn::Add(expanded, dipoles(leaf, &fast.areas[3 * index], i, px, py, pz));
        } else {
          hn::Mask<lanes> near;
          angles = hn::Add(angles, half_angles(leaf, i, px, py, pz, near));
          for (uint32_t bits = mask_bits(near); bits != 0; bits &= bits - 1) {
            const uint32_t lane =
                static_cast<uint32_t>(i) + static_cast<uint32_t>(std::countr_zero(bits));
            sum += half_angle(fast, leaf.first + lane, q.p) / turn;
          }
        }
      }
    }
    waiting.leaf_count = 0;
    sum += static_cast<double>(hn::GetLane(hn::SumOfLanes(d, expanded))) +
           static_cast<double>(hn::GetLane(hn::SumOfLanes(d, angles))) / turn;
  }
  q.sum = sum;
}

void add_fast_winding(fast_query& q) {
  const int order = q.data->order;
  if (q.data->points) {
    if (order == 1) return add_all<1, true>(q);
    if (order == 2) return add_all<2, true>(q);
    return add_all<3, true>(q);
  }
  if (order == 1) return add_all<1, false>(q);
  if (order == 2) return add_all<2, false>(q);
  return add_all<3, false>(q);
}

}  // namespace wisp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wisp {
namespace {
HWY_EXPORT(add_fast_winding);
}  // namespace

void run_fast_winding(fast_query& q) { HWY_DYNAMIC_DISPATCH(add_fast_winding)(q); }

}  // namespace wisp
#endif  // HWY_ONCE
