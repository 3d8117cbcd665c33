#include "point_walks.h"

#include <algorithm>
#include <cmath>

namespace wisp {

namespace {

void join(sphere_moments& a, const sphere_moments& b) {
  a.mean += b.mean;
  for (std::size_t c = 0; c < max_channels; ++c) a.slope[c] += b.slope[c];
  a.nu += b.nu;
  a.weight += b.weight;
}

// What the first ball of a walk adds.
struct first_ball {
  dvec3 nu = {0, 0, 0};
  dvec4 source = {0, 0, 0, 0};
  channel_vectors source_gradient = {};
  double mass = 0;  // of the Laplacian, biharmonic
};

}  // namespace

walk_context::walk_context(const pde_problem& p, const solve_options& o)
    : problem(p), options(o), domain(*p.domain.data()), sources(p, o) {
  if (p.equation == pde_equation::screened_poisson) k = std::sqrt(p.screening);
  epsilon = o.epsilon > 0 ? o.epsilon : 1e-4 * domain.size;
  has_source = !sources.empty();
  if (k > 0 && sources.has_volume() && o.sampling == source_sampling::uniform) max_radius = 4 / k;
  if (domain.bounded) far_radius = 0.5 * 1.05 * domain.size;
}

dvec4 walk_context::boundary_value(const boundary_point& at) const {
  const dvec4 g = problem.boundary(at);
  return sources.has_field() ? g - sources.field(at.position) : g;
}

void walk_sums::merge(const walk_sums& b) {
  value.merge(b.value);
  walks += b.walks;
  steps += b.steps;
  unfinished += b.unfinished;
  undefined += b.undefined;
  join(seen, b.seen);
}
void walk_sums::learn() { learned = averaged(seen); }

void gradient_sums::merge(const gradient_sums& b) {
  for (std::size_t c = 0; c < max_channels; ++c) channel[c].merge(b.channel[c]);
  join(seen, b.seen);
}
void gradient_sums::learn() { learned = averaged(seen); }

point_place place_point(const walk_context& context, const dvec3& p) {
  point_place place;
  const bool finite = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  const int side = finite ? context.domain.side_of(p) : 1;
  if (!finite || side == (context.exterior() ? -1 : 1)) {
    place.status = point_status::outside;
    return place;
  }
  if (side == domain_data::unknown_side) {
    place.status = point_status::undefined;
    return place;
  }
  const double tiny = 1e-14 * context.domain.size;
  if (side == 0) {
    const auto near = context.domain.find_boundary(p, tiny);
    place.status = point_status::boundary;
    const dvec4 g = context.problem.boundary(near.ends ? near.at : boundary_point{p});
    for (int c = 0; c < context.problem.channels; ++c) place.value[c] = g[c];
    if (!all_finite(g)) place.status = point_status::undefined;
    return place;
  }
  if (context.sources.on_point_source(p)) {
    place.status = point_status::singular;
    return place;
  }
  context.domain.clearances({&p, 1}, {&place.radius, 1}, 0.01);
  // next to the boundary bounds in single precision say nothing
  if (!(place.radius > 1e-4 * context.domain.size)) {
    const auto near = context.domain.find_boundary(p, 1e-3 * context.domain.size);
    place.radius = std::max(place.radius, near.distance);
  }
  place.radius = std::min(place.radius, context.max_radius);
  if (!(place.radius > 0)) place.status = point_status::outside;
  return place;
}

void block_directions(rng_state& rng, std::span<dvec3> directions) {
  if (directions.size() <= 2) {
    directions[0] = sample_direction(rng);
    if (directions.size() == 2) directions[1] = -directions[0];
    return;
  }
  // A spherical Fibonacci lattice (Gonzalez, Measurement of Areas on a Sphere, 2010)
  // around a random pole, turned by a random angle.
  const dvec3 w = sample_direction(rng);
  const dvec3 a = std::abs(w.x) < 0.6 ? dvec3{1, 0, 0} : dvec3{0, 1, 0};
  const dvec3 e = glm::normalize(glm::cross(w, a)), f = glm::cross(w, e);
  const double n = static_cast<double>(directions.size());
  const double turn = 2 * pi_d * rand1d(rng);
  constexpr double golden = 2.39996322972865332;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / n;
    const double s = std::sqrt((1 - z) * (1 + z)), phi = turn + golden * static_cast<double>(i);
    directions[i] = z * w + s * (std::cos(phi) * e + std::sin(phi) * f);
  }
}

