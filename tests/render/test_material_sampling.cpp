// Sampling of surfaces and interiors, held against quadrature of values and densities.
//
// All random numbers have fixed seeds; where a test is statistical, the rate of
// false alarms of the whole test case is stated.

#include <doctest/doctest.h>

#include <vector>

#include "render/material_cases.h"
#include "support/statistics.h"
#include "wisp/core/rng.h"
#include "wisp/core/statistics.h"

using namespace wisp;
using namespace wisp::test;

namespace {

// What samples and quadrature say about a case, around one lobe.
struct comparison {
  double p_value = 1;    // samples against their density, chi-square
  double pdf_total = 0;  // integral of the density over the grid
  double value_total = 0;
  double z_score = 0;  // mean of value / pdf against the integral of the value
};

comparison compare(const scatter_case& c, const vec3& axis, double width, double theta_max,
                   int samples, uint64_t stream) {
  vec3 o = outgoing_at(c.cos_o);
  polar_grid grid(axis, width, theta_max);
  auto cells = integrate_cells(grid, [&](const vec3& i) {
    return pair_t{double(sample_bsdf_pdf(c.m, test_normal, o, i)),
                  mean3(eval_bsdf(c.m, test_normal, o, i))};
  });
  comparison result;
  // The last cell holds what is drawn elsewhere, and what cannot be drawn. Where a
  // lobe barely reaches into a cell the quadrature may see nothing; what it
  // can miss is added, and such cells end up in the pool.
  std::vector<double> counts(cells.size() + 1), expected(cells.size() + 1);
  for (std::size_t k = 0; k < cells.size(); k++) {
    expected[k] = std::max(cells[k][0], 2e-7) * samples;
    result.pdf_total += cells[k][0];
    result.value_total += cells[k][1];
  }
  expected.back() = std::max(1 - result.pdf_total, 1e-9) * samples;

  running_stats weights;
  rng_state rng = make_rng(7, stream);
  for (int k = 0; k < samples; k++) {
    float rnl = rand1f(rng);
    float x = rand1f(rng), y = rand1f(rng);
    vec3 i = sample_bsdf(c.m, test_normal, o, rnl, {x, y});
    int cell = i == vec3{0, 0, 0} ? -1 : grid.find(i);
    counts[cell < 0 ? cells.size() : std::size_t(cell)]++;
    float pdf = sample_bsdf_pdf(c.m, test_normal, o, i);
    add_sample(weights,
               cell >= 0 && pdf > 0 ? mean3(eval_bsdf(c.m, test_normal, o, i)) / double(pdf) : 0);
  }
  result.p_value = chi_square_p_value(counts, expected);
  double error = std::hypot(standard_error(weights), 1e-5);  // and that of the quadrature
  result.z_score = (weights.mean - result.value_total) / error;
  return result;
}

void check_cases(const std::vector<scatter_case>& cases, bool narrow, int samples, double rate) {
  int tests = 0;
  for (const auto& c : cases) tests += 2 * int(lobe_axes(c).size());
  double significance = sidak(rate, tests);
  uint64_t stream = 0;
  for (const auto& c : cases)
    for (const auto& axis : lobe_axes(c)) {
      double alpha = c.m.type == material_type::matte ? 1 : double(c.m.roughness);
      auto r = compare(c, axis, alpha, narrow ? 30 * alpha : pi_d, samples, stream++);
      INFO("type ", int(c.m.type), " alpha ", c.m.roughness, " ior ", c.m.ior, " metallic ",
           c.m.metallic, " cos_o ", c.cos_o, " value ", r.value_total, " z ", r.z_score);
      CHECK(r.p_value > significance);
      CHECK(two_sided(r.z_score) > significance);
      CHECK(r.pdf_total < 1 + 2e-4);
      CHECK(r.pdf_total > 0);
    }
}

// The integral of the value, rgb mean, with refraction's change of radiance undone.
double albedo(const scatter_case& c) {
  vec3 o = outgoing_at(c.cos_o);
  double eta = c.cos_o < 0 ? 1 / double(c.m.ior) : double(c.m.ior);
  double alpha = c.m.type == material_type::matte ? 1 : double(c.m.roughness);
  double sum = 0;
  for (int k = 0; const auto& axis : lobe_axes(c)) {
    // Each lobe on its own grid, which sees its side of the surface alone.
    bool other_side = k++ > 0;
    for (const auto& cell : integrate_cells(polar_grid(axis, alpha, pi_d), [&](const vec3& i) {
           bool crosses = glm::dot(test_normal, i) * float(c.cos_o) < 0;
           if (crosses != other_side) return pair_t{0, 0};
           double scale = crosses && bends_light(c.m) ? eta * eta : 1;
           return pair_t{0, mean3(eval_bsdf(c.m, test_normal, o, i)) * scale};
         }))
      sum += cell[1];
  }
  return sum;
}

}  // namespace

