// Materials of other renderers against their own formulas, written down here from
// their documentation, in double and without a use of the library's maps.

#include <doctest/doctest.h>

#include <cmath>

#include "wisp/core/rng.h"
#include "wisp/core/sampling.h"
#include "wisp/hair/bsdf.h"
#include "wisp/hair/materials.h"

using namespace wisp::hair;
using d3 = glm::dvec3;
using d2 = glm::dvec2;

namespace {

constexpr double pi = 3.14159265358979323846;

double variance_of(double b) {
  return std::pow(0.726 * b + 0.812 * b * b + 3.7 * std::pow(b, 20), 2);
}
double raw_scale_of(double b) { return 0.265 * b + 1.194 * b * b + 5.372 * std::pow(b, 22); }
d3 chiang_sigma(const d3& c, double b) {
  double k = 5.969 - 0.215 * b + 2.532 * b * b - 10.73 * std::pow(b, 3) + 5.574 * std::pow(b, 4) +
             0.245 * std::pow(b, 5);
  return {std::pow(std::log(c.x) / k, 2), std::pow(std::log(c.y) / k, 2),
          std::pow(std::log(c.z) / k, 2)};
}
void check(const d3& a, const d3& b, double tolerance = 1e-6) {
  for (int k = 0; k < 3; k++) {
    CAPTURE(a[k]);
    CAPTURE(b[k]);
    CHECK(std::abs(a[k] - b[k]) <= tolerance * (1 + std::abs(b[k])));
  }
}

// The common model of the three, from lobe variances, scales (with sqrt(pi / 8)),
// tilts that are added to theta_i, and tints.
struct reference {
  double eta = 1.55;
  double v[4] = {}, s[3] = {}, tilt[3] = {};
  d3 tint[4] = {d3(1), d3(1), d3(1), d3(1)};
  d3 sigma_a = d3(0);
};

double i0(double x) {  // the power series, all of it that counts
  double sum = 1, term = 1;
  for (int k = 1; k < 2000; k++) {
    term *= x * x / (4.0 * k * k);
    sum += term;
    if (term < 1e-18 * sum) break;
  }
  return sum;
}
double m_p(double ti, double to, double v) {
  return i0(std::cos(ti) * std::cos(to) / v) * std::exp(-std::sin(ti) * std::sin(to) / v) /
         (2 * v * std::sinh(1 / v));
}
double n_p(double phi, double s) {
  while (phi > pi) phi -= 2 * pi;
  while (phi < -pi) phi += 2 * pi;
  auto cdf = [s](double x) { return 1 / (1 + std::exp(-x / s)); };
  double e = std::exp(-std::abs(phi) / s);
  return e / (s * (1 + e) * (1 + e)) / (cdf(pi) - cdf(-pi));
}
d3 eval(const reference& r, double h, double to, double phi_o, double ti, double phi_i) {
  double st = std::sin(to) / r.eta, ct = std::sqrt(1 - st * st);
  double etap = std::sqrt(r.eta * r.eta - std::sin(to) * std::sin(to)) / std::cos(to);
  double go = std::asin(h), gt = std::asin(h / etap);
  double c = std::cos(to) * std::cos(go);
  double g = std::sqrt(r.eta * r.eta - 1 + c * c);
  double fs = (c - g) / (c + g), fp = (r.eta * r.eta * c - g) / (r.eta * r.eta * c + g);
  double f = (fs * fs + fp * fp) / 2;
  d3 t = glm::exp(-r.sigma_a * (2 * std::cos(gt) / ct));
  d3 a[4] = {d3(f), (1 - f) * (1 - f) * t, (1 - f) * (1 - f) * f * t * t, {}};
  a[3] = a[2] * f * t / (d3(1) - f * t);
  d3 sum(0);
  for (int p = 0; p < 4; p++) {
    double phi = phi_i - phi_o - (2 * p * gt - 2 * go + p * pi);
    double m = m_p(ti + (p < 3 ? r.tilt[p] : 0), to, r.v[p]);
    sum += r.tint[p] * a[p] * (m * (p < 3 ? n_p(phi, r.s[p]) : 1 / (2 * pi)));
  }
  return sum;
}

// The largest relative difference over many pairs of directions.
double difference(const material<double>& m, const reference& r) {
  auto bsdf = make_hair_bsdf(m.parameters);
  auto rng = wisp::make_rng(11);
  auto random = [&] { return double(wisp::rand1f(rng)); };
  double worst = 0;
  for (int i = 0; i < 2000; i++) {
    double to = (random() - 0.5) * 2.8, ti = (random() - 0.5) * 2.8;
    double po = random() * 6.28, pi_ = random() * 6.28, h = random() * 1.98 - 0.99;
    auto direction = [](double t, double p) {
      return d3(std::sin(t), std::cos(t) * std::cos(p), std::cos(t) * std::sin(p));
    };
    auto hit = make_hair_hit<double>(bsdf, m.sigma_a, h, direction(to, po));
    d3 got = eval_hair(bsdf, hit, direction(ti, pi_)), want = eval(r, h, to, po, ti, pi_);
    for (int k = 0; k < 3; k++)
      worst = std::max(worst, std::abs(got[k] - want[k]) / (want[k] + 1e-9));
  }
  return worst;
}

}  // namespace

