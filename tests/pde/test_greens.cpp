// Green's functions, Poisson kernels and samples of them, against their definitions.

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <functional>

#include "ball_points.h"
#include "wisp/pde/greens.h"

using namespace wisp;
using wisp::test::greens_at;
using wisp::test::lanes_of;
using wisp::test::laplacian_at;
using wisp::test::value_at;

namespace {

using real = long double;

// Gauss-Legendre would do better, but not where the integrand has a tail that is thin:
// composite Simpson in t with x = a + (b - a) t^2, which is dense at a.
double integrate(const std::function<double(double)>& f, double a, double b, int n = 4000) {
  double sum = 0;
  const auto g = [&](double t) { return f(a + (b - a) * t * t) * 2 * (b - a) * t; };
  for (int i = 0; i < n; ++i) {
    const double t0 = double(i) / n, t1 = double(i + 1) / n;
    sum += (g(t0) + 4 * g(0.5 * (t0 + t1)) + g(t1)) / 6 / n;
  }
  return sum;
}

// In long double, where sinh does not overflow before k R = 11356.
real c_exact(real x) { return x == 0 ? 1 : x / sinhl(x); }
real g_exact(real r, real R, real k) {
  if (k == 0) return (1 / r - 1 / R) / (4 * 3.14159265358979323846264338327950288L);
  return sinhl(k * (R - r)) / (4 * 3.14159265358979323846264338327950288L * r * sinhl(k * R));
}

const std::array screenings = {0.0,  1e-10, 1e-8, 1e-4, 0.01,  0.3,
                               0.99, 1.01,  3.0,  30.0, 700.0, 1e4};

// Chi-square of samples in 40 bins against a density on [0, 1], with a false alarm in 1e6.
void check_distribution(const std::function<double()>& draw,
                        const std::function<double(double)>& density) {
  constexpr int bins = 40, n = 200000;
  std::array<double, bins> seen = {};
  for (int i = 0; i < n; ++i) {
    const double x = draw();
    REQUIRE(x >= 0);
    REQUIRE(x <= 1);
    ++seen[static_cast<std::size_t>(std::min(static_cast<int>(x * bins), bins - 1))];
  }
  double chi = 0, pooled_seen = 0, pooled = 0, all = 0;
  int used = 0;
  for (int b = 0; b < bins; ++b) {
    const double expected = n * integrate(density, double(b) / bins, double(b + 1) / bins, 200);
    all += expected;
    pooled += expected;
    pooled_seen += seen[static_cast<std::size_t>(b)];
    if (pooled < 20) continue;
    chi += (pooled_seen - pooled) * (pooled_seen - pooled) / pooled;
    ++used;
    pooled = pooled_seen = 0;
  }
  CHECK(all == doctest::Approx(n).epsilon(1e-3));
  // Wilson and Hilferty: the cube root of chi / degrees is about normal
  const double d = std::max(used - 1, 1);
  const double z = (std::cbrt(chi / d) - (1 - 2 / (9 * d))) / std::sqrt(2 / (9 * d));
  CAPTURE(chi);
  CAPTURE(used);
  CHECK(z < 4.8);
}

dvec3 direction_of(double t, double phi) {
  const double s = std::sqrt(1 - t * t);
  return {s * std::cos(phi), s * std::sin(phi), t};
}

// The mean of f over the unit sphere, by Gauss-like midpoints: spectral in phi, and fine in t.
double sphere_mean(const std::function<double(const dvec3&)>& f) {
  double sum = 0;
  constexpr int rows = 400, columns = 64;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      sum += f(direction_of(-1 + (2 * i + 1.0) / rows, 2 * pi_d * j / columns));
    }
  }
  return sum / (rows * columns);
}

}  // namespace

TEST_CASE("pde: factors of balls are right to rounding for any screening") {
  for (const double R : {1e-4, 1.0, 37.0}) {
    for (const double x : screenings) {
      CAPTURE(R);
      CAPTURE(x);
      const double k = x / R;
      const real X = static_cast<real>(k) * R;
      CHECK(mean_value_factor(R, k) == doctest::Approx(double(c_exact(X))).epsilon(1e-12));
      if (x > 0.01) {
        const double mass = double((1 - c_exact(X)) / (static_cast<real>(k) * k));
        CHECK(greens_mass(R, k) == doctest::Approx(mass).epsilon(1e-11));
      } else {
        CHECK(greens_mass(R, k) == doctest::Approx(R * R / 6 * (1 - 7 * x * x / 60)).epsilon(1e-9));
      }
      for (const double q : {1e-6, 0.1, 0.5, 0.9, 0.999999}) {
        const double exact = double(g_exact(static_cast<real>(q) * R, R, k));
        CHECK(greens(q * R, R, k) == doctest::Approx(exact).epsilon(1e-9));
      }
      // C + c int G = 1
      CHECK(mean_value_factor(R, k) + k * k * greens_mass(R, k) ==
            doctest::Approx(1).epsilon(1e-12));
    }
  }
  CHECK(mean_value_factor(1, 1e5) == 0);
  CHECK(greens_mass(1, 1e5) == doctest::Approx(1e-10));
}

