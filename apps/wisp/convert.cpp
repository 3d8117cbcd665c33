#include <fmt/format.h>

#include <algorithm>

#include "commands.h"
#include "console.h"
#include "wisp/render/gltf.h"
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

// All instances of a scene as one shape in world space.
wisp::shape_data merge_instances(const wisp::scene_data& scene, const std::string& path) {
  wisp::shape_data all;
  bool first_strands = true;
  for (const auto& instance : scene.instances) {
    const auto& s = scene.shapes[static_cast<std::size_t>(instance.shape)];
    std::size_t before = all.positions.size(), count = s.positions.size();
    auto base = static_cast<int>(before);
    for (const auto& p : s.positions)
      all.positions.push_back(wisp::transform_point(instance.frame, p));
    std::vector<wisp::vec3> normals = s.normals;
    for (auto& n : normals) n = wisp::transform_normal(instance.frame, n);
    append(all.normals, before, normals, count, {0, 0, 0});
    append(all.texcoords, before, s.texcoords, count, {0, 0});
    append(all.colors, before, s.colors, count, {1, 1, 1, 1});
    append(all.radius, before, s.radius, count, 0.001f);
    for (int p : s.points) all.points.push_back(p + base);
    for (const auto& t : s.triangles) all.triangles.push_back(t + base);
    for (const auto& q : s.quads) all.quads.push_back(q + base);
    if (wisp::strand_count(s) > 0) {
      if (!all.positions.empty() && before > 0 && (first_strands || all.basis != s.basis))
        throw wisp::file_error(
            path, "",
            "holds strands and faces, or strands of several bases; these cannot be one shape");
      if (first_strands) all.strands.push_back(0);
      all.basis = s.basis;
      for (std::size_t k = 1; k < s.strands.size(); k++)
        all.strands.push_back(s.strands[k] + static_cast<uint32_t>(before));
      first_strands = false;
    }
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
    shape = merge_instances(wisp::load_gltf_scene(args.in, warnings), args.in);
  else
    shape = wisp::load_shape(args.in, warnings);
  wisp::save_shape(args.out, shape, warnings);
  print_warnings(warnings, args.quiet);
  if (!args.quiet) fmt::print("{}\n", args.out);
  return 0;
}

}  // namespace

command_action add_convert(CLI::App& app) {
  auto args = std::make_shared<convert_arguments>();
  auto* cmd = app.add_subcommand("convert", "Convert hair and mesh files between formats");
  cmd->footer(
      "Example:\n  wisp convert straight.hair straight.ply\n"
      "Reads .ply .obj .stl .hair .tfx .tfxmesh .pbrt .gltf .glb; writes .ply .obj .stl .hair .tfx "
      ".pbrt.");
  cmd->add_option("in", args->in, "File to read")->required();
  cmd->add_option("out", args->out, "File to write")->required();
  cmd->add_flag("--quiet", args->quiet, "No messages");
  return [args] { return run_convert(*args); };
}
