// Special functions on vectors. Compiled once for each instruction set, hence the
// odd guard. Where there is fused multiply-add it is used; division and square
// root are the exact ones, so that all processors with it agree to the last bit.
// Polynomials are near-minimax (Lawson's reweighted least squares, 30 digits).

#if defined(WISP_HAIR_BATCH_MATH) == defined(HWY_TARGET_TOGGLE)
#ifdef WISP_HAIR_BATCH_MATH
#undef WISP_HAIR_BATCH_MATH
#else
#define WISP_HAIR_BATCH_MATH
#endif

#include <hwy/highway.h>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace wisp::hair::batch::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using floats = hn::ScalableTag<float>;
using ints = hn::RebindToSigned<floats>;
using vec = hn::Vec<floats>;
using int_vec = hn::Vec<ints>;

HWY_INLINE vec all(float x) { return hn::Set(floats(), x); }

// The polynomial of coefficients c at t, by even and odd parts: two chains of half
// the length run side by side.
template <std::size_t N>
HWY_INLINE vec polynomial(const float (&c)[N], vec t) {
  vec s = t * t;
  vec even = all(c[(N - 1) / 2 * 2]);
  vec odd = all(c[N / 2 * 2 - 1]);
  for (std::size_t i = (N - 1) / 2; i-- > 0;) even = hn::MulAdd(even, s, all(c[2 * i]));
  for (std::size_t i = N / 2 - 1; i-- > 0;) odd = hn::MulAdd(odd, s, all(c[2 * i + 1]));
  return hn::MulAdd(odd, t, even);
}

// x k to the nearest integer, for |x k| < 2^21: the sum has no room for a fraction.
// Its last bits are the integer.
inline constexpr float round_shift = 12582912;  // 1.5 * 2^23
HWY_INLINE vec shifted_integer(vec x, float k) { return hn::MulAdd(x, all(k), all(round_shift)); }

// exp(x) = power + power * rest, for x <= 0, with power a power of 2 and 0 below -87.
struct exp_parts {
  vec power, rest;
};
HWY_INLINE exp_parts split_exp(vec x) {
  constexpr float c[] = {1.000000011f,   0.5000000081f,   0.166665051f,
                         0.04166624067f, 0.008369165036f, 0.001394858447f};
  vec lowest = all(-87.0f);
  vec y = hn::Max(x, lowest);
  vec shifted = shifted_integer(y, 1.44269504f);
  vec n = shifted - all(round_shift);
  vec r = hn::NegMulAdd(n, all(0.693359375f), y);  // y - n log(2)
  r = hn::MulAdd(n, all(2.12194440e-4f), r);
  int_vec bits =
      hn::ShiftLeft<23>(hn::BitCast(ints(), shifted)) + hn::Set(ints(), std::int32_t(127) << 23);
  vec power = hn::IfThenElseZero(x > lowest, hn::BitCast(floats(), bits));
  return {power, r * polynomial(c, r)};
}
HWY_INLINE vec exp_nonpositive(vec x) {
  exp_parts e = split_exp(x);
  return hn::MulAdd(e.power, e.rest, e.power);
}

// log(x) for normal x > 0; exact digits near 1.
HWY_INLINE vec log_of(vec x) {
  constexpr float c[] = {-0.4999998829f, 0.333333255f,   -0.2500158649f,
                         0.2000198618f,  -0.1660901742f, 0.1418158262f,
                         -0.1324326214f, 0.1290595635f,  -0.07622917985f};
  // x = m 2^n, with m from sqrt(1/2) to sqrt(2).
  int_vec bits = hn::BitCast(ints(), x);
  int_vec n = hn::ShiftRight<23>(bits - hn::Set(ints(), 0x3f3504f3));
  vec f = hn::BitCast(floats(), bits - hn::ShiftLeft<23>(n)) - all(1);
  vec e = hn::ConvertTo(floats(), n);
  vec rest = hn::MulAdd(e, all(-2.12194440e-4f), f * f * polynomial(c, f));
  return hn::MulAdd(e, all(0.693359375f), f + rest);
}

