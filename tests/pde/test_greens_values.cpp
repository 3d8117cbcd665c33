// Green's functions and what is drawn from them, against values of many digits.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "ball_points.h"
#include "wisp/pde/greens.h"

using namespace wisp;
using wisp::test::greens_at;
using wisp::test::value_at;

namespace {

// Simpson's rule in t with x = a + (b - a) t^2, which is dense at a.
double integrate(const std::function<double(double)>& f, double a, double b, int n) {
  double sum = 0;
  const auto g = [&](double t) { return f(a + (b - a) * t * t) * 2 * (b - a) * t; };
  for (int i = 0; i < n; ++i) {
    const double t0 = double(i) / n, t1 = double(i + 1) / n;
    sum += (g(t0) + 4 * g(0.5 * (t0 + t1)) + g(t1)) / 6 / n;
  }
  return sum;
}

dvec3 direction_of(double t, double phi) {
  const double s = std::sqrt(1 - t * t);
  return {s * std::cos(phi), s * std::sin(phi), t};
}

// Values to 16 digits, by the formulas with 400 digits (mpmath), R = 2, k = x / 2, r = 2 q:
//   C = x / sinh(x), D = k / i1(x), mass = (1 - C) / k^2, with i1(t) = (t cosh t - sinh t) / t^2,
//   G = sinh(k (2 - r)) / (4 pi r sinh(x)),
//   G' = k^2 (k1(k r) - i1(k r) k1(x) / i1(x)) / (4 pi) with k1(t) = exp(-t) (1 + t) / t^2.
// 0 stands for less than 1e-300.
struct factors {
  double x, C, D, mass;
};
constexpr std::array factor_table = {std::to_array<factors>(
    {{1e-10, 1.0, 1.5, 0.6666666666666667},
     {1e-6, 0.9999999999998333, 1.49999999999985, 0.6666666666665889},
     {1e-5, 0.9999999999833333, 1.499999999985, 0.6666666666588889},
     {0.1, 0.998335275729611, 1.498500963758208, 0.6658897081556145},
     {0.9375, 0.8672590297763088, 1.375270119734426, 0.6041189044847103},
     {1.0625, 0.8339857418696902, 1.342235585600177, 0.5882304509530701},
     {3, 0.2994647090064682, 0.6688097954934529, 0.3113490182193475},
     {20, 8.244614489754231e-8, 8.678541568162349e-7, 9.999999175538551e-3},
     {300, 3.088920133447208e-128, 4.648876455020882e-126, 4.444444444444444e-5},
     {1e4, 0, 0, 4.0e-8},
     {1e5, 0, 0, 4.0e-10}})};
struct kernels_at {
  double x, q, G, slope;
};
constexpr std::array kernel_table = {
    std::to_array<kernels_at>({{1e-10, 0.001953125, 20.33204397998963, 5215.189136379039},
                               {1e-10, 0.5, 0.03978873577297383, 0.06963028760270421},
                               {1e-10, 0.96875, 1.283507605579801e-3, 1.925908337606385e-3},
                               {1e-6, 0.001953125, 20.33204397998962, 5215.189136379039},
                               {1e-6, 0.5, 0.03978873577296886, 0.06963028760269998},
                               {1e-6, 0.96875, 1.283507605579587e-3, 1.925908337606193e-3},
                               {1e-5, 0.001953125, 20.33204397998831, 5215.189136379038},
                               {1e-5, 0.5, 0.03978873577247647, 0.06963028760228145},
                               {1e-5, 0.96875, 1.28350760555843e-3, 1.925908337587157e-3},
                               {0.1, 0.001953125, 20.33191182751374, 5215.189037140602},
                               {0.1, 0.5, 0.03973905160888894, 0.06958803279900302},
                               {0.1, 0.96875, 1.281373004883229e-3, 1.923986797740028e-3},
                               {0.9375, 0.001953125, 20.32105170820135, 5215.180416227831},
                               {0.9375, 0.5, 0.03578478576372131, 0.06606832013860163},
                               {0.9375, 0.96875, 1.113292802592556e-3, 1.766015364664239e-3},
                               {1.0625, 0.001953125, 20.31813319013398, 5215.177936537535},
                               {1.0625, 0.5, 0.03476627800542421, 0.06510836777669264},
                               {1.0625, 0.96875, 1.070623735081292e-3, 1.72366509533656e-3},
                               {3, 0.001953125, 20.25222229975512, 5215.099996067983},
                               {3, 0.5, 0.01691403381245725, 0.04329169032645352},
                               {3, 0.96875, 3.849285140990661e-4, 8.599691686901106e-4},
                               {20, 0.001953125, 19.59140006022682, 5211.312416020335},
                               {20, 0.5, 3.612811611415601e-6, 3.97409277334101e-5},
                               {20, 0.96875, 1.128454091706393e-10, 1.188235532102419e-9},
                               {300, 0.001953125, 11.33863246951323, 4603.484782622373},
                               {300, 0.5, 5.709759956439346e-67, 8.621737534223412e-65},
                               {300, 0.96875, 2.492956029570851e-128, 3.752300914192125e-126},
                               {1e4, 0.001953125, 6.709899286870233e-8, 3.526723065178995e-4},
                               {1e4, 0.5, 0, 0},
                               {1e4, 0.96875, 0, 0},
                               {1e5, 0.001953125, 3.061181672823359e-84, 1.538427461494107e-79},
                               {1e5, 0.5, 0, 0},
                               {1e5, 0.96875, 0, 0}})};

// |found / exact - 1| in units of rounding, where exponentials lose as many as their
// argument says.
double ulps(double found, double exact, double argument) {
  if (exact == 0) return found >= 0 && found < 1e-300 ? 0 : 1e300;
  return std::abs(found / exact - 1) / (0x1p-53 * (1 + argument));
}

}  // namespace

