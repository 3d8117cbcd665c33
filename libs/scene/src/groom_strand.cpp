// The natural interpolating cubic spline in B-spline form: Farin, Curves and
// Surfaces for CAGD, 5th edition, section 9.

#include "groom_strand.h"

#include <algorithm>
#include <cmath>

namespace wisp {

namespace {

float smooth(float t) {
  t = std::clamp(t, 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// Keeps the points of one strand off the surface. Queries that a former answer
// makes needless are left out: the distance changes by no more than the way.
class surface_guard {
 public:
  surface_guard(const groom_surface& surface, float radius) : surface_(surface), radius_(radius) {}

  // The signed closest point to p if it may be nearer than `clearance`.
  std::optional<groom_surface_point> near(const vec3& p, float clearance) {
    const float moved = glm::length(p - at_);
    if (known_ && free_ - moved > clearance) return {};
    float radius = std::max(radius_, 1.01f * clearance);
    // The last closest point bounds the search, with room for rounding.
    if (hit_) radius = std::min(radius, 1.01f * (std::abs(free_) + moved) + 1e-4f * radius);
    const auto hit = closest_surface_point(surface_, p, radius);
    known_ = true;
    hit_ = hit.has_value();
    at_ = p;
    free_ = hit ? hit->distance : radius;
    if (hit && hit->distance < clearance) return hit;
    return {};
  }

  vec3 push_out(const vec3& p, float clearance) {
    const auto hit = near(p, clearance);
    return hit ? hit->position + hit->normal * clearance : p;
  }

 private:
  const groom_surface& surface_;
  float radius_;
  bool known_ = false;  // at_ and free_ hold an answer
  bool hit_ = false;    // and it was a point, not the lack of one
  vec3 at_ = {0, 0, 0};
  float free_ = 0;
};

// How far a point at arc length a keeps off the surface: within the coat it
// rises to the strand's layer; elsewhere just so far that the curve between two
// points stays outside too.
float clearance(const groom_params& params, const strand_traits& traits, float arc, float step) {
  const float height = params.volume * traits.layer;
  const float rise = height > 0 ? height * smooth(arc / (3 * height)) : 0;
  return std::max(rise, std::min(0.12f * step, 0.3f * arc));
}

// A unit vector across t that turns least from `reference`.
vec3 across(const vec3& t, const vec3& reference) {
  const vec3 v = normalize_or_zero(reference - glm::dot(reference, t) * t);
  return v != vec3{0, 0, 0} ? v : basis_from_z(t)[0];
}

vec3 first_direction(const groom_params& params, const strand_traits& traits) {
  const groom_root& root = traits.root;
  vec3 comb = params.comb;
  if (params.part) {
    const vec3 normal = normalize_or_zero(vec3(*params.part));
    const float side = glm::dot(vec3(*params.part), root.position) - params.part->w;
    // Where the surface is steep hair falls, whatever its side of the parting.
    const float flat = smooth(-2 * glm::dot(normalize_or_zero(params.down), root.normal));
    comb += (side < 0 ? -flat : flat) * normal;
  }
  vec3 tangent = comb - glm::dot(comb, root.normal) * root.normal;
  // Hardly any of the comb lies in the surface: hang instead.
  const float weight = smooth(glm::length(tangent) / 0.3f);
  const vec3 fall = params.down - glm::dot(params.down, root.normal) * root.normal;
  tangent = normalize_or_zero(normalize_or_zero(tangent) * weight +
                              normalize_or_zero(fall) * (1 - weight));
  vec3 d = normalize_or_zero(tangent * (1 - params.lift) + root.normal * params.lift);
  if (d == vec3{0, 0, 0}) d = root.normal;
  const mat3 basis = basis_from_z(d);
  const float s = std::sin(traits.jitter_angle), c = std::cos(traits.jitter_angle);
  d = basis[2] * c +
      s * (basis[0] * std::cos(traits.jitter_turn) + basis[1] * std::sin(traits.jitter_turn));
  // never into the surface
  const float rise = glm::dot(d, root.normal);
  return rise > 0.02f ? d : normalize_or_zero(d + (0.02f - rise) * root.normal);
}

// Wander in [-1, 1] at s in [0, 1]: three waves of random phase and pitch.
float wander(uint32_t seed, float s, float waves) {
  rng_state rng = make_rng(seed);
  float sum = 0, weight = 0.55f;
  for (int i = 0; i < 3; ++i) {
    const float pitch = waves * static_cast<float>(i + 1) * (0.7f + 0.6f * rand1f(rng));
    sum += weight * std::sin(2 * pi * (pitch * s + rand1f(rng)));
    weight *= 0.55f;
  }
  return sum;
}

}  // namespace

strand_path grow_path(const groom_surface& surface, const groom_params& params,
                      const strand_traits& traits, float length, int steps) {
  const float step = length / static_cast<float>(steps);
  // With gravity 1, a strand of the greatest length that starts off level hangs
  // within 10 degrees of `down` after its first half.
  const float turn = 6 * params.gravity * step / params.length.y;
  const vec3 down = normalize_or_zero(params.down);
  surface_guard guard(surface, 2 * step);
  strand_path path = {traits.root.position};
  path.reserve(static_cast<std::size_t>(steps) + 1);
  vec3 d = first_direction(params, traits);
  for (int i = 1; i <= steps; ++i) {
    const vec3 p = path.back();
    const float keep = clearance(params, traits, static_cast<float>(i) * step, step);
    vec3 q = p + d * step;
    // Pushing out changes the length of the step, and restoring it the height.
    for (int k = 0; k < 3; ++k) {
      const auto hit = guard.near(q, keep);
      if (!hit) break;
      q = hit->position + hit->normal * keep;
      const vec3 way = normalize_or_zero(q - p);
      if (way == vec3{0, 0, 0}) break;
      if (k < 2) q = p + way * step;
      d = way;
    }
    path.push_back(q);
    const vec3 turned = normalize_or_zero(d + down * turn);
    if (turned != vec3{0, 0, 0}) d = turned;
  }
  return path;
}

strand_path follow_guide(const groom_surface& surface, const groom_params& params,
                         const strand_traits& traits, const strand_path& own,
                         const strand_path& guide, float guide_step) {
  const std::size_t steps = own.size() - 1;
  const float step = traits.length / static_cast<float>(steps);
  auto wanted = [&](std::size_t i) {
    const float s = static_cast<float>(i) / static_cast<float>(steps);
    const float pull = traits.clump * (1 - (1 - s) * (1 - s));
    const float at = static_cast<float>(i) * step / guide_step;
    const auto j = std::min(static_cast<std::size_t>(at), guide.size() - 2);
    const float t = std::min(at - static_cast<float>(j), 1.0f);
    return glm::mix(own[i], glm::mix(guide[j], guide[j + 1], t), pull);
  };
  surface_guard guard(surface, 2 * step);
  strand_path path = {own[0]};
  path.reserve(own.size());
  vec3 last = own[0];
  for (std::size_t i = 1; i <= steps; ++i) {
    const vec3 next = wanted(i);
    const vec3 way = normalize_or_zero(next - last);
    last = next;
    const vec3 p = path.back();
    vec3 q = p + way * step;
    const float keep = clearance(params, traits, static_cast<float>(i) * step, step);
    for (int k = 0; k < 3; ++k) {
      const vec3 out = guard.push_out(q, keep);
      if (out == q) break;
      const vec3 d = normalize_or_zero(out - p);
      q = k < 2 && d != vec3{0, 0, 0} ? p + d * step : out;
    }
    path.push_back(q);
  }
  return path;
}

strand_path add_detail(const groom_surface& surface, const groom_params& params,
                       const strand_traits& traits, const strand_path& path, int stride,
                       const vec3& reference) {
  const auto steps = static_cast<int>(path.size()) - 1;
  const float step = traits.length / static_cast<float>(steps);
  const float sample_step = step * static_cast<float>(stride);
  surface_guard guard(surface, 2 * sample_step);
  strand_path points = {path[0]};
  vec3 u = reference;
  for (int i = 1; i <= steps; ++i) {
    const vec3 before = path[static_cast<std::size_t>(i - 1)];
    const vec3 here = path[static_cast<std::size_t>(i)];
    const vec3 after = path[static_cast<std::size_t>(std::min(i + 1, steps))];
    const vec3 t = normalize_or_zero(after - before);
    if (t != vec3{0, 0, 0}) u = across(t, u);
    if (i % stride != 0) continue;
    const vec3 v = glm::cross(t, u);
    const float s = static_cast<float>(i) / static_cast<float>(steps);
    vec3 p = here;
    if (traits.curl_radius > 0) {
      const float angle = traits.phase + 2 * pi * traits.turns * s;
      const float radius = traits.curl_radius * smooth(s / 0.2f);
      p += radius * (std::cos(angle) * u + std::sin(angle) * v);
    }
    if (params.noise > 0) {
      // most of it is common to the clump, which then stays together
      const float shared = traits.clump, own = 1 - 0.75f * shared;
      const float x =
          shared * wander(traits.clump_seed, s, 0.9f) + own * wander(traits.own_seed, s, 1.2f);
      const float y = shared * wander(traits.clump_seed + 1, s, 0.9f) +
                      own * wander(traits.own_seed + 1, s, 1.2f);
      p += params.noise * s * (x * u + y * v);
    }
    if (traits.frizz > 0) {
      const float waves = 0.06f * static_cast<float>(params.points);
      p += traits.frizz * smooth(2 * s) *
           (wander(traits.own_seed + 2, s, waves) * u + wander(traits.own_seed + 3, s, waves) * v);
    }
    const float arc = s * traits.length;
    points.push_back(
        guard.push_out(p, std::max(std::min(0.12f * sample_step, 0.3f * arc), params.radius.x)));
  }
  return points;
}

std::vector<vec3> interpolate_bspline(std::span<const vec3> points) {
  // Inner control values: c[i-1] + 4 c[i] + c[i+1] = 6 q[i], with c = q at both
  // ends, where the second difference vanishes; the phantoms follow from that.
  const std::size_t n = points.size();
  std::vector<vec3> c(points.begin(), points.end());
  std::vector<float> factor(n, 0.0f);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const float pivot = 1 / (4 - factor[i - 1]);
    factor[i] = pivot;
    c[i] = (6.0f * points[i] - c[i - 1]) * pivot;
  }
  for (std::size_t i = n - 1; i-- > 1;) c[i] -= factor[i] * c[i + 1];
  std::vector<vec3> control;
  control.reserve(n + 2);
  control.push_back(2.0f * c[0] - c[1]);
  control.insert(control.end(), c.begin(), c.end());
  control.push_back(2.0f * c[n - 1] - c[n - 2]);
  return control;
}

}  // namespace wisp
