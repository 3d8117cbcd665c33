// Energy by quadrature. Samples cannot show it: without absorption f / pdf is 1
// whatever M_p and N_p are.

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "support/quadrature.h"
#include "wisp/hair/bsdf.h"

using namespace wisp::hair;
using wisp::test::make_rule;
using wisp::test::peak;

namespace {

struct fibre {
  hair_bsdf<double> bsdf;
  hair_hit<double> hit;
};

fibre make_fibre(const hair_parameters<double>& parameters, const glm::dvec3& sigma_a, double h,
                 double theta_o) {
  fibre f;
  f.bsdf = make_hair_bsdf(parameters);
  f.hit = make_hair_hit<double>(
      f.bsdf, sigma_a, h, {std::sin(theta_o), std::cos(theta_o) * 0.6, std::cos(theta_o) * 0.8});
  return f;
}

// The integral over the sphere of what eval_hair_with_pdf gives, in panels
// around every lobe. d omega = cos(theta) d theta d phi; eval_hair has the
// cosine of the rendering equation in it, so what is summed is its value.
hair_value<double> integrate(const fibre& f) {
  constexpr double pi = pi_v<double>;
  std::vector<peak> along, around;
  for (std::size_t p = 0; p <= std::size_t(f.bsdf.p_max); p++) {
    along.push_back(
        {-std::atan2(f.hit.sin_theta_op[p], f.hit.cos_theta_op[p]), 0.3 * std::sqrt(f.bsdf.v[p])});
    if (p == std::size_t(f.bsdf.p_max)) continue;
    double phi = wrap_angle(f.hit.exit_phi[p]);
    for (double turn : {-2 * pi, 0.0, 2 * pi}) around.push_back({phi + turn, 0.5 * f.bsdf.s[p]});
    around.push_back({phi > 0 ? phi - pi : phi + pi, 1});  // where the logistic is trimmed
  }
  auto theta = make_rule(-pi / 2, pi / 2, along);
  auto phi = make_rule(-pi, pi, around);
  hair_value<double> sum;
  for (std::size_t i = 0; i < theta.x.size(); i++) {
    double s = std::sin(theta.x[i]), c = std::cos(theta.x[i]);
    for (std::size_t j = 0; j < phi.x.size(); j++) {
      // phi against that of wo
      double cos_phi = std::cos(phi.x[j]), sin_phi = std::sin(phi.x[j]);
      glm::dvec3 wi = {s, c * (f.hit.cos_phi_o * cos_phi - f.hit.sin_phi_o * sin_phi),
                       c * (f.hit.sin_phi_o * cos_phi + f.hit.cos_phi_o * sin_phi)};
      auto value = eval_hair_with_pdf<double>(f.bsdf, f.hit, wi);
      double w = theta.w[i] * phi.w[j] * c;
      sum.value += value.value * w;
      sum.pdf += value.pdf * w;
    }
  }
  return sum;
}

}  // namespace

TEST_CASE("hair: the furnace is 1 by quadrature, and so is the density") {
  struct roughness {
    double m, n;
  };
  for (roughness beta : {roughness{0.001, 0.001},
                         {0.001, 1},
                         {0.05, 0.1},
                         {0.3, 0.3},
                         {0.9, 0.9},
                         {1, 0.001},
                         {1, 1}})
    for (double alpha : {0.0, 2.0, -3.0}) {
      struct place {
        double h, theta_o, eta;
      };
      for (place at :
           {place{0.3, 0.4, 1.55}, {-1, -1.2, 1.55}, {1, 0, 3}, {-0.98, 1.55, 1.3}, {0, 0.9, 1}}) {
        auto f = make_fibre({at.eta, beta.m, beta.n, alpha, 3}, {0, 0, 0}, at.h, at.theta_o);
        auto sum = integrate(f);
        INFO("beta ", beta.m, " ", beta.n, " alpha ", alpha, " h ", at.h, " theta ", at.theta_o);
        CHECK(sum.value.y == doctest::Approx(1).epsilon(1e-4));
        CHECK(sum.pdf == doctest::Approx(1).epsilon(1e-4));
      }
    }
}

