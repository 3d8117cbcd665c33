#include "wisp/geometry/signed_distance.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "query.h"
#include "sdf_node.h"
#include "wisp/core/parallel.h"
#include "wisp/geometry/spatial_order.h"

namespace wisp {

namespace {

struct mesh_leaf final : sdf_leaf_base {
  mesh_solid mesh;
  explicit mesh_leaf(const mesh_solid& m) : mesh(m) {}

  double distance(const dvec3& p, double within) const override {
    return signed_distance(mesh, p, within);
  }
  dvec3 gradient(const dvec3& p) const override {
    const signed_distance_result r = find_signed_distance(mesh, p);
    if (!r.closest) return {0, 0, 0};
    const dvec3 away = (p - r.closest.at.point) * (r.distance < 0 ? -1.0 : 1.0);
    const double l = glm::length(away), size = mesh.tree().data()->unit;
    if (l > 1e-9 * size) return away / l;
    // the direction to a point that near is noise
    return difference_gradient([this](const dvec3& q) { return signed_distance(mesh, q); }, p,
                               size);
  }
  sdf_properties properties() const override {
    return {true, true, 1, {mesh.tree().min(), mesh.tree().max()}};
  }
};

}  // namespace

signed_distance_result find_signed_distance(const mesh_solid& mesh, const dvec3& p, double within) {
  signed_distance_result r;
  if (std::isnan(p.x) || std::isnan(p.y) || std::isnan(p.z)) {
    r.distance = std::numeric_limits<double>::quiet_NaN();
    r.side = inside(mesh, p);
    return r;
  }
  if (mesh.tree().empty()) return r;
  within = std::max(within, 0.0);
  r.closest = closest_point(mesh.tree(), p, {.max_distance = within});
  r.side = inside(mesh, p);
  r.distance = r.closest ? r.closest.distance : within;
  if (r.side.inside && r.distance > 0) r.distance = -r.distance;
  return r;
}

double signed_distance(const mesh_solid& mesh, const dvec3& p, double within) {
  return find_signed_distance(mesh, p, within).distance;
}
double signed_distance(const mesh_solid& mesh, const dvec3& p) {
  return find_signed_distance(mesh, p).distance;
}

void signed_distances(const mesh_solid& mesh, std::span<const dvec3> points,
                      std::span<double> results, int threads) {
  if (points.size() != results.size()) {
    throw std::invalid_argument("signed_distances: " + std::to_string(results.size()) +
                                " results for " + std::to_string(points.size()) + " points");
  }
  const int n = thread_count(threads);
  const std::vector<uint32_t> order = spatial_order(points, n);
  parallel_for(
      points.size(), n,
      [&](std::size_t i) { results[order[i]] = signed_distance(mesh, points[order[i]]); }, 256);
}

sdf sdf_mesh(const mesh_solid& mesh) {
  if (mesh.tree().empty()) return sdf_empty();
  return sdf_leaf(std::make_shared<mesh_leaf>(mesh));
}

}  // namespace wisp
