// Single precision decides what may be the closest element, with bounds that count
// its rounding in; that is then compared in double.

#include "wisp/geometry/closest_point.h"

#include "finish.h"

namespace wisp {

namespace {

bool is_finite(const dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}
float round_up(double x) { return std::nextafter(static_cast<float>(x), infinity); }

// For points so far away that single precision could not tell the elements apart.
// Calls compare(leaf) for what may hold the closest, the nearest first, while
// limit() says how near it has to be, normalized and squared.
template <typename Compare, typename Limit>
void find_far(const bvh_data& data, const dvec3& p, const Compare& compare, const Limit& limit) {
  struct far_waiting {
    double distance2;
    uint32_t child;
  };
  std::array<far_waiting, stack_size> stack;
  std::size_t top = 0;
  stack[top++] = {0, 0};
  while (top > 0) {
    const far_waiting w = stack[--top];
    if (w.distance2 > limit()) continue;
    if ((w.child & bvh_leaf_bit) != 0) {
      compare(data.leaves[w.child & ~bvh_leaf_bit]);
      continue;
    }
    const bvh_node& n = data.nodes[w.child];
    const std::size_t base = top;
    for (int i = 0; i < bvh_width && n.child[i] != bvh_no_child; ++i) {
      dvec3 outside, q, normal;
      for (int a = 0; a < 3; ++a) {
        const double low = n.min[a][i], high = n.max[a][i];
        outside[a] = std::max({low - p[a], p[a] - high, 0.0});
        q[a] = p[a] - 0.5f * (n.min[a][i] + n.max[a][i]);
        normal[a] = n.normal[a][i];
      }
      const double z = glm::dot(q, normal);
      const double over = std::max({n.z_min[i] - z, z - n.z_max[i], 0.0});
      const double beside = std::max(glm::length(q - z * normal) - n.radius[i], 0.0);
      // the normal has unit length to single precision only
      const double cylinder2 = (over * over + beside * beside) * (1 - 1e-6);
      const far_waiting child = {std::max(glm::dot(outside, outside), cylinder2), n.child[i]};
      if (child.distance2 > limit()) continue;
      std::size_t j = top++;
      for (; j > base && stack[j - 1].distance2 < child.distance2; --j) stack[j] = stack[j - 1];
      stack[j] = child;
    }
  }
}

// How much farther than the closest element a computed squared distance may be.
constexpr double far_slack = 1 + 1e-13;

closest_point_result result_of(const finish& f, double distance, double lower_bound,
                               double max_distance) {
  closest_point_result r;
  if (f.element == bvh_no_child || !(distance <= max_distance)) {
    r.lower_bound = std::min(max_distance, std::max(lower_bound, 0.0));
    return r;
  }
  r.distance = distance;
  r.lower_bound = std::clamp(lower_bound, 0.0, distance);
  r.element = static_cast<int>(f.element);
  r.at = f.at;
  r.at.point *= f.data->unit;
  return r;
}

// No element is farther than the far end of the cube that is not far.
constexpr float farthest = 2 * (far_from + 2);

// Looks at all candidates.
void look_at_all(nearest_query& q, finish& best) {
  for (std::size_t i = 0; i < q.count; ++i) best.compare(q.candidates[i].slot);
  q.count = 0;
}

}  // namespace

void start(nearest_query& q, finish& best, const bvh_data& data, const dvec3& x,
           const closest_point_options& options) {
  q.data = &data;
  q.p = vec3(x);
  q.margin = margin_of(q.p);
  q.shrink = static_cast<float>(1 - std::clamp(options.tolerance, 0.0, 1.0));
  q.reach = q.surely = farthest;
  const double most = options.max_distance * data.scale;
  if (most < farthest) {
    q.reach = round_up(most) + 2 * q.margin;
    q.surely = static_cast<float>(most);
  }
  // the tolerance is of what will be found
  q.limit2 = q.reach * q.reach;
  q.least_left_out = infinity;
  q.count = 0;
  q.stack.start();
  q.best = &best;
  q.look_at = [](nearest_query& query) {
    auto& f = *static_cast<finish*>(query.best);
    look_at_all(query, f);
    query.reach = std::min(query.reach, round_up(std::sqrt(f.distance2)) + 2 * query.margin);
  };
}

closest_point_result finish_up(const nearest_query& q, finish& best, const bvh& tree,
                               const dvec3& p, const closest_point_options& options) {
  for (std::size_t i = 0; i < q.count; ++i) {
    const candidate& c = q.candidates[i];
    const float within = q.reach + c.slack;
    if (c.distance2 <= within * within) best.compare(c.slot);
  }
  const double distance = best.distance();
  double lower = distance;
  if (q.shrink < 1) {
    const double left_out = std::sqrt(static_cast<double>(q.least_left_out)) - q.margin;
    lower = std::min(lower, left_out * q.data->unit);
  }
  // where single precision cannot prove what was asked for, as next to slivers
  if (distance <= options.max_distance && lower < q.shrink * distance) {
    return closest_point(tree, p, {.max_distance = options.max_distance});
  }
  return result_of(best, distance, std::min(lower, options.max_distance), options.max_distance);
}

std::optional<closest_point_result> special_case(const bvh& tree, const dvec3& p,
                                                 const closest_point_options& options) {
  const double most = options.max_distance;
  closest_point_result none;
  if (!is_finite(p) || !(most >= 0)) return none;
  if (tree.empty()) {
    none.lower_bound = most;
    return none;
  }
  const bvh_data& data = *tree.data();
  const dvec3 x = data.normalized(p);
  if (!is_far(x)) return {};
  finish f(data, p);
  const double most2 = most * data.scale * (most * data.scale);
  find_far(
      data, x,
      [&](const bvh_leaf& leaf) {
        for (uint32_t i = 0; i < leaf.count; ++i) f.compare(leaf.first + i);
      },
      [&] { return std::min(f.distance2, most2) * far_slack; });
  const double distance = f.distance();
  return result_of(f, distance, std::min(distance, most), most);
}

void start(bounds_query& q, const bvh_data& data, const dvec3& x, double tolerance) {
  q.data = &data;
  q.p = vec3(x);
  const auto shrink = static_cast<float>(1 - std::clamp(tolerance, 0.0, 1.0));
  q.shrink2 = shrink * shrink;
  q.upper2 = q.least_left_out = infinity;
  q.limit2 = farthest * farthest;
  q.stack.start();
}

distance_bounds finish_up(const bounds_query& q, const bvh& tree, const dvec3& p,
                          double tolerance) {
  const double margin = margin_of(q.p);
  const double low = std::sqrt(std::min(q.least_left_out, q.upper2)) - margin;
  const double high = std::sqrt(q.upper2) + margin;
  // where single precision is not enough, as next to slivers
  if (low < (1 - tolerance) * high) {
    const double d = closest_point(tree, p).distance;
    return {d, d};
  }
  return {low * q.data->unit, high * q.data->unit};
}

std::optional<distance_bounds> special_bounds(const bvh& tree, const dvec3& p) {
  constexpr double unbounded = std::numeric_limits<double>::infinity();
  if (!is_finite(p)) return distance_bounds{};
  if (tree.empty()) return distance_bounds{unbounded, unbounded};
  if (!is_far(tree.data()->normalized(p))) return {};
  const double d = closest_point(tree, p).distance;
  return distance_bounds{d, d};
}

closest_point_result closest_point(const bvh& tree, const dvec3& p,
                                   const closest_point_options& options) {
  if (const auto special = special_case(tree, p, options)) return *special;
  const bvh_data& data = *tree.data();
  finish f(data, p);
  nearest_query q;
  start(q, f, data, data.normalized(p), options);
  run_nearest(q);
  return finish_up(q, f, tree, p, options);
}

bool closer_than(const bvh& tree, const dvec3& p, double r) {
  if (tree.empty() || !is_finite(p) || !(r > 0)) return false;
  const bvh_data& data = *tree.data();
  const dvec3 x = data.normalized(p);
  finish f(data, p);
  const double r_scaled = r * data.scale;
  if (is_far(x)) {
    find_far(
        data, x,
        [&](const bvh_leaf& leaf) {
          for (uint32_t i = 0; i < leaf.count; ++i) f.compare(leaf.first + i);
        },
        [&] { return f.distance() < r ? -1 : r_scaled * r_scaled * far_slack; });
    return f.distance() < r;
  }
  nearest_query q;
  start(q, f, data, x, {.max_distance = r});
  q.look_at = [](nearest_query& query) {
    auto& best = *static_cast<finish*>(query.best);
    look_at_all(query, best);
    if (best.distance() < best.enough) query.reach = -1;
  };
  f.enough = r;
  const float surely = static_cast<float>(std::min(r_scaled, 2.0 * farthest)) - 2 * q.margin;
  const int found = run_any(q, surely);
  if (found < 0) look_at_all(q, f);
  return found > 0 || f.distance() < r;
}

distance_bounds bound_distance(const bvh& tree, const dvec3& p, double tolerance) {
  if (const auto special = special_bounds(tree, p)) return *special;
  bounds_query q;
  start(q, *tree.data(), tree.data()->normalized(p), tolerance);
  run_bounds(q);
  return finish_up(q, tree, p, tolerance);
}

}  // namespace wisp
