#pragma once

// Solids as signed distances: primitives, meshes and functions of one's own, and what
// operations make of them. Negative inside, in scene units, in double.
//
// Every value is 1-Lipschitz and 0 on the surface, so that a ball of radius |value|
// around the point holds no surface: what sphere tracing and walks on spheres live
// on (Hart, Sphere tracing, 1996). Where a value is the distance itself and where no
// more than a lower bound of it follows from the tree:
//
//   node                         exact outside          exact inside
//   sphere, box, rounded box,    yes                    yes
//   capsule, cylinder, cone,
//   plane, ellipsoid, mesh
//   torus                        yes                    if minor <= major
//   union                        if all operands are    if there is one, and it is
//   intersection                 if there is one        if all operands are
//   difference                   as the intersection of the first with the complements
//   complement                   as its operand inside  as its operand outside
//   offset by r >= 0             as its operand         no (r > 0)
//   offset by r < 0              no                     as its operand
//   transform                    as its operand, for rotations, reflections and
//                                uniform scale (to 1e-12); else no
//   smooth operations            no                     no
//   leaf, function               as its maker says      as its maker says
//
// Outside of its bounds a value is no less than the distance from them. Where a value
// is a bound only, the sign is right, and an offset grows or shrinks the solid by no
// less than asked for. Where parts of a union touch, or of what is cut out, values are
// 0 on what they share, within the solid: a ball around it is safe, and of radius 0.
//
// Unions of many operands, and differences of many, keep a tree over their boxes, so
// that evaluation looks only at those that can matter. Unions of unions are one, and
// chains of transforms, offsets and complements too. Solids may be nested as deep as
// memory permits. Values and differences of them are rounded in the last digits of the
// coordinates.

#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/bounds.h"

namespace wisp {

struct sdf_node;  // within the library

// A solid. Immutable; copies share it, any number of threads may evaluate it at once.
// A default one is empty.
class WISP_API sdf {
 public:
  sdf();
  explicit sdf(std::shared_ptr<const sdf_node> node) : node_(std::move(node)) {}
  const sdf_node& node() const { return *node_; }
  const std::shared_ptr<const sdf_node>& shared() const { return node_; }

