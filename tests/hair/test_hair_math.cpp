// The special functions of the hair model against the standard library in
// double, over the whole range that each is for. Every bound is about twice the
// largest error that was measured, in units of 2^-24 (the rounding of a float)
// where that is what limits it.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "wisp/core/rng.h"
#include "wisp/hair/bsdf.h"

using namespace wisp;
using namespace wisp::hair;

namespace {

constexpr double rounding = 0x1p-24;

// The largest error over what it was told of.
struct worst {
  double error = 0, at = 0;
  void relative(double value, double truth, double x) {
    absolute(truth == 0 ? (value == 0 ? 0 : 1e30) : value / truth, truth == 0 ? 0 : 1, x);
  }
  void absolute(double value, double truth, double x) {
    double e = std::abs(value - truth);
    if (!(e <= error)) {
      error = std::isnan(e) ? 1e30 : e;
      at = x;
    }
  }
};

// Every stride-th float of [low, high], low >= 0, and both ends.
template <typename F>
void each_float(float low, float high, std::uint32_t stride, F&& f) {
  auto a = std::bit_cast<std::uint32_t>(low), b = std::bit_cast<std::uint32_t>(high);
  for (std::uint64_t bits = a; bits < b; bits += stride)
    f(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
  f(high);
}

bool same_bits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

// exp(-x) I0(x): the power series, whose terms are all positive, and for large
// x the asymptotic one.
double exact_i0e(double argument) {
  long double x = argument, sum = 1, term = 1;
  if (x < 40) {
    for (int k = 1; k < 200 && term > sum * 1e-22L; k++) {
      term *= (x / 2) * (x / 2) / (static_cast<long double>(k) * k);
      sum += term;
    }
    return static_cast<double>(sum * std::exp(-x));
  }
  for (int k = 1; k < 40; k++) {
    term *= static_cast<long double>((2 * k - 1) * (2 * k - 1)) / (8 * k * x);
    sum += term;
  }
  return static_cast<double>(sum / std::sqrt(2 * pi_v<long double> * x));
}
constexpr bool wide_truth = std::numeric_limits<long double>::digits >= 64;

}  // namespace

TEST_CASE("hair: exp of a float that is not positive") {
  worst w;
  each_float(1e-30f, std::nextafter(87.0f, 0.0f), 211,
             [&](float x) { w.relative(detail::exp_nonpositive(-x), std::exp(-double(x)), x); });
  CAPTURE(w.at);
  CHECK(w.error / rounding < 6.0);
  CHECK(detail::exp_nonpositive(0.0f) == 1);
  CHECK(detail::exp_nonpositive(-0.0f) == 1);
  // Above its end a normal number, below nothing, and no number is too far.
  float last = detail::exp_nonpositive(std::nextafter(-87.0f, 0.0f));
  CHECK(last >= std::numeric_limits<float>::min());
  CHECK(last < 1.7e-38f);
  for (float x : {87.0f, 87.1f, 88.0f, 103.0f, 104.0f, 1e3f, 1e9f, 2.2e9f, 1e30f,
                  std::numeric_limits<float>::max(), std::numeric_limits<float>::infinity()})
    CHECK(same_bits(detail::exp_nonpositive(-x), 0.0f));
  // Never above 1, and rising but for rounding.
  float before = 0;
  bool rises = true, within = true;
  each_float(1e-8f, 100, 97, [&](float x) {
    float y = detail::exp_nonpositive(-x);
    within = within && y >= 0 && y <= 1 + 1.2e-7f;
    rises = rises && (before == 0 || double(y) <= double(before) * (1 + 4 * rounding));
    before = y;
  });
  CHECK(rises);
  CHECK(within);
}

TEST_CASE("hair: inverse square root in float") {
  worst w;
  each_float(std::numeric_limits<float>::min(), std::numeric_limits<float>::max(), 1009,
             [&](float x) { w.relative(detail::inverse_sqrt(x), 1 / std::sqrt(double(x)), x); });
  CAPTURE(w.at);
  CHECK(w.error / rounding < 4.0);
  // Two octaves without a gap: the error has their period.
  worst all;
  each_float(1, 4, 1,
             [&](float x) { all.relative(detail::inverse_sqrt(x), 1 / std::sqrt(double(x)), x); });
  CAPTURE(all.at);
  CHECK(all.error / rounding < 3.0);
  CHECK(detail::inverse_sqrt(4.0) == 0.5);
}

TEST_CASE("hair: the angle of a direction in float") {
  worst w, turned;
  for (int i = 0; i < 2000000; i++) {
    double a = (i - 1000000 + 0.37) * 1e-6 * pi_v<double>;
    float scale = i % 3 == 0 ? 1.0f : i % 3 == 1 ? 1e-15f : 1e15f;
    float x = scale * static_cast<float>(std::cos(a)), y = scale * static_cast<float>(std::sin(a));
    w.relative(detail::angle_of(y, x), std::atan2(double(y), double(x)), a);
  }
  CAPTURE(w.at);
  CHECK(w.error / rounding < 7.0);
  // Small angles keep their digits.
  each_float(1e-30f, 1, 1009, [&](float y) {
    for (float s : {1.0f, -1.0f})
      turned.relative(detail::angle_of(s * y, 1.0f), std::atan2(double(s * y), 1.0), y);
  });
  CAPTURE(turned.at);
  CHECK(turned.error / rounding < 7.0);
  constexpr float pi = pi_v<float>;
  CHECK(detail::angle_of(0.0f, 0.0f) == 0);
  CHECK(same_bits(detail::angle_of(0.0f, 1.0f), 0.0f));
  CHECK(same_bits(detail::angle_of(-0.0f, 1.0f), -0.0f));
  CHECK(detail::angle_of(0.0f, -1.0f) == pi);
  CHECK(detail::angle_of(-0.0f, -1.0f) == -pi);
  CHECK(detail::angle_of(1.0f, 0.0f) == pi / 2);
  CHECK(detail::angle_of(-1.0f, 0.0f) == -pi / 2);
  CHECK(detail::angle_of(1.0f, 1.0f) == doctest::Approx(pi_v<double> / 4).epsilon(2e-7));
  CHECK(detail::angle_of(-1.0, -1.0) == std::atan2(-1.0, -1.0));
  // No step where the roles of the two legs change.
  for (float sx : {1.0f, -1.0f})
    for (float sy : {1.0f, -1.0f}) {
      float above = detail::angle_of(sy * std::nextafter(1.0f, 2.0f), sx);
      float below = detail::angle_of(sy * std::nextafter(1.0f, 0.0f), sx);
      CHECK(std::abs(above - below) < 6e-7f);
    }
}

TEST_CASE("hair: arc sine of a sine and its cosine in float") {
  worst w, octaves;
  auto one = [&](worst& to, float x) {
    float c = std::sqrt((1 - x) * (1 + x));
    to.relative(detail::arc_sine(x, c), std::asin(double(x)), x);
    to.relative(detail::arc_sine(-x, c), -std::asin(double(x)), x);
  };
  for (int i = 0; i <= 1000000; i++) one(w, static_cast<float>(i) * 1e-6f);
  each_float(1e-30f, 1, 4001, [&](float x) { one(octaves, x); });
  CAPTURE(w.at);
  CAPTURE(octaves.at);
  CHECK(w.error / rounding < 8.0);
  CHECK(octaves.error / rounding < 8.0);
  CHECK(detail::arc_sine(1.0f, 0.0f) == pi_v<float> / 2);
  CHECK(detail::arc_sine(-1.0f, 0.0f) == -pi_v<float> / 2);
  CHECK(same_bits(detail::arc_sine(0.0f, 1.0f), 0.0f));
  CHECK(same_bits(detail::arc_sine(-0.0f, 1.0f), -0.0f));
  // At the end of the range the cosine tells the angle where the sine cannot.
  worst end;
  each_float(1e-20f, 0.5f, 20011, [&](float c) {
    float x = static_cast<float>(std::sqrt(1 - double(c) * double(c)));
    end.absolute(detail::arc_sine(x, c), std::acos(double(c)), c);
  });
  CAPTURE(end.at);
  CHECK(end.error / rounding < 5.0);
  // Across the switch.
  float below = 0.7f, above = std::nextafter(0.7f, 1.0f);
  auto at = [](float x) { return detail::arc_sine(x, std::sqrt((1 - x) * (1 + x))); };
  CHECK(std::abs(at(above) - at(below)) < 4.0f * static_cast<float>(rounding));
  CHECK(std::abs(at(-above) - at(-below)) < 4.0f * static_cast<float>(rounding));
  CHECK(detail::arc_sine(0.3, std::sqrt(1 - 0.09)) ==
        doctest::Approx(std::asin(0.3)).epsilon(1e-15));
}

TEST_CASE("hair: cosine and sine in float") {
  // Absolute, for the range that azimuths have and for all that is allowed;
  // relative for the sine of a small angle.
  worst near, far, small;
  for (int i = -2000000; i <= 2000000; i++) {
    auto look = [](worst& to, float x) {
      auto y = detail::cos_sin_of(x);
      to.absolute(y.cos, std::cos(double(x)), x);
      to.absolute(y.sin, std::sin(double(x)), x);
    };
    look(near, static_cast<float>(i * 6.3 / 2e6));
    look(far, static_cast<float>(i * 1e3 / 2e6));
  }
  each_float(1e-30f, 0.785f, 4001, [&](float x) {
    small.relative(detail::cos_sin_of(x).sin, std::sin(double(x)), x);
    small.relative(detail::cos_sin_of(-x).sin, std::sin(-double(x)), x);
  });
  CAPTURE(near.at);
  CAPTURE(far.at);
  CAPTURE(small.at);
  CHECK(near.error / rounding < 3.0);
  CHECK(far.error / rounding < 3.0);
  CHECK(small.error / rounding < 2.0);
  CHECK(detail::cos_sin_of(0.0f).cos == 1);
  CHECK(detail::cos_sin_of(0.0f).sin == 0);
  // Continuous where quadrants meet.
  double step = 0;
  for (int k = -20; k < 20; k++) {
    auto edge = static_cast<float>((k + 0.5) * pi_v<double> / 2);
    auto a = detail::cos_sin_of(std::nextafter(edge, -1e3f));
    auto b = detail::cos_sin_of(std::nextafter(edge, 1e3f));
    double gap = 2.5 * std::abs(double(std::nextafter(edge, 1e3f)) - double(edge));
    step = std::max({step, std::abs(double(a.cos) - double(b.cos)) - gap,
                     std::abs(double(a.sin) - double(b.sin)) - gap});
  }
  CHECK(step / rounding < 3.0);
}

TEST_CASE("hair: angles brought to one turn") {
  // Up to what exit azimuths and a turn add up to, and beyond.
  worst near, far, wide;
  bool inside = true;
  auto remainder = [](double x) { return std::remainder(x, 2 * pi_v<double>); };
  auto look = [&](worst& to, float x) {
    float y = wrap_angle(x);
    inside = inside && std::abs(y) <= pi_v<float> + 4e-7f;
    double d = double(y) - remainder(x);  // at half a turn the sign may differ
    to.absolute(std::abs(d) > pi_v<double> ? std::abs(d) - 2 * pi_v<double> : d, 0, x);
  };
  for (int i = -1000000; i <= 1000000; i++) {
    look(near, static_cast<float>(i * 3.1415 / 1e6));
    look(far, static_cast<float>(i * 40.0 / 1e6));
    double x = i * 1e-3;
    double d = wrap_angle(x) - remainder(x);
    wide.absolute(std::abs(d) > pi_v<double> ? std::abs(d) - 2 * pi_v<double> : d, 0, x);
  }
  CAPTURE(far.at);
  CHECK(near.error == 0);
  CHECK(far.error / rounding < 4.0);
  CHECK(inside);
  CHECK(wide.error < 1.2e-13);
}

TEST_CASE("hair: the nearest integer") {
  bool same = true;
  for (int i = -2000; i <= 2000; i++) {
    auto x = static_cast<float>(i) * 0.25f;
    same = same && detail::nearest(x) == std::nearbyint(x);
    same = same && detail::nearest(double(x)) == std::nearbyint(double(x));
  }
  each_float(1e-20f, 0x1p22f - 1, 997, [&](float x) {
    same = same && detail::nearest(x) == std::nearbyint(x) &&
           detail::nearest(-x) == std::nearbyint(-x);
  });
  CHECK(same);
}

TEST_CASE("hair: I0e against its series") {
  worst single, twice;
  each_float(1e-10f, 1e30f, 2003, [&](float x) {
    double truth = exact_i0e(double(x));
    single.relative(bessel_i0e(x), truth, x);
  });
  // Where it is worst, below the switch, with hardly a gap.
  each_float(3.5f, 4.1f, 5, [&](float x) { single.relative(bessel_i0e(x), exact_i0e(x), x); });
  for (double x = 1e-8; x < 1e12; x *= 1.0005) twice.relative(bessel_i0e(x), exact_i0e(x), x);
  for (double x = 0; x < 40; x += 0.003) twice.relative(bessel_i0e(x), exact_i0e(x), x);
  CAPTURE(single.at);
  CAPTURE(twice.at);
  CHECK(single.error < 7e-7);
  CHECK(twice.error < (wide_truth ? 2e-15 : 2e-14));
  CHECK(bessel_i0e(0.0f) == doctest::Approx(1).epsilon(3e-7));
  CHECK(bessel_i0e(0.0) == doctest::Approx(1).epsilon(2e-15));
  // Across the switches: no step but rounding.
  auto step = [](auto x) {
    using T = decltype(x);
    return double(std::abs(bessel_i0e(std::nextafter(x, T(0))) - bessel_i0e(x)) / bessel_i0e(x));
  };
  CHECK(step(4.0f) < 6 * rounding);
  CHECK(step(8.0) < 2e-15);
  // Falling, but for rounding.
  bool falls = true;
  float before = 2;
  each_float(0.05f, 1e4f, 97, [&](float x) {
    float y = bessel_i0e(x);
    falls = falls && double(y) <= double(before) * (1 + 8 * rounding);
    before = y;
  });
  CHECK(falls);
}

#if defined(WISP_HAIR_LANES)

namespace {

using detail::float_lanes;

// Whether a function of lanes gives what it gives of each number alone.
template <typename F>
bool lanes_are_scalars(float low, float high, bool negative, F&& f) {
  bool same = true;
  std::array<float, 4> x{}, y{};
  std::size_t n = 0;
  each_float(low, high, 3001, [&](float a) {
    x[n] = negative && (std::bit_cast<std::uint32_t>(a) / 3001) % 3 != 0 ? -a : a;
    if (++n < 4) return;
    n = 0;
    float_lanes in, out;
    std::memcpy(&in, x.data(), sizeof(in));
    out = f(in);
    std::memcpy(y.data(), &out, sizeof(out));
    for (std::size_t k = 0; k < 4; k++) same = same && same_bits(y[k], f(x[k]));
  });
  return same;
}

}  // namespace

TEST_CASE("hair: four lanes give the bits of one") {
  constexpr float largest = std::numeric_limits<float>::max();
  CHECK(lanes_are_scalars(1e-30f, 1e5f, false,
                          [](auto x) { return detail::exp_nonpositive<decltype(x)>(-x); }));
  CHECK(lanes_are_scalars(1e-37f, largest, false,
                          [](auto x) { return detail::inverse_sqrt<decltype(x)>(x); }));
  CHECK(lanes_are_scalars(0, largest, false, [](auto x) { return bessel_i0e<decltype(x)>(x); }));
  CHECK(lanes_are_scalars(1e-30f, 1e4f, true, [](auto x) { return wrap_angle<decltype(x)>(x); }));
  CHECK(lanes_are_scalars(1e-30f, 4e6f, true,
                          [](auto x) { return detail::nearest<decltype(x)>(x); }));
  CHECK(lanes_are_scalars(0, largest, true,
                          [](auto x) { return detail::magnitude<decltype(x)>(x); }));
  CHECK(lanes_are_scalars(1e-30f, 1, true, [](auto x) {
    using T = decltype(x);
    auto square = 1.0f - x * x;  // not quite a cosine: all the same
    return detail::arc_sine<T>(x, square);
  }));
  CHECK(lanes_are_scalars(1e-30f, 30, true, [](auto x) {
    using T = decltype(x);
    return azimuthal_np<T>(x, detail::splat<T>(7.3f), detail::splat<T>(1.9f));
  }));
}

TEST_CASE("hair: lobes four at a time are lobes one by one") {
  auto rng = make_rng(41);
  int differ = 0;
  for (int i = 0; i < 20000; i++) {
    hair_parameters<float> p;
    p.beta_m = rand1f(rng);
    p.beta_n = rand1f(rng);
    p.alpha = 10 * rand1f(rng) - 5;
    p.p_max = 1 + static_cast<int>(rand_index(rng, 6));
    auto bsdf = make_hair_bsdf(p);
    float s = 2 * rand1f(rng) - 1, a = 6.28f * rand1f(rng), c = std::sqrt(1 - s * s);
    auto hit = make_hair_hit<float>(bsdf, {0, 1, 2}, 2 * rand1f(rng) - 1,
                                    {s, c * std::cos(a), c * std::sin(a)});
    float sin_i = 2 * rand1f(rng) - 1, cos_i = std::sqrt(1 - sin_i * sin_i);
    float phi = 8 * rand1f(rng) - 4;
    lobe_array<float> four{}, one{};
    for (std::size_t k = 0; k <= std::size_t(bsdf.p_max); k += 4)
      detail::eval_mn<float_lanes>(bsdf, hit, sin_i, cos_i, phi, k, four);
    glm::vec4 sum(0);
    for (std::size_t k = 0; k <= std::size_t(bsdf.p_max); k++) {
      detail::eval_mn<float>(bsdf, hit, sin_i, cos_i, phi, k, one);
      if (!same_bits(four[k], one[k])) differ++;
      sum = k == 0 ? hit.ap[k] * one[k] : sum + hit.ap[k] * one[k];
    }
    auto f = detail::eval_lobes(bsdf, hit, sin_i, cos_i, phi);
    if (!same_bits(f.value.x, sum.x) || !same_bits(f.pdf, sum.w)) differ++;
  }
  CHECK(differ == 0);
}

#endif
