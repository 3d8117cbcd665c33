// How values follow parameters and directions: without steps, in the order they
// should, and with the symmetries that the model has.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "wisp/core/rng.h"
#include "wisp/hair/bsdf.h"

using namespace wisp;
using namespace wisp::hair;

namespace {

constexpr double pi = pi_v<double>;
using doctest::Approx;

template <typename T>
glm::vec<3, T> direction(double theta, double phi) {
  double c = std::cos(theta);
  return {T(std::sin(theta)), T(c * std::cos(phi)), T(c * std::sin(phi))};
}

// All that a value hangs on.
struct setting {
  hair_parameters<double> k;
  glm::dvec3 sigma = {0.2, 0.5, 1};
  double h = 0.3, theta_o = 0.4, phi_o = 0.5, theta_i = -0.3, phi_i = 2.5;
};

template <typename T>
hair_value<T> value_of(const setting& s) {
  hair_parameters<T> k = {T(s.k.eta), T(s.k.beta_m), T(s.k.beta_n), T(s.k.alpha), s.k.p_max};
  k.coat = T(s.k.coat);
  for (std::size_t i = 0; i < 3; i++) {
    k.strength[i] = glm::vec<3, T>(s.k.strength[i]);
    k.roughness[i] = glm::vec<2, T>(s.k.roughness[i]);
  }
  auto bsdf = make_hair_bsdf(k);
  auto hit =
      make_hair_hit<T>(bsdf, glm::vec<3, T>(s.sigma), T(s.h), direction<T>(s.theta_o, s.phi_o));
  return eval_hair_with_pdf<T>(bsdf, hit, direction<T>(s.theta_i, s.phi_i));
}

setting random_setting(rng_state& rng) {
  auto between = [&](double a, double b) { return a + (b - a) * rand1d(rng); };
  setting s;
  s.k = {between(1.1, 2), between(0.15, 0.9), between(0.15, 0.9), between(-5, 5),
         1 + int(rand_index(rng, max_p_max))};
  s.sigma = {between(0, 1), between(0, 3), 0};
  s.h = between(-0.95, 0.95);
  s.theta_o = between(-1.3, 1.3);
  s.theta_i = between(-1.3, 1.3);
  s.phi_o = between(-pi, pi);
  s.phi_i = between(-pi, pi);
  return s;
}

// The largest step of a curve over [a, b] sampled n times, over its largest value.
double largest_step(double a, double b, int n, const std::function<double(double)>& f) {
  double before = f(a), step = 0, size = std::abs(before);
  for (int i = 1; i <= n; i++) {
    double y = f(a + (b - a) * i / n);
    step = std::max(step, std::abs(y - before));
    size = std::max(size, std::abs(y));
    before = y;
  }
  return size > 0 ? step / size : 0;
}

// Nine times as many samples make the steps of a curve with a slope nine times
// smaller, those of a square root three times, and leave a jump as it is. How
// much smaller they were; curves that are flat within rounding count as smooth.
double shrinkage(double a, double b, int n, const std::function<double(double)>& f) {
  double coarse = largest_step(a, b, n, f), fine = largest_step(a, b, 9 * n, f);
  return fine < 1e-9 ? 0 : fine / coarse;
}

// The worst shrinkage of value and density over many settings, of which `change`
// sets the swept parameter.
double sweep(
    double a, double b, int n, const std::function<void(setting&, double)>& change,
    const std::function<void(setting&)>& prepare = [](setting&) {}) {
  auto rng = make_rng(77);
  double worst = 0;
  for (int i = 0; i < 25; i++) {
    setting s = random_setting(rng);
    prepare(s);
    for (bool density : {false, true})
      worst = std::max(worst, shrinkage(a, b, n, [&](double x) {
                         change(s, x);
                         auto f = value_of<double>(s);
                         return density ? f.pdf : f.value.x;
                       }));
  }
  return worst;
}
constexpr double smooth = 0.2, rooted = 0.5;

}  // namespace

