// Distances of primitives. Those of revolution are computed in the plane of p and
// the axis.

#include <array>
#include <stdexcept>
#include <string>
#include <utility>

#include "sdf_ellipsoid.h"
#include "sdf_node.h"

namespace wisp {

void check_finite(double x, const char* what) {
  if (!std::isfinite(x)) throw std::invalid_argument(std::string(what) + " is not finite");
}
void check_finite(const dvec3& v, const char* what) {
  for (int a = 0; a < 3; ++a) check_finite(v[a], what);
}
void check_positive(double x, const char* what) {
  check_finite(x, what);
  if (!(x > 0)) throw std::invalid_argument(std::string(what) + " should be positive");
}

dvec3 sdf_node::gradient(const dvec3& p) const {
  const auto f = [this](const dvec3& q) { return value(*this, q); };
  return difference_gradient(f, p, bend_of(about.bounds, p));
}

namespace {

using std::max;
using std::min;

// A primitive by its formulas. Its direction, of any length, leads away from the
// surface; it may be zero where that is hard to tell, and differences tell.
template <typename Distance, typename Direction>
struct primitive final : sdf_node {
  Distance distance;
  Direction direction;
  primitive(Distance d, Direction g, const dbox3& bounds)
      : distance(std::move(d)), direction(std::move(g)) {
    about.bounds = bounds;
  }
  double at(const dvec3& p, double, double) const override { return distance(p); }
  dvec3 gradient(const dvec3& p) const override {
    const dvec3 g = direction(p);
    const double l = glm::length(g);
    return l > 0 && std::isfinite(l) ? g / l : sdf_node::gradient(p);
  }
};
template <typename Distance, typename Direction>
sdf make(Distance distance, Direction direction, const dbox3& bounds, bool exact_inside = true) {
  auto node = std::make_shared<primitive<Distance, Direction>>(std::move(distance),
                                                               std::move(direction), bounds);
  node->about.exact_inside = exact_inside;
  return sdf(std::move(node));
}

double length(double x, double y) { return std::sqrt(x * x + y * y); }

double box_distance(const dvec3& q) {
  const dvec3 outside = glm::max(q, dvec3{0});
  return glm::length(outside) + min(max({q.x, q.y, q.z}), 0.0);
}

dvec3 box_direction(const dvec3& q) {  // q as above
  const dvec3 outside = glm::max(q, dvec3{0});
  if (outside != dvec3{0}) return outside;
  if (q.x >= q.y && q.x >= q.z) return {1, 0, 0};
  return q.y >= q.z ? dvec3{0, 1, 0} : dvec3{0, 0, 1};
}
dvec3 with_signs(const dvec3& v, const dvec3& of) {
  return {std::copysign(v.x, of.x), std::copysign(v.y, of.y), std::copysign(v.z, of.z)};
}

// Some direction across v, which may be zero.
dvec3 across(const dvec3& v) {
  const dvec3 other = std::abs(v.x) > std::abs(v.y) ? dvec3{0, 1, 0} : dvec3{1, 0, 0};
  const dvec3 c = glm::cross(v, other);
  return c == dvec3{0} ? other : glm::normalize(c);
}

// Distance from the axis through a along the unit vector n, and height over a.
struct about_axis {
  dvec3 a, n;
  dvec2 operator()(const dvec3& p) const {
    const dvec3 q = p - a;
    const double height = glm::dot(q, n);
    return {glm::length(q - height * n), height};
  }
  // What is (out, up) in the plane of p and the axis.
  dvec3 direction(const dvec3& p, const dvec2& d) const {
    const dvec3 q = p - a;
    const dvec3 out = q - glm::dot(q, n) * n;
    const double l = glm::length(out);
    if (l > 0) return out * (d.x / l) + d.y * n;
    return d.x * across(n) + d.y * n;  // on the axis, any side will do
  }
};

// The box of a disc.
dbox3 disc_bounds(const dvec3& center, const dvec3& n, double radius) {
  dvec3 half;
  for (int a = 0; a < 3; ++a) half[a] = radius * std::sqrt(max(0.0, 1 - n[a] * n[a]));
  return {center - half, center + half};
}

about_axis axis_of(const dvec3& a, const dvec3& b, const char* what) {
  check_finite(a, what);
  check_finite(b, what);
  const dvec3 d = b - a;
  const double l = glm::length(d);
  if (!(l > 0)) {
    throw std::invalid_argument(std::string(what) + " has no length: its ends are one point");
  }
  return {a, d / l};
}

dvec3 unit(const dvec3& v, const char* what) {
  check_finite(v, what);
  const double size = max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(size > 0))
    throw std::invalid_argument(std::string(what) + " is zero, which is no direction");
  return glm::normalize(v / size);
}

}  // namespace