// The angle of the direction (x, y), in [-pi, pi]; 0 or pi at the origin.
HWY_INLINE vec angle_of(vec y, vec x) {
  constexpr float c[] = {0.9999999864f,  -0.3333309388f,  0.1999305251f,
                         -0.1420712057f, 0.1065462502f,   -0.07533562624f,
                         0.0430380101f,  -0.01628216341f, 0.002903339419f};
  vec ax = hn::Abs(x), ay = hn::Abs(y);
  vec large = hn::Max(ax, ay), small = hn::Min(ax, ay);
  vec a = hn::IfThenElseZero(large > all(0), small / large);
  vec r = a * polynomial(c, a * a);
  r = hn::IfThenElse(ay > ax, all(1.57079633f) - r, r);
  r = hn::IfThenElse(x < all(0), all(3.14159265f) - r, r);
  return hn::CopySign(r, y);
}

// The angle x brought to [-pi, pi], for |x| < 1000.
HWY_INLINE vec wrap_angle(vec x) {
  vec n = shifted_integer(x, 0.159154943f) - all(round_shift);
  vec r = hn::NegMulAdd(n, all(6.28125f), x);
  return hn::NegMulAdd(n, all(0.00193530717958647692f), r);  // 2 pi in two parts
}

struct cos_sin {
  vec cos, sin;
};
// For |x| < 1000.
HWY_INLINE cos_sin cos_sin_of(vec x) {
  constexpr float sine_of[] = {-0.1666666666f, 0.008333331867f, -0.0001984008237f, 2.724935206e-6f};
  constexpr float cosine_of[] = {0.04166666465f, -0.0013888301f, 2.454748664e-5f};
  vec shifted = shifted_integer(x, 0.636619772f);
  vec n = shifted - all(round_shift);
  vec r = hn::NegMulAdd(n, all(1.5703125f), x);  // x - n pi / 2
  r = hn::NegMulAdd(n, all(4.83826795e-4f), r);
  vec s = r * r;
  vec sine = hn::MulAdd(r * s, polynomial(sine_of, s), r);
  vec cosine = hn::MulAdd(s * s, polynomial(cosine_of, s), hn::NegMulAdd(all(0.5f), s, all(1)));
  int_vec quadrant = hn::BitCast(ints(), shifted);
  int_vec one = hn::Set(ints(), 1);
  auto swap = hn::RebindMask(floats(), (quadrant & one) == one);
  vec c = hn::IfThenElse(swap, sine, cosine), d = hn::IfThenElse(swap, cosine, sine);
  // Bit 1 of the quadrant, and of the next one, are the signs.
  int_vec sign = hn::Set(ints(), INT32_MIN);
  int_vec flip_sin = hn::ShiftLeft<30>(quadrant) & sign;
  int_vec flip_cos = hn::ShiftLeft<30>(quadrant + one) & sign;
  return {hn::Xor(c, hn::BitCast(floats(), flip_cos)), hn::Xor(d, hn::BitCast(floats(), flip_sin))};
}

// exp(-x) I0(x) over w, for x >= 0 and w in [1, 4], and 1 / w: one division serves
// both. The polynomials: I0e(x) over [0, split] in 2 x / split - 1, and
// sqrt(x) I0e(x) over [split, inf) in 2 split / x - 1, each with a relative error
// of 7e-8.
HWY_INLINE vec bessel_i0e_over(vec x, vec w) {
  constexpr float split = 3.5f;
  constexpr float small[] = {0.3345586417f,    -0.2036632561f,   0.1655046566f,
                             -0.1252158505f,   0.08278209716f,   -0.04750986034f,
                             0.02390065086f,   -0.01055470902f,  0.004037309473f,
                             -0.001487215073f, 0.0006178285816f, -0.0001678680011f};
  constexpr float large[] = {0.4067518142f,     0.008653401248f,  0.00107813148f,
                             0.0003448361224f,  0.0001145662831f, -6.033474774e-05f,
                             -8.042901299e-05f, 3.538536596e-06f, 1.966427576e-05f};
  vec m = hn::Max(x, all(split));
  vec q = all(1) / (m * w);
  vec inv_m = q * w, inv_w = q * m;
  vec of_large = inv_m * hn::Sqrt(m) * polynomial(large, hn::MulSub(all(2 * split), inv_m, all(1)));
  vec of_small = polynomial(small, hn::MulSub(all(2 / split), x, all(1)));
  return hn::IfThenElse(x < all(split), of_small, of_large) * inv_w;
}

}  // namespace wisp::hair::batch::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
