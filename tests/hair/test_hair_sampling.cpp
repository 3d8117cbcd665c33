// Samples against the density over the whole range of the parameters.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "support/quadrature.h"
#include "support/statistics.h"
#include "wisp/core/rng.h"
#include "wisp/hair/bsdf.h"
#include "wisp/hair/rounding.h"

using namespace wisp;
using namespace wisp::hair;

namespace {

constexpr double pi = pi_v<double>;

glm::dvec3 direction(double theta, double phi) {
  double c = std::cos(theta);
  return {std::sin(theta), c * std::cos(phi), c * std::sin(phi)};
}

template <typename T>
T number(rng_state& rng) {
  if constexpr (std::is_same_v<T, float>)
    return rand1f(rng);
  else
    return rand1d(rng);
}

// How the numbers come.
enum class numbers { four, three, two };

struct setting {
  hair_parameters<double> k;
  glm::dvec3 sigma = {0, 0, 0};
  double h = 0, theta_o = 0, phi_o = 0;
  glm::dvec3 weight = {1, 1, 1};
};

template <typename T>
struct scene {
  hair_bsdf<T> bsdf;
  hair_hit<T> hit;
};
template <typename T>
scene<T> make(const setting& x) {
  scene<T> s;
  s.bsdf = make_hair_bsdf(convert<T>(x.k));
  s.hit = make_hair_hit<T>(s.bsdf, glm::vec<3, T>(x.sigma), T(x.h),
                           glm::vec<3, T>(direction(x.theta_o, x.phi_o)), glm::vec<3, T>(x.weight));
  return s;
}

template <typename T>
glm::vec<3, T> draw(const scene<T>& s, numbers kind, rng_state& rng) {
  T a = number<T>(rng), b = number<T>(rng), c = number<T>(rng), d = number<T>(rng);
  if (kind == numbers::two) return sample_hair<T>(s.bsdf, s.hit, glm::vec<2, T>(a, b));
  return sample_hair<T>(s.bsdf, s.hit, glm::vec<4, T>(a, b, c, kind == numbers::four ? d : T(0.5)));
}

// Edges of cells along theta and around phi (against wo), at fixed distances in
// widths of each lobe from its peak, and some between.
struct cells {
  std::vector<double> theta, phi;
};
cells make_cells(const scene<double>& s) {
  cells c;
  for (double x = -1; x <= 1.01; x += 0.25) c.theta.push_back(std::asin(std::min(x, 1.0)));
  for (int i = 0; i <= 8; i++) c.phi.push_back(-pi + 2 * pi * i / 8);
  auto last = static_cast<std::size_t>(s.bsdf.p_max);
  for (std::size_t p = 0; p <= last; p++) {
    double at = -std::atan2(s.hit.sin_theta_op[p], s.hit.cos_theta_op[p]);
    for (double d : {-2.2, -1.0, -0.3, 0.3, 1.0, 2.2}) {
      double x = at + d * std::sqrt(s.bsdf.v[p]);
      if (std::abs(x) < pi / 2) c.theta.push_back(x);
    }
    if (p == last) continue;
    for (double d : {-3.0, -1.0, 0.0, 1.0, 3.0})
      c.phi.push_back(wrap_angle(s.hit.exit_phi[p] + d * s.bsdf.s[p]));
  }
  std::sort(c.theta.begin(), c.theta.end());
  std::sort(c.phi.begin(), c.phi.end());
  // In float, directions are a grid of 6e-8: cells stay far larger.
  auto close = [](double a, double b) { return b - a < 2e-5; };
  c.theta.erase(std::unique(c.theta.begin(), c.theta.end(), close), c.theta.end());
  c.phi.erase(std::unique(c.phi.begin(), c.phi.end(), close), c.phi.end());
  c.theta.back() = pi / 2;
  c.phi.back() = pi;
  return c;
}
std::size_t cell_of(const std::vector<double>& edges, double x) {
  auto i =
      static_cast<std::size_t>(std::upper_bound(edges.begin(), edges.end(), x) - edges.begin());
  return std::clamp<std::size_t>(i, 1, edges.size() - 1) - 1;
}

// The chances of the cells by quadrature, lobe by lobe, since within a lobe the
// two angles are independent.
std::vector<double> chances(const scene<double>& s, const cells& c) {
  std::size_t rows = c.theta.size() - 1, columns = c.phi.size() - 1;
  std::vector<double> chance(rows * columns, 0), along(rows), around(columns);
  auto last = static_cast<std::size_t>(s.bsdf.p_max);
  for (std::size_t p = 0; p <= last; p++) {
    double at = -std::atan2(s.hit.sin_theta_op[p], s.hit.cos_theta_op[p]);
    for (std::size_t i = 0; i < rows; i++) {
      auto rule = test::make_rule(c.theta[i], c.theta[i + 1], {{at, 0.5 * std::sqrt(s.bsdf.v[p])}});
      along[i] = 0;
      for (std::size_t k = 0; k < rule.x.size(); k++)
        along[i] += rule.w[k] * std::cos(rule.x[k]) *
                    longitudinal_mp(std::sin(rule.x[k]), std::cos(rule.x[k]), s.hit.sin_theta_op[p],
                                    s.hit.cos_theta_op[p], s.bsdf.inv_v[p], s.bsdf.mp_norm[p]);
    }
    double center = wrap_angle(s.hit.exit_phi[p]);
    double width = p == last ? 10 : 0.5 * s.bsdf.s[p];
    std::vector<test::peak> peaks = {{center > 0 ? center - pi : center + pi, 1}};
    for (double turn : {-2 * pi, 0.0, 2 * pi}) peaks.push_back({center + turn, width});
    for (std::size_t j = 0; j < columns; j++) {
      auto rule = test::make_rule(c.phi[j], c.phi[j + 1], peaks);
      around[j] = 0;
      for (std::size_t k = 0; k < rule.x.size(); k++)
        around[j] += rule.w[k] * azimuthal_np(rule.x[k] - s.hit.exit_phi[p], s.bsdf.inv_s[p],
                                              s.bsdf.np_norm[p]);
    }
    for (std::size_t i = 0; i < rows; i++)
      for (std::size_t j = 0; j < columns; j++)
        chance[i * columns + j] += s.hit.ap[p].w * along[i] * around[j];
  }
  return chance;
}

// The smallest p-value of three chi-square tests: of the cells, and of their sums
// along each angle, which see what spreads over many cells.
constexpr int tests_of_one = 3;
template <typename T>
double p_value(const setting& x, numbers kind, int samples, uint64_t stream) {
  auto exact = make<double>(x);
  auto s = make<T>(x);
  auto c = make_cells(exact);
  auto chance = chances(exact, c);
  std::size_t rows = c.theta.size() - 1, columns = c.phi.size() - 1;
  double total = 0;
  for (double p : chance) total += p;
  CHECK(total == doctest::Approx(1).epsilon(1e-7));
  std::vector<double> counts(rows * columns, 0), expected(rows * columns);
  for (std::size_t i = 0; i < chance.size(); i++) expected[i] = samples * chance[i];
  auto rng = make_rng(31, stream);
  int bad = 0;
  for (int i = 0; i < samples; i++) {
    auto wi = glm::dvec3(draw<T>(s, kind, rng));
    bad += !(std::abs(glm::length(wi) - 1) < 8 * double(std::numeric_limits<T>::epsilon()));
    double theta = std::atan2(wi.x, std::hypot(wi.y, wi.z));
    double phi = wrap_angle(std::atan2(wi.z, wi.y) - x.phi_o);
    counts[cell_of(c.theta, theta) * columns + cell_of(c.phi, phi)]++;
  }
  CHECK(bad == 0);
  auto sums = [&](const std::vector<double>& of, bool by_row) {
    std::vector<double> sum(by_row ? rows : columns, 0);
    for (std::size_t i = 0; i < of.size(); i++) sum[by_row ? i / columns : i % columns] += of[i];
    return sum;
  };
  return std::min({test::chi_square_p_value(counts, expected),
                   test::chi_square_p_value(sums(counts, true), sums(expected, true)),
                   test::chi_square_p_value(sums(counts, false), sums(expected, false))});
}

// Each setting with each type and kind of numbers in turn; false alarm of all
// together 1e-3. In float, roughness below 3e-3 makes lobes of few floats.
void check_settings(const std::vector<setting>& settings, int samples, uint64_t stream) {
  double level = test::sidak(1e-3, tests_of_one * int(settings.size()));
  for (std::size_t i = 0; i < settings.size(); i++) {
    const auto& x = settings[i];
    auto kind = std::array{numbers::four, numbers::two, numbers::three}[i / 2 % 3];
    double least = std::min(x.k.beta_m * (1 - std::min(x.k.coat, 0.99)), x.k.beta_n);
    for (const auto& own : x.k.roughness)
      for (double beta : {own.x, own.y})
        if (beta >= 0) least = std::min(least, beta);
    bool in_float = i % 2 == 1 && least >= 3e-3;
    double p = in_float ? p_value<float>(x, kind, samples, stream + i)
                        : p_value<double>(x, kind, samples, stream + i);
    CAPTURE(i);
    CAPTURE(x.k.beta_m);
    CAPTURE(x.k.beta_n);
    CAPTURE(x.h);
    CAPTURE(x.theta_o);
    CAPTURE(in_float);
    CHECK(p > level);
  }
}

// A setting in which every parameter is at an end of its range or inside.
setting random_setting(rng_state& rng) {
  auto unit = [&] { return rand1d(rng); };
  auto pick = [&](std::initializer_list<double> values) {
    return *(values.begin() + rand_index(rng, uint32_t(values.size())));
  };
  setting x;
  // The values are floats, so that both types have the same.
  auto single = [](double v) { return double(float(v)); };
  x.k.beta_m = single(pick({1e-4, 1e-3, 0.01, 0.05, 0.1, 0.3, 0.7, 1, unit()}));
  x.k.beta_n = single(pick({1e-4, 1e-3, 0.01, 0.05, 0.1, 0.3, 0.7, 1, unit()}));
  x.k.alpha = single(pick({0, 2, -3, 10, 20 * unit() - 10}));
  x.k.eta = single(pick({1, 1.3, 1.55, 3, 1 + 2 * unit()}));
  x.k.p_max = 1 + int(rand_index(rng, max_p_max));
  x.sigma = glm::dvec3(single(pick({0, 0.1, 3 * unit(), 1e4})), single(3 * unit()), 0.5);
  x.h = single(pick({-1, 1, 0, -0.999, 2 * unit() - 1, 2 * unit() - 1}));
  x.theta_o = pick({0, -1.5, 1.57, 1.5, 2 * unit() - 1, 3 * unit() - 1.5});
  x.phi_o = 2 * pi * unit() - pi;
  return x;
}

}  // namespace

