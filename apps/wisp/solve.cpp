#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <stdexcept>

#include "commands.h"
#include "console.h"
#include "empty_domain.h"
#include "estimators.h"
#include "option_checks.h"
#include "pde_scene.h"
#include "render_component.h"
#include "run_report.h"
#include "section_files.h"
#include "section_outline.h"
#include "solve_files.h"
#include "solve_result.h"
#include "solve_task.h"
#include "wisp/core/parallel.h"
#include "wisp/scene/io.h"

namespace {

std::string error_text(double error) {
  return std::isfinite(error) ? fmt::format("{:.2g}", error) : "unknown";
}

std::string count_text(double n) {
  if (n < 1e5) return fmt::format("{:.0f}", n);
  if (n < 1e8) return fmt::format("{:.2f} M", n * 1e-6);
  return fmt::format("{:.1f} G", n * 1e-9);
}

std::string progress_text(const wisp::solve_options::progress& p,
                          const wisp::solve_options& options) {
  const auto done = static_cast<double>(p.walks);
  const double rate = done / std::max(p.seconds, 1e-9);
  double left = std::numeric_limits<double>::infinity();
  if (p.planned > 0) left = std::max(0.0, static_cast<double>(p.planned) - done) / rate;
  left = std::min(left, std::max(0.0, options.seconds - p.seconds));
  if (options.error > 0 && p.error > 0) {
    const double ratio = p.error / options.error;
    left = std::min(left, std::max(0.0, p.seconds * (ratio * ratio - 1)));
  }
  std::string text = fmt::format("solve: {} walks, {:.0f} k walks/s, error {}", count_text(done),
                                 rate * 1e-3, error_text(p.error));
  if (std::isfinite(left)) text += ", " + format_duration(left) + " left";
  return text;
}

void save_outputs(const solve_arguments& args, const wisp::scene_data& scene,
                  const solve_task& task, const std::vector<wisp::dvec3>& points,
                  const wisp::section_grid& grid, const wisp::solution& solution,
                  const scene_problem& problem,
                  std::vector<std::pair<std::string, std::string>> metadata) {
  section_image image;
  section_style style;
  if (task.section != wisp::invalid_id) {
    const auto& section = scene.sections[static_cast<std::size_t>(task.section)];
    image = make_image(grid, solution, problem.problem.channels);
    image.distance = section_distances(problem.problem.domain, grid, args.threads);
    style = {section.colormap, section.range, section.contours, section.name, std::move(metadata)};
  }
  // All are tried: the failure of one must not cost the others.
  std::exception_ptr failure;
  for (const auto& output : args.outputs) try {
      if (is_table(output)) {
        save_points(output, points, solution, problem.problem.channels, problem.exact);
      } else {
        save_section(output, image, style);
      }
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  if (failure) std::rethrow_exception(failure);
}

int run_solve(const solve_arguments& args, const std::string& command_line) {
  check_files(args);
  progress_line line(args.quiet);
  phase_timer timer;
  wisp::warning_list warnings;

  timer.start("load");
  line.show("load: " + args.scene);
  solve_task task;
  auto scene = load_task(args, task, warnings);
  std::vector<wisp::dvec3> points;
  if (!args.points.empty()) points = load_points(args.points);
  const auto& data = scene.problems[static_cast<std::size_t>(task.problem)];
  const std::string problem_place = fmt::format("problems[{}]", task.problem);

  timer.start("build");
  line.show("build: the domain");
  auto problem = make_problem(scene, task.problem, args.threads, warnings);
  wisp::section_options options;
  options.solve = make_options(args, data);
  const bool is_section = task.section != wisp::invalid_id;
  for (auto& unused : choose_estimators(args.estimators, problem.problem, is_section, options)) {
    warnings.push_back(std::move(unused));
  }
  wisp::section_grid grid;
  if (is_section) {
    blame(args.scene, fmt::format("sections[{}]", task.section), [&] {
      grid = make_section_grid(problem.problem.domain,
                               make_plane(scene.sections[static_cast<std::size_t>(task.section)]),
                               args.threads);
    });
    points = grid.points;
  }
  timer.stop();
  line.clear();
  print_warnings(warnings, args.quiet);

  timer.start("solve");
  watch_interrupts();
  options.solve.on_progress = [&](const wisp::solve_options::progress& p) {
    line.show(progress_text(p, options.solve));
    return !interrupt_flag().load();
  };
  const wisp::solution solution = blame(args.scene, problem_place, [&] {
    return is_section ? solve_section(problem.problem, grid, options)
                      : solve(problem.problem, points, options.solve);
  });
  timer.stop();
  line.clear();
  const bool interrupted = interrupt_flag();
  const double seconds = timer.seconds("solve");
  if (interrupted && solution.walks == 0) {
    fmt::print(stderr, "wisp: stopped before the first walk; nothing saved\n");
    return exit_interrupted;
  }
  const solve_summary summary = summarize(solution, points, problem);
  if (!data.exterior && !has_inside(solution) &&
      (problem.flat || is_surely_empty(problem.problem.domain))) {
    throw wisp::file_error(args.scene, problem_place + ".domain",
                           problem.flat ? "has no inside, as the mesh is flat"
                                        : "has no inside; there is nothing to solve in it");
  }
  auto found = find_warnings(solution, summary, points.size(), options.solve);
  if (interrupted && summary.unsolved > 0) {
    found.push_back(fmt::format("{} of {} points are nan, as no walk was made for them yet",
                                summary.unsolved, points.size()));
  }
  print_warnings(found, args.quiet);
  warnings.insert(warnings.end(), found.begin(), found.end());

  timer.start("save");
  save_outputs(args, scene, task, points, grid, solution, problem,
               {{"wisp:version", WISP_VERSION},
                {"wisp:command", command_line},
                {"wisp:scene", args.scene},
                {"wisp:problem", data.name},
                {"wisp:walks", std::to_string(solution.walks)},
                {"wisp:error", fmt::format("{}", summary.error)},
                {"wisp:seconds", fmt::format("{:.3f}", seconds)},
                {"wisp:seed", std::to_string(args.seed)}});
  timer.stop();

  if (!args.report.empty()) {
    using json = nlohmann::ordered_json;
    finish_parts(problem);
    problem.parts.push_back({"gradients", args.gradient,
                             args.gradient ? "asked for by --gradient" : "not asked for", 0, 0});
    const auto known = [](double v) { return std::isfinite(v) ? json(v) : json(); };
    json report = {{"wisp", WISP_VERSION},
                   {"command", command_line},
                   {"scene", args.scene},
                   {"problem", data.name},
                   {"threads", wisp::thread_count(args.threads)},
                   {"seconds", timer.wall()},
                   {"cpu_seconds", timer.cpu()},
                   {"peak_memory_bytes", peak_memory_bytes()},
                   {"points", points.size()},
                   {"outside", summary.outside},
                   {"singular", summary.singular},
                   {"undefined", summary.undefined},
                   {"walks", solution.walks},
                   {"steps", solution.steps},
                   {"unfinished", solution.unfinished},
                   {"error", known(summary.error)},
                   {"interrupted", interrupted},
                   {"warnings", warnings},
                   {"parts", parts_json(problem.parts)}};
    if (problem.exact) report["rmse"] = known(summary.rmse);
    if (is_section) {
      report["section"] = scene.sections[static_cast<std::size_t>(task.section)].name;
      report["width"] = grid.width;
      report["height"] = grid.height;
    }
    save_text(args.report, json_text(report) + "\n");
  }
  if (!args.quiet) {
    const auto walks = static_cast<double>(solution.walks);
    fmt::print("{}{} point{}, {} walks in {}, {:.0f} k walks/s, error {}{}, peak memory {}\n",
               interrupted ? "stopped; saved what there is: " : "", points.size(),
               points.size() == 1 ? "" : "s", count_text(walks), format_duration(seconds),
               walks / std::max(seconds, 1e-9) * 1e-3, error_text(summary.error),
               problem.exact ? ", off by " + error_text(summary.rmse) : "",
               format_bytes(static_cast<double>(peak_memory_bytes())));
    for (const auto& output : args.outputs) fmt::print("{}\n", output);
  }
  return interrupted ? exit_interrupted : 0;
}

}  // namespace

command_action add_solve(CLI::App& app, const std::string& command_line) {
  auto args = std::make_shared<solve_arguments>();
  auto* cmd = app.add_subcommand("solve", "Estimate the solution of a PDE at points or sections");
  cmd->footer(
      std::string("Example:\n  wisp solve scene.json --section cut --walks 256 ") +
      (has_render ? "-o cut.png -o cut.exr\n" : "-o cut.vti -o cut.csv\n") +
      "  wisp solve scene.json --problem heat --points points.csv --gradient -o heat.csv\n" +
      estimator_help());
  constexpr double smallest = std::numeric_limits<double>::denorm_min();
  cmd->add_option("scene", args->scene, "Scene file, .json")->required();
  cmd->add_option("-o,--output", args->outputs,
                  std::string("File to write: .csv; for sections also ") +
                      (has_render ? ".png .exr .vti" : ".vti") + "; may be given several times")
      ->required()
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  cmd->add_option("--problem", args->problem, "Problem by name; default: the first");
  cmd->add_option("--points", args->points, "Where to solve: a .csv with columns x,y,z");
  cmd->add_option("--section", args->section,
                  "Where to solve: a section by name; default: that of the problem");
  cmd->add_option("--walks", args->walks,
                  "Walks for each point, or at most that many with a budget below; default: those "
                  "of the problem")
      ->check(check_whole(1, std::uint64_t{1} << 40))
      ->option_text("N");
  cmd->add_option("--epsilon", args->epsilon,
                  "Width of the shell at the boundary in which walks end, in scene units")
      ->check(check_number(smallest, "greater than 0"))
      ->option_text("E");
  cmd->add_option("--max-steps", args->max_steps, "Most steps of a walk")
      ->check(CLI::Range(1, std::numeric_limits<int>::max()))
      ->option_text("N");
  cmd->add_flag("--gradient", args->gradient, "Gradients too, as columns of .csv");
  cmd->add_option("--estimator", args->estimators, "How to estimate: names from the list below")
      ->delimiter(',')
      ->option_text("NAME,...");
  cmd->add_option("--time", args->time, "Stop after this many seconds of walking")
      ->check(check_number(smallest, "greater than 0"));
  cmd->add_option("--error", args->error,
                  "Stop when the standard error of each point is below this")
      ->check(check_number(smallest, "greater than 0"));
  cmd->add_option("--seed", args->seed, "Seed of the random numbers")
      ->check(check_whole(0, std::numeric_limits<std::uint64_t>::max()))
      ->option_text("N=0");
  cmd->add_option("--threads", args->threads, "Threads; 0: all")
      ->check(CLI::Range(0, 4096))
      ->option_text("N=0");
  cmd->add_option("--report", args->report, "JSON report of time, memory and what was built");
  cmd->add_flag("--quiet", args->quiet, "No progress, no warnings, no summary");
  return [args, command_line] { return run_solve(*args, command_line); };
}