TEST_CASE("hair: a jump is told from a slope") {
  // What the sweeps below rest on.
  CHECK(shrinkage(0, 1, 200, [](double x) { return std::sin(9 * x); }) < smooth);
  CHECK(shrinkage(0, 1, 200, [](double x) { return std::sqrt(x); }) < rooted);
  CHECK(shrinkage(0, 1, 200, [](double x) { return std::sin(9 * x) + (x > 0.4 ? 0.1 : 0); }) > 0.5);
}

TEST_CASE("hair: value and density follow the material without a jump") {
  double error = sweep(0.02, 1, 300, [](setting& s, double x) { s.k.beta_m = x; });
  CHECK(error < smooth);
  error = sweep(0.02, 1, 300, [](setting& s, double x) { s.k.beta_n = x; });
  CHECK(error < smooth);
  error = sweep(-10, 10, 300, [](setting& s, double x) { s.k.alpha = x; });
  CHECK(error < smooth);
  error = sweep(1, 3, 400, [](setting& s, double x) { s.k.eta = x; });
  CHECK(error < smooth);
  error = sweep(
      0, 1, 300, [](setting& s, double x) { s.k.coat = x; }, [](setting& s) { s.k.beta_m = 0.9; });
  CHECK(error < rooted);  // the narrow end grows steep
  error = sweep(0, 3, 200, [](setting& s, double x) { s.k.strength[1].x = x; });
  CHECK(error < smooth);
  error = sweep(0.1, 1, 300, [](setting& s, double x) { s.k.roughness[2].x = x; });
  CHECK(error < smooth);
  error = sweep(0.1, 1, 300, [](setting& s, double x) { s.k.roughness[1].y = x; });
  CHECK(error < smooth);
  error = sweep(0, 20, 300, [](setting& s, double x) { s.sigma.x = x; });
  CHECK(error < smooth);
}

TEST_CASE("hair: value and density follow the place and the directions without a jump") {
  double error = sweep(-pi / 2, pi / 2, 300, [](setting& s, double x) { s.h = std::sin(x); });
  CHECK(error < smooth);
  // The ends in h itself, where what is reflected is a square root of the rest.
  for (double end : {-1.0, 1.0}) {
    error = sweep(end, (1 - 1e-7) * end, 200, [](setting& s, double x) { s.h = x; });
    CHECK(error < rooted);
  }
  // To the poles, as near as a direction has an azimuth.
  constexpr double pole = pi / 2 - 1e-9;
  error = sweep(-pole, pole, 400, [](setting& s, double x) { s.theta_i = x; });
  CHECK(error < smooth);
  error = sweep(-pole, pole, 400, [](setting& s, double x) { s.theta_o = x; });
  CHECK(error < smooth);
  // Twice around.
  error = sweep(-2 * pi, 2 * pi, 800, [](setting& s, double x) { s.phi_i = x; });
  CHECK(error < smooth);
  error = sweep(-2 * pi, 2 * pi, 800, [](setting& s, double x) { s.phi_o = x; });
  CHECK(error < smooth);
  // At a pole there is none: every direction within rounding of it is the same.
  auto bsdf = make_hair_bsdf<double>({});
  for (double x : {-1.0, 1.0}) {
    auto value = [&](const glm::dvec3& wo) {
      auto hit = make_hair_hit<double>(bsdf, {0.1, 0, 0}, 0.3, wo);
      return eval_hair<double>(bsdf, hit, direction<double>(-1.4 * x, 1));
    };
    CHECK(value({x, 0, 0}).x > 0);
    CHECK(value({x, 1e-170, 1e-200}) == value({x, 0, 0}));
    CHECK(value({x, -5e-324, 5e-324}) == value({x, 0, 0}));
    CHECK(value({x, 1e-17, -3e-17}) == value({x, 0, 0}));
    // However near, the turn that makes world directions of azimuths is one.
    for (float c = 1; c > 1e-37f; c *= 0.3f) {
      auto hit = make_hair_hit<float>(make_hair_bsdf<float>({}), {0, 0, 0}, 0.3f,
                                      {static_cast<float>(x), 0.8f * c, 0.6f * c});
      CHECK(hit.cos_phi_o * hit.cos_phi_o + hit.sin_phi_o * hit.sin_phi_o ==
            Approx(1).epsilon(1e-6));
    }
  }
  // Past h = 1 as at it.
  setting s;
  for (double side : {-1.0, 1.0}) {
    s.h = side;
    auto at = value_of<double>(s);
    s.h = side * 1.0001;
    CHECK(value_of<double>(s).value == at.value);
    CHECK(value_of<double>(s).pdf == at.pdf);
    auto edge = make_hair_hit<double>(bsdf, {0, 0, 0}, side, direction<double>(0.3, 0));
    auto past = make_hair_hit<double>(bsdf, {0, 0, 0}, 1.5 * side, direction<double>(0.3, 0));
    for (std::size_t p = 0; p <= 3; p++) CHECK(edge.exit_phi[p] == past.exit_phi[p]);
  }
}