TEST_CASE("hair: samples follow the density over the whole range of the parameters") {
  auto rng = make_rng(77);
  std::vector<setting> settings;
  for (int i = 0; i < 120; i++) settings.push_back(random_setting(rng));
  check_settings(settings, 20000, 0);
}

TEST_CASE("hair: samples follow the density at the edge of the fibre and at grazing angles") {
  std::vector<setting> settings;
  for (double h : {-1.0, 1.0})
    for (double theta : {-1.57079, 0.3, 1.57})
      for (double beta : {0.01, 0.3}) {
        setting x;
        x.k.beta_m = x.k.beta_n = beta;
        x.h = h, x.theta_o = theta, x.phi_o = 2.5, x.sigma = {0.3, 1, 0};
        settings.insert(settings.end(), 2, x);  // double and float
      }
  check_settings(settings, 30000, 1000);
}

TEST_CASE(
    "hair: samples follow the density with weights, strengths, coats, and roughness by lobe") {
  std::vector<setting> settings;
  setting base;
  base.h = 0.4, base.theta_o = -0.5, base.phi_o = 1, base.sigma = {0.2, 0.5, 2};
  auto add = [&](auto&& change) {
    setting x = base;
    change(x);
    settings.insert(settings.end(), 4, x);  // types by numbers
  };
  add([](setting& x) { x.weight = {1, 0, 0}; });
  add([](setting& x) { x.weight = {0, 0.001, 7}; });
  add([](setting& x) { x.weight = {0, 0, 0}; });  // all lobes alike
  for (std::size_t off = 0; off < 3; off++) add([&](setting& x) { x.k.strength[off] = {0, 0, 0}; });
  add([](setting& x) { x.k.strength = {glm::dvec3(0), glm::dvec3(0), glm::dvec3(0)}; });
  add([](setting& x) {
    x.k.strength = {glm::dvec3(4, 0, 0), glm::dvec3(0, 0.5, 0), glm::dvec3(1)};
  });
  add([](setting& x) { x.k.coat = 0.5; });
  add([](setting& x) { x.k.coat = 0.95; });
  add([](setting& x) { x.k.coat = 1; });
  add([](setting& x) {
    x.k.roughness[0] = {0.05, 0.8};
    x.k.roughness[1] = {0.5, 0.02};
  });
  add([](setting& x) { x.k.roughness[2] = {1, 0.004}, x.k.p_max = 6; });
  check_settings(settings, 20000, 2000);
}

