// Dual contouring of implicit solids.
//
// Ju, Losasso, Schaefer and Warren, "Dual Contouring of Hermite Data", SIGGRAPH
// 2002: a vertex in each cell that the surface passes, a quad round each cell
// edge that it crosses. As in Nielson, "Dual Marching Cubes", 2004, a cell has a
// vertex for each of its sheets, so that the quads round a vertex are a single
// fan. That leaves one way to lose manifoldness (Wenger, Isosurfaces, 2013,
// section 3.3.5): two neighbouring cells whose common face holds two arcs, both
// of the same sheet in either cell, would have two mesh edges between the same
// two vertices. Each such edge gets a vertex of its own in the middle.

#include "wisp/geometry/contour.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

#include "contour_cell.h"
#include "contour_grid.h"
#include "wisp/core/parallel.h"

namespace wisp {

namespace {

using namespace contouring;

struct cell_vertices {
  int first = 0;        // the vertex of sheet 0; the others follow
  uint32_t sheets = 0;  // two bits for each edge
};
int vertex_at(const cell_vertices& cell, int edge) {
  return cell.first + static_cast<int>((cell.sheets >> (2 * edge)) & 3);
}

// The two vertices on a face where both arcs join the same two vertices.
struct face_name {
  ivec3 cell = {0, 0, 0};  // above the face
  int axis = 0;
};
bool operator<(const face_name& a, const face_name& b) {
  return std::array{a.cell.z, a.cell.y, a.cell.x, a.axis} <
         std::array{b.cell.z, b.cell.y, b.cell.x, b.axis};
}
struct face_split {
  bool first = false;  // cuts_first
  int vertex = 0;      // of arc 0; that of arc 1 follows
};
using face_splits = std::map<face_name, face_split>;

bool face_cuts_first(const lattice& grid, const ivec3& cell, int signs, int axis, int side) {
  dvec3 at = dvec3(cell) + 0.5;
  at[axis] = cell[axis] + side;
  return cuts_first(signs, axis, side, evaluate(grid, lattice_point(grid, at)) < 0);
}

dvec3 crossing_offset(int edge, const crossing& c) {
  dvec3 p = dvec3(edge_offset(edge));
  p[edge / 4] = c.t;
  return p;
}

// What is made of a block: vertices numbered from zero.
struct block_mesh {
  std::vector<dvec3> positions = {}, normals = {};
  std::vector<cell_vertices> cells = {};
};

block_mesh make_vertices(const sparse_grid& surface, const block& b,
                         const contour_options& options) {
  const lattice& grid = surface.grid;
  double unit = std::max({grid.cell.x, grid.cell.y, grid.cell.z});
  dvec3 size = grid.cell / unit;
  block_mesh mesh;
  for (uint64_t rest = b.surface; rest != 0; rest &= rest - 1) {
    ivec3 local = local_cell(std::countr_zero(rest)), cell = b.at * block_cells + local;
    int signs = cell_signs(b, local);
    std::array<bool, 6> first = {};
    for (int axis = 0; axis < 3; axis++)
      for (int side = 0; side < 2; side++)
        if (is_ambiguous(signs, axis, side))
          first[static_cast<std::size_t>(2 * axis + side)] =
              face_cuts_first(grid, cell, signs, axis, side);
    cell_sheets sheets = find_sheets(signs, first);

    cell_vertices entry;
    entry.first = static_cast<int>(mesh.positions.size());
    for (int sheet = 0; sheet < sheets.count; sheet++) {
      std::array<tangent_plane, 12> planes;
      std::size_t count = 0;
      dvec3 normal = {0, 0, 0};
      for (int e = 0; e < 12; e++) {
        if (sheets.of[static_cast<std::size_t>(e)] != sheet) continue;
        entry.sheets |= static_cast<uint32_t>(sheet) << (2 * e);
        const crossing& c = find_crossing(surface, cell, e);
        planes[count++] = {crossing_offset(e, c) * size, c.normal};
        normal += c.normal;
      }
      dvec3 p = fit_vertex({planes.data(), count}, size, options.sharp);
      mesh.positions.push_back(lattice_point(grid, dvec3(cell) + p / size));
      if (options.normals) {
        double length = glm::length(normal);
        mesh.normals.push_back(length > 1e-12 ? normal / length : dvec3{0, 0, 0});
      }
    }
    mesh.cells.push_back(entry);
  }
  return mesh;
}

struct mesher {
  const sparse_grid& surface;
  std::vector<cell_vertices> cells = {};
  face_splits splits = {};
};

// Null where the grid ends.
const cell_vertices* find_cell(const mesher& m, const ivec3& cell) {
  const block* b = find_block(m.surface, cell);
  if (!b) return nullptr;
  int local = local_index(cell - b->at * block_cells);
  if (((b->surface >> local) & 1) == 0) return nullptr;
  return &m.cells[b->first_cell + static_cast<std::size_t>(rank(b->surface, local))];
}

bool same_sheet(const cell_vertices& cell, const std::array<int, 4>& edges) {
  int v = vertex_at(cell, edges[0]);
  return v == vertex_at(cell, edges[1]) && v == vertex_at(cell, edges[2]) &&
         v == vertex_at(cell, edges[3]);
}

// The faces below the cells of a block whose arcs join the same two vertices.
std::vector<face_name> find_splits(const mesher& m, const block& b) {
  std::vector<face_name> found;
  for (uint64_t rest = b.surface; rest != 0; rest &= rest - 1) {
    ivec3 local = local_cell(std::countr_zero(rest)), cell = b.at * block_cells + local;
    int signs = cell_signs(b, local);
    for (int axis = 0; axis < 3; axis++) {
      if (!is_ambiguous(signs, axis, 0)) continue;
      const cell_vertices* high = find_cell(m, cell);
      const cell_vertices* low = find_cell(m, cell - axis_offset(axis));
      if (high && low && same_sheet(*high, face_edges(axis, 0)) &&
          same_sheet(*low, face_edges(axis, 1)))
        found.push_back({cell, axis});
    }
  }
  return found;
}

void add_split(mesher& m, const face_name& face, contour_mesh& mesh, bool normals) {
  const lattice& grid = m.surface.grid;
  const block* b = find_block(m.surface, face.cell);
  int signs = cell_signs(*b, face.cell - b->at * block_cells);
  face_split split;
  split.first = face_cuts_first(grid, face.cell, signs, face.axis, 0);
  split.vertex = static_cast<int>(mesh.positions.size());
  auto edges = face_edges(face.axis, 0);
  for (int arc = 0; arc < 2; arc++) {
    dvec3 middle = {0, 0, 0}, normal = {0, 0, 0};
    for (int i = 0; i < 4; i++) {
      if (arc_of(split.first, i) != arc) continue;
      int e = edges[static_cast<std::size_t>(i)];
      const crossing& c = find_crossing(m.surface, face.cell, e);
      middle += crossing_offset(e, c) * 0.5;
      normal += c.normal;
    }
    mesh.positions.push_back(lattice_point(grid, dvec3(face.cell) + middle));
    double length = glm::length(normal);
    if (normals) mesh.normals.push_back(length > 1e-12 ? normal / length : dvec3{0, 0, 0});
  }
  m.splits.emplace(face, split);
}

// How well a triangle fits the surface's normal: the cosine between.
double fit(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& normal) {
  dvec3 n = glm::cross(b - a, c - a);
  double length = glm::length(n);
  return length > 0 ? glm::dot(n, normal) / length : -1;
}

// Splits the quad where its worse triangle faces the surface's normal best;
// where that is all the same, along the shorter diagonal.
bool split_at_first(const std::array<dvec3, 4>& p, const dvec3& normal) {
  double first = std::min(fit(p[0], p[1], p[2], normal), fit(p[0], p[2], p[3], normal));
  double second = std::min(fit(p[0], p[1], p[3], normal), fit(p[1], p[2], p[3], normal));
  if (std::abs(first - second) > 1e-3) return first > second;
  return glm::dot(p[2] - p[0], p[2] - p[0]) <= glm::dot(p[3] - p[1], p[3] - p[1]) * (1 + 1e-9);
}

// The faces round the crossing edge of `axis` at the lowest corner of `cell`.
void add_polygon(const mesher& m, const contour_mesh& mesh, const block& b, const ivec3& cell,
                 int axis, std::vector<ivec3>& triangles) {
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  // Counter-clockwise seen from the upper end.
  constexpr std::array<ivec2, 4> back = {ivec2{1, 1}, ivec2{0, 1}, ivec2{0, 0}, ivec2{1, 0}};
  std::array<const cell_vertices*, 4> cells;
  std::array<ivec3, 4> at;
  std::array<int, 4> edges;
  for (std::size_t i = 0; i < 4; i++) {
    at[i] = cell - back[i].x * axis_offset(u) - back[i].y * axis_offset(v);
    edges[i] = axis * 4 + back[i].x + 2 * back[i].y;
    cells[i] = find_cell(m, at[i]);
    if (!cells[i]) return;  // at the border of an open grid
  }
  std::array<int, 8> polygon;
  std::size_t count = 0, middle = 8;
  for (std::size_t i = 0; i < 4; i++) {
    polygon[count++] = vertex_at(*cells[i], edges[i]);
    if (m.splits.empty()) continue;
    std::size_t j = (i + 1) & 3;
    int across = at[i][u] != at[j][u] ? u : v;
    std::size_t high = at[i][across] > at[j][across] ? i : j;
    auto split = m.splits.find({at[high], across});
    if (split == m.splits.end()) continue;
    auto ring = face_edges(across, 0);
    int place = static_cast<int>(std::find(ring.begin(), ring.end(), edges[high]) - ring.begin());
    middle = count;
    polygon[count++] = split->second.vertex + arc_of(split->second.first, place);
  }
  bool flip = !inside_at(b, cell - b.at * block_cells);  // the upper end is inside
  if (flip) std::reverse(polygon.begin(), polygon.begin() + static_cast<std::ptrdiff_t>(count));
  std::size_t from = 0;
  if (count == 4) {
    std::array<dvec3, 4> p;
    for (std::size_t i = 0; i < 4; i++) p[i] = mesh.positions[static_cast<std::size_t>(polygon[i])];
    from = split_at_first(p, find_crossing(m.surface, cell, axis * 4).normal) ? 0 : 1;
  } else {
    // From a middle: it is a corner of no other polygon with these vertices, so
    // that the diagonals are edges of this polygon alone.
    from = flip ? count - 1 - middle : middle;
  }
  for (std::size_t i = 1; i + 1 < count; i++)
    triangles.push_back(
        {polygon[from], polygon[(from + i) % count], polygon[(from + i + 1) % count]});
}

std::vector<ivec3> make_triangles(const mesher& m, const contour_mesh& mesh, const block& b) {
  std::vector<ivec3> triangles;
  for (int axis = 0; axis < 3; axis++)
    for (uint64_t rest = b.edges[static_cast<std::size_t>(axis)]; rest != 0; rest &= rest - 1)
      add_polygon(m, mesh, b, b.at * block_cells + local_cell(std::countr_zero(rest)), axis,
                  triangles);
  return triangles;
}

// An open mesh has no polygons at the edges on the box, so that the vertices of
// the cells there may be of none.
void drop_unused(contour_mesh& mesh) {
  std::vector<int> place(mesh.positions.size(), -1);
  for (const ivec3& t : mesh.triangles)
    for (int k = 0; k < 3; k++) place[static_cast<std::size_t>(t[k])] = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < place.size(); i++) {
    if (place[i] < 0) continue;
    mesh.positions[count] = mesh.positions[i];
    if (!mesh.normals.empty()) mesh.normals[count] = mesh.normals[i];
    place[i] = static_cast<int>(count++);
  }
  mesh.positions.resize(count);
  if (!mesh.normals.empty()) mesh.normals.resize(count);
  for (ivec3& t : mesh.triangles)
    for (int k = 0; k < 3; k++) t[k] = place[static_cast<std::size_t>(t[k])];
}

void check_count(std::size_t count) {
  if (count > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw std::length_error("contour: the mesh does not fit an int; lower the resolution");
}

}  // namespace

contour_mesh contour(const std::function<double(const dvec3&)>& f, const contour_options& options) {
  sparse_grid surface = sample_surface(make_lattice(f, options), options.threads);
  std::size_t n = surface.blocks.size();
  contour_mesh mesh;

  std::vector<block_mesh> parts(n);
  parallel_for(
      n, options.threads,
      [&](std::size_t i) { parts[i] = make_vertices(surface, surface.blocks[i], options); }, 8);
  std::size_t cells = 0, vertices = 0;
  for (const block_mesh& part : parts) {
    cells += part.cells.size();
    vertices += part.positions.size();
  }
  check_count(vertices);
  mesher m{surface};
  m.cells.reserve(cells);
  mesh.positions.reserve(vertices);
  if (options.normals) mesh.normals.reserve(vertices);
  for (std::size_t i = 0; i < n; i++) {
    surface.blocks[i].first_cell = m.cells.size();
    auto base = static_cast<int>(mesh.positions.size());
    for (cell_vertices cell : parts[i].cells) {
      cell.first += base;
      m.cells.push_back(cell);
    }
    mesh.positions.insert(mesh.positions.end(), parts[i].positions.begin(),
                          parts[i].positions.end());
    mesh.normals.insert(mesh.normals.end(), parts[i].normals.begin(), parts[i].normals.end());
    parts[i] = {};
  }

  std::vector<std::vector<face_name>> splits(n);
  parallel_for(
      n, options.threads, [&](std::size_t i) { splits[i] = find_splits(m, surface.blocks[i]); },
      64);
  for (const auto& list : splits)
    for (const face_name& face : list) {
      check_count(mesh.positions.size() + 2);
      add_split(m, face, mesh, options.normals);
    }

  std::vector<std::vector<ivec3>> triangles(n);
  parallel_for(
      n, options.threads,
      [&](std::size_t i) { triangles[i] = make_triangles(m, mesh, surface.blocks[i]); }, 8);
  std::size_t total = 0;
  for (const auto& list : triangles) total += list.size();
  check_count(total);
  mesh.triangles.reserve(total);
  for (auto& list : triangles) {
    mesh.triangles.insert(mesh.triangles.end(), list.begin(), list.end());
    list = {};
  }
  if (!options.close_at_box) drop_unused(mesh);
  return mesh;
}

}  // namespace wisp
