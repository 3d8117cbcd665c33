// Roughness and colour to the numbers of the model and back.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "wisp/hair/absorption.h"
#include "wisp/hair/parameters.h"

using namespace wisp::hair;
using doctest::Approx;

TEST_CASE("hair: roughness maps both ways") {
  double error_m = 0, error_n = 0;
  double before_v = 0, before_s = 0, before_m = -1, before_n = -1;
  bool rising = true;
  for (int i = 1; i <= 20000; i++) {
    double beta = i / 20000.0;
    double v = longitudinal_variance(beta), s = logistic_scale(beta);
    error_m = std::max(error_m, std::abs(beta_m_from_variance(v) - beta) / beta);
    error_n = std::max(error_n, std::abs(beta_n_from_scale(s) - beta) / beta);
    rising = rising && v > before_v && s > before_s;
    before_v = v;
    before_s = s;
    // The inverses rise too, over their own arguments.
    double bm = beta_m_from_variance(1e-9 * std::pow(1e11, beta));
    double bn = beta_n_from_scale(1e-9 * std::pow(1e11, beta));
    rising = rising && bm >= before_m && bn >= before_n;
    before_m = bm;
    before_n = bn;
  }
  CHECK(error_m < 1e-15);
  CHECK(error_n < 1e-15);
  CHECK(rising);
  for (double beta = 1e-12; beta < 1; beta *= 1.3) {
    REQUIRE(beta_m_from_variance(longitudinal_variance(beta)) == Approx(beta).epsilon(1e-13));
    REQUIRE(beta_n_from_scale(logistic_scale(beta)) == Approx(beta).epsilon(1e-13));
  }
  float error_f = 0;
  for (int i = 1; i <= 1000; i++) {
    float beta = static_cast<float>(i) * 1e-3f;
    error_f = std::max({error_f,
                        std::abs(beta_m_from_variance(longitudinal_variance(beta)) - beta) / beta,
                        std::abs(beta_n_from_scale(logistic_scale(beta)) - beta) / beta});
  }
  CHECK(error_f < 4e-7f);
  CHECK(beta_m_from_variance(0.0) == 0);
  CHECK(beta_m_from_variance(-1.0) == 0);
  CHECK(beta_n_from_scale(-1.0) == 0);
  CHECK(beta_m_from_variance(1e9) == 1);
  CHECK(beta_n_from_scale(1e9) == 1);
  CHECK(beta_m_from_variance(longitudinal_variance(1.0)) == 1);
  CHECK(beta_n_from_scale(logistic_scale(1.0)) == 1);
  CHECK(beta_m_from_variance(std::numeric_limits<double>::quiet_NaN()) == 0);
  // Values of the polynomials of the paper, by hand.
  CHECK(longitudinal_variance(1.0) == Approx(5.238 * 5.238).epsilon(1e-14));
  CHECK(longitudinal_variance(0.5) ==
        Approx(0.566003528594970703 * 0.566003528594970703).epsilon(1e-12));
  CHECK(logistic_scale(1.0) == Approx(0.626657069 * 6.831).epsilon(1e-14));
  CHECK(logistic_scale(0.5) == Approx(0.626657069 * 0.431001280784606934).epsilon(1e-12));
}

TEST_CASE("hair: colours and absorptions both ways") {
  double error = 0;
  bool falling = true;
  for (double beta : {1e-4, 0.1, 0.3, 0.7, 1.0}) {
    double before = 1e300;
    for (int i = 0; i <= 2000; i++) {
      double c = 1e-5 + (1 - 1e-5) * i / 2000;
      auto sigma = sigma_a_from_color(glm::dvec3(c, c * c, 1), beta);
      auto back = color_from_sigma_a(sigma, beta);
      error = std::max({error, std::abs(back.x / c - 1),
                        std::abs(back.y / std::max(c * c, 1e-5) - 1), std::abs(back.z - 1)});
      falling = falling && sigma.x < before && sigma.x >= 0;
      before = sigma.x;
    }
    // And the other way around, as far as a colour can tell.
    for (double sigma = 1e-12; sigma < 2; sigma *= 1.1) {
      auto there = sigma_a_from_color(color_from_sigma_a(glm::dvec3(sigma), beta), beta);
      REQUIRE(there.y == Approx(sigma).epsilon(1e-8));
    }
    // Outside of the range: its ends.
    CHECK(sigma_a_from_color(glm::dvec3(-1, 0, 2), beta) ==
          sigma_a_from_color(glm::dvec3(1e-5, 1e-5, 1), beta));
    CHECK(color_from_sigma_a(glm::dvec3(-1, 0, 0), beta) == glm::dvec3(1));
  }
  CHECK(error < 1e-14);
  CHECK(falling);
  // The polynomial of the paper at its ends, and absorption by hand.
  CHECK(color_polynomial(0.0) == Approx(5.969).epsilon(1e-15));
  CHECK(color_polynomial(1.0) == Approx(3.375).epsilon(1e-14));
  CHECK(color_polynomial(0.5) == Approx(5.50928125).epsilon(1e-14));
  CHECK(sigma_a_from_color(glm::dvec3(std::exp(-5.969)), 0.0).x == Approx(1).epsilon(1e-14));
}
