// Evaluates the boundary's part of a winding number.
//
// With v the ray's direction and, of a vertex relative to p, t its part across v and
// A = |a| - v.a, the angle of an edge is
//   atan2(-v.(a x b), t_a.t_b + A B):
// the form of numerics that cancels nothing, as A = |t|^2 / (|a| + v.a) is computed so
// where v.a > 0. Angles are not summed but the complex numbers that have them are
// multiplied, eight sums side by side, and how often the product passes the negative
// real axis is counted: one atan2 for all.
//
// An angle jumps by 2 pi where the ray passes its edge. There its sign is that of the
// exact predicate that crossings are decided by.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/boundary.h"
#include "src/orient2d.h"

// Vectors whose size the compiler does not know are no wider than what NEON has.
#ifndef HWY_DISABLED_TARGETS
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/boundary_kernels.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

#include "src/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace wisp::HWY_NAMESPACE {

using edge_lanes = hn::CappedTag<double, boundary_width>;
using edge_doubles = hn::Vec<edge_lanes>;

// The ray in the order u, v, k, k along it.
struct edge_ray {
  int u, v, k;
  dvec3 p;
  double sign;
};

// |a| - sign * k, without cancellation, of a vertex at (u, v, k); one that the ray
// passes exactly is moved off it as p is moved by (e, e^2).
HWY_INLINE edge_doubles along(edge_doubles& u, edge_doubles& v, edge_doubles k, edge_doubles sign) {
  const edge_lanes d;
  const auto zero = hn::Zero(d);
  const auto across2 = hn::MulAdd(u, u, hn::Mul(v, v));
  const auto forward = hn::Mul(sign, k);
  const auto sum = hn::Add(hn::Sqrt(hn::MulAdd(k, k, across2)), hn::Abs(forward));
  const auto ahead = hn::Gt(forward, zero);
  const auto at = hn::IfThenElse(ahead, hn::Div(across2, sum), sum);
  const auto on_ray = hn::And(ahead, hn::Eq(across2, zero));
  u = hn::IfThenElse(on_ray, hn::Set(d, -1.0), u);
  v = hn::IfThenElse(on_ray, zero, v);
  return at;
}

// Of lanes whose angle is at the jump: the sign from the exact predicate, and an
// imaginary part that is not zero.
HWY_NOINLINE void settle(double* HWY_RESTRICT x, double* HWY_RESTRICT y, uint32_t lanes,
                         const boundary_leaf& leaf, std::size_t first, const edge_ray& ray) {
  for (std::size_t i = 0; i < boundary_width; ++i) {
    if ((lanes >> i & 1) == 0) continue;
    const std::size_t e = first + i;
    const dvec2 a{leaf.a[ray.u][e], leaf.a[ray.v][e]}, b{leaf.b[ray.u][e], leaf.b[ray.v][e]};
    const int turn = orient2d_moved(a, b, dvec2{ray.p[ray.u], ray.p[ray.v]});
    if (turn == 0) continue;
    const double size = std::max(std::abs(y[i]), 1e-200 * std::abs(x[i]));
    y[i] = ray.sign * turn > 0 ? -size : size;
  }
}

// A product of complex numbers side by side, and how often its argument left (-pi, pi].
struct angle_product {
  edge_doubles re, im, turns;
};

HWY_INLINE void multiply(angle_product& z, edge_doubles x, edge_doubles y) {
  const edge_lanes d;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0);
  const auto re = hn::MulSub(z.re, x, hn::Mul(z.im, y));
  const auto im = hn::MulAdd(z.re, y, hn::Mul(z.im, x));
  const auto was = hn::Lt(z.im, zero), by = hn::Lt(y, zero), is = hn::Lt(im, zero);
  const auto over = hn::AndNot(hn::Or(was, by), is);
  const auto under = hn::AndNot(is, hn::And(was, by));
  z.turns = hn::Add(z.turns, hn::IfThenElseZero(over, one));
  z.turns = hn::Sub(z.turns, hn::IfThenElseZero(under, one));
  const auto size = hn::Add(hn::Abs(re), hn::Abs(im));
  // where p is on the edge there is no angle
  const auto some = hn::Gt(size, hn::Set(d, 1e-290));
  const auto inverse = hn::Div(one, hn::IfThenElse(some, size, one));
  z.re = hn::IfThenElse(some, hn::Mul(re, inverse), z.re);
  z.im = hn::IfThenElse(some, hn::Mul(im, inverse), z.im);
}

