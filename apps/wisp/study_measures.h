#pragma once

// Errors, coverage and fitted lines of wisp study.

#include <map>
#include <span>

#include "study.h"

// Throws std::invalid_argument for arrays of different sizes.
study_errors measure_errors(const study_values& values, const study_reference& reference);

// Whether a logarithm of it can be taken: finite and above 0.
bool drawable(double v);

// The root mean square of the finite ones; 0 for none.
double root_mean_square(std::span<const double> values);

// Quantile of Student's t for a two-sided interval of 95 %, n >= 1 degrees of freedom,
// from the exact distribution (Abramowitz and Stegun 1964, 26.7.3 and 26.7.4).
double student_t95(int n);

// NaN for fewer than two points, or without spread of x; no interval for two.
study_fit fit_line(std::span<const double> x, std::span<const double> y);
// The standard error of the line at x.
double line_error(const study_fit& fit, double x);

// Sums over repeats, from which rows follow. Values are kept as mean and squares for each
// budget: 16 bytes a value and budget.
class study_tally {
 public:
  void add(const study_run& run, const study_values& values);
  std::vector<study_row> rows(const study_reference& reference) const;

 private:
  struct level {
    std::vector<study_run> runs;
    std::vector<double> mean, squares;
  };
  std::map<std::uint64_t, level> levels_;
};

// log10 rmse over log10 of the seconds, or of the budgets, of runs of two budgets or more.
study_fit fit_time(std::span<const study_run> runs);
study_fit fit_budget(std::span<const study_run> runs);
