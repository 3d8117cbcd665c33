// Samples of the hair model against its density, where both are hard: narrow
// lobes, grazing light, the edge of the fibre, many lobes of little weight.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "stress_hair.h"
#include "stress_quadrature.h"
#include "wisp/core/rng.h"
#include "wisp/hair/bsdf.h"

using namespace wisp;
using namespace wisp::hair;

namespace {

constexpr double pi = pi_v<double>;
constexpr int sample_count = 200000;

struct setting {
  const char* name;
  hair_parameters<double> k;
  glm::dvec3 sigma;
  double h, theta_o;
};

template <typename T>
struct scene {
  hair_bsdf<T> bsdf;
  hair_hit<T> hit;
};
template <typename T>
scene<T> make(const setting& x) {
  scene<T> s;
  s.bsdf = make_hair_bsdf(convert<T>(x.k));
  s.hit = make_hair_hit<T>(s.bsdf, glm::vec<3, T>(x.sigma), T(x.h),
                           {T(std::sin(x.theta_o)), T(std::cos(x.theta_o)), T(0)});
  return s;
}

double peak_along(const scene<double>& s, std::size_t p) {
  return -std::atan2(s.hit.sin_theta_op[p], s.hit.cos_theta_op[p]);
}

// Edges of cells of theta and phi: some even ones, and some in every lobe.
struct cells {
  std::vector<double> theta, phi;
};
cells make_cells(const scene<double>& s) {
  cells c;
  for (int i = 0; i <= 8; i++) {
    c.theta.push_back(std::asin(0.25 * i - 1));
    c.phi.push_back(pi * (0.25 * i - 1));
  }
  auto last = static_cast<std::size_t>(s.bsdf.p_max);
  for (std::size_t p = 0; p <= last; p++)
    for (double d : {-2.0, -1.0, -0.3, 0.3, 1.0, 2.0}) {
      double x = peak_along(s, p) + d * std::sqrt(s.bsdf.v[p]);
      if (std::abs(x) < pi / 2) c.theta.push_back(x);
      if (p < last) c.phi.push_back(wrap_angle(s.hit.exit_phi[p] + 1.5 * d * s.bsdf.s[p]));
    }
  std::sort(c.theta.begin(), c.theta.end());
  std::sort(c.phi.begin(), c.phi.end());
  return c;
}
std::size_t cell_of(const std::vector<double>& edges, double x) {
  auto next = std::upper_bound(edges.begin() + 1, edges.end() - 1, x);
  return static_cast<std::size_t>(next - edges.begin()) - 1;
}

// The chances of the cells: within a lobe the angles are independent.
std::vector<double> chances(const scene<double>& s, const cells& c) {
  std::size_t rows = c.theta.size() - 1, columns = c.phi.size() - 1;
  std::vector<double> chance(rows * columns, 0), around(columns);
  auto last = static_cast<std::size_t>(s.bsdf.p_max);
  for (std::size_t p = 0; p <= last; p++) {
    double center = wrap_angle(s.hit.exit_phi[p]), width = p < last ? 0.5 * s.bsdf.s[p] : pi;
    std::vector<peak> peaks = {{center > 0 ? center - pi : center + pi, 1}};
    for (double turn : {-2 * pi, 0.0, 2 * pi}) peaks.push_back({center + turn, width});
    for (std::size_t j = 0; j < columns; j++)
      around[j] = integrate(c.phi[j], c.phi[j + 1], peaks, [&](double phi) {
        return azimuthal_np(phi - s.hit.exit_phi[p], s.bsdf.inv_s[p], s.bsdf.np_norm[p]);
      });
    for (std::size_t i = 0; i < rows; i++) {
      double along = integrate(
          c.theta[i], c.theta[i + 1], {{peak_along(s, p), 0.5 * std::sqrt(s.bsdf.v[p])}},
          [&](double t) {
            return std::cos(t) * longitudinal_mp(std::sin(t), std::cos(t), s.hit.sin_theta_op[p],
                                                 s.hit.cos_theta_op[p], s.bsdf.inv_v[p],
                                                 s.bsdf.mp_norm[p]);
          });
      for (std::size_t j = 0; j < columns; j++)
        chance[i * columns + j] += s.hit.ap[p].w * along * around[j];
    }
  }
  return chance;
}

// How many standard deviations the chi-square of counts lies above what is
// expected of it (the cube root of Wilson and Hilferty). Cells that expect fewer
// than 10 are joined.
double deviations(const std::vector<double>& counts, const std::vector<double>& chance) {
  double chi = 0, rest = 0, rest_expected = 0;
  int k = -1;
  auto add = [&](double count, double expected) {
    chi += (count - expected) * (count - expected) / expected;
    k++;
  };
  for (std::size_t i = 0; i < counts.size(); i++) {
    double expected = sample_count * chance[i];
    if (expected >= 10) {
      add(counts[i], expected);
    } else {
      rest += counts[i];
      rest_expected += expected;
    }
  }
  // Where next to nothing is expected a count is a fault.
  if (rest_expected >= 1e-3)
    add(rest, rest_expected);
  else if (rest > 0)
    return INFINITY;
  double w = 2.0 / (9 * k);
  return (std::cbrt(chi / k) - (1 - w)) / std::sqrt(w);
}

template <typename T>
stress_row chi_square(const setting& x, bool two, uint64_t seed, uint64_t stream) {
  auto exact = make<double>(x);
  auto s = make<T>(x);
  auto c = make_cells(exact);
  auto chance = chances(exact, c);
  std::vector<double> counts(chance.size(), 0);
  auto rng = make_rng(seed, stream);
  auto number = [&] { return static_cast<T>(sizeof(T) == 4 ? double(rand1f(rng)) : rand1d(rng)); };
  for (int i = 0; i < sample_count; i++) {
    T a = number(), b = number(), d = number(), e = number();
    auto wi = glm::dvec3(two ? sample_hair<T>(s.bsdf, s.hit, glm::vec<2, T>(a, b))
                             : sample_hair<T>(s.bsdf, s.hit, glm::vec<4, T>(a, b, d, e)));
    double theta = std::atan2(wi.x, std::hypot(wi.y, wi.z)), phi = std::atan2(wi.z, wi.y);
    counts[cell_of(c.theta, theta) * (c.phi.size() - 1) + cell_of(c.phi, phi)]++;
  }
  double off = deviations(counts, chance);
  return {fmt::format("chi-square of {} samples in {} cells, {}, {}, {} numbers", sample_count,
                      chance.size(), x.name, sizeof(T) == 4 ? "float" : "double", two ? 2 : 4),
          "below 5 σ", fmt::format("{:.2f} σ", off), std::max(0.0, off), 5};
}

}  // namespace

