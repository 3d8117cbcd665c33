// Times wisp::hair beside pbrt's hair BSDF (pbrt_hair.h), one thread, in float, both
// compiled with the same flags. Every benchmark goes through the same table of
// random calls: 16 materials; directions, h and absorption differ from call to call.
// A table is printed in place of Google Benchmark's: nanoseconds per call, and how
// many times as fast as the baseline that is.
//
//   bench_hair [--benchmark_filter=REGEX] [other options of Google Benchmark]

#include <benchmark/benchmark.h>

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "pbrt_hair.h"
#include "support/table_reporter.h"
#include "wisp/core/rng.h"
#include "wisp/core/sampling.h"
#include "wisp/hair/bsdf.h"

namespace {

using namespace wisp;
using glm::vec2;
using glm::vec3;
using glm::vec4;

// Too many for the branch predictors to learn, few enough for the second cache,
// which fetches ahead as they are walked through in order.
constexpr std::size_t call_count = 4096;
constexpr std::size_t material_count = 16;

struct call {
  vec3 wo, wi, sigma_a;
  float h;
  vec4 u;
  std::size_t material;
};
struct tables {
  std::vector<hair::hair_parameters<float>> parameters;
  std::vector<hair::hair_bsdf<float>> bsdfs;
  std::vector<call> calls;
  std::vector<hair::hair_hit<float>> hits;
  std::vector<wisp_bench::pbrt_hair<float>> baseline;
};

wisp_bench::pbrt_hair<float> make_baseline(const hair::hair_parameters<float>& p, const call& c) {
  return wisp_bench::make_pbrt_hair(c.h, p.eta, c.sigma_a, p.beta_m, p.beta_n, p.alpha);
}

tables make_tables() {
  tables t;
  auto rng = make_rng(1);
  auto between = [&rng](float a, float b) { return a + (b - a) * rand1f(rng); };
  for (std::size_t k = 0; k < material_count; k++) {
    hair::hair_parameters<float> p;
    p.eta = between(1.4f, 1.7f);
    p.beta_m = between(0.1f, 0.6f);
    p.beta_n = between(0.1f, 0.6f);
    p.alpha = between(0, 4);
    t.parameters.push_back(p);
    t.bsdfs.push_back(hair::make_hair_bsdf(p));
  }
  for (std::size_t k = 0; k < call_count; k++) {
    call c;
    c.wo = sample_sphere({rand1f(rng), rand1f(rng)});
    c.wi = sample_sphere({rand1f(rng), rand1f(rng)});
    c.sigma_a = {between(0, 1), between(0, 2), between(0, 4)};
    c.h = between(-1, 1);
    c.u = {rand1f(rng), rand1f(rng), rand1f(rng), rand1f(rng)};
    c.material = rand_index(rng, material_count);
    t.calls.push_back(c);
    t.hits.push_back(hair::make_hair_hit(t.bsdfs[c.material], c.sigma_a, c.h, c.wo));
    t.baseline.push_back(make_baseline(t.parameters[c.material], c));
  }
  return t;
}

template <typename F>
void walk(benchmark::State& state, F&& one) {
  static const tables t = make_tables();
  std::size_t i = 0;
  for (auto _ : state) {
    auto result = one(t, i);
    benchmark::DoNotOptimize(result);
    i = (i + 1) % call_count;
  }
}

struct value_and_pdf {
  vec3 f;
  float pdf;
};

void wisp_bsdf(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    return hair::make_hair_bsdf(t.parameters[i % material_count]);
  });
}
void wisp_hit(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    const call& c = t.calls[i];
    return hair::make_hair_hit(t.bsdfs[c.material], c.sigma_a, c.h, c.wo);
  });
}
void wisp_eval(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    const call& c = t.calls[i];
    return hair::eval_hair_with_pdf(t.bsdfs[c.material], t.hits[i], c.wi);
  });
}
void wisp_hit_eval(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    const call& c = t.calls[i];
    const auto& bsdf = t.bsdfs[c.material];
    auto hit = hair::make_hair_hit(bsdf, c.sigma_a, c.h, c.wo);
    return hair::eval_hair_with_pdf(bsdf, hit, c.wi);
  });
}
void wisp_sample(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    const call& c = t.calls[i];
    return hair::sample_hair_with_pdf(t.bsdfs[c.material], t.hits[i], c.u);
  });
}
void wisp_hit_sample(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    const call& c = t.calls[i];
    const auto& bsdf = t.bsdfs[c.material];
    auto hit = hair::make_hair_hit(bsdf, c.sigma_a, c.h, c.wo);
    return hair::sample_hair_with_pdf(bsdf, hit, c.u);
  });
}

