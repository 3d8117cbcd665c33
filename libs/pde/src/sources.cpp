#include "sources.h"

#include <algorithm>
#include <cmath>

#include "wisp/pde/greens.h"

namespace wisp {

namespace {

double largest(const dvec4& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z), std::abs(v.w)});
}

double gaussian(const source_peak& peak, const dvec3& p) {
  const dvec3 d = (p - peak.center) / peak.radius;
  const double s = peak.radius * std::sqrt(2 * pi_d);
  return std::exp(-0.5 * glm::dot(d, d)) / (s * s * s);
}

// A Gaussian number by Box and Muller's method.
double sample_gaussian(rng_state& rng) {
  const double l = std::sqrt(-2 * std::log(1 - rand1d(rng)));
  return l * std::cos(2 * pi_d * rand1d(rng));
}

// A peak matters for a ball if it comes within this many standard deviations: with four, a
// thousandth of a Gaussian would be left to samples that hardly ever meet it.
constexpr double peak_reach = 7;

}  // namespace

void source_elements::add(const dvec3& a, const dvec3& b, const dvec4& strength, double longest) {
  const double length = glm::distance(a, b);
  if (!(length > 0) || !(largest(strength) > 0)) return;
  const double parts = std::clamp(std::ceil(length / longest), 1.0, 16384.0);
  for (double i = 0; i < parts; ++i) {
    const dvec3 from = a + i / parts * (b - a), to = a + (i + 1) / parts * (b - a);
    elements_.push_back({{from, to, to}, false, length / parts, strength});
  }
}

void source_elements::add(const dvec3& a, const dvec3& b, const dvec3& c, const dvec4& strength,
                          double longest, int splits) {
  const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
  if (!(area > 0) || !(largest(strength) > 0)) return;
  const double ab = glm::distance(a, b), bc = glm::distance(b, c), ca = glm::distance(c, a);
  const double side = std::max({ab, bc, ca});
  if (side <= longest || splits == 0) {
    elements_.push_back({{a, b, c}, true, area, strength});
    return;
  }
  // halves, by the middle of the longest side
  if (side > ab && side == bc) return add(b, c, a, strength, longest, splits);
  if (side > ab && side == ca) return add(c, a, b, strength, longest, splits);
  const dvec3 middle = 0.5 * (a + b);
  add(a, middle, c, strength, longest, splits - 1);
  add(middle, b, c, strength, longest, splits - 1);
}

void source_elements::build() {
  nodes_.clear();
  if (elements_.empty()) return;
  nodes_.reserve(2 * elements_.size());
  build(0, static_cast<std::uint32_t>(elements_.size()));
}

std::uint32_t source_elements::build(std::uint32_t first, std::uint32_t count) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  dbox3 box, centers;
  double weight = 0;
  const auto center = [](const element& e) { return (e.p[0] + e.p[1] + e.p[2]) / 3.0; };
  for (std::uint32_t i = first; i < first + count; ++i) {
    for (const dvec3& p : elements_[i].p) box = merge(box, p);
    centers = merge(centers, center(elements_[i]));
    weight += elements_[i].measure * largest(elements_[i].strength);
  }
  nodes_[index].box = box;
  nodes_[index].weight = weight;
  if (count == 1) {
    nodes_[index].leaf = true;
    nodes_[index].element = first;
    return index;
  }
  const dvec3 extent = centers.max - centers.min;
  const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  const auto begin = elements_.begin() + first;
  std::nth_element(
      begin, begin + count / 2, begin + count,
      [&](const element& a, const element& b) { return center(a)[axis] < center(b)[axis]; });
  build(first, count / 2);
  const std::uint32_t right = build(first + count / 2, count - count / 2);
  nodes_[index].right = right;
  return index;
}

