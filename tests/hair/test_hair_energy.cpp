// Energy of the hair model by quadrature. Samples cannot tell: where nothing is
// absorbed f / pdf is 1 whatever M_p and N_p are.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/hair/absorption.h"
#include "wisp/hair/bsdf.h"

using namespace wisp;
using namespace wisp::hair;

namespace {

constexpr double pi = pi_v<double>;
using doctest::Approx;

// A peak of what is integrated, and how narrow it is.
struct peak {
  double at, width;
};
struct node {
  double x, weight;
};

// Nodes over [a, b]: eight of Gauss and Legendre in each of many panels, which
// shrink to a fraction of the width towards every peak.
std::vector<node> make_nodes(double a, double b, const std::vector<peak>& peaks) {
  constexpr std::array<double, 4> x = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                       0.9602898564975363};
  constexpr std::array<double, 4> w = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                       0.1012285362903763};
  std::vector<double> edges = {a, b};
  for (const peak& p : peaks) {
    edges.push_back(std::clamp(p.at, a, b));
    for (double s = p.width; s < b - a; s *= 2.2) {
      edges.push_back(std::clamp(p.at - s, a, b));
      edges.push_back(std::clamp(p.at + s, a, b));
    }
  }
  for (int i = 1; i < 4; i++) edges.push_back(a + (b - a) * i / 4);
  std::sort(edges.begin(), edges.end());
  std::vector<node> nodes;
  double from = a;
  for (double to : edges) {
    // Neighbours that are closer than any width matters are one.
    if (to - from < 1e-9 && to != b) continue;
    double half = (to - from) / 2, mid = (to + from) / 2;
    for (std::size_t i = 0; i < 4; i++) {
      nodes.push_back({mid - half * x[i], half * w[i]});
      nodes.push_back({mid + half * x[i], half * w[i]});
    }
    from = to;
  }
  return nodes;
}

template <typename T>
glm::vec<3, T> direction(double theta, double phi) {
  double c = std::cos(theta);
  return {T(std::sin(theta)), T(c * std::cos(phi)), T(c * std::sin(phi))};
}

// The integral of M_p cos(theta) over theta and that of N_p over phi, for lobe
// p of a hit.
template <typename T>
double integral_of_mp(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit, std::size_t p) {
  double at = -std::atan2(double(hit.sin_theta_op[p]), double(hit.cos_theta_op[p]));
  double sum = 0;
  for (node n : make_nodes(-pi / 2, pi / 2, {{at, std::sqrt(double(bsdf.v[p]))}})) {
    double c = std::cos(n.x);
    sum += n.weight * c *
           double(longitudinal_mp<T>(T(std::sin(n.x)), T(c), hit.sin_theta_op[p],
                                     hit.cos_theta_op[p], bsdf.inv_v[p], bsdf.mp_norm[p]));
  }
  return sum;
}
template <typename T>
double integral_of_np(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit, std::size_t p) {
  double width = bsdf.inv_s[p] > 0 ? 1 / double(bsdf.inv_s[p]) : 1.0;
  double at = wrap_angle(double(hit.exit_phi[p])), wrap = wrap_angle(at + pi), sum = 0;
  for (node n :
       make_nodes(-pi, pi, {{at, width}, {wrap, 1}, {at - 2 * pi, width}, {at + 2 * pi, width}}))
    sum += n.weight *
           double(azimuthal_np<T>(T(n.x) - hit.exit_phi[p], bsdf.inv_s[p], bsdf.np_norm[p]));
  return sum;
}

