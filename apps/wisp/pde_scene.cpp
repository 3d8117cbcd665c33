#include "pde_scene.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

#include "commands.h"
#include "empty_domain.h"
#include "render_component.h"
#include "wisp/geometry/bvh.h"
#include "wisp/geometry/closest_point.h"
#include "wisp/geometry/mesh.h"
#include "wisp/geometry/signed_distance.h"
#include "wisp/scene/formula.h"
#include "wisp/scene/solid.h"

using wisp::dvec2;
using wisp::dvec3;
using wisp::dvec4;

namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::vector<wisp::ivec3> triangles_of(const wisp::shape_data& shape) {
  auto triangles = shape.triangles;
  const auto split = wisp::quads_to_triangles(shape.quads);
  triangles.insert(triangles.end(), split.begin(), split.end());
  return triangles;
}

// The places of a mesh in a solid.
void find_frames(const wisp::solid_data& solid, std::size_t node, int shape,
                 const glm::dmat4& frame, std::vector<glm::dmat4>& found) {
  const wisp::solid_node& n = solid.nodes[node];
  if (n.type == wisp::solid_type::mesh && n.shape == shape) found.push_back(frame);
  const glm::dmat4 inner =
      n.type == wisp::solid_type::transform ? frame * glm::dmat4(n.frame) : frame;
  for (const int operand : n.operands) find_frames(solid, at(operand), shape, inner, found);
}

// What colours a mesh: its vertices or an image. Points of the boundary that do not tell
// their triangle take the closest one of the mesh, where it stands in the solid.
struct surface_colors {
  std::vector<wisp::ivec3> triangles = {};
  std::vector<wisp::vec4> colors = {};
  std::vector<wisp::vec2> texcoords = {};
  image_lookup image = {};  // none where there are colours
  wisp::bvh tree = {};      // none where boundary points tell their triangle
  struct place {
    glm::dmat4 frame{1};
    glm::dmat4 inverse{1};
  };
  std::vector<place> places = {};

  dvec4 at_triangle(int element, const dvec2& uv) const {
    const wisp::ivec3 t = triangles[at(element)];
    const double w[3] = {1 - uv.x - uv.y, uv.x, uv.y};
    if (!colors.empty()) {
      dvec4 sum{0};
      for (int k = 0; k < 3; ++k) sum += w[k] * dvec4(colors[at(t[k])]);
      return {sum.x, sum.y, sum.z, 0};
    }
    dvec2 st{0};
    for (int k = 0; k < 3; ++k) st += w[k] * dvec2(texcoords[at(t[k])]);
    const wisp::vec4 texel = image(wisp::vec2(st));
    return {texel.x, texel.y, texel.z, 0};
  }

  dvec4 operator()(const wisp::boundary_point& p) const {
    if (tree.empty()) return p.element < 0 ? dvec4{std::nan("")} : at_triangle(p.element, p.uv);
    double best = std::numeric_limits<double>::infinity();
    wisp::closest_point_result closest;
    for (const place& where : places) {
      const auto found = wisp::closest_point(tree, dvec3(where.inverse * dvec4(p.position, 1)));
      if (!found) continue;
      const double distance =
          glm::distance(dvec3(where.frame * dvec4(found.at.point, 1)), p.position);
      if (!(distance < best)) continue;
      best = distance;
      closest = found;
    }
    return closest ? at_triangle(closest.element, closest.at.uv) : dvec4{std::nan("")};
  }
};

// One formula for each channel, or one for all.
struct formula_field {
  std::vector<wisp::formula> formulas = {};
  int channels = 1;

  dvec4 operator()(const dvec3& p) const {
    dvec4 result{0};
    for (int i = 0; i < channels; ++i) {
      result[i] = i < static_cast<int>(formulas.size()) ? formulas[at(i)](p) : result[0];
    }
    return result;
  }
};

