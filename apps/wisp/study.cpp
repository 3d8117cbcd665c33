// wisp study: error against run time.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <span>

#include "commands.h"
#include "console.h"
#include "estimators.h"
#include "option_checks.h"
#include "run_report.h"
#include "study_compare.h"
#include "study_json.h"
#include "study_measures.h"
#include "study_page.h"
#include "study_plot.h"
#include "study_runs.h"
#include "study_subjects.h"
#include "wisp/core/parallel.h"

namespace fs = std::filesystem;

namespace {

// A folder, with those above it that it needs, that goes away again if nothing comes into it.
class output_folder {
 public:
  explicit output_folder(const std::string& path) {
    if (path.empty()) throw usage_error("-o: is empty; give a folder");
    std::error_code error;
    if (fs::exists(path, error) && !fs::is_directory(path)) {
      throw wisp::file_error(path, "", "is a file, where a folder is to be");
    }
    for (auto p = fs::absolute(path); !fs::exists(p, error) && p != p.parent_path();
         p = p.parent_path())
      made_.push_back(p);
    fs::create_directories(path, error);
    if (error) {
      remove();
      throw wisp::file_error(path, "", "cannot be made: " + error.message());
    }
    if (access(path.c_str(), W_OK) != 0) {
      throw wisp::file_error(path, "", "is a folder without the right to write in it");
    }
  }
  ~output_folder() { remove(); }
  output_folder(const output_folder&) = delete;
  output_folder& operator=(const output_folder&) = delete;

 private:
  void remove() const {
    std::error_code ignored;
    for (const auto& folder : made_) fs::remove(folder, ignored);  // only if it is empty
  }

  std::vector<fs::path> made_;  // the innermost first
};

// "1,2,4" and "4..256", which doubles.
std::vector<std::uint64_t> parse_budgets(const std::string& text) {
  const auto fail = [&] {
    throw usage_error(fmt::format(
        "--budgets: '{}' must be whole numbers from 1, as 1,2,4 or, doubling, 4..256", text));
  };
  const auto whole = [&](std::string_view digits) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size() || value == 0 ||
        value > (std::uint64_t{1} << 40))
      fail();
    return value;
  };
  std::vector<std::uint64_t> budgets;
  for (std::size_t at = 0; at <= text.size();) {
    const auto comma = std::min(text.find(',', at), text.size());
    const std::string_view item = std::string_view(text).substr(at, comma - at);
    at = comma + 1;
    if (const auto dots = item.find(".."); dots != std::string_view::npos) {
      const auto first = whole(item.substr(0, dots)), last = whole(item.substr(dots + 2));
      if (first > last) fail();
      for (auto b = first; b <= last; b *= 2) budgets.push_back(b);
    } else {
      budgets.push_back(whole(item));
    }
  }
  std::sort(budgets.begin(), budgets.end());
  budgets.erase(std::unique(budgets.begin(), budgets.end()), budgets.end());
  return budgets;
}

bool asks_for_problem(const solve_arguments& s) {
  return !s.problem.empty() || !s.points.empty() || !s.section.empty() || !s.estimators.empty() ||
         s.gradient || s.epsilon > 0 || s.max_steps > 0;
}
bool asks_for_picture(const study_arguments& args) {
  return args.picture || !args.resolution.empty() || !args.camera.empty() || args.bounces >= 0 ||
         !args.filter.empty() || args.clamp > 0;
}

void check_arguments(const study_arguments& args) {
  if (args.compare.empty() && args.solve.scene.empty()) {
    throw usage_error("give a scene, or --compare with two files study.json");
  }
  if (!args.compare.empty() && !args.solve.scene.empty()) {
    throw usage_error("a scene and --compare exclude each other");
  }
  if (args.compare.size() == 1) throw usage_error("--compare: give at least two files study.json");
  if (args.images.size() != args.image_seconds.size()) {
    throw usage_error("each --image needs its --seconds, the time that it took to make");
  }
  if (asks_for_problem(args.solve) && asks_for_picture(args)) {
    throw usage_error(
        "options of pictures (--picture, --resolution, --camera, --bounces, --filter, --clamp) and "
        "of problems (--problem, --points, --section, --estimator, --gradient, --epsilon, "
        "--max-steps) exclude each other");
  }
}

