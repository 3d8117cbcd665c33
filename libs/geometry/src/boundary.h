#pragma once

// The open boundary of a mesh, and the angles that it makes around a ray.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bvh_data.h"

namespace wisp {

// Closed runs of directed edges, one after the other: run i is made of the vertices
// from starts[i] to starts[i + 1] - 1, and leads back to its first.
struct boundary_loops {
  std::vector<dvec3> points = {};  // as given, times bvh_data::scale
  std::vector<uint32_t> starts = {0};
  std::size_t count() const { return starts.size() - 1; }
};

// An edge between two of the positions of a tree.
struct directed_edge {
  uint32_t from, to;
};

// The edges of a tree's triangles that are left when opposite ones have cancelled, with
// their multiplicity. Vertices at the same position are the first of them. Throws
// std::length_error for a third of 2^32 triangles or more.
std::vector<directed_edge> open_edges(const bvh_data& data, int threads);

// The loops that these edges form, those near one another in space next to each other.
boundary_loops chain_edges(const bvh_data& data, std::span<const directed_edge> edges, int threads);

inline constexpr int boundary_width = 8;

// Eight edges a to b; those behind the last have no length.
struct alignas(64) boundary_leaf {
  double a[3][boundary_width];
  double b[3][boundary_width];
};

// Eight clusters of consecutive edges. Seen from farther away than the square root of
// far2 from its center, by a ray that misses its box, a cluster is its chords, which
// close its cut runs, and the multipoles of the surface between the two.
struct alignas(64) boundary_group {
  double center[3][boundary_width];
  double far2[boundary_width];
  double min[3][boundary_width];
  double max[3][boundary_width];
  double dipole[3][boundary_width];      // the surface's area as a vector
  double quadrupole[6][boundary_width];  // xx, yy, zz, xy, yz, zx
  double octupole[10][boundary_width];   // xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy, xyz
  double chord[2][6][boundary_width];    // a and b; no length: there is none
  uint32_t chords[boundary_width];       // bit i: chord i is there
  uint32_t count;                        // of clusters
};

// levels[0] holds the groups of leaves, eight leaves to a group; each group of a level
// above holds eight of the one below. The last level has one group.
struct boundary_tree {
  std::vector<boundary_leaf> leaves = {};
  std::vector<std::vector<boundary_group>> levels = {};
  std::size_t edges = 0, loops = 0;
  std::size_t bytes() const;
};

boundary_tree make_boundary_tree(const boundary_loops& loops, double tolerance, int threads);

// How many groups and leaves a query opens, on average over points of a box, scaled.
double boundary_cost(const boundary_tree& tree, const dvec3& low, const dvec3& high);

// Half of the solid angle, over 2 pi, of the fans between the boundary and the point
// infinitely far away against the ray, which is to be added to the crossings of the
// ray from p along axis in the direction `sign`. p as the tree's vertices: scaled.
double boundary_winding(const boundary_tree& tree, const dvec3& p, int axis, double sign);

}  // namespace wisp
