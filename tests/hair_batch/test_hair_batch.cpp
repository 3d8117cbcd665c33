#include <doctest/doctest.h>

#include <hwy/targets.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/core/sampling.h"
#include "wisp/hair/bsdf.h"
#include "wisp/hair_batch/hair_batch.h"

using namespace wisp;
using namespace wisp::hair;
using glm::dvec3;
using glm::dvec4;
using glm::vec3;
using glm::vec4;

namespace {

struct arrays3 {
  std::vector<float> x, y, z;
  arrays3() = default;
  explicit arrays3(std::size_t n) : x(n), y(n), z(n) {}
  void push(const vec3& v) { x.push_back(v.x), y.push_back(v.y), z.push_back(v.z); }
  vec3 get(std::size_t i) const { return {x[i], y[i], z[i]}; }
  batch_in3 in() const { return {x, y, z}; }
  batch_out3 out() { return {x, y, z}; }
};

struct inputs {
  arrays3 wo, wi, sigma_a, weight;
  std::vector<float> h;
  std::array<std::vector<float>, 4> u;
  std::size_t size() const { return h.size(); }
  vec4 numbers(std::size_t i) const { return {u[0][i], u[1][i], u[2][i], u[3][i]}; }

  hair_eval_inputs eval() const {
    hair_eval_inputs in;
    in.wo = wo.in();
    in.wi = wi.in();
    in.h = h;
    in.sigma_a.each = sigma_a.in();
    in.channel_weight.each = weight.in();
    return in;
  }
  hair_sample_inputs sample() const {
    hair_sample_inputs in;
    in.wo = wo.in();
    in.h = h;
    in.sigma_a.each = sigma_a.in();
    in.channel_weight.each = weight.in();
    in.u = {u[0], u[1], u[2], u[3]};
    return in;
  }
};
struct outputs {
  arrays3 direction, value;
  std::vector<float> pdf;
  explicit outputs(std::size_t n) : direction(n), value(n), pdf(n) {}
  hair_eval_outputs eval() { return {value.out(), pdf}; }
  hair_sample_outputs sample() { return {direction.out(), value.out(), pdf}; }
};
outputs eval(const hair_bsdf<float>& bsdf, const inputs& in) {
  outputs out(in.size());
  eval_hair_batch(bsdf, in.eval(), out.eval());
  return out;
}
outputs sample(const hair_bsdf<float>& bsdf, const inputs& in) {
  outputs out(in.size());
  sample_hair_batch(bsdf, in.sample(), out.sample());
  return out;
}
bool same(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}
bool same(const arrays3& a, const arrays3& b) {
  return same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z);
}
bool same(const outputs& a, const outputs& b) {
  return same(a.direction, b.direction) && same(a.value, b.value) && same(a.pdf, b.pdf);
}

void choose(std::int64_t targets) {
  hwy::SetSupportedTargetsForTest(targets);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}
// Calls f for every instruction set that the library has code for and that this
// processor has.
template <typename F>
int for_each_target(F&& f) {
  choose(0);
  int count = 0;
  for (std::int64_t all = hwy::SupportedTargets(); all != 0; all &= all - 1) {
    choose(all & -all);
    auto target = current_hair_batch_target();
    std::string name = target.name;
    if (name != hwy::TargetName(all & -all)) continue;
    CAPTURE(name);
    f(target);
    count++;
  }
  choose(0);
  return count;
}

