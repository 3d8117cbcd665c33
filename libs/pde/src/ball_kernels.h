#pragma once

// What values on the sphere of a ball, and a source in it, are worth at a point that is
// not the center. For c = 0 these have closed forms; for screened equations, and for the
// Laplacian of biharmonic ones, they are series in Legendre polynomials, which fall at
// least like (r / R)^l and are cut off below 1e-10 of the first term.

#include <array>
#include <cstddef>

#include "ball_lanes.h"

namespace wisp {

enum struct ball_kernel_type { harmonic, screened, biharmonic };

// Kernels are for points within this part of the radius, and terms that their series may
// need.
inline constexpr double served = 0.6;
inline constexpr int series_terms = 64;
using series_array = std::array<double, series_terms + 1>;

// A ball of radius R around the origin; k is the square root of the screening.
struct kernel_ball {
  ball_kernel_type type = ball_kernel_type::harmonic;
  double R = 1, k = 0;
  // Screened: i_l / i_(l - 1) and k_l / k_(l - 1) of modified spherical Bessel functions
  // at k R, from l = 1.
  series_array rise = {}, fall = {};

  kernel_ball() = default;
  kernel_ball(ball_kernel_type type, double R, double k);

  // What Green's functions of all points of the ball need of sources at z: rows of
  // z.count numbers. None where they are closed forms.
  std::size_t product_rows() const;
  void products(const point_lanes& z, double* result) const;
};

// A point y of it, |y| <= served R.
class ball_kernels {
 public:
  ball_kernels(const kernel_ball& ball, const dvec3& y);

  // u(y) = mean over nu of value(nu) u(R nu) - ... The mean of value is value_mean(), and
  // that of value(nu) nu is value_slope() y.
  void values(const point_lanes& nu, double* result) const;
  double value_mean() const { return mean_; }
  double value_slope() const { return slope_; }
  // Biharmonic: u(y) = ... - mean of laplacian(nu) lap u(R nu).
  void laplacians(const point_lanes& nu, double* result) const;
  // Green's function for sources at z, |z| <= R; z != y. `products` are those of the ball.
  void greens(const point_lanes& z, const double* products, double* result) const;
  // Its integral over the ball.
  double greens_mass() const { return mass_; }

 private:
  const kernel_ball& ball_;
  dvec3 y_;
  double r_, mean_ = 1, slope_ = 0, mass_ = 0;
  // Screened: (2 l + 1) i_l(k r) / i_l(k R). Biharmonic, for the Laplacian:
  // (2 l + 1) (R^2 - r^2) / (2 (2 l + 3)) (r / R)^l.
  series_array terms_;
  int count_ = 0;
  series_array rise_;  // i_l / i_(l - 1) at k r
};

}  // namespace wisp