// Value and pdf over the whole sphere, by the public functions alone, with
// nodes where the lobes are; wo has the azimuth phi_o.
struct totals {
  glm::dvec3 value = {0, 0, 0};
  double pdf = 0;
};
template <typename T>
totals over_sphere(const hair_bsdf<T>& bsdf, const hair_hit<T>& hit, double phi_o) {
  std::vector<peak> thetas, phis;
  for (std::size_t p = 0; p <= std::size_t(bsdf.p_max); p++) {
    thetas.push_back({-std::atan2(double(hit.sin_theta_op[p]), double(hit.cos_theta_op[p])),
                      std::sqrt(double(bsdf.v[p]))});
    if (p == std::size_t(bsdf.p_max)) continue;
    double at = wrap_angle(double(hit.exit_phi[p]) + phi_o), width = 1 / double(bsdf.inv_s[p]);
    phis.push_back({at, width});
    phis.push_back({at > 0 ? at - 2 * pi : at + 2 * pi, width});
    phis.push_back({wrap_angle(at + pi), 1});
  }
  auto across = make_nodes(-pi, pi, phis);
  totals sum;
  for (node t : make_nodes(-pi / 2, pi / 2, thetas)) {
    totals row;
    for (node n : across) {
      auto f = eval_hair_with_pdf<T>(bsdf, hit, direction<T>(t.x, n.x));
      row.value += n.weight * glm::dvec3(f.value);
      row.pdf += n.weight * double(f.pdf);
    }
    sum.value += t.weight * std::cos(t.x) * row.value;
    sum.pdf += t.weight * std::cos(t.x) * row.pdf;
  }
  return sum;
}

// What a fibre gives back in all: the first reflection and the geometric series
// of all that enters, by textbook formulas.
double energy_of(double eta, double sigma, double h, double theta_o) {
  using real = long double;  // asin near 1 and eta near 1 cost half of the digits
  real n = eta, sin_o = std::sin(real(theta_o)), cos_o = std::cos(real(theta_o));
  real gamma_o = std::asin(real(h)), theta_t = std::asin(sin_o / n);
  real gamma_t = std::asin(h / (std::sqrt(n * n - sin_o * sin_o) / cos_o));
  real c = cos_o * std::cos(gamma_o), t = std::sqrt(1 - (1 - c * c) / (n * n));
  real rs = (c - n * t) / (c + n * t), rp = (n * c - t) / (n * c + t);
  real f = (rs * rs + rp * rp) / 2;
  real through = std::exp(-sigma * 2 * std::cos(gamma_t) / std::cos(theta_t));
  return static_cast<double>(f + (1 - f) * (1 - f) * through / (1 - f * through));
}
constexpr bool wide_truth = std::numeric_limits<long double>::digits >= 64;

const std::array<double, 9> thetas_o = {-1.5707, -1.56, -1.2, -0.5, 0, 0.3, 1, 1.5, 1.570796};
const std::array<double, 9> hs = {-1, -0.999, -0.6, -0.2, 0, 0.35, 0.8, 0.9999, 1};

}  // namespace

TEST_CASE("hair: M_p and N_p of every lobe integrate to 1") {
  double worst_m = 0, worst_n = 0;
  for (double beta : {1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 0.7, 0.85, 1.0})
    for (int variant = 0; variant < 4; variant++) {
      hair_parameters<double> k;
      k.beta_m = k.beta_n = beta;
      k.alpha = 3;
      k.p_max = 4;
      if (variant == 1) k.coat = 0.7;
      if (variant >= 2) k.roughness[0] = {1 - beta, beta};
      if (variant == 2) k.roughness[1] = {0.02, 0.6};
      if (variant == 3) {
        k.coat = 0.3;
        k.roughness[2] = {0.4, 0.01};
      }
      auto bsdf = make_hair_bsdf(k);
      for (double theta_o : thetas_o) {
        auto hit = make_hair_hit<double>(bsdf, {0, 0, 0}, 0.35, direction<double>(theta_o, 2));
        for (std::size_t p = 0; p <= 4; p++) {
          CAPTURE(beta);
          CAPTURE(variant);
          CAPTURE(theta_o);
          CAPTURE(p);
          double m = integral_of_mp(bsdf, hit, p), n = integral_of_np(bsdf, hit, p);
          worst_m = std::max(worst_m, std::abs(m - 1));
          worst_n = std::max(worst_n, std::abs(n - 1));
          REQUIRE(m == Approx(1).epsilon(1e-8));
          REQUIRE(n == Approx(1).epsilon(1e-8));
        }
      }
    }
  CHECK(worst_m < 2e-9);
  CHECK(worst_n < 2e-9);
}

