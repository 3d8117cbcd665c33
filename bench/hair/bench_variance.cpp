// The variance of one fibre's response at equal numbers of samples: wisp::hair's
// sampling beside the two choices that pbrt has published (pbrt_hair.h, with an
// exact Bessel function so that all estimate the same thing).
//
//   bench_hair_variance [SAMPLES]    samples of each small case, 4096 by default; words
//                                 with -- are for the other benchmarks
//
// What is estimated, for wo at several angles, several h and four colours of hair:
//   furnace   radiance 1 from everywhere, by sampling the BSDF;
//   lamp      a disc of 5 degrees at several places, found by sampling the BSDF;
//   mis       the same by one sample of the lamp and one of the BSDF, with the
//             power heuristic.
// "path" multiplies by a throughput such as a path has after passing through hair
// of that colour. Numbers are independent, or 16 points of a scrambled Sobol
// sequence at a time.
//
// The variance of a case is the sum of those of red, green and blue, and a row adds
// up its cases, as the squared RMSE over a picture does. A table shows it as a ratio
// to the better one of pbrt's, with the standard error of that ratio.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_hair.h"
#include "wisp/core/rng.h"
#include "wisp/core/sampler.h"
#include "wisp/core/statistics.h"
#include "wisp/hair/absorption.h"
#include "wisp/hair/bsdf.h"