// A false alarm has a chance of 3e-7 in each.
std::vector<stress_row> stress_hair_samples(const stress_options& options) {
  const std::vector<setting> settings = {
      {"β = 0.02, h = 1, θo = −0.5", {1.55, 0.02, 0.02, 2, 3}, {0.3, 1, 0}, 1, -0.5},
      {"β = 0.3, eta = 3, θo = 1.57", {3, 0.3, 0.3, -3, 6}, {0.1, 0, 0}, -0.7, 1.57},
      {"β_m = 1, β_n = 0.1, eta = 1.01, h = 0.99", {1.01, 1, 0.1, 10, 3}, {2, 0, 1}, 0.99, 0.3},
  };
  std::vector<stress_row> rows;
  uint64_t stream = uint64_t(1) << 62;  // away from those of the random calls
  for (const auto& x : settings)
    for (bool two : {false, true}) {
      rows.push_back(chi_square<float>(x, two, options.seed, stream++));
      rows.push_back(chi_square<double>(x, two, options.seed, stream++));
    }
  for (double beta : {min_roughness, 1e-3}) {
    setting x = {"", {1.55, beta, beta, 2, 3}, {0.3, 1, 0}, -1, 0.7};
    auto name = fmt::format("β = {}, h = −1", beta);
    x.name = name.c_str();
    rows.push_back(chi_square<double>(x, beta < 1e-3, options.seed, stream++));
  }
  return rows;
}
