#pragma once

// Kernels of balls for one direction or point, which take many at once.

#include <array>
#include <vector>

#include "../../libs/pde/src/ball_kernels.h"

namespace wisp::test {

// Points in arrays as the kernels take them, filled up with the last one.
class lanes_of {
 public:
  explicit lanes_of(const std::vector<dvec3>& points) {
    for (std::size_t i = 0; i < padded(points.size()); ++i) {
      const dvec3& p = points[std::min(i, points.size() - 1)];
      x_.push_back(p.x);
      y_.push_back(p.y);
      z_.push_back(p.z);
    }
  }
  point_lanes get() const { return {x_.data(), y_.data(), z_.data(), x_.size()}; }

 private:
  std::vector<double> x_, y_, z_;
};

inline double value_at(const ball_kernels& kernel, const dvec3& nu) {
  std::array<double, kernel_lanes> result;
  const lanes_of lanes({nu});
  kernel.values(lanes.get(), result.data());
  return result[0];
}

inline double laplacian_at(const ball_kernels& kernel, const dvec3& nu) {
  std::array<double, kernel_lanes> result;
  const lanes_of lanes({nu});
  kernel.laplacians(lanes.get(), result.data());
  return result[0];
}

inline std::vector<double> greens_at(const kernel_ball& ball, const ball_kernels& kernel,
                                     const std::vector<dvec3>& z) {
  const lanes_of lanes(z);
  const point_lanes all = lanes.get();
  std::vector<double> products(all.count * ball.product_rows()), result(all.count);
  ball.products(all, products.data());
  kernel.greens(all, products.data(), result.data());
  result.resize(z.size());
  return result;
}

inline double greens_at(const kernel_ball& ball, const ball_kernels& kernel, const dvec3& z) {
  return greens_at(ball, kernel, std::vector<dvec3>{z})[0];
}

}  // namespace wisp::test
