#include "wisp/geometry/point_cloud.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bvh_data.h"
#include "query.h"
#include "wisp/core/parallel.h"

namespace wisp {

namespace {

bool is_finite(const dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

struct neighbor {
  double distance2;
  int index;
  bool operator<(const neighbor& o) const {
    return distance2 < o.distance2 || (distance2 == o.distance2 && index < o.index);
  }
};

struct box_waiting {
  double distance2;
  uint32_t child;
};

// The k nearest to p in `best`, a heap with the farthest first, of normalized squared
// distances.
void find_neighbors(const bvh_data& data, const dvec3& x, std::size_t k,
                    std::vector<neighbor>& best) {
  best.clear();
  const dvec3 p = data.normalized(x);
  if (k == 0) return;
  std::array<box_waiting, stack_size> stack;
  std::size_t top = 0;
  stack[top++] = {0, 0};
  // boxes are of coordinates that were rounded in double before
  const auto beyond = [&](double d2) {
    return best.size() == k && d2 > best.front().distance2 * (1 + 1e-14);
  };
  while (top > 0) {
    const box_waiting w = stack[--top];
    if (beyond(w.distance2)) continue;
    if ((w.child & bvh_leaf_bit) != 0) {
      const bvh_leaf& leaf = data.leaves[w.child & ~bvh_leaf_bit];
      for (uint32_t i = 0; i < leaf.count; ++i) {
        const uint32_t slot = leaf.first + i;
        const dvec3 v = (data.corners(slot)[0] - x) * data.scale;
        const neighbor n = {glm::dot(v, v), static_cast<int>(data.elements[slot])};
        if (best.size() < k) {
          best.push_back(n);
          std::push_heap(best.begin(), best.end());
        } else if (n < best.front()) {
          std::pop_heap(best.begin(), best.end());
          best.back() = n;
          std::push_heap(best.begin(), best.end());
        }
      }
      continue;
    }
    const bvh_node& n = data.nodes[w.child];
    const std::size_t base = top;
    for (int i = 0; i < bvh_width && n.child[i] != bvh_no_child; ++i) {
      dvec3 outside;
      for (int a = 0; a < 3; ++a) {
        outside[a] = std::max({n.min[a][i] - p[a], p[a] - n.max[a][i], 0.0});
      }
      const box_waiting child = {glm::dot(outside, outside), n.child[i]};
      if (beyond(child.distance2)) continue;
      std::size_t j = top++;
      for (; j > base && stack[j - 1].distance2 < child.distance2; --j) stack[j] = stack[j - 1];
      stack[j] = child;
    }
  }
}

// A convex polygon, clipped by half planes.
struct polygon {
  std::vector<dvec2> corners = {}, clipped = {};

  // Keeps what is nearer to 0 than to q.
  void clip(const dvec2& q) {
    clipped.clear();
    const double limit = 0.5 * glm::dot(q, q);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const dvec2 &a = corners[i], &b = corners[i + 1 < corners.size() ? i + 1 : 0];
      const double da = glm::dot(a, q) - limit, db = glm::dot(b, q) - limit;
      if (da <= 0) clipped.push_back(a);
      if ((da < 0 && db > 0) || (da > 0 && db < 0)) clipped.push_back(a + da / (da - db) * (b - a));
    }
    corners.swap(clipped);
  }

  double area() const {
    double twice = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const dvec2 &a = corners[i], &b = corners[i + 1 < corners.size() ? i + 1 : 0];
      twice += a.x * b.y - a.y * b.x;
    }
    return 0.5 * twice;
  }
};

constexpr int disc_corners = 24;

// Zero where there is none.
dvec3 unit_normal(const dvec3& n) {
  const double size = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
  if (!is_finite(n) || size == 0) return {0, 0, 0};
  return glm::normalize(n / size);
}

// Normalized.
double cell_area(const bvh_data& data, std::span<const dvec3> points,
                 std::span<const dvec3> normals, std::size_t point, std::span<const neighbor> near,
                 polygon& cell) {
  const dvec3 n = unit_normal(normals[point]);
  const dvec3 across = std::abs(n.x) < 0.6 ? dvec3{1, 0, 0} : dvec3{0, 1, 0};
  const dvec3 u = glm::normalize(glm::cross(n, across)), v = glm::cross(n, u);
  double farthest2 = 0;
  std::size_t together = 1;
  for (const neighbor& o : near) farthest2 = std::max(farthest2, o.distance2);
  if (!(farthest2 > 0)) return 0;
  // Points beyond the farthest neighbour may cut off what is farther than half of it,
  // but rarely all; at the edge of a surface nothing else ends the cell.
  const double radius = 0.65 * std::sqrt(farthest2);
  cell.corners.clear();
  for (int i = 0; i < disc_corners; ++i) {
    const double angle = 2 * 3.14159265358979323846 * i / disc_corners;
    cell.corners.push_back(radius * dvec2{std::cos(angle), std::sin(angle)});
  }
  for (const neighbor& o : near) {
    const auto other = static_cast<std::size_t>(o.index);
    if (other == point) continue;
    // the other side of something thin has cells of its own
    if (glm::dot(n, unit_normal(normals[other])) < -0.5) continue;
    if (o.distance2 == 0) {
      ++together;
      continue;
    }
    const dvec3 d = (points[other] - points[point]) * data.scale;
    const dvec2 q{glm::dot(d, u), glm::dot(d, v)};
    // one straight above is of another sheet
    if (glm::dot(q, q) > 1e-4 * o.distance2) cell.clip(q);
  }
  return cell.area() / static_cast<double>(together);
}

}  // namespace

