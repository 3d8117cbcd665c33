// Rounds of walks for many points, and what they add up to.

#include "wisp/pde/solve.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "point_walks.h"
#include "wisp/core/parallel.h"
#include "wisp/geometry/spatial_order.h"

namespace wisp {

void check_options(const solve_options& o) {
  const auto fail = [](const char* message) { throw std::invalid_argument(message); };
  if (o.walks == 0) fail("walks should be 1 or more");
  if (o.max_walks == 0) fail("max_walks should be 1 or more");
  if (!(o.epsilon >= 0) || !std::isfinite(o.epsilon))
    fail("epsilon should be finite and not negative");
  if (o.max_steps < 1) fail("max_steps should be 1 or more");
  if (!(o.error >= 0)) fail("the error to reach should not be negative");
  if (!(o.seconds > 0)) fail("the time to take should be above 0");
  if (!(o.tolerance > 0 && o.tolerance < 1)) fail("tolerance should be between 0 and 1");
  if (o.nested_walks < 1) fail("nested_walks should be 1 or more");
  if (!(o.roulette_continue > 0 && o.roulette_continue <= 1)) {
    fail("roulette_continue should be above 0, and 1 at most");
  }
  if (!(o.roulette_radius >= 1)) fail("roulette_radius should be 1 or more");
}

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

// The points of a solve, and rounds of walks from them.
class solver {
 public:
  solver(const pde_problem& problem, std::span<const dvec3> points, const solve_options& options)
      : context_(problem, options), points_(points), options_(options), start_(clock::now()) {
    states_.resize(points.size());
    if (options.gradient) gradients_.resize(points.size());
    parallel_for(
        points.size(), options.threads,
        [&](std::size_t i) { states_[i].place = place_point(context_, points_[i]); }, 64);
    // walks that start near each other share what caches hold
    for (const std::uint32_t i : spatial_order(points, options.threads)) {
      if (states_[i].place.status == point_status::ok) alive_.push_back(i);
    }
    result_.values.resize(points.size());
  }

  solution run() {
    if (options_.error > 0 || std::isfinite(options_.seconds)) {
      run_budget();
    } else {
      run_walks();
    }
    finish();
    return std::move(result_);
  }

 private:
  using clock = std::chrono::steady_clock;
  struct state {
    point_place place = {};
    walk_sums sums = {};
  };

  double seconds() const { return std::chrono::duration<double>(clock::now() - start_).count(); }
  std::uint64_t walks_of(std::size_t i) const { return states_[i].sums.walks; }
  void run_walks();
  void run_budget();
  bool run_round(const std::vector<std::uint64_t>& more, int block);
  bool report(std::uint64_t planned);
  double worst_error(std::size_t i) const;
  double deviation() const;
  double mean_error() const;
  void finish();

