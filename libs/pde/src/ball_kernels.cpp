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

double ball_kernels::series(double cosine) const {
  // Bonnet's recurrence
  double p0 = 1, p1 = cosine, sum = terms_[0];
  for (int l = 1; l < count_; ++l) {
    sum += terms_[static_cast<std::size_t>(l)] * p1;
    const double p2 = ((2 * l + 1) * cosine * p1 - l * p0) / (l + 1);
    p0 = p1;
    p1 = p2;
  }
  return sum;
}

double ball_kernels::value(const dvec3& nu) const {
  if (ball_.type == ball_kernel_type::screened) return series(cosine_of(nu));
  return poisson_kernel(r_, glm::distance(y_, ball_.R * nu), ball_.R);
}

double ball_kernels::laplacian(const dvec3& nu) const { return series(cosine_of(nu)); }

double ball_kernels::greens(const dvec3& z) const {
  const double R = ball_.R, k = ball_.k;
  const double d = glm::distance(y_, z), b = glm::length(z), yz = glm::dot(y_, z);
  if (ball_.type != ball_kernel_type::screened) {
    const double mirrored = r_ * r_ * b * b - 2 * R * R * yz + R * R * R * R;
    return std::max(1 / d - R / std::sqrt(std::max(mirrored, 0.0)), 0.0) / (4 * pi_d);
  }
  // exp(-k d) / (4 pi d) - k / (4 pi) sum (2 l + 1) i_l(k r) i_l(k b) k_l(k R) / i_l(k R) P_l
  const double x = k * R, a = k * r_, c = k * b;
  const auto i0_scaled = [](double t) { return t < 1e-8 ? 1 - t : -std::expm1(-2 * t) / (2 * t); };
  double g = k * i0_scaled(a) * i0_scaled(c) / i0_scaled(x) * std::exp(a + c - 2 * x) / x;
  const double cosine = r_ > 0 && b > 0 ? yz / (r_ * b) : 0;
  const int count = std::min(terms_for(r_ * b / (R * R)), count_);
  series_array rise_b;
  rising_ratios(c, count, rise_b);
  double p0 = 1, p1 = cosine, sum = g;
  for (int l = 1; l < count; ++l) {
    const auto i = static_cast<std::size_t>(l);
    g *= rise_[i] * rise_b[i] * ball_.fall[i] / ball_.rise[i];
    sum += (2 * l + 1) * g * p1;
    const double p2 = ((2 * l + 1) * cosine * p1 - l * p0) / (l + 1);
    p0 = p1;
    p1 = p2;
  }
  return std::max(std::exp(-k * d) / d - sum, 0.0) / (4 * pi_d);
}

}  // namespace wisp