namespace {

using namespace wisp;
using glm::dvec3;
using glm::vec2;
using glm::vec3;
using glm::vec4;

constexpr float pi_f = 3.14159265f;

// ------------------------------------------------------------------- methods

enum class method { wisp_luminance, wisp_throughput, pbrt_v3, pbrt_v4 };
constexpr std::array method_names = {"wisp", "wisp by throughput", "pbrt v3", "pbrt v4"};
constexpr std::size_t method_count = method_names.size();

struct fibre {
  hair::hair_parameters<float> parameters;
  vec3 sigma_a, throughput, wo;
  float h;
};

// A fibre as one of the methods sees it.
struct scatterer {
  method how;
  hair::hair_bsdf<float> bsdf;
  hair::hair_hit<float> hit;
  wisp_bench::pbrt_hair<float> pbrt;
  vec3 wo;
};
scatterer make_scatterer(method how, const fibre& f) {
  const auto& p = f.parameters;
  scatterer s;
  s.how = how;
  s.wo = f.wo;
  s.bsdf = hair::make_hair_bsdf(p);
  s.hit = how == method::wisp_throughput
              ? hair::make_hair_hit(s.bsdf, f.sigma_a, f.h, f.wo, f.throughput)
              : hair::make_hair_hit(s.bsdf, f.sigma_a, f.h, f.wo);
  s.pbrt = wisp_bench::make_pbrt_hair(f.h, p.eta, f.sigma_a, p.beta_m, p.beta_n, p.alpha);
  return s;
}

struct response {
  vec3 wi, f;
  float pdf;
};
response eval(const scatterer& s, const vec3& wi) {
  using namespace wisp_bench;
  switch (s.how) {
    case method::pbrt_v3:
      return {wi, pbrt_f<pbrt_exact>(s.pbrt, s.wo, wi),
              pbrt_pdf<pbrt_exact, weigh_by_luminance>(s.pbrt, s.wo, wi)};
    case method::pbrt_v4:
      return {wi, pbrt_f<pbrt_exact>(s.pbrt, s.wo, wi), pbrt_pdf<pbrt_exact>(s.pbrt, s.wo, wi)};
    default: {
      auto v = hair::eval_hair_with_pdf(s.bsdf, s.hit, wi);
      return {wi, v.value, v.pdf};
    }
  }
}
response sample(const scatterer& s, const vec4& u) {
  using namespace wisp_bench;
  auto of = [](const pbrt_hair_sample<float>& x) { return response{x.wi, x.f, x.pdf}; };
  switch (s.how) {
    case method::pbrt_v3:
      return of(pbrt_sample_v3<pbrt_exact>(s.pbrt, s.wo, vec2(u.x, u.y)));
    case method::pbrt_v4:
      return of(pbrt_sample_v4<pbrt_exact>(s.pbrt, s.wo, u.x, vec2(u.y, u.z)));
    default:
      return eval(s, hair::sample_hair(s.bsdf, s.hit, u));
  }
}

// ------------------------------------------------------------------ estimates

enum class light { furnace, lamp, mis };
constexpr std::array light_names = {"furnace", "lamp", "mis"};

struct lamp_disc {
  vec3 axis, x, y;
  float cos_angle, pdf;
};
lamp_disc make_lamp(const vec3& axis, float degrees) {
  lamp_disc lamp;
  lamp.axis = axis;
  vec3 other = std::abs(axis.x) < 0.5f ? vec3(1, 0, 0) : vec3(0, 1, 0);
  lamp.x = glm::normalize(glm::cross(axis, other));
  lamp.y = glm::cross(axis, lamp.x);
  lamp.cos_angle = std::cos(degrees * pi_f / 180);
  lamp.pdf = 1 / (2 * pi_f * (1 - lamp.cos_angle));
  return lamp;
}
vec3 sample_lamp(const lamp_disc& lamp, const vec2& u) {
  float c = 1 - u.x * (1 - lamp.cos_angle), s = std::sqrt((1 - c) * (1 + c)), phi = 2 * pi_f * u.y;
  return s * std::cos(phi) * lamp.x + s * std::sin(phi) * lamp.y + c * lamp.axis;
}

dvec3 weighed(const response& r, float weight) {
  if (!(r.pdf > 0)) return {0, 0, 0};
  return dvec3(r.f) * (double(weight) / double(r.pdf));
}
float power_heuristic(float a, float b) { return a * a / (a * a + b * b); }

dvec3 estimate(const scatterer& s, light kind, const lamp_disc& lamp, const vec4& u,
               const vec2& u_lamp) {
  auto r = sample(s, u);
  if (kind == light::furnace) return weighed(r, 1);
  // The integral over the lamp, in units of its solid angle.
  bool seen = glm::dot(r.wi, lamp.axis) >= lamp.cos_angle;
  if (kind == light::lamp) return seen ? weighed(r, lamp.pdf) : dvec3(0);
  dvec3 sum = seen ? weighed(r, lamp.pdf * power_heuristic(r.pdf, lamp.pdf)) : dvec3(0);
  auto direct = eval(s, sample_lamp(lamp, u_lamp));
  return sum + dvec3(direct.f) * double(power_heuristic(lamp.pdf, direct.pdf));
}

// ---------------------------------------------------------------------- cases

struct colour {
  const char* name;
  vec3 sigma_a;
};
std::vector<colour> make_colours() {
  auto melanin = [](float eumelanin, float pheomelanin) {
    return hair::sigma_a_from_melanin(eumelanin, pheomelanin);
  };
  return {{"blond", melanin(0.3f, 0)},
          {"red", melanin(0.2f, 1.2f)},
          {"brunette", melanin(1.3f, 0)},
          {"black", melanin(8, 0)}};
}

struct lit_fibre {
  fibre f;
  lamp_disc lamp;
};
std::vector<lit_fibre> make_cases(const vec3& sigma_a, light kind, bool path, float beta) {
  std::vector<lit_fibre> cases;
  // Lamps: in front, to the side, oblique from behind, behind; by azimuth from wo.
  std::vector<float> azimuths = {0, 75, 140, 180};
  if (kind == light::furnace) azimuths = {0};
  for (float theta : {0.0f, 30.0f, 60.0f, 80.0f})
    for (float h : {-0.9f, -0.4f, 0.0f, 0.6f, 0.95f})
      for (float azimuth : azimuths) {
        lit_fibre c;
        c.f.parameters.beta_m = c.f.parameters.beta_n = beta;
        c.f.sigma_a = sigma_a;
        c.f.throughput = path ? glm::exp(-2.0f * (sigma_a - sigma_a.x)) : vec3(1);
        c.f.h = h;
        float t = theta * pi_f / 180, phi = azimuth * pi_f / 180;
        c.f.wo = {std::sin(t), std::cos(t), 0};
        // Near the mirror cone, where the light is.
        float ti = -t * 0.9f;
        c.lamp = make_lamp(
            {std::sin(ti), std::cos(ti) * std::cos(phi), std::cos(ti) * std::sin(phi)}, 5);
        cases.push_back(c);
      }
  return cases;
}

constexpr std::uint32_t batch_count = 32;
struct method_result {
  std::array<double, batch_count> variance = {};  // mean over the cases
  std::vector<running_stats> red;                 // of each case, to compare the means
};

// The variance per sample, over `blocks` of `block` samples that are stratified
// together if block > 1.
method_result measure(method how, const std::vector<lit_fibre>& cases, light kind,
                      std::uint32_t samples, std::uint32_t block) {
  method_result result;
  for (std::size_t k = 0; k < cases.size(); k++) {
    const auto& c = cases[k];
    auto s = make_scatterer(how, c.f);
    std::uint32_t blocks = samples / block / batch_count;
    auto rng = make_rng(k, block);  // the same numbers for all methods
    running_stats red;
    for (std::uint32_t batch = 0; batch < batch_count; batch++) {
      std::array<running_stats, 3> stats;
      for (std::uint32_t b = 0; b < blocks; b++) {
        dvec3 mean = {0, 0, 0};
        auto seed = next_uint(rng);
        for (std::uint32_t i = 0; i < block; i++) {
          vec4 u, u_lamp;
          if (block > 1) {
            u = sample_4d({seed, i}, 0);
            u_lamp = sample_4d({seed, i}, 1);
          } else {
            u = {rand1f(rng), rand1f(rng), rand1f(rng), rand1f(rng)};
            u_lamp = {rand1f(rng), rand1f(rng), 0, 0};
          }
          mean += estimate(s, kind, c.lamp, u, vec2(u_lamp.x, u_lamp.y)) * dvec3(c.f.throughput);
        }
        mean /= double(block);
        for (int j = 0; j < 3; j++) add_sample(stats[std::size_t(j)], mean[j]);
        add_sample(red, mean.x);
      }
      for (const auto& channel : stats)
        result.variance[batch] += variance(channel) * block / double(cases.size());
    }
    result.red.push_back(red);
  }
  return result;
}

struct ratio {
  double value, error;
};
// Of two that were measured with the same numbers: what they share cancels.
ratio compare(const method_result& a, const method_result& b) {
  running_stats of_a, of_b, difference;
  for (double v : a.variance) add_sample(of_a, v);
  for (double v : b.variance) add_sample(of_b, v);
  double value = of_a.mean / of_b.mean;
  for (std::size_t k = 0; k < batch_count; k++)
    add_sample(difference, a.variance[k] - value * b.variance[k]);
  return {value, standard_error(difference) / of_b.mean};
}
double mean_variance(const method_result& r) {
  running_stats s;
  for (double v : r.variance) add_sample(s, v);
  return s.mean;
}

// What the rows say together.
struct summary {
  int rows = 0;
  int higher = 0;  // where ours is higher than pbrt's best by more than 3 standard errors
  // The largest difference of a case's mean to pbrt v4's, in standard errors.
  std::array<double, method_count> worst_z = {};
};

std::size_t index_of(method m) { return static_cast<std::size_t>(m); }

void print_row(const std::string& label, const std::array<method_result, method_count>& results,
               summary& all) {
  const auto &v3 = results[index_of(method::pbrt_v3)], &v4 = results[index_of(method::pbrt_v4)];
  const auto& best = mean_variance(v3) < mean_variance(v4) ? v3 : v4;
  fmt::print("{} {:12.4g}", label, mean_variance(best));
  for (std::size_t m = 0; m < method_count; m++) {
    auto r = compare(results[m], best);
    fmt::print(" {:>19}", fmt::format("{:.3f} +- {:.3f}", r.value, r.error));
    if (m == index_of(method::wisp_throughput) && r.value > 1 + 3 * r.error) all.higher++;
    for (std::size_t k = 0; k < results[m].red.size(); k++) {
      const auto &a = results[m].red[k], &b = v4.red[k];
      // Where there seems to be no noise there is the rounding of float, and a lobe so
      // rare that a run may miss it.
      double e = std::hypot(standard_error(a), standard_error(b), 5e-4 * b.mean);
      if (e > 0) all.worst_z[m] = std::max(all.worst_z[m], std::abs(a.mean - b.mean) / e);
    }
  }
  fmt::print("\n");
  std::fflush(stdout);
  all.rows++;
}

}  // namespace

