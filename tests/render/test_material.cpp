// Scattering at surfaces and in interiors, held against quadrature, against an
// independent double-precision form of the published formulas, and against
// what physics demands. All random numbers have fixed seeds; where a test is
// statistical, the rate of false alarms of the whole test case is stated.

#include <doctest/doctest.h>

#include <array>
#include <vector>

#include "support/statistics.h"
#include "wisp/core/rng.h"
#include "wisp/core/sampling.h"
#include "wisp/core/statistics.h"
#include "wisp/render/material.h"

using namespace wisp;
using namespace wisp::test;

namespace {

constexpr double pi_d = 3.14159265358979323846;

material_point make_point(material_type type, float alpha, float ior = 1.5f,
                          const vec3& color = {1, 1, 1}, float metallic = 0) {
  material_point m;
  m.type = type;
  m.color = color;
  m.roughness = alpha;
  m.ior = ior;
  m.metallic = metallic;
  return m;
}

bool bends_light(const material_point& m) {
  return m.type == material_type::refractive || m.type == material_type::subsurface;
}

// An oblique normal, so that no axis is special.
const vec3 test_normal = glm::normalize(vec3{0.3f, -0.5f, 0.7f});
const mat3 test_frame = basis_from_z(test_normal);

vec3 from_local(const dvec3& v) {
  return glm::normalize(
      vec3(dvec3(test_frame[0]) * v.x + dvec3(test_frame[1]) * v.y + dvec3(test_frame[2]) * v.z));
}
vec3 outgoing_at(double cosine, double phi = 0.4) {
  double sine = std::sqrt(1 - cosine * cosine);
  return from_local({sine * std::cos(phi), sine * std::sin(phi), cosine});
}

struct scatter_case {
  material_point m;
  double cos_o;  // < 0: seen from inside
};

// All rough types over roughness, index and direction.
std::vector<scatter_case> rough_cases(std::initializer_list<float> alphas) {
  std::vector<scatter_case> cases;
  const vec3 color = {0.8f, 0.5f, 0.2f};
  for (float alpha : alphas)
    for (double cos_o : {0.97, 0.5, 0.08}) {
      for (float ior : {1.2f, 1.5f, 2.4f}) {
        cases.push_back({make_point(material_type::glossy, alpha, ior, color), cos_o});
        cases.push_back({make_point(material_type::transparent, alpha, ior, color), cos_o});
        cases.push_back({make_point(material_type::refractive, alpha, ior), cos_o});
        cases.push_back({make_point(material_type::subsurface, alpha, ior), -cos_o});
      }
      cases.push_back({make_point(material_type::refractive, alpha, 0.7f), cos_o});
      cases.push_back({make_point(material_type::reflective, alpha, 1.5f, color), cos_o});
      for (float metallic : {0.0f, 0.6f, 1.0f})
        cases.push_back({make_point(material_type::gltfpbr, alpha, 1.5f, color, metallic), cos_o});
    }
  if (*alphas.begin() >= 0.1f)
    for (double cos_o : {0.97, 0.3})
      cases.push_back({make_point(material_type::matte, 0, 1.5f, color), cos_o});
  return cases;
}

// The directions that a smooth surface would send light to: centres of lobes.
std::vector<vec3> lobe_axes(const scatter_case& c) {
  dvec3 n = dvec3(test_normal) * (c.cos_o < 0 ? -1.0 : 1.0);
  dvec3 o = dvec3(outgoing_at(c.cos_o));
  double cosine = glm::dot(n, o);
  std::vector<vec3> axes = {vec3(glm::normalize(n * (2 * cosine) - o))};
  if (c.m.type == material_type::transparent) axes.push_back(-outgoing_at(c.cos_o));
  if (bends_light(c.m)) {
    double eta = c.cos_o < 0 ? 1 / double(c.m.ior) : double(c.m.ior);
    double cos2_t = 1 - (1 - cosine * cosine) / (eta * eta);
    if (cos2_t > 0)
      axes.push_back(vec3(glm::normalize(n * (cosine / eta - std::sqrt(cos2_t)) - o / eta)));
  }
  return axes;
}

// A grid of theta and phi around an axis, with rings that start at the width of
// the lobe and grow up to theta_max.
struct polar_grid {
  static constexpr int rings = 20, sectors = 12;
  dvec3 x, y, z;
  double theta_max = pi_d, growth = 1;