TEST_CASE("hair materials: pbrt's absorptions, in pbrt's order") {
  pbrt_hair<double> p;
  check(convert(p).sigma_a, 1.3 * d3(0.419, 0.697, 1.37));
  p.pheomelanin = 0.5;
  check(convert(p).sigma_a, 0.5 * d3(0.187, 0.4, 1.05));
  p.eumelanin = 0.2;
  check(convert(p).sigma_a, 0.2 * d3(0.419, 0.697, 1.37) + 0.5 * d3(0.187, 0.4, 1.05));
  p.color = d3(0.3, 0.2, 0.1);
  p.beta_n = 0.6;
  check(convert(p).sigma_a, chiang_sigma({0.3, 0.2, 0.1}, 0.6));
  p.sigma_a = d3(1, 2, 3);
  check(convert(p).sigma_a, {1, 2, 3});
  auto m = convert(p).parameters;
  CHECK(m.beta_n == 0.6);
  CHECK(m.beta_m == 0.3);
  CHECK(m.eta == 1.55);
  CHECK(m.alpha == 2);
}

TEST_CASE("hair materials: the absorption of Cycles' Principled Hair") {
  principled_hair<double> p;
  check(convert(p).sigma_a, chiang_sigma({0.017513, 0.005763, 0.002059}, 0.3));
  // The defaults of the three ways look about alike, as Blender says.
  d3 by_color = convert(p).sigma_a;
  p.parametrization = hair_parametrization::absorption;
  check(convert(p).sigma_a, {0.245531, 0.52, 1.365});
  p.parametrization = hair_parametrization::melanin;
  check(convert(p).sigma_a, -std::log(0.2) * d3(0.343, 0.733, 1.924));
  CHECK(glm::length(convert(p).sigma_a - by_color) < 2.5);

  p.melanin_redness = 0.3;
  p.tint = {0.9, 0.5, 0.2};
  d3 tint = chiang_sigma(p.tint, 0.3);
  auto pigment = [](double melanin) {
    double m = -std::log(std::max(1 - melanin, 1e-4));
    return m * 0.7 * d3(0.506, 0.841, 1.653) + m * 0.3 * d3(0.343, 0.733, 1.924);
  };
  check(convert(p).sigma_a, pigment(0.8) + tint);
  p.random_color = 0.4;
  for (double random : {0.0, 0.25, 0.5, 0.9, 1.0}) {
    p.random = random;
    check(convert(p).sigma_a, pigment(0.8 * (1 + 2 * (random - 0.5) * 0.4)) + tint);
  }
  // Beyond 1 the amount ends at -log(1e-4).
  CHECK(convert(p).sigma_a.x < 9.3 * 0.506 + tint.x);
}

