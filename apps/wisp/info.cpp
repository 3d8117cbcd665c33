#include <fmt/format.h>

#include <array>
#include <vector>

#include "commands.h"
#include "console.h"
#include "render_component.h"
#include "run_report.h"
#include "wisp/scene/io.h"

namespace {

struct info_arguments {
  std::string scene;
  bool json = false;
  bool quiet = false;
};

const char* type_name(wisp::material_type type) {
  constexpr std::array names = {"matte",       "glossy",     "reflective",
                                "transparent", "refractive", "subsurface",
                                "volumetric",  "gltfpbr",    "hair"};
  return names[static_cast<std::size_t>(type)];
}

const char* basis_name(wisp::curve_basis basis) {
  constexpr std::array names = {"linear", "bezier", "bspline", "catmull_rom"};
  return names[static_cast<std::size_t>(basis)];
}

nlohmann::ordered_json describe_problem(const wisp::scene_data& scene,
                                        const wisp::problem_data& problem) {
  constexpr std::array equations = {"laplace", "poisson", "screened_poisson", "biharmonic"};
  std::string domain = problem.solid != wisp::invalid_id
                           ? scene.solids[static_cast<std::size_t>(problem.solid)].name
                           : scene.shapes[static_cast<std::size_t>(problem.shape)].name;
  std::size_t sources = problem.point_sources.size() + problem.curve_sources.size() +
                        problem.mesh_sources.size() + (is_given(problem.source) ? 1 : 0);
  return {{"name", problem.name},
          {"equation", equations[static_cast<std::size_t>(problem.equation)]},
          {"side", problem.exterior ? "exterior" : "interior"},
          {"domain", domain},
          {"channels", problem.channels},
          {"sources", sources},
          {"exact", is_given(problem.exact)},
          {"walks", problem.walks}};
}

// The bounds of a shape's file leave out the lamp that it is seen by.
std::array<wisp::vec3, 2> bounds_of(wisp::scene_data& scene, const std::string& path) {
  if (!wisp::can_load_shape(path)) return wisp::scene_bounds(scene);
  auto all = scene.instances;
  std::erase_if(scene.instances, [&](const auto& instance) {
    const auto& material = scene.materials[static_cast<std::size_t>(instance.material)];
    return wisp::max_component(material.emission) > 0;
  });
  auto bounds = wisp::scene_bounds(scene);
  scene.instances = std::move(all);
  return bounds;
}

nlohmann::ordered_json describe(wisp::scene_data& scene, const std::string& path) {
  using json = nlohmann::ordered_json;
  json info = {{"wisp", WISP_VERSION}, {"scene", path}};
  auto bounds = bounds_of(scene, path);
  if (bounds[0].x <= bounds[1].x)
    info["bounds"] = {{bounds[0].x, bounds[0].y, bounds[0].z},
                      {bounds[1].x, bounds[1].y, bounds[1].z}};
  info["cameras"] = json::array();
  for (const auto& c : scene.cameras) info["cameras"].push_back(c.name);
  info["shapes"] = json::array();
  for (const auto& s : scene.shapes) {
    json shape = {{"name", s.name}};
    if (!s.triangles.empty()) shape["triangles"] = s.triangles.size();
    if (!s.quads.empty()) shape["quads"] = s.quads.size();
    if (!s.points.empty()) shape["points"] = s.points.size();
    if (wisp::strand_count(s) > 0) {
      std::size_t segments = 0;
      for (std::size_t k = 0; k + 1 < s.strands.size(); k++)
        segments += wisp::segment_count(s.basis, s.strands[k + 1] - s.strands[k]);
      shape["strands"] = wisp::strand_count(s);
      shape["segments"] = segments;
      shape["basis"] = basis_name(s.basis);
    }
    shape["vertices"] = s.positions.size();
    info["shapes"].push_back(shape);
  }
  info["subdivs"] = scene.subdivs.size();
  info["materials"] = json::array();
  for (const auto& m : scene.materials)
    info["materials"].push_back({{"name", m.name}, {"type", type_name(m.type)}});
  info["textures"] = json::array();
  for (const auto& t : scene.textures)
    info["textures"].push_back({{"name", t.name}, {"path", t.path.string()}});
  info["instances"] = scene.instances.size();
  info["environments"] = scene.environments.size();
  info["lights"] = scene.lights.size();
  info["solids"] = scene.solids.size();
  info["problems"] = json::array();
  for (const auto& p : scene.problems) info["problems"].push_back(describe_problem(scene, p));
  info["sections"] = json::array();
  for (const auto& s : scene.sections)
    info["sections"].push_back(
        {{"name", s.name},
         {"problem", scene.problems[static_cast<std::size_t>(s.problem)].name},
         {"resolution", s.resolution}});
  auto parts = json::array();
  for (const auto& part : plan_render(scene))
    parts.push_back({{"name", part.name}, {"built", part.built}, {"why", part.why}});
  info["parts"] = parts;
  return info;
}

std::string shown_name(const nlohmann::ordered_json& name) {
  return name == "" ? "(no name)" : name.get<std::string>();
}

void print_text(const nlohmann::ordered_json& info) {
  fmt::print("{}\n", info["scene"].get<std::string>());
  if (info.contains("bounds")) {
    auto b = info["bounds"].get<std::vector<std::vector<double>>>();
    fmt::print("  bounds       ({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g})\n", b[0][0],
               b[0][1], b[0][2], b[1][0], b[1][1], b[1][2]);
  }
  std::string cameras;
  for (const auto& c : info["cameras"]) cameras += (cameras.empty() ? "" : ", ") + shown_name(c);
  fmt::print("  cameras      {}{}\n", info["cameras"].size(),
             cameras.empty() ? "" : ": " + cameras);
  fmt::print("  shapes       {}\n", info["shapes"].size());
  for (const auto& s : info["shapes"]) {
    std::string line;
    for (const auto& [key, value] : s.items())
      if (key != "name" && key != "basis")
        line += fmt::format("{}{} {}", line.empty() ? "" : ", ", value.get<std::size_t>(), key);
    if (s.contains("basis")) line += ", basis " + s["basis"].get<std::string>();
    fmt::print("    {}: {}\n", shown_name(s["name"]), line);
  }
  fmt::print("  subdivs      {}\n", info["subdivs"].get<std::size_t>());
  fmt::print("  materials    {}\n", info["materials"].size());
  for (const auto& m : info["materials"])
    fmt::print("    {}: {}\n", shown_name(m["name"]), m["type"].get<std::string>());
  fmt::print("  textures     {}\n", info["textures"].size());
  fmt::print("  instances    {}\n", info["instances"].get<std::size_t>());
  fmt::print("  environments {}\n", info["environments"].get<std::size_t>());
  fmt::print("  lights       {}\n", info["lights"].get<std::size_t>());
  fmt::print("  solids       {}\n", info["solids"].get<std::size_t>());
  fmt::print("  problems     {}\n", info["problems"].size());
  for (const auto& p : info["problems"])
    fmt::print("    {}: {}, {} of {}, {} channel{}{}\n", shown_name(p["name"]),
               p["equation"].get<std::string>(), p["side"].get<std::string>(),
               shown_name(p["domain"]), p["channels"].get<int>(),
               p["channels"].get<int>() == 1 ? "" : "s",
               p["exact"].get<bool>() ? ", exact solution known" : "");
  fmt::print("  sections     {}\n", info["sections"].size());
  for (const auto& s : info["sections"])
    fmt::print("    {}: of {}, {} cells wide or high\n", shown_name(s["name"]),
               shown_name(s["problem"]), s["resolution"].get<int>());
  if (info["parts"].empty()) return;
  fmt::print("to render it, wisp\n");
  for (const auto& part : info["parts"])
    fmt::print("  {:<10} {:<20} {}\n", part["built"].get<bool>() ? "builds" : "leaves out",
               part["name"].get<std::string>(), part["why"].get<std::string>());
}

int run_info(const info_arguments& args) {
  wisp::warning_list warnings;
  auto scene = load_any_scene(args.scene, warnings);
  auto info = describe(scene, args.scene);
  print_warnings(warnings, args.quiet);
  if (args.json)
    fmt::print("{}\n", json_text(info));
  else
    print_text(info);
  flush_results();
  return 0;
}

}  // namespace

command_action add_info(CLI::App& app) {
  auto args = std::make_shared<info_arguments>();
  auto* cmd = app.add_subcommand(
      "info", has_render ? "Tell what a scene holds, what will be built for it, what is left out"
                         : "Tell what a scene holds");
  cmd->footer("Example:\n  wisp info scene.json");
  cmd->add_option("scene", args->scene, "Scene file")->required();
  cmd->add_flag("--json", args->json, "JSON on stdout");
  cmd->add_flag("--quiet", args->quiet, "No warnings");
  return [args] { return run_info(*args); };
}