bool source_elements::draw(const dvec3& x, double radius, double k, rng_state& rng,
                           source_sample& result) const {
  if (nodes_.empty()) return false;
  // Outside of a body there is no ball, and `radius` is no length that anything has.
  const dbox3& all = nodes_[0].box;
  const double farthest =
      glm::distance(0.5 * (all.min + all.max), x) + glm::distance(all.min, all.max);
  const double least = 1e-6 * std::min(radius, farthest);
  // What a node may contribute: never 0 where it reaches into the ball.
  const auto importance = [&](const node& n) {
    const double nearest = distance(n.box, x);
    if (!(nearest < radius)) return 0.0;
    const dvec3 half = 0.5 * (n.box.max - n.box.min);
    const double r =
        std::max({glm::distance(0.5 * (n.box.min + n.box.max), x), 0.5 * glm::length(half), least});
    return n.weight * std::exp(-k * nearest) / r;
  };
  std::uint32_t at = 0;
  double chance = 1;
  if (!(importance(nodes_[0]) > 0)) return false;
  while (!nodes_[at].leaf) {
    const std::uint32_t left = at + 1, right = nodes_[at].right;
    const double a = importance(nodes_[left]), b = importance(nodes_[right]);
    if (!(a + b > 0)) return false;
    const bool take_left = rand1d(rng) * (a + b) < a;
    chance *= (take_left ? a : b) / (a + b);
    at = take_left ? left : right;
  }
  const element& e = elements_[nodes_[at].element];
  if (e.is_triangle) {
    const double s = std::sqrt(rand1d(rng)), t = rand1d(rng);
    result.point = (1 - s) * e.p[0] + s * ((1 - t) * e.p[1] + t * e.p[2]);
  } else {
    result.point = e.p[0] + rand1d(rng) * (e.p[1] - e.p[0]);
  }
  result.f = e.strength;
  result.density = chance / e.measure;
  return true;
}

source_set::source_set(const pde_problem& problem, const solve_options& options) {
  k_ = problem.equation == pde_equation::screened_poisson ? std::sqrt(problem.screening) : 0;
  sampling_ = options.sampling;
  volume_ = problem.source;

  peaks_ = problem.source_peaks;
  for (const point_source& s : problem.point_sources) {
    if (largest(s.strength) > 0 && problem.domain.contains(s.position)) points_.push_back(s);
  }
  (options.point_sources == point_source_estimator::fundamental ? fields_ : balls_) = points_;
  const double longest = problem.domain.size() / 64;
  for (const curve_source& c : problem.curve_sources) {
    for (std::size_t i = 0; i + 1 < c.points.size(); ++i) {
      elements_.add(c.points[i], c.points[i + 1], c.strength, longest);
    }
  }
  for (const mesh_source& m : problem.mesh_sources) {
    for (const auto& t : m.triangles) {
      elements_.add(m.positions[t[0]], m.positions[t[1]], m.positions[t[2]], m.strength, longest);
    }
  }
  elements_.build();
}

source_sample source_set::draw_volume(const dvec3& x, double R, rng_state& rng) const {
  const double ball = 4 * pi_d / 3 * R * R * R;
  double weights = 0;
  for (const source_peak& p : peaks_) {
    if (glm::distance(p.center, x) < R + peak_reach * p.radius) weights += p.weight;
  }
  // half of the samples go to peaks, if any is near
  const double at_peaks = weights > 0 ? 0.5 : 0;
  source_sample result;
  if (at_peaks > 0 && rand1d(rng) < at_peaks) {
    double u = rand1d(rng) * weights;
    const source_peak* chosen = nullptr;
    for (const source_peak& p : peaks_) {
      if (!(glm::distance(p.center, x) < R + peak_reach * p.radius)) continue;
      chosen = &p;
      if (u < p.weight) break;
      u -= p.weight;
    }
    const double a = sample_gaussian(rng), b = sample_gaussian(rng), c = sample_gaussian(rng);
    result.point = chosen->center + chosen->radius * dvec3{a, b, c};
  } else if (sampling_ == source_sampling::uniform) {
    result.point = x + R * std::cbrt(rand1d(rng)) * sample_direction(rng);
  } else {
    const double r = sample_greens_radius(rng, R, k_);
    result.point = x + r * sample_direction(rng);
  }
  const double r = glm::distance(result.point, x);
  if (!(r < R) || r == 0) return {};
  double density =
      sampling_ == source_sampling::uniform ? 1 / ball : greens(r, R, k_) / greens_mass(R, k_);
  if (at_peaks > 0) {
    double peaked = 0;
    for (const source_peak& p : peaks_) {
      if (glm::distance(p.center, x) < R + peak_reach * p.radius) {
        peaked += p.weight / weights * gaussian(p, result.point);
      }
    }
    density = (1 - at_peaks) * density + at_peaks * peaked;
  }
  result.density = density;
  result.f = volume_(result.point);
  return result;
}

source_sample source_set::draw_element(const dvec3& x, double R, rng_state& rng) const {
  source_sample result;
  if (!elements_.draw(x, R, k_, rng, result) || !(glm::distance(result.point, x) < R)) return {};
  return result;
}

