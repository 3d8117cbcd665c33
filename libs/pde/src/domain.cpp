#include "wisp/pde/domain.h"

#include <cmath>
#include <stdexcept>
#include <vector>

#include "domain_data.h"

namespace wisp {

namespace {

bool is_finite(const dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

struct mesh_domain final : domain_data {
  mesh_solid mesh;
  distance_grid grid;
  // Smaller balls from cells cost less in all than larger ones from the tree.
  static constexpr double grid_tolerance = 0.6;
  double noise = 0;  // of bounds of distances, which come from single precision

  mesh_domain(const mesh_solid& m, const domain_options& options) : mesh(m) {
    const bvh& tree = mesh.tree();
    bounds = {tree.min(), tree.max()};
    if (options.grid_resolution != 0) grid = distance_grid(tree, {options.grid_resolution, 0.1});
    noise = 4e-6 * glm::distance(bounds.min, bounds.max);
  }
  int side_of(const dvec3& p) const override {
    if (find_boundary(p, 0).ends) return 0;
    return wisp::inside(mesh, p).inside ? -1 : 1;
  }
  std::size_t bytes() const override { return grid.bytes(); }

  void clearances(std::span<const dvec3> points, std::span<double> radii,
                  double tolerance) const override {
    std::vector<dvec3> far;
    std::vector<std::uint32_t> where;
    far.reserve(points.size());
    where.reserve(points.size());
    grid.lower_bounds(points, radii, grid_tolerance);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (radii[i] > 0) continue;
      far.push_back(points[i]);
      where.push_back(static_cast<std::uint32_t>(i));
    }
    std::vector<distance_bounds> found(far.size());
    bound_distances(mesh.tree(), far, found, tolerance);
    for (std::size_t i = 0; i < far.size(); ++i) radii[where[i]] = std::max(found[i].lower, 0.0);
  }

  pde_domain::nearest find_boundary(const dvec3& p, double epsilon) const override {
    // a little beyond, so that rounding of bounds cannot trap a walk between the two
    const double reach = std::max(epsilon, noise);
    const closest_point_result c = closest_point(mesh.tree(), p, {reach, 0});
    pde_domain::nearest result;
    result.distance = c ? c.distance : c.lower_bound;
    result.ends = c && c.distance <= epsilon;
    if (c) result.at = {c.at.point, c.element, c.at.uv};
    return result;
  }
};

struct sdf_domain final : domain_data {
  sdf solid;

  explicit sdf_domain(const sdf& s) : solid(s) { bounds = properties(s).bounds; }
  int side_of(const dvec3& p) const override {
    const double v = signed_distance(solid, p);
    return v < 0 ? -1 : v > 0 ? 1 : v == 0 ? 0 : unknown_side;
  }
  std::size_t bytes() const override { return 0; }

  void clearances(std::span<const dvec3> points, std::span<double> radii, double) const override {
    for (std::size_t i = 0; i < points.size(); ++i) radii[i] = distance_bound(solid, points[i]);
  }

  pde_domain::nearest find_boundary(const dvec3& p, double epsilon) const override {
    pde_domain::nearest result;
    result.distance = distance_bound(solid, p);
    result.at.position = p;
    if (!(result.distance <= epsilon)) return result;
    // Where parts of a union touch, the value is 0 within the solid: no end of a walk.
    // A bound may be less than the distance, by far for a function of a careless maker.
    const double fine = std::clamp(1e-3 * epsilon / size, 1e-14, 1e-9);
    const auto surface = project(solid, p, {fine, 64});
    result.ends = surface && surface->distance <= 100 * epsilon;
    if (surface) result.at.position = surface->point;
    if (!result.ends) result.distance = epsilon;
    return result;
  }
};

sdf checked_function(std::function<double(const dvec3&)> f, const dbox3& bounds) {
  if (!f) throw std::invalid_argument("the distance of a domain is no function");
  // Solids may be empty, but who names a distance means a domain.
  if (is_empty(bounds)) {
    throw std::invalid_argument(
        "the bounds of a domain should be a box around its solid, min below max");
  }
  return sdf_function(std::move(f), bounds);
}

}  // namespace

domain_data::~domain_data() = default;

void domain_data::finish(domain_side s) {
  side = s;
  if (wisp::is_finite(bounds)) {
    size = glm::distance(bounds.min, bounds.max);
    center = 0.5 * bounds.min + 0.5 * bounds.max;
    bounded = true;
  }
}

pde_domain::pde_domain(const mesh_solid& mesh, domain_side side, const domain_options& options) {
  if (mesh.tree().empty()) return;
  auto data = std::make_shared<mesh_domain>(mesh, options);
  data->finish(side);
  data_ = std::move(data);
}

pde_domain::pde_domain(const sdf& solid, domain_side side, const domain_options&) {
  const dbox3 bounds = properties(solid).bounds;
  if (is_empty(bounds)) return;
  auto data = std::make_shared<sdf_domain>(solid);
  data->finish(side);
  data_ = std::move(data);
}

pde_domain::pde_domain(std::function<double(const dvec3&)> signed_distance, const dbox3& bounds,
                       domain_side side)
    : pde_domain(checked_function(std::move(signed_distance), bounds), side) {}

domain_side pde_domain::side() const { return data_ ? data_->side : domain_side::interior; }
dbox3 pde_domain::bounds() const { return data_ ? data_->bounds : dbox3{}; }
double pde_domain::size() const { return data_ ? data_->size : 1; }
std::size_t pde_domain::bytes() const { return data_ ? data_->bytes() : 0; }

bool pde_domain::contains(const dvec3& p) const {
  if (!data_ || !is_finite(p)) return false;
  return data_->side_of(p) == (data_->side == domain_side::interior ? -1 : 1);
}

double pde_domain::clearance(const dvec3& p, double tolerance) const {
  double r = 0;
  clearances({&p, 1}, {&r, 1}, tolerance);
  return r;
}

void pde_domain::clearances(std::span<const dvec3> points, std::span<double> radii,
                            double tolerance) const {
  if (points.size() != radii.size()) {
    throw std::invalid_argument("clearances: points and radii should be as many");
  }
  if (!data_) {
    std::fill(radii.begin(), radii.end(), 0.0);
  } else {
    data_->clearances(points, radii, tolerance);
  }
}

pde_domain::nearest pde_domain::find_boundary(const dvec3& p, double epsilon) const {
  return data_ ? data_->find_boundary(p, epsilon) : nearest{};
}

}  // namespace wisp
