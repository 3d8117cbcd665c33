// A bare shape as a scene: it gets what it needs to be seen, a camera, light and a
// material.

#include <cmath>

#include "wisp/scene/io.h"

namespace wisp {

namespace fs = std::filesystem;

namespace {

int add_material(scene_data& scene, material_data material) {
  scene.materials.push_back(std::move(material));
  return static_cast<int>(scene.materials.size()) - 1;
}

void add_shape(scene_data& scene, shape_data shape, int material, const frame3& frame) {
  instance_data instance;
  instance.name = shape.name;
  instance.frame = frame;
  instance.shape = static_cast<int>(scene.shapes.size());
  instance.material = material;
  scene.shapes.push_back(std::move(shape));
  scene.instances.push_back(std::move(instance));
}

// A square lamp above the left shoulder of whoever looks from +z, out of the
// default camera's view, its size and distance in proportion to the scene.
void add_key_light(scene_data& scene) {
  auto [low, high] = scene_bounds(scene);
  if (!(low.x <= high.x)) return;
  vec3 center = (low + high) / 2.0f;
  float diagonal = glm::length(high - low);
  if (!(diagonal > 0) || !std::isfinite(diagonal)) return;
  material_data material;
  material.name = "key light";
  material.emission = vec3{10};
  shape_data quad;
  quad.name = "key light";
  float half = 0.4f * diagonal;
  quad.positions = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
  quad.normals.assign(4, vec3{0, 0, 1});
  quad.texcoords = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  quad.quads = {{0, 1, 2, 3}};
  vec3 offset = vec3{-0.8f, 1.1f, 0.95f} * diagonal;
  mat3 axes = basis_from_z(normalize_or_zero(-offset));
  int id = add_material(scene, material);
  add_shape(scene, std::move(quad), id, {axes[0], axes[1], axes[2], center + offset});
}

}  // namespace

scene_data load_shape_scene(const fs::path& path, warning_list& warnings) {
  scene_data scene;
  scene.path = path;
  auto shape = load_shape(path, warnings);
  if (shape.name.empty()) shape.name = path.stem().string();
  bool has_faces = !shape.triangles.empty() || !shape.quads.empty() || !shape.points.empty();
  if (!has_faces && strand_count(shape) == 0)
    throw file_error{path.string(), "", "holds no faces, points or strands to show"};
  if (strand_count(shape) > 0) {
    material_data hair;
    hair.name = "hair";
    hair.type = material_type::hair;
    auto strands = shape;
    strands.points = {};
    strands.triangles = {};
    strands.quads = {};
    if (has_faces) strands.name += " strands";
    add_shape(scene, std::move(strands), add_material(scene, hair), identity_frame);
  }
  if (has_faces) {
    material_data grey;
    grey.name = "grey";
    grey.color = vec3{0.7f};
    shape.strands = {};
    add_shape(scene, std::move(shape), add_material(scene, grey), identity_frame);
  }
  scene.cameras.push_back(default_camera(scene));  // before the lamp, which it need not see
  if (scene.cameras.back().name.empty()) scene.cameras.back().name = "default";
  add_key_light(scene);
  environment_data sky;
  sky.name = "sky";
  sky.emission = vec3{1};
  scene.environments.push_back(sky);
  return scene;
}

}  // namespace wisp
