// Random calls of the hair model with parameters, directions and numbers at and
// near the ends of their ranges: no NaN, infinity or negative value, and float
// no further from double than wisp/hair/rounding.h says.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <mutex>

#include "stress_hair.h"
#include "wisp/core/parallel.h"
#include "wisp/core/rng.h"
#include "wisp/hair/rounding.h"

using namespace wisp;
using namespace wisp::hair;

namespace {

constexpr uint64_t block_size = 1 << 16;
constexpr int hits_per_material = 8;

// A source of values that are often the ends of their range.
struct hostile_rng {
  rng_state rng;
  float unit() { return rand1f(rng); }
  bool one_of(uint32_t n) { return rand_index(rng, n) == 0; }
  // 10^low .. 1, all magnitudes alike.
  float magnitude(float low) { return std::exp2(3.32192809f * low * unit()); }
  float pick(std::initializer_list<float> values) {
    return *(values.begin() + rand_index(rng, static_cast<uint32_t>(values.size())));
  }
  float beta() {
    return one_of(4) ? pick({0, 1e-4f, 0.999f, 1}) : one_of(3) ? magnitude(-5) : unit();
  }
  float number() { return one_of(8) ? pick({0, 0x1p-24f, 0.5f, 0x1.fffffep-1f}) : unit(); }
  float absorption() {
    return one_of(4) ? pick({0, 1e4f}) : one_of(3) ? unit() : 1e4f * magnitude(-12);
  }
  // From -1 to 1, its ends, and close to them.
  float offset() {
    float x = one_of(4) ? 1 - magnitude(-8) : one_of(8) ? pick({0, 1}) : unit();
    return one_of(2) ? -x : x;
  }
  glm::vec3 direction() {
    float x = offset(), phi = 2 * pi_v<float> * unit();
    if (one_of(16)) phi = pick({0, 0.5f, 1, 1.5f}) * pi_v<float>;
    float across = std::sqrt((1 - x) * (1 + x));
    if (across == 0 && one_of(2)) across = pick({1e-8f, 1e-14f, 1e-18f, 1e-25f});
    return {x, across * std::cos(phi), across * std::sin(phi)};
  }
};

struct material {
  hair_bsdf<float> single;
  hair_bsdf<double> twice;
};

hair_parameters<float> random_parameters(hostile_rng& rng) {
  hair_parameters<float> k;
  k.beta_m = rng.beta();
  k.beta_n = rng.beta();
  k.alpha = rng.one_of(3) ? rng.pick({0, 2, -3, 45, -90}) : 20 * rng.unit() - 10;
  k.eta = rng.one_of(3)   ? rng.pick({1, 1.55f, 3})
          : rng.one_of(3) ? 1 + rng.magnitude(-7)
                          : 1 + 2 * rng.unit();
  k.p_max = 1 + static_cast<int>(rand_index(rng.rng, max_p_max));
  if (rng.one_of(8)) k.coat = rng.beta();
  if (rng.one_of(8)) k.roughness[rand_index(rng.rng, 3)] = {rng.beta(), rng.beta()};
  if (rng.one_of(8))
    k.strength[rand_index(rng.rng, 3)] = glm::vec3(rng.pick({0, 0.5f, 1, 3}), rng.unit(), 1);
  return k;
}

// What one block of calls has found.
struct findings {
  uint64_t not_finite = 0, negative = 0, not_unit = 0, no_density = 0;
  double worst_value = 0, worst_pdf = 0, worst_weight = 0;

