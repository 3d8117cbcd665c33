#include "wisp/pde/section.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "domain_data.h"
#include "point_walks.h"
#include "section_share.h"
#include "wisp/core/parallel.h"

namespace wisp {

namespace {

bool is_finite(const dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

dvec3 unit(const dvec3& v, const char* what) {
  const double l = glm::length(v);
  if (!(l > 0) || !std::isfinite(l)) {
    throw std::invalid_argument(std::string("section: ") + what + " should be a direction");
  }
  return v / l;
}

// Corners of the polygon that a plane cuts out of a box: where it meets the edges.
std::vector<dvec3> cut_box(const dbox3& box, const dvec3& origin, const dvec3& normal) {
  std::vector<dvec3> corners;
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 4; ++side) {
      dvec3 a = box.min;
      if (side & 1) a[(axis + 1) % 3] = box.max[(axis + 1) % 3];
      if (side & 2) a[(axis + 2) % 3] = box.max[(axis + 2) % 3];
      dvec3 b = a;
      b[axis] = box.max[axis];
      const double ha = glm::dot(a - origin, normal), hb = glm::dot(b - origin, normal);
      if ((ha > 0) == (hb > 0) && ha != 0 && hb != 0) continue;
      const double t = ha == hb ? 0 : ha / (ha - hb);
      corners.push_back(a + t * (b - a));
    }
  }
  return corners;
}

}  // namespace

section_grid make_section_grid(const pde_domain& domain, const section_plane& plane, int threads) {
  const auto fail = [](const char* message) { throw std::invalid_argument(message); };
  if (domain.empty()) fail("section: the domain is empty");
  if (!is_finite(plane.origin)) fail("section: origin should be finite");
  if (plane.resolution < 2 || plane.resolution > 16384) {
    fail("section: resolution should be 2 to 16384");
  }
  section_grid grid;
  grid.normal = unit(plane.normal, "normal");
  dvec3 up = plane.up;
  if (up == dvec3{0, 0, 0}) {
    up = std::abs(grid.normal.y) < 0.99 ? dvec3{0, 1, 0} : dvec3{0, 0, -1};
  }
  const dvec3 across = glm::cross(unit(up, "up"), grid.normal);
  if (!(glm::length(across) > 1e-6)) fail("section: up should not lie along the normal");
  grid.right = glm::normalize(across);
  grid.down = -glm::cross(grid.normal, grid.right);

  // Beyond this, places in the domain are lost in the rounding of places on the plane.
  constexpr double far = 1e9;
  if (domain.data()->bounded) {
    const double size = domain.size();
    if (!(glm::length(plane.origin - domain.data()->center) <= far * size)) {
      fail("section: origin is farther from the domain than 1e9 times its size");
    }
    if (std::max(plane.size.x, plane.size.y) > far * size) {
      fail("section: size is more than 1e9 times that of the domain");
    }
  }

  dvec2 low = -0.5 * plane.size, high = 0.5 * plane.size;
  if (!(plane.size.x >= 0 && plane.size.y >= 0) || !std::isfinite(plane.size.x + plane.size.y)) {
    fail("section: size should be finite and not negative");
  }
  if (plane.size.x == 0 || plane.size.y == 0) {
    const dbox3 box = domain.bounds();
    if (!domain.data()->bounded) fail("section: an infinite solid needs a size of its sections");
    const auto corners = cut_box(box, plane.origin, grid.normal);
    if (corners.empty()) fail("section: the plane misses the domain");
    low = dvec2{std::numeric_limits<double>::infinity()};
    high = -low;
    for (const dvec3& c : corners) {
      const dvec2 q{glm::dot(c - plane.origin, grid.right), glm::dot(c - plane.origin, grid.down)};
      low = glm::min(low, q);
      high = glm::max(high, q);
    }
    const dvec2 extent = high - low;
    const double longest = std::max(extent.x, extent.y);
    const double margin =
        domain.side() == domain_side::exterior ? 0.25 * domain.size() : 0.02 * longest;
    low -= margin;
    high += margin;
  }
  const dvec2 extent = high - low;
  grid.cell = std::max(extent.x, extent.y) / plane.resolution;
  if (!(grid.cell > 0) || !std::isfinite(grid.cell)) fail("section: the plane misses the domain");
  const auto cells = [&](double length) {
    return std::clamp(static_cast<int>(std::ceil(length / grid.cell - 1e-9)), 1, plane.resolution);
  };
  grid.width = cells(extent.x);
  grid.height = cells(extent.y);
  const dvec2 middle = 0.5 * (low + high);
  grid.corner = plane.origin + (middle.x - 0.5 * grid.width * grid.cell) * grid.right +
                (middle.y - 0.5 * grid.height * grid.cell) * grid.down;

  double largest = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const dvec3 p = glm::abs(
        cell_center(grid, corner & 1 ? grid.width - 1 : 0, corner & 2 ? grid.height - 1 : 0));
    largest = std::max({largest, p.x, p.y, p.z});
  }
  if (!(grid.cell > 4 * std::numeric_limits<double>::epsilon() * largest)) {
    fail("section: its cells are smaller than the rounding of coordinates there");
  }

  const auto width = static_cast<std::size_t>(grid.width);
  const auto height = static_cast<std::size_t>(grid.height);
  std::vector<char> holds(width * height);
  const int wanted = domain.side() == domain_side::interior ? -1 : 1;
  parallel_for(height, threads, [&](std::size_t y) {
    for (std::size_t x = 0; x < width; ++x) {
      const dvec3 p = cell_center(grid, static_cast<int>(x), static_cast<int>(y));
      holds[y * width + x] = domain.data()->side_of(p) == wanted;
    }
  });
  for (std::size_t i = 0; i < holds.size(); ++i) {
    if (!holds[i]) continue;
    grid.cells.push_back(static_cast<std::uint32_t>(i));
    grid.points.push_back(
        cell_center(grid, static_cast<int>(i % width), static_cast<int>(i / width)));
  }
  if (grid.points.empty()) {
    fail(domain.data()->bounded && grid.cell > domain.size()
             ? "section: its cells are larger than the domain, and none has its center in it"
             : "section: the plane misses the domain");
  }
  return grid;
}

namespace {

void check_grid(const section_grid& grid) {
  const auto cells = static_cast<std::uint64_t>(std::max(grid.width, 0)) *
                     static_cast<std::uint64_t>(std::max(grid.height, 0));
  bool fine = grid.cells.size() == grid.points.size();
  for (const std::uint32_t cell : grid.cells) fine = fine && cell < cells;
  if (!fine) throw std::invalid_argument("section: each point should have a cell of the grid");
}

}  // namespace

solution solve_section(const pde_problem& problem, const section_grid& grid,
                       const section_options& options) {
  check_problem(problem);
  check_options(options.solve);
  check_grid(grid);
  if (options.share && can_share(problem, grid, options.solve)) {
    return solve_shared(problem, grid, options.solve);
  }
  return solve(problem, grid.points, options.solve);
}

}  // namespace wisp
