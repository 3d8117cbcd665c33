#pragma once

// Materials, directions and quadrature for the tests of materials.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "wisp/core/math.h"
#include "wisp/render/material.h"

namespace wisp::test {

inline constexpr double pi_d = 3.14159265358979323846;

inline material_point make_point(material_type type, float alpha, float ior = 1.5f,
                                 const vec3& color = {1, 1, 1}, float metallic = 0) {
  material_point m;
  m.type = type;
  m.color = color;
  m.roughness = alpha;
  m.ior = ior;
  m.metallic = metallic;
  return m;
}

inline bool bends_light(const material_point& m) {
  return m.type == material_type::refractive || m.type == material_type::subsurface;
}

// An oblique normal, so that no axis is special.
inline const vec3 test_normal = glm::normalize(vec3{0.3f, -0.5f, 0.7f});
inline const mat3 test_frame = basis_from_z(test_normal);

inline vec3 from_local(const dvec3& v) {
  return glm::normalize(
      vec3(dvec3(test_frame[0]) * v.x + dvec3(test_frame[1]) * v.y + dvec3(test_frame[2]) * v.z));
}
inline vec3 outgoing_at(double cosine, double phi = 0.4) {
  double sine = std::sqrt(1 - cosine * cosine);
  return from_local({sine * std::cos(phi), sine * std::sin(phi), cosine});
}

struct scatter_case {
  material_point m;
  double cos_o;  // < 0: seen from inside
};

// All rough types over roughness, index and direction.
inline std::vector<scatter_case> rough_cases(std::initializer_list<float> alphas) {
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
inline std::vector<vec3> lobe_axes(const scatter_case& c) {
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

inline double mean3(const vec3& v) { return (double(v.x) + double(v.y) + double(v.z)) / 3; }

// Upper tail of the normal distribution, two-sided.
inline double two_sided(double z) { return std::erfc(std::abs(z) / std::sqrt(2.0)); }

// Reflectance of a dielectric, in double.
inline double fresnel(double eta, double c) {
  c = std::abs(c);
  double t2 = 1 - (1 - c * c) / (eta * eta);
  if (t2 < 0) return 1;
  double t = std::sqrt(t2);
  double rs = (c - eta * t) / (c + eta * t), rp = (eta * c - t) / (eta * c + t);
  return (rs * rs + rp * rp) / 2;
}

}  // namespace wisp::test
