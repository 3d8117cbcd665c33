#include "wisp/geometry/sphere_trace.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

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

void check(const trace_options& o) {
  if (!(o.tolerance > 0 && o.tolerance < 1)) {
    throw std::invalid_argument("sphere_trace: tolerance should be between 0 and 1");
  }
  if (!(o.cone >= 0)) throw std::invalid_argument("sphere_trace: cone should not be negative");
  if (!(o.relaxation >= 0 && o.relaxation < 1)) {
    throw std::invalid_argument("sphere_trace: relaxation should be at least 0 and below 1");
  }
  if (o.max_steps < 1) throw std::invalid_argument("sphere_trace: max_steps should be positive");
}

struct half_space {
  dvec3 point, normal;
  double at(const dvec3& p) const { return glm::dot(p - point, normal); }
};

// The cut solid.
struct cut_solid {
  const sdf_node& solid;
  const std::vector<half_space>& cuts;

  double at(const dvec3& p) const {
    double most = -unbounded;
    for (const half_space& h : cuts) most = std::max(most, h.at(p));
    return std::max(most, solid.at(p, most, unbounded));
  }
  // The plane that decides the value at p; -1: the solid.
  int plane_at(const dvec3& p) const {
    int plane = -1;
    double most = value(solid, p);
    for (std::size_t i = 0; i < cuts.size(); ++i) {
      const double v = cuts[i].at(p);
      if (v > most) plane = static_cast<int>(i);
      most = std::max(most, v);
    }
    return plane;
  }
};

trace_result trace(const cut_solid& solid, const sdf_ray& ray, const trace_options& options) {
  trace_result result;
  const dvec3 d = ray.direction;
  const double speed = glm::length(d);
  if (!is_finite(ray.origin) || !is_finite(d) || !(speed > 0) || !std::isfinite(speed)) {
    return result;
  }
  double t = options.t_min, end = options.t_max, size = 0;
  const dbox3& box = solid.solid.about.bounds;
  if (is_empty(box)) return result;
  if (wisp::is_finite(box)) {
    const dvec3 extent = box.max - box.min;
    const dvec3 away = glm::max(glm::abs(box.min - ray.origin), glm::abs(box.max - ray.origin));
    size = std::max({extent.x, extent.y, extent.z, away.x, away.y, away.z});
    // where the box ends the value is not yet negative
    if (!clip(grow(box, 1e-6 * size), ray, t, end)) return result;
  }
  if (!(t <= end) || !std::isfinite(t)) return result;
  const auto point = [&](double at) { return ray.origin + at * d; };
  const auto tolerance = [&](double at) {
    const double along = std::abs(at) * speed;
    return std::max({options.tolerance * std::max(size, 1e-3 * along), options.cone * along,
                     4 * std::numeric_limits<double>::epsilon() * along});
  };

  // A start on the surface has no side: go on until there is one.
  double v = solid.at(point(t));
  const double first_step = tolerance(t);
  for (double step = first_step; std::abs(v) <= tolerance(t); step *= 2) {
    if (result.steps++ >= options.max_steps || !(t + step / speed <= end)) {
      result.end = result.steps >= options.max_steps ? trace_end::step_limit : trace_end::miss;
      return result;
    }
    // an edge or a tangent is left slowly, a surface at once
    t += std::min(step, 1024 * first_step) / speed;
    v = solid.at(point(t));
  }
  const double side = v < 0 ? -1 : 1;

  const auto unsigned_at = [&](double at) { return side * solid.at(point(at)); };
  double r = side * v;
  // How the distance grows along the ray, from the steps so far: -1 head on.
  double slope = -1;
  while (result.steps++ < options.max_steps) {
    if (std::isnan(r)) return result;  // of a function of the user's
    if (r <= tolerance(t)) {
      const dvec3 x = point(t);
      result.end = trace_end::hit;
      result.at = {t, x, {0, 0, 0}, side < 0, solid.plane_at(x)};
      result.at.normal = result.at.plane >= 0
                             ? solid.cuts[static_cast<std::size_t>(result.at.plane)].normal
                             : solid.solid.gradient(x);
      return result;
    }
    if (!(t < end)) return result;
    // along a plane this is where the next ball touches this one
    const double relaxed = std::max(1.0, 2 / (1 - slope));
    double next = std::min(t + relaxed * r / speed, end);
    if (!(std::abs(next) * speed < 1e100)) return result;  // on its way out of an infinite world
    double r_next = unsigned_at(next);
    // between two balls that do not meet there may be a surface
    if (relaxed > 1 && !((next - t) * speed <= r + r_next)) {
      slope = -1;
      next = std::min(t + r / speed, end);
      r_next = unsigned_at(next);
      ++result.steps;
    } else if (next > t) {
      const double grown = std::clamp((r_next - r) / ((next - t) * speed), -1.0, 1.0);
      slope += options.relaxation * (grown - slope);
    }
    t = next;
    r = r_next;
  }
  result.end = trace_end::step_limit;
  return result;
}

}  // namespace

trace_result sphere_trace(const sdf& solid, const sdf_ray& ray, const trace_options& options) {
  return sphere_trace(solid, {}, ray, options);
}

trace_result sphere_trace(const sdf& solid, std::span<const cut_plane> cuts, const sdf_ray& ray,
                          const trace_options& options) {
  check(options);
  std::vector<half_space> planes;
  for (const cut_plane& c : cuts) {
    const double l = glm::length(c.normal);
    if (!is_finite(c.point) || !(l > 0) || !std::isfinite(l)) {
      throw std::invalid_argument("sphere_trace: a cut plane needs a point and a direction");
    }
    planes.push_back({c.point, c.normal / l});
  }
  return trace({solid.node(), planes}, ray, options);
}

}  // namespace wisp
