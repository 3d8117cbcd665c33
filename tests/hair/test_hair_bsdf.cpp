#include <doctest/doctest.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "../support/hair_lobes.h"
#include "support/statistics.h"
#include "wisp/core/rng.h"
#include "wisp/hair/absorption.h"
#include "wisp/hair/bsdf.h"

using namespace wisp;
using namespace wisp::hair;

namespace {

template <typename T>
glm::vec<3, T> direction(T sin_theta, T phi) {
  T c = std::sqrt(std::max(T(0), 1 - sin_theta * sin_theta));
  return {sin_theta, c * std::cos(phi), c * std::sin(phi)};
}

// Gauss-Legendre nodes on [0, 1].
struct nodes {
  std::array<double, 16> x, w;
};
nodes make_nodes() {
  nodes n;
  for (int i = 0; i < 16; i++) {
    double x = std::cos(pi_v<double> * (i + 0.75) / 16.5), d = 0;
    for (int k = 0; k < 50; k++) {
      double p0 = 1, p1 = x;
      for (int j = 2; j <= 16; j++) {
        double p2 = ((2 * j - 1) * x * p1 - (j - 1) * p0) / j;
        p0 = p1;
        p1 = p2;
      }
      d = 16 * (x * p1 - p0) / (x * x - 1);
      x -= p1 / d;
    }
    n.x[std::size_t(i)] = (1 - x) / 2;
    n.w[std::size_t(i)] = 1 / ((1 - x * x) * d * d);
  }
  return n;
}

// Integral over [a, b] by panels that shrink towards `peak`.
template <typename F>
double integrate(double a, double b, double peak, double width, F&& f) {
  static const nodes n = make_nodes();
  std::vector<double> edges = {a, b, std::clamp(peak, a, b)};
  for (double s = width; s < b - a; s *= 1.5) {
    edges.push_back(std::clamp(peak - s, a, b));
    edges.push_back(std::clamp(peak + s, a, b));
  }
  std::sort(edges.begin(), edges.end());
  double sum = 0;
  for (std::size_t k = 0; k + 1 < edges.size(); k++) {
    double size = edges[k + 1] - edges[k];
    for (std::size_t i = 0; i < 16 && size > 0; i++)
      sum += size * n.w[i] * f(edges[k] + size * n.x[i]);
  }
  return sum;
}

}  // namespace

TEST_CASE("hair: I0e against the standard library and across its switch") {
  for (double x = 0; x < 600; x += x < 20 ? 0.01 : 1.7) {
    double truth = std::cyl_bessel_i(0.0, x) * std::exp(-x);
    CHECK(bessel_i0e(x) == doctest::Approx(truth).epsilon(1e-13));
    float xf = static_cast<float>(x);
    double truth_f = std::cyl_bessel_i(0.0, double(xf)) * std::exp(-double(xf));
    CHECK(double(bessel_i0e(xf)) == doctest::Approx(truth_f).epsilon(3e-7));
  }
  // No step at the switch that is larger than rounding.
  CHECK(std::abs(bessel_i0e(4.0f) - bessel_i0e(std::nextafter(4.0f, 5.0f))) < 3e-8f);
  CHECK(std::abs(bessel_i0e(8.0) - bessel_i0e(std::nextafter(8.0, 9.0))) < 1e-15);
}

TEST_CASE("hair: M_p integrates to 1 for every v") {
  for (double beta : {0.001, 0.01, 0.05, 0.1, 0.3, 0.5, 0.8, 1.0})
    for (double factor : {0.25, 1.0, 4.0}) {
      double v = longitudinal_variance(beta) * factor;
      double norm = -1 / (v * std::expm1(-2 / v));
      for (double theta_o : {-1.57, -1.2, -0.4, 0.0, 0.3, 1.0, 1.5}) {
        double total = integrate(
            -pi_v<double> / 2, pi_v<double> / 2, -theta_o, std::sqrt(v) * 0.05, [&](double t) {
              return longitudinal_mp(std::sin(t), std::cos(t), std::sin(theta_o), std::cos(theta_o),
                                     1 / v, norm) *
                     std::cos(t);
            });
        CHECK(total == doctest::Approx(1).epsilon(1e-5));
      }
    }
}

TEST_CASE("hair: N_p integrates to 1 for every s") {
  for (double beta : {0.001, 0.01, 0.1, 0.3, 0.6, 1.0}) {
    auto bsdf = make_hair_bsdf<double>({1.55, 0.3, beta, 2, 3});
    double total = integrate(-pi_v<double>, pi_v<double>, 0, bsdf.s[0] * 0.05, [&](double x) {
      return azimuthal_np(x, bsdf.inv_s[0], bsdf.np_norm[0]);
    });
    CHECK(total == doctest::Approx(1).epsilon(1e-6));
  }
}

