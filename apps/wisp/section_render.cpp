#include "section_render.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>

#include "colormap.h"
#include "console.h"
#include "pde_scene.h"
#include "section_cut.h"
#include "section_outline.h"
#include "section_picture.h"
#include "solve_result.h"
#include "wisp/pde/section.h"
#include "wisp/scene/solid.h"

using wisp::dvec2;
using wisp::dvec3;
using wisp::dvec4;
using wisp::vec3;
using wisp::vec4;

namespace {

constexpr int most_cells = 2048, least_cells = 64;  // along the longer side
constexpr float contour_pixels = 1.3f;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool is_section(const wisp::instance_data& instance) {
  return instance.shape == wisp::invalid_id && instance.section != wisp::invalid_id;
}

vec3 to_linear(const vec3& c) {
  return {srgb_to_linear(c.x), srgb_to_linear(c.y), srgb_to_linear(c.z)};
}

// A solved section as colours in space.
struct section_texture {
  wisp::section_grid grid = {};   // without its points
  std::vector<vec3> colors = {};  // linear
  std::vector<float> distance = {};

  std::size_t bytes() const {
    return colors.size() * sizeof(vec3) + distance.size() * sizeof(float);
  }

  // Straight between the centers of cells; opaque within the domain, or everywhere.
  vec4 look_up(const vec3& position, bool everywhere) const {
    const dvec3 p = dvec3(position) - grid.corner;
    const auto place = [](double x, int count, int& cell) {
      x = std::clamp(x - 0.5, 0.0, static_cast<double>(count - 1));
      cell = std::min(static_cast<int>(x), std::max(count - 2, 0));
      return static_cast<float>(x - cell);
    };
    int x = 0, y = 0;
    const float u = place(glm::dot(p, grid.right) / grid.cell, grid.width, x);
    const float v = place(glm::dot(p, grid.down) / grid.cell, grid.height, y);
    const int right = x + 1 < grid.width ? 1 : 0, below = y + 1 < grid.height ? grid.width : 0;
    const int i = y * grid.width + x;
    const auto blend = [&](const auto& data) {
      return glm::mix(glm::mix(data[at(i)], data[at(i + right)], u),
                      glm::mix(data[at(i + below)], data[at(i + below + right)], u), v);
    };
    return {blend(colors), everywhere || blend(distance) > 0 ? 1.0f : 0.0f};
  }
};

// Values of the boundary as colours.
struct boundary_paint {
  std::shared_ptr<const wisp::pde_problem> problem;
  wisp::section_colors colormap;
  dvec2 range;
  double reach;  // the surface that is shown may be off by this

  vec4 operator()(const vec3& position) const {
    wisp::boundary_point p;
    p.position = position;
    const auto nearest = problem->domain.find_boundary(p.position, reach);
    const dvec4 value = problem->boundary(nearest.ends ? nearest.at : p);
    return {to_linear(section_color(value, problem->channels, colormap, range)), 1};
  }
};

// The shape of the mesh that a domain is, if it is one.
int domain_mesh(const wisp::scene_data& scene, const wisp::problem_data& problem) {
  if (problem.solid == wisp::invalid_id) return problem.shape;
  const auto& nodes = scene.solids[at(problem.solid)].nodes;
  return nodes.size() == 1 && nodes[0].type == wisp::solid_type::mesh ? nodes[0].shape
                                                                      : wisp::invalid_id;
}

// Side of a pixel where the camera is nearest to a section, in scene units.
double pixel_size(const wisp::camera_data& camera, const wisp::ivec2& size,
                  const wisp::frame3& frame, const wisp::section_grid& grid) {
  const double pixels = std::max(size.x, size.y);
  const double slope =
      static_cast<double>(camera.film) / (static_cast<double>(camera.lens) * pixels);
  if (camera.orthographic) return slope;
  double depth = std::numeric_limits<double>::infinity();
  const wisp::shape_data sheet = make_sheet(grid);
  for (const vec3& corner : sheet.positions) {
    const vec3 to = wisp::transform_point(frame, corner) - camera.frame[3];
    depth = std::min(depth, static_cast<double>(-glm::dot(to, camera.frame[2])));
  }
  return std::max(depth, 0.0) * slope;
}

class section_renderer {
 public:
  section_renderer(wisp::scene_data& scene, const section_render_options& options,
                   wisp::warning_list& warnings)
      : scene_(scene), options_(options), warnings_(warnings) {}

  bool run() {
    std::vector<wisp::instance_data> instances;
    std::swap(instances, scene_.instances);
    // first all cells, so that instances of one section share a solution
    std::map<int, int> resolutions;
    for (const auto& instance : instances)
      if (is_section(instance)) {
        int& cells = resolutions[instance.section];
        cells = std::max(cells, find_resolution(instance));
      }
    for (const auto& [section, cells] : resolutions)
      if (!solve(section, cells)) return false;
    for (const auto& instance : instances)
      if (is_section(instance))
        show(instance);
      else
        scene_.instances.push_back(instance);
    return true;
  }

