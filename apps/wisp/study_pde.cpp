// PDEs as the subject of a study.

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>

#include "console.h"
#include "estimators.h"
#include "pde_scene.h"
#include "run_report.h"
#include "solve_files.h"
#include "solve_task.h"
#include "study_measures.h"
#include "study_subjects.h"
#include "wisp/pde/section.h"
#include "wisp/pde/solve.h"

namespace {

struct pde_study {
  wisp::scene_data scene;
  solve_task task;
  wisp::section_grid grid;
  std::vector<wisp::dvec3> points;
  wisp::section_options options;
  int threads = 0, channels = 1;
  std::vector<wisp::part_report> parts;
  wisp::warning_list ignored;  // those of the first build are shown, and are always the same

  bool is_section() const { return task.section != wisp::invalid_id; }
  bool gradient() const { return options.solve.gradient; }
};

// Channels of a point, or of its gradient, one after the other.
study_values values_of(const wisp::solution& solution, int channels) {
  study_values v;
  const bool gradient = !solution.gradients.empty();
  for (std::size_t i = 0; i < solution.values.size(); ++i) {
    const auto& e = solution.values[i];
    const bool known = e.status == wisp::point_status::ok && e.walks > 0;
    for (int c = 0; c < channels; ++c) {
      if (!gradient) {
        v.mean.push_back(e.mean[c]);
        v.error.push_back(e.standard_error[c]);
        continue;
      }
      const auto& g = solution.gradients[i];
      const auto k = static_cast<std::size_t>(c);
      for (int a = 0; a < 3; ++a) {
        v.mean.push_back(known ? g.mean[k][a] : study_unknown);
        v.error.push_back(known ? g.standard_error[k][a] : study_unknown);
      }
    }
  }
  return v;
}

// By central differences, whose error is some 1e-10 of what changes over the domain.
wisp::dvec4 difference(const wisp::space_field& exact, const wisp::dvec3& p, int axis, double h) {
  wisp::dvec3 step{0};
  step[axis] = h;
  return (exact(p + step) - exact(p - step)) / (2 * h);
}

std::vector<double> exact_values(const scene_problem& problem, const pde_study& s) {
  std::vector<double> values;
  const auto& domain = problem.problem.domain;
  const double h = 1e-5 * domain.size();
  for (const auto& p : s.points) {
    const bool known = s.is_section() || domain.contains(p);
    const wisp::dvec4 u = known ? problem.exact(p) : wisp::dvec4{study_unknown};
    wisp::dvec4 slopes[3] = {u, u, u};
    for (int a = 0; known && s.gradient() && a < 3; ++a)
      slopes[a] = difference(problem.exact, p, a, h);
    for (int c = 0; c < s.channels; ++c) {
      if (!s.gradient()) values.push_back(u[c]);
      for (int a = 0; s.gradient() && a < 3; ++a) values.push_back(slopes[a][c]);
    }
  }
  return values;
}

// value, std_error or value_0, value_1, ...; of gradients gx, gy, gz, gx_error, ...
std::vector<std::string> column_names(const pde_study& s) {
  std::vector<std::string> names = {"x", "y", "z"};
  const auto add = [&](const std::string& name, const std::string& end, int c) {
    names.push_back(name + end + (s.channels == 1 ? "" : fmt::format("_{}", c)));
  };
  for (const bool error : {false, true}) {
    for (int c = 0; c < s.channels; ++c) {
      if (!s.gradient()) add(error ? "std_error" : "value", "", c);
      for (const char* axis : {"gx", "gy", "gz"}) {
        if (s.gradient()) add(axis, error ? "_error" : "", c);
      }
    }
  }
  return names;
}

void save_values(const std::filesystem::path& file, const pde_study& s,
                 const study_values& values) {
  std::string text = fmt::format("{}\n", fmt::join(column_names(s), ","));
  const std::size_t each = values.mean.size() / s.points.size();
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    const auto& p = s.points[i];
    text += fmt::format("{},{},{}", p.x, p.y, p.z);
    for (const auto* numbers : {&values.mean, &values.error}) {
      for (std::size_t k = 0; k < each; ++k) text += fmt::format(",{}", (*numbers)[i * each + k]);
    }
    text += "\n";
  }
  save_text(file, text);
}

// What save_values or `wisp solve` wrote of the same points.
study_values load_values(const std::string& file, const pde_study& s) {
  if (!is_table(file)) {
    throw wisp::file_error(file, "",
                           "references of PDEs are .csv files, as wisp solve writes them");
  }
  const auto names = column_names(s);
  const std::size_t each = (names.size() - 3) / 2;
  const auto table = load_table(file, names, 3 + each);
  if (table.rows != s.points.size()) {
    throw wisp::file_error(
        file, "", fmt::format("has {} points, but the study {}", table.rows, s.points.size()));
  }
  study_values values;
  const bool errors = table.known.size() > 3 + each && table.known[3 + each];
  for (std::size_t i = 0; i < table.rows; ++i) {
    const double* row = table.numbers.data() + i * names.size();
    const wisp::dvec3 p = {row[0], row[1], row[2]};
    const double off = glm::length(p - s.points[i]);
    if (off > 1e-9 * (1 + glm::length(p))) {
      throw wisp::file_error(file, fmt::format("point {}", i + 1),
                             fmt::format("is {}, {}, {}, but that of the study is {}, {}, {}", p.x,
                                         p.y, p.z, s.points[i].x, s.points[i].y, s.points[i].z));
    }
    for (std::size_t k = 0; k < each; ++k) {
      values.mean.push_back(row[3 + k]);
      if (errors) values.error.push_back(row[3 + each + k]);
    }
  }
  return values;
}