// The argument of the product of all lanes, turns included.
HWY_INLINE double argument(const angle_product& z) {
  const edge_lanes d;
  HWY_ALIGN double re[boundary_width];
  HWY_ALIGN double im[boundary_width];
  hn::Store(z.re, d, re);
  hn::Store(z.im, d, im);
  double turns = hn::GetLane(hn::SumOfLanes(d, z.turns)), x = re[0], y = im[0];
  // of eight numbers no larger than 1 and no smaller than 1 / 2
  for (std::size_t i = 1; i < hn::Lanes(d); ++i) {
    const double u = x * re[i] - y * im[i], v = x * im[i] + y * re[i];
    if (y >= 0 && im[i] >= 0 && v < 0) turns += 1;
    if (y < 0 && im[i] < 0 && v >= 0) turns -= 1;
    x = u;
    y = v;
  }
  return std::atan2(y, x) + 2 * std::numbers::pi * turns;
}

HWY_INLINE void add_edges(const boundary_leaf& leaf, std::size_t i, const edge_ray& ray,
                          angle_product& z) {
  const edge_lanes d;
  const auto sign = hn::Set(d, ray.sign), zero = hn::Zero(d);
  const auto pu = hn::Set(d, ray.p[ray.u]), pv = hn::Set(d, ray.p[ray.v]);
  const auto pk = hn::Set(d, ray.p[ray.k]);
  auto au = hn::Sub(hn::Load(d, leaf.a[ray.u] + i), pu);
  auto av = hn::Sub(hn::Load(d, leaf.a[ray.v] + i), pv);
  const auto ak = hn::Sub(hn::Load(d, leaf.a[ray.k] + i), pk);
  auto bu = hn::Sub(hn::Load(d, leaf.b[ray.u] + i), pu);
  auto bv = hn::Sub(hn::Load(d, leaf.b[ray.v] + i), pv);
  const auto bk = hn::Sub(hn::Load(d, leaf.b[ray.k] + i), pk);
  const auto a = along(au, av, ak, sign), b = along(bu, bv, bk, sign);

  // no fused multiplication here: the bound of orient2d is for rounded products
  const auto left = hn::Mul(au, bv), right = hn::Mul(av, bu);
  const auto turn = hn::Sub(left, right);
  const auto bound =
      hn::Mul(hn::Add(hn::Abs(left), hn::Abs(right)), hn::Set(d, 3.3306690738754716e-16));
  auto x = hn::MulAdd(a, b, hn::MulAdd(au, bu, hn::Mul(av, bv)));
  auto y = hn::Neg(hn::Mul(sign, turn));
  const auto unsure = hn::And(hn::Le(hn::Abs(turn), bound), hn::Le(x, zero));
  if (HWY_UNLIKELY(!hn::AllFalse(d, unsure))) {
    HWY_ALIGN double xs[boundary_width];
    HWY_ALIGN double ys[boundary_width];
    hn::Store(x, d, xs);
    hn::Store(y, d, ys);
    settle(xs, ys, mask_bits(d, unsure), leaf, i, ray);
    y = hn::Load(d, ys);
  }
  multiply(z, x, y);
}

HWY_INLINE void add_leaf(const boundary_leaf& leaf, const edge_ray& ray, angle_product& z) {
  for (std::size_t i = 0; i < boundary_width; i += hn::Lanes(edge_lanes())) {
    add_edges(leaf, i, ray, z);
  }
}

// Chords wait here until there are eight.
struct waiting_chords {
  boundary_leaf edges;
  std::size_t count = 0;
};