class problem_maker {
 public:
  problem_maker(wisp::scene_data& scene, int index, int threads, wisp::warning_list& warnings)
      : scene_(scene),
        data_(scene.problems[at(index)]),
        place_(fmt::format("problems[{}]", index)),
        threads_(threads),
        warnings_(warnings) {}

  scene_problem make() {
    wisp::pde_problem& p = result_.problem;
    p.equation = static_cast<wisp::pde_equation>(data_.equation);
    p.screening = data_.screening;
    p.channels = data_.channels;
    p.infinity = data_.infinity;
    try {
      make_domain();
      p.boundary = surface_field(data_.boundary, "boundary");
      p.boundary_laplacian = surface_field(data_.boundary_laplacian, "boundary_laplacian");
      if (is_given(data_.source)) p.source = formulas(data_.source);
      if (is_given(data_.exact)) result_.exact = formulas(data_.exact);
      make_sources();
      make_parts();
      check_problem(p);
    } catch (const std::invalid_argument& error) {
      throw wisp::file_error(scene_.path.string(), place_, error.what());
    }
    return std::move(result_);
  }

 private:
  formula_field formulas(const wisp::field_data& field) const {
    formula_field result;
    for (const auto& text : field.formulas) result.formulas.emplace_back(text);
    result.channels = data_.channels;
    return result;
  }

  wisp::boundary_field surface_field(const wisp::field_data& field, const char* key);
  void make_domain();
  void make_sources();
  void make_parts();

  wisp::scene_data& scene_;
  const wisp::problem_data& data_;
  std::string place_;
  int threads_;
  wisp::warning_list& warnings_;
  scene_problem result_;
  int domain_shape_ = wisp::invalid_id;  // the mesh that the domain is
  wisp::solid_parts solid_ = {};
  double domain_seconds_ = 0, color_seconds_ = 0;
  std::size_t color_bytes_ = 0, texture_bytes_ = 0;
  int color_trees_ = 0, textures_ = 0;
};

void problem_maker::make_domain() {
  const auto side = data_.exterior ? wisp::domain_side::exterior : wisp::domain_side::interior;
  const double start = now();
  domain_shape_ = data_.shape;
  if (data_.solid != wisp::invalid_id) {
    const wisp::solid_data& solid = scene_.solids[at(data_.solid)];
    if (solid.nodes.size() == 1 && solid.nodes[0].type == wisp::solid_type::mesh) {
      domain_shape_ = solid.nodes[0].shape;
    }
  }
  if (domain_shape_ == wisp::invalid_id) {
    const auto& solid = scene_.solids[at(data_.solid)];
    result_.problem.domain =
        wisp::pde_domain(make_sdf(scene_, solid, threads_, warnings_, &solid_), side);
  } else {
    const wisp::shape_data& shape = scene_.shapes[at(domain_shape_)];
    const auto triangles = triangles_of(shape);
    result_.flat = is_flat(triangles, shape.positions);
    const auto tree = wisp::make_bvh(triangles, shape.positions, {.threads = threads_});
    const wisp::mesh_solid mesh(tree, {.threads = threads_});
    if (mesh.method() == wisp::inside_method::boundary ||
        mesh.method() == wisp::inside_method::moments) {
      warnings_.push_back(
          fmt::format("{}: {}.domain: the mesh '{}' is open ({} boundary edges); walks may leave "
                      "through its holes",
                      scene_.path.string(), place_, shape.name, mesh.boundary_edges()));
    }
    solid_ = {1, mesh.method() != wisp::inside_method::crossings ? 1u : 0u, tree.bytes(),
              mesh.bytes()};
    result_.problem.domain = wisp::pde_domain(mesh, side);
  }
  domain_seconds_ = now() - start;
  if (result_.problem.domain.empty()) {
    throw wisp::file_error(scene_.path.string(), place_ + ".domain",
                           "is empty; it must be a solid or mesh with an inside");
  }
}

