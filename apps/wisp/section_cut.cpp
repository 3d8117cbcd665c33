#include "section_cut.h"

#include <array>
#include <cstdint>
#include <unordered_map>

#include "wisp/geometry/mesh.h"

namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// Vertices are made where edges cross the plane, one for each edge.
class face_clipper {
 public:
  face_clipper(const wisp::shape_data& mesh, const wisp::dvec3& point, const wisp::dvec3& normal)
      : mesh_(mesh), kept_(mesh.positions.size(), wisp::invalid_id) {
    heights_.reserve(mesh.positions.size());
    for (const wisp::vec3& p : mesh.positions)
      heights_.push_back(glm::dot(wisp::dvec3(p) - point, normal));
    result_.name = mesh.name;
  }

  void add(const wisp::ivec3& face) {
    std::array<int, 4> corners = {};
    std::size_t count = 0;
    for (int k = 0; k < 3; k++) {
      const int a = face[k], b = face[(k + 1) % 3];
      const bool in_a = heights_[at(a)] <= 0, in_b = heights_[at(b)] <= 0;
      if (in_a) corners[count++] = keep(a);
      if (in_a != in_b) corners[count++] = cross(a, b);
    }
    for (std::size_t k = 2; k < count; k++)
      result_.triangles.push_back({corners[0], corners[k - 1], corners[k]});
  }

  wisp::shape_data finish() { return std::move(result_); }

 private:
  int keep(int vertex) {
    int& index = kept_[at(vertex)];
    if (index == wisp::invalid_id) index = add_vertex(vertex, vertex, 0);
    return index;
  }

  int cross(int a, int b) {
    if (a > b) std::swap(a, b);  // the same from both faces of an edge
    const auto key = static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint64_t>(b);
    const auto [entry, is_new] = crossings_.try_emplace(key, 0);
    const double ha = heights_[at(a)], hb = heights_[at(b)];
    if (is_new) entry->second = add_vertex(a, b, ha / (ha - hb));
    return entry->second;
  }

  int add_vertex(int a, int b, double t) {
    const auto blend = [&](const auto& from, auto& to) {
      using value = typename std::decay_t<decltype(from)>::value_type;
      if (from.empty()) return;
      to.push_back(a == b ? from[at(a)]
                          : value(glm::mix(from[at(a)], from[at(b)], static_cast<float>(t))));
    };
    if (a == b)
      result_.positions.push_back(mesh_.positions[at(a)]);
    else
      result_.positions.emplace_back(
          glm::mix(wisp::dvec3(mesh_.positions[at(a)]), wisp::dvec3(mesh_.positions[at(b)]), t));
    blend(mesh_.normals, result_.normals);
    blend(mesh_.texcoords, result_.texcoords);
    return static_cast<int>(result_.positions.size()) - 1;
  }

  const wisp::shape_data& mesh_;
  std::vector<double> heights_ = {};
  std::vector<int> kept_;
  std::unordered_map<std::uint64_t, int> crossings_ = {};
  wisp::shape_data result_ = {};
};

}  // namespace

wisp::shape_data clip_faces(const wisp::shape_data& mesh, const wisp::dvec3& point,
                            const wisp::dvec3& normal) {
  face_clipper clipper(mesh, point, normal);
  for (const auto& face : mesh.triangles) clipper.add(face);
  for (const auto& face : wisp::quads_to_triangles(mesh.quads)) clipper.add(face);
  return clipper.finish();
}

wisp::shape_data make_sheet(const wisp::section_grid& grid) {
  const wisp::dvec3 right = grid.cell * grid.width * grid.right;
  const wisp::dvec3 down = grid.cell * grid.height * grid.down;
  wisp::shape_data sheet;
  for (const auto& p :
       {grid.corner, grid.corner + down, grid.corner + down + right, grid.corner + right})
    sheet.positions.emplace_back(p);
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  return sheet;
}