int nearest_neighbors(const bvh& points, const dvec3& p, int k, std::span<int> found) {
  if (!points.empty() && points.element() != bvh_element::point) {
    throw std::invalid_argument("nearest_neighbors: the tree should be of points");
  }
  if (k < 0 || found.size() < static_cast<std::size_t>(k)) {
    throw std::invalid_argument("nearest_neighbors: k should be from 0 to the size of `found`");
  }
  if (points.empty() || !is_finite(p)) return 0;
  std::vector<neighbor> best;
  find_neighbors(*points.data(), p, static_cast<std::size_t>(k), best);
  std::sort_heap(best.begin(), best.end());
  for (std::size_t i = 0; i < best.size(); ++i) found[i] = best[i].index;
  return static_cast<int>(best.size());
}

std::vector<double> estimate_areas(const bvh& tree, std::span<const dvec3> points,
                                   std::span<const dvec3> normals, int k, int threads) {
  if (normals.size() != points.size()) {
    throw std::invalid_argument("estimate_areas: there should be as many normals as points");
  }
  if (k < 3) throw std::invalid_argument("estimate_areas: k should be at least 3");
  std::vector<double> areas(points.size(), 0.0);
  if (tree.empty()) return areas;
  const bvh_data& data = *tree.data();
  if (data.element != bvh_element::point || data.vertex_count != points.size()) {
    throw std::invalid_argument("estimate_areas: the tree should be of the points");
  }
  constexpr std::size_t grain = 64;
  const std::size_t count = data.elements.size();
  parallel_for((count + grain - 1) / grain, threads, [&](std::size_t g) {
    std::vector<neighbor> near;
    polygon cell;
    for (std::size_t slot = g * grain; slot < std::min((g + 1) * grain, count); ++slot) {
      const std::size_t i = data.elements[slot];
      const dvec3& n = normals[i];
      if (!is_finite(n) || n == dvec3{0, 0, 0}) continue;
      find_neighbors(data, points[i], static_cast<std::size_t>(k) + 1, near);
      areas[i] = cell_area(data, points, normals, i, near, cell) * data.unit * data.unit;
    }
  });
  return areas;
}

std::vector<double> estimate_areas(std::span<const dvec3> points, std::span<const dvec3> normals,
                                   int k, int threads) {
  return estimate_areas(make_point_bvh(points, {threads}), points, normals, k, threads);
}

}  // namespace wisp
