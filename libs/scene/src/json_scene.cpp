// Scenes in JSON: Yocto/GL's format (https://github.com/xelatihy/yocto-gl, asset
// versions 4.1, 4.2 and 5.0) and the additions of docs/scene-format.md.

#include "json_scene.h"

#include <fmt/format.h>

#include <algorithm>

#include "wisp/scene/io.h"

namespace wisp {

namespace {

const std::vector<std::string> supported_versions = {"4.1", "4.2", "5.0"};

// Checks that the file is a scene of a version that this reader knows.
void read_asset(json_object& root, scene_data& scene) {
  json_context& context = root.context();
  if (root.has("accessors") || root.has("bufferViews") || root.has("nodes"))
    context.fail("", "looks like a glTF scene; give it the ending .gltf");
  if (root.has("objects"))
    root.fail("objects",
              "belongs to Yocto/GL's format before 4.1, which is not supported; Yocto/GL can save "
              "it in the current one");
  const json_tree* tree = root.find("asset");
  if (tree == nullptr) return;
  json_object asset(context, *tree, "asset", "asset");
  asset.get("copyright", scene.copyright);
  std::string generator;
  asset.get("generator", generator);
  if (asset.has("version")) {
    std::string version;
    asset.get("version", version);
    if (version.starts_with("2."))
      asset.fail("version", "is that of glTF; give the file the ending .gltf");
    if (version == "4.0")
      asset.fail("version",
                 "4.0 is not supported; 4.1, 4.2 and 5.0 are (Yocto/GL can save it anew)");
    if (std::find(supported_versions.begin(), supported_versions.end(), version) ==
        supported_versions.end())
      asset.warn("version", "is " + quote_name(version) +
                                "; the file is read as 5.0, the newest version known");
  }
  asset.finish();
}

// Texts in place of objects, as 4.1 allows, become objects with a "datafile".
json_group read_group(json_object& root, const char* key, std::deque<json_tree>& storage) {
  json_group group;
  group.key = key;
  const json_tree* tree = root.find(key);
  if (tree == nullptr) return group;
  if (!tree->is_array() && !tree->is_object()) root.fail(key, "must be an array of objects");
  if (tree->size() > 100'000'000) root.fail(key, "has more than a hundred million elements");
  group.elements.reserve(tree->size());
  if (tree->is_array()) {
    for (std::size_t i = 0; i < tree->size(); i++) {
      json_element element{&(*tree)[i], fmt::format("{}[{}]", key, i), ""};
      if (element.tree->is_object())
        if (auto name = element.tree->find("name");
            name != element.tree->end() && name->is_string())
          element.name = name->get<std::string>();
      group.elements.push_back(std::move(element));
    }
  } else {
    for (const auto& [name, value] : tree->items()) {
      const json_tree* element = &value;
      if (value.is_string()) {
        json_tree object = json_tree::object();
        object["datafile"] = value;
        storage.push_back(std::move(object));
        element = &storage.back();
      }
      group.elements.push_back({element, fmt::format("{}[{}]", key, quote_name(name)), name});
    }
  }
  for (std::size_t i = 0; i < group.elements.size(); i++)
    if (!group.elements[i].name.empty())
      group.by_name.try_emplace(group.elements[i].name, static_cast<int>(i));
  return group;
}

// The problems whose shapes are needed: the one that is solved, or those of the sections
// that instances show.
std::vector<bool> find_problems(const json_context& context, const scene_load_options& options,
                                const scene_data& scene) {
  std::vector<bool> needed(scene.problems.size(), false);
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  if (options.choose_problem) {
    const int chosen = options.choose_problem(scene);
    if (chosen < 0 || at(chosen) >= needed.size())
      context.fail("problems", fmt::format("there is no problem {}", chosen));
    needed[at(chosen)] = true;
  }
  for (const auto& instance : scene.instances)
    if (instance.section != invalid_id)
      needed[at(scene.sections[at(instance.section)].problem)] = true;
  return needed;
}

// A hair material scatters light along strands only. Faces that have one get a
// matte material of its colour.
void replace_hair_on_faces(json_context& context, const std::vector<json_instance>& places,
                           scene_data& scene) {
  std::unordered_map<int, int> matte;  // hair material to its replacement
  for (std::size_t i = 0; i < scene.instances.size(); i++) {
    instance_data& instance = scene.instances[i];
    if (instance.section != invalid_id) continue;
    const auto& shape = scene.shapes[static_cast<std::size_t>(instance.shape)];
    material_data material = scene.materials[static_cast<std::size_t>(instance.material)];
    if (material.type != material_type::hair || strand_count(shape) > 0) continue;
    auto [it, is_new] =
        matte.try_emplace(instance.material, static_cast<int>(scene.materials.size()));
    if (is_new) {
      context.warn(
          places[i].place + ".material",
          fmt::format("the shape {} has no strands, and {} is a hair material; it is "
                      "rendered as matte {}",
                      quote_name(shape.name), quote_name(material.name),
                      material.hair.color ? "of its color" : "grey (it has no \"color\")"));
      material.type = material_type::matte;
      material.color = material.hair.color.value_or(vec3{0.5f, 0.5f, 0.5f});
      scene.materials.push_back(std::move(material));
    }
    instance.material = it->second;
  }
}

}  // namespace

bool get_reference(json_object& object, const char* key, const json_group& group, int& value) {
  const json_tree* tree = object.find(key);
  if (tree == nullptr) return false;
  auto count = static_cast<int>(group.elements.size());
  if (tree->is_string()) {
    const auto& name = tree->get_ref<const std::string&>();
    if (name.empty()) {
      value = invalid_id;
      return true;
    }
    auto it = group.by_name.find(name);
    if (it == group.by_name.end()) {
      std::vector<std::string> names;
      for (const auto& [known, index] : group.by_name)
        if (names.size() < 1000) names.push_back(known);
      std::sort(names.begin(), names.end());
      object.fail(key, fmt::format("there is nothing called {} in \"{}\"{}", quote_name(name),
                                   group.key, suggestion(name, names)));
    }
    value = it->second;
    return true;
  }
  if (!tree->is_number())
    object.fail(key,
                fmt::format("must be the index or the name of an element of \"{}\"", group.key));
  double number = tree->get<double>();
  if (number == invalid_id) {
    value = invalid_id;
    return true;
  }
  if (!(number >= 0 && number < count) || number != static_cast<int>(number))
    object.fail(
        key, count == 0 ? fmt::format("is {}, but the scene has no \"{}\"", tree->dump(), group.key)
                        : fmt::format("is {}; the scene has {} \"{}\", so it must be from "
                                      "0 to {}",
                                      tree->dump(), count, group.key, count - 1));
  value = static_cast<int>(number);
  return true;
}

std::filesystem::path get_path(json_object& object, const json_scene_file& file,
                               const char* subfolder) {
  std::string uri, datafile;
  bool has_uri = object.get("uri", uri);
  bool has_datafile = object.get("datafile", datafile);
  if (has_uri && has_datafile) object.fail("datafile", "is given as well as \"uri\"; keep one");
  if (uri.empty() && datafile.empty()) return {};
  const std::string& text = has_uri ? uri : datafile;
  const char* key = has_uri ? "uri" : "datafile";
  if (text.find('\0') != std::string::npos) object.fail(key, "holds a zero byte");
  if (text.size() > 4096) object.fail(key, "is longer than a path can be");
  std::filesystem::path path(std::u8string(text.begin(), text.end()));
  return has_uri ? file.folder / path : file.folder / subfolder / path;
}

std::vector<json_instance> read_instances(const json_scene_file& file) {
  std::vector<json_instance> result;
  for (const auto& element : file.instances.elements) {
    json_object object(file.context, *element.tree, element.place, "instances");
    json_instance read;
    read.place = element.place;
    read.instance.name = element.name;
    object.get("name", read.instance.name);
    get_frame(object, read.instance.frame);
    get_reference(object, "section", file.sections, read.instance.section);
    get_reference(object, "shape", file.shapes, read.instance.shape);
    get_reference(object, "solid", file.solids, read.solid);
    get_reference(object, "material", file.materials, read.instance.material);
    object.finish();
    if (read.solid != invalid_id && read.instance.shape != invalid_id)
      object.fail("solid", "is given as well as \"shape\"; keep one");
    bool is_section = read.instance.section != invalid_id;
    if (is_section && (read.solid != invalid_id || read.instance.shape != invalid_id))
      object.fail("section", "is given as well as a shape or solid; keep one");
    if (!is_section && read.solid == invalid_id && read.instance.shape == invalid_id)
      object.fail("shape",
                  "is missing; an instance needs the index or name of a shape, solid or section");
    if (!is_section && read.instance.material == invalid_id)
      object.fail("material", "is missing; an instance needs the index or name of a material");
    if (!is_invertible(read.instance.frame)) {
      object.warn("frame", "flattens or shrinks the shape to nothing; the instance is left out");
      continue;
    }
    result.push_back(std::move(read));
  }
  return result;
}

scene_data load_json_scene(const std::filesystem::path& path, warning_list& warnings,
                           const scene_load_options& options) {
  json_tree tree = read_json_file(path);
  json_context context(path.string(), warnings);
  json_object root(context, tree, "", "scene");
  scene_data scene;
  scene.path = path;
  read_asset(root, scene);

  std::deque<json_tree> storage;
  auto group = [&](const char* key) { return read_group(root, key, storage); };
  json_scene_file file{context,           path.parent_path(), group("cameras"),
                       group("textures"), group("materials"), group("shapes"),
                       group("subdivs"),  group("instances"), group("environments"),
                       group("lights"),   group("solids"),    group("problems"),
                       group("sections")};
  root.finish();

  scene.cameras = read_cameras(file);
  scene.textures = read_textures(file);
  scene.materials = read_materials(file);
  scene.environments = read_environments(file);
  scene.lights = read_lights(file);
  scene.solids = read_solids(file);
  scene.problems = read_problems(file, scene);
  scene.sections = read_sections(file);
  std::vector<json_shape> shapes = read_shapes(file);
  std::vector<json_subdiv> subdivs = read_subdivs(file);
  std::vector<json_instance> instances = read_instances(file);
  context.report_unknown_keys();

  if (options.choose_problem) instances.clear();
  for (const auto& read : instances) scene.instances.push_back(read.instance);
  for (const auto& read : subdivs) scene.subdivs.push_back(read.subdiv);
  scene.shapes.resize(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); i++) scene.shapes[i].name = shapes[i].name;
  show_solids(instances, scene);
  const std::vector<bool> problems = find_problems(context, options, scene);
  load_shapes(file, shapes, subdivs, problems, scene, warnings);
  check_problem_shapes(file, problems, scene);
  replace_hair_on_faces(context, instances, scene);
  return scene;
}

}  // namespace wisp
