#pragma once

#include "wisp/pde/domain.h"

namespace wisp {

struct domain_data {
  domain_side side = domain_side::interior;
  dbox3 bounds = {};
  bool bounded = false;  // the solid, whichever side is the domain
  double size = 1;       // the diagonal of the bounds
  dvec3 center = {0, 0, 0};

  virtual ~domain_data();
  void finish(domain_side s);
  // -1 inside of the solid, 1 outside, 0 on its surface; unknown_side where its distance
  // is not a number
  static constexpr int unknown_side = 2;
  virtual int side_of(const dvec3& p) const = 0;
  virtual std::size_t bytes() const = 0;
  virtual void clearances(std::span<const dvec3> points, std::span<double> radii,
                          double tolerance) const = 0;
  virtual pde_domain::nearest find_boundary(const dvec3& p, double epsilon) const = 0;
};

}  // namespace wisp
