#pragma once

// The loops of ball_kernels.h over directions and points, as vector code that is chosen
// at run time.

#include <cstddef>

#include "wisp/core/math.h"

namespace wisp {

// Arrays of what the loops run over are padded to a multiple of this.
inline constexpr std::size_t kernel_lanes = 8;
constexpr std::size_t padded(std::size_t n) {
  return (n + kernel_lanes - 1) / kernel_lanes * kernel_lanes;
}

// Points relative to the center of a ball, or directions; count is a multiple of
// kernel_lanes, as is that of all results.
struct point_lanes {
  const double *x = nullptr, *y = nullptr, *z = nullptr;
  std::size_t count = 0;
};

// Poisson's kernel of a ball of radius R at y, for its points R nu.
void poisson_kernels(const dvec3& y, double R, const point_lanes& nu, double* result);
// Sum over l < count of terms[l] P_l(axis . nu).
void legendre_series(const double* terms, int count, const dvec3& axis, const point_lanes& nu,
                     double* result);
// The harmonic Green's function at y of a ball of radius R, for sources at z.
void harmonic_greens(const dvec3& y, double R, const point_lanes& z, double* result);
// exp(-k d) / d, d = |y - z|, less the sum over l < count of
// terms[l] products[l z.count + j] P_l(cosine of y and z), over 4 pi; not below 0.
void screened_greens(const dvec3& y, double k, const double* terms, int count, const point_lanes& z,
                     const double* products, double* result);
// From row 0, i_0(k |z|) / i_0(k R), on: products[l z.count + j] = i_l(k |z_j|) / i_l(k R)
// for l < rows, given rise[l] = i_l(k R) / i_(l - 1)(k R).
void extend_products(double k, const double* rise, int rows, const point_lanes& z,
                     double* products);
// Sum of a[j] b[j]; n is a multiple of kernel_lanes.
double sum_of_products(const double* a, const double* b, std::size_t n);

}  // namespace wisp
