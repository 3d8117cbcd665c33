#include "empty_domain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

bool is_flat(std::span<const wisp::ivec3> triangles, std::span<const wisp::vec3> positions) {
  if (triangles.empty()) return true;
  const auto corner = [&](const wisp::ivec3& t, int k) {
    return wisp::dvec3(positions[static_cast<std::size_t>(t[k])]);
  };
  // Of all vertices the one with the most of something, from the first corner on.
  const wisp::dvec3 start = corner(triangles[0], 0);
  const auto largest = [&](auto&& measure) {
    std::pair<double, wisp::dvec3> found = {0, {0, 0, 0}};
    for (const auto& t : triangles) {
      for (int k = 0; k < 3; ++k) {
        const wisp::dvec3 p = corner(t, k);
        if (const double m = measure(p - start); m > found.first) found = {m, p - start};
      }
    }
    return found;
  };
  const auto [length, along] = largest([](const wisp::dvec3& v) { return glm::length(v); });
  if (!(length > 0)) return true;
  // of single precision in the coordinates
  const double rounding =
      2.0 * std::numeric_limits<float>::epsilon() * (glm::length(start) + length);
  const wisp::dvec3 axis = along / length;
  const auto [width, across] =
      largest([&](const wisp::dvec3& v) { return glm::length(glm::cross(axis, v)); });
  if (width <= rounding) return true;
  const wisp::dvec3 normal = glm::normalize(glm::cross(axis, across));
  // tilted by rounding of the corners that it comes from
  const auto [height, above] =
      largest([&](const wisp::dvec3& v) { return std::abs(glm::dot(normal, v)); });
  return height <= rounding * (1 + length / width);
}

bool has_inside(const wisp::solution& solution) {
  return std::any_of(solution.values.begin(), solution.values.end(), [](const auto& e) {
    return e.status != wisp::point_status::outside && e.status != wisp::point_status::boundary;
  });
}

bool is_surely_empty(const wisp::pde_domain& domain) {
  if (domain.side() == wisp::domain_side::exterior) return false;
  const wisp::dbox3 box = domain.bounds();
  const wisp::dvec3 extent = box.max - box.min;
  if (!std::isfinite(extent.x + extent.y + extent.z)) return false;
  // Boxes that are split along their longest side until a ball around the center, which
  // no boundary crosses, holds them.
  struct cell {
    wisp::dvec3 center, half;
  };
  std::vector<cell> open = {{box.min + 0.5 * extent, 0.5 * extent}};
  for (int balls = 0; !open.empty(); ++balls) {
    if (balls == 100000) return false;
    cell c = open.back();
    open.pop_back();
    if (domain.contains(c.center)) return false;
    if (domain.clearance(c.center, 0.1) > glm::length(c.half)) continue;
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      if (c.half[k] > c.half[axis]) axis = k;
    c.half[axis] *= 0.5;
    for (const double side : {-1.0, 1.0}) {
      cell part = c;
      part.center[axis] += side * c.half[axis];
      open.push_back(part);
    }
  }
  return true;
}
