#include <algorithm>
#include <array>
#include <cmath>

#include "wisp/geometry/closest_point.h"

namespace wisp {

element_point closest_point_on_segment(const dvec3& p, const dvec3& a, const dvec3& b) {
  const dvec3 ab = b - a;
  const double along = glm::dot(ab, p - a), length2 = glm::dot(ab, ab);
  if (!(along > 0)) return {a, {0, 0}, mesh_feature::vertex, 0};
  if (along >= length2) return {b, {1, 0}, mesh_feature::vertex, 1};
  const double t = along / length2;
  return {a + t * ab, {t, 0}, mesh_feature::edge, 0};
}

namespace {

// The closest point on edge k of the triangle.
element_point on_edge(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c, int k) {
  constexpr dvec2 uv[3] = {{0, 0}, {1, 0}, {0, 1}};
  const dvec3* v[3] = {&a, &b, &c};
  const int l = (k + 1) % 3;
  element_point e = closest_point_on_segment(p, *v[k], *v[l]);
  const double t = e.uv.x;
  e.uv = uv[k] + t * (uv[l] - uv[k]);
  e.feature_index = e.feature == mesh_feature::edge ? k : t == 0 ? k : l;
  return e;
}

// Barycentrics of a sliver come from a normal that is noisy, and are off by as much
// along its long edge. What is left of p over their point, split along that edge and
// across it, is small where that matters and takes the error out again.
void refine(std::array<double, 3>& weights, const dvec3& p, const dvec3& a, const dvec3& b,
            const dvec3& c) {
  const std::array<dvec3, 3> v = {a, b, c};
  std::size_t k = 0;  // the vertex opposite of the longest edge
  double longest = -1;
  for (std::size_t i = 0; i < 3; ++i) {
    const dvec3 e = v[(i + 2) % 3] - v[(i + 1) % 3];
    if (glm::dot(e, e) > longest) {
      longest = glm::dot(e, e);
      k = i;
    }
  }
  const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
  const dvec3 e = v[j] - v[i], f = v[k] - v[i];
  const double foot = glm::dot(e, f) / longest;
  const dvec3 height = f - foot * e;
  const double height2 = glm::dot(height, height);
  if (!(height2 > 0)) return;
  for (int step = 0; step < 2; ++step) {
    const dvec3 r = p - a - weights[1] * (b - a) - weights[2] * (c - a);
    const double along = glm::dot(r, e) / longest, across = glm::dot(r, height) / height2;
    weights[k] += across;
    weights[j] += along - foot * across;
    weights[i] = 1 - weights[j] - weights[k];
  }
}

}  // namespace

element_point closest_point_on_triangle(const dvec3& p, const dvec3& a, const dvec3& b,
                                        const dvec3& c) {
  const dvec3 ab = b - a, ac = c - a, bc = c - b, n = glm::cross(ab, ac);
  const dvec3 ap = p - a, bp = p - b;
  // p is over the face where it is on the inner side of all edges; these are
  // barycentrics times |n|^2
  const double w = glm::dot(glm::cross(ab, ap), n);
  const double v = glm::dot(glm::cross(ap, ac), n);
  const double u = glm::dot(glm::cross(bc, bp), n);
  const double sum = u + v + w;
  element_point best;
  // by differences of vertices, which lose nothing far from the origin
  const auto distance2 = [&](const element_point& e) {
    const dvec3 r =
        e.feature == mesh_feature::vertex ? p - e.point : ap - e.uv.x * ab - e.uv.y * ac;
    return glm::dot(r, r);
  };
  bool all_edges = false, any = false;
  if (u > 0 && v > 0 && w > 0 && std::isfinite(sum)) {
    std::array<double, 3> weights = {u / sum, v / sum, w / sum};
    const double l2 = std::max({glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(bc, bc)});
    const bool is_sliver = glm::dot(n, n) < 4e-3 * l2 * l2;
    if (is_sliver) refine(weights, p, a, b, c);
    best.uv = {weights[1], weights[2]};
    best.point = a + best.uv.x * ab + best.uv.y * ac;
    best.feature = mesh_feature::face;
    any = weights[0] > 0 && weights[1] > 0 && weights[2] > 0;
    if (any && !is_sliver) return best;
    all_edges = true;
  }
  // an edge that p is on the inner side of cannot hold the point, but for slivers
  all_edges =
      all_edges || !std::isfinite(sum) || !(sum > 1e-12 * glm::dot(ab, ab) * glm::dot(ac, ac));
  const double inner[3] = {w, u, v};
  for (int k = 0; k < 3; ++k) {
    if (!all_edges && inner[k] > 0) continue;
    const element_point e = on_edge(p, a, b, c, k);
    if (!any || distance2(e) < distance2(best)) best = e;
    any = true;
  }
  return best;
}

}  // namespace wisp
