#pragma once

// Meshes for stress_geometry, and points to ask from.

#include <cmath>
#include <vector>

#include "wisp/core/math.h"
#include "wisp/core/rng.h"

struct stress_mesh {
  std::vector<wisp::dvec3> positions = {};
  std::vector<wisp::ivec3> triangles = {};

  const wisp::dvec3& corner(std::size_t triangle, int k) const {
    return positions[static_cast<std::size_t>(triangles[triangle][k])];
  }
};

inline constexpr double stress_pi = 3.14159265358979323846;
inline constexpr double stress_nan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double stress_inf = std::numeric_limits<double>::infinity();

inline double uniform(wisp::rng_state& rng, double low, double high) {
  return low + (high - low) * wisp::rand1d(rng);
}
// 10^low to 10^high, all magnitudes alike.
inline double magnitude(wisp::rng_state& rng, double low, double high) {
  return std::pow(10.0, uniform(rng, low, high));
}
inline wisp::dvec3 random_in_cube(wisp::rng_state& rng, double half) {
  const double x = uniform(rng, -half, half), y = uniform(rng, -half, half);
  return {x, y, uniform(rng, -half, half)};
}
inline wisp::dvec3 random_direction(wisp::rng_state& rng) {
  const double z = uniform(rng, -1, 1), phi = uniform(rng, 0, 2 * stress_pi);
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * std::cos(phi), r * std::sin(phi), z};
}
// Far from where trees and closed forms are cut, and the same each time.
inline wisp::rng_state shape_rng(uint64_t shape) { return wisp::make_rng(17, shape); }

void add_triangle(stress_mesh& m, const wisp::dvec3& a, const wisp::dvec3& b, const wisp::dvec3& c);
stress_mesh joined(stress_mesh a, const stress_mesh& b);
stress_mesh moved(stress_mesh m, double scale, const wisp::dvec3& offset = {0, 0, 0});
stress_mesh inside_out(stress_mesh m);
stress_mesh subdivided(const stress_mesh& m);

// [-1, 1]^3 in 12 * 4^levels triangles: coordinates are exact.
stress_mesh cube_mesh(int levels);
// An octahedron refined to a ball of 8 * 4^levels triangles.
stress_mesh ball_mesh(int levels);
// The same with bumps; not convex.
stress_mesh bumpy_mesh(int levels);
// The upper half of a ball of radius 1 in rings of n triangles, open along the regular
// polygon of n corners in z = 0.
stress_mesh dome_mesh(int n);
// Triangles of length about 1 whose height is 1 / aspect: needles and caps.
stress_mesh sliver_mesh(int n, double aspect);
// Triangles anywhere, with sides of about `edge`.
stress_mesh soup_mesh(int n, double edge);

// Points in and about the mesh's box, next to its surface (1e-12 to 0.1 of its half
// size), and on its vertices, edges and faces, where vertices are finite.
wisp::dvec3 point_about(const stress_mesh& m, std::size_t i, wisp::rng_state& rng);
// A point of triangle t: of the face (kind 0), an edge (1), or a vertex (2).
wisp::dvec3 point_on(const stress_mesh& m, std::size_t t, int kind, wisp::rng_state& rng);