TEST_CASE("pde: Green's functions have the mass and slope that they should") {
  for (const double x : screenings) {
    if (x > 1000) continue;
    CAPTURE(x);
    const double R = 2, k = x / R;
    const double reach = std::min(R, 60 / std::max(k, 1e-9));
    const auto shell = [&](double r) { return r > 0 ? 4 * pi_d * r * r * greens(r, R, k) : 0; };
    CHECK(integrate(shell, 0, reach) == doctest::Approx(greens_mass(R, k)).epsilon(1e-6));
    // For u = sinh(k z) / k, or z: grad u at 0 is 1, and f = 0
    const double moment =
        integrate(
            [&](double t) {
              return 0.5 * t *
                     (k > 1e-6 ? std::exp(k * R * (t - 1)) * -std::expm1(-2 * k * R * t) / (2 * k)
                               : R * t * std::exp(-k * R));
            },
            0, 1) *
        2;
    CHECK(mean_gradient_factor(R, k) * moment * std::exp(k * R) ==
          doctest::Approx(1).epsilon(1e-5));
    // For u = z^2 + z with f = 2 - c u: only the odd part, -c z, matters to the slope at 0:
    // 1 = D R / 3 + c int z nu_z |grad G|
    const double inner = integrate(
        [&](double r) { return r > 0 ? 4 * pi_d / 3 * r * r * r * greens_gradient(r, R, k) : 0; },
        0, reach);
    CHECK(mean_gradient_factor(R, k) * R / 3 + k * k * inner == doctest::Approx(1).epsilon(1e-6));
  }
}

TEST_CASE("pde: radii are drawn with the density of Green's function") {
  for (const double x : {0.0, 0.5, 2.9, 3.1, 10.0, 100.0}) {
    CAPTURE(x);
    const double R = 1.5, k = x / R;
    rng_state rng = make_rng(3, static_cast<std::uint64_t>(10 * x));
    check_distribution([&] { return sample_greens_radius(rng, R, k) / R; },
                       [&](double q) {
                         const double r = std::max(q, 1e-12) * R;
                         return 4 * pi_d * r * r * greens(r, R, k) / greens_mass(R, k) * R;
                       });
    // the weighted radii of the gradient integrate any function of the radius
    double sum = 0, squares = 0;
    constexpr int n = 200000;
    for (int i = 0; i < n; ++i) {
      const weighted_radius w = sample_gradient_radius(rng, R, k);
      REQUIRE(std::isfinite(w.weight));
      sum += w.weight * w.r;
      squares += w.weight * w.weight * w.r * w.r;
    }
    const double mean = sum / n, error = std::sqrt((squares / n - mean * mean) / n);
    const double exact = integrate(
        [&](double r) { return r > 0 ? 4 * pi_d * r * r * r * greens_gradient(r, R, k) : 0; }, 0,
        R);
    CHECK(std::abs(mean - exact) < 5 * error);
  }
}

TEST_CASE("pde: walks come back to a sphere as Brownian motion does") {
  for (const double l : {1.1, 1.5, 4.0, 1e5}) {
    CAPTURE(l);
    rng_state rng = make_rng(8);
    const dvec3 w = glm::normalize(dvec3{1, 2, -2});
    const double g = 1 / l;
    check_distribution(
        [&] {
          return 0.5 +
                 0.5 * std::clamp(glm::dot(sample_exterior_return(rng, l * w, 1), w), -1.0, 1.0);
        },
        [&](double h) { return (1 - g * g) / std::pow(1 + g * g - 2 * g * (2 * h - 1), 1.5); });
  }
  // vanishes on the sphere and is symmetric
  const dvec3 x{0, 3, 1}, y{2, -1, 1};
  CHECK(exterior_greens(x, y, 1) == doctest::Approx(exterior_greens(y, x, 1)));
  CHECK(exterior_greens(x, glm::normalize(y) * (1 + 1e-9), 1) < 1e-9);
  CHECK(exterior_greens(x, y * 0.1, 1) == 0);
}

