// Distances of primitives. Those of revolution are computed in the plane of p and
// the axis.

#include <array>
#include <stdexcept>
#include <string>
#include <utility>

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
  const dbox3& b = about.bounds;
  const dvec3 extent = wisp::is_finite(b) ? b.max - b.min : dvec3{0};
  // relative to where it is, so that a far origin costs no digits
  const dvec3 center = wisp::is_finite(b) ? (b.min + b.max) / 2.0 : dvec3{0};
  return difference_gradient([&](const dvec3& q) { return value(*this, center + q); }, p - center,
                             std::max({extent.x, extent.y, extent.z}) / 2);
}

namespace {

using std::max;
using std::min;

// A primitive by its formula.
template <typename Distance>
struct primitive final : sdf_node {
  Distance distance;
  primitive(Distance d, const dbox3& bounds) : distance(std::move(d)) { about.bounds = bounds; }
  double at(const dvec3& p, double, double) const override { return distance(p); }
};
template <typename Distance>
sdf make(Distance distance, const dbox3& bounds, bool exact_inside = true) {
  auto node = std::make_shared<primitive<Distance>>(std::move(distance), bounds);
  node->about.exact_inside = exact_inside;
  return sdf(std::move(node));
}

double length(double x, double y) { return std::hypot(x, y); }

double box_distance(const dvec3& q) {
  const dvec3 outside = glm::max(q, dvec3{0});
  return glm::length(outside) + min(max({q.x, q.y, q.z}), 0.0);
}

// Distance from the axis through a along the unit vector n, and height over a.
struct about_axis {
  dvec3 a, n;
  dvec2 operator()(const dvec3& p) const {
    const dvec3 q = p - a;
    const double height = glm::dot(q, n);
    return {glm::length(q - height * n), height};
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

// The root of sum (r_i y_i / (t + r_i^2))^2 = 1 in scaled form, by bisection; sizes are
// relative to the smallest radius, z the coordinates and r the squares of the radii.
double ellipsoid_root(const dvec3& r, const dvec3& z, double g) {
  const dvec3 n = r * z;
  double low = z.z - 1, high = g < 0 ? 0 : glm::length(n) - 1;
  for (int i = 0; i < 2000; ++i) {
    const double s = (low + high) / 2;
    if (s == low || s == high) break;
    const double a = n.x / (s + r.x), b = n.y / (s + r.y), c = z.z / (s + 1);
    const double f = a * a + b * b + c * c - 1;
    if (f > 0) {
      low = s;
    } else if (f < 0) {
      high = s;
    } else {
      return s;
    }
  }
  return (low + high) / 2;
}

// The closest point of an ellipse to y >= 0, e.x >= e.y > 0, and for three axes below.
dvec2 closest_on_ellipse(const dvec2& e, const dvec2& y) {
  if (y.y > 0) {
    if (!(y.x > 0)) return {0, e.y};
    const dvec2 z = y / e;
    const double r = (e.x / e.y) * (e.x / e.y);
    const double s = ellipsoid_root({r, 0, 1}, {z.x, 0, z.y}, z.x * z.x + z.y * z.y - 1);
    return {r * y.x / (s + r), y.y / (s + 1)};
  }
  const double n = e.x * y.x, d = e.x * e.x - e.y * e.y;
  if (n < d) {
    const double q = n / d;
    return {e.x * q, e.y * std::sqrt(max(0.0, 1 - q * q))};
  }
  return {e.x, 0};
}

dvec3 closest_on_ellipsoid(const dvec3& e, const dvec3& y) {  // e.x >= e.y >= e.z
  if (y.z > 0) {
    if (!(y.y > 0)) {
      const dvec2 q = closest_on_ellipse({e.x, e.z}, {y.x, y.z});
      return {q.x, 0, q.y};
    }
    if (!(y.x > 0)) {
      const dvec2 q = closest_on_ellipse({e.y, e.z}, {y.y, y.z});
      return {0, q.x, q.y};
    }
    const dvec3 z = y / e;
    const dvec3 r = {(e.x / e.z) * (e.x / e.z), (e.y / e.z) * (e.y / e.z), 1};
    const double s = ellipsoid_root(r, z, glm::dot(z, z) - 1);
    return {r.x * y.x / (s + r.x), r.y * y.y / (s + r.y), y.z / (s + 1)};
  }
  const dvec2 n = {e.x * y.x, e.y * y.y};
  const dvec2 d = {e.x * e.x - e.z * e.z, e.y * e.y - e.z * e.z};
  if (n.x < d.x && n.y < d.y) {
    const dvec2 q = n / d;
    const double rest = 1 - q.x * q.x - q.y * q.y;
    if (rest > 0) return {e.x * q.x, e.y * q.y, e.z * std::sqrt(rest)};
  }
  const dvec2 q = closest_on_ellipse({e.x, e.y}, {y.x, y.y});
  return {q.x, q.y, 0};
}

}  // namespace

sdf sdf_sphere(const dvec3& center, double radius) {
  check_finite(center, "sphere: center");
  check_positive(radius, "sphere: radius");
  return make([=](const dvec3& p) { return glm::length(p - center) - radius; },
              {center - radius, center + radius});
}

sdf sdf_box(const dvec3& center, const dvec3& half) {
  check_finite(center, "box: center");
  for (int a = 0; a < 3; ++a) check_positive(half[a], "box: half");
  return make([=](const dvec3& p) { return box_distance(glm::abs(p - center) - half); },
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
      grow(disc_bounds(center, axis.n, major), minor), minor <= major);
}

sdf sdf_capsule(const dvec3& a, const dvec3& b, double radius) {
  check_finite(a, "capsule: a");
  check_finite(b, "capsule: b");
  check_positive(radius, "capsule: radius");
  const dvec3 d = b - a;
  const double l2 = glm::dot(d, d);
  return make(
      [=](const dvec3& p) {
        const double t = l2 > 0 ? std::clamp(glm::dot(p - a, d) / l2, 0.0, 1.0) : 0.0;
        return glm::length(p - a - t * d) - radius;
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
      merge(disc_bounds(a, axis.n, radius), disc_bounds(b, axis.n, radius)));
}

sdf sdf_cone(const dvec3& a, const dvec3& b, double radius_a, double radius_b) {
  check_finite(radius_a, "cone: radius_a");
  check_finite(radius_b, "cone: radius_b");
  if (!(radius_a >= 0 && radius_b >= 0 && radius_a + radius_b > 0)) {
    throw std::invalid_argument("cone: radii should not be negative, and one of them positive");
  }
  const about_axis axis = axis_of(a, b, "cone");
  const double height = glm::length(b - a), slope = radius_b - radius_a;
  const double side2 = slope * slope + height * height;
  return make(
      [=](const dvec3& p) {
        const dvec2 q = axis(p);
        // the nearest points of the caps and of the side, in the half plane
        const double cap_radius = q.y < height / 2 ? radius_a : radius_b;
        const double cap_height = q.y < height / 2 ? 0 : height;
        const double to_cap = length(max(q.x - cap_radius, 0.0), q.y - cap_height);
        const double t = std::clamp(((q.x - radius_a) * slope + q.y * height) / side2, 0.0, 1.0);
        const double to_side = length(q.x - radius_a - t * slope, q.y - t * height);
        const bool inside = q.y > 0 && q.y < height && (q.x - radius_a) * height < q.y * slope;
        const double d = min(to_cap, to_side);
        return inside ? -min(d, min(q.y, height - q.y)) : d;
      },
      merge(disc_bounds(a, axis.n, radius_a), disc_bounds(b, axis.n, radius_b)));
}

sdf sdf_plane(const dvec3& point, const dvec3& normal) {
  check_finite(point, "plane: point");
  const dvec3 n = unit(normal, "plane: normal");
  return make([=](const dvec3& p) { return glm::dot(p - point, n); }, infinite_box);
}

sdf sdf_ellipsoid(const dvec3& center, const dvec3& radii) {
  check_finite(center, "ellipsoid: center");
  for (int a = 0; a < 3; ++a) check_positive(radii[a], "ellipsoid: radii");
  std::array<int, 3> by = {0, 1, 2};
  std::sort(by.begin(), by.end(), [&](int a, int b) { return radii[a] > radii[b]; });
  const dvec3 e = {radii[by[0]], radii[by[1]], radii[by[2]]};
  return make(
      [=](const dvec3& p) {
        const dvec3 q = glm::abs(p - center);
        const dvec3 y = {q[by[0]], q[by[1]], q[by[2]]};
        const double d = glm::length(y - closest_on_ellipsoid(e, y));
        const dvec3 z = y / e;
        return glm::dot(z, z) < 1 ? -d : d;
      },
      {center - radii, center + radii});
}

}  // namespace wisp
