#pragma once

// What wisp solve is asked for: its arguments, held against each other, the files and the
// scene.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "wisp/core/error.h"
#include "wisp/pde/solve.h"
#include "wisp/scene/scene.h"

struct solve_arguments {
  std::string scene;
  std::vector<std::string> outputs;
  std::string problem;
  std::string points;
  std::string section;
  std::vector<std::string> estimators;
  std::string report;
  std::uint64_t walks = 0;  // 0: those of the problem
  int max_steps = 0;
  double epsilon = 0;
  double time = 0;
  double error = 0;
  bool gradient = false;
  std::uint64_t seed = 0;
  int threads = 0;
  bool quiet = false;
};

// The ending of a file's name in lower case, with its point.
std::string ending(const std::string& path);
inline bool is_table(const std::string& path) { return ending(path) == ".csv"; }
// Whether two paths are of one file, also of one that is not there yet.
bool same_file(const std::string& a, const std::string& b);

// Throws usage_error for arguments that do not go together, and wisp::file_error for
// files that could not be written: before hours of walking rather than after.
void check_files(const solve_arguments& args);

// What is to be solved: a problem of the scene, on a section of it or at points.
struct solve_task {
  int problem = wisp::invalid_id;
  int section = wisp::invalid_id;
};
// Throws usage_error, and wisp::file_error for a scene without problems.
solve_task find_task(const wisp::scene_data& scene, const solve_arguments& args);

// The scene, with what its task needs and nothing else. Throws as find_task, and
// wisp::file_error.
wisp::scene_data load_task(const solve_arguments& args, solve_task& task,
                           wisp::warning_list& warnings);

// Those of the problem where the arguments do not tell.
wisp::solve_options make_options(const solve_arguments& args, const wisp::problem_data& problem);

// Mistakes that only the library knows are those of the file, or of an option.
template <typename F>
auto blame(const std::string& file, const std::string& place, F&& f) {
  try {
    return f();
  } catch (const std::invalid_argument& error) {
    throw wisp::file_error(file, place, error.what());
  }
}