TEST_CASE("hair: the ends of the ranges are where the ranges lead") {
  auto rng = make_rng(78);
  double error_eta = 0, error_beta = 0, error_theta = 0, error_sigma = 0, error_h = 0;
  auto differ = [](const setting& a, const setting& b) {
    auto x = value_of<double>(a), y = value_of<double>(b);
    double d = 0;
    for (int k = 0; k < 3; k++)
      d = std::max(d, std::abs(x.value[k] - y.value[k]) / (1e-3 + y.value[k]));
    return std::max(d, std::abs(x.pdf - y.pdf) / (1e-3 + y.pdf));
  };
  for (int i = 0; i < 500; i++) {
    setting s = random_setting(rng), t = s;
    s.k.eta = 1 + 1e-9;
    t.k.eta = 1;
    error_eta = std::max(error_eta, differ(s, t));
    s = t = random_setting(rng);
    (i % 2 ? s.theta_i : s.theta_o) = (i % 4 < 2 ? 1 : -1) * (pi / 2 - 1e-7);
    t.theta_i = i % 2 ? (i % 4 < 2 ? 1 : -1) * (pi / 2 - 1e-12) : t.theta_i;
    t.theta_o = i % 2 ? t.theta_o : (i % 4 < 2 ? 1 : -1) * (pi / 2 - 1e-12);
    error_theta = std::max(error_theta, differ(s, t));
    s = t = random_setting(rng);
    s.sigma = glm::dvec3(1e4);
    t.sigma = glm::dvec3(1e30);
    error_sigma = std::max(error_sigma, differ(s, t));
    s = t = random_setting(rng);
    s.h = (i % 2 ? 1 : -1) * std::sin(pi / 2 - 1e-7);
    t.h = i % 2 ? 1 : -1;
    error_h = std::max(error_h, differ(s, t));
    // Below the least roughness, and above the largest, nothing changes.
    s = t = random_setting(rng);
    (i % 2 ? s.k.beta_m : s.k.beta_n) = i % 4 < 2 ? -1 : 1.5;
    (i % 2 ? t.k.beta_m : t.k.beta_n) = i % 4 < 2 ? min_roughness : 1;
    error_beta = std::max(error_beta, differ(s, t));
  }
  CHECK(error_eta < 4e-7);
  CHECK(error_theta < 1e-3);
  CHECK(error_sigma < 1e-9);
  CHECK(error_h < 3e-4);
  CHECK(error_beta == 0);
}

TEST_CASE("hair: lobes are continuous through the least roughness") {
  // In the lobe's own coordinates: at the peak the density is one over the width.
  auto peak_of = [](double beta) {
    auto b = make_hair_bsdf<double>({1.55, beta, beta, 2, 3});
    double m = longitudinal_mp(0.0, 1.0, 0.0, 1.0, b.inv_v[0], b.mp_norm[0]) * std::sqrt(b.v[0]);
    double n = azimuthal_np(0.0, b.inv_s[0], b.np_norm[0]) * b.s[0];
    return glm::dvec2(m, n);
  };
  for (double beta = 2e-5; beta < 0.2; beta *= 1.01) {
    auto p = peak_of(beta);
    REQUIRE(p.x == Approx(1 / std::sqrt(2 * pi)).epsilon(2e-2));
    REQUIRE(p.y == Approx(0.25).epsilon(1e-6));
  }
  CHECK(shrinkage(0.2 * min_roughness, 3 * min_roughness, 300, [](double beta) {
          return std::sqrt(make_hair_bsdf<double>({1.55, beta, beta, 2, 3}).v[0]);
        }) < smooth);
  CHECK(shrinkage(0.2 * min_roughness, 3 * min_roughness, 300, [](double beta) {
          return make_hair_bsdf<double>({1.55, beta, beta, 2, 3}).s[0];
        }) < smooth);
  auto least = make_hair_bsdf<double>({1.55, 0, 0, 2, 3});
  CHECK(std::sqrt(least.v[0]) == Approx(0.726e-4).epsilon(2e-4));
  CHECK(least.s[0] == Approx(0.626657069 * 0.265e-4).epsilon(5e-4));
}

