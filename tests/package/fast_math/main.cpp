// The hair model in float, with its polynomials, against the same in double, which has the
// standard library's functions, at random places. Ends with 1 where they differ by more
// than rounding.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "wisp/hair/bsdf.h"

namespace {

using namespace wisp::hair;

struct random_numbers {
  std::mt19937 engine{1};
  float next() { return static_cast<float>(engine() >> 8) * 0x1p-24f; }
  float next(float low, float high) { return low + (high - low) * next(); }
};

glm::vec3 direction(random_numbers& rng) {
  const float x = rng.next(-1, 1), phi = rng.next(0, 6.2831853f), r = std::sqrt(1 - x * x);
  return {x, r * std::cos(phi), r * std::sin(phi)};
}

// Of numbers below a thousandth the difference itself.
double difference(double a, double exact) { return std::abs(a - exact) / (exact + 1e-3); }

}  // namespace

int main() {
  random_numbers rng;
  double worst_value = 0, worst_pdf = 0, worst_sample = 0;
  for (int i = 0; i < 100000; i++) {
    hair_parameters<float> k;
    k.beta_m = rng.next(0.1f, 0.9f), k.beta_n = rng.next(0.1f, 0.9f), k.alpha = rng.next(-4, 4);
    const auto bsdf = make_hair_bsdf(k);
    const auto exact_bsdf = make_hair_bsdf(convert<double>(k));
    const glm::vec3 sigma_a = {rng.next(0, 2), rng.next(0, 2), rng.next(0, 2)};
    const glm::vec3 wo = direction(rng), wi = direction(rng);
    const float h = rng.next(-0.99f, 0.99f);
    const auto hit = make_hair_hit(bsdf, sigma_a, h, wo);
    const auto exact_hit =
        make_hair_hit(exact_bsdf, glm::dvec3(sigma_a), static_cast<double>(h), glm::dvec3(wo));
    const auto f = eval_hair_with_pdf(bsdf, hit, wi);
    const auto exact = eval_hair_with_pdf(exact_bsdf, exact_hit, glm::dvec3(wi));
    for (int c = 0; c < 3; c++) {
      const double value = static_cast<double>(f.value[c]);
      worst_value = std::max(worst_value, difference(value, exact.value[c]));
    }
    worst_pdf = std::max(worst_pdf, difference(static_cast<double>(f.pdf), exact.pdf));
    // What is drawn has the density that it says.
    const glm::vec4 u = {rng.next(), rng.next(0.01f, 0.99f), rng.next(), rng.next()};
    const auto s = sample_hair_with_pdf(bsdf, hit, u);
    const auto drawn = eval_hair_with_pdf(exact_bsdf, exact_hit, glm::dvec3(s.direction));
    worst_sample = std::max(worst_sample, difference(static_cast<double>(s.pdf), drawn.pdf));
  }
  std::printf("largest differences: value %.1e, density %.1e, density of samples %.1e\n",
              worst_value, worst_pdf, worst_sample);
  return worst_value < 1e-4 && worst_pdf < 1e-4 && worst_sample < 1e-3 ? 0 : 1;
}
