#include "study_measures.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

namespace {

double median(std::vector<double> v) {
  if (v.empty()) return study_unknown;
  std::sort(v.begin(), v.end());
  const std::size_t half = v.size() / 2;
  return v.size() % 2 == 1 ? v[half] : 0.5 * (v[half - 1] + v[half]);
}

// P(|T| <= t) for Student's t with n degrees of freedom.
double student_within(double t, int n) {
  const double angle = std::atan(t / std::sqrt(n));
  const double c = std::cos(angle), s = std::sin(angle);
  double term = 1, sum = 1;
  if (n % 2 == 0) {
    for (int k = 2; k < n; k += 2) sum += term *= c * c * (k - 1) / k;
    return s * sum;
  }
  if (n == 1) return 2 * angle / std::numbers::pi;
  for (int k = 3; k < n; k += 2) sum += term *= c * c * (k - 1) / k;
  return 2 / std::numbers::pi * (angle + s * c * sum);
}

study_fit fit_runs(std::span<const study_run> runs, double (*of)(const study_run&)) {
  std::vector<double> x, y;
  std::set<std::uint64_t> budgets;
  for (const auto& run : runs) {
    if (!drawable(run.errors.rmse) || !drawable(of(run))) continue;
    x.push_back(std::log10(of(run)));
    y.push_back(std::log10(run.errors.rmse));
    budgets.insert(run.budget);
  }
  // Times of one budget differ by chance alone.
  if (budgets.size() < 2) return {};
  return fit_line(x, y);
}

}  // namespace

bool drawable(double v) { return std::isfinite(v) && v > 0; }

