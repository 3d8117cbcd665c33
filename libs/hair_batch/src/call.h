#pragma once

// What the kernels are given, in plain arrays: their code is compiled once for each
// instruction set and calls no function of another header.

#include <cstddef>

namespace wisp::hair::batch {

inline constexpr int lobe_count = 8;

struct material {
  float eta = 1, n2_minus_1 = 0;  // eta^2 - 1
  int p_max = 1;
  bool has_strength = false;
  // As in hair_bsdf, by lobe.
  float v[lobe_count], inv_v[lobe_count], exp_m2_over_v[lobe_count], mp_norm[lobe_count];
  float sin_tilt[lobe_count], cos_tilt[lobe_count];
  float s[lobe_count], inv_s[lobe_count], np_norm[lobe_count], logistic_cdf_a[lobe_count];
  float strength[lobe_count][3];
};

// The arrays of a call; of sigma_a and the channel weight a null pointer stands for
// the constant.
enum input { in_wo = 0, in_h = 3, in_sigma_a = 4, in_weight = 7, in_wi = 10, in_u = 10 };
enum output { out_value = 0, out_pdf = 3, out_direction = 4 };
inline constexpr int input_count = 14, output_count = 7;

struct call {
  std::size_t count = 0;
  const float* in[input_count] = {};
  float* out[output_count] = {};
  float sigma_a[3] = {}, weight[3] = {};
};

}  // namespace wisp::hair::batch