// 4 pi times the winding numbers of the clusters from lane i on, as series.
HWY_INLINE edge_doubles series(const boundary_group& g, std::size_t i, edge_doubles x,
                               edge_doubles y, edge_doubles z, edge_doubles r2) {
  const edge_lanes d;
  const auto load = [&](const double* from) { return hn::Load(d, from + i); };
  const auto one = hn::Set(d, 1.0);
  const auto inv2 = hn::Div(one, hn::Max(r2, hn::Set(d, 1e-300)));
  const auto inv3 = hn::Mul(inv2, hn::Sqrt(inv2));
  const auto sum3 = [](edge_doubles ax, edge_doubles bx, edge_doubles ay, edge_doubles by,
                       edge_doubles az, edge_doubles bz) {
    return hn::MulAdd(ax, bx, hn::MulAdd(ay, by, hn::Mul(az, bz)));
  };
  const auto n_r = sum3(load(g.dipole[0]), x, load(g.dipole[1]), y, load(g.dipole[2]), z);

  const auto xx = hn::Mul(x, x), yy = hn::Mul(y, y), zz = hn::Mul(z, z);
  const auto qxx = load(g.quadrupole[0]), qyy = load(g.quadrupole[1]), qzz = load(g.quadrupole[2]);
  const auto off = sum3(load(g.quadrupole[3]), hn::Mul(x, y), load(g.quadrupole[4]), hn::Mul(y, z),
                        load(g.quadrupole[5]), hn::Mul(z, x));
  const auto q_rr = hn::MulAdd(hn::Set(d, 2.0), off, sum3(qxx, xx, qyy, yy, qzz, zz));
  const auto q_trace = hn::Add(qxx, hn::Add(qyy, qzz));

  const auto oxxx = load(g.octupole[0]), oyyy = load(g.octupole[1]), ozzz = load(g.octupole[2]);
  const auto oxxy = load(g.octupole[3]), oxxz = load(g.octupole[4]), oyyx = load(g.octupole[5]);
  const auto oyyz = load(g.octupole[6]), ozzx = load(g.octupole[7]), ozzy = load(g.octupole[8]);
  const auto oxyz = load(g.octupole[9]);
  const auto o_r = sum3(hn::Add(oxxx, hn::Add(oyyx, ozzx)), x, hn::Add(oyyy, hn::Add(oxxy, ozzy)),
                        y, hn::Add(ozzz, hn::Add(oxxz, oyyz)), z);
  const auto cubes = sum3(oxxx, hn::Mul(xx, x), oyyy, hn::Mul(yy, y), ozzz, hn::Mul(zz, z));
  const auto mixed = hn::Add(hn::Mul(xx, hn::MulAdd(oxxy, y, hn::Mul(oxxz, z))),
                             hn::Add(hn::Mul(yy, hn::MulAdd(oyyx, x, hn::Mul(oyyz, z))),
                                     hn::Mul(zz, hn::MulAdd(ozzx, x, hn::Mul(ozzy, y)))));
  const auto o_rrr = hn::MulAdd(hn::Set(d, 6.0), hn::Mul(oxyz, hn::Mul(x, hn::Mul(y, z))),
                                hn::MulAdd(hn::Set(d, 3.0), mixed, cubes));

  // n.r + (tr Q - 3 r.Q r / r^2) + (15 O(r, r, r) / r^2 - 9 O(r)) / (2 r^2), over r^3
  const auto second = hn::NegMulAdd(hn::Mul(hn::Set(d, 3.0), inv2), q_rr, q_trace);
  const auto third =
      hn::Mul(hn::Mul(hn::Set(d, 1.5), inv2),
              hn::MulSub(hn::Mul(hn::Set(d, 5.0), inv2), o_rrr, hn::Mul(hn::Set(d, 3.0), o_r)));
  return hn::Mul(inv3, hn::Add(n_r, hn::Add(second, third)));
}