inputs typical_inputs(std::size_t n, std::uint64_t seed) {
  inputs in;
  auto rng = make_rng(seed);
  auto between = [&rng](float a, float b) { return a + (b - a) * rand1f(rng); };
  for (std::size_t i = 0; i < n; i++) {
    in.wo.push(sample_sphere({rand1f(rng), rand1f(rng)}));
    in.wi.push(sample_sphere({rand1f(rng), rand1f(rng)}));
    in.h.push_back(between(-1, 1));
    in.sigma_a.push({between(0, 1), between(0, 2), between(0, 4)});
    in.weight.push({between(0, 1), between(0, 1), between(0, 1)});
    for (auto& u : in.u) u.push_back(rand1f(rng));
  }
  return in;
}
// Each number is an extreme one now and then.
inputs extreme_inputs(std::size_t n, std::uint64_t seed) {
  inputs in = typical_inputs(n, seed);
  auto rng = make_rng(seed + 1);
  auto one_of = [&rng](auto... xs) {
    std::array<float, sizeof...(xs)> a = {float(xs)...};
    return a[rand_index(rng, sizeof...(xs))];
  };
  auto often = [&rng] { return rand1f(rng) < 0.3f; };
  auto pole = [&](arrays3& a, std::size_t i) {
    float across = one_of(0, 0, 1e-20, 1e-7, 1e-3, 0.01);
    float phi = 6.28f * rand1f(rng);
    a.x[i] = one_of(-1, 1) * std::sqrt(1 - across * across);
    a.y[i] = across * std::cos(phi);
    a.z[i] = across * std::sin(phi);
  };
  for (std::size_t i = 0; i < n; i++) {
    if (often()) pole(in.wo, i);
    if (often()) pole(in.wi, i);
    if (often()) {  // mirror and forward directions
      float s = one_of(-1, 1), t = one_of(-1, 1);
      in.wi.x[i] = -in.wo.x[i], in.wi.y[i] = s * in.wo.y[i], in.wi.z[i] = t * in.wo.z[i];
    }
    if (often()) in.h[i] = one_of(-1, 1, 0, -0.9999999, 0.999, 1e-20);
    if (often()) {
      in.sigma_a.x[i] = one_of(0, 1e-20, 1e-6, 1e4);
      in.sigma_a.y[i] = one_of(0, 1e-3, 30, 1e4);
      in.sigma_a.z[i] = one_of(0, 100, 1e4);
    }
    if (often()) {
      in.weight.x[i] = one_of(0, 1);
      in.weight.y[i] = one_of(0, 1e-6);
      in.weight.z[i] = one_of(0, 1e3);
    }
    for (auto& u : in.u)
      if (often()) u[i] = one_of(0, 0.5, 0.99999994, 1e-30, 1e-7);
  }
  return in;
}

hair_parameters<float> random_material(rng_state& rng, bool extreme) {
  auto between = [&rng](float a, float b) { return a + (b - a) * rand1f(rng); };
  hair_parameters<float> p;
  p.eta = extreme ? between(1.05f, 3) : between(1.3f, 1.8f);
  auto beta = [&] { return extreme ? std::pow(10.0f, between(-4.2f, 0)) : between(0.1f, 0.8f); };
  p.beta_m = beta();
  p.beta_n = beta();
  p.alpha = between(-5, 5);
  p.p_max = 1 + int(rand_index(rng, max_p_max));
  if (rand1f(rng) < 0.3f) p.coat = rand1f(rng);
  if (rand1f(rng) < 0.3f)
    for (auto& s : p.strength) s = {between(0, 1), between(0, 2), between(0, 1)};
  if (rand1f(rng) < 0.2f)
    for (auto& r : p.roughness) r = {beta(), beta()};
  return p;
}

// The same numbers in double.
hair_bsdf<double> widen(const hair_bsdf<float>& a) {
  hair_bsdf<double> b;
  b.eta = a.eta;
  b.p_max = a.p_max;
  b.has_strength = a.has_strength;
  for (std::size_t i = 0; i < lobe_room; i++) {
    b.v[i] = a.v[i], b.inv_v[i] = a.inv_v[i];
    b.exp_m2_over_v[i] = a.exp_m2_over_v[i], b.mp_norm[i] = a.mp_norm[i];
    b.sin_tilt[i] = a.sin_tilt[i], b.cos_tilt[i] = a.cos_tilt[i];
    b.s[i] = a.s[i], b.inv_s[i] = a.inv_s[i];
    b.np_norm[i] = a.np_norm[i], b.logistic_cdf_a[i] = a.logistic_cdf_a[i];
  }
  for (std::size_t i = 0; i < 3; i++) b.strength[i] = a.strength[i];
  return b;
}

