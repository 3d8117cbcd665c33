#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <limits>

#include "commands.h"
#include "console.h"
#include "option_checks.h"
#include "picture_options.h"
#include "run_report.h"
#include "section_render.h"
#include "wisp/core/parallel.h"
#include "wisp/render/gltf.h"
#include "wisp/render/image.h"
#include "wisp/render/trace.h"

namespace fs = std::filesystem;

namespace {

constexpr int unlimited_samples = 1 << 24;
constexpr double largest_float = std::numeric_limits<float>::max();

struct render_arguments {
  std::string scene;
  std::vector<std::string> outputs;
  std::string resolution;
  std::string camera;
  std::vector<std::string> aovs;
  std::string report;
  std::string filter = "blackman-harris";
  std::string tonemap = "filmic";
  float exposure = 0;
  bool half_float = false;
  bool quiet = false;
  bool compact = false;
  uint64_t walks = 0;  // of sections; 0: those of their problems
  wisp::trace_options trace;
};

void check_report(const std::string& output) {
  auto folder = fs::absolute(output).parent_path();
  if (!fs::is_directory(folder))
    throw wisp::file_error(output, "",
                           fmt::format("the folder '{}' does not exist", folder.string()));
  if (fs::is_directory(output)) throw wisp::file_error(output, "", "is a folder");
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error);
}

// Fails before hours of rendering rather than after.
void check_outputs(const render_arguments& args) {
  for (const auto& output : args.outputs)
    if (!wisp::can_save_image(output))
      throw usage_error(fmt::format("-o: '{}' must end in .exr, .hdr, .png or .jpg", output));
  if (!args.report.empty()) {
    if (same_file(args.report, args.scene))
      throw usage_error(fmt::format("--report: '{}' is the scene itself", args.report));
    for (const auto& output : args.outputs)
      if (same_file(args.report, output))
        throw usage_error(fmt::format("--report: '{}' is the name of an image, too", args.report));
    check_report(args.report);
  }
  for (const auto& output : args.outputs) wisp::check_image_output(output);
}

// One sample tells nothing about its error.
std::string error_text(double error, int64_t samples) {
  return samples > 1 ? fmt::format("{:.2g}", error) : "unknown";
}

std::string progress_text(const wisp::trace_progress& p, const wisp::trace_options& options) {
  double left = (p.samples_wanted - p.samples_done) * p.seconds / std::max(1, p.samples_done);
  if (options.seconds > 0) left = std::min(left, std::max(0.0, options.seconds - p.seconds));
  if (options.error > 0 && p.error > 0) {
    double ratio = p.error / static_cast<double>(options.error);
    left = std::min(left, std::max(0.0, p.seconds * (ratio * ratio - 1)));
  }
  auto wanted =
      options.samples < unlimited_samples ? fmt::format("/{}", p.samples_wanted) : std::string();
  return fmt::format("render: {}{} samples, {:.2f} M paths/s, error {}, {} left", p.samples_done,
                     wanted, p.samples_per_second * 1e-6, error_text(p.error, p.samples_done),
                     format_duration(left));
}

// True if an output is not .exr, which needs no image library.
bool encodes_images(const std::vector<std::string>& outputs) {
  return std::any_of(outputs.begin(), outputs.end(), [](const std::string& output) {
    return CLI::detail::to_lower(fs::path(output).extension().string()) != ".exr";
  });
}

