#include "wisp/geometry/sphere_trace.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sdf_node.h"

namespace wisp {

namespace {

// The part of the ray in the box: false where there is none.
bool clip(const dbox3& box, const sdf_ray& ray, double& t_min, double& t_max) {
  for (int a = 0; a < 3; ++a) {
    if (ray.direction[a] == 0) {
      if (!(ray.origin[a] >= box.min[a] && ray.origin[a] <= box.max[a])) return false;
      continue;
    }
    double near = (box.min[a] - ray.origin[a]) / ray.direction[a];
    double far = (box.max[a] - ray.origin[a]) / ray.direction[a];
    if (near > far) std::swap(near, far);
    t_min = std::max(t_min, near);
    t_max = std::min(t_max, far);
  }
  return t_min <= t_max;
}

bool is_finite(const dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void check(const sphere_trace_options& o) {
  if (!(o.tolerance > 0 && o.tolerance < 1)) {
    throw std::invalid_argument("sphere_trace: tolerance should be between 0 and 1");
  }
  if (!(o.cone >= 0)) throw std::invalid_argument("sphere_trace: cone should not be negative");
  if (!(o.relaxation >= 0 && o.relaxation < 1)) {
    throw std::invalid_argument("sphere_trace: relaxation should be at least 0 and below 1");
  }
  if (o.max_steps < 1) throw std::invalid_argument("sphere_trace: max_steps should be positive");
}

// A ray against a solid, from `t` to `end`.
struct tracer {
  const sdf_node& solid;
  const sdf_ray& ray;
  const sphere_trace_options& options;
  double speed;
  double size = 0;   // of the solid
  double noise = 0;  // what rounding does to values at the ray's start and the solid
  double t, end;
  double side = 0;  // of the start; 0 as long as it has none
  int steps = 0;

  tracer(const sdf_node& s, const sdf_ray& r, const sphere_trace_options& o)
      : solid(s), ray(r), options(o), speed(glm::length(r.direction)), t(o.t_min), end(o.t_max) {
    const auto reach = [](const dvec3& p) {
      return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    };
    const dbox3& box = solid.about.bounds;
    size = size_of(box);
    noise = reach(ray.origin);
    if (wisp::is_finite(box)) noise = std::max({noise, reach(box.min), reach(box.max)});
    noise *= 2 * std::numeric_limits<double>::epsilon();
  }

  dvec3 point(double at) const { return ray.origin + at * ray.direction; }
  double signed_at(double at) const { return value(solid, point(at)); }
  double unsigned_at(double at) const { return side * signed_at(at); }
  // How near is on the surface, for one that leaves out the cone.
  double near(double at) const {
    const double along = std::abs(at) * speed;
    return std::max({options.tolerance * (size > 0 ? size : 1e-3 * along), noise,
                     4 * std::numeric_limits<double>::epsilon() * along, 1e-300});
  }
  double tolerance(double at) const {
    return std::max(near(at), options.cone * std::abs(at) * speed);
  }

  // Finds the side of the start: one on the surface goes on until there is one.
  trace_end leave_start();
  // The next surface: t is where. A miss where there is none up to `end`.
  trace_end find();
  // What a point within the tolerance of the surface is.
  enum struct contact { crossing, touching, along };
  contact refine(double before, double at_before, double r);
};

trace_end tracer::leave_start() {
  double v = signed_at(t);
  const double first_step = tolerance(t);
  for (double step = first_step; std::abs(v) <= tolerance(t); step *= 2) {
    if (steps++ >= options.max_steps) return trace_end::step_limit;
    // an edge or a tangent is left slowly, a surface at once
    const double next = t + (size > 0 ? std::min(step, 1024 * first_step) : step) / speed;
    if (!(next <= end)) return trace_end::miss;
    t = next;
    v = signed_at(t);
  }
  if (std::isnan(v)) return trace_end::miss;  // of a function of the user's
  side = v < 0 ? -1 : 1;
  return trace_end::hit;
}

// r is the value at t, at_before the one at `before`, which is positive. Moves t to the
// crossing, or past where the surface is only touched.
tracer::contact tracer::refine(double before, double at_before, double r) {
  const double enough = near(t);
  const double least = std::max(1e-14 * size, 0.5 * noise);
  double low = before, at_low = at_before, high = t, at_high = r;
  if (r > 0) {
    low = t;
    at_low = r;
    double step = std::max(2 * r, 0.25 * enough) / speed;
    for (int i = 0;; ++i, step *= 2) {
      const double next = t + step;
      if (i == 12 || !(next <= end)) return contact::along;
      const double v = unsigned_at(next);
      ++steps;
      if (v <= 0) {
        high = next;
        at_high = v;
        break;
      }
      if (v > 2 * enough && v > r) {
        t = next;
        return contact::touching;
      }
      low = next;
      at_low = v;
    }
  }
  // a touch that rounding makes a crossing
  const double past = high + 4 * enough / speed;
  if (past <= end && at_high >= -4 * least) {
    const double v = unsigned_at(past);
    ++steps;
    if (v > 2 * enough) {
      t = past;
      return contact::touching;
    }
  }
  // regula falsi, with the weight of an end that stays halved (Illinois)
  for (int i = 0; i < 100; ++i) {
    double middle = low + (high - low) * (at_low / (at_low - at_high));
    if (i >= 40 || !(middle > low && middle < high)) middle = 0.5 * (low + high);
    t = middle;
    if (!(middle > low && middle < high)) break;
    const double v = unsigned_at(middle);
    ++steps;
    if (std::abs(v) <= least) break;
    if (v > 0) {
      low = middle;
      at_low = v;
      at_high *= 0.5;
    } else {
      high = middle;
      at_high = v;
      at_low *= 0.5;
    }
  }
  return contact::crossing;
}

trace_end tracer::find() {
  double r = unsigned_at(t), before = t, at_before = r;
  // How the distance grows along the ray, from the steps so far: -1 head on.
  double slope = -1;
  while (steps++ < options.max_steps) {
    if (std::isnan(r)) return trace_end::miss;
    if (r <= tolerance(t)) {
      if (options.cone > 0 || refine(before, at_before, r) != contact::touching) {
        return trace_end::hit;
      }
      r = unsigned_at(t);
      before = t;
      at_before = r;
      slope = -1;
      continue;
    }
    if (!(t < end)) return trace_end::miss;
    // along a plane this is where the next ball touches this one
    const double relaxed = std::max(1.0, 2 / (1 - slope));
    double next = std::min(t + relaxed * r / speed, end);
    if (!(std::abs(next) * speed < 1e100)) return trace_end::miss;  // out of an infinite world
    double r_next = unsigned_at(next);
    // between two balls that do not meet there may be a surface
    if (relaxed > 1 && !((next - t) * speed <= r + r_next)) {
      slope = -1;
      next = std::min(t + r / speed, end);
      r_next = unsigned_at(next);
      ++steps;
    } else if (next > t) {
      const double grown = std::clamp((r_next - r) / ((next - t) * speed), -1.0, 1.0);
      slope += options.relaxation * (grown - slope);
    }
    before = t;
    at_before = r;
    t = next;
    r = r_next;
  }
  return trace_end::step_limit;
}

// What of the ray lies behind the planes: it enters through one and leaves by another.
struct kept_part {
  double enter, leave;
  int enter_plane = -1, leave_plane = -1;
  bool any = true;
};

// A start nearer to a plane than `near` is on it, and on the side that the ray goes to.
kept_part keep(std::span<const cut_plane> cuts, const tracer& ray) {
  kept_part kept{ray.t, ray.end};
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const double l = glm::length(cuts[i].normal);
    if (!is_finite(cuts[i].point) || !(l > 0) || !std::isfinite(l)) {
      throw std::invalid_argument("sphere_trace: a cut plane needs a point and a direction");
    }
    const dvec3 n = cuts[i].normal / l;
    const double rate = glm::dot(ray.ray.direction, n);
    const double height = glm::dot(ray.ray.origin - cuts[i].point, n);  // over the plane
    const double at_start = height + ray.t * rate;
    const double crossing = -height / rate;
    const bool on_plane = std::abs(at_start) <= ray.near(ray.t);
    if (rate > 0) {
      if (on_plane || !(crossing >= ray.t)) {
        kept.any = false;
      } else if (crossing < kept.leave) {
        kept.leave = crossing;
        kept.leave_plane = static_cast<int>(i);
      }
    } else if (at_start > 0 && !on_plane) {
      if (!(rate < 0)) {
        kept.any = false;
      } else if (crossing > kept.enter) {
        kept.enter = crossing;
        kept.enter_plane = static_cast<int>(i);
      }
    }
  }
  kept.any = kept.any && kept.enter <= kept.leave;
  return kept;
}

}  // namespace

trace_result sphere_trace(const sdf& solid, const sdf_ray& ray,
                          const sphere_trace_options& options) {
  return sphere_trace(solid, {}, ray, options);
}

trace_result sphere_trace(const sdf& solid, std::span<const cut_plane> cuts, const sdf_ray& ray,
                          const sphere_trace_options& options) {
  check(options);
  trace_result result;
  tracer tracing(solid.node(), ray, options);
  const bool is_ray = is_finite(ray.origin) && is_finite(ray.direction) && tracing.speed > 0 &&
                      std::isfinite(tracing.speed);
  const kept_part kept = keep(cuts, tracing);
  const dbox3& box = solid.node().about.bounds;
  if (!is_ray || !kept.any || is_empty(box)) return result;

  const auto hit_plane = [&](double t, int plane, bool from_inside) {
    const dvec3 n = cuts[static_cast<std::size_t>(plane)].normal;
    result.end = trace_end::hit;
    result.at = {t, tracing.point(t), n / glm::length(n), from_inside, plane};
    result.steps = tracing.steps;
    return result;
  };
  double& t = tracing.t;
  t = kept.enter;
  tracing.end = kept.leave;
  // where the box ends the value is not yet negative
  if (wisp::is_finite(box)) {
    const double margin = 1e-6 * tracing.size + 4 * tracing.noise;
    if (!clip(grow(box, margin), ray, t, tracing.end)) return result;
  }
  if (!(t <= tracing.end) || !std::isfinite(t)) return result;

  result.end = tracing.leave_start();
  if (result.end == trace_end::hit) {
    // through a plane into the solid
    const bool entered = tracing.side < 0 && kept.enter_plane >= 0;
    if (entered) return hit_plane(kept.enter, kept.enter_plane, false);
    result.end = tracing.find();
    const bool left = result.end == trace_end::miss && tracing.side < 0 && t == kept.leave;
    if (left && kept.leave_plane >= 0) return hit_plane(kept.leave, kept.leave_plane, true);
  }
  result.steps = tracing.steps;
  if (result.end == trace_end::miss) return result;
  result.at.t = t;
  result.at.point = tracing.point(t);
  if (result.end == trace_end::step_limit) return result;
  result.at.from_inside = tracing.side < 0;
  result.at.normal = gradient_of(solid.node(), result.at.point);
  return result;
}

}  // namespace wisp