double boundary_angle(const boundary_tree& tree, const dvec3& p, int axis, double direction) {
  const edge_lanes d;
  edge_ray ray;
  ray.k = axis;
  ray.u = (axis + 1) % 3;
  ray.v = (axis + 2) % 3;
  ray.p = p;
  ray.sign = direction;
  const auto zero = hn::Zero(d);
  angle_product z = {hn::Set(d, 1.0), zero, zero};
  auto far_sum = zero;
  waiting_chords chords;
  const auto flush = [&] {
    for (std::size_t i = chords.count; i < boundary_width; ++i) {
      for (int k = 0; k < 3; ++k) chords.edges.a[k][i] = chords.edges.b[k][i] = p[k] + 1;
    }
    add_leaf(chords.edges, ray, z);
    chords.count = 0;
  };

  struct open_group {
    uint32_t level, group;
  };
  open_group stack[boundary_width * 12];
  std::size_t top = 0;
  stack[top++] = {static_cast<uint32_t>(tree.levels.size() - 1), 0};
  const auto px = hn::Set(d, p.x), py = hn::Set(d, p.y), pz = hn::Set(d, p.z);
  const auto pu = hn::Set(d, p[ray.u]), pv = hn::Set(d, p[ray.v]), pk = hn::Set(d, p[ray.k]);
  while (top > 0) {
    const open_group o = stack[--top];
    const boundary_group& g = tree.levels[o.level][o.group];
    uint32_t far = 0;
    for (std::size_t i = 0; i < boundary_width; i += hn::Lanes(d)) {
      const auto x = hn::Sub(hn::Load(d, g.center[0] + i), px);
      const auto y = hn::Sub(hn::Load(d, g.center[1] + i), py);
      const auto zz = hn::Sub(hn::Load(d, g.center[2] + i), pz);
      const auto r2 = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(zz, zz)));
      const auto beside_u = hn::Or(hn::Lt(hn::Load(d, g.max[ray.u] + i), pu),
                                   hn::Gt(hn::Load(d, g.min[ray.u] + i), pu));
      const auto beside_v = hn::Or(hn::Lt(hn::Load(d, g.max[ray.v] + i), pv),
                                   hn::Gt(hn::Load(d, g.min[ray.v] + i), pv));
      const auto behind = direction > 0 ? hn::Lt(hn::Load(d, g.max[ray.k] + i), pk)
                                        : hn::Gt(hn::Load(d, g.min[ray.k] + i), pk);
      const auto missed = hn::Or(hn::Or(beside_u, beside_v), behind);
      const auto is_far = hn::And(missed, hn::Gt(r2, hn::Load(d, g.far2 + i)));
      if (hn::AllFalse(d, is_far)) continue;
      far_sum = hn::Add(far_sum, hn::IfThenElseZero(is_far, series(g, i, x, y, zz, r2)));
      far |= mask_bits(d, is_far) << i;
    }
    for (uint32_t i = 0; i < g.count; ++i) {
      const uint32_t child = o.group * boundary_width + i;
      if ((far >> i & 1) == 0) {
        if (o.level == 0) {
          add_leaf(tree.leaves[child], ray, z);
        } else {
          stack[top++] = {o.level - 1, child};
        }
        continue;
      }
      for (std::size_t c = 0; c < 2; ++c) {
        if ((g.chords[i] >> c & 1) == 0) continue;
        for (std::size_t k = 0; k < 3; ++k) {
          chords.edges.a[k][chords.count] = g.chord[c][k][i];
          chords.edges.b[k][chords.count] = g.chord[c][k + 3][i];
        }
        if (++chords.count == boundary_width) flush();
      }
    }
  }
  if (chords.count > 0) flush();

  const double angle = argument(z);
  return angle + hn::GetLane(hn::SumOfLanes(d, far_sum)) / 2;
}

}  // namespace wisp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wisp {
namespace {

HWY_EXPORT(boundary_angle);

}  // namespace

double boundary_winding(const boundary_tree& tree, const dvec3& p, int axis, double sign) {
  if (tree.edges == 0) return 0;
  return HWY_DYNAMIC_DISPATCH(boundary_angle)(tree, p, axis, sign) / (2 * std::numbers::pi);
}

}  // namespace wisp
#endif  // HWY_ONCE