void walk_from_points(const walk_context& context, const walk_chunk& chunk, int block,
                      std::vector<chunk_sums>& sums) {
  const solve_options& o = context.options;
  const double k = context.k;
  const bool biharmonic = context.biharmonic();
  const auto b = static_cast<std::size_t>(block);
  std::vector<walk> walks;
  std::vector<first_ball> firsts;
  // Of the nested biharmonic estimator: walks from a sample of the first ball come
  // after the walk that they belong to.
  const int nested =
      biharmonic && o.biharmonic == biharmonic_estimator::nested ? o.nested_walks : 0;
  std::size_t total = 0;
  for (const walk_run& run : chunk) total += run.count;
  walks.reserve(total * static_cast<std::size_t>(1 + nested));
  firsts.reserve(total);

  std::vector<dvec3> directions(b);
  for (std::size_t s = 0; s < chunk.size(); ++s) {
    const walk_run& run = chunk[s];
    const dvec3 at = sums[s].at;
    const double R = sums[s].place.radius;
    const std::uint64_t seed = hash64(o.seed * 0x9e3779b97f4a7c15ull + run.point + 1);
    for (std::uint64_t i = 0; i < run.count; ++i) {
      const std::uint64_t index = run.first + i;
      if (i % b == 0) {
        rng_state rng = make_rng(seed, index);
        block_directions(rng, directions);
      }
      walk w;
      w.rng = make_rng(~seed, index);
      first_ball first;
      first.nu = directions[static_cast<std::size_t>(i % b)];
      if (context.has_source) {
        first.source = -context.sources.sample_first_ball(
            at, R, w.rng, o.gradient ? &first.source_gradient : nullptr);
      }
      w.x = at + R * first.nu;
      if (!biharmonic) {
        walks.push_back(w);
        firsts.push_back(first);
        continue;
      }
      first.mass = R * R / 6;
      dvec3 y = at;
      if (o.biharmonic != biharmonic_estimator::one_walk) {
        const double r = sample_greens_radius(w.rng, R, 0);
        y = at + r * sample_direction(w.rng);
        if (o.biharmonic == biharmonic_estimator::tree) {
          first.mass *= poisson_kernel(r, glm::distance(y, w.x), R);
        }
      }
      const std::uint64_t inner_seed =
          static_cast<std::uint64_t>(next_uint(w.rng)) << 32 | next_uint(w.rng);
      walks.push_back(w);
      for (int j = 0; j < nested; ++j) {
        walk inner;
        inner.x = y;
        inner.rng = make_rng(inner_seed, static_cast<std::uint64_t>(j));
        inner.only_laplacian = true;
        walks.push_back(inner);
      }
      firsts.push_back(first);
    }
  }
  run_walks(context, walks);

  std::size_t at_walk = 0, at_first = 0;
  for (std::size_t s = 0; s < chunk.size(); ++s) {
    chunk_sums& sum = sums[s];
    const double R = sum.place.radius;
    const double C = mean_value_factor(R, k), D = mean_gradient_factor(R, k);
    const bool controlled = o.control_variates && sum.learned.weight > 0;
    dvec4 value{0};
    channel_vectors gradient = {};
    bool defined = true;
    for (std::uint64_t i = 0; i < chunk[s].count; ++i) {
      const walk& w = walks[at_walk++];
      const first_ball& first = firsts[at_first++];
      ++sum.sums.walks;
      sum.sums.steps += w.steps + 1;
      dvec4 laplacian = w.laplacian;
      bool unfinished = w.unfinished;
      if (nested > 0) laplacian = dvec4{0};
      for (int j = 0; j < nested; ++j) {
        const walk& inner = walks[at_walk++];
        laplacian += inner.laplacian / static_cast<double>(nested);
        sum.sums.steps += inner.steps;
        unfinished = unfinished || inner.unfinished;
      }
      sum.sums.unfinished += unfinished;
      const dvec4 local = first.source - first.mass * laplacian;
      defined = defined && all_finite(w.u) && all_finite(local);
      for (const dvec3& g : first.source_gradient) {
        defined = defined && std::isfinite(g.x + g.y + g.z);
      }

      const dvec4 learned = sum.learned.at(first.nu) - sum.learned.mean;  // its mean is 0
      value += C * (controlled ? w.u - learned : w.u) + local;
      sum.sums.seen.add(controlled ? w.u - learned : w.u, first.nu);
      if (controlled) {
        // the slope of what was taken out
        for (std::size_t c = 0; c < max_channels; ++c)
          sum.sums.seen.slope[c] += sum.learned.slope[c];
      }
      if (o.gradient) {
        // grad u = 3/R E[u nu] - R^2/10 3/R E[lap u nu], biharmonic
        const dvec4 q = biharmonic ? w.u - R * R / 10 * w.laplacian : w.u;
        const dvec4 rest = controlled ? q - sum.learned_slope.at(first.nu) : q;
        for (std::size_t c = 0; c < max_channels; ++c) {
          const dvec3 known = controlled ? sum.learned_slope.slope[c] / 3.0 : dvec3{0};
          const dvec3 moment = rest[static_cast<int>(c)] * first.nu + known;
          gradient[c] += D * moment - first.source_gradient[c];
          sum.gradient.seen.slope[c] += 3.0 * moment;
        }
        sum.gradient.seen.mean += q;
        sum.gradient.seen.weight += 1;
      }
      if ((i + 1) % b != 0) continue;
      if (defined) {
        sum.sums.value.add(value / static_cast<double>(b));
        if (o.gradient) {
          for (std::size_t c = 0; c < max_channels; ++c) {
            sum.gradient.channel[c].add(gradient[c] / static_cast<double>(b));
          }
        }
      } else {
        ++sum.sums.undefined;
      }
      value = dvec4{0};
      gradient = {};
      defined = true;
    }
  }
}

}  // namespace wisp