void save_outputs(const render_arguments& args, const wisp::image_data& image) {
  wisp::image_write_options options;
  options.exposure = args.exposure;
  options.filmic = args.tonemap == "filmic";
  options.half_float = args.half_float;
  // All are tried: the failure of one must not cost the others.
  std::exception_ptr failure;
  for (const auto& output : args.outputs) try {
      wisp::save_image(output, image, options);
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  if (failure) std::rethrow_exception(failure);
}

int run_render(render_arguments args, const std::string& command_line) {
  if (!args.resolution.empty()) parse_resolution(args.resolution, args.trace);
  check_outputs(args);
  auto& options = args.trace;
  options.filter = filter_of(args.filter);
  for (const auto& aov : args.aovs) {
    options.albedo |= aov == "albedo";
    options.normal |= aov == "normal";
    options.tangent |= aov == "tangent";
    options.depth |= aov == "depth";
    options.error_image |= aov == "error";
  }
  progress_line line(args.quiet);
  phase_timer timer;
  wisp::warning_list warnings;

  timer.start("load");
  line.show("load: " + args.scene);
  auto data = wisp::load_scene(args.scene, warnings);
  if (data.cameras.empty()) data.cameras.push_back(wisp::default_camera(data));
  options.camera = find_camera(data, args.camera);
  auto size = wisp::image_size(data, options);
  for (const auto& output : args.outputs) wisp::check_image_output(output, size.x, size.y);

  std::vector<wisp::part_report> section_parts;
  if (shows_sections(data)) {
    timer.start("sections");
    watch_interrupts();
  }
  const bool solved =
      render_sections(data,
                      {options.camera, size, args.walks, options.seed, options.threads,
                       [&](const std::string& text) {
                         line.show(text);
                         return !interrupt_flag().load();
                       }},
                      section_parts, warnings);
  if (!solved) {
    line.clear();
    fmt::print(stderr, "wisp: stopped before the first sample; nothing saved\n");
    return exit_interrupted;
  }

  timer.start("build");
  line.show("build: textures, ray structures and lights");
  auto scene = [&] {
    try {
      return wisp::prepare_scene(std::move(data), {options.threads, args.compact}, warnings);
    } catch (const std::invalid_argument& error) {  // of a scene that the file itself allows
      throw wisp::file_error(args.scene, "", error.what());
    }
  }();
  timer.stop();
  line.clear();
  print_warnings(warnings, args.quiet);

  timer.start("render");
  watch_interrupts();
  auto state = wisp::make_trace_state(scene, options);
  wisp::trace_image(
      state, scene, options,
      [&](const wisp::trace_progress& p) { line.show(progress_text(p, options)); },
      &interrupt_flag());
  timer.stop();
  line.clear();
  bool interrupted = interrupt_flag();
  auto [fewest, most] = std::minmax_element(state.samples.begin(), state.samples.end());
  uint32_t samples = *fewest;
  if (*most == 0) {
    fmt::print(stderr, "wisp: stopped before the first sample; nothing saved\n");
    return exit_interrupted;
  }

  timer.start("save");
  auto image = wisp::get_image(state);
  image.metadata = {{"wisp:version", WISP_VERSION},
                    {"wisp:command", command_line},
                    {"wisp:scene", args.scene},
                    {"wisp:samples", std::to_string(samples)},
                    {"wisp:seconds", fmt::format("{:.3f}", timer.seconds("render"))},
                    {"wisp:seed", std::to_string(options.seed)},
                    {"wisp:bounces", std::to_string(options.bounces)}};
  save_outputs(args, image);
  timer.stop();

  double error = wisp::image_error(state);
  if (state.paths_with_errors > 0 && !args.quiet)
    fmt::print(stderr, "wisp: warning: {} paths had a value that is not finite and were left out\n",
               state.paths_with_errors);
  if (!args.report.empty()) {
    auto parts = scene.parts;
    parts.insert(parts.end(), section_parts.begin(), section_parts.end());
    for (auto& part : parts)
      if (part.name == "image library" && encodes_images(args.outputs)) {
        part.why = part.built ? part.why + ", and an output is encoded" : "an output is encoded";
        part.built = true;
      }
    std::size_t pixels = state.samples.size();
    parts.push_back({"film", true, fmt::format("{} x {} pixels", state.width, state.height), 0,
                     pixels * (sizeof(wisp::dvec4) + sizeof(double) + sizeof(uint32_t))});
    bool aovs = options.albedo || options.normal || options.tangent || options.depth;
    parts.push_back(
        {"auxiliary images", aovs, aovs ? "asked for by --aovs" : "none asked for by --aovs", 0,
         (state.albedo.size() + state.normal.size() + state.tangent.size()) * sizeof(wisp::vec3) +
             state.depth.size() * 8});
    nlohmann::ordered_json report = {
        {"wisp", WISP_VERSION},
        {"command", command_line},
        {"scene", args.scene},
        {"threads", wisp::thread_count(options.threads)},
        {"seconds", timer.wall()},
        {"cpu_seconds", timer.cpu()},
        {"peak_memory_bytes", peak_memory_bytes()},
        {"width", state.width},
        {"height", state.height},
        {"samples", samples},
        {"error", samples > 1 ? nlohmann::ordered_json(error) : nlohmann::ordered_json()},
        {"interrupted", interrupted},
        {"dropped_paths", state.paths_with_errors},
        {"warnings", warnings},
        {"parts", parts_json(parts)}};
    save_text(args.report, json_text(report) + "\n");
  }
  if (!args.quiet) {
    double paths = 0;
    for (uint32_t n : state.samples) paths += n;
    fmt::print("{}{} sample{} in {}, {:.2f} M paths/s, error {}, peak memory {}\n",
               interrupted ? "stopped; saved what there is: " : "", samples,
               samples == 1 ? "" : "s", format_duration(timer.seconds("render")),
               paths / timer.seconds("render") * 1e-6, error_text(error, samples),
               format_bytes(static_cast<double>(peak_memory_bytes())));
    for (const auto& output : args.outputs) fmt::print("{}\n", output);
  }
  return interrupted ? exit_interrupted : 0;
}

}  // namespace