// What a study is made of must outlive it, and so must its report.
void check_inputs(const study_arguments& args) {
  const fs::path folder(args.output);
  std::vector<const char*> written = {"compare.json", "compare.svg", "compare.png", "index.html"};
  if (args.compare.empty()) {
    written = {"study.csv", "runs.csv", "study.json", "study.svg", "study.png", "index.html"};
    if (args.reference.empty()) written.insert(written.end(), {"reference.csv", "reference.exr"});
  }
  std::vector<std::string> kept = {args.solve.scene, args.solve.points, args.reference,
                                   args.solve.report};
  for (const auto* files : {&args.images, &args.compare})
    kept.insert(kept.end(), files->begin(), files->end());
  for (const auto& file : kept) {
    for (const char* name : written) {
      if (file.empty() || !same_file(file, (folder / name).string())) continue;
      throw usage_error(
          fmt::format("-o: '{}' would be overwritten by the study; give another folder", file));
    }
  }
  std::error_code ignored;
  if (!args.compare.empty() && fs::exists(folder / "study.json", ignored)) {
    throw usage_error(fmt::format(
        "-o: '{}' holds a study, whose index.html would be overwritten; give another folder",
        args.output));
  }
}

// Where options do not tell: the problems of a scene that has some. Reading one tells what
// is wrong with a file that is no JSON, in a wisp that cannot render too.
bool means_problem(const study_arguments& args) {
  if (asks_for_picture(args)) return false;
  if (asks_for_problem(args.solve)) return true;
  if (ending(args.solve.scene) != ".json") return false;
  std::ifstream in(args.solve.scene, std::ios::binary);
  const auto scene = nlohmann::json::parse(in, nullptr, false);
  if (!scene.is_object()) return true;
  return scene.contains("problems") && !scene["problems"].empty();
}

study_subject make_subject(const study_arguments& args, const study_watch& watch,
                           wisp::warning_list& warnings) {
  if (means_problem(args)) return make_pde_subject(args, watch, warnings);
  return make_picture_subject(args, watch, warnings);
}

// The plots, and the page with them. Those of an earlier study go, also where there are none
// of this one: a failure leaves a page without.
void save_page(const study_arguments& args, std::span<const study_result> studies,
               std::span<const std::string> names, const std::string& plot,
               const std::function<std::string()>& page) {
  const auto file = fs::path(args.output) / "index.html";
  remove_plots(args.output, plot);
  try {
    if (!args.no_plots) plot_studies(studies, names, args.output, plot);
  } catch (const wisp::file_error&) {
    save_text(file, page());
    throw;
  }
  save_text(file, page());
}

void save_study(const study_arguments& args, const study_result& result) {
  const fs::path folder(args.output);
  save_text(folder / "study.csv", rows_csv(result));
  save_text(folder / "runs.csv", runs_csv(result));
  save_text(folder / "study.json", json_text(study_json(result)) + "\n");
  const std::string names[] = {result.title};
  save_page(args, {&result, 1}, names, "study", [&] { return study_page(result, folder); });
}

int run_compare(const study_arguments& args, const std::string& command_line) {
  check_inputs(args);
  if (!args.no_plots) check_gnuplot();
  std::vector<study_result> studies;
  for (const auto& file : args.compare) studies.push_back(load_study(file));
  const auto names = name_studies(studies, args.compare);
  const auto differences = find_differences(studies, args.compare);
  const output_folder made(args.output);
  const fs::path folder(args.output);
  using json = nlohmann::ordered_json;
  const auto known = [](double v) { return std::isfinite(v) ? json(v) : json(); };
  json list = json::array();
  for (std::size_t i = 0; i < studies.size(); ++i) {
    const auto r = compare_studies(studies[i], studies[0]);
    list.push_back({{"name", names[i]},
                    {"file", args.compare[i]},
                    {"slope", known(studies[i].time_fit.slope)},
                    {"slope_half_width_95", known(studies[i].time_fit.half_width)},
                    {"at_error", known(r.error)},
                    {"time_ratio", known(r.time)},
                    {"time_ratio_low_95", known(r.low)},
                    {"time_ratio_high_95", known(r.high)},
                    {"extrapolated", r.outside}});
  }
  const json report = {{"wisp", WISP_VERSION},
                       {"command", command_line},
                       {"studies", list},
                       {"differences", differences}};
  save_text(folder / "compare.json", json_text(report) + "\n");
  save_page(args, studies, names, "compare",
            [&] { return compare_page(studies, names, differences, folder, command_line); });
  if (!args.solve.quiet) {
    fmt::print("{}\n{}\n", compare_text(studies, names, differences),
               (folder / "index.html").string());
  }
  return 0;
}

