#pragma once

// The reference of a study and its runs.

#include <chrono>
#include <string>

#include "console.h"
#include "study.h"
#include "study_subjects.h"

// Budgets of all runs, and how many are done: what the time left follows from.
class study_progress {
 public:
  study_progress(progress_line& line, double total) : line_(line), total_(total) {}

  std::optional<study_measurement> run(const study_subject& subject, std::uint64_t budget,
                                       std::uint64_t seed, const std::string& text);

 private:
  void show(const std::string& text, double part);

  progress_line& line_;
  double total_, done_ = 0;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Of a file that is held against runs. Throws wisp::file_error.
study_values load_values(const study_subject& subject, const std::string& file);

// The reference, and where it is a run of its own a file of it. Throws wisp::file_error and
// study_interrupted.
study_reference make_reference(const study_arguments& args, const study_subject& subject,
                               std::uint64_t largest, study_progress& progress);

// All runs, repeat by repeat, so that a study that is stopped has a curve, and a machine
// that slows down slows all budgets.
void make_runs(const study_arguments& args, const study_subject& subject,
               std::vector<std::uint64_t> budgets, study_progress& progress, study_result& result);
