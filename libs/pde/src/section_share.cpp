// Walks from the centers of balls serve all points in them: a variant of mean value
// caching (Bakbouk and Peers, Mean Value Caching for Walk on Spheres, 2023) that stores
// nothing from one pass to the next, so that memory does not grow with walks, and in which
// each point keeps to the same balls with the same weights, so that it stays unbiased.

#include "section_share.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "section_balls.h"
#include "wisp/core/parallel.h"

namespace wisp {

namespace {

// Where the records of a ball are; they are padded.
struct record_places {
  std::size_t first_walk = 0;
  std::size_t samples = 1, first_sample = 0;  // of the source, in a pass
};

// Positions relative to centers of balls. What is not filled lies on the sphere, where
// kernels are finite, and counts for nothing.
struct lane_records {
  std::vector<double> x, y, z;

  void resize(std::size_t n) {
    x.resize(n);
    y.resize(n);
    z.resize(n);
  }
  void set(std::size_t i, const dvec3& p) {
    x[i] = p.x;
    y[i] = p.y;
    z[i] = p.z;
  }
  point_lanes from(std::size_t first, std::size_t count) const {
    return {x.data() + first, y.data() + first, z.data() + first, padded(count)};
  }
};
using channel_records = std::array<std::vector<double>, max_channels>;

// The walks of a pass, by ball: the directions that they start to and what they found,
// less what is known before.
struct walk_records {
  lane_records nu;
  channel_records u, laplacian;
};
// Samples of a pass, by ball: f / (density * samples), less what is known before, and what
// Green's functions need of the places.
struct source_records {
  lane_records z;
  channel_records f;
  std::vector<double> products;
  std::size_t rows = 0;  // of them, for each ball

