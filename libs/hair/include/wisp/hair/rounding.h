#pragma once

// How far value and density in float may lie from the exact ones of the same
// inputs: what rounding does to the terms of each lobe, to first order. Pure, safe to call
// from any thread.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/vec3.hpp>

#include "wisp/hair/bsdf.h"

namespace wisp::hair {

// In units of 2^-24, half the distance between 1 and the next float, lobe p has
// the relative error
//   1 + |log A_p| + (sqrt(d) + sqrt(v)) / v + (p + 2) / s,
// with d the squared distance of the directions in longitudinal_mp: absolute
// errors of that size in directions and angles, against the widths of the lobe.
// The residual lobe, a quotient of differences, has the absolute error of A_p = 1.
// Of a sum the bound is the sum of the bounds, of the density the same with the
// lobes' probabilities. `bsdf`, `hit` and `wi` in double are those in float,
// converted; what float gives lies within `factor` times this, and within the
// least number that exp_nonpositive knows, for directions of unit length.
//
// A weight's square has to be a float: a length |A_p| has the absolute error
// 2^-73, so that where all are below that the bound on the density is open, as
// the density itself is. Channel weights of hair_hit are taken to be about 1.
inline hair_value<double> rounding_bound(const hair_bsdf<double>& bsdf, const hair_hit<double>& hit,
                                         const glm::dvec3& wi, double factor = 10) {
  constexpr double unit = 0x1p-24;
  // Where exp_nonpositive cuts off, and where products leave the normal floats.
  constexpr double least = 0x1p-125;
  double sin_i = std::clamp(wi.x, -1.0, 1.0);
  double cos_i = std::min(std::sqrt(wi.y * wi.y + wi.z * wi.z), 1.0);
  double phi = detail::angle_of(wi.z * hit.cos_phi_o - wi.y * hit.sin_phi_o,
                                wi.y * hit.cos_phi_o + wi.z * hit.sin_phi_o);
  auto log_of = [](double a) { return std::abs(std::log(std::max(a, 1e-38))); };
  auto last = static_cast<std::size_t>(bsdf.p_max);
  // The sum of the weights, which all probabilities have below them.
  double weights = 0, weights_error = 0;
  for (std::size_t p = 0; p <= last; p++) {
    weights += glm::length(glm::dvec3(hit.ap[p]));
    weights_error += hit.ap[p].w * log_of(hit.ap[p].w);
  }
  double open = 0x1p-73 / std::max(weights, 1e-60);
  hair_value<double> bound;
  for (std::size_t p = 0; p <= last; p++) {
    double mn = longitudinal_mp(sin_i, cos_i, hit.sin_theta_op[p], hit.cos_theta_op[p],
                                bsdf.inv_v[p], bsdf.mp_norm[p]) *
                azimuthal_np(phi - hit.exit_phi[p], bsdf.inv_s[p], bsdf.np_norm[p]);
    double floor = least * bsdf.mp_norm[p] * std::max(1.0, bsdf.np_norm[p]);
    double d = sqr(sin_i + hit.sin_theta_op[p]) + sqr(cos_i - hit.cos_theta_op[p]);
    double shape = 1 + (std::sqrt(d) + std::sqrt(bsdf.v[p])) * bsdf.inv_v[p] +
                   static_cast<double>(p + 2) * bsdf.inv_s[p];
    auto of = [&](double a) {
      return factor * unit * mn * (a * (shape + log_of(a)) + (p == last ? 1 : 0)) +
             floor * std::max(1.0, a);
    };
    for (int k = 0; k < 3; k++) bound.value[k] += of(hit.ap[p][k]);
    bound.pdf += of(hit.ap[p].w) + mn * (factor * unit * hit.ap[p].w * weights_error + open);
  }
  return bound;
}

}  // namespace wisp::hair
