#include "study_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "study_measures.h"

namespace fs = std::filesystem;

namespace {

bool any_finite(const study_values& values) {
  return std::any_of(values.mean.begin(), values.mean.end(),
                     [](double v) { return std::isfinite(v); });
}

}  // namespace

std::optional<study_measurement> study_progress::run(const study_subject& subject,
                                                     std::uint64_t budget, std::uint64_t seed,
                                                     const std::string& text) {
  const auto weight = static_cast<double>(budget);
  show(text, 0);
  auto m = subject.run(budget, seed, [&](double part) { show(text, part * weight); });
  done_ += weight;
  return m;
}

void study_progress::show(const std::string& text, double part) {
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - start_;
  const double done = done_ + part;
  std::string left;
  if (done > 0) {
    const double rest = std::max(total_ - done, 0.0);  // a run to warm up is not of the total
    left = ", " + format_duration(rest / done * since.count()) + " left";
  }
  line_.show(fmt::format("study: {}{}", text, left));
}

study_values load_values(const study_subject& subject, const std::string& file) {
  auto values = subject.load_reference(file);
  if (!any_finite(values)) throw wisp::file_error(file, "", "has no value that is a number");
  for (const double error : values.error) {
    if (!(error < 0)) continue;
    throw wisp::file_error(
        file, "", fmt::format("has a standard error of {}; they must be at least 0", error));
  }
  return values;
}

study_reference make_reference(const study_arguments& args, const study_subject& subject,
                               std::uint64_t largest, study_progress& progress) {
  study_reference r;
  const auto check = [&] {
    if (any_finite(r.values)) return;
    throw wisp::file_error(
        args.solve.scene, "",
        "has nothing to study: the reference has no value at any point; are they "
        "in the domain?");
  };
  if (!args.reference.empty()) {
    r.kind = "file";
    r.source = args.reference;
    r.values = load_values(subject, args.reference);
  } else if (!subject.exact.empty()) {
    r.kind = "exact";
    r.source = subject.exact_text;
    r.values.mean = subject.exact;
    check();
  } else {
    const std::uint64_t budget = std::min(16 * largest, subject.most);
    r.kind = "run";
    r.source = fmt::format("{} {}, seed {}", budget, subject.unit, args.solve.seed);
    auto m = progress.run(subject, budget, args.solve.seed,
                          fmt::format("reference of {} {}", budget, subject.unit));
    if (!m) throw study_interrupted();
    r.seconds = m->seconds;
    r.values = std::move(m->values);
    check();
    subject.save_reference(fs::path(args.output) / ("reference" + subject.reference_ending),
                           r.values);
  }
  // A short run, so that the first that counts does not pay for cold caches.
  if (r.kind != "run") progress.run(subject, 1, args.solve.seed, "warming up");
  r.error = root_mean_square(r.values.error);
  if (subject.kind == "pde") {
    const double size = root_mean_square(r.values.mean);
    r.relative_floor = size > 0 ? 0.01 * size * size : 1;
  }
  return r;
}

void make_runs(const study_arguments& args, const study_subject& subject,
               std::vector<std::uint64_t> budgets, study_progress& progress, study_result& result) {
  study_tally tally;
  double seconds = 0;
  std::uint64_t walks = 0, unfinished = 0;
  const auto finish = [&] {
    result.rows = tally.rows(result.reference);
    if (unfinished == 0) return;
    result.warnings.push_back(
        fmt::format("{} of {} walks did not end at the boundary within their steps, or left "
                    "through a hole of it, and may have biased the result; --max-steps or "
                    "\"max_steps\" raises the limit",
                    unfinished, walks));
  };
  std::uint64_t seed = args.solve.seed;
  for (int repeat = 0; repeat < args.repeats && !result.interrupted; ++repeat) {
    for (std::size_t i = 0; i < budgets.size(); ++i) {
      if (args.solve.time > 0 && seconds >= args.solve.time) {
        result.warnings.push_back(
            fmt::format("--time ended the study in repeat {} of {}", repeat + 1, args.repeats));
        return finish();
      }
      const auto budget = budgets[i];
      auto m = progress.run(
          subject, budget, ++seed,
          fmt::format("{} {}, repeat {} of {}", budget, subject.unit, repeat + 1, args.repeats));
      if (!m) {
        result.interrupted = true;
        break;
      }
      study_run run;
      run.budget = budget;
      run.repeat = repeat;
      run.seed = seed;
      run.seconds = m->seconds;
      run.cpu_seconds = m->cpu_seconds;
      run.build_seconds = m->build_seconds;
      run.errors = measure_errors(m->values, result.reference);
      seconds += m->seconds;
      walks += m->walks;
      unfinished += m->unfinished;
      tally.add(run, m->values);
      result.runs.push_back(run);
      if (args.solve.error > 0 && run.errors.estimated < args.solve.error) {
        budgets.resize(i + 1);  // for all repeats
      }
    }
  }
  finish();
}
