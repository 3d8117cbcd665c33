// Problems and sections of a JSON scene.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "json_scene.h"
#include "wisp/scene/formula.h"

namespace wisp {

namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// The only mesh that the domain consists of, or none.
int domain_mesh(const scene_data& scene, const problem_data& problem) {
  if (problem.solid == invalid_id) return problem.shape;
  int found = invalid_id;
  for (const solid_node& node : scene.solids[at(problem.solid)].nodes) {
    if (node.type != solid_type::mesh || node.shape == found) continue;
    if (found != invalid_id) return invalid_id;
    found = node.shape;
  }
  return found;
}

class problem_reader {
 public:
  problem_reader(const json_scene_file& file, const scene_data& scene, json_object& object)
      : file_(file), scene_(scene), object_(object) {}

  problem_data read(const std::string& name);

 private:
  void read_domain();
  void read_equation();
  void read_sources();
  void read_infinity();

  bool read_field(const char* key, bool on_surface, field_data& field);
  void read_formula(const json_tree& tree, const std::string& place, field_data& field);
  void read_surface(const json_tree& tree, const std::string& place, field_data& field);
  void read_vector(json_object& object, const char* key, dvec4& value);
  void read_list(const char* key, const std::function<void(json_object&)>& read);
  void count_channels(std::size_t count, const std::string& place);

