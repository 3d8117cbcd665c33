#pragma once

// Special functions of the hair model, in float and double from one source.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <type_traits>

namespace wisp::hair {

template <typename T>
inline constexpr T pi_v = static_cast<T>(3.14159265358979323846L);

template <typename T>
inline T sqr(T x) {
  return x * x;
}
template <typename T>
inline T safe_sqrt(T x) {
  return std::sqrt(std::max(T(0), x));
}
template <typename T>
inline T safe_asin(T x) {
  return std::asin(std::clamp(x, T(-1), T(1)));
}

namespace detail {

template <typename T, std::size_t N>
inline T horner(const std::array<T, N>& c, T t) {
  T r = c[N - 1];
  for (std::size_t i = N - 1; i-- > 0;) r = r * t + c[i];
  return r;
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

}  // namespace detail

// exp(-x) I0(x) for x >= 0, I0 the modified Bessel function of the first kind.
// The relative error is below 2e-7 in float and 2e-15 in double for every x;
// the two forms meet within rounding.
template <typename T>
inline T bessel_i0e(T x) {
  using table = detail::i0e_table<T>;
  if (x <= table::split) return detail::horner(table::small, x * (2 / table::split) - 1);
  T r = 1 / x;
  return std::sqrt(r) * detail::horner(table::large, 2 * table::split * r - 1);
}

// The angle x brought to [-pi, pi].
template <typename T>
inline T wrap_angle(T x) {
  return x - 2 * pi_v<T> * std::nearbyint(x * (1 / (2 * pi_v<T>)));
}

}  // namespace wisp::hair