TEST_CASE("hair: lobes widen with roughness") {
  // The part of each lobe within an angle of its peak falls from step to step.
  constexpr int steps = 60;
  std::array<std::array<double, 2>, 2> before{{{2, 2}, {2, 2}}};
  std::array<double, 4> v{}, s{};
  for (int i = 1; i <= steps; i++) {
    double beta = double(i) / steps;
    auto b = make_hair_bsdf<double>({1.55, beta, beta, 2, 3});
    for (std::size_t p = 0; p < 4; p++) {
      CHECK(b.v[p] > v[p]);
      v[p] = b.v[p];
      if (p == 3) continue;
      CHECK(b.s[p] > s[p]);
      s[p] = b.s[p];
    }
    CHECK(b.v[1] == Approx(b.v[0] / 4).epsilon(1e-14));
    CHECK(b.v[2] == Approx(b.v[0] * 4).epsilon(1e-14));
    CHECK(b.v[3] == b.v[2]);
    std::size_t n = 0;
    for (double angle : {0.1, 0.8}) {
      constexpr int cells = 4000;
      double m = 0, az = 0;
      for (int j = 0; j < cells; j++) {
        double t = angle * ((j + 0.5) / cells * 2 - 1), w = 2 * angle / cells;
        m += w * std::cos(t) *
             longitudinal_mp(std::sin(t), std::cos(t), 0.0, 1.0, b.inv_v[0], b.mp_norm[0]);
        az += w * azimuthal_np(t, b.inv_s[0], b.np_norm[0]);
      }
      CHECK(m <= before[n][0] + 1e-6);
      CHECK(az <= before[n][1] + 1e-6);
      before[n] = {m, az};
      n++;
    }
  }
  CHECK(before[0][0] < 0.2);
  CHECK(before[0][1] < 0.2);
  // A coat narrows the reflection and nothing else.
  double width = 10;
  auto plain = make_hair_bsdf<double>({1.55, 0.5, 0.5, 2, 3});
  for (double coat = 0; coat <= 1.01; coat += 0.1) {
    hair_parameters<double> k = {1.55, 0.5, 0.5, 2, 3};
    k.coat = coat;
    auto b = make_hair_bsdf(k);
    CHECK(b.v[0] < width);
    width = b.v[0];
    for (std::size_t p = 1; p < 4; p++) CHECK(b.v[p] == plain.v[p]);
    CHECK(b.s == plain.s);
  }
}

TEST_CASE("hair: lobes stand where the scales turn them") {
  // R by -2 alpha, TT by alpha, TRT by 4 alpha; later ones stay.
  for (double alpha : {-3.0, 0.0, 2.0, 5.0})
    for (double theta_o : {-0.9, 0.0, 0.5}) {
      auto b = make_hair_bsdf<double>({1.55, 0.05, 0.3, alpha, 5});
      auto hit = make_hair_hit<double>(b, {0, 0, 0}, 0.2, direction<double>(theta_o, 1));
      std::array<double, 6> turn = {-2, 1, 4, 0, 0, 0};
      for (std::size_t p = 0; p < 6; p++) {
        double best = 0, at = 0;
        for (int i = -15000; i < 15000; i++) {
          double t = i * 1e-4;
          double m = longitudinal_mp(std::sin(t), std::cos(t), hit.sin_theta_op[p],
                                     hit.cos_theta_op[p], b.inv_v[p], b.mp_norm[p]) *
                     std::sqrt(std::cos(t));  // makes the peak that of a Gaussian
          if (m > best) {
            best = m;
            at = t;
          }
        }
        CHECK(at == Approx(-(theta_o + turn[p] * alpha * pi / 180)).epsilon(3e-3).scale(0.5));
      }
    }
}