 private:
  std::shared_ptr<const sdf_node> node_;
};

struct sdf_properties {
  bool exact_outside = true;
  bool exact_inside = true;
  double lipschitz = 1;  // of values as signed_distance returns them
  dbox3 bounds = {};     // holds the solid; infinite where it may be
};
WISP_API sdf_properties properties(const sdf& solid);

// What a user's own solid implements. Its const functions are called from many threads at
// once, as is the function of sdf_function.
class WISP_API sdf_leaf_base {
 public:
  virtual ~sdf_leaf_base();
  // The signed distance of p, or a lower bound of it of the right sign. Where its
  // absolute value is above `within`, any value of the right sign with an absolute
  // value from `within` to that of the distance will do. |distance(p) - distance(q)|
  // <= properties().lipschitz |p - q|; values are divided by that.
  virtual double distance(const dvec3& p, double within) const = 0;
  // The direction in which the distance grows, of unit length; central differences
  // that suit the bounds if not overridden.
  virtual dvec3 gradient(const dvec3& p) const;
  virtual sdf_properties properties() const = 0;
};

// All throw std::invalid_argument for numbers that are not finite and for parameters
// out of range.
WISP_API sdf sdf_empty();
WISP_API sdf sdf_sphere(const dvec3& center, double radius);          // radius > 0
WISP_API sdf sdf_box(const dvec3& center, const dvec3& half);         // half > 0
WISP_API sdf sdf_rounded_box(const dvec3& center, const dvec3& half,  // half with the
                             double radius);                          // rounding
WISP_API sdf sdf_torus(const dvec3& center, const dvec3& normal, double major, double minor);
WISP_API sdf sdf_capsule(const dvec3& a, const dvec3& b, double radius);
WISP_API sdf sdf_cylinder(const dvec3& a, const dvec3& b, double radius);  // flat caps
WISP_API sdf sdf_cone(const dvec3& a, const dvec3& b, double radius_a,     // flat caps
                      double radius_b);
WISP_API sdf sdf_plane(const dvec3& point, const dvec3& normal);  // inside behind it
// The distance as in Eberly, Distance from a Point to an Ellipse, an Ellipsoid, or a
// Hyperellipsoid (2013), by a Newton iteration that cannot fail. radii > 0, within a
// factor of 1e9 of each other.
WISP_API sdf sdf_ellipsoid(const dvec3& center, const dvec3& radii);
WISP_API sdf sdf_leaf(std::shared_ptr<const sdf_leaf_base> leaf);
// A function f with |f(p) - f(q)| <= lipschitz |p - q|, negative inside; its values are
// divided by lipschitz. `bounds` holds the solid. `exact`: f / lipschitz is the
// distance.
WISP_API sdf sdf_function(std::function<double(const dvec3&)> f, const dbox3& bounds,
                          double lipschitz = 1, bool exact = false);

// Of one solid or more.
WISP_API sdf sdf_union(std::span<const sdf> solids);
WISP_API sdf sdf_intersection(std::span<const sdf> solids);
WISP_API sdf sdf_difference(std::span<const sdf> solids);  // the first without the others
// The same with edges rounded over a width of `blend` > 0: where values differ by more
// than that they are as above. Two values a and b become
//   min(a, b) - max(blend - |a - b|, 0)^2 / (4 blend)
// (Quilez, Smooth minimum, the quadratic one); more than two are taken in by
// increasing value, so that their order does not matter.
WISP_API sdf sdf_smooth_union(std::span<const sdf> solids, double blend);
WISP_API sdf sdf_smooth_intersection(std::span<const sdf> solids, double blend);
WISP_API sdf sdf_smooth_difference(std::span<const sdf> solids, double blend);
// `frame`: axes and origin as columns, invertible.
WISP_API sdf sdf_transform(const glm::dmat4x3& frame, const sdf& of);
WISP_API sdf sdf_offset(const sdf& of, double by);  // grown by, or shrunk where negative
WISP_API sdf sdf_complement(const sdf& of);

// The value at p; +infinity for an empty solid; NaN where p is not finite. Cost: a
// primitive takes 3 to 40 ns, an ellipsoid 130. No memory is asked for, but for a
// smooth operation where more than 32 operands meet within the blend, and for solids
// nested more than 64 deep.
WISP_API double signed_distance(const sdf& solid, const dvec3& p);
// The same where it lies in [low, high]; otherwise what is returned lies between the
// nearer of the two and the value. Cheaper, as parts that cannot matter are left out.
WISP_API double signed_distance(const sdf& solid, const dvec3& p, double low, double high);

// The radius of a ball around p that holds no surface: |value|, 0 where that is NaN.
WISP_API double distance_bound(const sdf& solid, const dvec3& p);

// The unit normal of the level set at p, outward: of the operand that decides, by its
// primitive's formula, or by central differences for functions and for solids nested
// more than 64 deep. Zero where there is none (an empty solid); any where there are
// several (the center of a sphere).
WISP_API dvec3 gradient(const sdf& solid, const dvec3& p);

// A point of the surface near p, found by following the gradient as sphere tracing
// follows a ray.
struct sdf_surface_point {
  dvec3 point = {0, 0, 0};
  double distance = 0;   // of p from it
  double residual = 0;   // |value| at it
  double bound = 0;      // |value| at p: no surface is nearer
  bool closest = false;  // distance is bound, within the tolerance: none is closer
};
struct project_options {
  double tolerance = 1e-9;  // of the residual, as a part of the distance and the size; (0, 1)
  int max_steps = 256;
};
// None where it does not land on a surface: from a point where the gradient vanishes,
// where steps run in circles between surfaces, or where the value vanishes but has one
// sign on both sides. For an exact value this is the closest point of the surface, but
// next to where several are equally close; for a bound it is a point of the surface,
// and p's distance from it an upper bound. Throws std::invalid_argument for options out
// of range.
WISP_API std::optional<sdf_surface_point> project(const sdf& solid, const dvec3& p,
                                                  const project_options& options = {});

}  // namespace wisp
