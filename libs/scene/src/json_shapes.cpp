// Shapes and subdivs of a JSON scene: what the file says, then loading and growing.

#include <fmt/format.h>

#include <exception>
#include <functional>
#include <stdexcept>
#include <system_error>

#include "json_groom.h"
#include "json_scene.h"
#include "wisp/core/parallel.h"
#include "wisp/geometry/subdivide.h"
#include "wisp/scene/io.h"
#include "wisp/scene/solid.h"

namespace wisp {

namespace {

// Of strands and points whose file has no radius, as in Yocto/GL.
constexpr float missing_radius = 0.001f;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

void check_file(const json_context& context, const std::string& place,
                const std::filesystem::path& path) {
  std::error_code code;
  auto status = std::filesystem::status(path, code);
  if (!std::filesystem::exists(status))
    context.fail(place, "there is no file " + quote_name(path.generic_string()));
  if (std::filesystem::is_directory(status))
    context.fail(place, quote_name(path.generic_string()) + " is a folder, not a file");
}

shape_data read_shape_file(json_context& context, const json_shape& source,
                           warning_list& warnings) {
  check_file(context, source.place + ".uri", source.path);
  if (!can_load_shape(source.path))
    context.fail(source.place + ".uri",
                 quote_name(source.path.filename().generic_string()) +
                     " has an ending that is not of a shape; .ply, .obj, .stl, .hair, .tfx, "
                     ".tfxmesh and .pbrt are read");
  shape_data shape = load_shape(source.path, warnings);

  auto warn = [&](const char* key, const std::string& text) {
    warnings.push_back(context.file() + ": " + source.place + "." + key + ": " + text);
  };
  bool strands = strand_count(shape) > 0;
  if (source.basis && !strands)
    warn("basis", "the file holds no strands; ignored");
  else if (source.basis && shape.basis != curve_basis::linear && shape.basis != *source.basis)
    warn("basis", "the file itself says what its curves are, which is something else; ignored");
  else if (source.basis)
    apply_basis(context, source.place + ".basis", *source.basis, shape);
  if (source.profile && !strands)
    warn("profile", "the file holds no strands; ignored");
  else if (source.profile)
    shape.profile = *source.profile;
  if (source.radius && !strands && shape.points.empty())
    warn("radius", "the file holds no strands or points; ignored");
  else if (source.radius)
    apply_radius(*source.radius, shape);
  if ((strands || !shape.points.empty()) && shape.radius.empty())
    shape.radius.assign(shape.positions.size(), missing_radius);
  return shape;
}

// The refined surface of a subdiv without displacement, to grow hair on.
shape_data refine_for_groom(const json_context& context, const json_subdiv& source,
                            const subdiv_data& subdiv, const std::string& groom_place,
                            warning_list& warnings) {
  if (subdiv.displacement != 0 && subdiv.displacement_tex != invalid_id)
    warnings.push_back(context.file() + ": " + groom_place + ".groom.on: hair is rooted on " +
                       source.place + " as it is without its displacement");
  quad_mesh<vec3> mesh{subdiv.quadspos, subdiv.positions};
  for (int level = 0; level < subdiv.subdivisions; level++) {
    if (mesh.quads.size() > 25'000'000)
      context.fail(source.place + ".subdivisions",
                   "makes more than a hundred million faces; use fewer");
    mesh = subdiv.catmullclark ? subdivide_catmullclark(mesh, false) : subdivide_linear(mesh);
  }
  shape_data shape;
  shape.quads = std::move(mesh.quads);
  shape.positions = std::move(mesh.vertices);
  return shape;
}

// The surface of a solid, to grow hair on.
shape_data tesselate_for_groom(const json_context& context, const json_shape& source,
                               const scene_data& scene, const solid_data& solid,
                               warning_list& warnings) {
  try {
    return tesselate_solid(solid, make_sdf(scene, solid, 0, warnings), 0);
  } catch (const std::invalid_argument& error) {
    context.fail(source.place + ".groom.on", error.what());
  }
}

// Runs jobs side by side. Warnings come in the order of the jobs, and of several
// errors the first job's is thrown, so that nothing depends on timing.
void run_jobs(std::size_t count, warning_list& warnings,
              const std::function<void(std::size_t, warning_list&)>& job) {
  std::vector<warning_list> lists(count);
  std::vector<std::exception_ptr> errors(count);
  parallel_for(count, 0, [&](std::size_t i) {
    try {
      job(i, lists[i]);
    } catch (...) {
      errors[i] = std::current_exception();
    }
  });
  for (std::size_t i = 0; i < count; i++) {
    warnings.insert(warnings.end(), lists[i].begin(), lists[i].end());
    if (errors[i]) std::rethrow_exception(errors[i]);
  }
}

}  // namespace

std::vector<json_shape> read_shapes(const json_scene_file& file) {
  std::vector<json_shape> result;
  for (const auto& element : file.shapes.elements) {
    json_object object(file.context, *element.tree, element.place, "shapes");
    json_shape shape;
    shape.name = element.name;
    shape.place = element.place;
    object.get("name", shape.name);
    shape.path = get_path(object, file, "shapes");
    int word = 0;
    if (object.get_word("basis", word,
                        {{"linear", 0},
                         {"bezier", 1},
                         {"bspline", 2},
                         {"catmull_rom", 3},
                         {"catmull-rom", 3},
                         {"catmullrom", 3}}))
      shape.basis = static_cast<curve_basis>(word);
    if (object.get_word("profile", word, {{"flat", 0}, {"round", 1}}))
      shape.profile = static_cast<curve_profile>(word);
    vec2 radius;
    if (object.get_pair("radius", radius, not_negative)) shape.radius = radius;
    if (const json_tree* groom = object.find("groom")) {
      if (!shape.path.empty()) object.fail("groom", "is given as well as \"uri\"; keep one");
      shape.groom =
          read_groom(*groom, object.place_of("groom"), file, shape.radius, shape.groom_on);
      if (shape.basis && shape.basis != curve_basis::bspline)
        object.warn("basis", "a groom consists of B-splines; ignored");
    }
    object.finish();
    result.push_back(std::move(shape));
  }
  return result;
}

std::vector<json_subdiv> read_subdivs(const json_scene_file& file) {
  std::vector<json_subdiv> result;
  std::unordered_map<int, std::string> refined;
  for (const auto& element : file.subdivs.elements) {
    json_object object(file.context, *element.tree, element.place, "subdivs");
    json_subdiv read;
    subdiv_data& subdiv = read.subdiv;
    subdiv.name = element.name;
    read.place = element.place;
    object.get("name", subdiv.name);
    read.path = get_path(object, file, "subdivs");
    get_reference(object, "shape", file.shapes, subdiv.shape);
    object.get("subdivisions", subdiv.subdivisions, 0, 30);
    object.get("catmullcark", subdiv.catmullclark);  // so spelt by some versions of Yocto/GL
    object.get("catmullclark", subdiv.catmullclark);
    object.get("smooth", subdiv.smooth);
    object.get("displacement", subdiv.displacement);
    get_reference(object, "displacement_tex", file.textures, subdiv.displacement_tex);
    object.finish();
    if (read.path.empty()) object.fail("uri", "is missing; a subdiv needs a mesh file");
    if (subdiv.shape == invalid_id)
      object.fail("shape",
                  "is missing; a subdiv needs the index or name of a shape to refine into");
    auto [it, is_new] = refined.try_emplace(subdiv.shape, element.place);
    if (!is_new) object.warn("shape", "is also that of " + it->second + "; the last one counts");
    it->second = element.place;
    result.push_back(std::move(read));
  }
  return result;
}

void load_shapes(const json_scene_file& file, const std::vector<json_shape>& sources,
                 const std::vector<json_subdiv>& subdivs, const std::vector<bool>& problems,
                 scene_data& scene, warning_list& warnings) {
  json_context& context = file.context;
  std::size_t count = sources.size();
  std::vector<int> subdiv_of(count, invalid_id);
  for (std::size_t i = 0; i < subdivs.size(); i++)
    subdiv_of[at(subdivs[i].subdiv.shape)] = static_cast<int>(i);
  std::vector<bool> shown(count, false), grown_on(count, false);
  for (const auto& instance : scene.instances)
    if (instance.shape != invalid_id && at(instance.shape) < count)
      shown[at(instance.shape)] = true;  // others are of solids
  std::vector<bool> meshes = find_solid_meshes(file, sources, subdivs, problems, scene);
  find_problem_shapes(file, sources, subdivs, problems, scene, meshes, shown);
  for (std::size_t i = 0; i < count; i++) {
    if (!shown[i] || !sources[i].groom || subdiv_of[i] != invalid_id) continue;
    if (sources[i].groom_on.solid != invalid_id) continue;
    auto on = at(sources[i].groom_on.shape);
    if (sources[on].groom)
      context.fail(sources[i].place + ".groom.on",
                   on == i ? "is the groom itself; name a mesh"
                           : "is a groom itself; hair grows on meshes and solids only");
    grown_on[on] = true;
  }

  // Meshes of subdivs, then shapes from files, then grooms.
  run_jobs(subdivs.size(), warnings, [&](std::size_t i, warning_list& list) {
    subdiv_data& subdiv = scene.subdivs[i];
    auto shape = at(subdiv.shape);
    if (subdiv_of[shape] != static_cast<int>(i) || (!shown[shape] && !grown_on[shape])) return;
    check_file(context, subdivs[i].place + ".uri", subdivs[i].path);
    subdiv_data mesh = load_subdiv_mesh(subdivs[i].path, list);
    subdiv.quadspos = std::move(mesh.quadspos);
    subdiv.quadsnorm = std::move(mesh.quadsnorm);
    subdiv.quadstexcoord = std::move(mesh.quadstexcoord);
    subdiv.positions = std::move(mesh.positions);
    subdiv.normals = std::move(mesh.normals);
    subdiv.texcoords = std::move(mesh.texcoords);
  });
  for (std::size_t i = 0; i < count; i++) {
    scene.shapes[i].name = sources[i].name;
    if ((shown[i] || grown_on[i]) && subdiv_of[i] == invalid_id && !sources[i].groom &&
        sources[i].path.empty())
      context.fail(sources[i].place,
                   "has neither \"uri\" nor \"groom\"; a shape needs one of them");
  }
  run_jobs(count, warnings, [&](std::size_t i, warning_list& list) {
    if (!shown[i] && !grown_on[i] && !meshes[i]) return;
    if (sources[i].groom || subdiv_of[i] != invalid_id) return;
    scene.shapes[i] = read_shape_file(context, sources[i], list);
    scene.shapes[i].name = sources[i].name;
  });
  // surfaces of subdivs and of solids that hair grows on
  std::unordered_map<int, shape_data> refined, surfaces;
  for (std::size_t i = 0; i < count; i++) {
    if (!shown[i] || !sources[i].groom || subdiv_of[i] != invalid_id) continue;
    const groom_ground& on = sources[i].groom_on;
    if (on.solid != invalid_id) {
      if (!surfaces.contains(on.solid))
        surfaces[on.solid] =
            tesselate_for_groom(context, sources[i], scene, scene.solids[at(on.solid)], warnings);
      scene.shapes[i] = grow_shape(context, sources[i], surfaces[on.solid]);
    } else {
      int subdiv = subdiv_of[at(on.shape)];
      if (subdiv != invalid_id && !refined.contains(on.shape))
        refined[on.shape] = refine_for_groom(context, subdivs[at(subdiv)],
                                             scene.subdivs[at(subdiv)], sources[i].place, warnings);
      scene.shapes[i] =
          grow_shape(context, sources[i],
                     subdiv != invalid_id ? refined[on.shape] : scene.shapes[at(on.shape)]);
    }
    scene.shapes[i].name = sources[i].name;
    if (sources[i].profile) scene.shapes[i].profile = *sources[i].profile;
  }
  for (std::size_t i = 0; i < count; i++)  // wanted for their hair alone
    if (!shown[i] && !meshes[i] && grown_on[i]) {
      scene.shapes[i] = {};
      scene.shapes[i].name = sources[i].name;
    }
}

}  // namespace wisp
