// Pictures as the subject of a study.

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "commands.h"
#include "console.h"
#include "picture_options.h"
#include "run_report.h"
#include "section_render.h"
#include "study_subjects.h"
#include "wisp/render/gltf.h"
#include "wisp/render/image.h"
#include "wisp/render/trace.h"

namespace {

struct picture {
  wisp::render_scene scene;
  wisp::trace_options options;
  wisp::ivec2 size = {0, 0};
  std::vector<wisp::part_report> parts;
};

// Red, green and blue of each pixel with the standard error that the pixel has, the mean
// over its channels.
study_values values_of(const wisp::image_data& image, const std::string& file) {
  const auto channel = [&](const char* name) {
    for (std::size_t i = 0; i < image.channels.size(); ++i)
      if (image.channels[i] == name) return static_cast<int>(i);
    return -1;
  };
  const int rgb[] = {channel("R"), channel("G"), channel("B")};
  const int error = channel("error.V");
  for (const int c : rgb) {
    if (c < 0) throw wisp::file_error(file, "", "has no channels R, G and B");
  }
  const std::size_t n = image.channels.size(), pixels = image.pixels.size() / n;
  study_values v;
  v.mean.reserve(3 * pixels);
  if (error >= 0) v.error.reserve(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (const int c : rgb) {
      v.mean.push_back(static_cast<double>(image.pixels[i * n + static_cast<std::size_t>(c)]));
      if (error < 0) continue;
      v.error.push_back(static_cast<double>(image.pixels[i * n + static_cast<std::size_t>(error)]));
    }
  }
  return v;
}

wisp::image_data image_of(const study_values& values, const wisp::ivec2& size) {
  wisp::image_data image;
  image.width = size.x;
  image.height = size.y;
  image.channels = {"R", "G", "B"};
  if (!values.error.empty()) image.channels.push_back("error.V");
  for (std::size_t i = 0; i < values.mean.size(); i += 3) {
    for (std::size_t c = 0; c < 3; ++c)
      image.pixels.push_back(static_cast<float>(values.mean[i + c]));
    if (!values.error.empty()) image.pixels.push_back(static_cast<float>(values.error[i]));
  }
  return image;
}

study_values load_picture(const std::string& file, const wisp::ivec2& size) {
  const auto kind = ending(file);
  if (kind == ".png" || kind == ".jpg" || kind == ".jpeg") {
    throw wisp::file_error(file, "",
                           "is tone mapped and rounded; errors need linear values, as of .exr");
  }
  const auto image = wisp::load_image(file);
  if (image.width != size.x || image.height != size.y) {
    throw wisp::file_error(file, "",
                           fmt::format("has {} x {} pixels, but the study {} x {}; --resolution "
                                       "sets those of the study",
                                       image.width, image.height, size.x, size.y));
  }
  return values_of(image, file);
}

}  // namespace

study_subject make_picture_subject(const study_arguments& args, const study_watch& watch,
                                   wisp::warning_list& warnings) {
  auto p = std::make_shared<picture>();
  auto& o = p->options;
  parse_resolution(args.resolution.empty() ? "256" : args.resolution, o);
  o.filter = filter_of(args.filter.empty() ? "blackman-harris" : args.filter);
  if (args.bounces >= 0) o.bounces = args.bounces;
  o.clamp = static_cast<float>(args.clamp);
  o.threads = args.solve.threads;
  o.seed = args.solve.seed;
  o.error_image = true;

  phase_timer timer;
  timer.start("load");
  watch("load: " + args.solve.scene);
  auto data = wisp::load_scene(args.solve.scene, warnings);
  if (data.cameras.empty()) data.cameras.push_back(wisp::default_camera(data));
  o.camera = find_camera(data, args.camera);
  const auto camera_name = data.cameras[static_cast<std::size_t>(o.camera)].name;
  p->size = wisp::image_size(data, o);
  timer.start("build");
  watch("build: textures, ray structures and lights");
  // sections are part of the scene here: solved once, with the walks of their problems
  const section_render_options sections = {o.camera, p->size,   args.solve.walks,
                                           o.seed,   o.threads, watch};
  if (!render_sections(data, sections, p->parts, warnings)) throw study_interrupted();
  try {
    p->scene = wisp::prepare_scene(std::move(data), {o.threads, false}, warnings);
  } catch (const std::invalid_argument& error) {
    throw wisp::file_error(args.solve.scene, "", error.what());
  }
  timer.stop();
  p->parts.insert(p->parts.begin(), p->scene.parts.begin(), p->scene.parts.end());

  study_subject s;
  s.kind = "render";
  s.title = std::filesystem::path(args.solve.scene).filename().string();
  if (!args.camera.empty()) s.title += ", camera " + camera_name;
  s.unit = "samples";
  s.size = fmt::format("{} x {} pixels", p->size.x, p->size.y);
  s.load_seconds = timer.seconds("load");
  s.build_seconds = timer.seconds("build");
  s.reference_ending = ".exr";
  s.budgets = {1, 2, 4, 8, 16, 32, 64};
  s.most = std::uint64_t{1} << 24;
  s.run = [p](std::uint64_t budget, std::uint64_t seed,
              const std::function<void(double)>& progress) -> std::optional<study_measurement> {
    auto options = p->options;
    options.samples = static_cast<int>(budget);
    options.seed = seed;
    phase_timer clock;
    clock.start("run");
    auto state = wisp::make_trace_state(p->scene, options);
    wisp::trace_image(
        state, p->scene, options,
        [&](const wisp::trace_progress& t) {
          progress(static_cast<double>(t.samples_done) / t.samples_wanted);
        },
        &interrupt_flag());
    clock.stop();
    if (interrupt_flag()) return std::nullopt;
    study_measurement m;
    m.seconds = clock.seconds("run");
    m.cpu_seconds = clock.cpu()["run"];
    m.values = values_of(wisp::get_image(state), "");
    if (budget < 2) m.values.error.clear();  // one sample tells nothing of its error
    return m;
  };
  s.save_reference = [p](const std::filesystem::path& file, const study_values& values) {
    wisp::save_image(file, image_of(values, p->size));
  };
  s.load_reference = [p](const std::string& file) { return load_picture(file, p->size); };
  s.parts = [p] { return p->parts; };
  return s;
}
