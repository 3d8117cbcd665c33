// Walks from the centers of balls serve all points in them: a variant of mean value
// caching (Bakbouk and Peers, Mean Value Caching for Walk on Spheres, 2023) that stores
// nothing from one pass to the next, so that memory does not grow with walks, and in which
// each point keeps to the same balls with the same weights, so that it stays unbiased.

#include "section_share.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>

#include "ball_kernels.h"
#include "point_walks.h"
#include "wisp/core/parallel.h"

namespace wisp {

namespace {

// Points within this part of a ball's radius are served by it, and those within a
// smaller one need no ball of their own.
constexpr double served = 0.6, covered = 0.45;
// Screened equations forget over 1 / k: balls are no larger than this many times it.
constexpr double screened_reach = 3;

struct ball {
  std::uint32_t center = 0;  // the point
  double radius = 0;
  kernel_ball kernel = {};
};

// The walks of a ball in a pass: from points of its sphere, with samples of the source in
// the ball. Positions are relative to the center.
struct ball_records {
  std::array<dvec3, max_batch> nu = {};
  std::array<dvec4, max_batch> u = {};          // at R nu
  std::array<dvec4, max_batch> laplacian = {};  // biharmonic
};
struct source_records {
  std::array<dvec3, max_batch> point = {};
  std::array<dvec4, max_batch> f = {};        // f / (density * samples); 0 where there is none
  std::array<double, max_batch> weight = {};  // 1 / (density * samples)
};

class shared_solver {
 public:
  shared_solver(const pde_problem& problem, const section_grid& grid, const solve_options& options)
      : context_(problem, options), grid_(grid), options_(options), start_(clock::now()) {
    type_ = problem.equation == pde_equation::biharmonic ? ball_kernel_type::biharmonic
            : context_.k > 0                             ? ball_kernel_type::screened
                                                         : ball_kernel_type::harmonic;
    place_points();
    make_balls();
  }

  solution run();

 private:
  using clock = std::chrono::steady_clock;
  struct point_sums {
    tally<dvec4> value = {};
    double steps = 0, walks = 0, unfinished = 0;
    bool undefined = false;
  };
  struct ball_sums {
    std::uint64_t passes = 0;  // so far; names the next walks
    double steps = 0;          // of the last pass
    double unfinished = 0;
    sphere_moments seen = {}, learned = {};
    tally<dvec4> source = {};             // of f at its samples
    dvec4 learned_source = {0, 0, 0, 0};  // the mean of that, as of the last pass
  };

  double seconds() const { return std::chrono::duration<double>(clock::now() - start_).count(); }
  void place_points();
  void make_balls();
  bool run_pass(const std::vector<char>& wanted);
  void keep(const source_sample& drawn, const dvec3& center, std::size_t j,
            source_records& records) const;
  void walk_from_balls(std::span<const std::uint32_t> some);
  void gather(std::uint32_t point);
  double worst_error(std::size_t i) const;
  double mean_error() const;
  void finish();

  walk_context context_;
  const section_grid& grid_;
  const solve_options& options_;
  clock::time_point start_;
  ball_kernel_type type_;
  std::size_t block_ = 1;  // walks of a ball in a pass
  // Of them, those with a sample of the source: fewer where its kernel costs as much as
  // a walk.
  std::size_t sampled_ = 1;

  std::vector<point_place> places_;
  std::vector<ball> balls_;
  // The balls that serve point i: serving_[first_[i]] .. serving_[first_[i + 1] - 1].
  std::vector<std::uint32_t> first_, serving_;
  std::vector<ball_records> records_;
  std::vector<source_records> volumes_, elements_;  // where there are such sources
  std::vector<ball_sums> ball_sums_;
  std::vector<point_sums> point_sums_;
  solution result_;
};

void shared_solver::place_points() {
  const std::size_t n = grid_.points.size();
  places_.resize(n);
  point_sums_.resize(n);
  parallel_for(
      n, options_.threads,
      [&](std::size_t i) { places_[i] = place_point(context_, grid_.points[i]); }, 64);
}

// The largest balls first; a point that none covers yet gets one.
void shared_solver::make_balls() {
  const std::size_t n = grid_.points.size();
  const auto radius_of = [&](std::size_t i) {
    const double r = places_[i].radius;
    return context_.k > 0 ? std::min(r, screened_reach / context_.k) : r;
  };
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return radius_of(a) > radius_of(b); });
  constexpr std::uint32_t none = ~std::uint32_t{0};
  std::vector<std::uint32_t> point_at(
      static_cast<std::size_t>(grid_.width) * static_cast<std::size_t>(grid_.height), none);
  for (std::size_t i = 0; i < n; ++i) point_at[grid_.cells[i]] = static_cast<std::uint32_t>(i);