sdf sdf_sphere(const dvec3& center, double radius) {
  check_finite(center, "sphere: center");
  check_positive(radius, "sphere: radius");
  return make([=](const dvec3& p) { return glm::length(p - center) - radius; },
              [=](const dvec3& p) {
                return p == center ? dvec3{1, 0, 0} : p - center;
              },
              {center - radius, center + radius});
}

sdf sdf_box(const dvec3& center, const dvec3& half) {
  check_finite(center, "box: center");
  for (int a = 0; a < 3; ++a) check_positive(half[a], "box: half");
  return make([=](const dvec3& p) { return box_distance(glm::abs(p - center) - half); },
              [=](const dvec3& p) {
                return with_signs(box_direction(glm::abs(p - center) - half), p - center);
              },
              {center - half, center + half});
}

sdf sdf_rounded_box(const dvec3& center, const dvec3& half, double radius) {
  check_finite(center, "rounded box: center");
  for (int a = 0; a < 3; ++a) check_positive(half[a], "rounded box: half");
  check_finite(radius, "rounded box: radius");
  if (!(radius >= 0 && radius <= min({half.x, half.y, half.z}))) {
    throw std::invalid_argument("rounded box: radius should be from 0 to the smallest half size");
  }
  return make(
      [=](const dvec3& p) { return box_distance(glm::abs(p - center) - half + radius) - radius; },
      [=](const dvec3& p) {
        return with_signs(box_direction(glm::abs(p - center) - half + radius), p - center);
      },
      {center - half, center + half});
}

sdf sdf_torus(const dvec3& center, const dvec3& normal, double major, double minor) {
  check_finite(center, "torus: center");
  check_positive(major, "torus: major");
  check_positive(minor, "torus: minor");
  const about_axis axis{center, unit(normal, "torus: normal")};
  return make(
      [=](const dvec3& p) {
        const dvec2 q = axis(p);
        return length(q.x - major, q.y) - minor;
      },
      [=](const dvec3& p) {
        const dvec2 d = axis(p) - dvec2{major, 0};
        return axis.direction(p, d == dvec2{0} ? dvec2{1, 0} : d);
      },
      grow(disc_bounds(center, axis.n, major), minor), minor <= major);
}

sdf sdf_capsule(const dvec3& a, const dvec3& b, double radius) {
  check_finite(a, "capsule: a");
  check_finite(b, "capsule: b");
  check_positive(radius, "capsule: radius");
  const dvec3 d = b - a;
  const double l2 = glm::dot(d, d);
  const auto from_axis = [=](const dvec3& p) {
    const double t = l2 > 0 ? std::clamp(glm::dot(p - a, d) / l2, 0.0, 1.0) : 0.0;
    return p - a - t * d;
  };
  return make([=](const dvec3& p) { return glm::length(from_axis(p)) - radius; },
              [=](const dvec3& p) {
                const dvec3 away = from_axis(p);
                return away != dvec3{0} ? away : across(d);
              },
              {glm::min(a, b) - radius, glm::max(a, b) + radius});
}

sdf sdf_cylinder(const dvec3& a, const dvec3& b, double radius) {
  check_positive(radius, "cylinder: radius");
  const about_axis axis = axis_of(a, b, "cylinder");
  const double half = glm::length(b - a) / 2;
  return make(
      [=](const dvec3& p) {
        const dvec2 q = axis(p);
        return box_distance({q.x - radius, std::abs(q.y - half) - half, -unbounded});
      },
      [=](const dvec3& p) {
        const dvec2 q = axis(p);
        const dvec3 d = box_direction({q.x - radius, std::abs(q.y - half) - half, -unbounded});
        return axis.direction(p, {d.x, std::copysign(d.y, q.y - half)});
      },
      merge(disc_bounds(a, axis.n, radius), disc_bounds(b, axis.n, radius)));
}

