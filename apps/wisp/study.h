#pragma once

// Error against run time: what wisp study measures.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "wisp/core/report.h"

// Thrown when Ctrl-C came before there was anything to save.
struct study_interrupted {};

inline constexpr double study_unknown = std::numeric_limits<double>::quiet_NaN();

// What a run gives: numbers, and the standard errors that the program itself estimates.
// NaN where there is none (points outside of a domain, pixels of one sample).
struct study_values {
  std::vector<double> mean = {};
  std::vector<double> error = {};  // empty: of none
};

struct study_measurement {
  study_values values = {};
  double build_seconds = 0;  // of what a run builds anew
  double seconds = 0;        // of estimating alone, wall clock
  double cpu_seconds = 0;
  std::uint64_t walks = 0, unfinished = 0;  // of PDEs: all, and those cut short
};

// How far values are from their reference. Means are over the values that both have.
struct study_errors {
  std::size_t count = 0;           // of values
  std::size_t missing = 0;         // that the reference has and the run has not
  double mse = study_unknown;      // mean squared error; that of the reference is in it
  double rmse = study_unknown;     // its root
  double relmse = study_unknown;   // mean of d^2 / (r^2 + s), see study_reference
  double maximum = study_unknown;  // largest |d|
  // The root mean square of the standard errors that the run itself estimates, and the
  // fraction of values whose 95 % interval, mean +- 1.96 standard errors, holds the
  // reference. Values without noise (an empty pixel) do not count.
  double estimated = study_unknown;
  double coverage = study_unknown;
};

struct study_run {
  std::uint64_t budget = 0, seed = 0;
  int repeat = 0;
  double seconds = 0, cpu_seconds = 0, build_seconds = 0;
  study_errors errors = {};
};

// All repeats of a budget: medians of times, means of squared errors.
struct study_row {
  std::uint64_t budget = 0;
  int repeats = 0;
  double seconds = 0, cpu_seconds = 0;
  study_errors errors = {};
  double efficiency = study_unknown;  // 1 / (mse * seconds)
  // Between repeats: the root mean square of the standard deviations of values, which is
  // what `estimated` should be; and what of the error repeats have in common, NaN where it
  // does not stand out of the noise. Of two repeats or more.
  double deviation = study_unknown;
  double bias = study_unknown;
};

// y = intercept + slope x by least squares, with what tells how sure that is.
struct study_fit {
  int count = 0;
  double slope = study_unknown, intercept = study_unknown;
  double half_width = study_unknown;  // of the slope's 95 % interval, by Student's t
  double mean_x = 0, sum_xx = 0;      // sum of (x - mean_x)^2
  double residual = 0;                // standard deviation
};

// What runs are held against.
struct study_reference {
  std::string kind;    // "exact", "file", "run"
  std::string source;  // the formula, the file or the run
  study_values values = {};
  double error = 0;    // root mean square of its standard errors; 0: none known
  double seconds = 0;  // to make it, of runs
  // Added to squares of the reference in relative errors, so that zeros do not count for
  // everything: 0.01 for pictures, a hundredth of the mean square for PDEs.
  double relative_floor = 0.01;
};

// A picture of another program at a known time.
struct study_image {
  std::string file;
  double seconds = 0;
  study_errors errors = {};
};

// What is studied: a picture or a PDE.
struct study_subject {
  std::string kind;    // "render", "pde"
  std::string title;   // "bust.json", "heat on the section cut"
  std::string unit;    // of budgets: "samples", "walks"
  std::string size;    // "256 x 320 pixels", "312 points of 3 channels"
  std::string method;  // estimators, where they are not the default
  double load_seconds = 0, build_seconds = 0;
  // One run, which tells how much of it is done, 0 to 1; nothing if it was interrupted.
  std::function<std::optional<study_measurement>(std::uint64_t budget, std::uint64_t seed,
                                                 const std::function<void(double)>& progress)>
      run;
  std::vector<std::uint64_t> budgets = {};  // where none are asked for
  std::uint64_t most = 0;                   // of a budget
  // Empty where there is no known solution.
  std::string exact_text;
  std::vector<double> exact = {};
  // Values as a file that load_reference takes back. Both throw wisp::file_error.
  std::string reference_ending;  // ".exr", ".csv"
  std::function<void(const std::filesystem::path&, const study_values&)> save_reference;
  std::function<study_values(const std::string& file)> load_reference;
  std::function<std::vector<wisp::part_report>()> parts;  // for --report
};

struct study_result {
  std::string version, command, scene, kind, title, unit, size, method, machine;
  int threads = 0, repeats = 0;
  double load_seconds = 0, build_seconds = 0;
  study_reference reference = {};
  std::vector<study_run> runs = {};
  std::vector<study_row> rows = {};
  study_fit time_fit = {};    // log10 rmse over log10 seconds, of all runs
  study_fit budget_fit = {};  // log10 rmse over log10 budget
  std::vector<study_image> images = {};
  bool interrupted = false;
  std::vector<std::string> warnings = {};
};
