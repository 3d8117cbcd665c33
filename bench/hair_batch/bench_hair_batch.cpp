// Times wisp::hair_batch beside the scalar code of wisp::hair, one thread: value and
// pdf, and sample with value and pdf, both with the work of make_hair_hit, for each
// instruction set that this processor has and the library was compiled for. All go
// through the same table of random inputs. A table is printed in place of Google
// Benchmark's: nanoseconds per input, and how many times as fast as the scalar code.
//
//   bench_hair_batch [--benchmark_filter=REGEX] [other options of Google Benchmark]

#include <benchmark/benchmark.h>

#include <hwy/targets.h>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "support/table_reporter.h"
#include "wisp/core/rng.h"
#include "wisp/core/sampling.h"
#include "wisp/hair/bsdf.h"
#include "wisp/hair_batch/hair_batch.h"

namespace {

using namespace wisp;
using glm::vec3;
using glm::vec4;

// Inputs and outputs are about a megabyte: they stay in the second cache.
constexpr std::size_t input_count = 16384;

struct arrays3 {
  std::vector<float> x, y, z;
  arrays3() : x(input_count), y(input_count), z(input_count) {}
  hair::batch_in3 in() const { return {x, y, z}; }
  hair::batch_out3 out() { return {x, y, z}; }
  void set(std::size_t i, const vec3& v) { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
  vec3 get(std::size_t i) const { return {x[i], y[i], z[i]}; }
};

struct tables {
  hair::hair_bsdf<float> bsdf;
  arrays3 wo, wi, sigma_a, value, direction;
  std::vector<float> h, pdf;
  std::array<std::vector<float>, 4> u;

  vec4 numbers(std::size_t i) const { return {u[0][i], u[1][i], u[2][i], u[3][i]}; }
};

tables make_tables() {
  tables t;
  t.bsdf = hair::make_hair_bsdf(hair::hair_parameters<float>{});
  auto rng = make_rng(1);
  auto between = [&rng](float a, float b) { return a + (b - a) * rand1f(rng); };
  for (std::size_t i = 0; i < input_count; i++) {
    t.wo.set(i, sample_sphere({rand1f(rng), rand1f(rng)}));
    t.wi.set(i, sample_sphere({rand1f(rng), rand1f(rng)}));
    t.sigma_a.set(i, {between(0, 1), between(0, 2), between(0, 4)});
    t.h.push_back(between(-1, 1));
    for (auto& u : t.u) u.push_back(rand1f(rng));
  }
  t.pdf.resize(input_count);
  return t;
}
tables& data() {
  static tables t = make_tables();
  return t;
}

void scalar_eval(tables& t) {
  for (std::size_t i = 0; i < input_count; i++) {
    auto hit = hair::make_hair_hit(t.bsdf, t.sigma_a.get(i), t.h[i], t.wo.get(i));
    auto r = hair::eval_hair_with_pdf(t.bsdf, hit, t.wi.get(i));
    t.value.set(i, r.value);
    t.pdf[i] = r.pdf;
  }
}
void scalar_sample(tables& t) {
  for (std::size_t i = 0; i < input_count; i++) {
    auto hit = hair::make_hair_hit(t.bsdf, t.sigma_a.get(i), t.h[i], t.wo.get(i));
    auto r = hair::sample_hair_with_pdf(t.bsdf, hit, t.numbers(i));
    t.direction.set(i, r.direction);
    t.value.set(i, r.value);
    t.pdf[i] = r.pdf;
  }
}
void batch_eval(tables& t) {
  hair::hair_eval_inputs in;
  in.wo = t.wo.in();
  in.wi = t.wi.in();
  in.h = t.h;
  in.sigma_a.each = t.sigma_a.in();
  hair::eval_hair_batch(t.bsdf, in, {t.value.out(), t.pdf});
}
void batch_sample(tables& t) {
  hair::hair_sample_inputs in;
  in.wo = t.wo.in();
  in.h = t.h;
  in.sigma_a.each = t.sigma_a.in();
  in.u = {t.u[0], t.u[1], t.u[2], t.u[3]};
  hair::sample_hair_batch(t.bsdf, in, {t.direction.out(), t.value.out(), t.pdf});
}

// One program is timed with one instruction set after another.
void time_it(benchmark::State& state, void (*run)(tables&), std::int64_t target) {
  if (target != 0) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
  tables& t = data();
  for (auto _ : state) {
    run(t);
    benchmark::ClobberMemory();
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace

int main(int argc, char** argv) {
  wisp_bench::table t;
  t.times = "CPU nanoseconds per input";
  t.ratios = "times as fast as the scalar code";
  t.decimals = 1;
  t.calls_per_iteration = double(input_count);
  auto add = [&t](const std::string& what, const char* with, void (*run)(tables&),
                  std::int64_t target) {
    std::string name = what + ", " + with, scalar = what + ", scalar";
    wisp_bench::table_row row = {name, {}};
    if (name != scalar) row.rivals = {scalar};
    t.rows.push_back(std::move(row));
    benchmark::RegisterBenchmark(name.c_str(),
                                 [=](benchmark::State& state) { time_it(state, run, target); });
  };
  std::vector<std::pair<const char*, std::int64_t>> targets;
  for (std::int64_t all = hwy::SupportedTargets(); all != 0; all &= all - 1) {
    // Only those that the library was compiled for: it names what it chooses.
    std::int64_t one = all & -all;
    hwy::SetSupportedTargetsForTest(one);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    const char* name = hwy::TargetName(one);
    if (std::string(name) == hair::current_hair_batch_target().name) targets.push_back({name, one});
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  add("eval, pdf", "scalar", scalar_eval, 0);
  for (auto [name, target] : targets) add("eval, pdf", name, batch_eval, target);
  add("sample, value, pdf", "scalar", scalar_sample, 0);
  for (auto [name, target] : targets) add("sample, value, pdf", name, batch_sample, target);
  return wisp_bench::run_table(argc, argv, std::move(t));
}