struct reference_input {
  dvec3 wo, wi, sigma_a, weight;
  double h;
};
dvec4 reference(const hair_bsdf<double>& bsdf, const reference_input& in) {
  auto hit = make_hair_hit(bsdf, in.sigma_a, in.h, in.wo, in.weight);
  auto r = eval_hair_with_pdf(bsdf, hit, in.wi);
  return {r.value, r.pdf};
}
// The error that the header promises: of each lobe, and of what rounded inputs do.
// `ok_pdf` says whether the weights are within what a float holds when squared.
dvec4 allowed_error(const hair_bsdf<double>& bsdf, const reference_input& in, bool& ok_pdf) {
  auto hit = make_hair_hit(bsdf, in.sigma_a, in.h, in.wo, in.weight);
  double sin_i = std::clamp(in.wi.x, -1.0, 1.0);
  double cos_i = std::min(1.0, std::hypot(in.wi.y, in.wi.z));
  double phi = detail::angle_of(in.wi.z * hit.cos_phi_o - in.wi.y * hit.sin_phi_o,
                                in.wi.y * hit.cos_phi_o + in.wi.z * hit.sin_phi_o);
  lobe_array<double> mn;
  dvec4 error(0);
  double weights = 0;
  for (std::size_t p = 0; p <= std::size_t(bsdf.p_max); p++) {
    detail::eval_mn<double>(bsdf, hit, sin_i, cos_i, phi, p, mn);
    double relative =
        1e-6 * (4 + 2 * double(p) + 1 / std::sqrt(bsdf.v[p]) + (1 + double(p)) * bsdf.inv_s[p]);
    error += hit.ap[p] * mn[p] * relative + bsdf.mp_norm[p] * bsdf.np_norm[p] * 1e-36;
    double weight = glm::length(dvec3(hit.ap[p]) * in.weight);
    if (weight < 1e-18) error.w += hit.ap[p].w * mn[p];
    weights += weight;
  }
  ok_pdf = weights > 1e-12;
  constexpr double change = 2e-7;
  dvec4 here = reference(bsdf, in);
  auto add = [&](double reference_input::*member, dvec3 reference_input::*member3, int k) {
    dvec4 most(0);
    for (double sign : {-1.0, 1.0}) {
      auto other = in;
      if (member != nullptr)
        other.*member = std::clamp(other.*member + sign * change, -1.0, 1.0);
      else if (member3 == &reference_input::sigma_a)
        other.sigma_a *= 1 + sign * 2 * change;
      else
        (other.*member3)[k] += sign * change;
      most = glm::max(most, glm::abs(reference(bsdf, other) - here));
    }
    error += most;
  };
  add(&reference_input::h, nullptr, 0);
  add(nullptr, &reference_input::sigma_a, 0);
  for (int k = 0; k < 3; k++) {
    add(nullptr, &reference_input::wo, k);
    add(nullptr, &reference_input::wi, k);
  }
  return error;
}