TEST_CASE("hair: the density of the azimuth is the one of the logistic") {
  // Not only of total 1: the trimmed logistic itself, wherever its turn is counted from.
  for (double beta : {0.05, 0.3, 1.0}) {
    auto bsdf = make_hair_bsdf<double>({1.55, 0.3, beta, 2, 3});
    double s = 0.626657069 * (0.265 * beta + 1.194 * beta * beta + 5.372 * std::pow(beta, 22));
    auto cdf = [s](double x) { return 1 / (1 + std::exp(-x / s)); };
    for (int i = -200; i < 200; i++) {
      double x = (i + 0.5) / 200 * pi, e = std::exp(-std::abs(x) / s);
      double truth = e / (s * (1 + e) * (1 + e)) / (cdf(pi) - cdf(-pi));
      for (int turn : {-2, -1, 0, 1, 3})
        REQUIRE(azimuthal_np(x + turn * 2 * pi, bsdf.inv_s[0], bsdf.np_norm[0]) ==
                Approx(truth).epsilon(1e-11 / std::min(1.0, s)));
    }
    CHECK(azimuthal_np(1.3, bsdf.inv_s[3], bsdf.np_norm[3]) == Approx(1 / (2 * pi)).epsilon(1e-14));
  }
}

TEST_CASE("hair: a white furnace by quadrature, lobe by lobe") {
  const std::vector<std::pair<double, double>> betas = {
      {0.001, 0.001}, {0.001, 1}, {1, 0.001}, {0.03, 0.2}, {0.3, 0.03}, {0.7, 0.7}, {1, 1}};
  double worst = 0, worst_pdf = 0;
  for (auto [bm, bn] : betas)
    for (double alpha : {0.0, 2.0, 5.0, -3.0})
      for (double eta : {1.0, 1.3, 1.55, 3.0}) {
        auto bsdf = make_hair_bsdf<double>({eta, bm, bn, alpha, 3});
        for (double theta_o : thetas_o) {
          std::array<double, 4> m{};
          for (double h : hs) {
            auto hit = make_hair_hit<double>(bsdf, {0, 0, 0}, h, direction<double>(theta_o, -1));
            double energy = 0, pdf = 0;
            for (std::size_t p = 0; p <= 3; p++) {
              if (m[p] == 0) m[p] = integral_of_mp(bsdf, hit, p);  // does not hang on h
              double mn = m[p] * (hit.ap[p].x > 1e-7 ? integral_of_np(bsdf, hit, p) : 1);
              energy += hit.ap[p].x * mn;
              pdf += hit.ap[p].w * mn;
            }
            worst = std::max(worst, std::abs(energy - 1));
            worst_pdf = std::max(worst_pdf, std::abs(pdf - 1));
          }
        }
      }
  CHECK(worst < 2e-9);
  CHECK(worst_pdf < 2e-9);
}

TEST_CASE("hair: a white furnace by quadrature, whole directions") {
  // All of eval_hair at once, so that a lobe with another's azimuth or tilt or
  // weight is seen.
  double worst = 0, worst_pdf = 0;
  auto rng = make_rng(5);
  for (double bm : {0.1, 0.3, 1.0})
    for (double bn : {0.1, 0.4, 1.0})
      for (double alpha : {0.0, 2.0, 5.0, -3.0}) {
        double eta = std::array{1.0, 1.3, 1.55, 3.0}[rand_index(rng, 4)];
        double theta_o = thetas_o[rand_index(rng, 9)], h = hs[rand_index(rng, 9)];
        double phi_o = 6.28 * rand1d(rng) - 3.14;
        auto bsdf = make_hair_bsdf<double>({eta, bm, bn, alpha, 1 + int(rand_index(rng, 5))});
        auto hit = make_hair_hit<double>(bsdf, {0, 0, 0}, h, direction<double>(theta_o, phi_o));
        auto sum = over_sphere(bsdf, hit, phi_o);
        CAPTURE(bm);
        CAPTURE(bn);
        CAPTURE(alpha);
        CHECK(sum.value.x == Approx(1).epsilon(1e-8));
        CHECK(sum.pdf == Approx(1).epsilon(1e-8));
        worst = std::max(worst, std::abs(sum.value.z - 1));
        worst_pdf = std::max(worst_pdf, std::abs(sum.pdf - 1));
      }
  CHECK(worst < 1e-9);
  CHECK(worst_pdf < 1e-9);
}