  wisp::part_report report(double seconds) const {
    std::string why;
    for (const auto& [section, made] : made_)
      why += fmt::format("{}{} of {} x {} cells", why.empty() ? "" : ", ",
                         scene_.sections[at(section)].name.empty()
                             ? fmt::format("section {}", section)
                             : "'" + scene_.sections[at(section)].name + "'",
                         made.texture->grid.width, made.texture->grid.height);
    std::size_t bytes = 0;
    for (const auto& [section, made] : made_) bytes += made.texture->bytes();
    return {"section textures", true, why, seconds, bytes};
  }

  std::vector<wisp::part_report> problem_parts() {
    std::vector<wisp::part_report> parts;
    for (auto& [index, problem] : problems_) {
      finish_parts(problem);
      for (const auto& part : problem.parts)
        if (part.built && (part.name == "distance grid" || part.name == "distance tree"))
          parts.push_back({part.name + " of a section", true, part.why, part.seconds, part.bytes});
    }
    return parts;
  }

 private:
  struct solved_section {
    std::shared_ptr<const section_texture> texture = {};
    int surface = wisp::invalid_id, sheet = wisp::invalid_id;  // shapes
  };

  template <typename F>
  auto blame(int section, F&& f) {
    try {
      return f();
    } catch (const std::invalid_argument& error) {
      throw wisp::file_error(scene_.path.string(), fmt::format("sections[{}]", section),
                             error.what());
    }
  }

  scene_problem& problem_of(int section) {
    const int index = scene_.sections[at(section)].problem;
    auto found = problems_.find(index);
    if (found == problems_.end())
      found =
          problems_.emplace(index, make_problem(scene_, index, options_.threads, warnings_)).first;
    return found->second;
  }

  wisp::section_grid make_grid(int section, int resolution) {
    const wisp::pde_domain& domain = problem_of(section).problem.domain;
    wisp::section_plane plane = make_plane(scene_.sections[at(section)]);
    plane.resolution = resolution;
    // all of the cut is seen, whatever its files hold
    if (domain.side() == wisp::domain_side::interior && wisp::is_finite(domain.bounds()))
      plane.size = {0, 0};
    return blame(section, [&] { return make_section_grid(domain, plane, options_.threads); });
  }

  int find_resolution(const wisp::instance_data& instance) {
    const wisp::section_grid coarse = make_grid(instance.section, least_cells);
    const double scale =
        std::cbrt(std::abs(static_cast<double>(glm::determinant(wisp::rotation(instance.frame)))));
    const double pixel =
        pixel_size(scene_.cameras[at(options_.camera)], options_.size, instance.frame, coarse);
    const double side = coarse.cell * std::max(coarse.width, coarse.height) * scale;
    const double cells = std::ceil(side / pixel);
    return cells < most_cells ? std::max(static_cast<int>(cells), least_cells) : most_cells;
  }

  bool solve(int index, int resolution);
  void make_shapes(int index, const wisp::section_grid& grid, const dvec2& range);
  void show(const wisp::instance_data& instance);
  int add_shape(wisp::shape_data shape);