TEST_CASE("hair: more lobes converge, and the energy stays") {
  auto rng = make_rng(79);
  int apart = 0;
  double error = 0;
  for (int i = 0; i < 1000; i++) {
    setting s = random_setting(rng);
    s.h = 0.8 * (2 * rand1d(rng) - 1);
    std::array<glm::dvec3, max_p_max + 1> value{};
    std::array<glm::dvec3, max_p_max + 1> rest{}, first{};
    for (int p_max = 1; p_max <= max_p_max; p_max++) {
      s.k.p_max = p_max;
      auto n = std::size_t(p_max);
      auto bsdf = make_hair_bsdf(s.k);
      auto hit = make_hair_hit<double>(bsdf, s.sigma, s.h, direction<double>(s.theta_o, s.phi_o));
      value[n] = value_of<double>(s).value;
      glm::dvec3 sum(0);
      for (std::size_t p = 0; p <= n; p++) sum += glm::dvec3(hit.ap[p]);
      rest[n] = glm::dvec3(hit.ap[n]);
      if (p_max == 1) first[0] = sum;
      for (int c = 0; c < 3; c++) error = std::max(error, std::abs(sum[c] - first[0][c]));
      // No more can change than the rest, spread as the narrowest that it may be.
      if (p_max == 1) continue;
      double m = 0;
      for (std::size_t p = n - 1; p <= n; p++)
        m = std::max(m, bsdf.mp_norm[p] * std::max(bsdf.np_norm[p] / 4, 1 / (2 * pi)));
      auto other = s.k;
      other.p_max = p_max - 1;
      auto few = make_hair_bsdf(other);
      m = std::max(m, few.mp_norm[n - 1] / (2 * pi));
      for (int c = 0; c < 3; c++)
        if (std::abs(value[n][c] - value[n - 1][c]) > rest[n - 1][c] * m) apart++;
    }
    // Below no lobe and above the last there is nothing.
    s.k.p_max = 0;
    CHECK(value_of<double>(s).value == value[1]);
    s.k.p_max = 99;
    CHECK(value_of<double>(s).value == value[max_p_max]);
    for (int c = 0; c < 3; c++)
      if (rest[6][c] > 0.1 * rest[3][c] + 1e-3) apart++;
  }
  CHECK(error < 1e-14);
  CHECK(apart == 0);
}

TEST_CASE("hair: mirrors and turns") {
  auto rng = make_rng(80);
  double error_across = 0, error_across_f = 0, error_turn = 0;
  int unlike = 0, alike = 0;
  for (int i = 0; i < 5000; i++) {
    setting s = random_setting(rng), t = s;
    if (i % 2) s.k.roughness[1] = t.k.roughness[1] = {0.3, 0.4};
    auto compare = [](const auto& a, const auto& b) {
      double d = std::abs(double(a.pdf) - double(b.pdf)) / (1e-3 + double(b.pdf));
      for (int c = 0; c < 3; c++)
        d = std::max(
            d, std::abs(double(a.value[c]) - double(b.value[c])) / (1e-3 + double(b.value[c])));
      return d;
    };
    // Across the fibre: the other side of it under the mirrored directions.
    t.h = -s.h;
    t.phi_o = pi - s.phi_o;
    t.phi_i = pi - s.phi_i;
    error_across = std::max(error_across, compare(value_of<double>(s), value_of<double>(t)));
    error_across_f = std::max(error_across_f, compare(value_of<float>(s), value_of<float>(t)));
    // Around the fibre nothing has a place of its own.
    t = s;
    t.phi_o += 1.7;
    t.phi_i += 1.7;
    error_turn = std::max(error_turn, compare(value_of<double>(s), value_of<double>(t)));
    // Along the fibre, with the scales the other way: to the bit.
    t = s;
    t.theta_o = -s.theta_o;
    t.theta_i = -s.theta_i;
    t.k.alpha = -s.k.alpha;
    auto a = value_of<double>(s), b = value_of<double>(t);
    auto af = value_of<float>(s), bf = value_of<float>(t);
    if (a.value != b.value || a.pdf != b.pdf || af.value != bf.value || af.pdf != bf.pdf) unlike++;
    // The other side alone is another place.
    t = s;
    t.h = -s.h;
    if (compare(value_of<double>(s), value_of<double>(t)) < 1e-6) alike++;
  }
  CHECK(error_across < 1e-13);
  CHECK(error_across_f < 2e-5);
  CHECK(error_turn < 1e-13);
  CHECK(unlike == 0);
  CHECK(alike < 500);
}