TEST_CASE("pde: factors and kernels of balls agree with values of many digits") {
  const double R = 2;
  double worst_factor = 0, worst_kernel = 0;
  for (const factors& t : factor_table) {
    CAPTURE(t.x);
    const double k = t.x / R;
    const double c = ulps(mean_value_factor(R, k), t.C, t.x);
    const double d = ulps(mean_gradient_factor(R, k), t.D, t.x);
    const double m = ulps(greens_mass(R, k), t.mass, 0);
    CHECK(c < 10);
    CHECK(d < 20);
    CHECK(m < 20);
    worst_factor = std::max({worst_factor, c, d, m});
  }
  for (const kernels_at& t : kernel_table) {
    CAPTURE(t.x);
    CAPTURE(t.q);
    const double k = t.x / R, r = t.q * R;
    const double g = ulps(greens(r, R, k), t.G, t.x * t.q);
    // a difference of two terms that are equal on the sphere
    const double near = std::exp(-k * r) * (1 + k * r) / (4 * pi_d * r * r);
    const double lost = t.slope > 0 ? near / t.slope : 1;
    const double s = ulps(greens_gradient(r, R, k), t.slope, t.x * t.q) / std::max(lost, 1.0);
    CHECK(g < 10);
    CHECK(s < 20);
    worst_kernel = std::max({worst_kernel, g, s});
  }
  MESSAGE("worst error in units of rounding: factors " << worst_factor << " and kernels "
                                                       << worst_kernel);
}

TEST_CASE("pde: weights of radii for gradients have the right mean whatever the radius") {
  // E[w phi(r)] = int 4 pi r^2 |grad G| phi, in eight bins of the radius: each within 5
  // standard errors, a false alarm in 4e4 for all bins together.
  for (const double x : {0.0, 1.0, 2.99, 3.01, 30.0}) {
    const double R = 1.5, k = x / R, reach = x > 3 ? std::min(R, 12 / k) : R;
    rng_state rng = make_rng(17, static_cast<std::uint64_t>(100 * x));
    constexpr int bins = 8, n = 100000;
    std::array<double, bins> sum = {}, squares = {};
    for (int i = 0; i < n; ++i) {
      const weighted_radius w = sample_gradient_radius(rng, R, k);
      const auto b = static_cast<std::size_t>(w.r / reach * bins);
      if (b >= bins) continue;
      sum[b] += w.weight;
      squares[b] += w.weight * w.weight;
    }
    for (std::size_t b = 0; b < bins; ++b) {
      const double exact = integrate(
          [&](double r) { return r > 0 ? 4 * pi_d * r * r * greens_gradient(r, R, k) : 0; },
          reach * static_cast<double>(b) / bins, reach * static_cast<double>(b + 1) / bins, 200);
      const double mean = sum[b] / n, error = std::sqrt((squares[b] / n - mean * mean) / n);
      CAPTURE(x);
      CAPTURE(b);
      CHECK(std::abs(mean - exact) < 5 * error);
    }
  }
}

TEST_CASE("pde: directions fill the sphere") {
  // The first and second moments of directions, and of what comes back around its axis,
  // within 5 standard errors of 0 and 1/3: a false alarm in 1e5 for all of them together.
  rng_state rng = make_rng(5);
  const dvec3 away = 2.0 * glm::normalize(dvec3{2, -1, 1});
  constexpr int n = 200000;
  dvec3 sum{0}, squares{0}, mixed{0}, across{0};
  double across_squares = 0;
  for (int i = 0; i < n; ++i) {
    const dvec3 d = sample_direction(rng);
    REQUIRE(std::abs(glm::length(d) - 1) < 1e-12);
    sum += d;
    squares += d * d;
    mixed += dvec3{d.x * d.y, d.y * d.z, d.z * d.x};
    const dvec3 back = sample_exterior_return(rng, away, 1);
    REQUIRE(std::abs(glm::length(back) - 1) < 1e-9);
    const dvec3 flat = back - glm::dot(back, away) / 4 * away;
    across += flat;
    across_squares += glm::dot(flat, flat);
  }
  for (int a = 0; a < 3; ++a) {
    CHECK(std::abs(sum[a]) < 5 * std::sqrt(n / 3.0));
    CHECK(std::abs(squares[a] - n / 3.0) < 5 * std::sqrt(n * 4 / 45.0));
    CHECK(std::abs(mixed[a]) < 5 * std::sqrt(n / 15.0));
    CHECK(std::abs(across[a]) < 5 * std::sqrt(across_squares));
  }
}