std::optional<study_measurement> run_walks(pde_study& s, std::uint64_t walks, std::uint64_t seed,
                                           const std::function<void(double)>& progress) {
  phase_timer clock;
  clock.start("build");
  // Anew, as grids of distances fill while walks go on and serve all that come later.
  auto problem = make_problem(s.scene, s.task.problem, s.threads, s.ignored);
  auto options = s.options;
  options.solve.walks = walks;
  options.solve.seed = seed;
  options.solve.on_progress = [&](const wisp::solve_options::progress& p) {
    if (p.planned > 0) progress(static_cast<double>(p.walks) / static_cast<double>(p.planned));
    return !interrupt_flag().load();
  };
  clock.start("run");
  const auto solution =
      blame(s.scene.path.string(), fmt::format("problems[{}]", s.task.problem), [&] {
        return s.is_section() ? solve_section(problem.problem, s.grid, options)
                              : solve(problem.problem, s.points, options.solve);
      });
  clock.stop();
  if (interrupt_flag()) return std::nullopt;
  finish_parts(problem);
  s.parts = problem.parts;
  study_measurement m;
  m.build_seconds = clock.seconds("build");
  m.seconds = clock.seconds("run");
  m.cpu_seconds = clock.cpu()["run"];
  m.walks = solution.walks;
  m.unfinished = solution.unfinished;
  m.values = values_of(solution, s.channels);
  if (walks < 2 && !(s.is_section() && options.share)) m.values.error.clear();
  return m;
}

}  // namespace

study_subject make_pde_subject(const study_arguments& args, const study_watch& watch,
                               wisp::warning_list& warnings) {
  auto s = std::make_shared<pde_study>();
  const auto& a = args.solve;
  phase_timer timer;
  timer.start("load");
  watch("load: " + a.scene);
  s->scene = load_task(a, s->task, warnings);
  if (!a.points.empty()) s->points = load_points(a.points);
  const auto& data = s->scene.problems[static_cast<std::size_t>(s->task.problem)];
  s->options.solve = make_options(a, data);
  // budgets of the study, not of a run
  s->options.solve.error = 0;
  s->options.solve.seconds = std::numeric_limits<double>::infinity();
  s->threads = a.threads;
  s->channels = data.channels;

  timer.start("build");
  watch("build: the domain");
  const auto problem = make_problem(s->scene, s->task.problem, s->threads, warnings);
  for (auto& unused :
       choose_estimators(a.estimators, problem.problem, s->is_section(), s->options)) {
    warnings.push_back(std::move(unused));
  }
  std::string where = std::filesystem::path(a.points).filename().string();
  if (s->is_section()) {
    const auto& section = s->scene.sections[static_cast<std::size_t>(s->task.section)];
    blame(a.scene, fmt::format("sections[{}]", s->task.section), [&] {
      s->grid = make_section_grid(problem.problem.domain, make_plane(section), s->threads);
    });
    s->points = s->grid.points;
    where = "section " + section.name;
  }
  timer.stop();

  study_subject subject;
  subject.kind = "pde";
  subject.title = fmt::format("{}, {}", data.name, where);
  subject.unit = "walks";
  subject.size = fmt::format("{} {}{}{}", s->points.size(), s->gradient() ? "gradient" : "point",
                             s->points.size() == 1 ? "" : "s",
                             s->channels > 1 ? fmt::format(" of {} channels", s->channels) : "");
  subject.method = fmt::format("{}", fmt::join(a.estimators, ","));
  subject.load_seconds = timer.seconds("load");
  subject.build_seconds = timer.seconds("build");
  if (problem.exact) {
    subject.exact_text = fmt::format("{}", fmt::join(data.exact.formulas, ", "));
    subject.exact = exact_values(problem, *s);
  }
  subject.run = [s](std::uint64_t budget, std::uint64_t seed, const auto& progress) {
    return run_walks(*s, budget, seed, progress);
  };
  // Some million walks at most, in powers of two.
  std::uint64_t largest = 64;
  while (largest < 65536 && 2 * largest * s->points.size() <= (1u << 20)) largest *= 2;
  for (int k = 6; k >= 0; --k) subject.budgets.push_back(largest >> k);
  subject.most = std::uint64_t{1} << 40;
  subject.reference_ending = ".csv";
  subject.save_reference = [s](const std::filesystem::path& file, const study_values& values) {
    save_values(file, *s, values);
  };
  subject.load_reference = [s](const std::string& file) { return load_values(file, *s); };
  subject.parts = [s] { return s->parts; };
  return subject;
}