  const json_scene_file& file_;
  const scene_data& scene_;
  json_object& object_;
  problem_data problem_ = {};
  std::string channels_place_ = "";  // what has as many channels as the problem
};

// One channel serves as many as there are; other counts must agree.
void problem_reader::count_channels(std::size_t count, const std::string& place) {
  const auto channels = static_cast<int>(count);
  if (channels == 1 || channels == problem_.channels) return;
  if (problem_.channels != 1)
    file_.context.fail(place, fmt::format("has {} channels, but {} has {}; all of a problem must "
                                          "have as many, or 1",
                                          channels, channels_place_, problem_.channels));
  problem_.channels = channels;
  channels_place_ = place;
}

void problem_reader::read_formula(const json_tree& tree, const std::string& place,
                                  field_data& field) {
  if (!tree.is_string() && !tree.is_number())
    file_.context.fail(place, "must be a formula in x, y and z, such as \"sin(20*y) > 0\"");
  const std::string text =
      tree.is_string() ? tree.get_ref<const std::string&>() : std::string(tree.dump());
  try {
    const formula compiled(text);
    if (compiled.constant() && !std::isfinite(compiled({0, 0, 0})))
      file_.context.fail(
          place, fmt::format("{} is {}, which no problem can have", quote_name(text),
                             std::isnan(compiled({0, 0, 0})) ? "not a number" : "infinite"));
  } catch (const formula_error& error) {
    file_.context.fail(place, error.what());
  }
  field.formulas.push_back(text);
}

void problem_reader::read_surface(const json_tree& tree, const std::string& place,
                                  field_data& field) {
  json_object object(file_.context, tree, place, "field");
  const json_tree* colors = object.find("vertex_colors");
  if (colors != nullptr) {
    if (object.has("texture")) object.fail("texture", "is given as well as \"vertex_colors\"");
    field.vertex_colors = true;
    if (colors->is_boolean() && !colors->get<bool>())
      object.fail("vertex_colors", "must be true, or the name of a shape");
    if (!colors->is_boolean()) get_reference(object, "vertex_colors", file_.shapes, field.shape);
  } else if (object.has("texture")) {
    get_reference(object, "texture", file_.textures, field.texture);
    if (field.texture == invalid_id) object.fail("texture", "must name a texture");
    get_reference(object, "shape", file_.shapes, field.shape);
  } else {
    file_.context.fail(place,
                       "must be a formula, an array of them, {\"vertex_colors\": true} or "
                       "{\"texture\": name}");
  }
  object.finish();
  if (field.shape == invalid_id) field.shape = domain_mesh(scene_, problem_);
  if (field.shape == invalid_id)
    object.fail(field.vertex_colors ? "vertex_colors" : "shape",
                "must name the shape that is meant, as the domain is not one mesh");
  count_channels(3, place);
}

// An empty formula is none.
bool problem_reader::read_field(const char* key, bool on_surface, field_data& field) {
  const json_tree* tree = object_.find(key);
  if (tree == nullptr) return false;
  if (tree->is_string() && tree->get_ref<const std::string&>().empty()) return false;
  if (tree->is_object()) {
    if (!on_surface)
      object_.fail(key, "must be a formula; only what is on the boundary can come from a mesh");
    read_surface(*tree, object_.place_of(key), field);
  } else if (tree->is_array()) {
    if (tree->empty() || tree->size() > 4)
      object_.fail(key, fmt::format("is an array of {}; there are one to four channels, each with "
                                    "a formula",
                                    tree->size()));
    for (std::size_t i = 0; i < tree->size(); i++)
      read_formula((*tree)[i], fmt::format("{}[{}]", object_.place_of(key), i), field);
    count_channels(tree->size(), object_.place_of(key));
  } else {
    read_formula(*tree, object_.place_of(key), field);
  }
  return true;
}

// A number for all channels, or one for each.
void problem_reader::read_vector(json_object& object, const char* key, dvec4& value) {
  const json_tree* tree = object.find(key);
  if (tree == nullptr) return;
  if (tree->is_array() && tree->size() >= 2 && tree->size() <= 4) {
    std::vector<double> v;
    object.get(key, v, tree->size());
    count_channels(v.size(), object.place_of(key));
    value = {0, 0, 0, 0};
    for (std::size_t i = 0; i < v.size(); i++) value[static_cast<int>(i)] = v[i];
  } else if (tree->is_array()) {
    object.fail(key, "must be a number, or an array of two to four, one for each channel");
  } else {
    double v = 0;
    object.get(key, v);
    value = dvec4{v};
  }
}

void problem_reader::read_list(const char* key, const std::function<void(json_object&)>& read) {
  const json_tree* tree = object_.find(key);
  if (tree == nullptr) return;
  if (!tree->is_array()) object_.fail(key, "must be an array of objects");
  for (std::size_t i = 0; i < tree->size(); i++) {
    json_object child(file_.context, (*tree)[i], fmt::format("{}[{}]", object_.place_of(key), i),
                      std::string("problems.") + key);
    read(child);
    child.finish();
  }
}

// A name is that of a solid, or else of a shape; a number is the index of a solid.
void problem_reader::read_domain() {
  const json_tree* tree = object_.find("domain");
  if (tree == nullptr)
    object_.fail("domain", "is missing; a problem needs the name of a solid or of a mesh");
  if (tree->is_string() && !tree->get_ref<const std::string&>().empty()) {
    const auto& name = tree->get_ref<const std::string&>();
    if (file_.solids.by_name.count(name) == 0) {
      if (auto it = file_.shapes.by_name.find(name); it != file_.shapes.by_name.end()) {
        problem_.shape = it->second;
        return;
      }
      std::vector<std::string> names;
      for (const auto* group : {&file_.solids, &file_.shapes})
        for (const auto& [known, index] : group->by_name)
          if (names.size() < 1000) names.push_back(known);
      std::sort(names.begin(), names.end());
      object_.fail("domain", fmt::format("there is nothing called {} in \"solids\" or \"shapes\"{}",
                                         quote_name(name), suggestion(name, names)));
    }
  }
  get_reference(object_, "domain", file_.solids, problem_.solid);
  if (problem_.solid == invalid_id) object_.fail("domain", "must name a solid or a mesh");
}

void problem_reader::read_equation() {
  int word = 0;
  object_.get_word("side", word, {{"interior", 0}, {"exterior", 1}});
  problem_.exterior = word == 1;
  word = 0;
  object_.get_word("equation", word,
                   {{"laplace", 0}, {"poisson", 1}, {"screened_poisson", 2}, {"biharmonic", 3}});
  problem_.equation = static_cast<problem_equation>(word);
  const bool screened = problem_.equation == problem_equation::screened_poisson;
  if (!screened && object_.has("screening"))
    object_.fail("screening", "belongs to the equation \"screened_poisson\"");
  if (screened && !object_.get("screening", problem_.screening, not_negative))
    object_.fail("screening", "is missing; it is the c >= 0 of lap u - c u = f");
  const bool biharmonic = problem_.equation == problem_equation::biharmonic;
  if (biharmonic && problem_.exterior)
    object_.fail("side", "must be \"interior\" for the biharmonic equation");

  if (!read_field("boundary", true, problem_.boundary))
    object_.fail("boundary",
                 "is missing; a problem needs u on the boundary, as a formula in x, y and z "
                 "(\"sin(20*y) > 0\"), {\"vertex_colors\": true} or {\"texture\": name}");
  const bool has_laplacian = read_field("boundary_laplacian", true, problem_.boundary_laplacian);
  if (biharmonic && !has_laplacian)
    object_.fail("boundary_laplacian",
                 "is missing; the biharmonic equation needs lap u on the boundary, which may be 0");
  if (!biharmonic && has_laplacian)
    object_.fail("boundary_laplacian", "belongs to the equation \"biharmonic\"");
  read_field("exact", false, problem_.exact);
}

void problem_reader::read_sources() {
  read_field("source", false, problem_.source);
  const auto strength = [&](json_object& child, dvec4& value) {
    value = dvec4{1};
    read_vector(child, "strength", value);
  };
  read_list("point_sources", [&](json_object& child) {
    point_source_data source;
    if (!child.get("position", source.position)) child.fail("position", "is missing");
    strength(child, source.strength);
    problem_.point_sources.push_back(source);
  });
  read_list("curve_sources", [&](json_object& child) {
    curve_source_data source;
    const json_tree* points = child.find("points");
    get_reference(child, "shape", file_.shapes, source.shape);
    if ((points != nullptr) == (source.shape != invalid_id))
      child.fail("points", points == nullptr
                               ? "is missing; a curve is given by points, or by a \"shape\" of "
                                 "strands"
                               : "is given as well as \"shape\"; keep one");
    if (points != nullptr) {
      if (!points->is_array() || points->size() < 2)
        child.fail("points", "must be an array of two or more points, each of three numbers");
      for (std::size_t i = 0; i < points->size(); i++) {
        // as a value of its own, for its place in errors
        json_tree wrapped = json_tree::object();
        const std::string key = fmt::format("points[{}]", i);
        wrapped[key] = (*points)[i];
        dvec3 point;
        json_object(file_.context, wrapped, child.place(), "points").get(key, point);
        source.points.push_back(point);
      }
    }
    strength(child, source.strength);
    problem_.curve_sources.push_back(std::move(source));
  });
  read_list("mesh_sources", [&](json_object& child) {
    mesh_source_data source;
    get_reference(child, "shape", file_.shapes, source.shape);
    if (source.shape == invalid_id) child.fail("shape", "is missing; it is a mesh");
    strength(child, source.strength);
    problem_.mesh_sources.push_back(source);
  });
  read_list("source_peaks", [&](json_object& child) {
    source_peak_data peak;
    if (!child.get("center", peak.center)) child.fail("center", "is missing");
    if (!child.get("radius", peak.radius, positive)) child.fail("radius", "is missing");
    child.get("weight", peak.weight, positive);
    problem_.source_peaks.push_back(peak);
  });
  if (problem_.equation == problem_equation::poisson ||
      problem_.equation == problem_equation::screened_poisson)
    return;
  const std::pair<const char*, bool> given[] = {{"source", is_given(problem_.source)},
                                                {"point_sources", !problem_.point_sources.empty()},
                                                {"curve_sources", !problem_.curve_sources.empty()},
                                                {"mesh_sources", !problem_.mesh_sources.empty()},
                                                {"source_peaks", !problem_.source_peaks.empty()}};
  for (const auto& [key, is] : given)
    if (is)
      object_.fail(key,
                   "is given, but the equation has no sources; those that have are "
                   "\"poisson\" and \"screened_poisson\"");
}

void problem_reader::read_infinity() {
  if (!problem_.exterior) {
    object_.ignore({"infinity"}, "only exterior problems reach infinity; ignored");
    return;
  }
  read_vector(object_, "infinity", problem_.infinity);
  if (problem_.screening > 0 && problem_.infinity != dvec4{0, 0, 0, 0})
    object_.fail("infinity", "must be 0 where the screening is positive: u tends to nothing else");
}

problem_data problem_reader::read(const std::string& name) {
  problem_.name = name;
  object_.get("name", problem_.name);
  read_domain();
  read_equation();
  read_sources();
  read_infinity();
  object_.get("epsilon", problem_.epsilon, positive);
  object_.get("walks", problem_.walks, 1, 2147483647);
  object_.get("max_steps", problem_.max_steps, 1, 2147483647);
  object_.finish();
  const auto cut = [&](dvec4& v) {
    for (int i = problem_.channels; i < 4; i++) v[i] = 0;
  };
  for (auto& source : problem_.point_sources) cut(source.strength);
  for (auto& source : problem_.curve_sources) cut(source.strength);
  for (auto& source : problem_.mesh_sources) cut(source.strength);
  cut(problem_.infinity);
  return std::move(problem_);
}

void read_plane(json_object& object, section_data& section) {
  object.get("origin", section.origin);
  object.get("normal", section.normal);
  const double normal = glm::length(section.normal);
  if (!(normal > 0)) object.fail("normal", "is [0, 0, 0], which is no direction");
  if (object.get("up", section.up)) {
    const double up = glm::length(section.up);
    if (!(up > 0)) object.fail("up", "is [0, 0, 0], which is no direction");
    if (!(glm::length(glm::cross(section.up / up, section.normal / normal)) > 1e-6))
      object.fail("up", "is along the normal; it must lie across it");
  }
  if (const json_tree* size = object.find("size")) {
    double v = 0;
    std::vector<double> both;
    if (size->is_number()) {
      object.get("size", v, positive);
      section.size = dvec2{v};
    } else {
      object.get("size", both, 2);
      section.size = {both[0], both[1]};
      if (!(both[0] > 0 && both[1] > 0)) object.fail("size", "must be two positive numbers");
    }
  }
}

void warn_of_name(const json_object& object, const json_group& group, std::size_t index) {
  const auto found = group.by_name.find(group.elements[index].name);
  if (found == group.by_name.end() || at(found->second) == index) return;
  object.warn("name",
              fmt::format("{} is the name of {} too, which is the one that it means",
                          quote_name(found->first), group.elements[at(found->second)].place));
}

}  // namespace

