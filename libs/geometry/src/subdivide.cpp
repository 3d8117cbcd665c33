// Catmull-Clark subdivision: Catmull and Clark, "Recursively generated B-spline
// surfaces on arbitrary topological meshes", Computer-Aided Design 10(6), 1978;
// boundaries after DeRose, Kass and Truong, "Subdivision Surfaces in Character
// Animation", SIGGRAPH 1998.

#include "wisp/geometry/subdivide.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include "wisp/core/rng.h"

namespace wisp {

namespace {

constexpr std::size_t max_elements = static_cast<std::size_t>(std::numeric_limits<int>::max());

int corners(const ivec4& q) { return q.z == q.w ? 3 : 4; }

// The edges of a mesh in the order in which its faces name them first, so that
// the result does not depend on a hash function.
struct edge_list {
  std::vector<ivec2> vertices = {};         // x <= y
  std::vector<int> faces = {};              // face corners on each edge
  std::vector<std::array<int, 4>> of = {};  // of[face][corner]: edge from corner to the next
};

edge_list find_edges(const std::vector<ivec4>& quads) {
  // An open-addressing table of edge numbers, never full: at most four edges a face.
  std::size_t capacity = 16;
  while (capacity < quads.size() * 5) capacity *= 2;
  std::vector<int> table(capacity, -1);

  edge_list edges;
  edges.vertices.reserve(quads.size() * 2);
  edges.faces.reserve(quads.size() * 2);
  edges.of.reserve(quads.size());
  for (const ivec4& q : quads) {
    std::array<int, 4> ids = {-1, -1, -1, -1};
    int n = corners(q);
    for (int k = 0; k < n; k++) {
      int a = q[k], b = q[(k + 1) % n];
      ivec2 edge = a < b ? ivec2{a, b} : ivec2{b, a};
      uint64_t key = (static_cast<uint64_t>(static_cast<uint32_t>(edge.x)) << 32) |
                     static_cast<uint32_t>(edge.y);
      std::size_t slot = static_cast<std::size_t>(hash64(key)) & (capacity - 1);
      while (table[slot] >= 0 && edges.vertices[static_cast<std::size_t>(table[slot])] != edge)
        slot = (slot + 1) & (capacity - 1);
      if (table[slot] < 0) {
        table[slot] = static_cast<int>(edges.vertices.size());
        edges.vertices.push_back(edge);
        edges.faces.push_back(0);
      }
      edges.faces[static_cast<std::size_t>(table[slot])]++;
      ids[static_cast<std::size_t>(k)] = table[slot];
    }
    edges.of.push_back(ids);
  }
  return edges;
}

template <typename T>
void check_mesh(const quad_mesh<T>& mesh) {
  // Each face makes at most four faces, four edges and one vertex.
  if (mesh.quads.size() > max_elements / 8 || mesh.vertices.size() > max_elements / 2)
    throw std::length_error("the subdivided mesh would have more vertices than an int can count");
  for (const ivec4& q : mesh.quads)
    for (int k = 0; k < 4; k++)
      if (q[k] < 0 || static_cast<std::size_t>(q[k]) >= mesh.vertices.size())
        throw std::invalid_argument(
            "a face of the mesh to subdivide names a vertex that is not there");
}

// The refined mesh before any smoothing: the old vertices, then the middles of
// the edges, then the middles of the faces. Corner k of a face becomes the quad
// (corner, edge after, middle, edge before).
template <typename T>
quad_mesh<T> split(const quad_mesh<T>& mesh, const edge_list& edges) {
  quad_mesh<T> result;
  result.vertices.reserve(mesh.vertices.size() + edges.vertices.size() + mesh.quads.size());
  result.vertices = mesh.vertices;
  auto at = [&](int i) -> const T& { return mesh.vertices[static_cast<std::size_t>(i)]; };
  for (const ivec2& e : edges.vertices) result.vertices.push_back((at(e.x) + at(e.y)) * 0.5f);
  for (const ivec4& q : mesh.quads)
    result.vertices.push_back(corners(q) == 4 ? (at(q.x) + at(q.y) + at(q.z) + at(q.w)) * 0.25f
                                              : (at(q.x) + at(q.y) + at(q.z)) / 3.0f);

  auto first_edge = static_cast<int>(mesh.vertices.size());
  auto first_face = static_cast<int>(mesh.vertices.size() + edges.vertices.size());
  result.quads.reserve(mesh.quads.size() * 4);
  for (std::size_t f = 0; f < mesh.quads.size(); f++) {
    int n = corners(mesh.quads[f]);
    for (int k = 0; k < n; k++) {
      int after = edges.of[f][static_cast<std::size_t>(k)];
      int before = edges.of[f][static_cast<std::size_t>((k + n - 1) % n)];
      result.quads.push_back({mesh.quads[f][k], first_edge + after,
                              first_face + static_cast<int>(f), first_edge + before});
    }
  }
  return result;
}

// What is around a vertex: sums of the middles of its faces and edges, and of
// the neighbours along sharp edges.
template <typename T>
struct vertex_ring {
  T face_sum = T{0};
  T edge_sum = T{0};
  T sharp_sum = T{0};
  int faces = 0;
  int edges = 0;
  int sharp = 0;
};

}  // namespace

template <typename T>
quad_mesh<T> subdivide_linear(const quad_mesh<T>& mesh) {
  check_mesh(mesh);
  return split(mesh, find_edges(mesh.quads));
}

template <typename T>
quad_mesh<T> subdivide_catmullclark(const quad_mesh<T>& mesh, bool lock_boundary) {
  check_mesh(mesh);
  edge_list edges = find_edges(mesh.quads);
  quad_mesh<T> result = split(mesh, edges);
  std::size_t vertices = mesh.vertices.size();
  std::size_t first_face = vertices + edges.vertices.size();

  std::vector<vertex_ring<T>> rings(vertices);
  // The sum of the middles of the faces beside each edge.
  std::vector<T> beside(edges.vertices.size(), T{0});
  for (std::size_t f = 0; f < mesh.quads.size(); f++) {
    const T& middle = result.vertices[first_face + f];
    for (int k = 0; k < corners(mesh.quads[f]); k++) {
      auto& ring = rings[static_cast<std::size_t>(mesh.quads[f][k])];
      ring.face_sum += middle;
      ring.faces++;
      beside[static_cast<std::size_t>(edges.of[f][static_cast<std::size_t>(k)])] += middle;
    }
  }

  // Edge points. An edge that does not lie between exactly two faces (a
  // boundary, or three sheets that meet) is sharp: its point is its middle.
  for (std::size_t e = 0; e < edges.vertices.size(); e++) {
    auto [a, b] = std::array<int, 2>{edges.vertices[e].x, edges.vertices[e].y};
    if (a == b) continue;  // a collapsed side of a face
    T middle = result.vertices[vertices + e];
    bool sharp = edges.faces[e] != 2;
    for (auto [from, to] : {std::array<int, 2>{a, b}, std::array<int, 2>{b, a}}) {
      auto& ring = rings[static_cast<std::size_t>(from)];
      ring.edge_sum += middle;
      ring.edges++;
      if (!sharp) continue;
      ring.sharp_sum += mesh.vertices[static_cast<std::size_t>(to)];
      ring.sharp++;
    }
    if (!sharp) result.vertices[vertices + e] = middle * 0.5f + beside[e] * 0.25f;
  }

  // Vertex points: (F + 2 E + (n - 3) V) / n inside, (A + 6 V + B) / 8 on a
  // sharp line. A vertex where more than two sharp edges meet uses the mean of
  // all of them; one where a sharp line ends counts as inside.
  for (std::size_t v = 0; v < vertices; v++) {
    const auto& ring = rings[v];
    const T& old = mesh.vertices[v];
    if (ring.sharp >= 2) {
      if (!lock_boundary)
        result.vertices[v] =
            old * 0.75f + ring.sharp_sum * (0.25f / static_cast<float>(ring.sharp));
    } else if (ring.faces > 0 && ring.edges >= 2) {
      auto n = static_cast<float>(ring.edges);
      result.vertices[v] = (ring.face_sum / static_cast<float>(ring.faces) +
                            ring.edge_sum * (2 / n) + old * (n - 3)) /
                           n;
    }
  }
  return result;
}

template WISP_API quad_mesh<vec2> subdivide_catmullclark(const quad_mesh<vec2>&, bool);
template WISP_API quad_mesh<vec3> subdivide_catmullclark(const quad_mesh<vec3>&, bool);
template WISP_API quad_mesh<vec4> subdivide_catmullclark(const quad_mesh<vec4>&, bool);
template WISP_API quad_mesh<vec2> subdivide_linear(const quad_mesh<vec2>&);
template WISP_API quad_mesh<vec3> subdivide_linear(const quad_mesh<vec3>&);
template WISP_API quad_mesh<vec4> subdivide_linear(const quad_mesh<vec4>&);

}  // namespace wisp