TEST_CASE("hair: a white furnace in float") {
  double worst = 0, worst_pdf = 0;
  for (double beta : {0.05, 0.3, 1.0})
    for (double alpha : {0.0, 5.0})
      for (double theta_o : {-1.5, 0.4}) {
        auto bsdf = make_hair_bsdf<float>({1.55f, float(beta), float(beta), float(alpha), 3});
        auto hit = make_hair_hit<float>(bsdf, {0, 0, 0}, 0.7f, direction<float>(theta_o, 1));
        auto sum = over_sphere(bsdf, hit, 1);
        worst = std::max(worst, std::abs(sum.value.x - 1));
        worst_pdf = std::max(worst_pdf, std::abs(sum.pdf - 1));
      }
  CHECK(worst < 1e-6);
  CHECK(worst_pdf < 1e-6);
  // Lobes so narrow that the rounding of a direction is a part of their width.
  double narrow = 0;
  for (double beta : {0.001, 0.01})
    for (double theta_o : {-1.2, 0.4}) {
      auto bsdf = make_hair_bsdf<float>({1.55f, float(beta), float(beta), 2, 3});
      auto hit = make_hair_hit<float>(bsdf, {0, 0, 0}, 0.7f, direction<float>(theta_o, 1));
      double energy = 0;
      for (std::size_t p = 0; p <= 3; p++)
        energy += double(hit.ap[p].x) * integral_of_mp(bsdf, hit, p) * integral_of_np(bsdf, hit, p);
      narrow = std::max(narrow, std::abs(energy - 1));
    }
  CHECK(narrow < 2e-4);
}