wisp::boundary_field problem_maker::surface_field(const wisp::field_data& field, const char* key) {
  if (!is_given(field)) return {};
  if (!field.formulas.empty()) return formulas(field);
  const double start = now();
  auto colors = std::make_shared<surface_colors>();
  const wisp::shape_data& shape = scene_.shapes[at(field.shape)];
  colors->triangles = triangles_of(shape);
  if (field.vertex_colors) {
    colors->colors = shape.colors;
  } else {
    colors->texcoords = shape.texcoords;
    colors->image = load_image_lookup(scene_, field.texture, threads_,
                                      fmt::format("{}.{}.texture", place_, key), texture_bytes_);
    ++textures_;
  }
  if (field.shape != domain_shape_) {
    colors->tree = wisp::make_bvh(colors->triangles, shape.positions, {.threads = threads_});
    std::vector<glm::dmat4> frames;
    if (data_.solid != wisp::invalid_id) {
      const auto& solid = scene_.solids[at(data_.solid)];
      find_frames(solid, solid.nodes.size() - 1, field.shape, glm::dmat4{1}, frames);
    }
    if (frames.empty()) frames.emplace_back(1);
    for (const auto& frame : frames) colors->places.push_back({frame, glm::inverse(frame)});
    color_bytes_ += colors->tree.bytes();
    ++color_trees_;
  }
  color_seconds_ += now() - start;
  return [colors](const wisp::boundary_point& p) { return (*colors)(p); };
}

// Points along a strand: those given, or eight to a piece of a spline.
std::vector<dvec3> strand_points(const wisp::shape_data& shape, std::size_t strand) {
  const std::size_t begin = shape.strands[strand], end = shape.strands[strand + 1];
  std::vector<dvec3> result;
  if (shape.basis == wisp::curve_basis::linear) {
    result.assign(shape.positions.begin() + static_cast<std::ptrdiff_t>(begin),
                  shape.positions.begin() + static_cast<std::ptrdiff_t>(end));
    return result;
  }
  const auto pieces = wisp::segment_count(shape.basis, static_cast<std::uint32_t>(end - begin));
  const std::size_t stride = shape.basis == wisp::curve_basis::bezier ? 3 : 1;
  for (std::size_t i = 0; i < pieces; ++i) {
    dvec3 p[4];
    for (std::size_t k = 0; k < 4; ++k) p[k] = shape.positions[begin + i * stride + k];
    const int steps = 8;
    for (int k = i == 0 ? 0 : 1; k <= steps; ++k) {
      const double t = static_cast<double>(k) / steps, s = 1 - t;
      switch (shape.basis) {
        case wisp::curve_basis::bezier:
          result.push_back(s * s * s * p[0] + 3 * s * s * t * p[1] + 3 * s * t * t * p[2] +
                           t * t * t * p[3]);
          break;
        case wisp::curve_basis::bspline:
          result.push_back((s * s * s * p[0] + (3 * t * t * t - 6 * t * t + 4) * p[1] +
                            (3 * s * s * s - 6 * s * s + 4) * p[2] + t * t * t * p[3]) /
                           6.0);
          break;
        default:  // Catmull-Rom
          result.push_back(0.5 * (2.0 * p[1] + t * (p[2] - p[0]) +
                                  t * t * (2.0 * p[0] - 5.0 * p[1] + 4.0 * p[2] - p[3]) +
                                  t * t * t * (3.0 * p[1] - p[0] - 3.0 * p[2] + p[3])));
      }
    }
  }
  return result;
}

