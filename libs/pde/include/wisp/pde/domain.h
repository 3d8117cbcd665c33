#pragma once

// Where a problem is posed: inside or outside of a mesh, of a signed distance, of
// booleans of both, or of any distance function. A walk asks a domain for balls without
// boundary, near the boundary for its closest point, and at its start on which side it
// is.

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/bounds.h"
#include "wisp/geometry/distance_grid.h"
#include "wisp/geometry/sdf.h"
#include "wisp/geometry/signed_distance.h"

namespace wisp {

enum struct domain_side { interior, exterior };

// A point of the boundary. `element` and `uv` tell the triangle and the barycentrics of
// its vertices 1 and 2, in domains of one mesh; -1 elsewhere.
struct boundary_point {
  dvec3 position = {0, 0, 0};
  int element = -1;
  dvec2 uv = {0, 0};
};

struct domain_options {
  // Cells along the longest side of the grid of distances that meshes have, up to 4096;
  // it is filled where walks come by. 0: none. Solids that are not a mesh have no grid.
  int grid_resolution = 1024;
};

struct domain_data;  // within the library

// Immutable; copies share it, and any number of threads may ask it at once. A default
// one is empty.
class WISP_API pde_domain {
 public:
  pde_domain() = default;
  // All throw std::invalid_argument for options out of range. An empty mesh or solid
  // makes an empty domain, which is refused when a problem is solved.
  //
  // The fast one: steps far from the mesh read one number of a grid, others find a
  // lower bound of the distance, and only where a walk may end the closest point.
  explicit pde_domain(const mesh_solid& mesh, domain_side side = domain_side::interior,
                      const domain_options& options = {});
  // Any solid; balls are those of its values, smaller than they could be where they
  // are bounds.
  explicit pde_domain(const sdf& solid, domain_side side = domain_side::interior,
                      const domain_options& options = {});
  // A function of one's own, negative inside of a solid that lies in `bounds`, with
  // |f(p) - f(q)| <= |p - q|; sdf_function takes other slopes. The solid is not looked
  // for outside of the bounds, which may be infinite. It is called from many threads at
  // once. Throws for an empty std::function and empty bounds; where f is NaN, points are
  // `undefined`.
  pde_domain(std::function<double(const dvec3&)> signed_distance, const dbox3& bounds,
             domain_side side = domain_side::interior);

  bool empty() const { return data_ == nullptr; }
  domain_side side() const;
  // Of the solid, whichever side of it is the domain.
  dbox3 bounds() const;
  // The diagonal of the bounds; 1 where they are infinite.
  double size() const;
  // Memory of the grid in use.
  std::size_t bytes() const;

  // Whether p belongs to the domain and not to its boundary. False for a p that is not
  // finite.
  bool contains(const dvec3& p) const;
  // No boundary is nearer than this; 0 where it cannot be told. Within `tolerance`, in
  // (0, 1), of the distance, or of what the solid's values say; from a grid it may be 0.4
  // of it.
  double clearance(const dvec3& p, double tolerance) const;
  // The same for each of `points`; grids and trees are faster on many.
  void clearances(std::span<const dvec3> points, std::span<double> radii, double tolerance) const;
  // The distance from the boundary, or a lower bound of it, and the point of the
  // boundary that a walk which ends at p takes its value from, if it is no farther
  // than epsilon.
  struct nearest {
    double distance = 0;
    bool ends = false;
    boundary_point at = {};
  };
  nearest find_boundary(const dvec3& p, double epsilon) const;

  const domain_data* data() const { return data_.get(); }

 private:
  std::shared_ptr<const domain_data> data_ = {};
};

}  // namespace wisp
