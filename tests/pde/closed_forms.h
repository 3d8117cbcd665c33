#pragma once

// Problems whose solutions are known, and the statistics that hold estimates to them.

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/pde/solve.h"

namespace wisp::test {

struct known_problem {
  std::string name = "";
  pde_problem problem = {};
  std::function<double(const dvec3&)> exact = {};
  std::function<dvec3(const dvec3&)> gradient = {};
};

// Points of the domain, uniform in a box.
inline std::vector<dvec3> points_in(const pde_domain& domain, int count, const dbox3& box,
                                    std::uint64_t seed = 1) {
  rng_state rng = make_rng(seed, 77);
  std::vector<dvec3> points;
  for (int tries = 0; static_cast<int>(points.size()) < count && tries < 1000 * count; ++tries) {
    const double x = rand1d(rng), y = rand1d(rng), z = rand1d(rng);
    const dvec3 p = box.min + dvec3{x, y, z} * (box.max - box.min);
    if (domain.contains(p)) points.push_back(p);
  }
  return points;
}

// How estimates lie about the truth in units of their standard errors. For right
// estimates `squares` is the mean of `count` squares of about normal numbers.
struct scores {
  double sum = 0, squares = 0;
  int count = 0;
  void add(double estimate, double error, double exact) {
    const double z = (estimate - exact) / error;
    sum += z;
    squares += z * z;
    ++count;
  }
  // Both within 5 standard deviations: a false alarm in about 1e6 (mean) and 1e5 (mean of
  // squares, which has a longer tail).
  bool mean_is_right() const { return std::abs(sum) < 5 * std::sqrt(count); }
  bool spread_is_right() const {
    return squares / count < 1 + 5 * std::sqrt(2.0 / count) &&
           squares / count > 1 - 5 * std::sqrt(2.0 / count);
  }
};

}  // namespace wisp::test
