#include "wisp/hair_batch/hair_batch.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "src/call.h"

// Vectors whose size the compiler does not know cannot be members of structs; those
// processors have NEON too.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/hair_batch.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

#include "src/lobes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace wisp::hair::batch::HWY_NAMESPACE {

// Whole vectors only. Kept out of line so that a tail runs through the same code.
template <int known_p_max>
HWY_NOINLINE void eval_whole(const material& m, const call& c) {
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(floats())) eval_at<known_p_max>(m, c, i);
}
template <int known_p_max>
HWY_NOINLINE void sample_whole(const material& m, const call& c) {
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(floats())) sample_at<known_p_max>(m, c, i);
}

// What is left after the whole vectors is padded with copies of its last input.
void run(const material& m, call c, void (*whole)(const material&, const call&)) {
  constexpr std::size_t most = HWY_MAX_BYTES / sizeof(float);
  const std::size_t lanes = hn::Lanes(floats());
  const std::size_t left = c.count % lanes, first = c.count - left;
  c.count = first;
  if (first > 0) whole(m, c);
  if (left == 0) return;
  float in[input_count][most], out[output_count][most];
  call tail = c;
  tail.count = lanes;
  for (int k = 0; k < input_count; k++) {
    if (c.in[k] == nullptr) continue;
    for (std::size_t i = 0; i < lanes; i++) in[k][i] = c.in[k][first + (i < left ? i : left - 1)];
    tail.in[k] = in[k];
  }
  for (int k = 0; k < output_count; k++) tail.out[k] = out[k];
  whole(m, tail);
  for (int k = 0; k < output_count; k++)
    if (c.out[k] != nullptr)
      for (std::size_t i = 0; i < left; i++) c.out[k][first + i] = out[k][i];
}

void eval(const material& m, const call& c) {
  run(m, c, m.p_max == 3 ? eval_whole<3> : eval_whole<0>);
}
void sample(const material& m, const call& c) {
  run(m, c, m.p_max == 3 ? sample_whole<3> : sample_whole<0>);
}
hair_batch_target describe() {
  return {hwy::TargetName(HWY_TARGET), static_cast<int>(hn::Lanes(floats()))};
}

}  // namespace wisp::hair::batch::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wisp::hair {
namespace batch {
namespace {

HWY_EXPORT(eval);
HWY_EXPORT(sample);
HWY_EXPORT(describe);

material material_of(const hair_bsdf<float>& bsdf) {
  material m = {};
  m.eta = bsdf.eta;
  m.n2_minus_1 = (bsdf.eta - 1) * (bsdf.eta + 1);
  m.p_max = std::clamp(bsdf.p_max, 1, max_p_max);
  m.has_strength = bsdf.has_strength;
  auto copy = [](const lobe_array<float>& from, float* to) {
    std::copy(from.begin(), from.end(), to);
  };
  static_assert(lobe_room == lobe_count);
  copy(bsdf.v, m.v);
  copy(bsdf.inv_v, m.inv_v);
  copy(bsdf.exp_m2_over_v, m.exp_m2_over_v);
  copy(bsdf.mp_norm, m.mp_norm);
  copy(bsdf.sin_tilt, m.sin_tilt);
  copy(bsdf.cos_tilt, m.cos_tilt);
  copy(bsdf.s, m.s);
  copy(bsdf.inv_s, m.inv_s);
  copy(bsdf.np_norm, m.np_norm);
  copy(bsdf.logistic_cdf_a, m.logistic_cdf_a);
  for (int p = 0; p < lobe_count; p++)
    for (int k = 0; k < 3; k++)
      m.strength[p][k] = bsdf.strength[std::min(static_cast<std::size_t>(p), std::size_t(2))][k];
  return m;
}

// Takes the arrays of a call down, and their sizes to task.
struct binder {
  call c;
  // The inputs that both calls have: of hair_eval_inputs or hair_sample_inputs.
  template <typename Inputs>
  explicit binder(const Inputs& inputs) {
    c.count = inputs.h.size();
    in3(in_wo, inputs.wo, "wo");
    in(in_h, inputs.h, "h");
    color(in_sigma_a, inputs.sigma_a, c.sigma_a, "sigma_a");
    color(in_weight, inputs.channel_weight, c.weight, "channel_weight");
  }

  void check(std::size_t size, const char* name) const {
    if (size != c.count)
      throw std::invalid_argument(std::string("hair batch: ") + name + " has " +
                                  std::to_string(size) + " elements; it should have " +
                                  std::to_string(c.count) + ", as h has");
  }
  void in(int k, std::span<const float> a, const char* name) {
    check(a.size(), name);
    c.in[k] = a.data();
  }
  void in3(int k, const batch_in3& a, const char* name) {
    in(k, a.x, name);
    in(k + 1, a.y, name);
    in(k + 2, a.z, name);
  }
  void color(int k, const batch_color& a, float (&constant)[3], const char* name) {
    for (int j = 0; j < 3; j++) constant[j] = a.all[j];
    if (!a.each.x.empty() || !a.each.y.empty() || !a.each.z.empty()) in3(k, a.each, name);
  }
  void out(int k, std::span<float> a, const char* name) {
    check(a.size(), name);
    c.out[k] = a.data();
  }
  void out3(int k, const batch_out3& a, const char* name) {
    out(k, a.x, name);
    out(k + 1, a.y, name);
    out(k + 2, a.z, name);
  }
};

}  // namespace
}  // namespace batch

void eval_hair_batch(const hair_bsdf<float>& bsdf, const hair_eval_inputs& inputs,
                     const hair_eval_outputs& outputs) {
  using namespace batch;
  binder b(inputs);
  b.in3(in_wi, inputs.wi, "wi");
  b.out3(out_value, outputs.value, "value");
  b.out(out_pdf, outputs.pdf, "pdf");
  HWY_DYNAMIC_DISPATCH(eval)(material_of(bsdf), b.c);
}

void sample_hair_batch(const hair_bsdf<float>& bsdf, const hair_sample_inputs& inputs,
                       const hair_sample_outputs& outputs) {
  using namespace batch;
  binder b(inputs);
  for (int k = 0; k < 4; k++) b.in(in_u + k, inputs.u[static_cast<std::size_t>(k)], "u");
  b.out3(out_direction, outputs.direction, "direction");
  b.out3(out_value, outputs.value, "value");
  b.out(out_pdf, outputs.pdf, "pdf");
  HWY_DYNAMIC_DISPATCH(sample)(material_of(bsdf), b.c);
}

hair_batch_target current_hair_batch_target() { return HWY_DYNAMIC_DISPATCH(batch::describe)(); }

}  // namespace wisp::hair
#endif  // HWY_ONCE
