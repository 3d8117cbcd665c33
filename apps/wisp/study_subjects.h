#pragma once

// What wisp study can study, made of its arguments.

#include <functional>
#include <string>
#include <vector>

#include "solve_task.h"
#include "study.h"
#include "wisp/core/error.h"

struct study_arguments {
  std::string output;
  std::vector<std::uint64_t> budgets = {};
  int repeats = 3;
  std::string reference;
  std::vector<std::string> images = {};
  std::vector<double> image_seconds = {};
  std::vector<std::string> compare = {};
  bool no_plots = false;
  bool picture = false;  // of a scene that has problems, too
  // of pictures
  std::string resolution, camera, filter;
  int bounces = -1;
  double clamp = 0;
  // of PDEs; and the scene, the seed, threads, budgets of time and error, --report, --quiet
  solve_arguments solve = {};
};

// Told what is being done; false stops.
using study_watch = std::function<bool(const std::string&)>;

// Both throw usage_error and wisp::file_error.
study_subject make_picture_subject(const study_arguments& args, const study_watch& watch,
                                   wisp::warning_list& warnings);
study_subject make_pde_subject(const study_arguments& args, const study_watch& watch,
                               wisp::warning_list& warnings);
