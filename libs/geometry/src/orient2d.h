#pragma once

// Exact signs of orient2d and orient3d: a filter in double, and behind it arithmetic
// with expansions (Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast
// Robust Geometric Predicates, 1997). Exact for coordinates whose products neither
// overflow nor fall below what a double can hold: callers scale by a power of two.
//
// Ties of a query point are broken by simulation of simplicity (Edelsbrunner and
// Mücke 1990): the point is taken to be moved by (e, e^2) for an infinitely small e.

#include <array>
#include <cmath>
#include <cstddef>

#include "wisp/core/math.h"

namespace wisp {

// A sum of doubles that do not overlap, the largest last. Zeros are left out.
template <std::size_t Room>
class expansion {
 public:
  // Shewchuk's Grow-Expansion (theorem 10) with zero elimination.
  void add(double b) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const double a = x_[i], sum = a + b;
      const double bv = sum - a;
      const double error = (a - (sum - bv)) + (b - bv);
      b = sum;
      if (error != 0) x_[kept++] = error;
    }
    if (b != 0) x_[kept++] = b;
    count_ = kept;
  }
  void add_product(double a, double b) {
    const double product = a * b;
    if (const double error = std::fma(a, b, -product); error != 0) add(error);
    if (product != 0) add(product);
  }
  void add_product(double a, double b, double c) {
    const double ab = a * b;
    if (const double error = std::fma(a, b, -ab); error != 0) add_product(error, c);
    add_product(ab, c);
  }
  int sign() const { return count_ == 0 ? 0 : x_[count_ - 1] > 0 ? 1 : -1; }

 private:
  std::array<double, Room> x_;
  std::size_t count_ = 0;
};

// a - b without error, as a sum of two.
struct exact_difference {
  double high, low;
  exact_difference(double a, double b) : high(a - b) {
    const double bv = a - high, av = high + bv;
    low = (a - av) + (bv - b);
  }
};

inline int sign_of(double x) { return (x > 0) - (x < 0); }

// The sign of (a - p) x (b - p): positive where a, b, p turn counter-clockwise.
inline int orient2d(const dvec2& a, const dvec2& b, const dvec2& p) {
  const double left = (a.x - p.x) * (b.y - p.y), right = (a.y - p.y) * (b.x - p.x);
  const double det = left - right;
  constexpr double bound = 3.3306690738754716e-16;  // (3 + 16 eps) eps
  if (std::abs(det) > bound * (std::abs(left) + std::abs(right))) return sign_of(det);

  const exact_difference ax(a.x, p.x), ay(a.y, p.y), bx(b.x, p.x), by(b.y, p.y);
  expansion<16> e;
  for (const double x : {ax.low, ax.high}) {
    for (const double y : {by.low, by.high}) e.add_product(x, y);
  }
  for (const double y : {ay.low, ay.high}) {
    for (const double x : {bx.low, bx.high}) e.add_product(-y, x);
  }
  return e.sign();
}

// The same with p moved by (e, e^2): zero only for a == b.
inline int orient2d_moved(const dvec2& a, const dvec2& b, const dvec2& p) {
  if (const int s = orient2d(a, b, p); s != 0) return s;
  // d/de of the determinant, then d/de^2
  if (a.y != b.y) return a.y > b.y ? 1 : -1;
  return sign_of(b.x - a.x);
}

// The sign of (p - a) . ((b - a) x (c - a)): positive on the side of a triangle from
// which it is seen counter-clockwise.
inline int orient3d(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& p) {
  const dvec3 ap = a - p, bp = b - p, cp = c - p;
  const double bxcy = bp.x * cp.y, cxby = cp.x * bp.y;
  const double cxay = cp.x * ap.y, axcy = ap.x * cp.y;
  const double axby = ap.x * bp.y, bxay = bp.x * ap.y;
  const double det = ap.z * (bxcy - cxby) + bp.z * (cxay - axcy) + cp.z * (axby - bxay);
  const double permanent = (std::abs(bxcy) + std::abs(cxby)) * std::abs(ap.z) +
                           (std::abs(cxay) + std::abs(axcy)) * std::abs(bp.z) +
                           (std::abs(axby) + std::abs(bxay)) * std::abs(cp.z);
  constexpr double bound = 7.771561172376103e-16;  // (7 + 56 eps) eps
  if (std::abs(det) > bound * permanent) return -sign_of(det);

  expansion<192> e;
  const dvec3* v[3] = {&a, &b, &c};
  for (int i = 0; i < 3; ++i) {
    // the terms of the determinant with z of vertex i
    const dvec3 &r = *v[i], &s = *v[(i + 1) % 3], &t = *v[(i + 2) % 3];
    const exact_difference rz(r.z, p.z), sx(s.x, p.x), sy(s.y, p.y), tx(t.x, p.x), ty(t.y, p.y);
    for (const double z : {rz.low, rz.high}) {
      for (const double x : {sx.low, sx.high}) {
        for (const double y : {ty.low, ty.high}) e.add_product(x, y, z);
      }
      for (const double x : {tx.low, tx.high}) {
        for (const double y : {sy.low, sy.high}) e.add_product(-x, y, z);
      }
    }
  }
  return -e.sign();
}

}  // namespace wisp