TEST_CASE("hair: exchange of the directions") {
  // A_p and gamma_t hang on theta_o alone, so that the model is reciprocal just
  // where both directions are as steep; the other side of the fibre is seen from
  // the other end, hence -h.
  auto exchanged = [](const setting& s) {
    setting t = s;
    std::swap(t.theta_o, t.theta_i);
    std::swap(t.phi_o, t.phi_i);
    t.h = -s.h;
    return t;
  };
  auto apart = [&](const setting& s) {
    auto a = value_of<double>(s).value, b = value_of<double>(exchanged(s)).value;
    return glm::dvec2(std::abs(a.x - b.x), (a.x + b.x) / 2);
  };
  auto rng = make_rng(81);
  double error_same = 0, error_mirror = 0, error_tilted = 0, error_lobe = 0;
  std::array<double, 3> part{};
  for (std::size_t tilt = 0; tilt < 3; tilt++) {
    glm::dvec2 sum(0);
    for (int i = 0; i < 40000; i++) {
      setting s;
      s.k.alpha = tilt == 0 ? 0 : tilt == 1 ? 2 : 5;
      s.sigma = {0.3, 0, 0};
      s.h = 2 * rand1d(rng) - 1;
      s.theta_o = std::asin(2 * rand1d(rng) - 1);
      s.theta_i = std::asin(2 * rand1d(rng) - 1);
      s.phi_o = 2 * pi * rand1d(rng);
      s.phi_i = 2 * pi * rand1d(rng);
      sum += apart(s);
      s.theta_i = s.theta_o;
      auto same = apart(s);
      error_same = std::max(error_same, same.x / (1e-6 + same.y));
      s.theta_i = -s.theta_o;
      auto mirror = apart(s);
      (tilt == 0 ? error_mirror : error_tilted) =
          std::max(tilt == 0 ? error_mirror : error_tilted, mirror.x / (1e-6 + mirror.y));
      // M_p by itself, without tilt.
      double a = std::asin(2 * rand1d(rng) - 1), b = std::asin(2 * rand1d(rng) - 1);
      double v = longitudinal_variance(0.05 + 0.95 * rand1d(rng)),
             n = -1 / (v * std::expm1(-2 / v));
      double m = longitudinal_mp(std::sin(a), std::cos(a), std::sin(b), std::cos(b), 1 / v, n);
      double r = longitudinal_mp(std::sin(b), std::cos(b), std::sin(a), std::cos(a), 1 / v, n);
      error_lobe = std::max(error_lobe, std::abs(m - r) / (1e-9 + m));
    }
    part[tilt] = sum.x / sum.y;
  }
  CHECK(error_same < 1e-13);
  CHECK(error_mirror < 1e-13);
  CHECK(error_lobe < 1e-14);
  // How far it is from it elsewhere: the mean difference over the mean value.
  double worst_0 = part[0], worst_2 = part[1], worst_5 = part[2];
  CHECK(worst_0 < 0.2);
  CHECK(worst_2 < 0.215);
  CHECK(worst_5 < 0.25);
  CHECK(worst_0 < worst_2);
  CHECK(worst_2 < worst_5);
  // With a tilt, mirrored directions are no longer exchanged at no cost.
  CHECK(error_tilted > 0.1);
}