TEST_CASE("hair materials: Cycles' roughness varies before it is limited and maps colours") {
  principled_hair<double> p;
  p.roughness = 0.8;
  p.radial_roughness = 0.6;
  p.coat = 0.75;
  p.random_roughness = 0.5;
  p.random = 1;
  auto m = convert(p);
  CHECK(m.parameters.beta_m == 1);
  CHECK(m.parameters.beta_n == doctest::Approx(0.9));
  CHECK(m.parameters.roughness[0].x == doctest::Approx(0.25));
  CHECK(m.parameters.roughness[0].y < 0);
  CHECK(m.parameters.roughness[1].x < 0);
  check(m.sigma_a, chiang_sigma(p.color, 0.9));
  p.radial_roughness = 0.9;
  m = convert(p);
  CHECK(m.parameters.beta_n == 1);
  check(m.sigma_a, chiang_sigma(p.color, 1.35));
  p.random = 0;
  p.random_roughness = 1;
  CHECK(convert(p).parameters.beta_m == 0.001);
  p.coat = 1;
  p.random = 0.5;
  CHECK(convert(p).parameters.roughness[0].x == 0.001);
}

TEST_CASE("hair materials: Cycles' lobes") {
  principled_hair<double> p;
  p.parametrization = hair_parametrization::absorption;
  p.roughness = 0.4;
  p.radial_roughness = 0.5;
  p.coat = 0.3;
  p.ior = 1.4;
  p.offset = 0;
  reference r;
  r.eta = 1.4;
  r.v[0] = variance_of(0.7 * 0.4);
  r.v[1] = variance_of(0.4) / 4;
  r.v[2] = r.v[3] = variance_of(0.4) * 4;
  for (double& s : r.s) s = raw_scale_of(0.5) * std::sqrt(pi / 8);
  r.sigma_a = {0.245531, 0.52, 1.365};
  CHECK(difference(convert(p), r) < 1e-6);
  p.coat = 0.31;
  CHECK(difference(convert(p), r) > 1e-3);
}

TEST_CASE("hair materials: lobes of Cycles and MaterialX peak where theirs do") {
  // Narrow R alone: the theta_i at which M_R is largest against -theta_o - 2 offset.
  auto peak = [](hair_parameters<double> parameters, double theta_o) {
    parameters.strength[1] = parameters.strength[2] = d3(0);
    auto bsdf = make_hair_bsdf(parameters);
    d3 wo(std::sin(theta_o), 0, std::cos(theta_o));
    auto hit = make_hair_hit<double>(bsdf, d3(0), 0.0, wo);
    double best = 0, at = 0;
    for (double t = -1.5; t < 1.5; t += 1e-4) {
      double f = eval_hair(bsdf, hit, d3(std::sin(t), 0, std::cos(t))).x / std::cos(t);
      if (f > best) best = f, at = t;
    }
    return at;
  };
  principled_hair<double> p;
  p.roughness = 0.02;
  for (double offset : {0.0, 2.0, 5.0, -3.0}) {
    p.offset = offset;
    CHECK(std::abs(peak(convert(p).parameters, 0.3) - (-0.3 - 2 * offset * pi / 180)) < 2e-3);
  }
  chiang_hair<double> c;
  c.roughness_R = {0.001, 0.1};
  for (double angle : {0.0, 3.0, -4.0}) {
    c.cuticle_angle = 0.5 + angle / 180;
    CHECK(std::abs(peak(convert(c).parameters, 0.3) - (-0.3 - 2 * angle * pi / 180)) < 2e-3);
  }
}

