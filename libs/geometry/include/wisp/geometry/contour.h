#pragma once

// Meshes of implicit solids, by dual contouring with a vertex for every sheet
// of surface in a cell.

#include <functional>
#include <vector>

#include "wisp/core/export.h"
#include "wisp/core/math.h"

namespace wisp {

struct contour_options {
  dvec3 min = {-1, -1, -1};  // the box that is meshed; f is called nowhere else
  dvec3 max = {1, 1, 1};
  int resolution = 128;      // cells along the longest side, 2 to 4096
  double lipschitz = 1;      // |f(a) - f(b)| <= lipschitz |a - b| in the box
  int threads = 0;           // 0: all of the machine's
  bool sharp = true;         // place vertices on edges and corners of the solid
  bool close_at_box = true;  // mesh the solid inside the box; otherwise the mesh ends at the box
  bool normals = false;      // fill contour_mesh::normals
};

struct contour_mesh {
  std::vector<dvec3> positions = {};
  std::vector<ivec3> triangles = {};  // counter-clockwise seen from outside
  std::vector<dvec3> normals = {};    // unit, of the vertices; zero where f has no gradient
};

// The surface of {f < 0} in a box. f is negative inside; zero and NaN count as
// outside. It is called from several threads at once unless threads is 1, and
// must give the same value for the same point each time.
//
// The mesh is an oriented two-manifold: each directed edge belongs to one
// triangle and so does its opposite, except along the box where close_at_box is
// false. Vertices and triangles come in the same order at any thread count.
// Triangles may be thin or, where the solid has details of the size of a cell,
// cross each other; a part of the solid smaller than a cell may be missed.
//
// A crossing of a cell edge is exact to 1e-10 cells; the surface is off by
// O(cell^2) where it is smooth. With sharp, vertices minimize the distances to
// the tangent planes at the crossings (Ju et al. 2002) within their cell, so
// that edges and corners are exact for planar faces; otherwise they are the
// mean of the crossings.
//
// Any number of threads may call this at once, if f takes that.
//
// Cost and memory grow with the number of cells near the surface: boxes whose
// value at the centre exceeds lipschitz times their half diagonal are skipped.
// A lipschitz that is too small loses parts of the surface that lie apart, but
// never tears it. Where f is NaN nothing is skipped.
//
// Throws std::invalid_argument for options out of range, or when f contradicts
// itself, std::length_error when the mesh needs more vertices or triangles than
// an int counts, and whatever f throws.
WISP_API contour_mesh contour(const std::function<double(const dvec3&)>& f,
                              const contour_options& options = {});

}  // namespace wisp