  std::vector<char> is_covered(n, 0);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;  // point, ball
  for (const std::uint32_t i : order) {
    if (is_covered[i] || places_[i].status != point_status::ok) continue;
    const double R = radius_of(i);
    const auto b = static_cast<std::uint32_t>(balls_.size());
    balls_.push_back({i, R, kernel_ball(type_, R, context_.k)});
    const int x = static_cast<int>(grid_.cells[i] % static_cast<std::uint32_t>(grid_.width));
    const int y = static_cast<int>(grid_.cells[i] / static_cast<std::uint32_t>(grid_.width));
    const int reach = static_cast<int>(std::min(served * R / grid_.cell, 1e6));
    for (int row = std::max(y - reach, 0); row <= std::min(y + reach, grid_.height - 1); ++row) {
      for (int column = std::max(x - reach, 0); column <= std::min(x + reach, grid_.width - 1);
           ++column) {
        const std::uint32_t p =
            point_at[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.width) +
                     static_cast<std::size_t>(column)];
        if (p == none || places_[p].status != point_status::ok) continue;
        const double distance = glm::distance(grid_.points[p], grid_.points[i]);
        if (distance > served * R) continue;
        pairs.emplace_back(p, b);
        if (distance <= covered * R) is_covered[p] = 1;
      }
    }
  }
  first_.assign(n + 1, 0);
  for (const auto& [p, b] : pairs) ++first_[p + 1];
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  serving_.resize(pairs.size());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (const auto& [p, b] : pairs) serving_[next[p]++] = b;
  ball_sums_.resize(balls_.size());
}

// Keeps a sample of the source in a ball around `center` for all points of the ball.
void shared_solver::keep(const source_sample& drawn, const dvec3& center, std::size_t j,
                         source_records& records) const {
  records.point[j] = drawn.point - center;
  records.weight[j] = drawn.density > 0 ? 1 / (drawn.density * static_cast<double>(sampled_)) : 0;
  records.f[j] = records.weight[j] * drawn.f;
}

// Walks of one pass from the spheres of some balls.
void shared_solver::walk_from_balls(std::span<const std::uint32_t> some) {
  std::vector<walk> walks;
  walks.reserve(some.size() * block_);
  std::vector<dvec3> directions(block_);
  for (const std::uint32_t b : some) {
    const dvec3 at = grid_.points[balls_[b].center];
    const double R = balls_[b].radius;
    const std::uint64_t seed = hash64(options_.seed * 0x9e3779b97f4a7c15ull + b + 1);
    rng_state rng = make_rng(seed, ball_sums_[b].passes);
    block_directions(rng, directions);
    for (std::size_t j = 0; j < block_; ++j) {
      records_[b].nu[j] = directions[j];
      walk w;
      w.rng = make_rng(~seed, ball_sums_[b].passes * block_ + j);
      w.x = at + R * directions[j];
      walks.push_back(w);
    }
    for (std::size_t j = 0; j < sampled_; ++j) {
      if (!volumes_.empty()) {
        const source_sample drawn = context_.sources.draw_volume(at, R, rng);
        keep(drawn, at, j, volumes_[b]);
        if (drawn.density > 0 && context_.sources.has_no_peaks()) ball_sums_[b].source.add(drawn.f);
      }
      if (!elements_.empty()) keep(context_.sources.draw_element(at, R, rng), at, j, elements_[b]);
    }
  }
  run_walks(context_, walks);
  std::size_t at = 0;
  for (const std::uint32_t b : some) {
    ball_sums& sums = ball_sums_[b];
    sums.steps = sums.unfinished = 0;
    ++sums.passes;
    for (std::size_t j = 0; j < block_; ++j) {
      const walk& w = walks[at++];
      records_[b].u[j] = w.u;
      records_[b].laplacian[j] = w.laplacian;
      sums.steps += w.steps + 1.0;
      sums.unfinished += w.unfinished;
      sums.seen.add(w.u, records_[b].nu[j]);
    }
  }
}