TEST_CASE("hair: A_p add up to 1 without absorption") {
  for (double eta : {1.0, 1.3, 1.55, 3.0})
    for (int p_max : {1, 2, 3, 6})
      for (double h : {-1.0, -0.7, 0.0, 0.3, 0.999, 1.0})
        for (double s : {-1.0, -0.9, 0.0, 0.5, 1.0}) {
          auto bsdf = make_hair_bsdf<double>({eta, 0.3, 0.3, 2, p_max});
          auto hit = make_hair_hit<double>(bsdf, {0, 0, 0}, h, direction(s, 0.4));
          double sum = 0, chance = 0;
          for (std::size_t p = 0; p <= std::size_t(p_max); p++) {
            sum += hit.ap[p].y;
            chance += hit.ap[p].w;
          }
          CHECK(sum == doctest::Approx(1).epsilon(1e-9));
          CHECK(chance == doctest::Approx(1).epsilon(1e-9));
        }
}

TEST_CASE("hair: samples follow the density, tilted and coloured, to the edge of the fibre") {
  // Chi-square over 16 x 24 cells of (sin theta, phi) with equal solid angle;
  // false alarm of all together 1e-3.
  struct variant {
    double beta_m, beta_n, alpha, eta, h, sin_o;
    glm::dvec3 sigma;
  };
  std::vector<variant> variants;
  for (double bm : {0.05, 0.3, 0.9})
    for (double bn : {0.1, 0.3, 0.9})
      for (double h : {-1.0, -0.4, 0.0, 0.8, 1.0}) {
        variants.push_back({bm, bn, 0, 1.55, h, 0.2, {0, 0, 0}});
        variants.push_back({bm, bn, 2, 1.3, h, -0.8, {0.5, 1, 3}});
        variants.push_back({bm, bn, 8, 2.5, h, 0.97, {30, 0.1, 0}});
      }
  double level = test::sidak(1e-3, int(variants.size()));
  constexpr int rows = 16, columns = 24, samples = 40000, sub = 12;
  uint64_t stream = 0;
  for (const auto& k : variants) {
    auto bsdf = make_hair_bsdf<double>({k.eta, k.beta_m, k.beta_n, k.alpha, 3});
    auto hit = make_hair_hit<double>(bsdf, k.sigma, k.h, direction(k.sin_o, 1.1));
    std::vector<double> counts(rows * columns, 0), expected(rows * columns, 0);
    auto rng = make_rng(99, stream++);
    auto row_of = [&](double s) { return std::min(rows - 1, int((s + 1) / 2 * rows)); };
    auto column_of = [&](double y, double z) {
      double phi = std::atan2(z, y) + pi_v<double>;
      return std::min(columns - 1, int(phi / (2 * pi_v<double>)*columns));
    };
    for (int i = 0; i < samples; i++) {
      auto wi = sample_hair<double>(bsdf, hit,
                                    glm::dvec4(rand1d(rng), rand1d(rng), rand1d(rng), rand1d(rng)));
      CHECK(glm::length(wi) == doctest::Approx(1).epsilon(1e-9));
      counts[std::size_t(row_of(wi.x) * columns + column_of(wi.y, wi.z))]++;
    }
    // Midpoints, denser for narrow lobes.
    int fine = k.beta_m < 0.1 || k.beta_n < 0.2 ? sub * 4 : sub;
    double cell = 4 * pi_v<double> / (double(rows) * columns * fine * fine), total = 0;
    for (int j = 0; j < rows * fine; j++)
      for (int i = 0; i < columns * fine; i++) {
        double s = -1 + 2 * (j + 0.5) / (rows * fine),
               phi = -pi_v<double> + 2 * pi_v<double> * (i + 0.5) / (columns * fine);
        double p = sample_hair_pdf<double>(bsdf, hit, direction(s, phi)) * cell;
        total += p;
        expected[std::size_t(j / fine * columns + i / fine)] += p * samples;
      }
    CHECK(total == doctest::Approx(1).epsilon(2e-3));
    CHECK(test::chi_square_p_value(counts, expected) > level);
  }
}

TEST_CASE("hair: a white furnace gives 1 with and without tilt, by samples") {
  // The mean of f/pdf over wi and h of 4000 stratified samples; with no
  // absorption each weight is 1 up to the lobes' different normalisation.
  for (double alpha : {0.0, 2.0, 5.0})
    for (double bm : {0.001, 0.05, 0.3, 1.0})
      for (double bn : {0.001, 0.3, 1.0}) {
        auto bsdf = make_hair_bsdf<float>({1.55f, float(bm), float(bn), float(alpha), 3});
        auto rng = make_rng(7, uint64_t(alpha * 1e6 + bm * 1e3 + bn));
        double sum = 0;
        for (int i = 0; i < 4000; i++) {
          auto wo = direction(-0.9f + 1.8f * rand1f(rng), 6.28f * rand1f(rng));
          auto hit = make_hair_hit<float>(bsdf, {0, 0, 0}, 2 * rand1f(rng) - 1, wo);
          auto wi = sample_hair<float>(
              bsdf, hit, glm::vec4(rand1f(rng), rand1f(rng), rand1f(rng), rand1f(rng)));
          auto f = eval_hair_with_pdf<float>(bsdf, hit, wi);
          CHECK(f.pdf > 0);
          sum += double(f.value.y / f.pdf);
        }
        CHECK(sum / 4000 == doctest::Approx(1).epsilon(1e-4));
      }
}