TEST_CASE("hair: energy with absorption is the sum of A_p and the geometric series") {
  double worst = 0;
  for (double eta : {1.0, 1.3, 1.55, 3.0})
    for (int p_max = 1; p_max <= max_p_max; p_max++) {
      auto bsdf = make_hair_bsdf<double>({eta, 0.3, 0.3, 2, p_max});
      for (double theta_o : {-1.56, -1.2, -0.5, 0.0, 0.3, 1.0, 1.5})
        for (double h : {-0.999, -0.6, 0.0, 0.35, 0.8, 0.9999})
          for (double sigma : {0.0, 1e-6, 0.1, 1.0, 7.0, 1e4}) {
            auto hit = make_hair_hit<double>(bsdf, {sigma, 2 * sigma, 0}, h,
                                             direction<double>(theta_o, 3));
            glm::dvec3 sum = {0, 0, 0};
            double chance = 0, weights = 0;
            for (std::size_t p = 0; p <= std::size_t(p_max); p++) {
              sum += glm::dvec3(hit.ap[p]);
              chance += hit.ap[p].w;
              weights += glm::length(glm::dvec3(hit.ap[p]));
            }
            for (std::size_t p = 0; p <= std::size_t(p_max); p++)
              worst = std::max(
                  worst, std::abs(hit.ap[p].w - glm::length(glm::dvec3(hit.ap[p])) / weights));
            worst = std::max({worst, std::abs(sum.x - energy_of(eta, sigma, h, theta_o)),
                              std::abs(sum.y - energy_of(eta, 2 * sigma, h, theta_o)),
                              std::abs(sum.z - 1), std::abs(chance - 1)});
          }
    }
  CHECK(worst < (wide_truth ? 1e-12 : 1e-9));
  // And so does the light over the sphere, in colours of their own.
  auto rng = make_rng(6);
  for (int i = 0; i < 16; i++) {
    double eta = 1 + 2 * rand1d(rng), h = 1.9 * rand1d(rng) - 0.95;
    double theta_o = 2.8 * rand1d(rng) - 1.4, phi_o = 6.28 * rand1d(rng) - 3.14;
    hair_parameters<double> k = {eta, 0.1 + 0.9 * rand1d(rng), 0.1 + 0.9 * rand1d(rng),
                                 8 * rand1d(rng) - 4, 1 + i % max_p_max};
    if (i % 3 == 0) k.coat = rand1d(rng) / 2;
    if (i % 4 == 0) k.roughness[1] = {0.3, 0.2};
    if (i % 5 == 0) k.roughness[2] = {0.2, 0.5};
    auto bsdf = make_hair_bsdf(k);
    glm::dvec3 sigma = {rand1d(rng), 5 * rand1d(rng), 0.1 * rand1d(rng)};
    auto hit = make_hair_hit<double>(bsdf, sigma, h, direction<double>(theta_o, phi_o),
                                     {rand1d(rng), rand1d(rng), rand1d(rng)});
    auto sum = over_sphere(bsdf, hit, phi_o);
    CAPTURE(i);
    for (int c = 0; c < 3; c++)
      CHECK(sum.value[c] == Approx(energy_of(eta, sigma[c], h, theta_o)).epsilon(1e-8));
    CHECK(sum.pdf == Approx(1).epsilon(1e-8));
  }
}

