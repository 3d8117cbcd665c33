#include "walker.h"

#include <algorithm>
#include <cmath>

namespace wisp {

namespace {

// A weight so small that what is multiplied by it cannot matter.
constexpr double negligible = 1e-100;

// Walks that are under way, by index. Walks of their own, of the nested biharmonic
// estimator, are added at the end.
struct walkers {
  const walk_context& context;
  std::vector<walk>& walks;
  std::vector<std::uint32_t> active = {};
  std::vector<dvec3> points = {};
  std::vector<double> radii = {};

  void run();

 private:
  // The walk comes to its end at a point of the boundary.
  void finish(walk& w, const boundary_point& at);
  // It is given up, and takes the value of the boundary within `reach`, if there is any.
  void cut_short(walk& w, double reach);
  // Beyond the sphere around the boundary. False: the walk is over.
  bool return_from_afar(walk& w);
  // One ball. False: the walk is over.
  bool step(std::uint32_t index, double radius);
  void add_nested(std::uint32_t index, const dvec3& from, double mass);
};

void walkers::finish(walk& w, const boundary_point& at) {
  const dvec4 g = context.boundary_value(at);
  if (!context.biharmonic()) {
    w.u += w.weight * g;
    return;
  }
  w.laplacian = context.problem.boundary_laplacian(at);
  w.u += g - w.held * w.laplacian;
}

void walkers::cut_short(walk& w, double reach) {
  w.unfinished = true;
  const pde_domain::nearest near = context.domain.find_boundary(w.x, reach);
  if (near.ends) return finish(w, near.at);
  // nothing is known here: not a number is better than any
  w.u = w.laplacian = dvec4{std::numeric_limits<double>::quiet_NaN()};
}

bool walkers::return_from_afar(walk& w) {
  const domain_data& domain = context.domain;
  const dvec3 away = w.x - domain.center;
  const double r = glm::length(away);
  if (!(r > context.far_radius)) return true;
  if (!context.exterior()) {
    // out through a hole of the boundary, and not likely to come back
    if (r < 4 * context.far_radius) return true;
    cut_short(w, 2 * r);
    return false;
  }
  const solve_options& o = context.options;
  if (o.exterior == exterior_estimator::roulette || context.k > 0) {
    if (context.k > 0 || !(r > o.roulette_radius * context.far_radius)) return true;
    // u less its value at infinity, to which a walk that ends adds nothing
    if (rand1d(w.rng) < o.roulette_continue) {
      w.u += (w.weight - w.weight / o.roulette_continue) * context.problem.infinity;
      w.weight /= o.roulette_continue;
      return true;
    }
    w.u += w.weight * context.problem.infinity;
    return false;
  }
  if (context.has_source) {
    w.u -=
        w.weight * context.sources.sample_outside(away, domain.center, context.far_radius, w.rng);
  }
  const double returns = context.far_radius / r;
  if (!w.returned) {
    // Both ways the first time: from afar, hardly a walk would come back by chance.
    w.returned = true;
    w.u += w.weight * (1 - returns) * context.problem.infinity;
    w.weight *= returns;
  } else if (rand1d(w.rng) >= returns) {
    w.u += w.weight * context.problem.infinity;
    return false;
  }
  w.x = domain.center + sample_exterior_return(w.rng, away, context.far_radius);
  return true;
}

void walkers::add_nested(std::uint32_t index, const dvec3& from, double mass) {
  const int n = context.options.nested_walks;
  for (int i = 0; i < n; ++i) {
    walk inner;
    inner.x = from;
    inner.rng = make_rng(static_cast<std::uint64_t>(next_uint(walks[index].rng)) << 32 |
                         next_uint(walks[index].rng));
    inner.only_laplacian = true;
    inner.parent = index;
    inner.parent_weight = mass / n;
    active.push_back(static_cast<std::uint32_t>(walks.size()));
    walks.push_back(inner);
  }
}

bool walkers::step(std::uint32_t index, double radius) {
  walk& w = walks[index];
  const double k = context.k;
  if (context.has_source) w.u -= w.weight * context.sources.sample_ball(w.x, radius, w.rng);
  const dvec3 from = w.x;
  w.x += radius * sample_direction(w.rng);
  ++w.steps;
  if (k > 0) {
    w.weight *= mean_value_factor(radius, k);
    if (!(w.weight > negligible)) return false;
  }
  if (context.biharmonic() && !w.only_laplacian) {
    const double mass = radius * radius / 6;
    if (context.options.biharmonic == biharmonic_estimator::one_walk) {
      w.held += mass;
    } else {
      const double r = sample_greens_radius(w.rng, radius, 0);
      const dvec3 y = from + r * sample_direction(w.rng);
      if (context.options.biharmonic == biharmonic_estimator::tree) {
        w.held += mass * poisson_kernel(r, glm::distance(y, w.x), radius);
      } else {
        add_nested(index, y, mass);  // w may have moved
      }
    }
  }
  return true;
}

void walkers::run() {
  active.resize(walks.size());
  for (std::size_t i = 0; i < walks.size(); ++i) active[i] = static_cast<std::uint32_t>(i);
  const auto max_steps = static_cast<std::uint32_t>(context.options.max_steps);
  std::vector<std::uint32_t> now;
  while (!active.empty()) {
    now.swap(active);
    active.clear();
    if (context.far_radius > 0) {
      std::erase_if(now, [&](std::uint32_t i) { return !return_from_afar(walks[i]); });
    }
    points.resize(now.size());
    radii.resize(now.size());
    for (std::size_t i = 0; i < now.size(); ++i) points[i] = walks[now[i]].x;
    context.domain.clearances(points, radii, context.options.tolerance);
    for (std::size_t i = 0; i < now.size(); ++i) {
      walk& w = walks[now[i]];
      double radius = radii[i];
      if (!(radius > context.epsilon)) {
        const pde_domain::nearest near = context.domain.find_boundary(w.x, context.epsilon);
        if (near.ends) {
          finish(w, near.at);
          continue;
        }
        radius = std::max(radius, near.distance);
      }
      if (w.steps >= max_steps || !(radius > 0)) {
        cut_short(w, 4 * radius + context.epsilon);
        continue;
      }
      if (step(now[i], std::min(radius, context.max_radius))) active.push_back(now[i]);
    }
  }
}

}  // namespace

void run_walks(const walk_context& context, std::vector<walk>& walks) {
  const std::size_t count = walks.size();
  walkers{context, walks}.run();
  // Walks of walks give their parents the Laplacian at a point.
  for (std::size_t i = count; i < walks.size(); ++i) {
    const walk& w = walks[i];
    walk& parent = walks[w.parent];
    parent.u -= w.parent_weight * w.laplacian;
    parent.steps += w.steps;
    parent.unfinished = parent.unfinished || w.unfinished;
  }
  walks.resize(count);
}

}  // namespace wisp