TEST_CASE("pde: returns from near and far are the same formula") {
  // either side of where the code changes, with the same random numbers
  const dvec3 axis = glm::normalize(dvec3{1, -2, 2});
  for (std::uint64_t i = 0; i < 100; ++i) {
    rng_state a = make_rng(9, i), b = make_rng(9, i);
    const dvec3 near = sample_exterior_return(a, 9999.99 * axis, 1);
    const dvec3 far = sample_exterior_return(b, 10000.01 * axis, 1);
    CHECK(glm::dot(near, axis) == doctest::Approx(glm::dot(far, axis)).epsilon(3e-7));
  }
}

TEST_CASE("pde: fields in free space and outside of a sphere have their strength and slope") {
  for (const double k : {0.0, 0.7, 40.0}) {
    for (const double r : {1e-6, 0.3, 2.0}) {
      const double h = 1e-5 * r;
      const double slope = (free_greens(r + h, k) - free_greens(r - h, k)) / (2 * h);
      CHECK(free_greens_slope(r, k) == doctest::Approx(slope).epsilon(1e-6));
      CHECK(free_greens(r, k) * 4 * pi_d * r * std::exp(k * r) == doctest::Approx(1));
    }
  }
  // next to its source it is that of free space, and it is the image's in closed form on the
  // axis: (1 / (b - a) - 1 / (a b - 1)) / (4 pi)
  const dvec3 x{0, 0, 3};
  CHECK(exterior_greens(x, {1e-7, 0, 3}, 1) * 4 * pi_d * 1e-7 == doctest::Approx(1));
  for (const double b : {1.5, 5.0, 1e4}) {
    CHECK(exterior_greens(x, {0, 0, b}, 1) ==
          doctest::Approx((1 / std::abs(b - 3) - 1 / (3 * b - 1)) / (4 * pi_d)).epsilon(1e-10));
  }
  // seen from x it falls on the sphere as exterior returns do: the flux of G through the
  // sphere is R / |x|
  double flux = 0;
  for (int i = 0; i < 2000; ++i) {
    const double t = -1 + (2 * i + 1.0) / 2000, h = 1e-5;
    flux += exterior_greens(x, (1 + h) * direction_of(t, 0.4), 1) / h * 4 * pi_d / 2000;
  }
  CHECK(flux == doctest::Approx(1 / 3.0).epsilon(1e-4));
}

TEST_CASE("pde: screened kernels of balls come near the harmonic ones as screening goes") {
  const dvec3 y{0.2, -0.3, 0.25}, nu = glm::normalize(dvec3{1, 1, -1}), z{-0.4, 0.1, 0.5};
  const kernel_ball harmonic(ball_kernel_type::harmonic, 1.2, 0);
  const ball_kernels exact(harmonic, y);
  const double value = value_at(exact, nu), green = greens_at(harmonic, exact, z);
  for (const double x : {1e-12, 1e-8, 1e-6, 1e-4}) {
    CAPTURE(x);
    const kernel_ball screened(ball_kernel_type::screened, 1.2, x / 1.2);
    const ball_kernels near(screened, y);
    const double v = value_at(near, nu), g = greens_at(screened, near, z);
    const double slack = 3e-9 + 2 * x * x;  // what is cut off, and what screening does
    CHECK(v == doctest::Approx(value).epsilon(slack));
    CHECK(g == doctest::Approx(green).epsilon(slack));
    CHECK(near.value_mean() == doctest::Approx(exact.value_mean()).epsilon(slack));
    CHECK(near.value_slope() == doctest::Approx(exact.value_slope()).epsilon(slack));
    CHECK(near.greens_mass() == doctest::Approx(exact.greens_mass()).epsilon(slack));
  }
  // at the center they are those of greens.h, for any screening that they are used for
  for (const double x : {0.3, 0.999, 1.001, 3.0}) {
    const kernel_ball ball(ball_kernel_type::screened, 1.2, x / 1.2);
    const ball_kernels middle(ball, {0, 0, 0});
    const double g = greens_at(ball, middle, z);
    CHECK(g == doctest::Approx(greens(glm::length(z), 1.2, x / 1.2)).epsilon(1e-9));
    CHECK(middle.value_mean() == doctest::Approx(mean_value_factor(1.2, x / 1.2)).epsilon(1e-12));
    CHECK(middle.value_slope() ==
          doctest::Approx(mean_gradient_factor(1.2, x / 1.2) / 3).epsilon(1e-12));
    CHECK(middle.greens_mass() == doctest::Approx(greens_mass(1.2, x / 1.2)).epsilon(1e-12));
  }
}