TEST_CASE("material: samples follow their density, wide lobes") {
  // False alarms: 1e-4 for the whole test case.
  check_cases(rough_cases({0.1f, 0.4f, 1.0f}), false, 40000, 1e-4);
}

TEST_CASE("material: samples follow their density, narrow lobes") {
  // Around each lobe alone. False alarms: 1e-4 for the whole test case.
  check_cases(rough_cases({0.0009f, 0.02f}), true, 20000, 1e-4);
}

TEST_CASE("material: no direction scatters more light than arrives") {
  const vec3 white = {1, 1, 1};
  for (float alpha : {0.002f, 0.1f, 0.5f, 1.0f})
    for (double cos_o : {0.99, 0.4, 0.05}) {
      INFO("alpha ", alpha, " cos_o ", cos_o);
      // Single scattering loses energy, none to speak of on nearly smooth surfaces.
      bool lossless = alpha < 0.01f && cos_o > 0.1;
      double mirror = albedo({make_point(material_type::reflective, alpha, 1.5f, white), cos_o});
      CHECK(mirror < 1 + 1e-4);
      CHECK(mirror > (lossless ? 0.9999 : 0.25));
      double metal = albedo({make_point(material_type::gltfpbr, alpha, 1.5f, white, 1), cos_o});
      CHECK(metal == doctest::Approx(mirror).epsilon(1e-3));
      // Diffuse under a coat, see material.cpp.
      CHECK(albedo({make_point(material_type::gltfpbr, alpha, 1.5f, white), cos_o}) < 1.02);
      for (float ior : {1.2f, 1.5f, 2.4f}) {
        INFO("ior ", ior);
        CHECK(albedo({make_point(material_type::glossy, alpha, ior, white), cos_o}) < 1.02);
        // A thin white sheet sends on what its facets do not mirror.
        CHECK(albedo({make_point(material_type::transparent, alpha, ior), cos_o}) ==
              doctest::Approx(mirror).epsilon(2e-3));
        for (auto c : {scatter_case{make_point(material_type::refractive, alpha, ior), cos_o},
                       scatter_case{make_point(material_type::refractive, alpha, ior), -cos_o},
                       scatter_case{make_point(material_type::subsurface, alpha, ior), cos_o}}) {
          double a = albedo(c);
          INFO("type ", int(c.m.type), " from ", c.cos_o, " albedo ", a);
          CHECK(a < 1 + 1e-3);
          CHECK(a > (lossless ? 0.999 : 0.05));
        }
      }
    }
  // Known in closed form: alpha = 1 seen straight on gives 1 - ln 2.
  CHECK(albedo({make_point(material_type::reflective, 1, 1.5f, white), 1}) ==
        doctest::Approx(1 - std::log(2.0)).epsilon(1e-4));
  for (double cos_o : {1.0, 0.5, 0.01})
    CHECK(albedo({make_point(material_type::matte, 0, 1.5f, vec3{0.6f}), cos_o}) ==
          doctest::Approx(0.6).epsilon(1e-4));
}

TEST_CASE("material: weights of samples are bounded") {
  rng_state rng = make_rng(2);
  for (auto type : {material_type::reflective, material_type::transparent,
                    material_type::refractive, material_type::gltfpbr})
    for (int k = 0; k < 100000; k++) {
      auto m = make_point(type, std::max(0.0009f, rand1f(rng)), 1.05f + rand1f(rng), {1, 1, 1}, 1);
      double cosine = std::pow(double(rand1f(rng)), 4.0);
      if (type == material_type::refractive && rand1f(rng) < 0.5f) cosine = -cosine;
      vec3 o = outgoing_at(cosine);
      float rnl = rand1f(rng), x = rand1f(rng), y = rand1f(rng);
      vec3 i = sample_bsdf(m, test_normal, o, rnl, {x, y});
      float pdf = sample_bsdf_pdf(m, test_normal, o, i);
      if (!(pdf > 0)) continue;
      float cos_o = glm::dot(test_normal, o);
      bool crosses = cos_o * glm::dot(test_normal, i) < 0;
      double eta = cos_o < 0 ? 1 / double(m.ior) : double(m.ior);
      double scale = crosses && bends_light(m) ? eta * eta : 1;
      double weight = double(max_component(eval_bsdf(m, test_normal, o, i))) / double(pdf) * scale;
      if (!(weight <= 1 + 1e-4)) FAIL("weight ", weight, " of type ", int(type));
    }
}