void pbrt_make(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    const call& c = t.calls[i];
    return make_baseline(t.parameters[c.material], c);
  });
}
template <typename Policy>
void pbrt_f(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    return wisp_bench::pbrt_f<Policy>(t.baseline[i], t.calls[i].wo, t.calls[i].wi);
  });
}
template <typename Policy>
void pbrt_f_pdf(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    const call& c = t.calls[i];
    value_and_pdf r;
    r.f = wisp_bench::pbrt_f<Policy>(t.baseline[i], c.wo, c.wi);
    r.pdf = wisp_bench::pbrt_pdf<Policy>(t.baseline[i], c.wo, c.wi);
    return r;
  });
}
template <typename Policy>
void pbrt_sample_v3(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    const call& c = t.calls[i];
    return wisp_bench::pbrt_sample_v3<Policy>(t.baseline[i], c.wo, vec2(c.u.x, c.u.y));
  });
}
template <typename Policy>
void pbrt_sample_v4(benchmark::State& state) {
  walk(state, [](const tables& t, std::size_t i) {
    const call& c = t.calls[i];
    return wisp_bench::pbrt_sample_v4<Policy>(t.baseline[i], c.wo, c.u.x, vec2(c.u.y, c.u.z));
  });
}

using wisp_bench::pbrt_fast_exp;
using wisp_bench::pbrt_published;

// `rival` names the baseline that does the same work, if one does.
struct entry {
  const char* name;
  void (*run)(benchmark::State&);
  const char* rival;
};
constexpr std::array entries = {
    entry{"wisp: make_hair_bsdf, once a material", wisp_bsdf, nullptr},
    entry{"wisp: make_hair_hit", wisp_hit, nullptr},
    entry{"wisp: value and pdf", wisp_eval, "pbrt: f, PDF"},
    entry{"wisp: make_hair_hit, value and pdf", wisp_hit_eval, "pbrt: f, PDF"},
    entry{"wisp: sample, value and pdf", wisp_sample, "pbrt: Sample_f, v4"},
    entry{"wisp: make_hair_hit, sample, value, pdf", wisp_hit_sample, "pbrt: Sample_f, v4"},
    entry{"pbrt: constructor", pbrt_make, nullptr},
    entry{"pbrt: f", pbrt_f<pbrt_published>, nullptr},
    entry{"pbrt: f, PDF", pbrt_f_pdf<pbrt_published>, nullptr},
    entry{"pbrt: Sample_f, v3", pbrt_sample_v3<pbrt_published>, nullptr},
    entry{"pbrt: Sample_f, v4", pbrt_sample_v4<pbrt_published>, nullptr},
    entry{"pbrt with fast exp: f", pbrt_f<pbrt_fast_exp>, nullptr},
    entry{"pbrt with fast exp: f, PDF", pbrt_f_pdf<pbrt_fast_exp>, nullptr},
    entry{"pbrt with fast exp: Sample_f, v4", pbrt_sample_v4<pbrt_fast_exp>, nullptr},
};

}  // namespace

int main(int argc, char** argv) {
  wisp_bench::table t;
  t.times = "CPU nanoseconds a call";
  t.ratios = "times as fast as pbrt (with fast exp)";
  for (const auto& e : entries) {
    benchmark::RegisterBenchmark(e.name, e.run);
    wisp_bench::table_row row = {e.name, {}};
    if (e.rival) row.rivals = {e.rival, "pbrt with fast exp" + std::string(e.rival).substr(4)};
    t.rows.push_back(std::move(row));
  }
  return wisp_bench::run_table(argc, argv, std::move(t));
}
