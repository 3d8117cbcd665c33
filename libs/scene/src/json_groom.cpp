// The "groom" of a shape in a JSON scene.

#include "json_groom.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>

#include "wisp/scene/groom.h"

namespace wisp {

namespace {

// A child object, read by `body` where the key is there.
template <typename Body>
void read_child(json_object& parent, const char* key, Body&& body) {
  const json_tree* tree = parent.find(key);
  if (tree == nullptr) return;
  json_object child(parent.context(), *tree, parent.place_of(key), std::string("groom.") + key);
  body(child);
  child.finish();
}

void read_plane(json_object& object, const char* key, std::optional<vec4>& value) {
  vec4 plane;
  if (!object.get(key, plane)) return;
  if (vec3(plane) == vec3{0, 0, 0})
    object.fail(key, "its first three numbers are a direction and must not all be 0");
  value = plane;
}

void read_on(json_object& object, const json_scene_file& file, groom_ground& on) {
  const json_tree* tree = object.find("on");
  const bool is_solid = tree != nullptr && tree->is_string() &&
                        !file.shapes.by_name.contains(tree->get<std::string>()) &&
                        file.solids.by_name.contains(tree->get<std::string>());
  if (is_solid) {
    get_reference(object, "on", file.solids, on.solid);
  } else {
    get_reference(object, "on", file.shapes, on.shape);
    if (on.shape == invalid_id)
      object.fail("on", "is missing; a groom needs the name of the mesh or solid to grow on");
  }
}

}  // namespace

groom_params read_groom(const json_tree& tree, const std::string& place,
                        const json_scene_file& file, const std::optional<vec2>& radius,
                        groom_ground& on) {
  json_object object(file.context, tree, place, "groom");
  groom_params params;
  read_on(object, file, on);
  object.get("strands", params.strands, 1, 1'000'000'000);
  object.get("points", params.points, 4, 4096);
  if (static_cast<int64_t>(params.strands) * params.points > 4'000'000'000ll)
    object.fail("strands", "times \"points\" is above four thousand million");
  object.get_pair("length", params.length, positive);
  if (params.length.x > params.length.y)
    object.fail("length", "is [shortest, longest], and the first number is larger");
  if (radius) params.radius = *radius;
  object.get_pair("radius", params.radius, not_negative);
  object.get("taper", params.taper, positive);
  read_child(object, "curl", [&](json_object& curl) {
    curl.get("radius", params.curl_radius, not_negative);
    curl.get("turns", params.curl_turns, not_negative);
    curl.get("randomness", params.curl_randomness, unit_interval);
    if (params.curl_radius > 0 && 2.5f * params.curl_turns > static_cast<float>(params.points - 3))
      curl.fail("turns", fmt::format("is {}, and {} points can follow {:.3g} turns at most; give "
                                     "the groom {} \"points\" or more",
                                     params.curl_turns, params.points, (params.points - 3) / 2.5,
                                     std::ceil(2.5 * static_cast<double>(params.curl_turns)) + 3));
  });
  const json_tree* clump = object.find("clump");
  if (clump != nullptr && clump->is_object())
    read_child(object, "clump", [&](json_object& child) {
      child.get("amount", params.clump, unit_interval);
      child.get("size", params.clump_size, not_negative);
    });
  else
    object.get("clump", params.clump, unit_interval);
  object.get("gravity", params.gravity, not_negative);
  object.get("down", params.down);
  if (params.down == vec3{0, 0, 0}) object.fail("down", "is [0, 0, 0], which is no direction");
  object.get("noise", params.noise, not_negative);
  object.get("frizz", params.frizz, not_negative);
  object.get("lift", params.lift, unit_interval);
  object.get("comb", params.comb);
  read_plane(object, "part", params.part);
  object.get("volume", params.volume, not_negative);
  read_child(object, "region", [&](json_object& region) {
    region.get("min", params.region_min);
    region.get("max", params.region_max);
    read_plane(region, "plane", params.region_plane);
    region.get("fade", params.region_fade, not_negative);
    for (int i = 0; i < 3; i++)
      if (params.region_min[i] > params.region_max[i])
        region.fail("max", "is below \"min\"; the region is empty");
  });
  read_plane(object, "density_axis", params.density_axis);
  object.get("seed", params.seed);
  object.finish();
  return params;
}

shape_data grow_shape(const json_context& context, const json_shape& source,
                      const shape_data& mesh) {
  if (mesh.triangles.empty() && mesh.quads.empty())
    context.fail(source.place + ".groom.on",
                 "that shape has no faces; hair grows on meshes and solids only");
  try {
    return grow_groom(mesh, *source.groom);
  } catch (const std::invalid_argument& error) {
    std::string reason = error.what();
    if (reason.starts_with("groom: ")) reason.erase(0, 7);
    context.fail(source.place + ".groom", reason);
  } catch (const std::bad_alloc&) {
    context.fail(source.place + ".groom.strands",
                 "times \"points\" needs more memory than there is; use fewer");
  }
}

}  // namespace wisp