// The largest error in units of the allowed one; -1 for NaN, infinity or a negative number.
double worst_error(const hair_bsdf<float>& bsdf, const inputs& in, const arrays3& wi,
                   const outputs& out, const std::vector<char>& skip = {}) {
  auto wide = widen(bsdf);
  double worst = 0;
  for (std::size_t i = 0; i < in.size(); i++) {
    dvec4 got = {dvec3(out.value.get(i)), out.pdf[i]};
    for (int k = 0; k < 4; k++)
      if (!(got[k] >= 0 && std::isfinite(got[k]))) return -1;
    if (!skip.empty() && skip[i]) continue;
    // Along the fibre there is no azimuth; signs of zeros make one up.
    if (wi.y[i] == 0 && wi.z[i] == 0) continue;
    reference_input ref = {in.wo.get(i), wi.get(i), in.sigma_a.get(i), in.weight.get(i), in.h[i]};
    bool ok_pdf = true;
    dvec4 error = allowed_error(wide, ref, ok_pdf);
    dvec4 ratio = glm::abs(got - reference(wide, ref)) / error;
    for (int k = 0; k < (ok_pdf ? 4 : 3); k++) worst = std::max(worst, ratio[k]);
  }
  return worst;
}

}  // namespace

TEST_CASE("hair_batch: values and densities against double, on every target") {
  int count = for_each_target([](hair_batch_target) {
    auto rng = make_rng(11);
    for (bool extreme : {false, true}) {
      double worst = 0;
      for (std::uint64_t k = 0; k < 40; k++) {
        auto bsdf = make_hair_bsdf(random_material(rng, extreme));
        auto in = extreme ? extreme_inputs(67, k) : typical_inputs(67, k);
        double error = worst_error(bsdf, in, in.wi, eval(bsdf, in));
        CHECK(error >= 0);
        worst = std::max(worst, error);
      }
      CAPTURE(extreme);
      CHECK(worst <= 1);
      MESSAGE(std::string(current_hair_batch_target().name) << ", error over bound: " << worst);
    }
  });
  CHECK(count >= 1);
}

TEST_CASE("hair_batch: samples against double, on every target") {
  for_each_target([](hair_batch_target) {
    auto rng = make_rng(12);
    for (bool extreme : {false, true}) {
      double worst = 0, length = 0;
      for (std::uint64_t k = 0; k < 40; k++) {
        auto bsdf = make_hair_bsdf(random_material(rng, extreme));
        auto in = extreme ? extreme_inputs(67, 100 + k) : typical_inputs(67, 100 + k);
        auto out = sample(bsdf, in);
        // At a pole the direction does not tell the azimuth that it was drawn with.
        std::vector<char> skip;
        for (std::size_t i = 0; i < in.size(); i++) {
          dvec3 d = out.direction.get(i);
          skip.push_back(std::hypot(d.y, d.z) < 1e-4);
          length = std::max(length, std::abs(glm::length(d) - 1));
        }
        double error = worst_error(bsdf, in, out.direction, out, skip);
        CHECK(error >= 0);
        worst = std::max(worst, error);
      }
      CAPTURE(extreme);
      CHECK(worst <= 1);
      CHECK(length < 3e-6);
      MESSAGE(std::string(current_hair_batch_target().name) << ", error over bound: " << worst);
    }
  });
}

TEST_CASE("hair_batch: samples go where the scalar code sends them") {
  for_each_target([](hair_batch_target) {
    auto rng = make_rng(13);
    std::size_t far = 0, all = 0;
    for (std::uint64_t k = 0; k < 60; k++) {
      auto bsdf = make_hair_bsdf(random_material(rng, false));
      auto in = typical_inputs(200, 200 + k);
      auto out = sample(bsdf, in);
      for (std::size_t i = 0; i < in.size(); i++) {
        auto hit = make_hair_hit(bsdf, in.sigma_a.get(i), in.h[i], in.wo.get(i), in.weight.get(i));
        auto d = sample_hair(bsdf, hit, in.numbers(i));
        if (glm::length(d - out.direction.get(i)) > 2e-5f) far++;
        all++;
      }
    }
    CHECK(far <= all / 200);
  });
}