TEST_CASE("hair: no NaN, infinity or negative value anywhere") {
  auto rng = make_rng(2024);
  auto pick = [&](std::initializer_list<float> edge, float low, float high) {
    auto n = uint32_t(edge.size());
    uint32_t k = rand_index(rng, 2 * n);
    return k < n ? *(edge.begin() + k) : low + (high - low) * rand1f(rng);
  };
  for (int i = 0; i < 300000; i++) {
    hair_parameters<float> p;
    p.beta_m = pick({0, 1e-4f, 1}, 0, 1);
    p.beta_n = pick({0, 1e-4f, 1}, 0, 1);
    p.alpha = pick({0, 2, -10, 45}, 0, 10);
    p.eta = pick({1, 1.55f, 3}, 1, 3);
    auto bsdf = make_hair_bsdf(p);
    glm::vec3 sigma = {pick({0, 1e4f}, 0, 10), pick({0, 1e4f}, 0, 10), pick({0, 1e4f}, 0, 10)};
    auto wo = direction(pick({1, -1, 0, 0.9999999f}, -1, 1), pick({0, 3.14159265f}, -4, 4));
    auto hit = make_hair_hit<float>(bsdf, sigma, pick({-1, 1, 0}, -1, 1), wo);
    float one = 0x1.fffffep-1f;
    glm::vec4 u = {pick({0, one}, 0, 1), pick({0, one}, 0, 1), pick({0, one}, 0, 1),
                   pick({0, one}, 0, 1)};
    auto wi = i % 2 == 0 ? sample_hair<float>(bsdf, hit, u)
                         : direction(pick({1, -1}, -1, 1), pick({0}, -4, 4));
    auto f = eval_hair_with_pdf<float>(bsdf, hit, wi);
    bool fine = std::isfinite(f.pdf) && f.pdf >= 0 && std::isfinite(wi.x + wi.y + wi.z);
    for (int k = 0; k < 3; k++) fine = fine && std::isfinite(f.value[k]) && f.value[k] >= 0;
    CHECK(fine);
  }
}

TEST_CASE("hair: colours and absorption are inverse to each other") {
  for (float beta_n : {0.1f, 0.3f, 0.7f, 1.0f})
    for (float c : {0.01f, 0.1f, 0.5f, 0.9f, 1.0f}) {
      glm::vec3 color = {c, c * 0.5f, 1 - c / 2};
      auto back = color_from_sigma_a(sigma_a_from_color(color, beta_n), beta_n);
      CHECK(glm::length(back - color) < 1e-5f);
    }
  CHECK(std::isfinite(sigma_a_from_color(glm::vec3{0, 0, 0}, 0.3f).x));
  auto s = sigma_a_from_melanin(1.3f, 0.5f);
  CHECK(s.z == doctest::Approx(1.3 * 1.37 + 0.5 * 1.05));
}

namespace {

std::vector<std::vector<double>> read_table(const std::string& path) {
  std::vector<std::vector<double>> rows;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#' || line[0] == 'i') continue;
    std::vector<double> row;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');)
      row.push_back(std::strtod(cell.c_str(), nullptr));
    rows.push_back(row);
  }
  return rows;
}

// The table's float32 directions are of unit length only to rounding, which at the
// poles is a large part of the cosine; its values take x as exact.
glm::dvec3 exact_direction(const std::vector<double>& row, std::size_t i) {
  double c = std::sqrt(std::max(0.0, 1 - row[i] * row[i])), l = std::hypot(row[i + 1], row[i + 2]);
  return l > 0 ? glm::dvec3(row[i], row[i + 1] * c / l, row[i + 2] * c / l)
               : glm::dvec3(row[i], c, 0);
}

}  // namespace

TEST_CASE("hair: the 50-digit reference values") {
  const char* data = std::getenv("WISP_TEST_DATA");
  if (!data) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  auto rows = read_table(std::string(data) + "/reference/hair_reference_mpmath.csv");
  REQUIRE(rows.size() > 50);
  for (const auto& row : rows) {
    std::array<double, 15> x;
    for (std::size_t i = 0; i < 15; i++) x[i] = double(float(row[i]));
    auto bsdf = make_hair_bsdf<double>({x[4], x[1], x[2], x[3], 3});
    std::vector<double> exact(x.begin(), x.end());
    auto hit = make_hair_hit<double>(bsdf, {x[5], x[6], x[7]}, x[8], exact_direction(exact, 9));
    wisp_test::draw_lobes_by_sum(hit, 3, {0.2126, 0.7152, 0.0722});
    auto f = eval_hair_with_pdf<double>(bsdf, hit, exact_direction(exact, 12));
    for (int k = 0; k < 3; k++)
      CHECK(f.value[k] == doctest::Approx(row[std::size_t(15 + k)]).epsilon(1e-6).scale(1e-9));
    CHECK(f.pdf == doctest::Approx(row[18]).epsilon(1e-6).scale(1e-9));
  }
}