TEST_CASE("hair: a lobe without strength is not drawn") {
  for (std::size_t off = 0; off < 3; off++) {
    setting x;
    x.k.strength[off] = {0, 0, 0};
    auto s = make<float>(x);
    CHECK(s.hit.ap[off].w == 0.0f);
    for (float u : {0.0f, 0x1p-24f, 0.3f, 0.7f, 0x1.fffffep-1f}) {
      auto sample = sample_hair_with_pdf<float>(s.bsdf, s.hit, glm::vec4(u, 0.5f, 0.1f, 0.5f));
      CHECK(sample.pdf > 0);
      CHECK(sample.value.y > 0);
    }
  }
}

TEST_CASE("hair: the azimuth of a lobe with a small share has all its digits") {
  // R with a share of about 3e-6 in float: u.x has some 50 values in it, whose
  // steps u.w has to fill in. Cells of equal chance; false alarm 1e-4.
  setting x;
  x.k.strength[0] = glm::dvec3(5e-5);
  auto s = make<float>(x);
  auto steps = uint32_t(s.hit.ap[0].w * 0x1p24f);
  REQUIRE(steps > 20);
  REQUIRE(steps < 200);
  constexpr int columns = 1000, samples = 100000;
  std::vector<double> counts(columns, 0), expected(columns, 0);
  auto rng = make_rng(12);
  for (int i = 0; i < samples; i++) {
    float u = float(rand_index(rng, steps)) * 0x1p-24f;
    auto wi =
        sample_hair<float>(s.bsdf, s.hit, glm::vec4(u, rand1f(rng), rand1f(rng), rand1f(rng)));
    double y = wrap_angle(std::atan2(double(wi.z), double(wi.y)) - double(s.hit.exit_phi[0]));
    // The place in the trimmed logistic, by its distribution function.
    double scale = s.bsdf.s[0], low = 1 / (1 + std::exp(pi / scale));
    double place = (1 / (1 + std::exp(-y / scale)) - low) / (1 - 2 * low);
    counts[std::size_t(std::clamp(int(place * columns), 0, columns - 1))]++;
  }
  // The step that straddles the end of the lobe's share is left out.
  double covered = steps / (double(s.hit.ap[0].w) * 0x1p24);
  for (int i = 0; i < columns; i++)
    expected[std::size_t(i)] =
        samples * std::clamp(covered * columns - i, 0.0, 1.0) / (covered * columns);
  CHECK(test::chi_square_p_value(counts, expected) > 1e-4);
}

