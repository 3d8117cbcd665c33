// Float against double, and calls at the ends of every range. The long form of
// both is `wisp stress`.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>

#include "wisp/core/rng.h"
#include "wisp/hair/rounding.h"

using namespace wisp;
using namespace wisp::hair;

namespace {

struct source {
  rng_state rng;
  float unit() { return rand1f(rng); }
  // One of the edges, or between low and high.
  float pick(std::initializer_list<float> edges, float low, float high) {
    auto n = uint32_t(edges.size());
    uint32_t k = rand_index(rng, 2 * n);
    return k < n ? *(edges.begin() + k) : low + (high - low) * unit();
  }
  float magnitude(float low) { return std::pow(10.0f, low * unit()); }
  glm::vec3 direction(float x) {
    float phi = pick({0, pi_v<float> / 2, pi_v<float>}, -4, 4);
    float c = std::sqrt(std::max(0.0f, (1 - x) * (1 + x)));
    return {x, c * std::cos(phi), c * std::sin(phi)};
  }
  glm::vec3 direction() {
    return direction(pick({1, -1, 0, 0.9999999f, 1 - magnitude(-7), magnitude(-7) - 1}, -1, 1));
  }
};

hair_parameters<float> extreme_parameters(source& s) {
  hair_parameters<float> p;
  p.beta_m = s.pick({0, 1e-4f, 1, s.magnitude(-4)}, 0, 1);
  p.beta_n = s.pick({0, 1e-4f, 1, s.magnitude(-4)}, 0, 1);
  p.alpha = s.pick({0, 2, -10, 45}, 0, 10);
  p.eta = s.pick({1, 1.55f, 3, 1 + s.magnitude(-7)}, 1, 3);
  p.p_max = 1 + int(rand_index(s.rng, max_p_max));
  if (s.unit() < 0.2f) p.coat = s.pick({1}, 0, 1);
  if (s.unit() < 0.2f) p.roughness[1] = {s.pick({0, 1}, 0, 1), s.pick({0, 1}, 0, 1)};
  if (s.unit() < 0.2f) p.strength[rand_index(s.rng, 3)] = glm::vec3(s.pick({0}, 0, 2));
  return p;
}

}  // namespace

TEST_CASE("hair: no NaN, infinity or negative value anywhere") {
  // A million calls; `wisp stress` makes as many as wanted.
  source s{make_rng(2024)};
  int bad = 0, bad_sample = 0;
  hair_bsdf<float> bsdf;
  for (int i = 0; i < 1000000; i++) {
    if (i % 8 == 0) bsdf = make_hair_bsdf(extreme_parameters(s));
    glm::vec3 sigma = {s.pick({0, 1e4f}, 0, 10), s.pick({0, 1e4f}, 0, 10), s.pick({0}, 0, 1e4f)};
    glm::vec3 weight(1);
    if (i % 5 == 0) weight = {s.pick({0, 1e-20f}, 0, 1), s.pick({0, 1e6f}, 0, 1), 0};
    auto wo = s.direction();
    if (i % 64 == 1) wo = {1, s.pick({1e-20f, 1e-30f, 1e-40f}, 0, 1e-14f), 1e-20f};
    auto hit = make_hair_hit<float>(bsdf, sigma, s.pick({-1, 1, 0}, -1, 1), wo, weight);
    constexpr float one = 0x1.fffffep-1f;
    glm::vec4 u = {s.pick({0, one}, 0, 1), s.pick({0, one}, 0, 1), s.pick({0, one}, 0, 1),
                   s.pick({0, one}, 0, 1)};
    hair_value<float> f;
    glm::vec3 wi;
    if (i % 2 == 0) {
      auto sample = i % 4 == 0 ? sample_hair_with_pdf<float>(bsdf, hit, u)
                               : sample_hair_with_pdf<float>(bsdf, hit, glm::vec2(u));
      wi = sample.direction;
      f = {sample.value, sample.pdf};
      if (!(std::abs(glm::dot(wi, wi) - 1) < 2e-6f && f.pdf > 0)) bad_sample++;
    } else {
      wi = s.direction();
      f = eval_hair_with_pdf<float>(bsdf, hit, wi);
    }
    bool fine = std::isfinite(f.pdf) && f.pdf >= 0 && std::isfinite(wi.x + wi.y + wi.z);
    for (int k = 0; k < 3; k++) fine = fine && std::isfinite(f.value[k]) && f.value[k] >= 0;
    bad += !fine;
  }
  CHECK(bad == 0);
  CHECK(bad_sample == 0);
}