  polar_grid(const vec3& axis, double width, double theta_max_) : theta_max(theta_max_) {
    mat3 frame = basis_from_z(axis);
    x = dvec3(frame[0]), y = dvec3(frame[1]), z = glm::normalize(dvec3(axis));
    growth = std::log1p(theta_max / width);
  }
  double theta(double s) const { return theta_max * std::expm1(growth * s) / std::expm1(growth); }
  double theta_slope(double s) const {
    return theta_max * growth * std::exp(growth * s) / std::expm1(growth);
  }
  // The cell of a direction; -1 outside of theta_max.
  int find(const vec3& v) const {
    dvec3 d = dvec3(v);
    double t = std::atan2(glm::length(glm::cross(z, d)), glm::dot(z, d));
    if (t >= theta_max) return -1;
    double s = std::log1p(t / theta_max * std::expm1(growth)) / growth;
    double phi = std::atan2(glm::dot(y, d), glm::dot(x, d));
    if (phi < 0) phi += 2 * pi_d;
    int ring = std::min(int(s * rings), rings - 1);
    return ring * sectors + std::min(int(phi / (2 * pi_d) * sectors), sectors - 1);
  }
};

// (pdf, luminance of the value) integrated over a cell, by Gauss rules that
// are halved until they agree.
using pair_t = std::array<double, 2>;

template <typename F>
pair_t gauss(const polar_grid& g, double s0, double s1, double p0, double p1, F&& f) {
  static constexpr double x[] = {0.1127016653792583, 0.5, 0.8872983346207417};
  static constexpr double w[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  pair_t sum = {0, 0};
  for (int i = 0; i < 3; i++) {
    double s = s0 + (s1 - s0) * x[i], theta = g.theta(s);
    double sine = std::sin(theta), area = sine * g.theta_slope(s) * (s1 - s0) * (p1 - p0);
    for (int j = 0; j < 3; j++) {
      double phi = p0 + (p1 - p0) * x[j];
      pair_t v = f(vec3(g.x * (sine * std::cos(phi)) + g.y * (sine * std::sin(phi)) +
                        g.z * std::cos(theta)));
      for (std::size_t k = 0; k < 2; k++) sum[k] += v[k] * w[i] * w[j] * area;
    }
  }
  return sum;
}

template <typename F>
pair_t integrate(const polar_grid& g, double s0, double s1, double p0, double p1,
                 const pair_t& whole, int depth, F&& f) {
  double sm = (s0 + s1) / 2, pm = (p0 + p1) / 2;
  std::array<pair_t, 4> part = {gauss(g, s0, sm, p0, pm, f), gauss(g, sm, s1, p0, pm, f),
                                gauss(g, s0, sm, pm, p1, f), gauss(g, sm, s1, pm, p1, f)};
  pair_t sum = {0, 0};
  double change = 0;
  for (std::size_t k = 0; k < 2; k++) {
    for (const auto& p : part) sum[k] += p[k];
    change += std::abs(sum[k] - whole[k]);
  }
  if (depth >= 7 || (depth >= 1 && change < 2e-7)) return sum;
  part[0] = integrate(g, s0, sm, p0, pm, part[0], depth + 1, f);
  part[1] = integrate(g, sm, s1, p0, pm, part[1], depth + 1, f);
  part[2] = integrate(g, s0, sm, pm, p1, part[2], depth + 1, f);
  part[3] = integrate(g, sm, s1, pm, p1, part[3], depth + 1, f);
  for (std::size_t k = 0; k < 2; k++) sum[k] = part[0][k] + part[1][k] + part[2][k] + part[3][k];
  return sum;
}

template <typename F>
std::vector<pair_t> integrate_cells(const polar_grid& g, F&& f) {
  std::vector<pair_t> cells;
  for (int i = 0; i < g.rings; i++)
    for (int j = 0; j < g.sectors; j++) {
      double s0 = double(i) / g.rings, s1 = double(i + 1) / g.rings;
      double p0 = 2 * pi_d * j / g.sectors, p1 = 2 * pi_d * (j + 1) / g.sectors;
      cells.push_back(integrate(g, s0, s1, p0, p1, gauss(g, s0, s1, p0, p1, f), 0, f));
    }
  return cells;
}

double mean3(const vec3& v) { return (double(v.x) + double(v.y) + double(v.z)) / 3; }

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

// Upper tail of the normal distribution, two-sided.
double two_sided(double z) { return std::erfc(std::abs(z) / std::sqrt(2.0)); }

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

// ---------------------------------------------------------------------------
// The published formulas, in double and as they stand in Yocto/GL: z is up.
// ---------------------------------------------------------------------------

double fresnel(double eta, double c) {
  c = std::abs(c);
  double t2 = 1 - (1 - c * c) / (eta * eta);
  if (t2 < 0) return 1;
  double t = std::sqrt(t2);
  double rs = (c - eta * t) / (c + eta * t), rp = (eta * c - t) / (eta * c + t);
  return (rs * rs + rp * rp) / 2;
}
double ggx(double alpha, const dvec3& h) {
  double a2 = alpha * alpha, d = h.z * h.z * (a2 - 1) + 1;
  return h.z > 0 ? a2 / (pi_d * d * d) : 0;
}
double masking(double alpha, const dvec3& v, const dvec3& h) {
  if (v.z * glm::dot(v, h) <= 0) return 0;
  double tan2 = (1 - v.z * v.z) / (v.z * v.z);
  return 2 / (1 + std::sqrt(1 + alpha * alpha * tan2));
}

dvec3 reference(const material_point& m, dvec3 o, dvec3 i) {
  using enum material_type;
  double alpha = double(m.roughness), ior = double(m.ior);
  dvec3 color = dvec3(m.color);
  if (o.z < 0) {
    o.z = -o.z, i.z = -i.z;
    if (bends_light(m)) ior = 1 / ior;
  }
  auto facets = [&](const dvec3& v) {
    dvec3 h = glm::normalize(o + v);
    return ggx(alpha, h) * masking(alpha, o, h) * masking(alpha, v, h) / (4 * o.z);
  };
  if (i.z < 0) {
    if (m.type == transparent) {
      dvec3 v = {i.x, i.y, -i.z};
      return color * ((1 - fresnel(ior, glm::dot(o, glm::normalize(o + v)))) * facets(v));
    }
    if (!bends_light(m)) return {0, 0, 0};
    dvec3 h = glm::normalize(o + ior * i);  // Walter, equation 16 and 21
    if (h.z < 0) h = -h;
    double oh = glm::dot(o, h), ih = glm::dot(i, h), d = oh + ior * ih;
    if (oh <= 0 || ih >= 0) return {0, 0, 0};
    return dvec3(std::abs(oh * ih / (o.z * i.z)) * (1 - fresnel(ior, oh)) * ggx(alpha, h) *
                 masking(alpha, o, h) * masking(alpha, i, h) / (d * d) * std::abs(i.z));
  }
  if (m.type == matte) return color * (i.z / pi_d);
  double oh = glm::dot(o, glm::normalize(o + i));
  if (m.type == glossy)
    return color * ((1 - fresnel(ior, o.z)) * i.z / pi_d) + fresnel(ior, oh) * facets(i);
  if (m.type == reflective) {
    dvec3 f;
    for (int k = 0; k < 3; k++) {
      double r = std::sqrt(color[k]);
      f[k] = fresnel((1 + r) / (1 - r), oh);
    }
    return f * facets(i);
  }
  if (m.type == gltfpbr) {
    double r0 = (ior - 1) * (ior - 1) / ((ior + 1) * (ior + 1)), metal = double(m.metallic);
    dvec3 f0 = glm::mix(dvec3(r0), color, metal);
    auto schlick = [&](double c) { return f0 + (1.0 - f0) * std::pow(1 - c, 5.0); };
    return color * (1 - metal) * (1.0 - schlick(o.z)) * (i.z / pi_d) + schlick(oh) * facets(i);
  }
  return dvec3(fresnel(ior, oh) * facets(i));
}

dvec3 to_local(const vec3& v) {
  return {glm::dot(dvec3(test_frame[0]), dvec3(v)), glm::dot(dvec3(test_frame[1]), dvec3(v)),
          glm::dot(dvec3(test_frame[2]), dvec3(v))};
}

constexpr std::array all_types = {
    material_type::matte,       material_type::glossy,     material_type::reflective,
    material_type::transparent, material_type::refractive, material_type::subsurface,
    material_type::volumetric,  material_type::gltfpbr,    material_type::hair};

}  // namespace

TEST_CASE("material: values are those of the published formulas") {
  rng_state rng = make_rng(1);
  int compared = 0;
  for (const auto& c : rough_cases({0.1f, 0.35f, 1.0f})) {
    vec3 o = outgoing_at(c.cos_o);
    for (int k = 0; k < 500; k++) {
      float x = rand1f(rng), y = rand1f(rng);
      vec3 i = sample_sphere({x, y});
      if (std::abs(glm::dot(i, test_normal)) < 1e-2f) continue;
      dvec3 wanted = reference(c.m, to_local(o), to_local(i));
      vec3 value = eval_bsdf(c.m, test_normal, o, i);
      INFO("type ", int(c.m.type), " alpha ", c.m.roughness, " ior ", c.m.ior, " metallic ",
           c.m.metallic, " cos_o ", c.cos_o);
      for (int ch = 0; ch < 3; ch++) {
        compared += wanted[ch] > 0;
        CHECK(double(value[ch]) == doctest::Approx(wanted[ch]).epsilon(2e-3).scale(1e-3));
      }
    }
  }
  CHECK(compared > 50000);
}

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

TEST_CASE("material: light goes both ways alike") {
  rng_state rng = make_rng(3);
  const vec3 color = {0.8f, 0.5f, 0.2f};
  int compared = 0;
  for (float alpha : {0.05f, 0.3f, 1.0f})
    for (const auto& m : {make_point(material_type::matte, alpha, 1.5f, color),
                          make_point(material_type::glossy, alpha, 1.5f, {0, 0, 0}),
                          make_point(material_type::reflective, alpha, 1.5f, color),
                          make_point(material_type::transparent, alpha, 1.5f, color),
                          make_point(material_type::refractive, alpha, 1.5f),
                          make_point(material_type::subsurface, alpha, 1.3f),
                          make_point(material_type::gltfpbr, alpha, 1.5f, color, 1)})
      for (int k = 0; k < 2000; k++) {
        float a = rand1f(rng), b = rand1f(rng), c = rand1f(rng);
        float x = rand1f(rng), y = rand1f(rng);
        vec3 o = outgoing_at(0.02 + 0.98 * double(a), 6 * double(b));
        // Half of them where the lobe is.
        vec3 i = k % 2 ? sample_bsdf(m, test_normal, o, c, {x, y}) : sample_sphere({x, y});
        float cos_o = glm::dot(o, test_normal), cos_i = glm::dot(i, test_normal);
        if (std::abs(cos_i) < 0.02f) continue;
        // Non-transmissive normals face the viewer, but need not.
        vec3 f = eval_bsdf(m, test_normal, o, i) / std::abs(cos_i);
        vec3 g = eval_bsdf(m, test_normal, i, o) / std::abs(cos_o);
        // Radiance over the squared index is what is conserved.
        if (bends_light(m) && cos_o * cos_i < 0) f *= m.ior * m.ior;
        INFO("type ", int(m.type), " alpha ", alpha, " cosines ", cos_o, " ", cos_i);
        for (int ch = 0; ch < 3; ch++) {
          compared += f[ch] > 0;
          CHECK(double(f[ch]) == doctest::Approx(double(g[ch])).epsilon(5e-3).scale(1e-3));
        }
      }
  CHECK(compared > 30000);
}

TEST_CASE("material: delta lobes share the light and obey Snell and Fresnel") {
  const vec3 color = {0.8f, 0.5f, 0.2f};
  for (float ior : {0.8f, 1.0f, 1.0005f, 1.33f, 1.5f, 2.4f})
    for (double cos_o : {1.0, 0.7, 0.2, 0.01, -1.0, -0.7, -0.2, -0.01}) {
      vec3 o = outgoing_at(cos_o);
      INFO("ior ", ior, " cos_o ", cos_o);
      for (auto type :
           {material_type::reflective, material_type::transparent, material_type::refractive,
            material_type::subsurface, material_type::volumetric}) {
        auto m = make_point(type, 0, ior, color);
        INFO("type ", int(type));
        REQUIRE(is_delta(m));
        double eta = cos_o < 0 ? 1 / double(ior) : double(ior);
        double light = 0, probability = 0;
        vec3 last = {0, 0, 0};
        for (float rnl : {0.0f, 0.999999f}) {
          vec3 i = sample_delta(m, test_normal, o, rnl);
          if (i == vec3{0, 0, 0} || i == last) continue;
          last = i;
          CHECK(glm::length(i) == doctest::Approx(1).epsilon(1e-5));
          float pdf = sample_delta_pdf(m, test_normal, o, i);
          vec3 value = eval_delta(m, test_normal, o, i);
          CHECK(pdf > 0);
          probability += double(pdf);
          bool crosses = double(glm::dot(i, test_normal)) * cos_o < 0;
          bool bent = bends_light(m) && std::abs(ior - 1) > 1e-3f;
          dvec3 out = dvec3(o), in = dvec3(i), n = dvec3(test_normal);
          dvec3 wanted = crosses && bent ? glm::cross(n, out) / -eta
                                         : glm::cross(n, out) * -1.0;  // Snell: tangents
          CHECK(glm::length(glm::cross(n, in) - wanted) < 1e-5);
          double f = fresnel(type == material_type::transparent ? double(ior) : eta, cos_o);
          double chance = crosses ? 1 - f : f;
          if (type == material_type::reflective || (crosses && !bent && bends_light(m)) ||
              type == material_type::volumetric)
            chance = 1;
          CHECK(double(pdf) == doctest::Approx(chance).epsilon(1e-4));
          light += double(value.x) * (crosses && bent ? eta * eta : 1);
        }
        if (type == material_type::reflective) {
          double r = std::sqrt(0.8);
          CHECK(light == doctest::Approx(fresnel((1 + r) / (1 - r), cos_o)).epsilon(1e-4));
        } else if (type == material_type::transparent) {
          double f = fresnel(double(ior), cos_o);
          CHECK(light == doctest::Approx(f + (1 - f) * 0.8).epsilon(1e-4));
        } else {
          CHECK(light == doctest::Approx(1).epsilon(1e-5));
        }
        CHECK(probability == doctest::Approx(1).epsilon(1e-5));
        // A delta has no density.
        CHECK(eval_bsdf(m, test_normal, o, -o) == vec3{0, 0, 0});
        CHECK(sample_bsdf(m, test_normal, o, 0.5f, {0.5f, 0.5f}) == vec3{0, 0, 0});
        CHECK(sample_bsdf_pdf(m, test_normal, o, -o) == 0);
      }
    }
  // Total internal reflection.
  auto glass = make_point(material_type::refractive, 0, 1.5f);
  vec3 o = outgoing_at(-0.5), i = sample_delta(glass, test_normal, o, 0.999999f);
  CHECK(glm::dot(i, test_normal) < 0);
  CHECK(sample_delta_pdf(glass, test_normal, o, i) == 1);
  CHECK(eval_delta(glass, test_normal, o, i) == vec3{1, 1, 1});
  CHECK(eval_delta(glass, test_normal, o, -i) == vec3{0, 0, 0});
  CHECK(eval_delta(make_point(material_type::reflective, 0), test_normal, o, i) == vec3{1, 1, 1});
}

TEST_CASE("material: an index of 1 lets light through at any roughness") {
  auto m = make_point(material_type::refractive, 0.5f, 1);
  vec3 o = outgoing_at(0.3);
  CHECK(is_delta(m));
  CHECK(sample_delta(m, test_normal, o, 0.5f) == -o);
  CHECK(eval_delta(m, test_normal, o, -o) == vec3{1, 1, 1});
  CHECK(sample_delta_pdf(m, test_normal, o, -o) == 1);
  CHECK(eval_bsdf(m, test_normal, o, -o) == vec3{0, 0, 0});
}

TEST_CASE("material: a million calls give finite values that are not negative") {
  rng_state rng = make_rng(4);
  auto cosine = [&]() -> double {  // every so often next to grazing or straight
    float kind = rand1f(rng);
    double c = double(rand1f(rng)) * 2 - 1;
    if (kind < 0.2f) return c * 1e-4;
    if (kind < 0.3f) return c * 1e-9;
    if (kind < 0.35f) return c < 0 ? -1 : 1;
    if (kind < 0.37f) return 0;
    return c;
  };
  auto good = [](const vec3& v) { return is_finite(v) && v.x >= 0 && v.y >= 0 && v.z >= 0; };
  auto unit = [](const vec3& v) {
    return v == vec3{0, 0, 0} || std::abs(glm::dot(v, v) - 1) < 1e-4f;
  };
  auto color_channel = [&] {
    float kind = rand1f(rng);
    return kind < 0.15f ? 0.0f : kind < 0.3f ? 1.0f : rand1f(rng);
  };
  uint64_t bad = 0, unmatched = 0, scattered = 0;
  for (int k = 0; k < 1000000; k++) {
    material_data data;
    data.type = all_types[rand_index(rng, all_types.size())];
    data.color = {color_channel(), color_channel(), color_channel()};
    data.roughness = rand1f(rng) < 0.2f ? 0.0f : rand1f(rng);
    data.metallic = color_channel();
    data.ior = rand1f(rng) < 0.1f ? 1.0f : 0.5f + 2 * rand1f(rng);
    data.scattering = {color_channel(), color_channel(), color_channel()};
    data.scanisotropy = 2 * color_channel() - 1;
    data.trdepth = rand1f(rng) < 0.01f ? 0.0f : rand1f(rng);
    material_point m = eval_material(data, {}, {0, 0}, {1, 1, 1, 1});
    float x = rand1f(rng), y = rand1f(rng), rnl = rand1f(rng);
    vec3 n = sample_sphere({x, y});
    mat3 frame = basis_from_z(n);
    auto direction = [&] {
      double c = cosine(), s = std::sqrt(1 - c * c), phi = 6.3 * double(rand1f(rng));
      return glm::normalize(frame * vec3(dvec3(s * std::cos(phi), s * std::sin(phi), c)));
    };
    vec3 o = direction();
    x = rand1f(rng), y = rand1f(rng);
    if (rnl < 0.01f) x = y = 0;
    bool delta = is_delta(m);
    vec3 drawn = delta ? sample_delta(m, n, o, rnl) : sample_bsdf(m, n, o, rnl, {x, y});
    bad += !unit(drawn);
    for (vec3 i : {drawn, direction(), -o, o}) {
      vec3 value = eval_bsdf(m, n, o, i);
      float pdf = sample_bsdf_pdf(m, n, o, i);
      vec3 delta_value = eval_delta(m, n, o, i);
      float delta_pdf = sample_delta_pdf(m, n, o, i);
      bad += !good(value) || !(pdf >= 0) || !std::isfinite(pdf) || !good(delta_value) ||
             !(delta_pdf >= 0) || !std::isfinite(delta_pdf);
      // No value where nothing is drawn, and the other way round but for black.
      unmatched +=
          (pdf == 0 && value != vec3{0, 0, 0}) || (delta_pdf == 0 && delta_value != vec3{0, 0, 0});
      if (m.type == material_type::refractive || m.type == material_type::subsurface)
        unmatched += pdf > 1e-20f && value == vec3{0, 0, 0};
      scattered += pdf > 0 || delta_pdf > 0;
    }
    vec3 p = sample_scattering(m, o, {x, y});
    bad += !unit(p) || !good(eval_scattering(m, o, p)) ||
           !std::isfinite(sample_scattering_pdf(m, o, p)) || !(sample_scattering_pdf(m, o, p) > 0);
    float far = rnl < 0.1f ? infinity : rand1f(rng);
    float t = sample_transmittance(m.density, far, x, y);
    bad += !(t >= 0) || !good(eval_transmittance(m.density, t)) ||
           !std::isfinite(sample_transmittance_pdf(m.density, t, far)) ||
           !(sample_transmittance_pdf(m.density, t, far) >= 0);
  }
  CHECK(bad == 0);
  CHECK(unmatched == 0);
  CHECK(scattered > 1500000);
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

TEST_CASE("material: parameters mean what they mean in Yocto/GL") {
  std::vector<texture_data> textures(3);
  for (auto& t : textures) t.width = t.height = 1;
  textures[0].pixelsf = {{0.5f, 0.25f, 1, 0.5f}};
  textures[1].pixelsb = {{9, 51, 204, 99}};  // green 0.2, blue 0.8, not decoded
  textures[2].pixelsb = {{255, 0, 188, 255}};
  material_data data;
  data.type = material_type::gltfpbr;
  data.emission = {2, 4, 6};
  data.color = {0.8f, 0.4f, 0.2f};
  data.opacity = 0.9f;
  data.roughness = 0.5f;
  data.metallic = 0.5f;
  data.ior = 1.4f;
  vec4 vertex = {0.5f, 1, 0.5f, 0.8f};

  auto m = eval_material(data, {}, {0, 0}, {1, 1, 1, 1});
  CHECK(m.color == data.color);
  CHECK(m.emission == data.emission);
  CHECK(m.opacity == data.opacity);
  CHECK(m.roughness == 0.25f);
  CHECK(m.metallic == 0.5f);
  CHECK(m.ior == 1.4f);
  CHECK(m.density == vec3{0, 0, 0});

  data.color_tex = data.emission_tex = 0;
  data.roughness_tex = 1;
  m = eval_material(data, textures, {0.3f, 7}, vertex);
  CHECK(glm::length(m.color - vec3{0.2f, 0.1f, 0.1f}) < 1e-6f);
  CHECK(m.emission == vec3{1, 1, 6});  // vertex colours do not tint it
  CHECK(m.opacity == doctest::Approx(0.9 * 0.5 * 0.8));
  CHECK(m.roughness == doctest::Approx(0.01));
  CHECK(m.metallic == doctest::Approx(0.4));

  // Colour textures of 8 bits are decoded.
  data.color_tex = 2;
  m = eval_material(data, textures, {0, 0}, {1, 1, 1, 1});
  CHECK(m.color.z == doctest::Approx(0.2 * 0.5028865));

  // Interiors: `color` is left after trdepth.
  data = {};
  data.type = material_type::subsurface;
  data.color = {0.5f, 1, 0};
  data.trdepth = 0.2f;
  data.scattering = {1, 0.5f, 0.8f};
  data.scanisotropy = 0.3f;
  data.scattering_tex = 0;
  m = eval_material(data, textures, {0, 0}, {1, 1, 1, 1});
  vec3 left = eval_transmittance(m.density, 0.2f);
  CHECK(glm::length(left - vec3{0.5f, 1, 0.0001f}) < 1e-6f);
  CHECK(m.scattering == vec3{0.5f, 0.125f, 0.8f});
  CHECK(m.scanisotropy == 0.3f);
  CHECK(is_volumetric(m));

  for (auto type : all_types) {
    data = {};
    data.type = type;
    data.roughness = 0.02f;  // below 0.03: a delta, or the least roughness
    m = eval_material(data, {}, {0, 0}, {1, 1, 1, 1});
    using enum material_type;
    bool coated = type == glossy || type == gltfpbr;
    CHECK(m.roughness == (coated ? 0.03f * 0.03f : 0));
    CHECK(is_delta(m) == (type == reflective || type == transparent || type == refractive ||
                          type == subsurface || type == volumetric));
    CHECK(is_transmissive(type) ==
          (type == refractive || type == subsurface || type == volumetric));
    data.roughness = 0.031f;
    m = eval_material(data, {}, {0, 0}, {1, 1, 1, 1});
    CHECK(is_delta(m) == (type == volumetric));
    // Textures that are not there are no textures.
    data.color = {0.5f, 0.5f, 0.5f};
    data.color_tex = data.emission_tex = data.roughness_tex = data.scattering_tex = 12;
    CHECK(eval_material(data, textures, {0, 0}, {1, 1, 1, 1}).color == data.color);
  }

  data = {};
  data.type = material_type::hair;
  data.color = {1, 1, 1};
  data.color_tex = 0;
  data.emission = {1, 2, 3};
  data.opacity = 0.5f;
  data.ior = 1.6f;
  m = eval_material(data, textures, {0, 0}, {1, 0.5f, 1, 1});
  CHECK(m.color == vec3{0.5f, 0.125f, 1});
  CHECK(m.opacity == 0.25f);
  CHECK(m.ior == 1.6f);
  CHECK(m.emission == data.emission);
  CHECK(eval_emission(m, {0, 0, 1}, {0, 0, 1}) == data.emission);
  CHECK(eval_emission(m, {0, 0, 1}, {0, 0, -1}) == data.emission);
}
