#pragma once

// Green's functions and Poisson kernels of balls and of the outside of a sphere, in
// three dimensions, for lap u - c u = f with k = sqrt(c) >= 0; c = 0 is the Poisson
// equation. In a ball of radius R around x without boundary,
//
//   u(x)      = C mean(u on the sphere) - int G f
//   grad u(x) = D mean(u nu on the sphere) - int grad G f,   nu the outward normal
//
// (Sawhney and Crane 2020, section 2 and appendix A). G > 0 here. Everything is written
// with decaying exponentials and expm1, so that it is right to a few ulps for k R from 0
// to any size: no switch loses digits, and nothing overflows.
//
// Lengths are in any one unit and k in its inverse; 0 <= r <= R, R > 0. The functions are
// safe to call from any thread; those that draw change the generator they are given.

#include <cmath>

#include "wisp/core/math.h"
#include "wisp/core/rng.h"

namespace wisp {

inline constexpr double pi_d = 3.14159265358979323846;

namespace pde_detail {

// Below this k R the equation is the Poisson equation to rounding: terms of (k R)^2.
inline constexpr double harmonic_limit = 1e-9;

// exp(-z) i_1(z) with the modified spherical Bessel function i_1 = (z cosh z - sinh z) / z^2.
inline double i1_scaled(double z) {
  if (z < 1) {
    const double q = z * z;
    return std::exp(-z) * z / 3 *
           (1 +
            q / 10 *
                (1 +
                 q / 28 *
                     (1 + q / 54 * (1 + q / 88 * (1 + q / 130 * (1 + q / 180 * (1 + q / 238)))))));
  }
  return ((z - 1) + (z + 1) * std::exp(-2 * z)) / (2 * z * z);
}

}  // namespace pde_detail

// C = k R / sinh(k R): 1 for k = 0.
inline double mean_value_factor(double R, double k) {
  const double x = k * R;
  if (x < pde_detail::harmonic_limit) return 1;
  return 2 * x * std::exp(-x) / -std::expm1(-2 * x);
}

// D: 3 / R for k = 0, else k / i_1(k R).
inline double mean_gradient_factor(double R, double k) {
  const double x = k * R;
  if (x < pde_detail::harmonic_limit) return 3 / R;
  return k * std::exp(-x) / pde_detail::i1_scaled(x);
}

// int G = (1 - C) / c: R^2 / 6 for k = 0.
inline double greens_mass(double R, double k) {
  const double x = k * R;
  if (x < pde_detail::harmonic_limit) return R * R / 6;
  if (x < 1) {
    // 1 - C = (sinh x - x) / sinh x by the series of its numerator
    const double q = x * x;
    const double s =
        1 +
        q / 20 *
            (1 +
             q / 42 * (1 + q / 72 * (1 + q / 110 * (1 + q / 156 * (1 + q / 210 * (1 + q / 272))))));
    return R * R / 6 * s * mean_value_factor(R, k);
  }
  return (1 - mean_value_factor(R, k)) / (k * k);
}

// G(r) = sinh(k (R - r)) / (4 pi r sinh(k R)); infinite for r = 0.
inline double greens(double r, double R, double k) {
  if (k * R < pde_detail::harmonic_limit) return (R - r) / (4 * pi_d * r * R);
  return std::exp(-k * r) * (std::expm1(-2 * k * (R - r)) / std::expm1(-2 * k * R)) /
         (4 * pi_d * r);
}

// |grad G| at the center, towards the point at distance r: (1 / r^2 - r / R^3) / (4 pi)
// for k = 0, else k^2 (k_1(k r) - i_1(k r) k_1(k R) / i_1(k R)) / (4 pi).
inline double greens_gradient(double r, double R, double k) {
  if (k * R < pde_detail::harmonic_limit) {
    const double p = r / R;
    return (1 - p * p * p) / (4 * pi_d * r * r);
  }
  using pde_detail::i1_scaled;
  const double z = k * r, x = k * R;
  const double near = std::exp(-z) * (1 + z);
  const double far =
      (1 + x) * (r / R) * (r / R) * std::exp(z - 2 * x) * (i1_scaled(z) / i1_scaled(x));
  return std::max(near - far, 0.0) / (4 * pi_d * r * r);
}

// The field of a unit source in free space, exp(-k r) / (4 pi r), and its slope along r.
inline double free_greens(double r, double k) { return std::exp(-k * r) / (4 * pi_d * r); }
inline double free_greens_slope(double r, double k) {
  return -std::exp(-k * r) * (1 + k * r) / (4 * pi_d * r * r);
}

// The Poisson kernel of the ball for k = 0, relative to the mean over the sphere:
// u(y) = mean(P u), with y at distance r from the center and d from the point of the
// sphere.
inline double poisson_kernel(double r, double d, double R) {
  return R * (R - r) * (R + r) / (d * d * d);
}

// A direction, uniform on the sphere (Marsaglia, Choosing a Point from the Surface of a
// Sphere, 1972).
inline dvec3 sample_direction(rng_state& rng) {
  while (true) {
    const double a = next_uint(rng) * 0x1p-31 - 1, b = next_uint(rng) * 0x1p-31 - 1;
    const double s = a * a + b * b;
    if (!(s < 1)) continue;
    const double w = 2 * std::sqrt(1 - s);
    return {a * w, b * w, 1 - 2 * s};
  }
}

// A distance r from the center with the density of 4 pi r^2 G(r) / int G.
inline double sample_greens_radius(rng_state& rng, double R, double k) {
  const double x = k * R;
  if (x < 3) {
    while (true) {
      // 6 p (1 - p): the median of three
      const double a = rand1d(rng), b = rand1d(rng), c = rand1d(rng);
      const double p = std::max(std::min(a, b), std::min(std::max(a, b), c));
      if (x < pde_detail::harmonic_limit) return p * R;
      const double q = 1 - p;
      const double accept = std::exp(-x * p) * std::expm1(-2 * x * q) / (q * std::expm1(-2 * x));
      if (rand1d(rng) < accept) return p * R;
    }
  }
  while (true) {
    const double r = -std::log((1 - rand1d(rng)) * (1 - rand1d(rng))) / k;
    if (r < R && rand1d(rng) < -std::expm1(-2 * k * (R - r))) return r;
  }
}

// A distance for integrals with grad G, and its weight 4 pi r^2 |grad G| / density,
// which is bounded.
struct weighted_radius {
  double r = 0, weight = 0;
};
inline weighted_radius sample_gradient_radius(rng_state& rng, double R, double k) {
  const double x = k * R;
  if (x < 3) {
    const double r = R * (1 - rand1d(rng));
    return {r, 4 * pi_d * r * r * greens_gradient(r, R, k) * R};
  }
  // (1 + z) exp(-z) / 2, z = k r, where z < x
  while (true) {
    double product = 1 - rand1d(rng);
    if (rand1d(rng) < 0.5) product *= 1 - rand1d(rng);
    const double z = -std::log(product);
    if (!(z < x) || z == 0) continue;
    const double inside = 1 - std::exp(-x) * (1 + x / 2);
    const double r = z / k, density = k * (1 + z) * std::exp(-z) / (2 * inside);
    return {r, 4 * pi_d * r * r * greens_gradient(r, R, k) / density};
  }
}

// Where a harmonic function's mean outside of a sphere of radius R around the origin is
// taken: from x, |x| > R, Brownian motion meets it with probability R / |x|, at a point of
// this distribution (the exterior Poisson kernel, whose cosine has the density of Henyey
// and Greenstein with g = R / |x|).
inline dvec3 sample_exterior_return(rng_state& rng, const dvec3& x, double R) {
  const double l = glm::length(x), g = R / l;
  const double u = rand1d(rng);
  const double s = (1 - g) * (1 + g) / (1 - g + 2 * g * u);
  const double c = std::clamp(
      g > 1e-4 ? (1 + g * g - s * s) / (2 * g) : 2 * u - 1 + 6 * g * u * (1 - u), -1.0, 1.0);
  const double t = std::sqrt((1 - c) * (1 + c)), phi = 2 * pi_d * rand1d(rng);
  const dvec3 w = x / l;
  const dvec3 a = std::abs(w.x) < 0.6 ? dvec3{1, 0, 0} : dvec3{0, 1, 0};
  const dvec3 e = glm::normalize(glm::cross(w, a)), f = glm::cross(w, e);
  return R * (c * w + t * (std::cos(phi) * e + std::sin(phi) * f));
}

// Green's function for k = 0 of the outside of the sphere of radius R around the origin;
// 0 where y is within it.
inline double exterior_greens(const dvec3& x, const dvec3& y, double R) {
  const double lx = glm::length(x), ly = glm::length(y);
  if (!(ly > R)) return 0;
  const dvec3 mirrored = x * (R * R / (lx * lx));
  return std::max(1 / glm::distance(x, y) - R / (lx * glm::distance(y, mirrored)), 0.0) /
         (4 * pi_d);
}

}  // namespace wisp