int run_study(const study_arguments& args, const std::string& command_line) {
  check_arguments(args);
  if (!args.compare.empty()) return run_compare(args, command_line);
  check_inputs(args);
  const output_folder made(args.output);
  check_files(args.solve);
  if (!args.no_plots) check_gnuplot();
  progress_line line(args.solve.quiet);
  watch_interrupts();
  wisp::warning_list warnings;
  study_result result;
  try {
    const auto watch = [&](const std::string& text) {
      line.show(text);
      return !interrupt_flag().load();
    };
    const study_subject subject = make_subject(args, watch, warnings);
    line.clear();
    print_warnings(warnings, args.solve.quiet);
    const auto budgets = args.budgets.empty() ? subject.budgets : args.budgets;
    if (budgets.back() > subject.most) {
      throw usage_error(fmt::format("--budgets: {} {} are more than {}", budgets.back(),
                                    subject.unit, subject.most));
    }
    result.version = WISP_VERSION;
    result.command = command_line;
    result.scene = args.solve.scene;
    result.kind = subject.kind;
    result.title = subject.title;
    result.unit = subject.unit;
    result.size = subject.size;
    result.method = subject.method;
    result.threads = wisp::thread_count(args.solve.threads);
    result.machine = describe_machine(result.threads);
    result.repeats = args.repeats;
    result.load_seconds = subject.load_seconds;
    result.build_seconds = subject.build_seconds;
    result.warnings = warnings;

    double total = 0;
    for (const auto b : budgets) total += static_cast<double>(b) * args.repeats;
    if (args.reference.empty() && subject.exact.empty())
      total += 16 * static_cast<double>(budgets.back());
    study_progress progress(line, total);
    // before a reference that may take hours
    std::vector<study_values> images;
    for (const auto& file : args.images) images.push_back(load_values(subject, file));
    result.reference = make_reference(args, subject, budgets.back(), progress);
    for (std::size_t i = 0; i < images.size(); ++i) {
      result.images.push_back(
          {args.images[i], args.image_seconds[i], measure_errors(images[i], result.reference)});
    }
    const auto& wanted = result.reference.values.mean;
    const auto known =
        std::count_if(wanted.begin(), wanted.end(), [](double v) { return std::isfinite(v); });
    if (const auto unknown = static_cast<std::ptrdiff_t>(wanted.size()) - known; unknown > 0) {
      result.warnings.push_back(
          fmt::format("the reference has no number for {} of {} values, which do not count",
                      unknown, wanted.size()));
    }
    make_runs(args, subject, budgets, progress, result);
    line.clear();
    if (result.runs.empty()) throw study_interrupted();
    result.time_fit = fit_time(result.runs);
    result.budget_fit = fit_budget(result.runs);
    save_study(args, result);
    if (!args.solve.report.empty()) {
      const nlohmann::ordered_json report = {
          {"wisp", WISP_VERSION},
          {"command", command_line},
          {"scene", args.solve.scene},
          {"threads", result.threads},
          {"seconds", {{"load", result.load_seconds}, {"build", result.build_seconds}}},
          {"peak_memory_bytes", peak_memory_bytes()},
          {"interrupted", result.interrupted},
          {"warnings", warnings},
          {"parts", parts_json(subject.parts())}};
      save_text(args.solve.report, json_text(report) + "\n");
    }
  } catch (const study_interrupted&) {
    line.clear();
    fmt::print(stderr, "wisp: stopped before the first run; {}\n",
               result.reference.kind == "run" ? "saved is the reference alone" : "nothing saved");
    return exit_interrupted;
  }
  if (!args.solve.quiet) {
    fmt::print("{}\n{}\n", study_text(result), (fs::path(args.output) / "index.html").string());
  }
  return result.interrupted ? exit_interrupted : 0;
}

}  // namespace

