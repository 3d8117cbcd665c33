// The shapes that the problems of a JSON scene need.

#include <fmt/format.h>

#include "json_scene.h"

namespace wisp {

namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// Calls visit(shape, place, what) for each shape that a problem names.
enum struct shape_use { mesh, colors, texture, curve };
template <typename F>
void visit_shapes(const problem_data& problem, const std::string& place, F&& visit) {
  if (problem.shape != invalid_id) visit(problem.shape, place + ".domain", shape_use::mesh);
  const std::pair<const field_data*, const char*> fields[] = {
      {&problem.boundary, ".boundary"}, {&problem.boundary_laplacian, ".boundary_laplacian"}};
  for (const auto& [field, key] : fields)
    if (field->shape != invalid_id)
      visit(field->shape, place + key,
            field->vertex_colors ? shape_use::colors : shape_use::texture);
  for (std::size_t i = 0; i < problem.curve_sources.size(); i++)
    if (problem.curve_sources[i].shape != invalid_id)
      visit(problem.curve_sources[i].shape, fmt::format("{}.curve_sources[{}].shape", place, i),
            shape_use::curve);
  for (std::size_t i = 0; i < problem.mesh_sources.size(); i++)
    visit(problem.mesh_sources[i].shape, fmt::format("{}.mesh_sources[{}].shape", place, i),
          shape_use::mesh);
}

}  // namespace

void find_problem_shapes(const json_scene_file& file, const std::vector<json_shape>& sources,
                         const std::vector<json_subdiv>& subdivs, const std::vector<bool>& problems,
                         const scene_data& scene, std::vector<bool>& meshes,
                         std::vector<bool>& shown) {
  for (std::size_t i = 0; i < problems.size(); i++) {
    if (!problems[i]) continue;
    visit_shapes(scene.problems[i], file.problems.elements[i].place,
                 [&](int shape, const std::string& place, shape_use use) {
                   if (use == shape_use::curve && sources[at(shape)].groom) {
                     shown[at(shape)] = true;
                     return;
                   }
                   check_own_file(file, sources, subdivs, shape, place, "a problem");
                   meshes[at(shape)] = true;
                 });
  }
}

void check_problem_shapes(const json_scene_file& file, const std::vector<bool>& problems,
                          const scene_data& scene) {
  for (std::size_t i = 0; i < problems.size(); i++) {
    if (!problems[i]) continue;
    visit_shapes(
        scene.problems[i], file.problems.elements[i].place,
        [&](int index, const std::string& place, shape_use use) {
          const shape_data& shape = scene.shapes[at(index)];
          const auto fail = [&](const char* what) {
            file.context.fail(place, fmt::format("the shape {} {}", quote_name(shape.name), what));
          };
          if (use == shape_use::curve) {
            if (strand_count(shape) == 0) fail("has no strands or lines");
            return;
          }
          if (shape.triangles.empty() && shape.quads.empty())
            fail("has no faces; it must be a mesh");
          if (use == shape_use::colors && shape.colors.size() != shape.positions.size())
            fail("has no vertex colours; .ply files can hold them");
          if (use == shape_use::texture && shape.texcoords.size() != shape.positions.size())
            fail("has no texture coordinates");
        });
  }
}

}  // namespace wisp