TEST_CASE("hair: with absorption the energy is the sum of A_p, of any p_max") {
  for (int p_max = 1; p_max <= max_p_max; p_max++) {
    glm::dvec3 sigma_a = {0.1, 0.7, 20};
    auto f = make_fibre({1.55, 0.3, 0.4, 2, p_max}, sigma_a, -0.6, 0.5);
    auto sum = integrate(f);
    glm::dvec3 energy(0);
    for (std::size_t p = 0; p <= std::size_t(p_max); p++) energy += glm::dvec3(f.hit.ap[p]);
    for (int k = 0; k < 3; k++) CHECK(sum.value[k] == doctest::Approx(energy[k]).epsilon(1e-4));
    CHECK(sum.pdf == doctest::Approx(1).epsilon(1e-4));
    // The residual lobe holds what is missing: the energy does not depend on p_max.
    auto three = make_fibre({1.55, 0.3, 0.4, 2, 3}, sigma_a, -0.6, 0.5);
    glm::dvec3 same(0);
    for (std::size_t p = 0; p <= 3; p++) same += glm::dvec3(three.hit.ap[p]);
    for (int k = 0; k < 3; k++) CHECK(energy[k] == doctest::Approx(same[k]).epsilon(1e-12));
  }
}

TEST_CASE("hair: a coat, strengths and roughness of their own keep lobes normalised") {
  hair_parameters<double> parameters;
  parameters.coat = 0.8;
  parameters.roughness = {glm::dvec2(-1), glm::dvec2(0.05, 0.6), glm::dvec2(0.7, -1)};
  auto f = make_fibre(parameters, {0, 0, 0}, 0.4, -0.3);
  CHECK(f.bsdf.v[0] == doctest::Approx(longitudinal_variance(0.06)).epsilon(1e-12));
  CHECK(f.bsdf.v[1] == doctest::Approx(longitudinal_variance(0.05)).epsilon(1e-12));
  CHECK(f.bsdf.v[2] == doctest::Approx(longitudinal_variance(0.7)).epsilon(1e-12));
  CHECK(f.bsdf.v[3] == doctest::Approx(longitudinal_variance(0.7)).epsilon(1e-12));
  CHECK(f.bsdf.s[0] == doctest::Approx(logistic_scale(0.3)).epsilon(1e-12));
  CHECK(f.bsdf.s[1] == doctest::Approx(logistic_scale(0.6)).epsilon(1e-12));
  CHECK(f.bsdf.s[2] == doctest::Approx(logistic_scale(0.3)).epsilon(1e-12));
  auto sum = integrate(f);
  CHECK(sum.value.x == doctest::Approx(1).epsilon(1e-4));
  CHECK(sum.pdf == doctest::Approx(1).epsilon(1e-4));

  // A full coat leaves R as narrow as a lobe can be.
  parameters.coat = 1;
  CHECK(make_hair_bsdf(parameters).v[0] ==
        doctest::Approx(longitudinal_variance(min_roughness)).epsilon(1e-9));

  parameters.strength = {glm::dvec3(0.5, 0, 1), glm::dvec3(0.25), glm::dvec3(0, 2, 0)};
  auto scaled = make_fibre(parameters, {0, 0, 0}, 0.4, -0.3);
  for (int k = 0; k < 3; k++) {
    double want = 0;
    for (std::size_t p = 0; p < 4; p++)
      want += f.hit.ap[p][k] * parameters.strength[std::min<std::size_t>(p, 2)][k];
    double got = 0;
    for (std::size_t p = 0; p < 4; p++) got += scaled.hit.ap[p][k];
    CHECK(got == doctest::Approx(want).epsilon(1e-12));
  }
  CHECK(integrate(scaled).pdf == doctest::Approx(1).epsilon(1e-4));
}

TEST_CASE("hair: more absorption never gives more light") {
  auto total = [](double sigma_a, double h, double theta) {
    auto f = make_fibre({1.55, 0.3, 0.3, 2, 3}, glm::dvec3(sigma_a), h, theta);
    double sum = 0;
    for (std::size_t p = 0; p <= 3; p++) sum += f.hit.ap[p].x;
    return sum;
  };
  for (double h : {-1.0, -0.5, 0.0, 0.9})
    for (double theta : {0.0, 1.0, 1.57}) {
      double last = 2;
      for (double sigma_a = 0; sigma_a < 2e4; sigma_a = sigma_a * 1.5 + 1e-4) {
        double now = total(sigma_a, h, theta);
        CHECK(now <= last);
        last = now;
      }
      // What is left is R.
      auto f = make_fibre({1.55, 0.3, 0.3, 2, 3}, glm::dvec3(1e4), h, theta);
      CHECK(last <= f.hit.ap[0].x * (1 + 1e-9) + 1e-9);
    }
}
