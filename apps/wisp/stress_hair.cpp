// The hair model where it is stiffest, by quadrature: samples cannot tell, since
// without absorption f / pdf is 1 whatever M_p and N_p are.

#include "stress_hair.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "stress_quadrature.h"
#include "wisp/hair/bsdf.h"

using namespace wisp::hair;

namespace {

constexpr double pi = pi_v<double>;

template <typename T>
glm::vec<3, T> direction(double theta, double phi) {
  double c = std::cos(theta);
  return {T(std::sin(theta)), T(c * std::cos(phi)), T(c * std::sin(phi))};
}

peak peak_of_mp(const hair_bsdf<double>& bsdf, const hair_hit<double>& hit, std::size_t p) {
  return {-std::atan2(hit.sin_theta_op[p], hit.cos_theta_op[p]), 0.5 * std::sqrt(bsdf.v[p])};
}

double integral_of_mp(const hair_bsdf<double>& bsdf, const hair_hit<double>& hit, std::size_t p) {
  return integrate(-pi / 2, pi / 2, {peak_of_mp(bsdf, hit, p)}, [&](double t) {
    return std::cos(t) * longitudinal_mp(std::sin(t), std::cos(t), hit.sin_theta_op[p],
                                         hit.cos_theta_op[p], bsdf.inv_v[p], bsdf.mp_norm[p]);
  });
}

// Where N_p peaks between -pi and pi, there and a turn away, and where it is cut.
void peaks_of_np(const hair_bsdf<double>& bsdf, const hair_hit<double>& hit, std::size_t p,
                 std::vector<peak>& peaks) {
  if (p == static_cast<std::size_t>(bsdf.p_max)) return;
  double at = wrap_angle(hit.exit_phi[p]), width = 0.5 * bsdf.s[p];
  for (double turn : {-2 * pi, 0.0, 2 * pi}) peaks.push_back({at + turn, width});
  peaks.push_back({at > 0 ? at - pi : at + pi, 1});
}

double integral_of_np(const hair_bsdf<double>& bsdf, const hair_hit<double>& hit, std::size_t p) {
  std::vector<peak> peaks;
  peaks_of_np(bsdf, hit, p, peaks);
  return integrate(-pi, pi, peaks, [&](double phi) {
    return azimuthal_np(phi - hit.exit_phi[p], bsdf.inv_s[p], bsdf.np_norm[p]);
  });
}

// Energy, the red channel's, and total density, lobe by lobe.
std::pair<double, double> totals_by_lobes(const hair_bsdf<double>& bsdf,
                                          const hair_hit<double>& hit) {
  double energy = 0, pdf = 0;
  for (std::size_t p = 0; p <= static_cast<std::size_t>(bsdf.p_max); p++) {
    double mn = integral_of_mp(bsdf, hit, p) * integral_of_np(bsdf, hit, p);
    energy += hit.ap[p].x * mn;
    pdf += hit.ap[p].w * mn;
  }
  return {energy, pdf};
}

// The same by whole directions, wo having the azimuth 0.
std::pair<double, double> totals_by_directions(const hair_bsdf<double>& bsdf,
                                               const hair_hit<double>& hit) {
  std::vector<peak> along, around;
  for (std::size_t p = 0; p <= static_cast<std::size_t>(bsdf.p_max); p++) {
    along.push_back(peak_of_mp(bsdf, hit, p));
    peaks_of_np(bsdf, hit, p, around);
  }
  auto total = [&](auto&& part) {
    return integrate(-pi / 2, pi / 2, along, [&](double theta) {
      return std::cos(theta) * integrate(-pi, pi, around, [&](double phi) {
               return part(eval_hair_with_pdf<double>(bsdf, hit, direction<double>(theta, phi)));
             });
    });
  };
  return {total([](const auto& f) { return f.value.x; }),
          total([](const auto& f) { return f.pdf; })};
}

// What a smooth fibre gives back in all: the reflection and the geometric series
// of what enters, by the textbook's angles.
double energy_of(double eta, double sigma, double h, double theta_o) {
  double gamma_o = std::asin(h), theta_t = std::asin(std::sin(theta_o) / eta);
  double gamma_t = std::asin(h * std::cos(theta_o) / (eta * std::cos(theta_t)));
  double c = std::cos(theta_o) * std::cos(gamma_o), t = std::sqrt(1 - (1 - c * c) / (eta * eta));
  double rs = (c - eta * t) / (c + eta * t), rp = (eta * c - t) / (eta * c + t);
  double f = (rs * rs + rp * rp) / 2;
  double through = std::exp(-sigma * 2 * std::cos(gamma_t) / std::cos(theta_t));
  return f + (1 - f) * (1 - f) * through / (1 - f * through);
}

stress_row near(std::string what, double expected, double got, double bound) {
  return {std::move(what), fmt::format("{:.10g}", expected), fmt::format("{:.10g}", got),
          std::abs(got - expected), bound};
}

// Of many values that all should be 1 the one furthest from it.
struct furthest {
  double value = 1;
  void look(double x) {  // a NaN stays
    if (!std::isnan(value) && !(std::abs(x - 1) <= std::abs(value - 1))) value = x;
  }
};

void special_functions(std::vector<stress_row>& rows) {
  auto truth = [](double x) { return std::cyl_bessel_i(0.0, x) * std::exp(-x); };
  for (double x : {std::nextafter(12.0, 0.0), std::nextafter(12.0, 13.0)})
    rows.push_back({fmt::format("exp(-x) I0(x), x just {} 12, double", x < 12 ? "below" : "above"),
                    fmt::format("{:.15g}", truth(x)), fmt::format("{:.15g}", bessel_i0e(x)),
                    std::abs(bessel_i0e(x) / truth(x) - 1), 1e-13});
  rows.push_back({"exp(-x) I0(x), x = 12, float", fmt::format("{:.8g}", truth(12)),
                  fmt::format("{:.8g}", bessel_i0e(12.0f)),
                  std::abs(double(bessel_i0e(12.0f)) / truth(12) - 1), 5e-7});
  double worst = 0, worst_f = 0;
  for (double x = 0; x < 700; x += x < 20 ? 0.003 : 0.1) {
    auto single = static_cast<float>(x);
    worst = larger_error(worst, std::abs(bessel_i0e(x) / truth(x) - 1));
    worst_f =
        larger_error(worst_f, std::abs(double(bessel_i0e(single)) / truth(double(single)) - 1));
  }
  rows.push_back({"exp(-x) I0(x), largest relative error for x of 0 … 700, double", "0",
                  fmt::format("{:.2g}", worst), worst, 1e-12});
  rows.push_back({"the same, float", "0", fmt::format("{:.2g}", worst_f), worst_f, 7e-7});
  // sqrt(2 pi x) I0e(x) by its asymptotic series, where I0 itself overflows.
  double far = 0, far_f = 0;
  for (double x = 1e3; x < 1e9; x *= 1.1) {
    auto single = static_cast<float>(x);
    auto series = [](double y) {
      double z = 1 / (8 * y);
      return (1 + z * (1 + z * (4.5 + z * 37.5))) / std::sqrt(2 * pi * y);
    };
    far = larger_error(far, std::abs(bessel_i0e(x) / series(x) - 1));
    far_f = larger_error(far_f, std::abs(double(bessel_i0e(single)) / series(double(single)) - 1));
  }
  rows.push_back({"the same for x of 1e3 … 1e9 against the asymptotic series, double", "0",
                  fmt::format("{:.2g}", far), far, 1e-11});
  rows.push_back({"the same, float", "0", fmt::format("{:.2g}", far_f), far_f, 7e-7});
  auto step = [](auto at) {
    auto below = bessel_i0e(std::nextafter(at, decltype(at)(0)));
    return std::abs(double(below) / double(bessel_i0e(at)) - 1);
  };
  rows.push_back({"step of it at its switch, x = 8, double", "0", fmt::format("{:.2g}", step(8.0)),
                  step(8.0), 2e-15});
  rows.push_back({"step of it at its switch, x = 4, float", "0", fmt::format("{:.2g}", step(4.0f)),
                  step(4.0f), 5e-7});
}

void normalisation(std::vector<stress_row>& rows) {
  for (double beta : {min_roughness, 1e-3, 0.3, 1.0}) {
    auto bsdf = make_hair_bsdf<double>({1.55, beta, beta, 2, 3});
    furthest m, n;
    for (double theta : {-1.5707, -0.7, 0.0, 0.4, 1.5707963})
      for (double h : {-1.0, 0.3}) {
        auto hit = make_hair_hit<double>(bsdf, {0, 0, 0}, h, direction<double>(theta, 0));
        for (std::size_t p = 0; p <= 3; p++) {
          m.look(integral_of_mp(bsdf, hit, p));
          n.look(integral_of_np(bsdf, hit, p));
        }
      }
    rows.push_back(
        near(fmt::format("∫ M_p cos θ dθ, β_m = {}, worst of all lobes and θo to 90°", beta), 1,
             m.value, 1e-9));
    rows.push_back(
        near(fmt::format("∫ N_p dφ, β_n = {}, worst of all lobes and h", beta), 1, n.value, 1e-9));
  }
  // Where other renderers change from one form of M_p to another.
  auto mp = [](double v, double theta_i) {
    return longitudinal_mp(std::sin(theta_i), std::cos(theta_i), std::sin(0.4), std::cos(0.4),
                           1 / v, -1 / (v * std::expm1(-2 / v)));
  };
  double step = 0;
  for (double theta = -1.5; theta < 1.5; theta += 0.01)
    step = larger_error(step, std::abs(mp(std::nextafter(0.1, 0), theta) / mp(0.1, theta) - 1));
  rows.push_back({"step of M_p at v = 0.1", "0", fmt::format("{:.2g}", step), step, 1e-13});
}

void furnaces(std::vector<stress_row>& rows) {
  const std::array<double, 5> thetas = {-1.5707963, -1.2, 0, 0.6, 1.5707};
  const std::array<double, 5> hs = {-1, -0.6, 0, 0.999, 1};
  for (double alpha : {0.0, 2.0, -3.0})
    for (double beta : {0.001, 0.3, 1.0}) {
      furthest total;
      for (double eta : {1.0, 1.55, 3.0}) {
        auto bsdf = make_hair_bsdf<double>({eta, beta, beta, alpha, 3});
        for (double theta : thetas)
          for (double h : hs) {
            auto hit = make_hair_hit<double>(bsdf, {0, 0, 0}, h, direction<double>(theta, 0));
            auto [energy, pdf] = totals_by_lobes(bsdf, hit);
            total.look(energy);
            total.look(pdf);
          }
      }
      auto at = fmt::format("white furnace and ∫ pdf, α = {}°, β = {}", alpha, beta);
      rows.push_back(
          near(at + ", worst of θo to 90°, h to ±1, eta 1, 1.55, 3", 1, total.value, 1e-8));
      // And by whole directions, so that a lobe with another's place would be seen.
      auto bsdf = make_hair_bsdf<double>({1.55, beta, beta, alpha, 3});
      auto hit = make_hair_hit<double>(bsdf, {0, 0, 0}, 0.6, direction<double>(0.9, 0));
      auto [energy, pdf] = totals_by_directions(bsdf, hit);
      furthest whole;
      whole.look(energy);
      whole.look(pdf);
      rows.push_back(near(at + ", over the sphere, θo = 0.9, h = 0.6", 1, whole.value, 1e-7));
    }
  auto at = [&](const char* what, double eta, double sigma, double h, double theta) {
    auto bsdf = make_hair_bsdf<double>({eta, 0.3, 0.3, 2, 3});
    auto hit = make_hair_hit<double>(bsdf, glm::dvec3(sigma), h, direction<double>(theta, 0));
    rows.push_back(
        near(what, energy_of(eta, sigma, h, theta), totals_by_lobes(bsdf, hit).first, 1e-8));
  };
  at("energy, σ_a = 1e4: the reflection alone", 1.55, 1e4, 0.3, 0.4);
  at("energy, σ_a = 1e4, eta = 1: nothing", 1, 1e4, 0.3, 0.4);
  at("energy, σ_a = 1, h = 0.999999", 1.55, 1, 0.999999, 0.4);
  at("energy, σ_a = 1, θo = 1.5707 (grazing)", 1.55, 1, 0.3, 1.5707);
  at("energy, σ_a = 1, eta = 1", 1, 1, 0.3, 0.4);
  at("energy, σ_a = 1, eta = 3", 3, 1, 0.3, 0.4);
  at("energy, σ_a = 1e-9", 1.55, 1e-9, 0.3, 0.4);
}

}  // namespace

std::vector<stress_row> stress_hair(const stress_options& options) {
  std::vector<stress_row> rows;
  options.progress("hair: special functions and integrals");
  special_functions(rows);
  normalisation(rows);
  options.progress("hair: furnaces");
  furnaces(rows);
  options.progress("hair: samples");
  for (auto part : {stress_hair_samples, stress_hair_calls}) {
    auto more = part(options);
    rows.insert(rows.end(), more.begin(), more.end());
  }
  return rows;
}
