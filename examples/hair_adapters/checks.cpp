#include "checks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <random>
#include <vector>

#include "wisp/hair/bsdf.h"

namespace {

namespace hair = wisp::hair;

// The frame of wisp, from the geometry alone.
struct viewer_frame {
  glm::dvec3 x, y, z;
};
viewer_frame make_frame(const situation& s) {
  const glm::dvec3 x(s.tangent), y = glm::normalize(glm::cross(glm::dvec3(s.wo), x));
  return {x, y, glm::cross(x, y)};
}

// f cos by wisp in double.
std::array<double, 4> reference(const situation& s, const glm::vec3& wi, int channels) {
  const viewer_frame f = make_frame(s);
  auto local = [&f](const glm::dvec3& w) {
    return glm::dvec3(glm::dot(w, f.x), glm::dot(w, f.y), glm::dot(w, f.z));
  };
  const auto bsdf = hair::make_hair_bsdf(hair::convert<double>(s.material));
  std::array<double, 4> result = {};
  for (std::size_t i = 0; i < static_cast<std::size_t>(channels); i++) {
    const auto hit = hair::make_hair_hit(bsdf, glm::dvec3(static_cast<double>(s.sigma_a[i])),
                                         static_cast<double>(s.h), local(s.wo));
    result[i] = hair::eval_hair(bsdf, hit, local(wi)).x;
  }
  return result;
}

struct random_numbers {
  std::mt19937 engine{1};
  // In [0, 1), the same with every standard library.
  float next() { return static_cast<float>(engine() >> 8) * 0x1p-24f; }
};

// Means over samples, and how far they may be from the truth.
struct mean {
  double n = 0, sum = 0, squares = 0;
  void add(double x) { n++, sum += x, squares += x * x; }
  double value() const { return sum / n; }
  double error() const { return std::sqrt(std::max(0.0, squares / n - value() * value()) / n); }
};

struct report {
  bool good = true;
  void expect(bool fine, const char* what, double got, double wanted, double bound) {
    if (fine) return;
    good = false;
    std::printf("    WRONG: %s is %.5g, not %.5g within %.2g\n", what, got, wanted, bound);
  }
  // Within five standard errors, and those small enough to tell something.
  void near(const char* what, const mean& m, double wanted, double largest_error) {
    const double bound = 5 * m.error() + 2e-4;
    expect(std::abs(m.value() - wanted) <= bound, what, m.value(), wanted, bound);
    expect(m.error() <= largest_error, "a standard error", m.error(), 0, largest_error);
  }
};

// Uniform directions give integrals over the sphere; drawn ones must have the same moments.
void check_integrals(const situation& s, const scattering& hair, report& r) {
  constexpr int count = 150000;
  const double sphere = 4 * std::acos(-1.0);
  const std::size_t channels = static_cast<std::size_t>(hair.channels);
  random_numbers rng;
  mean furnace, density, drawn_furnace, moments[6], drawn_moments[6];
  auto add_moments = [](mean* m, const glm::dvec3& w, double factor) {
    for (int k = 0; k < 3; k++) {
      m[k].add(factor * w[k]);
      m[3 + k].add(factor * w[k] * w[(k + 1) % 3]);
    }
  };
  for (int i = 0; i < count; i++) {
    const float z = 1 - 2 * rng.next(), phi = 6.2831853f * rng.next(), q = std::sqrt(1 - z * z);
    const glm::vec3 w = {q * std::cos(phi), q * std::sin(phi), z};
    const auto v = hair.eval(w);
    for (std::size_t k = 0; k < channels; k++) furnace.add(sphere * v.f_cos[k]);
    density.add(sphere * v.pdf);
    add_moments(moments, glm::dvec3(w), sphere * v.pdf);

    const glm::vec3 u = {rng.next(), rng.next(), rng.next()};
    const auto d = hair.draw(u);
    if (!(d.pdf > 0)) continue;
    for (std::size_t k = 0; k < channels; k++) drawn_furnace.add(d.weight[k]);
    add_moments(drawn_moments, glm::dvec3(d.wi), 1);
  }
  std::printf("  %-28s furnace %.3f, drawn %.3f, density %.3f", s.name, furnace.value(),
              drawn_furnace.value(), density.value());
  r.near("the density's integral", density, 1, 0.01);
  r.expect(drawn_moments[0].n > 0.999 * count, "the part that is drawn", drawn_moments[0].n / count,
           1, 1e-3);
  // What uniform and drawn directions gather is the same, and 1 where nothing is absorbed.
  const double all = drawn_furnace.value(), bound = 5 * drawn_furnace.error() + 2e-4;
  const bool clear =
      std::all_of(s.sigma_a.begin(), s.sigma_a.end(), [](float a) { return a == 0; });
  r.near("what uniform directions gather", furnace, clear ? 1 : all, 0.01);
  if (clear) r.expect(std::abs(all - 1) <= bound, "the furnace", all, 1, bound);
  for (int k = 0; k < 6; k++) {
    const double difference = drawn_moments[k].value() - moments[k].value();
    const double error = std::hypot(drawn_moments[k].error(), moments[k].error());
    r.expect(std::abs(difference) <= 5 * error, "a moment of drawn directions",
             drawn_moments[k].value(), moments[k].value(), 5 * error);
  }
}

// Values against wisp in double, and a sample against value and density at its direction.
void check_values(const situation& s, const scattering& hair, report& r) {
  random_numbers rng;
  double worst = 0, worst_weight = 0, worst_pdf = 0;
  for (int i = 0; i < 4000; i++) {
    const auto d = hair.draw({rng.next(), rng.next(), rng.next()});
    if (!(d.pdf > 1e-3)) continue;
    const auto v = hair.eval(d.wi);
    const auto wanted = reference(s, d.wi, hair.channels);
    worst_pdf = std::max(worst_pdf, std::abs(v.pdf / d.pdf - 1));
    for (std::size_t k = 0; k < static_cast<std::size_t>(hair.channels); k++) {
      const double scale = wanted[k] + 1e-3;
      worst = std::max(worst, std::abs(v.f_cos[k] - wanted[k]) / scale);
      worst_weight = std::max(worst_weight, std::abs(d.weight[k] * d.pdf - v.f_cos[k]) / scale);
    }
  }
  std::printf(", value within %.0e\n", worst);
  r.expect(worst < 2e-3, "the largest difference from wisp's value", worst, 0, 2e-3);
  r.expect(worst_weight < 2e-3, "the largest difference of weight * pdf from the value",
           worst_weight, 0, 2e-3);
  r.expect(worst_pdf < 2e-3, "the largest difference of a sample's density from pdf()", worst_pdf,
           0, 2e-3);
}

// The surface reflects as a mirror would where the ray meets it, turned by twice the tilt of
// the scales towards the tip.
void check_mirror(const situation& s, const make_scattering& make, report& r) {
  for (const float alpha : {0.0f, 6.0f}) {
    situation mirror = s;
    mirror.material.beta_m = mirror.material.beta_n = 0.05f;
    mirror.material.alpha = alpha;
    mirror.material.strength = {glm::vec3(1), glm::vec3(0), glm::vec3(0)};
    const scattering hair = make(mirror);
    random_numbers rng;
    glm::dvec3 sum = {0, 0, 0};
    for (int i = 0; i < 4000; i++) {
      const auto d = hair.draw({rng.next(), rng.next(), rng.next()});
      if (d.pdf > 0) sum += glm::dvec3(d.wi);
    }
    const glm::dvec3 got = glm::normalize(sum);
    const viewer_frame f = make_frame(s);
    const double h = static_cast<double>(s.h);
    const glm::dvec3 normal = f.y * h + f.z * std::sqrt(1 - h * h), wo(s.wo);
    const glm::dvec3 reflected = 2 * glm::dot(wo, normal) * normal - wo;
    const double theta = std::asin(glm::dot(reflected, f.x)) +
                         2 * static_cast<double>(alpha) * std::acos(-1.0) / 180;
    const glm::dvec3 around = glm::normalize(reflected - f.x * glm::dot(reflected, f.x));
    const glm::dvec3 wanted = f.x * std::sin(theta) + around * std::cos(theta);
    const double angle = std::acos(std::min(1.0, glm::dot(got, wanted))) * 180 / std::acos(-1.0);
    r.expect(angle < 1, "the angle of R from the mirror's direction in degrees", angle, 0, 1);
  }
}

std::vector<situation> make_situations() {
  const glm::vec3 t = glm::normalize(glm::vec3(0.3f, -0.8f, 0.5f));
  const glm::vec3 a = glm::normalize(glm::vec3(0.7f, 0.4f, 0.9f));
  const glm::vec3 b = glm::normalize(glm::vec3(-0.2f, 0.9f, 0.6f));
  wisp::hair::hair_parameters<float> plain = {.beta_m = 0.4f, .beta_n = 0.4f, .alpha = 3};
  wisp::hair::hair_parameters<float> rough = {.beta_m = 0.7f, .beta_n = 0.6f, .alpha = -4};
  return {{"clear, seen across", t, a, 0.3f, 0.4f, plain, {}},
          {"clear, from the root's side", t, b, -0.7f, -0.9f, rough, {}},
          {"clear, ribbon turned away", t, a, -0.5f, 2.6f, plain, {}},
          {"brown", t, a, -0.4f, 0.2f, plain, {0.5f, 0.9f, 1.8f, 0.7f}},
          {"red, near the edge", -t, b, 0.95f, -2.2f, rough, {0.1f, 1.5f, 6, 0.3f}}};
}

}  // namespace

bool check_scattering(const char* renderer, const make_scattering& make) {
  std::printf("%s\n", renderer);
  report r;
  for (const situation& s : make_situations()) {
    const scattering hair = make(s);
    check_integrals(s, hair, r);
    check_values(s, hair, r);
    check_mirror(s, make, r);
  }
  return r.good;
}