double root_mean_square(std::span<const double> values) {
  double sum = 0;
  std::size_t count = 0;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    sum += v * v;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

study_errors measure_errors(const study_values& values, const study_reference& reference) {
  const auto& wanted = reference.values;
  if (values.mean.size() != wanted.mean.size()) {
    throw std::invalid_argument("values and reference are not of the same size");
  }
  study_errors e;
  double squares = 0, relative = 0, largest = 0, estimated = 0;
  std::size_t intervals = 0, covered = 0, estimates = 0;
  for (std::size_t i = 0; i < values.mean.size(); ++i) {
    if (!std::isfinite(wanted.mean[i])) continue;
    if (!std::isfinite(values.mean[i])) {
      ++e.missing;
      continue;
    }
    const double d = values.mean[i] - wanted.mean[i];
    const double of_reference =
        !wanted.error.empty() && std::isfinite(wanted.error[i]) ? wanted.error[i] : 0;
    ++e.count;
    squares += d * d;
    relative += d * d / (wanted.mean[i] * wanted.mean[i] + reference.relative_floor);
    largest = std::max(largest, std::abs(d));
    if (values.error.empty() || !std::isfinite(values.error[i])) continue;
    const double own = values.error[i];
    ++estimates;
    estimated += own * own;
    // rounding of pixels to float
    const double rounding = 1e-6 * std::abs(wanted.mean[i]);
    if (own == 0 && std::abs(d) <= rounding) continue;
    ++intervals;
    covered += std::abs(d) <= 1.959964 * std::hypot(own, of_reference) + rounding;
  }
  if (e.count == 0) return e;
  const auto n = static_cast<double>(e.count);
  e.mse = squares / n;
  e.rmse = std::sqrt(e.mse);
  e.relmse = relative / n;
  e.maximum = largest;
  if (estimates > 0) e.estimated = std::sqrt(estimated / static_cast<double>(estimates));
  if (intervals > 0) {
    e.coverage = static_cast<double>(covered) / static_cast<double>(intervals);
  }
  return e;
}

double student_t95(int n) {
  double low = 0, high = 13;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (student_within(middle, n) < 0.95 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

study_fit fit_line(std::span<const double> x, std::span<const double> y) {
  study_fit fit;
  fit.count = static_cast<int>(x.size());
  if (fit.count < 2) return fit;
  const double n = fit.count;
  double mean_y = 0, sum_xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    fit.mean_x += x[i] / n;
    mean_y += y[i] / n;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    fit.sum_xx += (x[i] - fit.mean_x) * (x[i] - fit.mean_x);
    sum_xy += (x[i] - fit.mean_x) * (y[i] - mean_y);
  }
  if (!(fit.sum_xx > 1e-12)) return fit;
  fit.slope = sum_xy / fit.sum_xx;
  fit.intercept = mean_y - fit.slope * fit.mean_x;
  if (fit.count == 2) return fit;
  double squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double d = y[i] - fit.intercept - fit.slope * x[i];
    squares += d * d;
  }
  fit.residual = std::sqrt(squares / (n - 2));
  fit.half_width = student_t95(fit.count - 2) * fit.residual / std::sqrt(fit.sum_xx);
  return fit;
}

double line_error(const study_fit& fit, double x) {
  if (fit.count < 3 || !(fit.sum_xx > 0)) return study_unknown;
  const double d = x - fit.mean_x;
  return fit.residual * std::sqrt(1.0 / fit.count + d * d / fit.sum_xx);
}

void study_tally::add(const study_run& run, const study_values& values) {
  level& l = levels_[run.budget];
  if (l.runs.empty()) {
    l.mean.assign(values.mean.size(), 0);
    l.squares.assign(values.mean.size(), 0);
  }
  l.runs.push_back(run);
  const auto n = static_cast<double>(l.runs.size());
  for (std::size_t i = 0; i < values.mean.size(); ++i) {  // Welford 1962
    const double d = values.mean[i] - l.mean[i];
    l.mean[i] += d / n;
    l.squares[i] += d * (values.mean[i] - l.mean[i]);
  }
}

std::vector<study_row> study_tally::rows(const study_reference& reference) const {
  std::vector<study_row> rows;
  for (const auto& [budget, l] : levels_) {
    study_row row;
    row.budget = budget;
    row.repeats = static_cast<int>(l.runs.size());
    std::vector<double> seconds, cpu;
    double mse = 0, relmse = 0, estimated = 0, coverage = 0;
    study_errors& e = row.errors;
    for (const auto& run : l.runs) {
      seconds.push_back(run.seconds);
      cpu.push_back(run.cpu_seconds);
      mse += run.errors.mse;
      relmse += run.errors.relmse;
      estimated += run.errors.estimated * run.errors.estimated;
      coverage += run.errors.coverage;
      e.maximum = std::fmax(e.maximum, run.errors.maximum);  // of what is known
      e.count = run.errors.count;
      e.missing = std::max(e.missing, run.errors.missing);
    }
    const auto n = static_cast<double>(l.runs.size());
    row.seconds = median(seconds);
    row.cpu_seconds = median(cpu);
    e.mse = mse / n;
    e.rmse = std::sqrt(e.mse);
    e.relmse = relmse / n;
    e.estimated = std::sqrt(estimated / n);
    e.coverage = coverage / n;
    if (drawable(e.mse) && drawable(row.seconds)) row.efficiency = 1 / (e.mse * row.seconds);
    if (row.repeats > 1) {
      double variance = 0, squares = 0;
      std::size_t count = 0;
      for (std::size_t i = 0; i < l.squares.size(); ++i) {
        if (!std::isfinite(l.squares[i]) || !std::isfinite(reference.values.mean[i])) continue;
        const double v = l.squares[i] / (n - 1);
        variance += v;
        squares += v * v;
        ++count;
      }
      if (count > 0) {
        const auto m = static_cast<double>(count);
        row.deviation = std::sqrt(variance / m);
        // mse = deviation^2 + bias^2, where the first is known to about this much, and not as
        // well where neighbours share their errors, or where few values have most of it:
        // degrees of freedom by Satterthwaite 1946
        const double freedom = (n - 1) * variance * variance / squares;
        const double t = student_t95(freedom >= 1 ? static_cast<int>(std::min(freedom, 1e3)) : 1) /
                         student_t95(1000);
        const double noise =
            t * t * std::max(3 * std::sqrt(2 / (n - 1) * squares), 0.5 * variance) / m;
        const double common = e.mse - variance / m - reference.error * reference.error;
        if (common > noise) row.bias = std::sqrt(common);
      }
    }
    rows.push_back(row);
  }
  return rows;
}

study_fit fit_time(std::span<const study_run> runs) {
  return fit_runs(runs, [](const study_run& run) { return run.seconds; });
}
study_fit fit_budget(std::span<const study_run> runs) {
  return fit_runs(runs, [](const study_run& run) { return static_cast<double>(run.budget); });
}