namespace {

// 64 x 64 cells of pairs (x, y) in [0, 1)^2 against even ones.
template <typename F>
double even_p_value(int samples, F&& pair) {
  std::vector<double> counts(64 * 64, 0), expected(64 * 64, samples / 4096.0);
  for (int i = 0; i < samples; i++) {
    glm::dvec2 x = pair();
    counts[std::size_t(x.x * 64) * 64 + std::size_t(x.y * 64)]++;
  }
  return test::chi_square_p_value(counts, expected);
}

template <typename T>
void check_split(uint64_t stream, double level) {
  auto rng = make_rng(71, stream);
  auto digits = double(1 << std::numeric_limits<T>::digits / 2);
  auto split = [&] { return split_numbers(glm::vec<2, T>(number<T>(rng), number<T>(rng))); };
  auto rest = [&](T x) { return double(x) * digits - std::floor(double(x) * digits); };
  CHECK(even_p_value(100000, [&] {
          auto u = split();
          return glm::dvec2(u.y, u.z);
        }) > level);
  CHECK(even_p_value(100000, [&] {
          auto u = split();
          return glm::dvec2(rest(u.y), rest(u.z));
        }) > level);
  CHECK(even_p_value(100000, [&] {
          auto u = split();
          return glm::dvec2(u.x, rest(u.z));
        }) > level);
}

}  // namespace

