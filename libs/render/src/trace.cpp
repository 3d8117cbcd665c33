#include "wisp/render/trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <stdexcept>

#include "path.h"
#include "wisp/core/parallel.h"
#include "wisp/core/sampling.h"
#include "wisp/render/camera.h"

namespace wisp {

namespace {

constexpr int tile_size = 16;

// Samples of a symmetric filter by inversion of its tabulated distribution: the
// sample is moved instead of weighted, so pixels stay independent of each other
// (Ernst et al., Filter Importance Sampling, 2006).
struct filter_table {
  static constexpr std::size_t bins = 256;
  float radius = 0.5f;
  bool box = true;
  std::array<float, bins + 1> inverse = {};
};

float filter_value(pixel_filter filter, float x) {  // x in [-1, 1] of the radius
  switch (filter) {
    case pixel_filter::tent:
      return 1 - std::abs(x);
    case pixel_filter::gaussian:
      return std::exp(-4.5f * x * x) - std::exp(-4.5f);
    case pixel_filter::blackman_harris: {
      float t = pi * (x + 1);
      return 0.35875f - 0.48829f * std::cos(t) + 0.14128f * std::cos(2 * t) -
             0.01168f * std::cos(3 * t);
    }
    default:
      return 1;
  }
}

filter_table make_filter(pixel_filter filter) {
  filter_table table;
  if (filter == pixel_filter::box) return table;
  table.box = false;
  table.radius = filter == pixel_filter::tent ? 1.0f : 1.5f;
  constexpr std::size_t steps = 4096;
  std::vector<double> cdf(steps + 1, 0);
  for (std::size_t i = 0; i < steps; i++) {
    float x = 2 * (static_cast<float>(i) + 0.5f) / steps - 1;
    cdf[i + 1] = cdf[i] + std::max(0.0, static_cast<double>(filter_value(filter, x)));
  }
  std::size_t k = 0;
  for (std::size_t i = 0; i <= filter_table::bins; i++) {
    double target = cdf[steps] * static_cast<double>(i) / filter_table::bins;
    while (k + 1 < steps && cdf[k + 1] < target) k++;
    double width = cdf[k + 1] - cdf[k];
    double inside = width > 0 ? (target - cdf[k]) / width : 0;
    table.inverse[i] =
        static_cast<float>(2 * (static_cast<double>(k) + inside) / steps - 1) * table.radius;
  }
  return table;
}

// Offset from the pixel's centre.
float sample_filter(const filter_table& table, float u) {
  if (table.box) return u - 0.5f;
  float x = u * filter_table::bins;
  auto i = std::min(static_cast<std::size_t>(x), filter_table::bins - 1);
  float f = x - static_cast<float>(i);
  return table.inverse[i] * (1 - f) + table.inverse[i + 1] * f;
}

// The mean luminance of the picture, from few paths of their own.
float probe_brightness(const render_scene& scene, const trace_options& options) {
  constexpr int side = 32;
  const auto& camera = scene.scene.cameras[static_cast<std::size_t>(options.camera)];
  double sum = 0;
  for (int i = 0; i < side * side; i++) {
    sample_state sampler{pixel_seed(options.seed + 1, static_cast<uint32_t>(i), 0xffffffffu), 0};
    vec4 u = sample_4d(sampler, 0);
    vec2 uv = (vec2(i % side, i / side) + vec2(u)) / static_cast<float>(side);
    camera_ray c = eval_camera(camera, uv, sample_disk({u.z, u.w}));
    float l = luminance(
        trace_path(scene, {c.origin, c.direction, 0, infinity}, sampler, options, 0, nullptr)
            .radiance);
    if (std::isfinite(l)) sum += static_cast<double>(l);
  }
  return static_cast<float>(sum / (side * side));
}

struct pixel_task {
  const render_scene& scene;
  const trace_options& options;
  const camera_data& camera;
  filter_table filter;
  bool wants_first_hit;
};

void add_pixel_samples(trace_state& state, const pixel_task& task, int x, int y, int count) {
  auto index = static_cast<std::size_t>(y) * static_cast<std::size_t>(state.width) +
               static_cast<std::size_t>(x);
  sample_state sampler{
      pixel_seed(task.options.seed, static_cast<uint32_t>(x), static_cast<uint32_t>(y)),
      state.samples[index]};
  for (int s = 0; s < count; s++, sampler.index++) {
    vec4 u = sample_4d(sampler, 0);
    vec2 uv = {(static_cast<float>(x) + 0.5f + sample_filter(task.filter, u.x)) /
                   static_cast<float>(state.width),
               (static_cast<float>(y) + 0.5f + sample_filter(task.filter, u.y)) /
                   static_cast<float>(state.height)};
    camera_ray c = eval_camera(task.camera, uv, sample_disk({u.z, u.w}));
    first_hit first;
    path_result path =
        trace_path(task.scene, {c.origin, c.direction, 0, infinity}, sampler, task.options,
                   state.brightness, task.wants_first_hit ? &first : nullptr);
    dvec3 radiance = dvec3(path.radiance);
    if (!is_finite(path.radiance)) {
      radiance = dvec3(0);
      std::atomic_ref<uint64_t>(state.paths_with_errors).fetch_add(1, std::memory_order_relaxed);
    }
    state.radiance[index] += dvec4(radiance, path.covered ? 1.0 : 0.0);
    state.squares[index] += glm::dot(radiance, radiance);
    if (task.wants_first_hit && first.found) {
      if (task.options.albedo) state.albedo[index] += first.albedo;
      if (task.options.normal) state.normal[index] += first.normal;
      if (task.options.tangent) state.tangent[index] += first.tangent;
      if (task.options.depth) {
        state.depth[index] += first.depth;
        state.depth_samples[index]++;
      }
    }
    state.samples[index]++;
  }
}

}  // namespace

ivec2 image_size(const scene_data& scene, const trace_options& options) {
  if (options.camera < 0 || static_cast<std::size_t>(options.camera) >= scene.cameras.size())
    throw std::invalid_argument(fmt::format("camera {} does not exist: the scene has {}",
                                            options.camera, scene.cameras.size()));
  float aspect = scene.cameras[static_cast<std::size_t>(options.camera)].aspect;
  int64_t width = options.width, height = options.height;
  if (width == 0 && height == 0) {
    if (aspect >= 1)
      width = 1280;
    else
      height = 1280;
  }
  if (height == 0) height = std::llround(static_cast<double>(width) / static_cast<double>(aspect));
  if (width == 0) width = std::llround(static_cast<double>(height) * static_cast<double>(aspect));
  if (options.height == 0 && height == 0) height = 1;
  if (options.width == 0 && width == 0) width = 1;
  if (width < 1 || height < 1 || width > 65536 || height > 65536 || width * height > (1 << 28))
    throw std::invalid_argument(
        fmt::format("a resolution of {} x {} cannot be rendered: each side must be 1 to 65536, and "
                    "the image at most 2^28 pixels",
                    width, height));
  return {static_cast<int>(width), static_cast<int>(height)};
}

trace_state make_trace_state(const render_scene& scene, const trace_options& options) {
  ivec2 size = image_size(scene.scene, options);
  trace_state state;
  state.width = size.x;
  state.height = size.y;
  auto pixels = static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
  state.radiance.assign(pixels, dvec4(0));
  state.squares.assign(pixels, 0);
  state.samples.assign(pixels, 0);
  if (options.albedo) state.albedo.assign(pixels, vec3(0));
  if (options.normal) state.normal.assign(pixels, vec3(0));
  if (options.tangent) state.tangent.assign(pixels, vec3(0));
  state.error_image = options.error_image;
  state.brightness = probe_brightness(scene, options);
  if (options.depth) {
    state.depth.assign(pixels, 0);
    state.depth_samples.assign(pixels, 0);
  }
  return state;
}

bool trace_samples(trace_state& state, const render_scene& scene, const trace_options& options,
                   int count, const std::atomic<bool>* stop) {
  pixel_task task{scene, options, scene.scene.cameras[static_cast<std::size_t>(options.camera)],
                  make_filter(options.filter),
                  options.albedo || options.normal || options.tangent || options.depth};
  int tiles_x = (state.width + tile_size - 1) / tile_size;
  int tiles_y = (state.height + tile_size - 1) / tile_size;
  auto stopped = [&] { return stop && stop->load(std::memory_order_relaxed); };
  parallel_for(static_cast<std::size_t>(tiles_x) * static_cast<std::size_t>(tiles_y),
               options.threads, [&](std::size_t tile) {
                 int tx = static_cast<int>(tile % static_cast<std::size_t>(tiles_x)) * tile_size;
                 int ty = static_cast<int>(tile / static_cast<std::size_t>(tiles_x)) * tile_size;
                 for (int y = ty; y < std::min(ty + tile_size, state.height); y++)
                   for (int x = tx; x < std::min(tx + tile_size, state.width); x++) {
                     if (stopped()) return;
                     add_pixel_samples(state, task, x, y, count);
                   }
               });
  return !stopped();
}

int trace_image(trace_state& state, const render_scene& scene, const trace_options& options,
                const std::function<void(const trace_progress&)>& progress,
                const std::atomic<bool>* stop) {
  auto start = std::chrono::steady_clock::now();
  auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  double pixels = static_cast<double>(state.width) * static_cast<double>(state.height);
  trace_progress report;
  report.samples_wanted = options.samples;
  double rate = 0;  // samples per pixel and second
  int pass = 1;
  while (report.samples_done < options.samples) {
    int count = std::min(pass, options.samples - report.samples_done);
    if (options.seconds > 0 && rate > 0) {
      // Never more than what is left of the time.
      double left = (options.seconds - elapsed()) * rate;
      if (left < 1) break;
      count = std::min(count, static_cast<int>(std::min(left, 1e9)));
    }
    if (!trace_samples(state, scene, options, count, stop)) return report.samples_done;
    report.samples_done += count;
    report.seconds = elapsed();
    rate = report.seconds > 0 ? report.samples_done / report.seconds : 0;
    report.samples_per_second = rate * pixels;
    report.error = image_error(state);
    if (progress) progress(report);
    if (options.error > 0 && report.samples_done >= 16 &&
        report.error <= static_cast<double>(options.error))
      break;
    // Passes double, but stay near half a second so that budgets and progress are fine.
    double wanted = rate * 0.5;
    pass = std::clamp(static_cast<int>(std::min(wanted, 1e6)), 1, 2 * pass);
  }
  return report.samples_done;
}

namespace {

// Squared standard error of the pixel's mean, summed over the channels.
double pixel_variance(const trace_state& state, std::size_t i) {
  double n = state.samples[i];
  if (n < 2) return 0;
  dvec3 mean = dvec3(state.radiance[i]) / n;
  return std::max(0.0, state.squares[i] / n - glm::dot(mean, mean)) / (n - 1);
}

}  // namespace

double image_error(const trace_state& state) {
  double sum = 0;
  for (std::size_t i = 0; i < state.squares.size(); i++) sum += pixel_variance(state, i);
  return state.squares.empty() ? 0
                               : std::sqrt(sum / (3 * static_cast<double>(state.squares.size())));
}

image_data get_image(const trace_state& state) {
  image_data image;
  image.width = state.width;
  image.height = state.height;
  image.channels = {"R", "G", "B", "A"};
  auto add = [&](bool wanted, std::initializer_list<const char*> names) {
    if (wanted) image.channels.insert(image.channels.end(), names.begin(), names.end());
  };
  add(!state.albedo.empty(), {"albedo.R", "albedo.G", "albedo.B"});
  add(!state.normal.empty(), {"normal.X", "normal.Y", "normal.Z"});
  add(!state.tangent.empty(), {"tangent.X", "tangent.Y", "tangent.Z"});
  add(!state.depth.empty(), {"depth.Z"});
  add(state.error_image, {"error.V"});
  std::size_t channels = image.channels.size();
  image.pixels.resize(state.samples.size() * channels);
  for (std::size_t i = 0; i < state.samples.size(); i++) {
    float* p = &image.pixels[i * channels];
    auto put = [&](const vec3& v) {
      *p++ = v.x;
      *p++ = v.y;
      *p++ = v.z;
    };
    double n = state.samples[i];
    double scale = n > 0 ? 1 / n : 0;
    auto fscale = static_cast<float>(scale);
    put(vec3(dvec3(state.radiance[i]) * scale));
    *p++ = static_cast<float>(state.radiance[i].w * scale);
    if (!state.albedo.empty()) put(state.albedo[i] * fscale);
    if (!state.normal.empty()) put(normalize_or_zero(state.normal[i]));
    if (!state.tangent.empty()) put(state.tangent[i] * fscale);
    if (!state.depth.empty()) {
      uint32_t k = state.depth_samples[i];
      *p++ = k > 0 ? state.depth[i] / static_cast<float>(k) : infinity;
    }
    if (state.error_image) *p++ = static_cast<float>(std::sqrt(pixel_variance(state, i) / 3));
  }
  return image;
}

}  // namespace wisp