int main(int argc, char** argv) {
  std::uint32_t samples = 4096;
  for (int i = 1; i < argc; i++) {
    if (std::string_view(argv[i]).starts_with("--")) continue;
    char* end = nullptr;
    long asked = std::strtol(argv[i], &end, 10);
    if (*end != 0 || asked < 2048 || asked > 1 << 24) {
      fmt::print(stderr, "usage: bench_hair_variance [SAMPLES]   (2048 to {})\n", 1 << 24);
      return 1;
    }
    samples = std::uint32_t(asked);
  }
  fmt::print("{:8} {:12} {:5} {:4} {:9} {:>12}", "light", "numbers", "path", "beta", "hair",
             "pbrt's best");
  for (const char* name : method_names) fmt::print(" {:>19}", name);
  fmt::print("\n");

  summary all;
  for (auto kind : {light::furnace, light::lamp, light::mis})
    for (std::uint32_t block : {1u, 16u})
      for (bool path : {false, true})
        for (float beta : {0.3f, 0.15f})
          for (const auto& colour : make_colours()) {
            auto cases = make_cases(colour.sigma_a, kind, path, beta);
            std::array<method_result, method_count> results;
            for (std::size_t m = 0; m < method_count; m++)
              results[m] = measure(method(m), cases, kind, samples, block);
            auto label = fmt::format("{:8} {:12} {:5} {:4} {:9}", light_names[std::size_t(kind)],
                                     block > 1 ? "Sobol, 16" : "independent", path ? "yes" : "no",
                                     beta, colour.name);
            print_row(label, results, all);
          }
  fmt::print(
      "wisp by throughput is higher than pbrt's best by 3 standard errors in {} of {} rows\n",
      all.higher, all.rows);
  fmt::print("largest difference of a case's mean to that of pbrt v4, in standard errors:");
  for (std::size_t m = 0; m < method_count; m++)
    fmt::print(" {} {:.1f}{}", method_names[m], all.worst_z[m], m + 1 < method_count ? "," : "\n");
}