TEST_CASE("hair_batch: the scalar code in float, for materials as they are used") {
  for_each_target([](hair_batch_target) {
    auto rng = make_rng(14);
    double worst = 0;
    for (std::uint64_t k = 0; k < 60; k++) {
      auto bsdf = make_hair_bsdf(random_material(rng, false));
      auto in = typical_inputs(200, 300 + k);
      auto out = eval(bsdf, in);
      for (std::size_t i = 0; i < in.size(); i++) {
        auto hit = make_hair_hit(bsdf, in.sigma_a.get(i), in.h[i], in.wo.get(i), in.weight.get(i));
        auto r = eval_hair_with_pdf(bsdf, hit, in.wi.get(i));
        vec4 a(r.value, r.pdf), b(out.value.get(i), out.pdf[i]);
        // Absolute below a millionth: there a lobe's far tail is all that is left.
        for (int n = 0; n < 4; n++)
          worst = std::max(worst, double(std::abs(a[n] - b[n]) / std::max(a[n], 1e-6f)));
      }
    }
    CHECK(worst < 1e-4);
    MESSAGE(std::string(current_hair_batch_target().name)
            << ", largest relative difference: " << worst);
  });
}

TEST_CASE("hair_batch: no NaN, infinity or negative number at the ends of the parameters") {
  for_each_target([](hair_batch_target) {
    bool good = true;
    std::uint64_t seed = 0;
    for (float beta_m : {0.0f, 1e-4f, 0.3f, 1.0f})
      for (float beta_n : {0.0f, 1e-4f, 0.3f, 1.0f})
        for (float eta : {1.0f, 1.0001f, 1.55f, 3.0f})
          for (int p_max : {1, 2, 3, 6}) {
            hair_parameters<float> p;
            p.beta_m = beta_m;
            p.beta_n = beta_n;
            p.eta = eta;
            p.p_max = p_max;
            auto bsdf = make_hair_bsdf(p);
            auto in = extreme_inputs(33, seed++);
            auto fine = [](float x) { return x >= 0 && std::isfinite(x); };
            for (bool drawn : {false, true}) {
              auto out = drawn ? sample(bsdf, in) : eval(bsdf, in);
              for (const auto* a : {&out.value.x, &out.value.y, &out.value.z, &out.pdf})
                good = good && std::all_of(a->begin(), a->end(), fine);
              for (std::size_t i = 0; drawn && i < in.size(); i++)
                good = good && std::abs(glm::length(out.direction.get(i)) - 1) < 1e-5f;
            }
          }
    CHECK(good);
  });
}

TEST_CASE(
    "hair_batch: targets agree to the last bit, those with fused multiply-add and those without") {
  auto rng = make_rng(15);
  auto bsdf = make_hair_bsdf(random_material(rng, false));
  auto in = extreme_inputs(1000, 5);
  std::vector<outputs> fused, plain;
  for_each_target([&](hair_batch_target target) {
    std::string name = target.name;
    bool has_fma = name.find("AVX") == 0 || name.find("NEON") == 0;
    auto& results = has_fma ? fused : plain;
    results.push_back(eval(bsdf, in));
    results.push_back(sample(bsdf, in));
  });
  for (const auto& results : {fused, plain})
    for (std::size_t i = 2; i < results.size(); i++) CHECK(same(results[i], results[i % 2]));
}