TEST_CASE("hair: parameters in another type are the same numbers") {
  hair_parameters<float> k = {1.3f, 0.1f, 0.2f, -3.7f, 5};
  k.coat = 0.4f;
  for (std::size_t i = 0; i < 3; i++) {
    k.strength[i] = glm::vec3(0.6f, 0.7f, 1.1f) + float(i);
    k.roughness[i] = glm::vec2(0.15f, 0.25f) + 0.1f * float(i);
  }
  auto check = [&k](const auto& other) {
    CHECK(double(other.eta) == double(k.eta));
    CHECK(double(other.beta_m) == double(k.beta_m));
    CHECK(double(other.beta_n) == double(k.beta_n));
    CHECK(double(other.alpha) == double(k.alpha));
    CHECK(other.p_max == k.p_max);
    CHECK(double(other.coat) == double(k.coat));
    for (std::size_t i = 0; i < 3; i++) {
      CHECK(glm::dvec3(other.strength[i]) == glm::dvec3(k.strength[i]));
      CHECK(glm::dvec2(other.roughness[i]) == glm::dvec2(k.roughness[i]));
    }
  };
  auto twice = convert<double>(k);
  check(twice);
  check(convert<float>(twice));
  twice.eta = 1.55;  // no float
  CHECK(convert<float>(twice).eta == 1.55f);
}

TEST_CASE("hair: float lies within the rounding bound of double") {
  source s{make_rng(2025)};
  double worst = 0, worst_pdf = 0, worst_sample = 0;
  hair_parameters<float> k;
  hair_bsdf<float> bsdf;
  hair_bsdf<double> exact;
  for (int i = 0; i < 60000; i++) {
    if (i % 4 == 0) {
      k = extreme_parameters(s);
      bsdf = make_hair_bsdf(k);
      exact = make_hair_bsdf(convert<double>(k));
    }
    glm::vec3 sigma = {s.pick({0, 1e4f, s.magnitude(-12)}, 0, 10), s.magnitude(-6), 3 * s.unit()};
    float h = s.pick({-1, 1, 0, 1 - s.magnitude(-8)}, -1, 1);
    auto wo = s.direction(), wi = s.direction();
    auto hit = make_hair_hit<float>(bsdf, sigma, h, wo);
    auto exact_hit = make_hair_hit<double>(exact, glm::dvec3(sigma), h, glm::dvec3(wo));
    glm::vec4 u = {s.unit(), s.unit(), s.unit(), s.unit()};
    auto sample = sample_hair_with_pdf<float>(bsdf, hit, u);
    auto look = [&](const glm::vec3& w, const glm::vec3& value, float pdf, double& to,
                    double& to_pdf) {
      auto truth = eval_hair_with_pdf<double>(exact, exact_hit, glm::dvec3(w));
      auto bound = rounding_bound(exact, exact_hit, glm::dvec3(w), 1);
      for (int c = 0; c < 3; c++) {
        double e = std::abs(double(value[c]) - truth.value[c]) / bound.value[c];
        if (!(e <= to)) to = std::isnan(e) ? 1e30 : e;
      }
      double e = std::abs(double(pdf) - truth.pdf) / bound.pdf;
      if (!(e <= to_pdf)) to_pdf = std::isnan(e) ? 1e30 : e;
    };
    auto f = eval_hair_with_pdf<float>(bsdf, hit, wi);
    look(wi, f.value, f.pdf, worst, worst_pdf);
    f = eval_hair_with_pdf<float>(bsdf, hit, sample.direction);
    look(sample.direction, f.value, f.pdf, worst, worst_pdf);
    if (sample.direction.y != 0 || sample.direction.z != 0)
      look(sample.direction, sample.value, sample.pdf, worst_sample, worst_sample);
  }
  // rounding_bound's own factor is 10; below 1 it would tell too little.
  CHECK(worst < 10);
  CHECK(worst_pdf < 10);
  CHECK(worst_sample < 10);
  CHECK(worst > 1);
}