  template <typename T>
  void look(const glm::vec<3, T>& value, T pdf, bool drawn) {
    bool finite = std::isfinite(pdf), positive = pdf >= 0;
    for (int k = 0; k < 3; k++) {
      finite = finite && std::isfinite(value[k]);
      positive = positive && value[k] >= 0;
    }
    not_finite += !finite;
    negative += !positive && finite;
    no_density += drawn && !(pdf > 0);
  }
  void compare(const glm::vec3& value, float pdf, const hair_value<double>& exact,
               const hair_value<double>& bound) {
    for (int k = 0; k < 3; k++)
      worst_value =
          larger_error(worst_value, std::abs(double(value[k]) - exact.value[k]) / bound.value[k]);
    worst_pdf = larger_error(worst_pdf, std::abs(double(pdf) - exact.pdf) / bound.pdf);
  }
  void add(const findings& f) {
    not_finite += f.not_finite;
    negative += f.negative;
    not_unit += f.not_unit;
    no_density += f.no_density;
    worst_value = larger_error(worst_value, f.worst_value);
    worst_pdf = larger_error(worst_pdf, f.worst_pdf);
    worst_weight = larger_error(worst_weight, f.worst_weight);
  }
};

// A call: a hit, its value for a direction of its own, and a sample, whose
// direction is evaluated once more.
template <typename T>
findings extreme_calls(rng_state state, uint64_t calls) {
  findings found;
  hostile_rng rng{state};
  hair_bsdf<T> bsdf;
  for (uint64_t i = 0; i < calls; i++) {
    if (i % hits_per_material == 0) bsdf = make_hair_bsdf(convert<T>(random_parameters(rng)));
    glm::vec<3, T> sigma(rng.absorption(), rng.absorption(), rng.absorption()), weight(1);
    if (rng.one_of(8)) weight = {rng.pick({0, 1}), rng.unit(), rng.pick({0, 1e-20f, 1e6f})};
    auto hit = make_hair_hit<T>(bsdf, sigma, T(rng.offset()), rng.direction(), weight);
    auto f = eval_hair_with_pdf<T>(bsdf, hit, rng.direction());
    found.look<T>(f.value, f.pdf, false);
    hair_sample<T> sample;
    if (rng.one_of(2)) {
      glm::vec<4, T> u(rng.number(), rng.number(), rng.number(), rng.number());
      sample = sample_hair_with_pdf<T>(bsdf, hit, u);
    } else {
      glm::vec<2, T> u(rng.number(), rng.number());
      sample = sample_hair_with_pdf<T>(bsdf, hit, u);
    }
    found.look<T>(sample.value, sample.pdf, true);
    T length = glm::dot(sample.direction, sample.direction);
    found.not_unit += !(std::abs(length - 1) < T(4e-6));
    f = eval_hair_with_pdf<T>(bsdf, hit, sample.direction);
    found.look<T>(f.value, f.pdf, false);
  }
  return found;
}

// Float against double, in units of the bound with factor 1, of a direction and
// of a sample; and f / pdf of a fibre that absorbs nothing.
findings compared_calls(rng_state state, uint64_t calls) {
  findings found;
  hostile_rng rng{state};
  material m;
  hair_parameters<float> k;
  for (uint64_t i = 0; i < calls; i++) {
    if (i % hits_per_material == 0) {
      k = random_parameters(rng);
      m = {make_hair_bsdf(k), make_hair_bsdf(convert<double>(k))};
    }
    glm::vec3 sigma = {rng.absorption(), rng.absorption(), rng.absorption()};
    float h = rng.offset();
    glm::vec3 wo = rng.direction(), wi = rng.direction();
    auto hit = make_hair_hit<float>(m.single, sigma, h, wo);
    auto exact = make_hair_hit<double>(m.twice, glm::dvec3(sigma), h, glm::dvec3(wo));
    glm::vec4 u = {rng.number(), rng.number(), rng.number(), rng.number()};
    auto compare = [&](const glm::vec3& w, const glm::vec3& value, float pdf) {
      found.compare(value, pdf, eval_hair_with_pdf<double>(m.twice, exact, glm::dvec3(w)),
                    rounding_bound(m.twice, exact, glm::dvec3(w), 1));
    };
    auto f = eval_hair_with_pdf<float>(m.single, hit, wi);
    compare(wi, f.value, f.pdf);
    auto sample = sample_hair_with_pdf<float>(m.single, hit, u);
    f = eval_hair_with_pdf<float>(m.single, hit, sample.direction);
    compare(sample.direction, f.value, f.pdf);
    // At a pole a sample knows the azimuth that its direction has lost.
    if (sample.direction.y != 0 || sample.direction.z != 0)
      compare(sample.direction, sample.value, sample.pdf);
    if (!m.single.has_strength) {
      auto white = make_hair_hit<float>(m.single, glm::vec3(0), h, wo);
      sample = sample_hair_with_pdf<float>(m.single, white, u);
      // Further out, where no sample ever comes but at the ends of its numbers, a lobe
      // counts whose weight has no square in float.
      if (!(sample.pdf < 1e-9f))
        found.worst_weight = larger_error(
            found.worst_weight, std::abs(double(sample.value.y) / double(sample.pdf) - 1));
    }
  }
  return found;
}

template <typename F>
findings in_blocks(const stress_options& options, const char* what, uint64_t calls, uint64_t stream,
                   F&& f) {
  std::size_t blocks = (calls + block_size - 1) / block_size;
  std::vector<findings> found(blocks);
  std::mutex telling;
  std::size_t done = 0;
  parallel_for(blocks, options.threads, [&](std::size_t i) {
    uint64_t from = i * block_size;
    found[i] = f(make_rng(options.seed, (i << 2) + stream), std::min(block_size, calls - from));
    std::lock_guard lock(telling);
    options.progress(fmt::format("hair: random calls, {}, {} %", what, 100 * ++done / blocks));
  });
  findings all;
  for (const auto& one : found) all.add(one);
  return all;
}

stress_row count_row(std::string what, uint64_t calls, uint64_t count) {
  return {fmt::format("{}, {} calls", what, calls), "none", fmt::format("{}", count),
          static_cast<double>(count), 0};
}

}  // namespace

std::vector<stress_row> stress_hair_calls(const stress_options& options) {
  std::vector<stress_row> rows;
  auto count = [&](const std::string& type, uint64_t calls, const findings& f) {
    rows.push_back(count_row("NaN or infinite, " + type, calls, f.not_finite));
    rows.push_back(count_row("negative, " + type, calls, f.negative));
    rows.push_back(count_row("sampled direction not of unit length, " + type, calls, f.not_unit));
    rows.push_back(count_row("sample without density, " + type, calls, f.no_density));
  };
  count("float", options.calls,
        in_blocks(options, "float", options.calls, 0, extreme_calls<float>));
  uint64_t fewer = std::max<uint64_t>(1, options.calls / 20);
  count("double", fewer, in_blocks(options, "double", fewer, 1, extreme_calls<double>));

  auto f = in_blocks(options, "float against double", fewer, 2, compared_calls);
  auto among = fmt::format("largest of {} calls", fewer);
  auto compare = [&](const char* what, double worst) {
    rows.push_back(
        {fmt::format("{} in float against double, in units of the rounding bound, {}", what, among),
         "below 10", fmt::format("{:.3g}", worst), worst, 10});
  };
  compare("value", f.worst_value);
  compare("density", f.worst_pdf);
  rows.push_back({"f / pdf of a sample in float, σ_a = 0, where pdf is above 1e-9, " + among, "1",
                  fmt::format("1 ± {:.2g}", f.worst_weight), f.worst_weight, 1e-5});
  return rows;
}