TEST_CASE(
    "hair_batch: an input's result depends neither on its place nor on the number of inputs") {
  auto rng = make_rng(16);
  auto bsdf = make_hair_bsdf(random_material(rng, false));
  auto in = typical_inputs(70, 6);
  for_each_target([&](hair_batch_target) {
    auto all_eval = eval(bsdf, in), all_sample = sample(bsdf, in);
    for (std::size_t n = 0; n <= 35; n++) {
      // From an odd place on, so that nothing is aligned.
      std::size_t first = n % 7 + 1;
      auto part = [&](const std::vector<float>& a) {
        return std::span<const float>(a).subspan(first, n);
      };
      auto part3 = [&](const arrays3& a) { return batch_in3{part(a.x), part(a.y), part(a.z)}; };
      constexpr float untouched = -7;
      std::array<std::vector<float>, 7> got;
      for (auto& a : got) a.assign(n + 4, untouched);
      auto to = [&](std::size_t k) { return std::span<float>(got[k]).subspan(1, n); };
      auto check = [&](const outputs& all, bool with_direction) {
        const std::vector<float>* wanted[] = {&all.value.x,    &all.value.y,     &all.value.z,
                                              &all.pdf,        &all.direction.x, &all.direction.y,
                                              &all.direction.z};
        for (std::size_t k = 0; k < (with_direction ? 7u : 4u); k++) {
          bool good = got[k][0] == untouched;
          for (std::size_t i = 0; i < n; i++)
            good = good && got[k][i + 1] == (*wanted[k])[first + i];
          for (std::size_t i = n + 1; i < n + 4; i++) good = good && got[k][i] == untouched;
          CAPTURE(n);
          CAPTURE(k);
          CHECK(good);
        }
      };
      hair_eval_inputs e;
      e.wo = part3(in.wo), e.wi = part3(in.wi), e.h = part(in.h);
      e.sigma_a.each = part3(in.sigma_a), e.channel_weight.each = part3(in.weight);
      eval_hair_batch(bsdf, e, {{to(0), to(1), to(2)}, to(3)});
      if (n > 0) check(all_eval, false);
      hair_sample_inputs s;
      s.wo = part3(in.wo), s.h = part(in.h);
      s.sigma_a.each = part3(in.sigma_a), s.channel_weight.each = part3(in.weight);
      for (std::size_t k = 0; k < 4; k++) s.u[k] = part(in.u[k]);
      sample_hair_batch(bsdf, s, {{to(4), to(5), to(6)}, {to(0), to(1), to(2)}, to(3)});
      if (n > 0) check(all_sample, true);
    }
  });
}

TEST_CASE("hair_batch: constant colours are what arrays of them are") {
  auto bsdf = make_hair_bsdf(hair_parameters<float>{});
  auto in = typical_inputs(50, 8);
  vec3 sigma_a(0.3f, 0.8f, 2.0f), weight(1, 0.5f, 0.2f);
  in.sigma_a = in.weight = {};
  for (std::size_t i = 0; i < in.size(); i++) in.sigma_a.push(sigma_a), in.weight.push(weight);
  auto e = in.eval();
  e.sigma_a = {sigma_a, {}};
  e.channel_weight = {weight, {}};
  outputs constant(in.size());
  eval_hair_batch(bsdf, e, constant.eval());
  CHECK(same(constant, eval(bsdf, in)));

  // And by default the weights are those of make_hair_hit.
  e.channel_weight = hair_eval_inputs{}.channel_weight;
  eval_hair_batch(bsdf, e, constant.eval());
  for (std::size_t i = 0; i < in.size(); i++) {
    auto hit = make_hair_hit(bsdf, sigma_a, in.h[i], in.wo.get(i));
    CHECK(constant.pdf[i] ==
          doctest::Approx(sample_hair_pdf(bsdf, hit, in.wi.get(i))).epsilon(1e-4));
  }
}