  walk_context context_;
  std::span<const dvec3> points_;
  const solve_options& options_;
  clock::time_point start_;
  std::vector<state> states_;
  std::vector<gradient_sums> gradients_;
  std::vector<std::size_t> alive_;  // points that are in the domain
  std::uint64_t planned_ = 0;       // walks in all, 0: not known
  solution result_;
};

// The largest of the standard errors of a point's channels.
double solver::worst_error(std::size_t i) const {
  const dvec4 e = states_[i].sums.value.standard_error();
  double worst = 0;
  for (int c = 0; c < context_.problem.channels; ++c) {
    worst = std::isnan(e[c]) ? std::numeric_limits<double>::infinity() : std::max(worst, e[c]);
  }
  return worst;
}

// Of blocks of walks: the root mean square over points and channels.
double solver::deviation() const {
  double sum = 0, n = 0;
  for (const std::size_t i : alive_) {
    const tally<dvec4>& v = states_[i].sums.value;
    for (int c = 0; c < context_.problem.channels && v.count > 1; ++c, ++n) {
      sum += v.m2[c] / static_cast<double>(v.count - 1);
    }
  }
  return n > 0 ? std::sqrt(sum / n) : 0;
}

double solver::mean_error() const {
  double sum = 0;
  std::size_t n = 0;
  for (const std::size_t i : alive_) {
    const dvec4 e = states_[i].sums.value.standard_error();
    for (int c = 0; c < context_.problem.channels; ++c) {
      if (!std::isfinite(e[c])) continue;
      sum += e[c] * e[c];
      ++n;
    }
  }
  return n > 0 ? std::sqrt(sum / static_cast<double>(n)) : not_a_number;
}

bool solver::report(std::uint64_t planned) {
  if (!options_.on_progress) return true;
  if (options_.on_progress({result_.walks, planned, mean_error(), seconds()})) return true;
  result_.stopped = true;
  return false;
}

// more[j] walks for point alive_[j], in blocks. False: stopped.
bool solver::run_round(const std::vector<std::uint64_t>& more, int block) {
  constexpr std::uint64_t chunk_walks = 2048;
  std::vector<walk_chunk> chunks;
  std::uint64_t room = 0;
  for (std::size_t j = 0; j < alive_.size(); ++j) {
    const std::size_t i = alive_[j];
    std::uint64_t first = walks_of(i), left = more[j];
    while (left > 0) {
      if (room < static_cast<std::uint64_t>(block)) {
        chunks.emplace_back();
        room = chunk_walks;
      }
      const std::uint64_t n = std::min(left, room - room % static_cast<std::uint64_t>(block));
      chunks.back().push_back({i, first, n});
      first += n;
      left -= n;
      room -= n;
    }
  }
  // As many chunks at once as keep all threads busy; sums join in order, so that they
  // do not depend on the number of threads.
  const std::size_t wave = 64 * static_cast<std::size_t>(thread_count(options_.threads));
  std::vector<std::vector<chunk_sums>> found(std::min(wave, chunks.size()));
  for (std::size_t from = 0; from < chunks.size(); from += wave) {
    const std::size_t n = std::min(wave, chunks.size() - from);
    parallel_for(n, options_.threads, [&](std::size_t c) {
      const walk_chunk& chunk = chunks[from + c];
      found[c].assign(chunk.size(), {});
      for (std::size_t s = 0; s < chunk.size(); ++s) {
        found[c][s].at = points_[chunk[s].point];
        found[c][s].place = states_[chunk[s].point].place;
        found[c][s].learned = states_[chunk[s].point].sums.learned;
        if (options_.gradient) {
          found[c][s].learned_slope = gradients_[chunk[s].point].learned;
        }
      }
      walk_from_points(context_, chunk, block, found[c]);
    });
    for (std::size_t c = 0; c < n; ++c) {
      for (std::size_t s = 0; s < found[c].size(); ++s) {
        const std::size_t i = chunks[from + c][s].point;
        states_[i].sums.merge(found[c][s].sums);
        if (options_.gradient) gradients_[i].merge(found[c][s].gradient);
        result_.walks += found[c][s].sums.walks;
      }
    }
    if (!report(planned_) || seconds() >= options_.seconds) return false;
  }
  for (const std::size_t i : alive_) {
    states_[i].sums.learn();
    if (options_.gradient) gradients_[i].learn();
  }
  return true;
}

// The same number of walks for each point. Rounds double, so that what one round has
// learned serves the next, and all points have something when time is up.
void solver::run_walks() {
  const std::uint64_t n = options_.walks;
  int block = 1;
  if (options_.directions != first_directions::independent && n % 2 == 0) block = 2;
  if (options_.directions == first_directions::stratified && n % 16 == 0) block = 16;
  planned_ = n * alive_.size();
  if (n < 2 * static_cast<std::uint64_t>(block)) block = 1;  // or there would be no error
  // no round so long that its list of chunks would matter
  const std::uint64_t most =
      std::max<std::uint64_t>((std::uint64_t{1} << 26) / std::max<std::size_t>(alive_.size(), 1),
                              16) /
      16 * 16;
  for (std::uint64_t done = 0; done < n;) {
    const std::uint64_t more = std::min({n - done, std::max<std::uint64_t>(done, 16), most});
    if (!run_round(std::vector<std::uint64_t>(alive_.size(), more), block)) return;
    done += more;
  }
}

void solver::run_budget() {
  int block = 1;
  if (options_.directions == first_directions::antithetic) block = 2;
  if (options_.directions == first_directions::stratified) block = 16;
  // without two of them there would be no error
  if (options_.max_walks < 2 * static_cast<std::uint64_t>(block)) block = 1;
  const auto b = static_cast<std::uint64_t>(block);
  const double limit = static_cast<double>(options_.max_walks / b * b);
  const auto in_blocks = [&](double walks) {
    return (static_cast<std::uint64_t>(std::clamp(walks, 0.0, limit)) + b - 1) / b * b;
  };
  // With an error to reach, at least so many that a standard error means something.
  const double wanted_least =
      static_cast<double>(std::min<std::uint64_t>(options_.walks / 4, 65536));
  const double least = std::min(options_.error > 0 ? std::max(wanted_least, 128.0) : 16.0, limit);
  std::vector<std::uint64_t> more(alive_.size(), in_blocks(least));
  while (run_round(more, block)) {
    double total = 0;
    if (options_.error > 0) {
      // Walks that all end alike have no variance, which proves little: one more is
      // counted that deviates as walks do elsewhere.
      const double spread = deviation();
      for (std::size_t j = 0; j < alive_.size(); ++j) {
        const walk_sums& s = states_[alive_[j]].sums;
        const double n = static_cast<double>(s.walks);
        const double blocks = static_cast<double>(std::max<std::uint64_t>(s.value.count, 1));
        const double ratio = std::hypot(worst_error(alive_[j]), spread / blocks) / options_.error;
        const bool done = !(ratio > 1) || n >= limit || s.undefined > 0;
        const double wanted = std::clamp(n * (1.1 * ratio * ratio - 1), 8.0, 3 * n);
        more[j] = done ? 0 : in_blocks(std::min(wanted, limit - n));
        total += static_cast<double>(more[j]);
      }
    } else {
      // The sum of squared errors is least where walks go with the deviation over the
      // root of what a walk costs (Neyman 1934).
      std::vector<double> wanted(alive_.size());
      double sum = 0, done = 0;
      for (std::size_t j = 0; j < alive_.size(); ++j) {
        const walk_sums& s = states_[alive_[j]].sums;
        const double n = static_cast<double>(s.walks);
        const double steps = static_cast<double>(s.steps) / std::max(n, 1.0);
        wanted[j] = worst_error(alive_[j]) * std::sqrt(n / std::max(steps, 1.0));
        if (!std::isfinite(wanted[j])) wanted[j] = 0;
        sum += wanted[j];
        done += n;
      }
      const double rate = done / std::max(seconds(), 1e-6);
      const double budget =
          std::min(0.5 * done, rate * std::max(options_.seconds - seconds(), 0.0));
      for (std::size_t j = 0; j < alive_.size(); ++j) {
        const double share = sum > 0 ? wanted[j] / sum : 1 / static_cast<double>(alive_.size());
        const double n = static_cast<double>(walks_of(alive_[j]));
        more[j] = in_blocks(std::max(std::min(share * (done + budget), limit) - n, 0.0));
        total += static_cast<double>(more[j]);
      }
    }
    if (total == 0) return;
  }
}

void solver::finish() {
  if (options_.gradient) result_.gradients.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const state& s = states_[i];
    estimate& e = result_.values[i];
    e.status = s.place.status;
    if (e.status == point_status::boundary) {
      e.mean = s.place.value;
      e.standard_error = dvec4{0};
    }
    gradient_estimate* g = options_.gradient ? &result_.gradients[i] : nullptr;
    if (g != nullptr) g->mean.fill(dvec3{not_a_number});
    if (g != nullptr) g->standard_error.fill(dvec3{not_a_number});
    if (e.status != point_status::ok || s.sums.walks == 0) continue;
    e.walks = s.sums.walks;
    e.unfinished = s.sums.unfinished;
    e.mean_steps = static_cast<double>(s.sums.steps) / static_cast<double>(s.sums.walks);
    result_.steps += s.sums.steps;
    result_.unfinished += s.sums.unfinished;
    if (s.sums.undefined > 0) {
      e.status = point_status::undefined;
      continue;
    }
    e.mean = s.sums.value.mean + context_.sources.field(points_[i]);
    e.standard_error = s.sums.value.standard_error();
    for (int c = context_.problem.channels; c < max_channels; ++c) {
      e.mean[c] = e.standard_error[c] = 0;
    }
    if (g == nullptr) continue;
    for (std::size_t c = 0; c < max_channels; ++c) {
      g->mean[c] = gradients_[i].channel[c].mean;
      g->standard_error[c] = gradients_[i].channel[c].standard_error();
    }
    context_.sources.add_field_gradient(points_[i], g->mean);
  }
  result_.seconds = seconds();
}

}  // namespace

solution solve(const pde_problem& problem, std::span<const dvec3> points,
               const solve_options& options) {
  check_problem(problem);
  check_options(options);
  return solver(problem, points, options).run();
}

}  // namespace wisp