// An estimate of one pass at a point.
void shared_solver::gather(std::uint32_t point) {
  const dvec3 p = grid_.points[point];
  point_sums& sums = point_sums_[point];
  const auto channels = static_cast<std::size_t>(context_.problem.channels);
  dvec4 total{0};
  double weights = 0;
  const double n = static_cast<double>(block_);
  std::array<double, max_batch> kernels;
  for (std::uint32_t s = first_[point]; s < first_[point + 1]; ++s) {
    const std::uint32_t b = serving_[s];
    const double R = balls_[b].radius;
    const dvec3 y = p - grid_.points[balls_[b].center];
    const ball_kernels kernel(balls_[b].kernel, y);
    const ball_sums& about = ball_sums_[b];
    const bool controlled = options_.control_variates && about.learned.weight > 0;
    // What is known of u on the sphere, to first order, has a known extension.
    dvec4 value{0};
    if (controlled) {
      value = kernel.value_mean() * about.learned.mean;
      for (std::size_t c = 0; c < channels; ++c) {
        value[static_cast<int>(c)] += kernel.value_slope() * glm::dot(about.learned.slope[c], y);
      }
    }
    const ball_records& r = records_[b];
    const std::span<const dvec3> nu = std::span(r.nu).first(block_);
    kernel.values(nu, kernels);
    for (std::size_t j = 0; j < block_; ++j) {
      const dvec4 rest = controlled ? r.u[j] - about.learned.at(r.nu[j]) : r.u[j];
      value += kernels[j] / n * rest;
    }
    if (type_ == ball_kernel_type::biharmonic) {
      kernel.laplacians(nu, kernels);
      for (std::size_t j = 0; j < block_; ++j) value -= kernels[j] / n * r.laplacian[j];
    }
    // int G (f - m) + m int G with the mean m of f in the ball, as far as it is known
    if (!volumes_.empty()) {
      const dvec4 here = controlled ? about.learned_source : dvec4{0};
      value -= kernel.greens_mass() * here;
      const source_records& v = volumes_[b];
      kernel.greens(std::span(v.point).first(sampled_), kernels);
      for (std::size_t j = 0; j < sampled_; ++j) {
        if (v.weight[j] > 0) value -= kernels[j] * (v.f[j] - v.weight[j] * here);
      }
    }
    if (!elements_.empty()) {
      const source_records& v = elements_[b];
      kernel.greens(std::span(v.point).first(sampled_), kernels);
      for (std::size_t j = 0; j < sampled_; ++j) {
        if (v.weight[j] > 0) value -= kernels[j] * v.f[j];
      }
    }
    // The variance of the kernel falls like this, and that of a walk does not depend on
    // where in the ball the point is.
    const double q = glm::dot(y, y) / (R * R);
    const double weight = (1 - q) * (1 - q) / (1 + q);
    total += weight * value;
    weights += weight;
    sums.steps += about.steps;
    sums.unfinished += about.unfinished;
    sums.walks += n;
  }
  total /= weights;
  for (int c = 0; c < 4; ++c) {
    if (!std::isfinite(total[c])) sums.undefined = true;
  }
  if (!sums.undefined) sums.value.add(total);
}

double shared_solver::worst_error(std::size_t i) const {
  const dvec4 e = point_sums_[i].value.standard_error();
  double worst = 0;
  for (int c = 0; c < context_.problem.channels; ++c) {
    worst = std::isnan(e[c]) ? std::numeric_limits<double>::infinity() : std::max(worst, e[c]);
  }
  return worst;
}

double shared_solver::mean_error() const {
  double sum = 0;
  std::size_t n = 0;
  for (std::size_t i = 0; i < point_sums_.size(); ++i) {
    const dvec4 e = point_sums_[i].value.standard_error();
    for (int c = 0; c < context_.problem.channels; ++c) {
      if (!std::isfinite(e[c]) || places_[i].status != point_status::ok) continue;
      sum += e[c] * e[c];
      ++n;
    }
  }
  return n > 0 ? std::sqrt(sum / static_cast<double>(n)) : std::numeric_limits<double>::quiet_NaN();
}

// One more estimate for each point that is wanted. False: stop.
bool shared_solver::run_pass(const std::vector<char>& wanted) {
  std::vector<char> used(balls_.size(), 0);
  std::vector<std::uint32_t> points, some;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!wanted[i] || first_[i] == first_[i + 1]) continue;
    points.push_back(static_cast<std::uint32_t>(i));
    for (std::uint32_t s = first_[i]; s < first_[i + 1]; ++s) used[serving_[s]] = 1;
  }
  for (std::size_t b = 0; b < used.size(); ++b) {
    if (used[b]) some.push_back(static_cast<std::uint32_t>(b));
  }
  if (some.empty()) return false;
  const std::size_t together = std::max<std::size_t>(2048 / block_, 1);
  const std::size_t chunks = (some.size() + together - 1) / together;
  parallel_for(chunks, options_.threads, [&](std::size_t c) {
    const std::size_t from = c * together;
    walk_from_balls(std::span(some).subspan(from, std::min(together, some.size() - from)));
  });
  parallel_for(
      points.size(), options_.threads, [&](std::size_t i) { gather(points[i]); }, 64);
  // what the next pass takes for known
  for (const std::uint32_t b : some) {
    ball_sums_[b].learned = averaged(ball_sums_[b].seen);
    ball_sums_[b].learned_source = ball_sums_[b].source.mean;
  }
  for (const std::uint32_t b : some)
    result_.steps += static_cast<std::uint64_t>(ball_sums_[b].steps);
  for (const std::uint32_t b : some) {
    result_.unfinished += static_cast<std::uint64_t>(ball_sums_[b].unfinished);
  }
  result_.walks += some.size() * block_;
  return true;
}