TEST_CASE("hair: value and density are the textbook's sum over the lobes") {
  // Everything written out once more, from angles, with std::sinh and the
  // standard Bessel function where they do not overflow.
  auto rng = make_rng(8);
  double worst = 0, worst_pdf = 0;
  for (int i = 0; i < 4000; i++) {
    hair_parameters<double> k;
    k.eta = 1.05 + 2 * rand1d(rng);
    k.beta_m = 0.25 + 0.75 * rand1d(rng);
    k.beta_n = 0.1 + 0.9 * rand1d(rng);
    k.alpha = 12 * rand1d(rng) - 6;
    k.p_max = 1 + int(rand_index(rng, max_p_max));
    bool own = i % 2 == 0;
    if (i % 3 == 0) k.coat = 0.4 * rand1d(rng);
    if (own) k.roughness = {glm::dvec2{0.5, 0.7}, {0.6, 0.3}, {0.4, 0.45}};
    if (i % 5 == 0) k.strength = {glm::dvec3{1, 2, 0.5}, {0.3, 0, 1}, {1, 1.5, 3}};
    auto bsdf = make_hair_bsdf(k);
    double theta_o = pi * (rand1d(rng) - 0.5), theta_i = pi * (rand1d(rng) - 0.5);
    double phi_o = 6.28 * rand1d(rng), phi_i = 6.28 * rand1d(rng), h = 2 * rand1d(rng) - 1;
    glm::dvec3 sigma = {rand1d(rng), 3 * rand1d(rng), 0}, channels = {0.2, 1, rand1d(rng)};
    auto hit = make_hair_hit<double>(bsdf, sigma, h, direction<double>(theta_o, phi_o), channels);
    auto f = eval_hair_with_pdf<double>(bsdf, hit, direction<double>(theta_i, phi_i));

    double gamma_o = std::asin(h), theta_t = std::asin(std::sin(theta_o) / k.eta);
    double gamma_t = std::asin(h * std::cos(theta_o) /
                               std::sqrt(k.eta * k.eta - std::pow(std::sin(theta_o), 2)));
    double fresnel = energy_of(k.eta, 1e9, h, theta_o);
    double tilt = k.alpha * pi / 180, width = 0, all = 0, pdf = 0;
    glm::dvec3 value = {0, 0, 0};
    for (int p = 0; p <= k.p_max; p++) {
      auto j = std::size_t(std::min(p, 2));
      double b = own ? k.roughness[j].x : k.beta_m, factor = own || p == 0 ? 1 : p == 1 ? 0.25 : 4;
      if (p == 0) b *= 1 - k.coat;
      double v = factor * std::pow(0.726 * b + 0.812 * b * b + 3.7 * std::pow(b, 20), 2);
      double turn = p == k.p_max ? 0 : p == 0 ? -2 * tilt : p == 1 ? tilt : p == 2 ? 4 * tilt : 0;
      double si = std::sin(theta_i) * std::sin(theta_o + turn) / v;
      double ci = std::cos(theta_i) * std::abs(std::cos(theta_o + turn)) / v;
      double m = std::exp(-si) * std::cyl_bessel_i(0.0, ci) / (2 * v * std::sinh(1 / v));
      double n = 1 / (2 * pi);
      if (p < k.p_max) {
        double c = own ? k.roughness[j].y : k.beta_n;
        width = 0.626657069 * (0.265 * c + 1.194 * c * c + 5.372 * std::pow(c, 22));
        double x = std::remainder(phi_i - phi_o - (2 * p * gamma_t - 2 * gamma_o + p * pi), 2 * pi);
        double e = std::exp(-std::abs(x) / width), edge = std::exp(-pi / width);
        n = e / (width * (1 + e) * (1 + e)) / (1 / (1 + edge) - edge / (1 + edge));
      }
      glm::dvec3 a;
      for (int c = 0; c < 3; c++) {
        double t = std::exp(-sigma[c] * 2 * std::cos(gamma_t) / std::cos(theta_t));
        a[c] = p == 0 ? fresnel
                      : std::pow(1 - fresnel, 2) * t * std::pow(fresnel * t, p - 1) /
                            (p == k.p_max ? 1 - fresnel * t : 1);
      }
      a *= k.strength[j];
      value += a * m * n;
      double weight = glm::length(a * channels);
      all += weight;
      pdf += weight * m * n;
    }
    pdf /= all;
    for (int c = 0; c < 3; c++)
      worst = std::max(worst, std::abs(f.value[c] - value[c]) / (1e-3 + value[c]));
    worst_pdf = std::max(worst_pdf, std::abs(f.pdf - pdf) / (1e-3 + pdf));
  }
  CHECK(worst < 1e-12);
  CHECK(worst_pdf < 1e-12);
}

TEST_CASE("hair: a channel that absorbs more gives less, and the others nothing else") {
  auto rng = make_rng(9);
  int more = 0, crossed = 0;
  for (int i = 0; i < 3000; i++) {
    auto bsdf = make_hair_bsdf<double>({1 + 2 * rand1d(rng), rand1d(rng), rand1d(rng),
                                        10 * rand1d(rng) - 5, 1 + int(rand_index(rng, 6))});
    auto wo = direction<double>(pi * (rand1d(rng) - 0.5), 6.28 * rand1d(rng));
    auto wi = direction<double>(pi * (rand1d(rng) - 0.5), 6.28 * rand1d(rng));
    double h = 2 * rand1d(rng) - 1;
    glm::dvec3 before = {1e300, 0, 0};
    for (double sigma : {0.0, 1e-9, 1e-3, 0.1, 0.11, 1.0, 3.0, 30.0, 1e4, 1e30}) {
      auto hit = make_hair_hit<double>(bsdf, {sigma, 0.3, 1}, h, wo);
      auto f = eval_hair<double>(bsdf, hit, wi);
      if (f.x > before.x * (1 + 1e-14)) more++;
      // A channel knows nothing of the others.
      if (before.x < 1e300 && (f.y != before.y || f.z != before.z)) crossed++;
      before = f;
    }
    // All that is left is the reflection.
    auto hit = make_hair_hit<double>(bsdf, {1e30, 0, 0}, h, wo);
    if (hit.ap[1].x > 1e-12) more++;
  }
  CHECK(more == 0);
  CHECK(crossed == 0);
}

