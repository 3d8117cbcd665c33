#pragma once

// The parts of the reader of JSON scenes, docs/scene-format.md. Each reads one
// group of the file; json_scene.cpp puts them together.

#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "json_reader.h"
#include "wisp/scene/groom.h"
#include "wisp/scene/scene.h"

namespace wisp {

struct json_element {
  const json_tree* tree = nullptr;
  std::string place = "";  // "materials[3]"
  std::string name = "";
};

// A group such as "materials": an array of objects, or (version 4.1) an object
// of objects by name.
struct json_group {
  std::string key = "";
  std::vector<json_element> elements = {};
  std::unordered_map<std::string, int> by_name = {};  // the first of each name
};

struct json_scene_file {
  json_context& context;
  std::filesystem::path folder;
  json_group cameras, textures, materials, shapes, subdivs, instances, environments, lights, solids,
      problems, sections;
};

// The index of an element of a group, given by number or by name; -1 and ""
// mean none. False when the key is absent.
bool get_reference(json_object& object, const char* key, const json_group& group, int& value);

// The path that "uri" gives, relative to the scene's folder, or "datafile",
// relative to `subfolder` in it; empty when there is neither.
std::filesystem::path get_path(json_object& object, const json_scene_file& file,
                               const char* subfolder);

// "frame" or "lookat". Returns false when both are absent; *distance becomes
// that from eye to centre of a lookat.
bool get_frame(json_object& object, frame3& frame, std::optional<float>* distance = nullptr);
// True when the axes of a frame span space, so that it can be inverted.
bool is_invertible(const frame3& frame);

std::vector<camera_data> read_cameras(const json_scene_file& file);
std::vector<texture_data> read_textures(const json_scene_file& file);
std::vector<environment_data> read_environments(const json_scene_file& file);
std::vector<light_data> read_lights(const json_scene_file& file);
std::vector<solid_data> read_solids(const json_scene_file& file);
std::vector<material_data> read_materials(const json_scene_file& file);

// By whose names a hair material is given: wisp's and pbrt's, Cycles', MaterialX'.
enum struct hair_kind { own, principled, chiang };
// The keys of a hair material that other types do not have.
void read_hair(json_object& object, const json_scene_file& file, hair_kind kind,
               material_data& material);

struct json_instance {
  instance_data instance = {};
  int solid = invalid_id;  // in place of a shape
  std::string place = "";
};
std::vector<json_instance> read_instances(const json_scene_file& file);

struct json_subdiv {
  subdiv_data subdiv = {};  // without its mesh
  std::filesystem::path path = "";
  std::string place = "";
};
std::vector<json_subdiv> read_subdivs(const json_scene_file& file);

// What hair grows on: a shape, or a solid.
struct groom_ground {
  int shape = invalid_id;
  int solid = invalid_id;
};

// What the file says about a shape, before anything is loaded.
struct json_shape {
  std::string name = "";
  std::string place = "";
  std::filesystem::path path = "";
  std::optional<curve_basis> basis = {};
  std::optional<curve_profile> profile = {};
  std::optional<vec2> radius = {};
  std::optional<groom_params> groom = {};
  groom_ground groom_on = {};
};
std::vector<json_shape> read_shapes(const json_scene_file& file);

// Loads and grows the shapes that `instances` need and the meshes of the
// subdivs that refine them; the other shapes stay empty but for their names.
// `problems` says for each problem whether its shapes are needed, too.
void load_shapes(const json_scene_file& file, const std::vector<json_shape>& sources,
                 const std::vector<json_subdiv>& subdivs, const std::vector<bool>& problems,
                 scene_data& scene, warning_list& warnings);

// Gives a shape of its own to each solid that `instances` show.
void show_solids(const std::vector<json_instance>& instances, scene_data& scene);
// Fails for a shape that is not a file of its own, which `user` needs it to be.
void check_own_file(const json_scene_file& file, const std::vector<json_shape>& sources,
                    const std::vector<json_subdiv>& subdivs, int shape, const std::string& place,
                    const std::string& user);
// Which shapes the solids that are shown, grown on or the domains of problems consist
// of. Fails for those that have no mesh file.
std::vector<bool> find_solid_meshes(const json_scene_file& file,
                                    const std::vector<json_shape>& sources,
                                    const std::vector<json_subdiv>& subdivs,
                                    const std::vector<bool>& problems, const scene_data& scene);

// Reads "problems", with formulas compiled to check them. `scene` has its solids.
std::vector<problem_data> read_problems(const json_scene_file& file, const scene_data& scene);
std::vector<section_data> read_sections(const json_scene_file& file);
// Adds the shapes that problems name themselves: to `meshes` what must be a mesh in a
// file, to `shown` what may also be grown.
void find_problem_shapes(const json_scene_file& file, const std::vector<json_shape>& sources,
                         const std::vector<json_subdiv>& subdivs, const std::vector<bool>& problems,
                         const scene_data& scene, std::vector<bool>& meshes,
                         std::vector<bool>& shown);
// Fails where a shape lacks what a problem asks of it: faces, strands, colours, texture
// coordinates.
void check_problem_shapes(const json_scene_file& file, const std::vector<bool>& problems,
                          const scene_data& scene);

// Turns points on curves into control points of `basis` that give curves from
// the first to the last point: B-splines and Catmull-Rom splines get a phantom
// point at each end. Throws file_error at `place` when a strand cannot be read
// so (Bezier curves need 3 n + 1 points).
void apply_basis(const json_context& context, const std::string& place, curve_basis basis,
                 shape_data& shape);
// Sets radii from root to tip, linear in the curve's parameter; points get the
// first.
void apply_radius(const vec2& radius, shape_data& shape);

}  // namespace wisp