TEST_CASE("hair: two numbers become four that fill their square, digits below included") {
  double level = test::sidak(1e-4, 6);
  check_split<float>(0, level);
  check_split<double>(1, level);
  // Below 1 where all digits of a half are ones, so that the hash could round up,
  // which it would for one in 8192 of these.
  int ones = 0;
  for (uint32_t k = 0; k < 1u << 12; k++) {
    uint32_t spread = 0;
    for (uint32_t b = 0; b < 12; b++) spread |= (k >> b & 1) << 2 * b;
    for (uint32_t bits : {spread | 0xaaaaaau, spread << 1 | 0x555555u}) {
      auto u = split_numbers(glm::vec2(0, float(bits) * 0x1p-24f));
      ones += !(u.y >= 0 && u.y < 1 && u.z >= 0 && u.z < 1);
    }
  }
  CHECK(ones == 0);
}

TEST_CASE("hair: a sample with its density is the sample and its density") {
  // The directions are the same bits. Value and density differ by the rounding of
  // angles to directions: within rounding_bound of the exact ones in float, and
  // within 2^-29 of that, the ratio of the types, in double.
  auto rng = make_rng(5);
  for (int i = 0; i < 60; i++) {
    auto x = random_setting(rng);
    auto in_float = make<float>(x);
    scene<double> exact = {make_hair_bsdf(x.k), {}};
    auto wo = glm::vec3(direction(x.theta_o, x.phi_o));
    exact.hit = make_hair_hit<double>(exact.bsdf, glm::dvec3(glm::vec3(x.sigma)), x.h,
                                      glm::dvec3(wo), x.weight);
    int bad = 0;
    for (int j = 0; j < 2000; j++) {
      glm::vec4 u = {rand1f(rng), rand1f(rng), rand1f(rng), rand1f(rng)};
      bool two = j % 2 == 1;
      auto one = [&](const auto& s, auto w, double factor) {
        using T = decltype(w);
        glm::vec<4, T> v(u);
        auto sample = two ? sample_hair_with_pdf<T>(s.bsdf, s.hit, glm::vec<2, T>(v))
                          : sample_hair_with_pdf<T>(s.bsdf, s.hit, v);
        auto alone = two ? sample_hair<T>(s.bsdf, s.hit, glm::vec<2, T>(v))
                         : sample_hair<T>(s.bsdf, s.hit, v);
        auto wi = glm::dvec3(sample.direction);
        auto truth = eval_hair_with_pdf<double>(exact.bsdf, exact.hit, wi);
        auto bound = rounding_bound(exact.bsdf, exact.hit, wi, factor);
        bool good = sample.direction == alone && sample.pdf > 0;
        good = good && std::abs(double(sample.pdf) - truth.pdf) <= bound.pdf;
        for (int k = 0; k < 3; k++)
          good = good && std::abs(double(sample.value[k]) - truth.value[k]) <= bound.value[k];
        bad += !good;
      };
      one(in_float, 1.0f, 10);
      one(exact, 1.0, 10 * 0x1p-29);
    }
    CAPTURE(i);
    CHECK(bad == 0);
  }
}

