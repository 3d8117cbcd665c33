// glTF 2.0 (Khronos Group, ISO/IEC 12113:2022) as a scene: nodes, cameras and
// lights. What a file says about units is taken as numbers: candela and lux are
// radiant intensity and irradiance here.

#include "wisp/render/gltf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <new>

#include "gltf_internal.h"

namespace wisp {

namespace gltf_detail {

namespace {

using matrix = glm::dmat4;

glm::dvec3 to_vec3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

// The transform of a node in its parent.
matrix local_transform(const gltf_file& file, const tinygltf::Node& node,
                       const std::string& place) {
  auto check = [&](const std::vector<double>& values, std::size_t count, const char* name) {
    if (!values.empty() && values.size() != count)
      fail(file, place + "." + name,
           fmt::format("has {} numbers, where {} are wanted", values.size(), count));
    return !values.empty();
  };
  matrix result{1};
  if (check(node.matrix, 16, "matrix")) {
    for (int c = 0; c < 4; c++)
      for (int r = 0; r < 4; r++) result[c][r] = node.matrix[static_cast<std::size_t>(c * 4 + r)];
    return result;
  }
  if (check(node.rotation, 4, "rotation")) {
    const auto& q = node.rotation;
    glm::dquat rotation(q[3], q[0], q[1], q[2]);
    double length = glm::length(rotation);
    if (length > 0 && std::isfinite(length)) result = glm::mat4_cast(rotation / length);
  }
  if (check(node.scale, 3, "scale")) {
    auto scale = to_vec3(node.scale);
    for (int c = 0; c < 3; c++) result[c] *= scale[c];
  }
  if (check(node.translation, 3, "translation"))
    result[3] = glm::dvec4{to_vec3(node.translation), 1};
  return result;
}

frame3 to_frame(const gltf_file& file, const matrix& m, const std::string& place) {
  constexpr double limit = 1e30;
  frame3 frame = identity_frame;
  for (int c = 0; c < 4; c++)
    for (int r = 0; r < 3; r++) {
      if (!(std::abs(m[c][r]) <= limit))
        fail(file, place, "its transform, with those of its parents, is out of range");
      frame[c][r] = static_cast<float>(m[c][r]);
    }
  return frame;
}

// The frame without scale and shear, for cameras and lights.
frame3 rigid_frame(const frame3& frame) {
  vec3 z = normalize_or_zero(frame[2]);
  vec3 x = normalize_or_zero(glm::cross(frame[1], z));
  if (z == vec3{0} || x == vec3{0}) return {vec3{1, 0, 0}, vec3{0, 1, 0}, vec3{0, 0, 1}, frame[3]};
  return {x, glm::cross(z, x), z, frame[3]};
}

void add_camera(gltf_loader& loader, int index, const std::string& node_name, const frame3& frame,
                const std::string& place) {
  const auto& file = loader.file;
  if (static_cast<std::size_t>(index) >= file.model.cameras.size())
    fail(
        file, place + ".camera",
        fmt::format("camera {} does not exist; the file has {}", index, file.model.cameras.size()));
  const auto& from = file.model.cameras[static_cast<std::size_t>(index)];
  auto where = fmt::format("cameras[{}]", index);
  auto positive = [&](double value, const char* name) {
    if (!(value > 0 && value < 1e20) || static_cast<float>(value) <= 0)
      fail(file, where + "." + name,
           fmt::format("is {}, where a positive number is wanted", value));
    return static_cast<float>(value);
  };
  camera_data camera;
  camera.name = !from.name.empty()   ? from.name
                : !node_name.empty() ? node_name
                                     : fmt::format("camera{}", index);
  camera.frame = rigid_frame(frame);
  if (from.type == "orthographic") {
    // The view is film / lens wide (or high, for an upright film); the
    // magnifications are half its sides.
    float x = positive(std::abs(from.orthographic.xmag), "orthographic.xmag");
    float y = positive(std::abs(from.orthographic.ymag), "orthographic.ymag");
    camera.orthographic = true;
    camera.aspect = x / y;
    camera.lens = camera.film / (2 * std::max(x, y));
  } else {
    double yfov = from.perspective.yfov;
    if (!(yfov > 0 && yfov < static_cast<double>(pi)))
      fail(file, where + ".perspective.yfov",
           fmt::format("is {}, where an angle between 0 and pi is wanted", yfov));
    // Without an aspect ratio the one of our cameras stays.
    if (from.perspective.aspectRatio != 0)
      camera.aspect = positive(from.perspective.aspectRatio, "perspective.aspectRatio");
    float height = camera.aspect >= 1 ? camera.film / camera.aspect : camera.film;
    camera.lens = height / (2 * static_cast<float>(std::tan(yfov / 2)));
  }
  loader.scene.cameras.push_back(camera);
}

void add_light(gltf_loader& loader, const tinygltf::Value& extension, const std::string& node_name,
               const frame3& frame, const std::string& place) {
  const auto& file = loader.file;
  int index = -1;
  if (extension.Has("light") && extension.Get("light").IsInt())
    index = extension.Get("light").GetNumberAsInt();
  if (index < 0 || static_cast<std::size_t>(index) >= file.model.lights.size())
    fail(file, place + ".extensions.KHR_lights_punctual.light",
         fmt::format("light {} does not exist; the file has {}", index, file.model.lights.size()));
  const auto& from = file.model.lights[static_cast<std::size_t>(index)];
  auto where = fmt::format("lights[{}]", index);
  light_data light;
  light.name = !from.name.empty()   ? from.name
               : !node_name.empty() ? node_name
                                    : fmt::format("light{}", index);
  light.frame = rigid_frame(frame);
  if (from.type == "point") {
    light.type = light_type::point;
  } else if (from.type == "spot") {
    light.type = light_type::spot;
    double outer = std::clamp(from.spot.outerConeAngle, 0.0, static_cast<double>(pi) / 2);
    light.outer_cone = static_cast<float>(outer);
    light.inner_cone = static_cast<float>(std::clamp(from.spot.innerConeAngle, 0.0, outer));
  } else if (from.type == "directional") {
    light.type = light_type::directional;
  } else {
    warn(loader, where,
         "its type '" + from.type.substr(0, 50) +
             "' is not point, spot or directional; it is left out");
    return;
  }
  for (int c = 0; c < 3; c++) {
    auto k = static_cast<std::size_t>(c);
    double value = from.intensity * (k < from.color.size() ? from.color[k] : 1.0);
    light.intensity[c] = static_cast<float>(std::clamp(value, 0.0, 1e20));
  }
  if (from.range > 0) light.range = static_cast<float>(std::min(from.range, 1e30));
  loader.scene.lights.push_back(light);
}

void add_instances(gltf_loader& loader, const tinygltf::Node& node, const frame3& frame,
                   const std::string& place) {
  const auto& file = loader.file;
  if (static_cast<std::size_t>(node.mesh) >= file.model.meshes.size())
    fail(file, place + ".mesh",
         fmt::format("mesh {} does not exist; the file has {}", node.mesh,
                     file.model.meshes.size()));
  auto inverted = inverse(frame);
  bool invertible = true;
  for (int c = 0; c < 4; c++) invertible = invertible && is_finite(inverted[c]);
  if (!invertible) {
    warn(loader, place, "its transform makes its mesh flat or vanish; it is left out");
    return;
  }
  for (const auto& part : get_mesh(loader, node.mesh)) {
    instance_data instance;
    instance.name = node.name.empty()
                        ? loader.scene.shapes[static_cast<std::size_t>(part.shape)].name
                        : node.name;
    instance.frame = frame;
    instance.shape = part.shape;
    instance.material = part.material;
    loader.scene.instances.push_back(std::move(instance));
  }
}

void add_node(gltf_loader& loader, const tinygltf::Node& node, const matrix& transform,
              const std::string& place) {
  auto light = node.extensions.find("KHR_lights_punctual");
  bool has_light = light != node.extensions.end() && light->second.IsObject();
  if (node.mesh < 0 && node.camera < 0 && !has_light) return;
  frame3 frame = to_frame(loader.file, transform, place);
  if (node.camera >= 0) add_camera(loader, node.camera, node.name, frame, place);
  if (has_light) add_light(loader, light->second, node.name, frame, place);
  if (node.mesh >= 0) add_instances(loader, node, frame, place);
}

// The nodes at the top of the scene that the file wants shown; those that are
// nobody's children when it has no scenes.
std::vector<int> root_nodes(const gltf_file& file) {
  const auto& model = file.model;
  if (!model.scenes.empty()) {
    int index = std::max(model.defaultScene, 0);
    if (static_cast<std::size_t>(index) >= model.scenes.size())
      fail(file, "scene",
           fmt::format("scene {} does not exist; the file has {}", index, model.scenes.size()));
    return model.scenes[static_cast<std::size_t>(index)].nodes;
  }
  std::vector<bool> is_child(model.nodes.size(), false);
  for (const auto& node : model.nodes)
    for (int child : node.children)
      if (child >= 0 && static_cast<std::size_t>(child) < is_child.size())
        is_child[static_cast<std::size_t>(child)] = true;
  std::vector<int> roots;
  for (std::size_t i = 0; i < is_child.size(); i++)
    if (!is_child[i]) roots.push_back(static_cast<int>(i));
  return roots;
}

// Depth first, in the order of the file. Nodes must form trees: one that is
// reached twice is its own ancestor or has two parents.
void add_nodes(gltf_loader& loader) {
  struct entry {
    int node;
    matrix parent;
    std::string place;
  };
  const auto& file = loader.file;
  const auto& nodes = file.model.nodes;
  std::vector<bool> reached(nodes.size(), false);
  std::vector<entry> stack;
  auto push = [&](const std::vector<int>& children, const matrix& parent,
                  const std::string& place) {
    for (auto it = children.rbegin(); it != children.rend(); ++it)
      stack.push_back({*it, parent, place});
  };
  push(root_nodes(file), matrix{1}, "scenes");
  while (!stack.empty()) {
    auto [index, parent, from] = std::move(stack.back());
    stack.pop_back();
    if (index < 0 || static_cast<std::size_t>(index) >= nodes.size())
      fail(file, from, fmt::format("node {} does not exist; the file has {}", index, nodes.size()));
    auto place = fmt::format("nodes[{}]", index);
    if (reached[static_cast<std::size_t>(index)])
      fail(file, place,
           "is reached twice; nodes must form trees, each with one parent and no cycles");
    reached[static_cast<std::size_t>(index)] = true;
    const auto& node = nodes[static_cast<std::size_t>(index)];
    matrix transform = parent * local_transform(file, node, place);
    add_node(loader, node, transform, place);
    push(node.children, transform, place);
  }
}

}  // namespace

void warn(gltf_loader& loader, const std::string& place, const std::string& reason) {
  auto line = loader.file.path.string() + ": " + place + ": " + reason;
  if (loader.warned.insert(line).second) loader.warnings.push_back(line);
}

}  // namespace gltf_detail

scene_data load_gltf_scene(const std::filesystem::path& path, warning_list& warnings) {
  using namespace gltf_detail;
  try {
    scene_data scene;
    auto file = read_gltf_file(path, warnings);
    scene.path = path;
    scene.copyright = file.model.asset.copyright;
    gltf_loader loader{file, scene, warnings};
    if (file.has_animations)
      warn(loader, "animations", "are not supported; the scene stands still");
    if (file.has_skins) warn(loader, "skins", "are not supported; meshes stay in their bind pose");
    add_nodes(loader);
    return scene;
  } catch (const std::bad_alloc&) {
    throw file_error{path.string(), "", "not enough memory for what the file holds"};
  }
}

}  // namespace wisp