std::vector<problem_data> read_problems(const json_scene_file& file, const scene_data& scene) {
  std::vector<problem_data> result;
  for (const auto& element : file.problems.elements) {
    json_object object(file.context, *element.tree, element.place, "problems");
    warn_of_name(object, file.problems, result.size());
    result.push_back(problem_reader(file, scene, object).read(element.name));
  }
  return result;
}

std::vector<section_data> read_sections(const json_scene_file& file) {
  std::vector<section_data> result;
  for (const auto& element : file.sections.elements) {
    json_object object(file.context, *element.tree, element.place, "sections");
    warn_of_name(object, file.sections, result.size());
    section_data section;
    section.name = element.name;
    object.get("name", section.name);
    get_reference(object, "problem", file.problems, section.problem);
    if (section.problem == invalid_id)
      object.fail("problem", "is missing; a section needs the index or name of a problem");
    read_plane(object, section);
    object.get("resolution", section.resolution, 2, 16384);
    int word = 0;
    object.get_word("colormap", word,
                    {{"viridis", 0},
                     {"coolwarm", 1},
                     {"magma", 2},
                     {"plasma", 3},
                     {"inferno", 4},
                     {"cividis", 5},
                     {"turbo", 6},
                     {"gray", 7},
                     {"grey", 7}});
    section.colormap = static_cast<section_colors>(word);
    std::vector<double> range;
    if (object.get("range", range, 2)) {
      if (!(range[0] < range[1]))
        object.fail("range", "must be two numbers, the smaller one first");
      section.range = dvec2{range[0], range[1]};
    }
    object.get("contours", section.contours, 0, 1000);
    object.get("lit", section.lit);
    object.finish();
    result.push_back(std::move(section));
  }
  return result;
}

}  // namespace wisp