command_action add_study(CLI::App& app, const std::string& command_line) {
  auto args = std::make_shared<study_arguments>();
  auto budgets = std::make_shared<std::string>();
  auto& s = args->solve;
  constexpr double smallest = std::numeric_limits<double>::denorm_min();
  auto* cmd = app.add_subcommand("study", "Measure error against run time, of a picture or a PDE");
  cmd->footer(
      "Example:\n  wisp study scene.json -o folder --budgets 1..256 --repeats 5\n"
      "  wisp study scene.json -o folder --section cut --estimator independent\n"
      "  wisp study --compare a/study.json b/study.json -o both\n"
      "Writes study.csv, runs.csv, study.json, study.svg, study.png and index.html. Without a "
      "known "
      "solution or --reference, the reference is a run of 16 times the largest budget, which is "
      "kept as reference.exr or .csv.\n" +
      estimator_help());
  cmd->add_option("scene", s.scene, "Scene file");
  cmd->add_option("-o,--output", args->output, "Folder to write; it is made")->required();
  cmd->add_option("--budgets", *budgets,
                  "Samples or walks, as 1,2,4 or, doubling, 4..256; default: seven")
      ->option_text("LIST");
  cmd->add_option("--repeats", args->repeats, "Runs of each budget, with different seeds")
      ->check(CLI::Range(1, 10000))
      ->option_text("N=3");
  cmd->add_option("--reference", args->reference,
                  "What is true: .exr of a picture, .csv of a PDE, as wisp writes them");
  cmd->add_option("--image", args->images,
                  "Another program's result, to be marked in the plot; may be given several times")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  cmd->add_option("--seconds", args->image_seconds, "How long that image took")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->check(check_number(smallest, "greater than 0"))
      ->option_text("S");
  cmd->add_option("--compare", args->compare, "Files study.json to lay side by side")
      ->option_text("A.json B.json ...");
  cmd->add_flag("--no-plots", args->no_plots, "Without study.svg and .png, which need gnuplot");
  cmd->add_flag("--picture", args->picture, "The picture of a scene that has problems, too");
  cmd->add_option("--resolution", args->resolution, "Of pictures: W or WxH; default: 256");
  cmd->add_option("--camera", args->camera, "Of pictures: camera by name; default: the first");
  cmd->add_option("--bounces", args->bounces, "Of pictures: most scattering events on a path")
      ->check(CLI::Range(0, 65536))
      ->option_text("N=64");
  cmd->add_option("--filter", args->filter,
                  "Of pictures: box, tent, gaussian, blackman-harris (default)")
      ->check(CLI::IsMember({"box", "tent", "gaussian", "blackman-harris"}).description(""));
  cmd->add_option("--clamp", args->clamp, "Of pictures: largest radiance of a path; 0: none")
      ->check(check_number(0, "of at least 0", std::numeric_limits<float>::max()))
      ->option_text("X=0");
  cmd->add_option("--problem", s.problem, "Of PDEs: problem by name; default: the first");
  cmd->add_option("--points", s.points, "Of PDEs: where to solve, a .csv with columns x,y,z");
  cmd->add_option("--section", s.section, "Of PDEs: a section by name");
  cmd->add_option("--estimator", s.estimators, "Of PDEs: names from the list below")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("NAME,...");
  cmd->add_flag("--gradient", s.gradient, "Of PDEs: errors of gradients rather than values");
  cmd->add_option("--epsilon", s.epsilon, "Of PDEs: width of the shell, in scene units")
      ->check(check_number(smallest, "greater than 0"))
      ->option_text("E");
  cmd->add_option("--max-steps", s.max_steps, "Of PDEs: most steps of a walk")
      ->check(CLI::Range(1, std::numeric_limits<int>::max()))
      ->option_text("N");
  cmd->add_option("--time", s.time,
                  "Start no run after this many seconds of estimating, the reference not counted")
      ->check(check_number(smallest, "greater than 0"));
  cmd->add_option("--error", s.error,
                  "Leave out larger budgets once a run estimates its error below this")
      ->check(check_number(smallest, "greater than 0"));
  cmd->add_option("--seed", s.seed, "Of the reference; runs have those that follow")
      ->check(check_whole(0, std::numeric_limits<std::uint64_t>::max()))
      ->option_text("N=0");
  cmd->add_option("--threads", s.threads, "Threads; 0: all")
      ->check(CLI::Range(0, 4096))
      ->option_text("N=0");
  cmd->add_option("--report", s.report, "JSON report of time, memory and what was built");
  cmd->add_flag("--quiet", s.quiet, "No progress, no warnings, no summary");
  return [args, budgets, command_line, cmd] {
    if (!args->compare.empty()) {
      const std::set<std::string> used = {"scene",      "--output",  "--compare",
                                          "--no-plots", "--threads", "--quiet"};
      for (const auto* option : cmd->get_options()) {
        if (option->count() == 0 || used.contains(option->get_name())) continue;
        throw usage_error("--compare reads studies that are there, and has no use for " +
                          option->get_name());
      }
    }
    if (!budgets->empty()) args->budgets = parse_budgets(*budgets);
    return run_study(*args, command_line);
  };
}
