#pragma once

// What stress_geometry holds answers to: distances and winding numbers of all triangles
// one by one, in more digits than double has.

#include "stress_geometry_shapes.h"

#ifdef __SIZEOF_FLOAT128__
__extension__ typedef __float128 wide;  // 34 digits
#else
using wide = long double;
#endif

struct wide3 {
  wide x = 0, y = 0, z = 0;
  wide3() = default;
  wide3(wide a, wide b, wide c) : x(a), y(b), z(c) {}
  explicit wide3(const wisp::dvec3& v) : x(v.x), y(v.y), z(v.z) {}
};
inline wide3 operator-(const wide3& a, const wide3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline wide3 operator+(const wide3& a, const wide3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline wide3 operator*(wide s, const wide3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline wide dot(const wide3& a, const wide3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline wide3 cross(const wide3& a, const wide3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
// The root of x, from 1e-300 to 1e300, and 0 of what is not positive.
wide wide_root(wide x);
inline wide length(const wide3& a) { return wide_root(dot(a, a)); }

// The distance of p from triangle t, and from the mesh: infinite for one without
// triangles. Triangles with a vertex that is not finite do not count.
double exact_distance(const stress_mesh& m, std::size_t t, const wisp::dvec3& p);
double exact_distance(const stress_mesh& m, const wisp::dvec3& p);

// The sum of solid angles over 4 pi (Van Oosterom and Strackee 1983), in long double.
double exact_winding(const stress_mesh& m, const wisp::dvec3& p);

// The signed crossings of a ray from p towards `direction`, in long double: the winding
// number of a closed mesh, but where the ray meets an edge.
int crossing_sum(const stress_mesh& m, const wisp::dvec3& p, const wisp::dvec3& direction);

// The signed distance of p from the ellipsoid about the origin, by bisection.
double exact_ellipsoid(const wisp::dvec3& radii, const wisp::dvec3& p);
