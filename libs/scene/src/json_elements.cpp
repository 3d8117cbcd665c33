// Cameras, textures, environments and lights of a JSON scene, and frames.

#include <fmt/format.h>

#include <cmath>

#include "json_scene.h"

namespace wisp {

bool is_invertible(const frame3& frame) {
  // Relative to the axes' lengths, so that the scale of a model does not matter.
  glm::dvec3 x = frame[0], y = frame[1], z = frame[2];
  double volume = std::abs(glm::dot(glm::cross(x, y), z));
  double box = glm::length(x) * glm::length(y) * glm::length(z);
  return box > 1e-100 && volume > 1e-7 * box;
}

bool get_frame(json_object& object, frame3& frame, std::optional<float>* distance) {
  std::vector<float> v;
  bool has_frame = object.get("frame", v, 12);
  if (has_frame)
    for (int c = 0; c < 4; c++)
      frame[c] = {v[static_cast<std::size_t>(3 * c)], v[static_cast<std::size_t>(3 * c + 1)],
                  v[static_cast<std::size_t>(3 * c + 2)]};
  if (!object.get("lookat", v, 9)) return has_frame;
  if (has_frame) object.fail("lookat", "is given as well as \"frame\"; keep one");
  glm::dvec3 eye{v[0], v[1], v[2]}, center{v[3], v[4], v[5]}, up{v[6], v[7], v[8]};
  glm::dvec3 back = eye - center;
  double length = glm::length(back);
  if (!(length > 0)) object.fail("lookat", "looks from a point to itself");
  glm::dvec3 z = back / length;
  glm::dvec3 right = glm::cross(up, z);
  if (!(glm::length(right) > 1e-6 * glm::length(up)))
    object.fail("lookat", "has an up vector (the last three numbers) along the view");
  glm::dvec3 x = glm::normalize(right);
  frame = frame3{vec3(x), vec3(glm::cross(z, x)), vec3(z), vec3(eye)};
  if (distance != nullptr) *distance = static_cast<float>(length);
  return true;
}

namespace {

void check_frame(const json_object& object, const frame3& frame) {
  if (!is_invertible(frame))
    object.fail("frame", "its first nine numbers, three axes, must not lie in a plane");
}

}  // namespace

std::vector<camera_data> read_cameras(const json_scene_file& file) {
  std::vector<camera_data> result;
  for (const auto& element : file.cameras.elements) {
    json_object object(file.context, *element.tree, element.place, "cameras");
    camera_data camera;
    camera.name = element.name;
    object.get("name", camera.name);
    std::optional<float> distance;
    if (get_frame(object, camera.frame, &distance)) check_frame(object, camera.frame);
    if (distance) camera.focus = *distance;
    object.get("ortho", camera.orthographic);
    object.get("orthographic", camera.orthographic);
    object.get("lens", camera.lens, positive);
    object.get("film", camera.film, positive);
    object.get("aspect", camera.aspect, positive);
    object.get("focus", camera.focus, positive);
    object.get("aperture", camera.aperture, not_negative);
    object.finish();
    result.push_back(std::move(camera));
  }
  return result;
}

std::vector<texture_data> read_textures(const json_scene_file& file) {
  std::vector<texture_data> result;
  for (const auto& element : file.textures.elements) {
    json_object object(file.context, *element.tree, element.place, "textures");
    texture_data texture;
    texture.name = element.name;
    object.get("name", texture.name);
    texture.path = get_path(object, file, "textures");
    object.get("nearest", texture.nearest);
    bool clamp = false;
    object.get("clamp", clamp);
    texture.clamp_s = texture.clamp_t = clamp;
    object.get("clamp_s", texture.clamp_s);
    object.get("clamp_t", texture.clamp_t);
    object.finish();
    if (texture.path.empty()) object.fail("uri", "is missing; a texture needs an image file");
    result.push_back(std::move(texture));
  }
  return result;
}

std::vector<environment_data> read_environments(const json_scene_file& file) {
  std::vector<environment_data> result;
  for (const auto& element : file.environments.elements) {
    json_object object(file.context, *element.tree, element.place, "environments");
    environment_data environment;
    environment.name = element.name;
    object.get("name", environment.name);
    if (get_frame(object, environment.frame)) check_frame(object, environment.frame);
    object.get("emission", environment.emission, not_negative);
    get_reference(object, "emission_tex", file.textures, environment.emission_tex);
    object.finish();
    result.push_back(std::move(environment));
  }
  return result;
}

std::vector<light_data> read_lights(const json_scene_file& file) {
  constexpr float to_radians = pi / 180;
  std::vector<light_data> result;
  for (const auto& element : file.lights.elements) {
    json_object object(file.context, *element.tree, element.place, "lights");
    light_data light;
    light.name = element.name;
    object.get("name", light.name);
    int type = 0;
    object.get_word("type", type, {{"point", 0}, {"spot", 1}, {"directional", 2}});
    light.type = static_cast<light_type>(type);
    bool has_frame = get_frame(object, light.frame);
    if (has_frame) check_frame(object, light.frame);
    vec3 position, direction;
    bool has_position = object.get("position", position);
    bool has_direction = object.get("direction", direction);
    if (has_frame && (has_position || has_direction))
      object.fail(has_position ? "position" : "direction",
                  "is given as well as a frame; keep \"frame\" or \"lookat\", or \"position\" and "
                  "\"direction\"");
    if (has_direction) {
      double length = glm::length(glm::dvec3(direction));
      if (!(length > 0)) object.fail("direction", "is [0, 0, 0], which is no direction");
      mat3 axes = basis_from_z(vec3(glm::dvec3(direction) / -length));
      light.frame = frame3{axes[0], axes[1], axes[2], light.frame[3]};
    }
    if (has_position) light.frame[3] = position;
    object.get("intensity", light.intensity, not_negative);
    float inner = 0, outer = 45;
    bool is_spot = light.type == light_type::spot;
    if (is_spot) {
      object.get("outer_cone", outer, {0, 90, true});
      object.get("inner_cone", inner, {0, 90});
      if (inner > outer)
        object.fail("inner_cone",
                    fmt::format("is {} degrees, wider than outer_cone with {}", inner, outer));
    } else {
      object.ignore({"inner_cone", "outer_cone"}, "only spot lights have a cone; ignored");
    }
    light.inner_cone = inner * to_radians;
    light.outer_cone = outer * to_radians;
    if (light.type == light_type::directional)
      object.ignore({"range"}, "directional lights have no range; ignored");
    else
      object.get("range", light.range, positive);
    object.finish();
    result.push_back(std::move(light));
  }
  return result;
}

}  // namespace wisp
