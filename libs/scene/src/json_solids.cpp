// Solids of a JSON scene: a tree of objects, each with one key that says what the
// node is, becomes a list in which operands come before what they are part of.

#include <fmt/format.h>

#include <map>

#include "json_scene.h"

namespace wisp {

namespace {

struct solid_reader {
  const json_scene_file& file;
  solid_data& solid;

  int read(const json_tree& tree, const std::string& place);

 private:
  int add(solid_node&& node) {
    solid.nodes.push_back(std::move(node));
    return static_cast<int>(solid.nodes.size()) - 1;
  }
  int read_leaf(json_object& object, solid_type type);
  int read_operands(const json_tree& tree, const std::string& place, solid_node&& node);
  int read_of(json_object& object, solid_node&& node);
};

const std::map<std::string, solid_type>& solid_types() {
  static const std::map<std::string, solid_type> types = {
      {"mesh", solid_type::mesh},
      {"sphere", solid_type::sphere},
      {"box", solid_type::box},
      {"rounded_box", solid_type::rounded_box},
      {"torus", solid_type::torus},
      {"capsule", solid_type::capsule},
      {"cylinder", solid_type::cylinder},
      {"cone", solid_type::cone},
      {"plane", solid_type::plane},
      {"ellipsoid", solid_type::ellipsoid},
      {"union", solid_type::unite},
      {"intersection", solid_type::intersection},
      {"difference", solid_type::difference},
      {"smooth_union", solid_type::smooth_union},
      {"smooth_intersection", solid_type::smooth_intersection},
      {"smooth_difference", solid_type::smooth_difference},
      {"transform", solid_type::transform},
      {"offset", solid_type::offset},
      {"complement", solid_type::complement},
  };
  return types;
}

bool is_smooth(solid_type type) {
  return type == solid_type::smooth_union || type == solid_type::smooth_intersection ||
         type == solid_type::smooth_difference;
}

// A number or vector that a node cannot do without.
template <typename T>
void need(json_object& object, const char* key, T& value, const json_range& range = any_number) {
  if (!object.get(key, value, range)) object.fail(key, "is missing");
}

void need_direction(json_object& object, const char* key, dvec3& value) {
  object.get(key, value);
  if (value == dvec3{0, 0, 0}) object.fail(key, "is [0, 0, 0], which is no direction");
}

void need_axis(json_object& object, solid_node& node) {
  need(object, "a", node.a);
  need(object, "b", node.b);
}

int solid_reader::read_leaf(json_object& object, solid_type type) {
  solid_node node;
  node.type = type;
  switch (type) {
    case solid_type::sphere:
      object.get("center", node.a);
      need(object, "radius", node.radius, positive);
      break;
    case solid_type::box:
    case solid_type::rounded_box:
      object.get("center", node.a);
      need(object, "half", node.b, positive);
      if (type == solid_type::rounded_box) need(object, "radius", node.radius, not_negative);
      break;
    case solid_type::torus:
      object.get("center", node.a);
      node.b = {0, 1, 0};
      need_direction(object, "normal", node.b);
      need(object, "major", node.radius, positive);
      need(object, "minor", node.radius2, positive);
      break;
    case solid_type::capsule:
    case solid_type::cylinder:
      need_axis(object, node);
      need(object, "radius", node.radius, positive);
      if (type == solid_type::cylinder && node.a == node.b)
        object.fail("b", "is the same point as \"a\"; a cylinder needs a length");
      break;
    case solid_type::cone:
      need_axis(object, node);
      need(object, "radius_a", node.radius, not_negative);
      need(object, "radius_b", node.radius2, not_negative);
      if (node.a == node.b) object.fail("b", "is the same point as \"a\"; a cone needs a length");
      if (node.radius == 0 && node.radius2 == 0)
        object.fail("radius_b", "is 0 as \"radius_a\" is; one of them must be positive");
      break;
    case solid_type::plane:
      object.get("point", node.a);
      if (!object.has("normal")) object.fail("normal", "is missing");
      need_direction(object, "normal", node.b);
      break;
    default:  // ellipsoid
      object.get("center", node.a);
      need(object, "radii", node.b, positive);
      break;
  }
  return add(std::move(node));
}

int solid_reader::read_operands(const json_tree& tree, const std::string& place,
                                solid_node&& node) {
  if (!tree.is_array() || tree.empty())
    file.context.fail(place, "must be an array of one or more solids");
  for (std::size_t i = 0; i < tree.size(); i++)
    node.operands.push_back(read(tree[i], fmt::format("{}[{}]", place, i)));
  return add(std::move(node));
}

int solid_reader::read_of(json_object& object, solid_node&& node) {
  const json_tree* of = object.find("of");
  if (of == nullptr) object.fail("of", "is missing; it is the solid that this is done to");
  node.operands = {read(*of, object.place_of("of"))};
  return add(std::move(node));
}

int solid_reader::read(const json_tree& tree, const std::string& place) {
  json_object object(file.context, tree, place, "sdf");
  std::vector<std::string> names;
  const std::pair<const std::string, solid_type>* found = nullptr;
  for (const auto& type : solid_types()) {
    names.push_back(type.first);
    if (!tree.contains(type.first)) continue;
    if (found != nullptr)
      object.fail(type.first, fmt::format("is given as well as {}; a node is one of them",
                                          quote_name(found->first)));
    found = &type;
  }
  if (found == nullptr) {
    std::string key;
    for (const auto& [name, value] : tree.items())
      if (key.empty() && name != "blend") key = name;
    file.context.fail(
        place, key.empty()
                   ? "is an empty object; a node is a primitive such as \"sphere\" "
                     "or an operation such as \"union\""
                   : fmt::format("{} is not a solid{}", quote_name(key), suggestion(key, names)));
  }
  const auto& [name, type] = *found;
  const json_tree& value = *object.find(name);
  const std::string at = object.place_of(name);
  solid_node node;
  node.type = type;
  if (is_smooth(type) && !object.get("blend", node.radius, positive))
    object.fail("blend", "is missing; a smooth operation needs the width of its blend");
  object.finish();

  switch (type) {
    case solid_type::mesh:
      get_reference(object, "mesh", file.shapes, node.shape);
      if (node.shape == invalid_id) object.fail("mesh", "must name a shape");
      return add(std::move(node));
    case solid_type::unite:
    case solid_type::intersection:
    case solid_type::difference:
    case solid_type::smooth_union:
    case solid_type::smooth_intersection:
    case solid_type::smooth_difference:
      return read_operands(value, at, std::move(node));
    default:
      break;
  }
  json_object child(file.context, value, at, "sdf." + name);
  int result;
  switch (type) {
    case solid_type::transform: {
      std::vector<double> v;
      if (!child.get("frame", v, 12)) child.fail("frame", "is missing; it is twelve numbers");
      for (int c = 0; c < 4; c++)
        for (int r = 0; r < 3; r++) node.frame[c][r] = v[static_cast<std::size_t>(3 * c + r)];
      if (!is_invertible(frame3(node.frame)))
        child.fail("frame", "its first nine numbers, three axes, must not lie in a plane");
      result = read_of(child, std::move(node));
      break;
    }
    case solid_type::offset:
      need(child, "by", node.radius);
      result = read_of(child, std::move(node));
      break;
    case solid_type::complement:
      result = read_of(child, std::move(node));
      break;
    default:
      result = read_leaf(child, type);
      break;
  }
  child.finish();
  return result;
}

}  // namespace

std::vector<solid_data> read_solids(const json_scene_file& file) {
  std::vector<solid_data> result;
  for (const auto& element : file.solids.elements) {
    json_object object(file.context, *element.tree, element.place, "solids");
    solid_data solid;
    solid.name = element.name;
    object.get("name", solid.name);
    const json_tree* tree = object.find("sdf");
    if (tree == nullptr)
      object.fail("sdf", "is missing; it is the tree that the solid consists of");
    solid_reader{file, solid}.read(*tree, object.place_of("sdf"));
    int display = 0;
    object.get_word("display", display, {{"mesh", 0}, {"trace", 1}});
    solid.display = static_cast<solid_display>(display);
    object.get("resolution", solid.resolution, 8, 2048);
    object.finish();
    result.push_back(std::move(solid));
  }
  return result;
}

void show_solids(const std::vector<json_instance>& instances, scene_data& scene) {
  std::vector<int> shape_of(scene.solids.size(), invalid_id);
  for (std::size_t i = 0; i < instances.size(); i++) {
    if (instances[i].solid == invalid_id) continue;
    int& shape = shape_of[static_cast<std::size_t>(instances[i].solid)];
    if (shape == invalid_id) {
      shape = static_cast<int>(scene.shapes.size());
      shape_data surface;
      surface.name = scene.solids[static_cast<std::size_t>(instances[i].solid)].name;
      surface.solid = instances[i].solid;
      scene.shapes.push_back(std::move(surface));
    }
    scene.instances[i].shape = shape;
  }
}

void check_own_file(const json_scene_file& file, const std::vector<json_shape>& sources,
                    const std::vector<json_subdiv>& subdivs, int shape, const std::string& place,
                    const std::string& user) {
  const json_shape& source = sources[static_cast<std::size_t>(shape)];
  if (source.path.empty())
    file.context.fail(place, fmt::format("the mesh {} has no file", quote_name(source.name)));
  for (const auto& subdiv : subdivs)
    if (subdiv.subdiv.shape == shape)
      file.context.fail(place, fmt::format("the mesh {} is refined by {}; {} needs a mesh "
                                           "that is a file of its own",
                                           quote_name(source.name), subdiv.place, user));
}

std::vector<bool> find_solid_meshes(const json_scene_file& file,
                                    const std::vector<json_shape>& sources,
                                    const std::vector<json_subdiv>& subdivs,
                                    const std::vector<bool>& problems, const scene_data& scene) {
  std::vector<bool> shown(scene.shapes.size(), false), solids(scene.solids.size(), false);
  for (const auto& instance : scene.instances)
    if (instance.shape != invalid_id) shown[static_cast<std::size_t>(instance.shape)] = true;
  for (std::size_t i = 0; i < scene.shapes.size(); i++) {
    if (!shown[i]) continue;
    int solid = i < sources.size() ? sources[i].groom_on.solid : scene.shapes[i].solid;
    if (solid != invalid_id) solids[static_cast<std::size_t>(solid)] = true;
  }
  for (std::size_t i = 0; i < problems.size(); i++)
    if (problems[i] && scene.problems[i].solid != invalid_id)
      solids[static_cast<std::size_t>(scene.problems[i].solid)] = true;
  std::vector<bool> needed(sources.size(), false);
  for (std::size_t i = 0; i < solids.size(); i++) {
    if (!solids[i]) continue;
    for (const solid_node& node : scene.solids[i].nodes) {
      if (node.type != solid_type::mesh) continue;
      check_own_file(file, sources, subdivs, node.shape, file.solids.elements[i].place + ".sdf",
                     "a solid");
      needed[static_cast<std::size_t>(node.shape)] = true;
    }
  }
  return needed;
}

}  // namespace wisp