TEST_CASE("pde: kernels of points of a ball") {
  const double R = 1.3;
  for (const double x : {0.0, 1e-5, 0.5, 2.0, 3.0}) {
    const double k = x / R;
    const auto type = x > 0 ? ball_kernel_type::screened : ball_kernel_type::harmonic;
    const kernel_ball ball(type, R, k);
    for (const dvec3& y : {dvec3{0, 0, 0}, dvec3{0.1, -0.2, 0.3}, dvec3{0, 0, 0.6 * R}}) {
      CAPTURE(x);
      CAPTURE(y.z);
      const ball_kernels kernel(ball, y);
      const auto value = [&](const dvec3& nu) { return value_at(kernel, nu); };
      CHECK(sphere_mean(value) == doctest::Approx(kernel.value_mean()).epsilon(1e-4));
      CHECK(sphere_mean([&](const dvec3& nu) { return value(nu) * nu.z; }) ==
            doctest::Approx(kernel.value_slope() * y.z).epsilon(1e-4));
      // lap u = c u for u = exp(a.x), |a|^2 = c; and a harmonic polynomial for c = 0
      const dvec3 a = k / 3 * dvec3{1, 2, -2};
      const auto u = [&](const dvec3& p) {
        return x > 0 ? std::exp(glm::dot(a, p)) : p.x * p.y + p.z * p.z - p.x * p.x + 1;
      };
      CHECK(sphere_mean([&](const dvec3& nu) { return value(nu) * u(R * nu); }) ==
            doctest::Approx(u(y)).epsilon(1e-4));
      // the mean over the ball of what Green's function is, and what it is on the sphere
      CHECK(greens_at(ball, kernel, 0.999999 * R * dvec3{0.6, 0, 0.8}) < 1e-5);
      const dvec3 z{-0.2, 0.5, 0.1};
      const double back = greens_at(ball, ball_kernels(ball, z), y);
      CHECK(greens_at(ball, kernel, z) == doctest::Approx(back).epsilon(1e-8));
      // 1 = value_mean + c mass
      CHECK(kernel.value_mean() + k * k * kernel.greens_mass() ==
            doctest::Approx(1).epsilon(1e-10));
      CHECK(kernel.greens_mass() < wisp::greens_mass(R, k) * (1 + 1e-12));
      // by shells around the center, in which Green's function is smooth but at |y|
      double mass = 0;
      constexpr int shells = 60;
      for (int i = 0; i < shells; ++i) {
        const double r = R * (i + 0.5) / shells;
        std::vector<dvec3> points;
        for (int row = 0; row < 60; ++row) {
          for (int j = 0; j < 24; ++j) {
            points.push_back(r *
                             direction_of(-1 + (2 * row + 1.0) / 60, 2 * pi_d * (j + 0.3) / 24));
          }
        }
        double mean = 0;
        for (const double g : greens_at(ball, kernel, points)) mean += g;
        mass += 4 * pi_d * r * r * mean / (60 * 24) * R / shells;
      }
      CHECK(mass == doctest::Approx(kernel.greens_mass()).epsilon(0.02));
    }
  }
}

TEST_CASE("pde: the kernel of a biharmonic function's Laplacian") {
  const double R = 0.9;
  const kernel_ball ball(ball_kernel_type::biharmonic, R, 0);
  const auto u = [](const dvec3& p) { return glm::dot(p, p) * (p.x * p.x - p.y * p.y + p.z); };
  const auto lap = [](const dvec3& p) { return 14 * (p.x * p.x - p.y * p.y) + 10 * p.z; };
  for (const dvec3& y : {dvec3{0, 0, 0}, dvec3{0.1, -0.2, 0.3}, dvec3{0.3, 0, 0.4}}) {
    const ball_kernels kernel(ball, y);
    const double found = sphere_mean([&](const dvec3& nu) {
      return value_at(kernel, nu) * u(R * nu) - laplacian_at(kernel, nu) * lap(R * nu);
    });
    CHECK(found == doctest::Approx(u(y)).epsilon(1e-4));
  }
}

TEST_CASE("pde: kernels of many points at once are those of each") {
  rng_state rng = make_rng(12);
  const double R = 1.3;
  for (const double x : {0.0, 0.01, 2.0, 3.0}) {
    CAPTURE(x);
    const auto type = x > 0 ? ball_kernel_type::screened : ball_kernel_type::harmonic;
    const kernel_ball ball(type, R, x / R);
    const ball_kernels kernel(ball, 0.4 * R * sample_direction(rng));
    for (const std::size_t n : {1u, 7u, 8u, 9u, 31u, 40u, 100u}) {
      CAPTURE(n);
      std::vector<dvec3> nu, z;
      for (std::size_t i = 0; i < n; ++i) {
        nu.push_back(sample_direction(rng));
        z.push_back(R * std::cbrt(rand1d(rng)) * sample_direction(rng));
      }
      const lanes_of lanes(nu);
      std::vector<double> values(lanes.get().count);
      kernel.values(lanes.get(), values.data());
      const std::vector<double> greens = greens_at(ball, kernel, z);
      double sum = 0;
      for (std::size_t i = 0; i < n; ++i) {
        CHECK(values[i] == doctest::Approx(value_at(kernel, nu[i])).epsilon(1e-12));
        // a sample far out has more terms taken for all
        CHECK(greens[i] == doctest::Approx(greens_at(ball, kernel, z[i])).epsilon(1e-8));
        sum += values[i] * values[i];
      }
      for (std::size_t i = n; i < values.size(); ++i) values[i] = 0;
      CHECK(sum_of_products(values.data(), values.data(), values.size()) ==
            doctest::Approx(sum).epsilon(1e-12));
    }
  }
}