TEST_CASE("hair: float for hair as it is used") {
  // beta from 0.1, up to 80 degrees from the plane across: a few 1e-6 of the value
  // or of a thousandth of the largest.
  source s{make_rng(2026)};
  double worst = 0;
  for (int i = 0; i < 30000; i++) {
    auto between = [&](float a, float b) { return a + (b - a) * s.unit(); };
    hair_parameters<float> k = {between(1.3f, 1.7f), between(0.1f, 1), between(0.1f, 1),
                                between(-5, 5), 3};
    auto bsdf = make_hair_bsdf(k);
    auto exact = make_hair_bsdf(convert<double>(k));
    auto wo = s.direction(between(-0.98f, 0.98f)), wi = s.direction(between(-0.98f, 0.98f));
    glm::vec3 sigma = {3 * s.unit(), s.unit(), 0};
    float h = between(-1, 1);
    auto f = eval_hair_with_pdf<float>(bsdf, make_hair_hit<float>(bsdf, sigma, h, wo), wi);
    auto exact_hit = make_hair_hit<double>(exact, glm::dvec3(sigma), h, glm::dvec3(wo));
    auto truth = eval_hair_with_pdf<double>(exact, exact_hit, glm::dvec3(wi));
    for (int c = 0; c < 3; c++)
      worst =
          std::max(worst, std::abs(double(f.value[c]) - truth.value[c]) / (1e-3 + truth.value[c]));
    worst = std::max(worst, std::abs(double(f.pdf) - truth.pdf) / (1e-3 + truth.pdf));
  }
  CHECK(worst < 1e-4);
}

TEST_CASE("hair: near the poles and without refraction nothing cancels") {
  // What would lose all digits of a float if it were written with sin theta_o,
  // eta^2 and 1 - sin^2 gamma_t.
  double worst = 0;
  for (float eta : {1.0f, 1.0000001f, 1.00001f, 1.01f})
    for (float across : {1.0f, 1e-2f, 1e-4f, 1e-7f, 1e-12f})
      for (float h : {0.1f, 0.9f, 0.9999f, 0.9999999f, 1.0f}) {
        glm::vec3 wo = {std::sqrt(1 - across * across), across * 0.6f, across * 0.8f};
        hair_parameters<float> k = {eta, 0.3f, 0.3f, 2, 3};
        auto bsdf = make_hair_bsdf(k);
        auto exact = make_hair_bsdf(convert<double>(k));
        float sigma = 0.1f * across;
        auto hit = make_hair_hit<float>(bsdf, glm::vec3(sigma), h, wo);
        auto truth = make_hair_hit<double>(exact, glm::dvec3(double(sigma)), h, glm::dvec3(wo));
        for (std::size_t p = 0; p <= 3; p++) {
          if (truth.ap[p].x < 1e-37) continue;
          // The residual is a quotient of differences.
          double absolute = p == 3 ? 0.1 : 0;
          worst = std::max(
              worst, std::abs(double(hit.ap[p].x) - truth.ap[p].x) / (truth.ap[p].x + absolute));
          worst = std::max(worst, std::abs(double(hit.exit_phi[p]) - truth.exit_phi[p]));
        }
      }
  CHECK(worst < 5e-6);
  // A view along the fibre but for less than squares can hold is along the fibre.
  auto bsdf = make_hair_bsdf<float>({1, 0.3f, 0.3f, 2, 3});
  for (float across : {1e-16f, 1e-19f, 1e-22f, 1e-38f, 1e-45f}) {
    auto hit = make_hair_hit<float>(bsdf, {1, 1, 1}, 0.3f, {1, across, across});
    auto wi = sample_hair<float>(bsdf, hit, glm::vec4(0.5f, 0.3f, 0.6f, 0.5f));
    CHECK(std::abs(glm::length(wi) - 1) < 1e-6f);
    CHECK(std::isfinite(eval_hair_with_pdf<float>(bsdf, hit, wi).pdf));
  }
  // A pole has no azimuth, whatever the signs of its zeros.
  CHECK(detail::angle_of(-0.0, -0.0) == 0);
  CHECK(detail::angle_of(0.0, -0.0) == 0);
  CHECK(detail::angle_of(-0.0f, -0.0f) == 0);
}