TEST_CASE("hair_batch: samples add up to the energy and the moments of what is evaluated") {
  constexpr std::size_t n = 100000;
  for (float beta : {0.15f, 0.5f}) {
    hair_parameters<float> p;
    p.beta_m = p.beta_n = beta;
    auto bsdf = make_hair_bsdf(p);
    auto in = typical_inputs(n, 21);
    vec3 wo = glm::normalize(vec3(0.4f, 0.3f, 0.8f)), sigma_a(0, 0.3f, 1.5f);
    std::fill(in.h.begin(), in.h.end(), 0.45f);
    for (std::size_t i = 0; i < n; i++) {
      in.wo.x[i] = wo.x, in.wo.y[i] = wo.y, in.wo.z[i] = wo.z;
      in.sigma_a.x[i] = sigma_a.x, in.sigma_a.y[i] = sigma_a.y, in.sigma_a.z[i] = sigma_a.z;
    }
    auto hit = make_hair_hit(bsdf, sigma_a, 0.45f, wo);
    dvec3 energy(0);
    for (std::size_t k = 0; k <= std::size_t(bsdf.p_max); k++) energy += dvec3(hit.ap[k]);
    auto drawn = sample(bsdf, in);
    auto even = eval(bsdf, in);  // wi evenly over the sphere

    // Means and their standard errors, of value by both, and of value times a direction.
    auto compare = [&](auto&& of_drawn, auto&& of_even, double wanted) {
      double s = 0, s2 = 0, t = 0, t2 = 0;
      for (std::size_t i = 0; i < n; i++) {
        double a = of_drawn(i), b = of_even(i);
        s += a, s2 += a * a, t += b, t2 += b * b;
      }
      double ms = s / n, mt = t / n;
      double es = std::sqrt((s2 / n - ms * ms) / n), et = std::sqrt((t2 / n - mt * mt) / n);
      CHECK(std::abs(ms - mt) < 4.5 * std::hypot(es, et));
      if (wanted >= 0) CHECK(std::abs(ms - wanted) < 4.5 * es + 1e-5);
    };
    double area = 4 * pi_v<double>;
    for (int c = 0; c < 3; c++) {
      auto value = [c](const outputs& o, std::size_t i) { return double(o.value.get(i)[c]); };
      compare([&](std::size_t i) { return value(drawn, i) / drawn.pdf[i]; },
              [&](std::size_t i) { return value(even, i) * area; }, energy[c]);
      for (int axis = 0; axis < 3; axis++)
        compare(
            [&](std::size_t i) {
              return value(drawn, i) / drawn.pdf[i] * drawn.direction.get(i)[axis];
            },
            [&](std::size_t i) { return value(even, i) * area * in.wi.get(i)[axis]; }, -1);
    }
    compare([](std::size_t) { return 1.0; }, [&](std::size_t i) { return even.pdf[i] * area; }, 1);
  }
}

TEST_CASE("hair_batch: lobes of no strength are never drawn, at the ends of the numbers either") {
  // Of TT alone; a draw from another lobe would land where TT gives nothing.
  hair_parameters<float> p;
  p.beta_m = p.beta_n = 0.05f;
  p.strength = {vec3(0), vec3(1), vec3(0)};
  auto bsdf = make_hair_bsdf(p);
  auto in = typical_inputs(500, 31);
  for (std::size_t i = 0; i < in.size(); i++) {
    in.h[i] *= 0.9f;
    in.u[0][i] = i % 3 == 0 ? 0 : i % 3 == 1 ? 0.99999994f : in.u[0][i];
  }
  for_each_target([&](hair_batch_target) {
    auto out = sample(bsdf, in);
    CHECK(*std::min_element(out.pdf.begin(), out.pdf.end()) > 1e-12f);
  });
}

TEST_CASE("hair_batch: spans of the wrong size are refused by name") {
  auto bsdf = make_hair_bsdf(hair_parameters<float>{});
  auto in = typical_inputs(8, 9);
  outputs out(8);
  auto e = in.eval();
  e.wo.y = e.wo.y.subspan(1);
  CHECK_THROWS_WITH_AS(eval_hair_batch(bsdf, e, out.eval()),
                       "hair batch: wo has 7 elements; it should have 8, as h has",
                       std::invalid_argument);
  e = in.eval();
  e.sigma_a.each.x = {};
  CHECK_THROWS_AS(eval_hair_batch(bsdf, e, out.eval()), std::invalid_argument);
  outputs small(7);
  CHECK_THROWS_AS(eval_hair_batch(bsdf, in.eval(), small.eval()), std::invalid_argument);
  auto s = in.sample();
  s.u[3] = {};
  CHECK_THROWS_AS(sample_hair_batch(bsdf, s, out.sample()), std::invalid_argument);
}