TEST_CASE("hair: samples beside a pole keep their digits in float") {
  // Along the fibre but for 1e-4 the part across is known to a float's precision of
  // itself; from 1 - sin^2 it would be off by 3e-4, more than all of it.
  auto rng = make_rng(17);
  double worst = 0;
  int compared = 0;
  for (int i = 0; i < 20000; i++) {
    auto x = float(0.9e-4 + 1e-4 * rand1d(rng));
    glm::vec3 wo = {i % 2 == 1 ? 1.0f : -1.0f, 0.6f * x, 0.8f * x};
    float h = 1.8f * rand1f(rng) - 0.9f;
    auto bsdf = make_hair_bsdf<float>({1.55f, 1e-4f, 0.3f, 0, 3});
    auto twice = make_hair_bsdf<double>({double(1.55f), double(1e-4f), double(0.3f), 0, 3});
    auto hit = make_hair_hit<float>(bsdf, {0, 0, 0}, h, wo);
    auto exact = make_hair_hit<double>(twice, {0, 0, 0}, h, glm::dvec3(wo));
    glm::vec4 u = {rand1f(rng), 0.05f + 0.9f * rand1f(rng), rand1f(rng), 0.5f};
    // Not where rounding may choose another lobe.
    double edge = 0;
    bool near = false;
    for (std::size_t p = 0; p <= 3; p++) {
      near = near || std::abs(double(u.x) - edge) < 1e-6;
      edge += exact.ap[p].w;
    }
    if (near) continue;
    auto w = glm::dvec3(sample_hair<float>(bsdf, hit, u));
    auto truth = sample_hair<double>(twice, exact, glm::dvec4(u));
    worst = std::max(worst, std::hypot(w.y - truth.y, w.z - truth.z));
    compared++;
  }
  CHECK(compared > 19000);
  CHECK(worst < 1e-6);
}

TEST_CASE("hair: sampled energy with absorption and weights is the sum of A_p") {
  // The mean of value / density is the energy, whatever lobes are drawn by: within
  // 5 standard errors, and those below 1 %. False alarm 60 * 6e-7.
  auto rng = make_rng(41);
  for (int i = 0; i < 20; i++) {
    auto x = random_setting(rng);
    x.sigma = glm::min(x.sigma, glm::dvec3(3));
    if (i % 2 == 1) x.weight = {0.1 + rand1d(rng), 0.1 + rand1d(rng), 0.1 + rand1d(rng)};
    if (i % 5 == 0) x.k.strength[i / 5 % 3] = {0.5, 2, 1};
    auto s = make<double>(x);
    glm::dvec3 energy(0), sum(0), squares(0);
    for (std::size_t p = 0; p <= std::size_t(s.bsdf.p_max); p++) energy += glm::dvec3(s.hit.ap[p]);
    constexpr int samples = 20000;
    for (int j = 0; j < samples; j++) {
      auto f = sample_hair_with_pdf<double>(s.bsdf, s.hit, glm::dvec2(rand1d(rng), rand1d(rng)));
      sum += f.value / f.pdf;
      squares += sqr(f.value / f.pdf);
    }
    for (int k = 0; k < 3; k++) {
      double mean = sum[k] / samples;
      double error = std::sqrt(std::max(0.0, squares[k] / samples - sqr(mean)) / samples);
      CHECK(std::abs(mean - energy[k]) <= 5 * error + 1e-9);
      CHECK(error < 0.01 * std::max(1.0, energy[k]));
    }
  }
}
