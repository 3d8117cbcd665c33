#pragma once

// The hair BSDF of wisp/hair/bsdf.h for many inputs of one material at once:
// vector code over inputs, written with Google Highway, for whatever instruction
// set the processor turns out to have (SSSE3 to AVX-512, NEON).
//
// Arrays are structures of arrays: one span of floats for each component, none of
// which has to be aligned. All spans of a call hold the same number of elements,
// N = inputs.h.size(), which may be anything, 0 included. Conventions, units and
// ranges are those of wisp::hair; what follows from wo (make_hair_hit) is part of
// the work.
//
// Results
//   - What an input gives does not depend on its place in the batch nor on N, nor
//     on the width of the vectors: only on whether the processor has fused
//     multiply-add (AVX2, AVX-512, NEON on 64-bit Arm) or not.
//   - They differ from the scalar functions and from exact arithmetic by rounding
//     only. The part of lobe p in value and pdf is within the relative error
//         1e-6 (4 + 2 p + 1 / sqrt(v_p) + (1 + p) / s_p)
//     of its exact value, for eta from 1.05 on (v_p and s_p: hair_bsdf; 1 / s_p is
//     0 for the uniform lobe p_max), as angles are known to a few 1e-7, plus what
//     changes of 2e-7 in wo, wi and h and of 4e-7 of sigma_a would do: near the
//     poles, near |h| = 1 and in strong absorption that may be more. At a pole the
//     azimuth is arbitrary. For roughness 0.1 to 0.8 the difference to the scalar
//     code stays below 1e-4 of the result (of 1e-6, for results below that). Lobes
//     below exp(-87) of their peak, light weakened by as much, and for the pdf
//     lobes with a channel_weight * A_p below 1e-19, are 0.
//   - sample_hair_batch draws the directions of sample_hair, but for rounding: as
//     if u[0] were changed by a few 1e-7, which may be another lobe. Directions
//     have unit length to 3e-6 or what wo has, whichever is worse.
//   - Valid inputs never give NaN, infinities or negative numbers.
//
// What is checked: the sizes of the spans; a wrong one throws std::invalid_argument.
// The numbers are not: non-finite ones, directions that do not have unit length,
// and negative absorption are the caller's error, and spoil no other input's
// result. Outputs must not overlap inputs or one another.
//
// The functions are pure and safe to call from any thread.

#include <array>
#include <glm/vec3.hpp>
#include <span>

#include "wisp/hair/bsdf.h"

#if defined(WISP_STATIC)
#define WISP_HAIR_BATCH_API
#elif defined(_WIN32)
#if defined(WISP_BUILDING)
#define WISP_HAIR_BATCH_API __declspec(dllexport)
#else
#define WISP_HAIR_BATCH_API __declspec(dllimport)
#endif
#else
#define WISP_HAIR_BATCH_API __attribute__((visibility("default")))
#endif

namespace wisp::hair {

// Directions in the frame of the fibre (x along it), or colours (red, green, blue).
struct batch_in3 {
  std::span<const float> x, y, z;
};
struct batch_out3 {
  std::span<float> x, y, z;
};

// A colour for each input, or, where `each` is empty, one for all.
struct batch_color {
  glm::vec3 all = {0, 0, 0};
  batch_in3 each = {};
};

struct hair_eval_inputs {
  batch_in3 wo;              // where the light goes, unit length
  batch_in3 wi;              // where it comes from, unit length
  std::span<const float> h;  // [-1, 1]; clamped to it
  batch_color sigma_a;       // absorption per fibre radius, >= 0
  // How much each colour channel matters when lobes are chosen, >= 0.
  batch_color channel_weight = {{1, 1, 1}, {}};
};
struct hair_eval_outputs {
  batch_out3 value;      // f |cos(theta_i)|
  std::span<float> pdf;  // of sample_hair, by solid angle
};

struct hair_sample_inputs {
  batch_in3 wo;
  std::span<const float> h;
  batch_color sigma_a;
  batch_color channel_weight = {{1, 1, 1}, {}};
  std::array<std::span<const float>, 4> u;  // [0, 1), as in sample_hair
};
struct hair_sample_outputs {
  batch_out3 direction;  // wi
  batch_out3 value;      // f |cos(theta_i)|
  std::span<float> pdf;  // by solid angle
};

// make_hair_hit and eval_hair_with_pdf for each input.
WISP_HAIR_BATCH_API void eval_hair_batch(const hair_bsdf<float>& bsdf,
                                         const hair_eval_inputs& inputs,
                                         const hair_eval_outputs& outputs);

// make_hair_hit and sample_hair_with_pdf for each input.
WISP_HAIR_BATCH_API void sample_hair_batch(const hair_bsdf<float>& bsdf,
                                           const hair_sample_inputs& inputs,
                                           const hair_sample_outputs& outputs);

// The instruction set in use, as Highway names it ("AVX2"), and the number of
// inputs that are worked on at once.
struct hair_batch_target {
  const char* name;
  int lanes;
};
WISP_HAIR_BATCH_API hair_batch_target current_hair_batch_target();

}  // namespace wisp::hair