TEST_CASE("hair materials: MaterialX' chiang_hair_bsdf") {
  chiang_hair<double> c;
  c.tint_R = {0.9, 0.8, 0.7};
  c.tint_TT = {0.5, 1, 0.3};
  c.tint_TRT = {1, 0.2, 0.6};
  c.roughness_R = {0.08, 0.15};
  c.roughness_TT = {0.03, 0.3};
  c.roughness_TRT = {0.4, 0.05};
  c.absorption_coefficient = {0.1, 0.4, 1.1};
  c.ior = 1.6;
  reference r;
  r.eta = 1.6;
  r.v[0] = 0.08, r.v[1] = 0.03, r.v[2] = r.v[3] = 0.4;
  r.s[0] = 0.15 * std::sqrt(pi / 8), r.s[1] = 0.3 * std::sqrt(pi / 8),
  r.s[2] = 0.05 * std::sqrt(pi / 8);
  r.tint[0] = c.tint_R, r.tint[1] = c.tint_TT, r.tint[2] = r.tint[3] = c.tint_TRT;
  r.sigma_a = c.absorption_coefficient;
  CHECK(difference(convert(c), r) < 1e-6);
  c.tint_TT.x += 0.01;
  CHECK(difference(convert(c), r) > 1e-3);
  // Pairs outside of what MaterialX allows are limited as there.
  c.roughness_R = {0, 7};
  auto p = convert(c).parameters;
  CHECK(longitudinal_variance(p.roughness[0].x) == doctest::Approx(0.001));
  CHECK(logistic_scale(p.roughness[0].y) == doctest::Approx(std::sqrt(pi / 8)));
}

TEST_CASE("hair materials: MaterialX' helper nodes") {
  auto pairs = chiang_hair_roughness(0.4, 0.7, 0.3, 1.5);
  double v = variance_of(0.4), s = raw_scale_of(0.7);
  for (std::size_t i = 0; i < 3; i++) CHECK(pairs[i].y == doctest::Approx(s));
  CHECK(pairs[0].x == doctest::Approx(v));
  CHECK(pairs[1].x == doctest::Approx(v * 0.09));
  CHECK(pairs[2].x == doctest::Approx(v * 2.25));
  CHECK(chiang_hair_roughness(-1.0, 5.0)[0].x == doctest::Approx(variance_of(0.001)));
  CHECK(chiang_hair_roughness(-1.0, 5.0)[0].y == doctest::Approx(raw_scale_of(1)));

  // The default colours are one unit of pbrt's pigments.
  double m = -std::log(1 - 0.25);
  check(deon_hair_absorption_from_melanin<double>(),
        m * 0.5 * d3(0.419, 0.697, 1.37) + m * 0.5 * d3(0.187, 0.4, 1.05), 1e-5);
  check(deon_hair_absorption_from_melanin<double>(1, 0, {0.5, 0.25, 2}),
        {std::log(1e4) * std::log(2.0), std::log(1e4) * std::log(4.0), 0});
  CHECK(deon_hair_absorption_from_melanin<double>(0.0, 1.0) == d3(0));
  check(chiang_hair_absorption_from_color<double>({0.4, 0, 1}, 0.3),
        chiang_sigma({0.4, 0.001, 1}, 0.3));
  CHECK(chiang_hair_absorption_from_color<double>() == d3(0));

  // The helper and the parameters that it stands for are the same hair.
  chiang_hair<double> c;
  auto r = chiang_hair_roughness(0.3, 0.3, 0.5, 2.0);
  c.roughness_R = r[0], c.roughness_TT = r[1], c.roughness_TRT = r[2];
  auto a = make_hair_bsdf(convert(c).parameters), b = make_hair_bsdf(hair_parameters<double>{});
  for (std::size_t i = 0; i < 4; i++) {
    CHECK(a.v[i] == doctest::Approx(b.v[i]).epsilon(1e-7));
    CHECK(a.s[i] == doctest::Approx(b.s[i]).epsilon(1e-6));
  }
}

TEST_CASE("hair materials: roughness maps and their inverses, in float and double") {
  for (int i = 0; i <= 1000; i++) {
    double b = std::max(1e-3, i / 1000.0);
    CHECK(beta_m_from_variance(longitudinal_variance(b)) == doctest::Approx(b).epsilon(1e-9));
    CHECK(beta_n_from_scale(logistic_scale(b)) == doctest::Approx(b).epsilon(1e-9));
    auto f = static_cast<float>(b);
    CHECK(beta_m_from_variance(longitudinal_variance(f)) == doctest::Approx(b).epsilon(2e-6));
    CHECK(beta_n_from_scale(logistic_scale(f)) == doctest::Approx(b).epsilon(2e-6));
  }
}