namespace {

// A capped cone in the half plane of (distance from the axis, height).
struct cone_section {
  double radius_a, radius_b, height;
  struct nearest {
    dvec2 point, normal;  // outward where the point is on a face's inner part, else 0
    bool inside;
  };
  nearest operator()(const dvec2& q) const {
    const dvec2 side = {radius_b - radius_a, height};
    const dvec2 from_a = q - dvec2{radius_a, 0};
    // the nearest points of the cap at hand and of the side
    const bool upper = q.y >= height / 2;
    const double cap_radius = upper ? radius_b : radius_a;
    const dvec2 cap = {min(q.x, cap_radius), upper ? height : 0};
    const double t = std::clamp(glm::dot(from_a, side) / glm::dot(side, side), 0.0, 1.0);
    const dvec2 on_side = dvec2{radius_a, 0} + t * side;
    const bool inside = q.y > 0 && q.y < height && from_a.x * side.y < q.y * side.x;
    const double to_cap = glm::distance(q, cap), to_side = glm::distance(q, on_side);
    if (to_cap < to_side || (to_cap == to_side && q.x < cap_radius)) {
      return {cap, q.x < cap_radius ? dvec2{0, upper ? 1 : -1} : dvec2{0}, inside};
    }
    return {on_side, t > 0 && t < 1 ? dvec2{side.y, -side.x} : dvec2{0}, inside};
  }
};

}  // namespace

sdf sdf_cone(const dvec3& a, const dvec3& b, double radius_a, double radius_b) {
  check_finite(radius_a, "cone: radius_a");
  check_finite(radius_b, "cone: radius_b");
  if (!(radius_a >= 0 && radius_b >= 0 && radius_a + radius_b > 0)) {
    throw std::invalid_argument("cone: radii should not be negative, and one of them positive");
  }
  const about_axis axis = axis_of(a, b, "cone");
  const cone_section section{radius_a, radius_b, glm::length(b - a)};
  return make(
      [=](const dvec3& p) {
        const dvec2 q = axis(p);
        const auto s = section(q);
        const double d = glm::distance(q, s.point);
        return s.inside ? -d : d;
      },
      [=](const dvec3& p) {
        const dvec2 q = axis(p);
        const auto s = section(q);
        if (s.normal != dvec2{0}) return axis.direction(p, s.normal);
        return axis.direction(p, (q - s.point) * (s.inside ? -1.0 : 1.0));
      },
      merge(disc_bounds(a, axis.n, radius_a), disc_bounds(b, axis.n, radius_b)));
}

sdf sdf_plane(const dvec3& point, const dvec3& normal) {
  check_finite(point, "plane: point");
  const dvec3 n = unit(normal, "plane: normal");
  return make([=](const dvec3& p) { return glm::dot(p - point, n); },
              [=](const dvec3&) { return n; }, infinite_box);
}

sdf sdf_ellipsoid(const dvec3& center, const dvec3& radii) {
  check_finite(center, "ellipsoid: center");
  for (int a = 0; a < 3; ++a) check_positive(radii[a], "ellipsoid: radii");
  std::array<int, 3> by = {0, 1, 2};
  std::sort(by.begin(), by.end(), [&](int a, int b) { return radii[a] > radii[b]; });
  const dvec3 e = {radii[by[0]], radii[by[1]], radii[by[2]]};
  if (!(e.x < 1e9 * e.z)) {
    throw std::invalid_argument("ellipsoid: radii should be within a factor of 1e9");
  }
  const auto sorted = [=](const dvec3& p) {
    const dvec3 q = glm::abs(p - center);
    return dvec3{q[by[0]], q[by[1]], q[by[2]]};
  };
  return make(
      [=](const dvec3& p) {
        const dvec3 y = sorted(p), z = y / e;
        const double d = glm::length(y - closest_on_ellipsoid(e, y));
        return glm::dot(z, z) < 1 ? -d : d;
      },
      [=](const dvec3& p) {
        // the normal of the closest point, which is better known than the way to it
        const dvec3 c = closest_on_ellipsoid(e, sorted(p)) / e * (e.z / e);
        dvec3 n;
        for (int a = 0; a < 3; ++a) n[by[static_cast<std::size_t>(a)]] = c[a];
        return with_signs(n, p - center);
      },
      {center - radii, center + radii});
}

}  // namespace wisp