void problem_maker::make_sources() {
  wisp::pde_problem& p = result_.problem;
  for (const auto& source : data_.point_sources) {
    p.point_sources.push_back({source.position, source.strength});
  }
  for (const auto& source : data_.curve_sources) {
    if (source.shape == wisp::invalid_id) {
      p.curve_sources.push_back({source.points, source.strength});
      continue;
    }
    const wisp::shape_data& shape = scene_.shapes[at(source.shape)];
    for (std::size_t k = 0; k < wisp::strand_count(shape); ++k) {
      auto points = strand_points(shape, k);
      if (points.size() >= 2) p.curve_sources.push_back({std::move(points), source.strength});
    }
  }
  for (const auto& source : data_.mesh_sources) {
    const wisp::shape_data& shape = scene_.shapes[at(source.shape)];
    wisp::mesh_source mesh;
    mesh.positions.assign(shape.positions.begin(), shape.positions.end());
    for (const auto& t : triangles_of(shape)) {
      mesh.triangles.push_back({static_cast<std::uint32_t>(t.x), static_cast<std::uint32_t>(t.y),
                                static_cast<std::uint32_t>(t.z)});
    }
    mesh.strength = source.strength;
    p.mesh_sources.push_back(std::move(mesh));
  }
  for (const auto& peak : data_.source_peaks) {
    p.source_peaks.push_back({peak.center, peak.radius, peak.weight});
  }
}

void problem_maker::make_parts() {
  auto& parts = result_.parts;
  const bool meshes = solid_.meshes > 0;
  const bool one = domain_shape_ != wisp::invalid_id;
  parts.push_back({"distance tree", meshes,
                   !meshes ? "the domain has no mesh"
                   : one   ? "the domain is a mesh"
                           : fmt::format("the domain has {} mesh{}", solid_.meshes,
                                       solid_.meshes == 1 ? "" : "es"),
                   domain_seconds_, solid_.tree_bytes});
  parts.push_back({"winding numbers", solid_.open_meshes > 0,
                   !meshes                  ? "the domain has no mesh"
                   : solid_.open_meshes > 0 ? "a mesh is open"
                                            : "meshes are closed; rays tell inside from outside",
                   0, solid_.winding_bytes});
  parts.push_back({"distance grid", one,
                   one ? "the domain is a mesh; cells are filled where walks come by"
                       : "the domain is not one mesh",
                   0, result_.problem.domain.bytes()});
  parts.push_back({"colour tree", color_trees_ > 0,
                   color_trees_ > 0 ? "boundary values come from a mesh that is not the domain"
                                    : "no boundary value is looked up on another mesh",
                   color_seconds_, color_bytes_});
  parts.push_back(
      {"textures", textures_ > 0,
       textures_ > 0 ? "boundary values come from images" : "no boundary value comes from an image",
       0, texture_bytes_});
  const auto formula_count = [](const wisp::field_data& f) { return f.formulas.size(); };
  const std::size_t count = formula_count(data_.boundary) + formula_count(data_.source) +
                            formula_count(data_.boundary_laplacian) + formula_count(data_.exact);
  parts.push_back({"formulas", count > 0, fmt::format("the problem has {}", count), 0, 0});
  for (const char* name : {"ray tree", "curve rays", "light sampler", "environment sampler"}) {
    parts.push_back({name, false, "a problem is solved without rays and light", 0, 0});
  }
}

}  // namespace

int find_problem(const wisp::scene_data& scene, const std::string& name) {
  if (scene.problems.empty()) {
    throw wisp::file_error(scene.path.string(), "problems",
                           "is missing or empty; there is no problem to solve");
  }
  if (name.empty()) return 0;
  std::string names;
  for (std::size_t i = 0; i < scene.problems.size(); ++i) {
    if (scene.problems[i].name == name) return static_cast<int>(i);
    names += (names.empty() ? "" : ", ") + scene.problems[i].name;
  }
  throw usage_error(
      fmt::format("--problem: the scene has no problem '{}'; it has: {}", name, names));
}

scene_problem make_problem(wisp::scene_data& scene, int problem, int threads,
                           wisp::warning_list& warnings) {
  return problem_maker(scene, problem, threads, warnings).make();
}

void finish_parts(scene_problem& problem) {
  for (auto& part : problem.parts) {
    if (part.name == "distance grid") part.bytes = problem.problem.domain.bytes();
  }
}

wisp::section_plane make_plane(const wisp::section_data& section) {
  wisp::section_plane plane;
  plane.origin = section.origin;
  plane.normal = section.normal;
  plane.up = section.up;
  plane.size = section.size;
  plane.resolution = section.resolution;
  return plane;
}
