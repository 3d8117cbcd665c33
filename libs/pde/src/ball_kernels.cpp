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

// Legendre polynomials of many cosines, by Bonnet's recurrence: in each step the loop
// over the cosines is one of independent operations.
struct ball_kernels::legendre {
  using lanes = std::array<double, max_batch>;
  lanes cosine = {}, p0, p1;
  int l = 0;

  legendre() {
    p0.fill(1);
    p1.fill(0);
  }
  void start() { p1 = cosine; }
  // From P_l, P_(l + 1) to the next.
  void next() {
    ++l;
    const double a = (2.0 * l + 1) / (l + 1.0), b = l / (l + 1.0);
    for (std::size_t j = 0; j < max_batch; ++j) {
      const double p2 = a * cosine[j] * p1[j] - b * p0[j];
      p0[j] = p1[j];
      p1[j] = p2;
    }
  }
};

void ball_kernels::series(std::span<const dvec3> nu, std::span<double> result) const {
  legendre p;
  for (std::size_t j = 0; j < nu.size(); ++j) p.cosine[j] = r_ > 0 ? glm::dot(y_, nu[j]) / r_ : 0;
  p.start();
  legendre::lanes sum;
  sum.fill(terms_[0]);
  for (int l = 1; l < count_; ++l) {
    const double t = terms_[static_cast<std::size_t>(l)];
    for (std::size_t j = 0; j < max_batch; ++j) sum[j] += t * p.p1[j];
    p.next();
  }
  std::copy_n(sum.begin(), nu.size(), result.begin());
}

void ball_kernels::values(std::span<const dvec3> nu, std::span<double> result) const {
  if (ball_.type == ball_kernel_type::screened) return series(nu, result);
  for (std::size_t j = 0; j < nu.size(); ++j) {
    result[j] = poisson_kernel(r_, glm::distance(y_, ball_.R * nu[j]), ball_.R);
  }
}

void ball_kernels::laplacians(std::span<const dvec3> nu, std::span<double> result) const {
  series(nu, result);
}

void ball_kernels::greens(std::span<const dvec3> z, std::span<double> result) const {
  if (ball_.type == ball_kernel_type::screened) return screened_greens(z, result);
  const double R = ball_.R;
  for (std::size_t j = 0; j < z.size(); ++j) {
    const double b2 = glm::dot(z[j], z[j]), yz = glm::dot(y_, z[j]);
    const double mirrored = r_ * r_ * b2 - 2 * R * R * yz + R * R * R * R;
    const double far = R / std::sqrt(std::max(mirrored, 0.0));
    result[j] = std::max(1 / glm::distance(y_, z[j]) - far, 0.0) / (4 * pi_d);
  }
}

// exp(-k d) / (4 pi d) - k / (4 pi) sum (2 l + 1) i_l(k r) i_l(k b) k_l(k R) / i_l(k R) P_l
void ball_kernels::screened_greens(std::span<const dvec3> z, std::span<double> result) const {
  const double R = ball_.R, k = ball_.k, x = k * R, a = k * r_;
  const auto i0_scaled = [](double t) { return t < 1e-8 ? 1 - t : -std::expm1(-2 * t) / (2 * t); };
  const double shared = k * i0_scaled(a) / i0_scaled(x) / x;
  legendre p;
  legendre::lanes c = {}, g = {}, sum = {}, rise = {};
  double longest = 0;
  for (std::size_t j = 0; j < z.size(); ++j) {
    const double b = glm::length(z[j]);
    longest = std::max(longest, b);
    c[j] = k * b;
    p.cosine[j] = r_ > 0 && b > 0 ? glm::dot(y_, z[j]) / (r_ * b) : 0;
    sum[j] = g[j] = shared * i0_scaled(c[j]) * std::exp(a + c[j] - 2 * x);
  }
  p.start();
  const int count = std::min(terms_for(r_ * longest / (R * R)), count_);
  // i_l / i_(l - 1) at k b, downwards as in rising_ratios
  std::array<legendre::lanes, series_terms + 1> rises;
  const int start = count + 16;
  for (std::size_t j = 0; j < max_batch; ++j) {
    rise[j] = c[j] / (start + std::hypot(start + 0.5, c[j]));
  }
  for (int l = start - 1; l > 0; --l) {
    for (std::size_t j = 0; j < max_batch; ++j) rise[j] = c[j] / (2 * l + 1 + c[j] * rise[j]);
    if (l <= count) rises[static_cast<std::size_t>(l)] = rise;
  }
  for (int l = 1; l < count; ++l) {
    const auto i = static_cast<std::size_t>(l);
    const double f = rise_[i] * ball_.fall[i] / ball_.rise[i];
    for (std::size_t j = 0; j < max_batch; ++j) {
      g[j] *= f * rises[i][j];
      sum[j] += (2 * l + 1) * g[j] * p.p1[j];
    }
    p.next();
  }
  for (std::size_t j = 0; j < z.size(); ++j) {
    const double d = glm::distance(y_, z[j]);
    result[j] = std::max(std::exp(-k * d) / d - sum[j], 0.0) / (4 * pi_d);
  }
}

}  // namespace wisp
