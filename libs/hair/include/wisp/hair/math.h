#pragma once

// Special functions of the hair model, in float and double from one source.
//
// In double they are the standard library's. In float they are polynomials
// without branches or calls, within a few units in the last place, so that the
// four lobes of a hair are worked on at once: with GCC and Clang by their vector
// types (128 bits, which every x86-64 and 64-bit Arm has), one by one elsewhere. They are
// pure and safe to call from any thread.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "wisp/hair/version.h"

namespace wisp::hair {

template <typename T>
inline constexpr T pi_v = static_cast<T>(3.14159265358979323846L);

template <typename T>
inline constexpr T sqr(T x) {
  return x * x;
}
template <typename T>
inline T safe_sqrt(T x) {
  return std::sqrt(std::max(T(0), x));
}

namespace detail {

#if defined(__GNUC__)
#define WISP_HAIR_LANES 4
typedef float float_lanes __attribute__((vector_size(16)));
typedef std::int32_t int_lanes __attribute__((vector_size(16)));
#endif

// What a value for one lobe or for four is made of, and its whole numbers.
template <typename T>
struct lane_traits {
  using scalar = T;
  using integer = std::int32_t;
};
#if defined(WISP_HAIR_LANES)
template <>
struct lane_traits<float_lanes> {
  using scalar = float;
  using integer = int_lanes;
};
#endif
template <typename T>
using scalar_of = typename lane_traits<T>::scalar;
template <typename T>
inline constexpr bool in_double = std::is_same_v<scalar_of<T>, double>;

template <typename T>
inline T splat(scalar_of<T> x) {
  return x - T{};
}
template <typename T>
inline typename lane_traits<T>::integer to_integer(T x) {
#if defined(WISP_HAIR_LANES)
  if constexpr (std::is_same_v<T, float_lanes>)
    return __builtin_convertvector(x, int_lanes);
  else
#endif
    return static_cast<std::int32_t>(x);
}
template <typename T>
inline T magnitude(T x) {
  if constexpr (in_double<T>)
    return std::abs(x);
  else {
    using integer = typename lane_traits<T>::integer;
    return std::bit_cast<T>(std::bit_cast<integer>(x) & 0x7fffffff);
  }
}

// Near-minimax polynomials from Chebyshev nodes (computed with 40 digits):
// I0e(x) over [0, split] in 2 x / split - 1, and sqrt(x) I0e(x) over
// [split, inf) in 2 split / x - 1.
template <typename T>
struct i0e_table;
template <>
struct i0e_table<float> {
  static constexpr float split = 4;
  static constexpr std::array<float, 14> small = {
      0.308508324f,    -0.186478067f,     0.1576866987f,    -0.1288955851f,  0.09416395074f,
      -0.06043225683f, 0.0341367233f,     -0.01712834973f,  0.007739660556f, -0.00313898161f,
      0.001102717603f, -0.0003798837007f, 0.0001628840729f, -4.591500592e-5f};
  static constexpr std::array<float, 9> large = {
      0.4056863424f,    0.007349199647f,  0.000735359117f,  0.0001882929064f, 7.789575237e-5f,
      -1.383609864e-7f, -3.270615003e-5f, -6.587468188e-6f, 6.176907676e-6f};
};
template <>
struct i0e_table<double> {
  static constexpr double split = 8;
  static constexpr std::array<double, 30> small = {
      0.207001921223986698,    -0.113004326886205484,     0.0945156285399510326,
      -0.0890434413607599057,  0.0873434161755229098,     -0.0849633809161512472,
      0.079275225907168981,    -0.0695411956174234162,    0.0567770320198432174,
      -0.0429859494522673779,  0.0301779120235688599,     -0.0196826547080824121,
      0.0119600779039633486,   -0.00679239979227157796,   0.00361712645967706184,
      -0.00181188705272955224, 0.000856315248395144677,   -0.000382901508945755908,
      0.000162405467270135905, -0.0000655095613063551374, 0.0000252022719844408925,
      -9.25059710625536915e-6, 3.22938506306783771e-6,    -1.08919642845073177e-6,
      3.67559289328829306e-7,  -1.13395236859071051e-7,   2.62733683452563946e-8,
      -7.8603697075082112e-9,  4.46937258185661538e-9,    -1.16629048784429537e-9};
  static constexpr std::array<double, 26> large = {
      0.402176509445008077,     0.00336055198366789448,  0.000136216074391867067,
      0.0000111430337875453856, 1.48384756878949387e-6,  2.97359962245212237e-7,
      8.87221430745173249e-8,   3.93243769953345857e-8,  2.15488936175862998e-8,
      7.56635248769823698e-9,   -6.75055228274028414e-9, -1.34662929483739598e-8,
      -5.39445673425943809e-9,  7.7371470337809337e-9,   7.40623504900152207e-9,
      -3.90523062371234106e-9,  -5.91556056510856003e-9, 2.10530801344034211e-9,
      3.59853629193947137e-9,   -1.1448789558755036e-9,  -1.59303547992163449e-9,
      5.12221214722838839e-10,  4.47891818479118163e-10, -1.50661136861014745e-10,
      -5.90502457399514778e-11, 2.08208358527931059e-11};
};

// The polynomial of coefficients c at t, by even and odd parts: two chains of
// half the length run side by side.
template <typename T, typename S, std::size_t N>
inline T polynomial(const std::array<S, N>& c, T t) {
  T s = t * t;
  T even = splat<T>(c[(N - 1) / 2 * 2]);
  for (std::size_t i = (N - 1) / 2; i-- > 0;) even = even * s + c[2 * i];
  T odd = splat<T>(c[N / 2 * 2 - 1]);
  for (std::size_t i = N / 2 - 1; i-- > 0;) odd = odd * s + c[2 * i + 1];
  return even + t * odd;
}

// y, with the compiler not knowing what it follows from. Programs that use these headers
// may well be compiled with -ffast-math, which takes (x + s) - s for x, and multiplies out
// a product with it so that x is lost beside s.
template <typename T>
inline T opaque(T y) {
#if defined(__GNUC__) && defined(__SSE2__)
  asm("" : "+x"(y));
#elif defined(__GNUC__) && defined(__aarch64__)
  asm("" : "+w"(y));
#elif defined(__GNUC__)
  asm("" : "+m"(y));
#else
  volatile T kept = y;
  y = kept;
#endif
  return y;
}

// x to the nearest integer, for |x| < 2^22 in float: the sum has no room for a
// fraction. Unlike std::nearbyint it is no call.
template <typename T>
inline T nearest(T x) {
  if constexpr (in_double<T>) {
    return std::nearbyint(x);
  } else {
    constexpr float shift = 12582912;  // 1.5 * 2^23
    return opaque<T>(opaque<T>(x + shift) - shift);
  }
}

// exp(x) for x <= 0, of any size; below -87 it is 0 in float.
template <typename T>
inline T exp_nonpositive(T x) {
  if constexpr (in_double<T>) {
    return std::exp(x);
  } else {
    constexpr std::array<float, 7> c = {1.0f,           1.00000004f,    0.5000000114f,
                                        0.1666640526f,  0.04166620004f, 0.00837597082f,
                                        0.001394978292f};
    T lowest = splat<T>(-87.0f);
    T y = x > lowest ? x : lowest;
    T n = nearest<T>(y * 1.44269504f);
    T r = (y - n * 0.693359375f) + n * 2.12194440e-4f;  // y - n log(2)
    T power = std::bit_cast<T>((to_integer(n) + 127) << 23);
    return x > lowest ? polynomial<T>(c, r) * power : T{};
  }
}

// 1 / sqrt(x) for x > 0.
template <typename T>
inline T inverse_sqrt(T x) {
  if constexpr (in_double<T>) {
    return 1 / std::sqrt(x);
  } else {
    // A first guess from the exponent, and three steps of Newton.
    using integer = typename lane_traits<T>::integer;
    T y = std::bit_cast<T>(0x5f375a86 - (std::bit_cast<integer>(x) >> 1));
    T half = 0.5f * x;
    y = y * (1.5f - half * y * y);
    y = y * (1.5f - half * y * y);
    return y + y * (0.5f - half * y * y);
  }
}

// The angle of the direction (x, y), in [-pi, pi]; 0 at the origin, where
// std::atan2 would ask for the sign of x.
inline double angle_of(double y, double x) { return std::atan2(y, x + 0.0); }
inline float angle_of(float y, float x) {
  float ax = std::abs(x), ay = std::abs(y);
  float large = std::max(ax, ay), small = std::min(ax, ay);
  float a = large > 0 ? small / large : 0;
  float s = a * a;
  constexpr std::array<float, 9> c = {0.9999999842f,  -0.3333306678f, 0.1999248358f,
                                      -0.1420257051f, 0.106367541f,   -0.07495445443f,
                                      0.04258760746f, -0.0160050305f, 0.002834064299f};
  float r = a * polynomial<float>(c, s);
  r = ay > ax ? 1.57079633f - r : r;
  r = x < 0 ? 3.14159265f - r : r;
  return std::copysign(r, y);
}

// The angle whose sine is x and whose cosine, >= 0, is c: near the ends of its
// range the sine alone does not tell the angle.
template <typename T>
inline T arc_sine(T x, T c) {
  if constexpr (in_double<T>) {
    return std::atan2(x, c);
  } else {
    constexpr std::array<float, 5> k = {0.1666667276f, 0.07498809176f, 0.04501070006f,
                                        0.02649427679f, 0.03820645206f};
    T a = magnitude<T>(x);
    auto steep = a > splat<T>(0.7f);
    // The smaller of two legs, of an angle t below 46 degrees, and the larger:
    // sin(t / 2) = small / sqrt(2 (1 + large)).
    T small = steep ? c : a, large = steep ? a : c;
    T half = small * inverse_sqrt<T>(2.0f + 2.0f * large);
    T s = half * half;
    T t = 2.0f * (half + half * s * polynomial<T>(k, s));
    T angle = steep ? 1.57079633f - t : t;
    using integer = typename lane_traits<T>::integer;
    return std::bit_cast<T>(std::bit_cast<integer>(angle) |
                            (std::bit_cast<integer>(x) & std::numeric_limits<std::int32_t>::min()));
  }
}

// f of four numbers, or of four pairs, at once where there are lanes for it.
template <typename T, typename F, typename... Xs>
inline std::array<T, 4> in_lanes(F&& f, const Xs&... xs) {
  std::array<T, 4> y;
#if defined(WISP_HAIR_LANES)
  if constexpr (std::is_same_v<T, float>) {
    auto load = [](const std::array<T, 4>& x) { return float_lanes{x[0], x[1], x[2], x[3]}; };
    float_lanes v = f(load(xs)...);
    std::memcpy(y.data(), &v, sizeof(v));
    return y;
  }
#endif
  for (std::size_t i = 0; i < 4; i++) y[i] = f(xs[i]...);
  return y;
}

// (cos x, sin x), for |x| < 1000 in float.
template <typename T>
struct cos_sin {
  T cos, sin;
};
inline cos_sin<double> cos_sin_of(double x) { return {std::cos(x), std::sin(x)}; }
inline cos_sin<float> cos_sin_of(float x) {
  float n = nearest(x * 0.636619772f);
  float r = (x - n * 1.5703125f) - n * 4.83826795e-4f;  // x - n pi / 2
  float s = r * r;
  constexpr std::array<float, 4> sine_of = {-0.1666666666f, 0.008333331867f, -0.0001984008237f,
                                            2.724935206e-6f};
  constexpr std::array<float, 3> cosine_of = {0.04166666465f, -0.0013888301f, 2.454748664e-5f};
  float sine = r + r * s * polynomial<float>(sine_of, s);
  float cosine = (1 - 0.5f * s) + s * s * polynomial<float>(cosine_of, s);
  auto quadrant = static_cast<std::int32_t>(n);
  bool swap = (quadrant & 1) != 0;
  float c = swap ? sine : cosine;
  float d = swap ? cosine : sine;
  return {((quadrant + 1) & 2) != 0 ? -c : c, (quadrant & 2) != 0 ? -d : d};
}

}  // namespace detail

// exp(-x) I0(x) for x >= 0, I0 the modified Bessel function of the first kind.
// The relative error is below 7e-7 in float and 2e-15 in double for every x;
// the two forms meet within rounding.
template <typename T>
inline T bessel_i0e(T x) {
  using S = detail::scalar_of<T>;
  using table = detail::i0e_table<S>;
  T split = detail::splat<T>(table::split);
  auto below = x < split;
  T y = detail::inverse_sqrt<T>(below ? split : x);
  T t = below ? x * (2 / table::split) - S(1) : (2 * table::split) * (y * y) - S(1);
  T small = detail::polynomial<T>(table::small, t);
  T large = y * detail::polynomial<T>(table::large, t);
  return below ? small : large;
}

// The angle x brought to [-pi, pi].
template <typename T>
inline T wrap_angle(T x) {
  using S = detail::scalar_of<T>;
  T n = detail::nearest<T>(x * (1 / (2 * pi_v<S>)));
  if constexpr (detail::in_double<T>)
    return x - n * (2 * pi_v<S>);
  else
    return (x - n * 6.28125f) - n * 0.00193530717958647692f;  // 2 pi in two parts
}

}  // namespace wisp::hair
