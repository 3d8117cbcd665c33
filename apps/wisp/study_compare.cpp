#include "study_compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <set>

#include "study_measures.h"

namespace {

struct range {
  double low = std::numeric_limits<double>::infinity(), high = 0;
};
range errors_of(const study_result& study) {
  range r;
  for (const auto& run : study.runs) {
    if (!drawable(run.errors.rmse)) continue;
    r.low = std::min(r.low, run.errors.rmse);
    r.high = std::max(r.high, run.errors.rmse);
  }
  return r;
}

// log10 of the time to an error by the line, and its standard error.
struct line_time {
  double x, error;
};
line_time time_to(const study_fit& fit, double log_error) {
  const double x = (log_error - fit.intercept) / fit.slope;
  return {x, line_error(fit, x) / std::abs(fit.slope)};
}

bool all_differ(const std::vector<std::string>& names) {
  return std::set<std::string>(names.begin(), names.end()).size() == names.size();
}

}  // namespace

study_ratio compare_studies(const study_result& study, const study_result& against) {
  study_ratio ratio;
  const auto &a = study.time_fit, &b = against.time_fit;
  // Without a slope there is no time to an error: the error does not fall.
  if (!(a.slope < 0) || !(b.slope < 0)) return ratio;
  const range ra = errors_of(study), rb = errors_of(against);
  double low = std::max(ra.low, rb.low), high = std::min(ra.high, rb.high);
  if (low > high) {
    std::swap(low, high);
    ratio.outside = true;
  }
  const double log_error = 0.5 * (std::log10(low) + std::log10(high));
  const line_time ta = time_to(a, log_error), tb = time_to(b, log_error);
  ratio.error = std::pow(10, log_error);
  ratio.time = std::pow(10, ta.x - tb.x);
  // The time that belongs to an error has no bound where the slope may as well be 0.
  if (!(a.half_width < -a.slope) || !(b.half_width < -b.slope)) return ratio;
  const double half = student_t95(std::min(a.count, b.count) - 2) * std::hypot(ta.error, tb.error);
  ratio.low = std::pow(10, ta.x - tb.x - half);
  ratio.high = std::pow(10, ta.x - tb.x + half);
  return ratio;
}

std::vector<std::string> name_studies(std::span<const study_result> studies,
                                      std::span<const std::string> files) {
  using part = std::function<std::string(const study_result&)>;
  const std::vector<part> parts = {
      [](const auto& s) { return s.method.empty() ? std::string() : s.method; },
      [](const auto& s) { return s.title; }, [](const auto& s) { return "wisp " + s.version; },
      [](const auto& s) { return fmt::format("{} threads", s.threads); }};
  std::vector<std::string> names(studies.size());
  for (const auto& p : parts) {
    std::set<std::string> values;
    for (const auto& s : studies) values.insert(p(s));
    if (values.size() == 1) continue;
    for (std::size_t i = 0; i < studies.size(); ++i) {
      const auto text = p(studies[i]).empty() ? "default" : p(studies[i]);
      names[i] += (names[i].empty() ? "" : ", ") + text;
    }
  }
  if (all_differ(names)) return names;
  for (std::size_t i = 0; i < studies.size(); ++i) {
    const std::filesystem::path file(files[i]);
    names[i] = file.has_parent_path() ? file.parent_path().filename().string() : file.string();
  }
  if (all_differ(names)) return names;
  return {files.begin(), files.end()};
}

std::vector<std::string> find_differences(std::span<const study_result> studies,
                                          std::span<const std::string> files) {
  std::vector<std::string> found;
  const auto& first = studies[0];
  for (std::size_t i = 0; i < studies.size(); ++i)
    if (studies[i].interrupted) found.push_back(files[i] + ": was stopped before its end");
  for (std::size_t i = 1; i < studies.size(); ++i) {
    const auto& s = studies[i];
    const auto differ = [&](const char* what, const std::string& a, const std::string& b) {
      if (a != b)
        found.push_back(
            fmt::format("{}: {} is {}, in {} it is {}", files[i], what, b, files[0], a));
    };
    differ("the kind of study", first.kind, s.kind);
    differ("the size", first.size, s.size);
    differ("the machine", first.machine, s.machine);
    differ("the reference", first.reference.kind + " " + first.reference.source,
           s.reference.kind + " " + s.reference.source);
  }
  return found;
}
