#include "solve_task.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>

#include "commands.h"
#include "pde_scene.h"
#include "render_component.h"
#include "section_files.h"
#include "wisp/scene/io.h"

namespace fs = std::filesystem;

namespace {

void check_folder(const std::string& output) {
  const auto folder = fs::absolute(output).parent_path();
  if (!fs::is_directory(folder)) {
    throw wisp::file_error(output, "",
                           fmt::format("the folder '{}' does not exist", folder.string()));
  }
  if (fs::is_directory(output)) throw wisp::file_error(output, "", "is a folder");
  if (access(folder.c_str(), W_OK) != 0) {
    throw wisp::file_error(output, "",
                           fmt::format("there is no right to write in '{}'", folder.string()));
  }
}

}  // namespace

std::string ending(const std::string& path) {
  return CLI::detail::to_lower(fs::path(path).extension().string());
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error);
}

void check_files(const solve_arguments& args) {
  if (!args.points.empty() && !args.section.empty()) {
    throw usage_error("--points and --section exclude each other");
  }
  for (const auto& output : args.outputs) {
    if (is_table(output)) continue;
    if (!can_save_section(output) && !is_section_image(output)) {
      throw usage_error(fmt::format("-o: '{}' must end in {}", output,
                                    has_render ? ".csv, .exr, .png or .vti" : ".csv or .vti"));
    }
    if (!args.points.empty()) {
      throw usage_error(fmt::format("-o: '{}' shows a section; points go to .csv", output));
    }
    if (!can_save_section(output)) {
      throw usage_error(needs_render(fmt::format("-o: '{}' is an image, which", output)) +
                        "; .csv and .vti can be written");
    }
  }
  auto written = args.outputs;
  if (!args.report.empty()) written.push_back(args.report);
  for (std::size_t i = 0; i < written.size(); ++i) {
    if (same_file(written[i], args.scene)) {
      throw usage_error(fmt::format("-o: '{}' is the scene itself", written[i]));
    }
    if (!args.points.empty() && same_file(written[i], args.points)) {
      throw usage_error(fmt::format("-o: '{}' holds the points", written[i]));
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (same_file(written[i], written[k])) {
        throw usage_error(fmt::format("-o: '{}' is given twice", written[i]));
      }
    }
    check_folder(written[i]);
  }
  for (const auto& output : args.outputs) {
    if (!is_table(output)) check_section_output(output);
  }
}

solve_task find_task(const wisp::scene_data& scene, const solve_arguments& args) {
  solve_task task;
  task.problem = find_problem(scene, args.problem);
  if (!args.points.empty()) return task;
  std::string names;
  int count = 0;
  for (std::size_t i = 0; i < scene.sections.size(); ++i) {
    const auto& section = scene.sections[i];
    if (!args.section.empty()) {
      names += (names.empty() ? "" : ", ") + section.name;
      if (section.name != args.section) continue;
      if (!args.problem.empty() && section.problem != task.problem) {
        throw usage_error(fmt::format(
            "--section: '{}' cuts the problem '{}', not '{}'", args.section,
            scene.problems[static_cast<std::size_t>(section.problem)].name, args.problem));
      }
      return {section.problem, static_cast<int>(i)};
    }
    if (section.problem != task.problem) continue;
    names += (names.empty() ? "" : ", ") + section.name;
    task.section = static_cast<int>(i);
    ++count;
  }
  if (!args.section.empty()) {
    throw usage_error(fmt::format("--section: the scene has no section '{}'; it has: {}",
                                  args.section, names.empty() ? "none" : names));
  }
  const auto& name = scene.problems[static_cast<std::size_t>(task.problem)].name;
  if (count == 0) {
    throw usage_error(
        fmt::format("the scene has no section of the problem '{}'; give --points FILE.csv", name));
  }
  if (count > 1) {
    throw usage_error(fmt::format(
        "the problem '{}' has {} sections; give --section with one of: {}", name, count, names));
  }
  return task;
}

wisp::scene_data load_task(const solve_arguments& args, solve_task& task,
                           wisp::warning_list& warnings) {
  if (ending(args.scene) != ".json") {
    throw wisp::file_error(args.scene, "", "holds no problems; problems are part of .json scenes");
  }
  wisp::scene_load_options load;
  load.choose_problem = [&](const wisp::scene_data& scene) {
    task = find_task(scene, args);
    return task.problem;
  };
  return wisp::load_json_scene(args.scene, warnings, load);
}

wisp::solve_options make_options(const solve_arguments& args, const wisp::problem_data& problem) {
  wisp::solve_options options;
  options.walks = args.walks > 0 ? args.walks : static_cast<std::uint64_t>(problem.walks);
  options.epsilon = args.epsilon > 0 ? args.epsilon : problem.epsilon;
  options.max_steps = args.max_steps > 0 ? args.max_steps : problem.max_steps;
  options.gradient = args.gradient;
  options.seed = args.seed;
  options.threads = args.threads;
  options.error = args.error;
  if (args.time > 0) options.seconds = args.time;
  if (args.walks > 0) options.max_walks = args.walks;
  // With a budget, --walks is a cap: how many the first walks are follows from the problem.
  if (args.error > 0 || args.time > 0)
    options.walks = std::min(options.walks, static_cast<std::uint64_t>(problem.walks));
  return options;
}