  double* products_of(const record_places& b) { return products.data() + rows * b.first_sample; }
  const double* products_of(const record_places& b) const {
    return products.data() + rows * b.first_sample;
  }
};

class shared_solver {
 public:
  shared_solver(const pde_problem& problem, const section_grid& grid, const solve_options& options)
      : context_(problem, options), grid_(grid), options_(options), start_(clock::now()) {
    type_ = problem.equation == pde_equation::biharmonic ? ball_kernel_type::biharmonic
            : context_.k > 0                             ? ball_kernel_type::screened
                                                         : ball_kernel_type::harmonic;
    all_ = make_balls(context_, grid, type_, options.threads);
    records_.resize(all_.balls.size());
    ball_sums_.resize(all_.balls.size());
    point_sums_.resize(grid.points.size());
    if (options.control_variates) take_nearest_values();
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
  void take_nearest_values();
  void make_records();
  bool run_pass(const std::vector<char>& wanted);
  void draw_sources(std::uint32_t b, rng_state& rng);
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

  section_balls all_;
  std::vector<record_places> records_;  // by ball
  walk_records walks_;
  source_records volumes_, elements_;  // where there are such sources
  std::vector<ball_sums> ball_sums_;
  std::vector<point_sums> point_sums_;
  solution result_;
};

// What is taken for known in the first pass: the boundary value next to each ball.
void shared_solver::take_nearest_values() {
  parallel_for(
      all_.balls.size(), options_.threads,
      [&](std::size_t b) {
        const std::uint32_t center = all_.balls[b].center;
        const auto near =
            context_.domain.find_boundary(grid_.points[center], 1.01 * all_.places[center].radius);
        if (!near.ends) return;
        const dvec4 g = context_.boundary_value(near.at);
        if (all_finite(g)) ball_sums_[b].learned.mean = g;
      },
      16);
}

void shared_solver::make_records() {
  std::size_t walks = 0, samples = 0, rows = 0;
  for (std::size_t b = 0; b < all_.balls.size(); ++b) {
    const section_ball& ball = all_.balls[b];
    // fewer samples where their kernels are series
    records_[b].samples = type_ == ball_kernel_type::screened ? (ball.walks + 3) / 4 : ball.walks;
    records_[b].first_walk = walks;
    records_[b].first_sample = samples;
    walks += padded(ball.walks);
    samples += padded(records_[b].samples);
    rows = std::max(rows, ball.kernel.product_rows());
  }
  const auto channels = static_cast<std::size_t>(context_.problem.channels);
  walks_.nu.resize(walks);
  std::fill(walks_.nu.x.begin(), walks_.nu.x.end(), 1.0);
  for (std::size_t c = 0; c < channels; ++c) {
    walks_.u[c].resize(walks);
    if (type_ == ball_kernel_type::biharmonic) walks_.laplacian[c].resize(walks);
  }
  const auto make = [&](source_records& records) {
    records.z.resize(samples);
    for (std::size_t b = 0; b < all_.balls.size(); ++b) {
      const std::size_t end = records_[b].first_sample + padded(records_[b].samples);
      for (std::size_t i = records_[b].first_sample; i < end; ++i) {
        records.z.x[i] = all_.balls[b].radius;
      }
    }
    for (std::size_t c = 0; c < channels; ++c) records.f[c].resize(samples);
    records.products.resize(samples * rows);
    records.rows = rows;
  };
  if (context_.sources.has_volume()) make(volumes_);
  if (context_.sources.has_elements()) make(elements_);
}

// Samples of the source in a ball, for all points of it.
void shared_solver::draw_sources(std::uint32_t index, rng_state& rng) {
  const double radius = all_.balls[index].radius;
  const record_places& place = records_[index];
  ball_sums& sums = ball_sums_[index];
  const dvec3 at = grid_.points[all_.balls[index].center];
  const auto keep = [&](const source_sample& drawn, const dvec4& known, std::size_t j,
                        source_records& records) {
    const std::size_t i = place.first_sample + j;
    const bool any = drawn.density > 0;
    const double scale = any ? 1 / (drawn.density * static_cast<double>(place.samples)) : 0;
    records.z.set(i, any ? drawn.point - at : dvec3{radius, 0, 0});
    for (int c = 0; c < context_.problem.channels; ++c) {
      records.f[static_cast<std::size_t>(c)][i] = any ? scale * (drawn.f[c] - known[c]) : 0;
    }
  };
  for (std::size_t j = 0; j < place.samples; ++j) {
    if (context_.sources.has_volume()) {
      const source_sample drawn = context_.sources.draw_volume(at, radius, rng);
      keep(drawn, sums.learned_source, j, volumes_);
      if (drawn.density > 0 && context_.sources.has_no_peaks()) sums.source.add(drawn.f);
    }
    if (context_.sources.has_elements()) {
      keep(context_.sources.draw_element(at, radius, rng), dvec4{0}, j, elements_);
    }
  }
  for (source_records* r : {&volumes_, &elements_}) {
    if (!r->products.empty()) {
      all_.balls[index].kernel.products(r->z.from(place.first_sample, place.samples),
                                        r->products_of(place));
    }
  }
}

// Walks of one pass from the spheres of some balls.
void shared_solver::walk_from_balls(std::span<const std::uint32_t> some) {
  std::vector<walk> walks;
  std::vector<dvec3> directions;
  for (const std::uint32_t index : some) {
    const section_ball& b = all_.balls[index];
    const dvec3 at = grid_.points[b.center];
    const std::uint64_t seed = hash64(options_.seed * 0x9e3779b97f4a7c15ull + index + 1);
    rng_state rng = make_rng(seed, ball_sums_[index].passes);
    directions.resize(b.walks);
    block_directions(rng, directions);
    for (std::size_t j = 0; j < b.walks; ++j) {
      walk w;
      w.rng = make_rng(~seed, ball_sums_[index].passes * b.walks + j);
      w.x = at + b.radius * directions[j];
      walks.push_back(w);
      walks_.nu.set(records_[index].first_walk + j, directions[j]);
    }
    draw_sources(index, rng);
  }
  run_walks(context_, walks);
  std::size_t at = 0;
  const auto channels = static_cast<std::size_t>(context_.problem.channels);
  for (const std::uint32_t index : some) {
    const section_ball& b = all_.balls[index];
    ball_sums& sums = ball_sums_[index];
    sums.steps = sums.unfinished = 0;
    ++sums.passes;
    const std::size_t first = records_[index].first_walk;
    for (std::size_t i = first; i < first + b.walks; ++i) {
      const walk& w = walks[at++];
      const dvec3 nu{walks_.nu.x[i], walks_.nu.y[i], walks_.nu.z[i]};
      const dvec4 rest = w.u - sums.learned.at(nu);
      for (std::size_t c = 0; c < channels; ++c) {
        walks_.u[c][i] = rest[static_cast<int>(c)];
        if (!walks_.laplacian[c].empty()) walks_.laplacian[c][i] = w.laplacian[static_cast<int>(c)];
      }
      sums.steps += w.steps + 1.0;
      sums.unfinished += w.unfinished;
      if (options_.control_variates) sums.seen.add(w.u, nu);
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
  std::array<double, max_block> kernels;
  for (std::uint32_t s = all_.first[point]; s < all_.first[point + 1]; ++s) {
    const std::uint32_t index = all_.serving[s];
    const section_ball& b = all_.balls[index];
    const record_places& place = records_[index];
    const ball_sums& about = ball_sums_[index];
    const dvec3 y = p - grid_.points[b.center];
    const ball_kernels kernel(b.kernel, y);
    // What is known of u on the sphere, to first order, has a known extension, and the
    // known mean of f in the ball a known integral.
    dvec4 value =
        kernel.value_mean() * about.learned.mean - kernel.greens_mass() * about.learned_source;
    for (std::size_t c = 0; c < channels; ++c) {
      value[static_cast<int>(c)] += kernel.value_slope() * glm::dot(about.learned.slope[c], y);
    }
    const auto add = [&](double scale, const channel_records& records, std::size_t first,
                         std::size_t n) {
      for (std::size_t c = 0; c < channels; ++c) {
        value[static_cast<int>(c)] +=
            scale * sum_of_products(kernels.data(), records[c].data() + first, padded(n));
      }
    };
    const point_lanes nu = walks_.nu.from(place.first_walk, b.walks);
    const double n = static_cast<double>(b.walks);
    kernel.values(nu, kernels.data());
    add(1 / n, walks_.u, place.first_walk, b.walks);
    if (type_ == ball_kernel_type::biharmonic) {
      kernel.laplacians(nu, kernels.data());
      add(-1 / n, walks_.laplacian, place.first_walk, b.walks);
    }
    for (const source_records* r : {&volumes_, &elements_}) {
      if (r->z.x.empty()) continue;
      kernel.greens(r->z.from(place.first_sample, place.samples), r->products_of(place),
                    kernels.data());
      add(-1, r->f, place.first_sample, place.samples);
    }
    const double w = ball_weight(b, y);
    total += w * value;
    weights += w;
    sums.steps += about.steps;
    sums.unfinished += about.unfinished;
    sums.walks += n;
  }
  total /= weights;
  if (!all_finite(total)) sums.undefined = true;
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
      if (!std::isfinite(e[c]) || all_.places[i].status != point_status::ok) continue;
      sum += e[c] * e[c];
      ++n;
    }
  }
  return n > 0 ? std::sqrt(sum / static_cast<double>(n)) : std::numeric_limits<double>::quiet_NaN();
}

// One more estimate for each point that is wanted. False: stop.
bool shared_solver::run_pass(const std::vector<char>& wanted) {
  std::vector<char> used(all_.balls.size(), 0);
  std::vector<std::uint32_t> points, some;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!wanted[i] || all_.first[i] == all_.first[i + 1]) continue;
    points.push_back(static_cast<std::uint32_t>(i));
    for (std::uint32_t s = all_.first[i]; s < all_.first[i + 1]; ++s) used[all_.serving[s]] = 1;
  }
  for (std::size_t b = 0; b < used.size(); ++b) {
    if (used[b]) some.push_back(static_cast<std::uint32_t>(b));
  }
  if (some.empty()) return false;
  std::vector<std::size_t> chunks = {0};  // of about as many walks
  for (std::size_t i = 0, walks = 0; i < some.size(); ++i) {
    walks += all_.balls[some[i]].walks;
    if (walks < 2048 && i + 1 < some.size()) continue;
    chunks.push_back(i + 1);
    walks = 0;
  }
  parallel_for(chunks.size() - 1, options_.threads, [&](std::size_t c) {
    walk_from_balls(std::span(some).subspan(chunks[c], chunks[c + 1] - chunks[c]));
  });
  parallel_for(
      points.size(), options_.threads, [&](std::size_t i) { gather(points[i]); }, 64);
  for (const std::uint32_t b : some) {
    ball_sums& sums = ball_sums_[b];
    // what the next pass takes for known
    if (options_.control_variates) {
      sums.learned = averaged(sums.seen);
      sums.learned_source = sums.source.mean;
    }
    result_.steps += static_cast<std::uint64_t>(sums.steps);
    result_.unfinished += static_cast<std::uint64_t>(sums.unfinished);
    result_.walks += all_.balls[b].walks;
  }
  return true;
}

solution shared_solver::run() {
  // A ball serves many cells: it may have more walks than each of them would have had.
  const auto for_ball = [](std::uint64_t walks) {
    return std::clamp<std::uint64_t>(4 * std::min(walks, std::uint64_t{1} << 60), 32,
                                     std::uint64_t{1} << 62);
  };
  const std::uint64_t n = for_ball(std::min(options_.walks, options_.max_walks));
  // Passes of equal size, eight or more: a standard error comes from their differences.
  const auto block = static_cast<std::size_t>(std::clamp<std::uint64_t>(n / 16, 4, 64));
  share_out(all_, grid_, block);
  make_records();
  const bool timed = std::isfinite(options_.seconds), to_error = options_.error > 0;
  const std::uint64_t passes = n / block;
  std::uint64_t planned = 0;
  if (!timed && !to_error) {
    for (const section_ball& b : all_.balls) planned += passes * b.walks;
  }
  const std::uint64_t least =
      std::min<std::uint64_t>(std::max<std::uint64_t>(passes / 4, 8), passes);
  const std::vector<char> all(grid_.points.size(), 1);
  std::vector<char> wanted = all;
  for (std::uint64_t pass = 0;; ++pass) {
    if (!timed && !to_error && pass == passes) break;
    if ((pass + 1) * block > for_ball(options_.max_walks)) break;
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
    e.status = all_.places[i].status;
    if (e.status == point_status::boundary) {
      e.mean = all_.places[i].value;
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
  if (are_small(std::sqrt(problem.screening), grid)) return false;
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