command_action add_render(CLI::App& app, const std::string& command_line) {
  auto args = std::make_shared<render_arguments>();
  auto& o = args->trace;
  auto* cmd = app.add_subcommand("render", "Path-trace a scene to an image");
  cmd->footer(
      "Example:\n  wisp render scene.json -o image.exr -o image.png --samples 256 --resolution "
      "1280x720\n"
      "Scenes: .json (Yocto/GL and wisp), .gltf, .glb, or a hair or mesh file by itself.");
  cmd->add_option("scene", args->scene, "Scene file")->required();
  cmd->add_option("-o,--output", args->outputs,
                  "Image to write: .exr .hdr .png .jpg; may be given several times")
      ->required()
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  cmd->add_option("--samples", o.samples, "Paths for each pixel")
      ->check(CLI::Range(1, unlimited_samples))
      ->capture_default_str();
  cmd->add_option("--resolution", args->resolution, "W or WxH; default: 1280 on the longer side");
  cmd->add_option("--camera", args->camera, "Camera by name; default: the first");
  cmd->add_option("--bounces", o.bounces, "Most scattering events on a path")
      ->check(CLI::Range(0, 65536))
      ->capture_default_str();
  cmd->add_option("--exposure", args->exposure, "Stops, for .png and .jpg")
      ->check(check_number(-100, "from -100 to 100", 100));
  cmd->add_option("--tonemap", args->tonemap, "Curve of .png and .jpg: filmic or srgb")
      ->check(CLI::IsMember({"filmic", "srgb"}))
      ->capture_default_str();
  cmd->add_option("--aovs", args->aovs, "More channels for .exr: albedo,normal,tangent,depth,error")
      ->delimiter(',')
      ->check(CLI::IsMember({"albedo", "normal", "tangent", "depth", "error"}));
  cmd->add_option("--filter", args->filter, "Pixel filter: box, tent, gaussian, blackman-harris")
      ->transform(CLI::IsMember({"box", "tent", "gaussian", "blackman-harris"}, CLI::ignore_case)
                      .description(""))
      ->option_text("NAME=blackman-harris");
  cmd->add_option("--clamp", o.clamp,
                  "Largest radiance of a path; 0 (default) is none, as it should be")
      ->check(check_number(0, "of at least 0", largest_float));
  cmd->add_option("--walks", args->walks,
                  "Walks for each cell of a section; default: those of its problem")
      ->check(check_whole(1, uint64_t{1} << 40))
      ->option_text("N");
  cmd->add_flag("--hide-environment", o.hide_environment,
                "Black, transparent background; the sky still lights");
  cmd->add_flag("--half", args->half_float, ".exr with half-float colours");
  cmd->add_flag("--compact", args->compact, "Smaller ray structures, somewhat slower");
  cmd->add_option("--seed", o.seed, "Seed of the random numbers")
      ->check(check_whole(0, std::numeric_limits<uint64_t>::max()))
      ->capture_default_str();
  cmd->add_option("--threads", o.threads, "Threads; 0: all")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  cmd->add_option("--time", o.seconds, "Stop after this many seconds of rendering")
      ->check(check_number(std::numeric_limits<double>::denorm_min(), "greater than 0"));
  cmd->add_option("--error", o.error, "Stop when the estimated error of the image is below")
      ->check(
          check_number(std::numeric_limits<float>::denorm_min(), "greater than 0", largest_float));
  cmd->add_option("--report", args->report, "JSON report of time, memory and what was built");
  cmd->add_flag("--quiet", args->quiet, "No progress, no warnings, no summary");
  cmd->callback([args, cmd] {
    // A budget in time or error without a number of samples: as many as it takes.
    bool budget = args->trace.seconds > 0 || args->trace.error > 0;
    if (budget && cmd->count("--samples") == 0) args->trace.samples = unlimited_samples;
  });
  return [args, command_line] { return run_render(*args, command_line); };
}