TEST_CASE("material: the phase function is normalised and has mean cosine g") {
  // Henyey and Greenstein; false alarms of the chi-squares: 1e-4 in all.
  const std::array g_values = {-0.95f, -0.5f, -1e-4f, 0.0f, 1e-3f, 0.3f, 0.8f, 0.99f};
  vec3 o = outgoing_at(0.6);
  for (std::size_t k = 0; k < g_values.size(); k++) {
    material_point m;
    m.type = material_type::volumetric;
    m.scattering = {0.9f, 0.5f, 0.1f};
    m.density = {1, 2, 3};
    m.scanisotropy = g_values[k];
    double g = double(g_values[k]);
    INFO("g ", g);
    polar_grid grid(g < 0 ? o : -o, 1 - std::abs(g), pi_d);
    auto cells = integrate_cells(grid, [&](const vec3& i) {
      double pdf = double(sample_scattering_pdf(m, o, i));
      return pair_t{pdf, pdf * -double(glm::dot(o, i))};
    });
    const int samples = 100000;
    std::vector<double> counts(cells.size()), expected;
    double total = 0, mean = 0;
    for (const auto& c : cells) {
      total += c[0], mean += c[1];
      expected.push_back(c[0] * samples);
    }
    CHECK(total == doctest::Approx(1).epsilon(1e-4));
    CHECK(mean == doctest::Approx(g).epsilon(1e-4));
    rng_state rng = make_rng(5, k);
    for (int s = 0; s < samples; s++) {
      float x = rand1f(rng), y = rand1f(rng);
      counts[std::size_t(grid.find(sample_scattering(m, o, {x, y})))]++;
    }
    CHECK(chi_square_p_value(counts, expected) > sidak(1e-4, int(g_values.size())));
    vec3 i = outgoing_at(-0.2, 2);
    vec3 wanted = m.scattering * m.density * sample_scattering_pdf(m, o, i);
    CHECK(glm::length(eval_scattering(m, o, i) - wanted) < 1e-6f);
  }
}

TEST_CASE("material: free flights follow their density") {
  // False alarms: 1e-4 in all.
  for (const vec3& density : {vec3{1, 2, 5}, vec3{0, 0.5f, 3}, vec3{0, 0, 0}}) {
    const float far = 1.3f;
    const int bins = 50, samples = 100000;
    std::vector<double> counts(bins + 1), expected(bins + 1);
    double total = expected[bins] = double(sample_transmittance_pdf(density, far, far));
    expected[bins] *= samples;
    for (int b = 0; b < bins; b++) {
      double sum = 0;
      for (int k = 0; k < 64; k++)
        sum += double(sample_transmittance_pdf(
            density, (float(b) + (float(k) + 0.5f) / 64) * far / bins, far));
      total += sum * double(far) / bins / 64;
      expected[std::size_t(b)] = sum * double(far) / bins / 64 * samples;
    }
    CHECK(total == doctest::Approx(1).epsilon(1e-4));
    rng_state rng = make_rng(6);
    running_stats mean;
    for (int k = 0; k < samples; k++) {
      float rl = rand1f(rng), rd = rand1f(rng);
      float t = sample_transmittance(density, far, rl, rd);
      counts[t >= far ? bins : std::size_t(t / far * bins)]++;
      // Flights that reach the end carry its transmittance.
      add_sample(mean, t >= far ? double(eval_transmittance(density, t).z) /
                                      double(sample_transmittance_pdf(density, t, far))
                                : 0);
    }
    CHECK(chi_square_p_value(counts, expected) > sidak(1e-4, 6));
    double z =
        (mean.mean - std::exp(-double(density.z * far))) / std::hypot(standard_error(mean), 1e-6);
    CHECK(two_sided(z) > sidak(1e-4, 6));
  }
  vec3 t = eval_transmittance({1, 0, 1e30f}, infinity);
  CHECK(t == vec3{0, 1, 0});
}
