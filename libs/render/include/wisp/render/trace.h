#pragma once

// The path tracer: explicit state, advanced by calls, in the manner of
// Yocto/GL. A pixel's samples follow from (seed, pixel, sample index) alone, so
// the picture is the same at any thread count.

#include <atomic>
#include <cstdint>
#include <functional>
#include <vector>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/render/image.h"
#include "wisp/render/render_scene.h"

namespace wisp {

enum struct pixel_filter { box, tent, gaussian, blackman_harris };

struct trace_options {
  int width = 0;  // pixels; with height 0 the camera's aspect gives the other
  int height = 0;
  int camera = 0;
  int samples = 64;  // paths for each pixel, >= 1
  int bounces = 64;  // scattering events on a path, >= 0
  uint64_t seed = 0;
  int threads = 0;  // 0: all
  float clamp = 0;  // largest radiance of a path; 0: none (unbiased)
  pixel_filter filter = pixel_filter::blackman_harris;
  // Stop early, after whole passes: after this much rendering (0: no limit), or
  // once the estimated error of the image is at most `error` (0: no target).
  double seconds = 0;
  float error = 0;
  // What is gathered beside the radiance; nothing is kept for what is off.
  bool albedo = false;
  bool normal = false;
  bool tangent = false;
  bool depth = false;
  bool error_image = false;
  bool hide_environment = false;  // the sky lights the scene but is not seen
};

// Sums over the samples of each pixel. A state is changed by one call at a time; the call
// itself uses many threads. `stop` may be set by any thread, and progress is told from the
// one that called.
struct trace_state {
  int width = 0;
  int height = 0;
  std::vector<dvec4> radiance = {};  // rgb and coverage
  std::vector<double> squares = {};  // of r, g, b, added
  std::vector<uint32_t> samples = {};
  std::vector<vec3> albedo = {}, normal = {}, tangent = {};
  std::vector<float> depth = {};
  std::vector<uint32_t> depth_samples = {};
  bool error_image = false;
  float brightness = 0;            // of the picture, about; steers roulette
  uint64_t paths_with_errors = 0;  // paths dropped for a value that is not finite
};

// What a running render tells its caller after each pass.
struct trace_progress {
  int samples_done = 0;
  int samples_wanted = 0;
  double seconds = 0;
  double samples_per_second = 0;  // paths per second
  double error = 0;               // see image_error
};

// The size of the image that the options mean for the scene's camera. Throws
// std::invalid_argument for sizes outside [1, 65536] or above 2^28 pixels and for
// a camera index out of range.
WISP_API ivec2 image_size(const scene_data& scene, const trace_options& options);
WISP_API trace_state make_trace_state(const render_scene& scene, const trace_options& options);

// Adds `count` samples to every pixel, over all threads. Returns false when
// `stop` became true: each pixel then holds the samples that it has.
WISP_API bool trace_samples(trace_state& state, const render_scene& scene,
                            const trace_options& options, int count,
                            const std::atomic<bool>* stop = nullptr);

// Passes of growing size until the samples, the time or the error is reached,
// or `stop`. Returns the number of samples of the last whole pass.
WISP_API int trace_image(trace_state& state, const render_scene& scene,
                         const trace_options& options,
                         const std::function<void(const trace_progress&)>& progress = {},
                         const std::atomic<bool>* stop = nullptr);

// The root mean square, over pixels and channels, of the standard error that the
// samples themselves show. Sobol points do better than independent samples, so
// this is an upper estimate.
WISP_API double image_error(const trace_state& state);

// The mean image with its channels: R G B A, then albedo.RGB, normal.XYZ,
// tangent.XYZ, depth.Z (infinite where nothing is hit) and error.V (standard error
// of the mean, averaged over the channels) as gathered.
WISP_API image_data get_image(const trace_state& state);

}  // namespace wisp
