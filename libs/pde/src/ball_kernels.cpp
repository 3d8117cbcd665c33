#include "ball_kernels.h"

#include <algorithm>
#include <cmath>

#include "wisp/pde/greens.h"

namespace wisp {

namespace {

constexpr double cut_off = 1e-10;

// Ratios i_l(z) / i_(l - 1)(z), l = 1 .. count, by their recurrence downwards, which is
// stable (Gautschi, Computational Aspects of Three-Term Recurrence Relations, 1967).
void rising_ratios(double z, int count, series_array& ratio) {
  if (!(z > 0)) {
    std::fill_n(ratio.begin(), count + 1, 0.0);
    return;
  }
  const int start = count + 16;
  // Amos, Computation of Modified Bessel Functions and Their Ratios, 1974
  double r = z / (start + std::hypot(start + 0.5, z));
  for (int l = start - 1; l > 0; --l) {
    r = z / (2 * l + 1 + z * r);
    if (l <= count) ratio[static_cast<std::size_t>(l)] = r;
  }
}

// Terms until they are below the cut off, where each is q times the last or less.
int terms_for(double q) {
  if (!(q > 1e-6)) return 3;
  return std::clamp(static_cast<int>(std::log(cut_off) / std::log(q) * 1.15) + 6, 3, series_terms);
}

// i_0(t) exp(-t)
double i0_scaled(double t) { return t < 1e-8 ? 1 - t : -std::expm1(-2 * t) / (2 * t); }

}  // namespace

kernel_ball::kernel_ball(ball_kernel_type t, double radius, double screening)
    : type(t), R(radius), k(screening) {
  const double x = k * R;
  if (type != ball_kernel_type::screened) return;
  if (x < pde_detail::harmonic_limit) {
    type = ball_kernel_type::harmonic;
    return;
  }
  rising_ratios(x, series_terms, rise);
  fall[1] = 1 + 1 / x;
  for (std::size_t l = 1; l < series_terms; ++l) {
    fall[l + 1] = (2 * static_cast<double>(l) + 1) / x + 1 / fall[l];
  }
}

ball_kernels::ball_kernels(const kernel_ball& ball, const dvec3& y)
    : ball_(ball), y_(y), r_(glm::length(y)) {
  const double R = ball.R, q = r_ / R;
  slope_ = 1 / R;
  mass_ = (R - r_) * (R + r_) / 6;
  if (ball.type == ball_kernel_type::harmonic) return;
  count_ = terms_for(q);
  if (ball.type == ball_kernel_type::biharmonic) {
    double power = 3 * mass_;
    for (int l = 0; l < count_; ++l, power *= q) {
      terms_[static_cast<std::size_t>(l)] = power * (2 * l + 1) / (2 * l + 3);
    }
    return;
  }

  const double x = ball.k * R, z = ball.k * r_;
  rising_ratios(z, count_, rise_);
  // i_0(z) / i_0(x)
  mean_ = z < 1e-8 ? mean_value_factor(R, ball.k)
                   : std::exp(z - x) * (std::expm1(-2 * z) / std::expm1(-2 * x)) * (x / z);
  double t = mean_;
  terms_[0] = t;
  for (int l = 1; l < count_; ++l) {
    const auto i = static_cast<std::size_t>(l);
    t *= rise_[i] / ball.rise[i];
    terms_[i] = (2 * l + 1) * t;
  }
  slope_ = r_ > 0 ? terms_[1] / (3 * r_) : mean_gradient_factor(R, ball.k) / 3;
  if (x < 1) {
    // (i_0(x) - i_0(z)) / (k^2 i_0(x)) by the series of its numerator
    double power = 1, difference = 1, factorial = 6, sum = 0;
    for (int n = 1; n < 10; ++n) {
      sum += difference / factorial;
      power *= z * z;
      difference = x * x * difference + power;
      factorial *= (2 * n + 2) * (2 * n + 3);
    }
    mass_ = (R - r_) * (R + r_) * sum * mean_value_factor(R, ball.k);
  } else {
    mass_ = (1 - mean_) / (ball.k * ball.k);
  }
}

std::size_t kernel_ball::product_rows() const {
  return type == ball_kernel_type::screened ? static_cast<std::size_t>(terms_for(served)) : 0;
}

void kernel_ball::products(const point_lanes& z, double* result) const {
  const auto rows = static_cast<int>(product_rows());
  if (rows == 0) return;
  const double x = k * R;
  for (std::size_t j = 0; j < z.count; ++j) {
    const double c = k * glm::length(dvec3{z.x[j], z.y[j], z.z[j]});
    result[j] = i0_scaled(c) / i0_scaled(x) * std::exp(c - x);
  }
  extend_products(k, rise.data(), rows, z, result);
}

void ball_kernels::values(const point_lanes& nu, double* result) const {
  if (ball_.type != ball_kernel_type::screened) return poisson_kernels(y_, ball_.R, nu, result);
  laplacians(nu, result);
}

void ball_kernels::laplacians(const point_lanes& nu, double* result) const {
  legendre_series(terms_.data(), count_, r_ > 0 ? y_ / r_ : dvec3{0}, nu, result);
}

void ball_kernels::greens(const point_lanes& z, const double* products, double* result) const {
  if (ball_.type != ball_kernel_type::screened) return harmonic_greens(y_, ball_.R, z, result);
  // exp(-k d) / d - k sum (2 l + 1) i_l(k r) k_l(k R) i_l(k b) / i_l(k R) P_l
  const double x = ball_.k * ball_.R, a = ball_.k * r_;
  double longest2 = 0;
  for (std::size_t j = 0; j < z.count; ++j) {
    longest2 = std::max(longest2, z.x[j] * z.x[j] + z.y[j] * z.y[j] + z.z[j] * z.z[j]);
  }
  const int count = std::min(terms_for(r_ * std::sqrt(longest2) / (ball_.R * ball_.R)), count_);
  series_array terms;
  double t = ball_.k * i0_scaled(a) * std::exp(a - x) / x;
  terms[0] = t;
  for (int l = 1; l < count; ++l) {
    const auto i = static_cast<std::size_t>(l);
    t *= rise_[i] * ball_.fall[i];
    terms[i] = (2 * l + 1) * t;
  }
  screened_greens(y_, ball_.k, terms.data(), count, z, products, result);
}

}  // namespace wisp