dvec4 source_set::sample_ball(const dvec3& x, double R, rng_state& rng) const {
  dvec4 sum{0};
  if (volume_) {
    if (sampling_ == source_sampling::greens && peaks_.empty()) {
      const double r = sample_greens_radius(rng, R, k_);
      sum += greens_mass(R, k_) * volume_(x + r * sample_direction(rng));
    } else {
      const source_sample s = draw_volume(x, R, rng);
      if (s.density > 0) sum += greens(glm::distance(s.point, x), R, k_) / s.density * s.f;
    }
  }
  for (const point_source& s : balls_) {
    const double r = glm::distance(s.position, x);
    if (r < R && r > 0) sum += greens(r, R, k_) * s.strength;
  }
  source_sample drawn;
  if (elements_.draw(x, R, k_, rng, drawn)) {
    const double r = glm::distance(drawn.point, x);
    if (r < R && r > 0) sum += greens(r, R, k_) / drawn.density * drawn.f;
  }
  return sum;
}

dvec4 source_set::sample_first_ball(const dvec3& x, double R, rng_state& rng,
                                    std::array<dvec3, max_channels>* gradient) const {
  const dvec4 value = sample_ball(x, R, rng);
  if (gradient == nullptr) return value;
  const auto add = [&](const dvec4& amount, const dvec3& direction) {
    for (int c = 0; c < max_channels; ++c) {
      (*gradient)[static_cast<std::size_t>(c)] += amount[c] * direction;
    }
  };
  if (volume_) {
    const weighted_radius s = sample_gradient_radius(rng, R, k_);
    const dvec3 d = sample_direction(rng);
    add(0.5 * s.weight * (volume_(x + s.r * d) - volume_(x - s.r * d)), d);
  }
  for (const point_source& s : balls_) {
    const double r = glm::distance(s.position, x);
    if (r < R && r > 0) add(greens_gradient(r, R, k_) * s.strength, (s.position - x) / r);
  }
  source_sample drawn;
  if (elements_.draw(x, R, k_, rng, drawn)) {
    const double r = glm::distance(drawn.point, x);
    if (r < R && r > 0) {
      add(greens_gradient(r, R, k_) / drawn.density * drawn.f, (drawn.point - x) / r);
    }
  }
  return value;
}

dvec4 source_set::sample_outside(const dvec3& away, const dvec3& center, double R,
                                 rng_state& rng) const {
  dvec4 sum{0};
  const dvec3 x = center + away;
  if (volume_) {
    // Around x at distances of the size of |away|, or around the solid at those of its size,
    // as sources may be near to it and x far away; with a tail that any source with a
    // potential has less of. Both at once by the balance heuristic (Veach 1997, 9.2).
    const bool near_solid = rand1d(rng) < 0.5;
    const double s = glm::length(away), u = rand1d(rng);
    const dvec3 direction = sample_direction(rng);
    const dvec3 to = near_solid ? R / (1 - u) * direction : away + s * u / (1 - u) * direction;
    const double r = glm::length(to - away), from_center = glm::length(to);
    const double g = r > 0 && from_center >= R ? exterior_greens(away, to, R) : 0;
    if (g > 0) {
      const double by_point = s / (r * r * (s + r) * (s + r));
      const double by_solid = R / (from_center * from_center * from_center * from_center);
      sum += g * 8 * pi_d / (by_point + by_solid) * volume_(center + to);
    }
  }
  for (const point_source& s : balls_) {
    if (s.position != x) sum += exterior_greens(away, s.position - center, R) * s.strength;
  }
  source_sample drawn;
  if (elements_.draw(x, std::numeric_limits<double>::max(), 0, rng, drawn)) {
    if (drawn.point != x) {
      sum += exterior_greens(away, drawn.point - center, R) / drawn.density * drawn.f;
    }
  }
  return sum;
}

dvec4 source_set::field(const dvec3& x) const {
  dvec4 sum{0};
  for (const point_source& s : fields_) {
    sum -= free_greens(glm::distance(s.position, x), k_) * s.strength;
  }
  return sum;
}

void source_set::add_field_gradient(const dvec3& x,
                                    std::array<dvec3, max_channels>& gradient) const {
  for (const point_source& s : fields_) {
    const double r = glm::distance(s.position, x);
    for (int c = 0; c < max_channels; ++c) {
      gradient[static_cast<std::size_t>(c)] -=
          free_greens_slope(r, k_) * s.strength[c] * (x - s.position) / r;
    }
  }
}

bool source_set::on_point_source(const dvec3& x) const {
  return std::any_of(points_.begin(), points_.end(),
                     [&](const point_source& s) { return s.position == x; });
}

}  // namespace wisp
