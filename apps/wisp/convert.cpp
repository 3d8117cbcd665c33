#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "commands.h"
#include "console.h"
#include "render_component.h"
#include "wisp/scene/io.h"

namespace {

struct convert_arguments {
  std::string in, out;
  bool quiet = false;
};

bool is_gltf(std::string ending) {
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending == ".gltf" || ending == ".glb";
}

// Appends vertex data; a shape that lacks it is filled up with `none`.
template <typename T>
void append(std::vector<T>& to, std::size_t before, const std::vector<T>& from, std::size_t count,
            const T& none) {
  if (to.empty() && from.empty()) return;
  to.resize(before, none);
  to.insert(to.end(), from.begin(), from.end());
  to.resize(before + count, none);
}

// Turns the faces from `first` on around, so that a mirror keeps the outside outside.
void flip_faces(wisp::shape_data& shape, std::size_t first_triangle, std::size_t first_quad) {
  for (std::size_t i = first_triangle; i < shape.triangles.size(); i++)
    std::swap(shape.triangles[i].y, shape.triangles[i].z);
  for (std::size_t i = first_quad; i < shape.quads.size(); i++) {
    auto& q = shape.quads[i];
    q = q.z == q.w ? wisp::ivec4{q.x, q.z, q.y, q.y} : wisp::ivec4{q.x, q.w, q.z, q.y};
  }
}

// All instances of a scene as one shape in world space. Those with strands come
// first, since strands are runs of vertices from the first one on.
wisp::shape_data merge_instances(wisp::scene_data scene, const std::string& path) {
  auto shape_of = [&](const wisp::instance_data& instance) -> const wisp::shape_data& {
    return scene.shapes[static_cast<std::size_t>(instance.shape)];
  };
  // sections have no shape of their own
  std::erase_if(scene.instances, [](const auto& i) { return i.shape == wisp::invalid_id; });
  std::stable_partition(scene.instances.begin(), scene.instances.end(), [&](const auto& instance) {
    return wisp::strand_count(shape_of(instance)) > 0;
  });
  wisp::shape_data all;
  for (const auto& instance : scene.instances) {
    const auto& s = shape_of(instance);
    std::size_t before = all.positions.size(), count = s.positions.size();
    std::size_t triangles = all.triangles.size(), quads = all.quads.size();
    auto base = static_cast<int>(before);
    float determinant = glm::determinant(wisp::rotation(instance.frame));
    for (const auto& p : s.positions)
      all.positions.push_back(wisp::transform_point(instance.frame, p));
    std::vector<wisp::vec3> normals = s.normals;
    for (auto& n : normals) n = wisp::transform_normal(instance.frame, n);
    std::vector<float> radius = s.radius;
    for (auto& r : radius) r *= std::cbrt(std::abs(determinant));
    append(all.normals, before, normals, count, {0, 0, 0});
    append(all.texcoords, before, s.texcoords, count, {0, 0});
    append(all.colors, before, s.colors, count, {1, 1, 1, 1});
    append(all.radius, before, radius, count, 0.001f);
    for (int p : s.points) all.points.push_back(p + base);
    for (const auto& t : s.triangles) all.triangles.push_back(t + base);
    for (const auto& q : s.quads) all.quads.push_back(q + base);
    if (determinant < 0) flip_faces(all, triangles, quads);
    if (wisp::strand_count(s) == 0) continue;
    if (before > 0 && (all.basis != s.basis || all.strands.back() != before))
      throw wisp::file_error(path, "", "holds strands of several bases, which cannot be one shape");
    if (before == 0) all.strands.push_back(0);
    all.basis = s.basis;
    for (std::size_t k = 1; k < s.strands.size(); k++)
      all.strands.push_back(s.strands[k] + static_cast<uint32_t>(before));
  }
  return all;
}

int run_convert(const convert_arguments& args) {
  if (!wisp::can_save_shape(args.out))
    throw usage_error(
        fmt::format("'{}' must end in .ply, .obj, .stl, .hair, .tfx or .pbrt", args.out));
  wisp::warning_list warnings;
  wisp::shape_data shape;
  if (is_gltf(std::filesystem::path(args.in).extension().string()))
    shape = merge_instances(load_gltf(args.in, warnings), args.in);
  else
    shape = wisp::load_shape(args.in, warnings);
  wisp::save_shape(args.out, shape, warnings);
  print_warnings(warnings, args.quiet);
  if (!args.quiet) fmt::print("{}\n", args.out);
  flush_results();
  return 0;
}

}  // namespace

command_action add_convert(CLI::App& app) {
  auto args = std::make_shared<convert_arguments>();
  auto* cmd = app.add_subcommand("convert", "Convert hair and mesh files between formats");
  cmd->footer(
      "Example:\n  wisp convert straight.hair straight.ply\n"
      "Reads .ply .obj .stl .hair .tfx .tfxmesh .pbrt" +
      std::string(has_render ? " .gltf .glb" : "") + "; writes .ply .obj .stl .hair .tfx .pbrt.");
  cmd->add_option("in", args->in, "File to read")->required();
  cmd->add_option("out", args->out, "File to write")->required();
  cmd->add_flag("--quiet", args->quiet, "No messages");
  return [args] { return run_convert(*args); };
}