  wisp::scene_data& scene_;
  const section_render_options& options_;
  wisp::warning_list& warnings_;
  std::map<int, scene_problem> problems_ = {};
  std::map<int, solved_section> made_ = {};
  int material_ = wisp::invalid_id;
};

bool section_renderer::solve(int index, int resolution) {
  const wisp::section_data& section = scene_.sections[at(index)];
  const wisp::problem_data& data = scene_.problems[at(section.problem)];
  const wisp::pde_problem& problem = problem_of(index).problem;
  const wisp::section_grid grid = make_grid(index, resolution);
  wisp::section_options options;
  options.solve.walks =
      options_.walks > 0 ? options_.walks : static_cast<std::uint64_t>(data.walks);
  options.solve.epsilon = data.epsilon;
  options.solve.max_steps = data.max_steps;
  options.solve.seed = options_.seed;
  options.solve.threads = options_.threads;
  options.solve.on_progress = [&](const wisp::solve_options::progress& p) {
    if (!options_.on_progress) return true;
    std::string text =
        fmt::format("section {}: {} x {} cells", section.name, grid.width, grid.height);
    if (p.planned > 0 && p.walks > 0) {
      const double done = static_cast<double>(p.walks) / static_cast<double>(p.planned);
      text += fmt::format(", {:.0f} %, {} left", 100 * done,
                          format_duration(p.seconds * std::max(0.0, 1 / done - 1)));
    }
    return options_.on_progress(text);
  };
  const wisp::solution solution =
      blame(index, [&] { return solve_section(problem, grid, options); });
  if (solution.stopped) return false;

  section_image image = make_image(grid, solution, problem.channels);
  section_style style;
  style.colormap = section.colormap;
  style.range = section.range;
  style.contours = section.contours;
  const dvec2 range = section_range(image, style);
  auto texture = std::make_shared<section_texture>();
  texture->grid = grid;
  texture->grid.points = {};
  texture->grid.cells = {};
  for (const vec3& color : draw_texture(image, style, range, contour_pixels).pixels)
    texture->colors.push_back(to_linear(color));
  for (const double d : section_distances(problem.domain, grid, options_.threads))
    texture->distance.push_back(static_cast<float>(d));
  made_[index].texture = texture;
  make_shapes(index, grid, range);
  return true;
}

int section_renderer::add_shape(wisp::shape_data shape) {
  scene_.shapes.push_back(std::move(shape));
  return static_cast<int>(scene_.shapes.size()) - 1;
}

void section_renderer::make_shapes(int index, const wisp::section_grid& grid, const dvec2& range) {
  const wisp::section_data& section = scene_.sections[at(index)];
  const wisp::problem_data& data = scene_.problems[at(section.problem)];
  solved_section& made = made_[index];
  // the callbacks outlive this object
  const auto problem = std::make_shared<const wisp::pde_problem>(problem_of(index).problem);
  const bool interior = problem->domain.side() == wisp::domain_side::interior;
  const std::shared_ptr<const section_texture> texture = made.texture;
  const boundary_paint outside{problem, section.colormap, range, 2e-3 * problem->domain.size()};

  wisp::shape_data surface;
  bool needs_sheet = true;
  if (const int mesh = domain_mesh(scene_, data); mesh != wisp::invalid_id) {
    surface = scene_.shapes[at(mesh)];
    surface.colors.clear();  // they are boundary values, if anything
    surface.tangents.clear();
    if (interior) surface = clip_faces(surface, section.origin, section.normal);
  } else {
    wisp::solid_data solid = scene_.solids[at(data.solid)];
    if (solid.display == wisp::solid_display::mesh) {
      wisp::warning_list said;  // when the problem was made
      surface = blame(index, [&] {
        return tesselate_solid(solid, make_sdf(scene_, solid, options_.threads, said),
                               options_.threads);
      });
      if (interior) surface = clip_faces(surface, section.origin, section.normal);
    } else {
      if (interior) solid.cuts.push_back({section.origin, section.normal});
      needs_sheet = !interior;
      scene_.solids.push_back(std::move(solid));
      surface.solid = static_cast<int>(scene_.solids.size()) - 1;
    }
  }
  surface.name = section.name;
  surface.paint.unlit = !section.lit;
  surface.paint.color = [texture, outside](const vec3& position, int cut) {
    return cut >= 0 ? texture->look_up(position, true) : outside(position);
  };
  made.surface = add_shape(std::move(surface));
  if (!needs_sheet) return;
  wisp::shape_data sheet = make_sheet(grid);
  sheet.name = section.name;
  sheet.paint.unlit = !section.lit;
  sheet.paint.transparent = true;
  sheet.paint.color = [texture](const vec3& position, int) {
    return texture->look_up(position, false);
  };
  made.sheet = add_shape(std::move(sheet));
}

void section_renderer::show(const wisp::instance_data& instance) {
  wisp::instance_data shown = instance;
  shown.section = wisp::invalid_id;
  if (shown.material == wisp::invalid_id) {
    if (material_ == wisp::invalid_id) {
      wisp::material_data white;
      white.name = "section";
      white.color = {1, 1, 1};
      scene_.materials.push_back(white);
      material_ = static_cast<int>(scene_.materials.size()) - 1;
    }
    shown.material = material_;
  }
  const solved_section& made = made_.at(instance.section);
  for (const int shape : {made.surface, made.sheet}) {
    if (shape == wisp::invalid_id) continue;
    shown.shape = shape;
    scene_.instances.push_back(shown);
  }
}

}  // namespace

bool shows_sections(const wisp::scene_data& scene) {
  return std::any_of(scene.instances.begin(), scene.instances.end(), is_section);
}

bool render_sections(wisp::scene_data& scene, const section_render_options& options,
                     std::vector<wisp::part_report>& parts, wisp::warning_list& warnings) {
  if (!shows_sections(scene)) {
    parts.push_back({"section textures", false, "no instance shows a section", 0, 0});
    return true;
  }
  const double start = now();
  section_renderer renderer(scene, options, warnings);
  if (!renderer.run()) return false;
  for (auto& part : renderer.problem_parts()) parts.push_back(std::move(part));
  parts.push_back(renderer.report(now() - start));
  return true;
}

void plan_sections(wisp::scene_data& scene, std::vector<wisp::part_report>& parts) {
  std::size_t shown = 0;
  for (auto& instance : scene.instances) {
    if (!is_section(instance)) continue;
    shown++;
    const auto& data = scene.problems[at(scene.sections[at(instance.section)].problem)];
    instance.shape = domain_mesh(scene, data);
    if (instance.shape == wisp::invalid_id) {
      wisp::shape_data surface;
      surface.solid = data.solid;
      scene.shapes.push_back(std::move(surface));
      instance.shape = static_cast<int>(scene.shapes.size()) - 1;
    }
    if (instance.material == wisp::invalid_id) {
      scene.materials.emplace_back();
      instance.material = static_cast<int>(scene.materials.size()) - 1;
    }
  }
  parts.push_back({"section textures", shown > 0,
                   shown > 0 ? fmt::format("{} instances show a section", shown)
                             : "no instance shows a section",
                   0, 0});
}