TEST_CASE("hair: strengths scale their lobes") {
  auto rng = make_rng(10);
  double worst = 0, worst_scaled = 0;
  for (int i = 0; i < 1000; i++) {
    hair_parameters<double> k = {1.3 + rand1d(rng), 0.1 + 0.9 * rand1d(rng),
                                 0.1 + 0.9 * rand1d(rng), 3, 1 + int(rand_index(rng, 6))};
    auto wo = direction<double>(3 * (rand1d(rng) - 0.5), 1), wi = direction<double>(0.2, 5);
    double h = 2 * rand1d(rng) - 1;
    glm::dvec3 sigma = {0.1, 0.5, 2};
    auto value = [&](const std::array<glm::dvec3, 3>& strength) {
      auto changed = k;
      changed.strength = strength;
      auto bsdf = make_hair_bsdf(changed);
      return eval_hair_with_pdf<double>(bsdf, make_hair_hit<double>(bsdf, sigma, h, wo), wi);
    };
    glm::dvec3 one(1), none(0), a = {0.5, 3, 0}, b = {2, 0.1, 1}, c = {0, 1, 7};
    auto full = value({one, one, one});
    glm::dvec3 parts =
        value({a, none, none}).value + value({none, b, none}).value + value({none, none, c}).value;
    glm::dvec3 split = a * value({one, none, none}).value + b * value({none, one, none}).value +
                       c * value({none, none, one}).value;
    auto together = value({a, b, c});
    auto twice = value({one * 2.0, one * 2.0, one * 2.0});
    for (int n = 0; n < 3; n++) {
      double size = 1e-12 + together.value[n];
      worst = std::max({worst, std::abs(parts[n] - together.value[n]) / size,
                        std::abs(split[n] - together.value[n]) / size});
      worst_scaled =
          std::max(worst_scaled, std::abs(twice.value[n] / 2 - full.value[n]) / full.value[n]);
    }
    worst_scaled = std::max(worst_scaled, std::abs(twice.pdf - full.pdf) / full.pdf);
    CHECK(value({none, none, none}).value == none);
    CHECK(value({none, none, none}).pdf > 0);
  }
  CHECK(worst < 1e-12);
  CHECK(worst_scaled < 1e-12);
  // With nothing to draw by, the density is still one.
  for (int p_max : {1, 3, 6})
    for (bool by_weight : {false, true}) {
      hair_parameters<double> k = {1.55, 0.3, 0.3, 2, p_max};
      if (!by_weight) k.strength.fill(glm::dvec3(0));
      auto bsdf = make_hair_bsdf(k);
      auto hit = make_hair_hit<double>(bsdf, {0, 0, 0}, 0.4, direction<double>(0.6, 1),
                                       glm::dvec3(by_weight ? 0 : 1));
      auto sum = over_sphere(bsdf, hit, 1);
      CHECK(sum.pdf == Approx(1).epsilon(1e-8));
      CHECK(sum.value.x == Approx(by_weight ? 1 : 0).epsilon(1e-6));
    }
  // A channel that does not count draws no lobe; the value is the same.
  auto bsdf = make_hair_bsdf<double>({1.55, 0.3, 0.3, 2, 3});
  auto wo = direction<double>(0.6, 1), wi = direction<double>(-0.5, 4);
  auto red = make_hair_hit<double>(bsdf, {0, 50, 50}, 0.4, wo, {0, 1, 0});
  auto all = make_hair_hit<double>(bsdf, {0, 50, 50}, 0.4, wo);
  CHECK(red.ap[0].w > 0.999);
  CHECK(all.ap[0].w < 0.2);
  CHECK(eval_hair<double>(bsdf, red, wi) == eval_hair<double>(bsdf, all, wi));
}