solution shared_solver::run() {
  // A ball serves many cells: it may have more walks than each of them would have had.
  const auto for_ball = [](std::uint64_t walks) {
    return std::clamp<std::uint64_t>(4 * std::min(walks, std::uint64_t{1} << 60), 16,
                                     std::uint64_t{1} << 62);
  };
  const std::uint64_t n = for_ball(std::min(options_.walks, options_.max_walks));
  // Passes of equal size, eight or more where there are walks for it: a standard error
  // comes from their differences.
  block_ = static_cast<std::size_t>(std::clamp<std::uint64_t>(n / 8, 1, max_batch));
  while (n % block_ != 0) --block_;
  sampled_ = type_ == ball_kernel_type::screened ? (block_ + 3) / 4 : block_;
  records_.resize(balls_.size());
  if (context_.sources.has_volume()) volumes_.resize(balls_.size());
  if (context_.sources.has_elements()) elements_.resize(balls_.size());
  const bool timed = std::isfinite(options_.seconds), to_error = options_.error > 0;
  const std::uint64_t passes = n / block_;
  const std::uint64_t planned = timed || to_error ? 0 : n * balls_.size();
  const std::uint64_t least =
      std::min<std::uint64_t>(std::max<std::uint64_t>(passes / 4, 8), passes);
  const std::vector<char> all(grid_.points.size(), 1);
  std::vector<char> wanted = all;
  for (std::uint64_t pass = 0;; ++pass) {
    if (!timed && !to_error && pass == passes) break;
    if ((pass + 1) * block_ > for_ball(options_.max_walks)) break;
    if (pass >= least && (timed || to_error)) {
      // with an error, those that have not reached it; with a time alone, every other
      // pass is for those whose error is above the mean
      const double mean = mean_error();
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        const double limit = to_error ? options_.error : pass % 2 == 1 ? mean : -1;
        wanted[i] = !point_sums_[i].undefined && worst_error(i) > limit;
      }
    }
    if (!run_pass(wanted)) {
      if (to_error || pass % 2 == 0) break;
      continue;
    }
    if (options_.on_progress &&
        !options_.on_progress({result_.walks, planned, mean_error(), seconds()})) {
      result_.stopped = true;
      break;
    }
    if (seconds() >= options_.seconds) break;
  }
  finish();
  return std::move(result_);
}

void shared_solver::finish() {
  result_.values.resize(grid_.points.size());
  for (std::size_t i = 0; i < grid_.points.size(); ++i) {
    estimate& e = result_.values[i];
    const point_sums& s = point_sums_[i];
    e.status = places_[i].status;
    if (e.status == point_status::boundary) {
      e.mean = places_[i].value;
      e.standard_error = dvec4{0};
    }
    if (e.status != point_status::ok || !(s.walks > 0)) continue;
    e.walks = static_cast<std::uint64_t>(s.walks);
    e.mean_steps = s.steps / s.walks;
    e.unfinished = static_cast<std::uint64_t>(s.unfinished);
    if (s.undefined) {
      e.status = point_status::undefined;
      continue;
    }
    e.mean = s.value.mean + context_.sources.field(grid_.points[i]);
    e.standard_error = s.value.standard_error();
    for (int c = context_.problem.channels; c < max_channels; ++c) {
      e.mean[c] = e.standard_error[c] = 0;
    }
  }
  result_.seconds = seconds();
}

}  // namespace

bool can_share(const pde_problem& problem, const section_grid& grid, const solve_options& options) {
  if (options.gradient) return false;
  const double reach = screened_reach / std::sqrt(problem.screening);  // of balls, if c > 0
  if (served * reach < 2 * grid.cell) return false;
  if (options.point_sources == point_source_estimator::balls && !problem.point_sources.empty()) {
    return false;
  }
  return problem.equation != pde_equation::biharmonic ||
         options.biharmonic == biharmonic_estimator::one_walk;
}

solution solve_shared(const pde_problem& problem, const section_grid& grid,
                      const solve_options& options) {
  return shared_solver(problem, grid, options).run();
}

}  // namespace wisp
