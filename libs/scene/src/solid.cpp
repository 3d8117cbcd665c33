#include "wisp/scene/solid.h"

#include <fmt/format.h>

#include <array>
#include <functional>
#include <stdexcept>

#include "wisp/core/parallel.h"
#include "wisp/geometry/contour.h"
#include "wisp/geometry/mesh.h"
#include "wisp/geometry/signed_distance.h"

namespace wisp {

namespace {

const shape_data& mesh_of(const scene_data& scene, const solid_node& node) {
  if (node.shape < 0 || static_cast<std::size_t>(node.shape) >= scene.shapes.size()) {
    throw std::invalid_argument("solid: a mesh is not a shape of the scene");
  }
  const shape_data& shape = scene.shapes[static_cast<std::size_t>(node.shape)];
  if (shape.triangles.empty() && shape.quads.empty()) {
    throw std::invalid_argument("solid: the mesh '" + shape.name + "' has no faces");
  }
  return shape;
}

// The tree of a solid, with its meshes made by `make_mesh`.
sdf make_tree(const scene_data& scene, const solid_data& solid,
              const std::function<sdf(const shape_data&)>& make_mesh) {
  if (solid.nodes.empty()) return sdf_empty();
  std::vector<sdf> made;
  std::vector<sdf> operands;
  for (const solid_node& n : solid.nodes) {
    operands.clear();
    for (const int i : n.operands) {
      if (i < 0 || static_cast<std::size_t>(i) >= made.size()) {
        throw std::invalid_argument("solid: an operand does not come before what it is part of");
      }
      operands.push_back(made[static_cast<std::size_t>(i)]);
    }
    const auto only = [&]() -> const sdf& {
      if (operands.size() != 1) throw std::invalid_argument("solid: a node needs one operand");
      return operands[0];
    };
    const auto make = [&]() -> sdf {
      switch (n.type) {
        case solid_type::mesh:
          return make_mesh(mesh_of(scene, n));
        case solid_type::sphere:
          return sdf_sphere(n.a, n.radius);
        case solid_type::box:
          return sdf_box(n.a, n.b);
        case solid_type::rounded_box:
          return sdf_rounded_box(n.a, n.b, n.radius);
        case solid_type::torus:
          return sdf_torus(n.a, n.b, n.radius, n.radius2);
        case solid_type::capsule:
          return sdf_capsule(n.a, n.b, n.radius);
        case solid_type::cylinder:
          return sdf_cylinder(n.a, n.b, n.radius);
        case solid_type::cone:
          return sdf_cone(n.a, n.b, n.radius, n.radius2);
        case solid_type::plane:
          return sdf_plane(n.a, n.b);
        case solid_type::ellipsoid:
          return sdf_ellipsoid(n.a, n.b);
        case solid_type::unite:
          return sdf_union(operands);
        case solid_type::intersection:
          return sdf_intersection(operands);
        case solid_type::difference:
          return sdf_difference(operands);
        case solid_type::smooth_union:
          return sdf_smooth_union(operands, n.radius);
        case solid_type::smooth_intersection:
          return sdf_smooth_intersection(operands, n.radius);
        case solid_type::smooth_difference:
          return sdf_smooth_difference(operands, n.radius);
        case solid_type::transform:
          return sdf_transform(n.frame, only());
        case solid_type::offset:
          return sdf_offset(only(), n.radius);
        case solid_type::complement:
          return sdf_complement(only());
      }
      throw std::invalid_argument("solid: unknown type of node");
    };
    made.push_back(make());
  }
  return made.back();
}

std::vector<ivec3> triangles_of(const shape_data& shape) {
  std::vector<ivec3> triangles = shape.triangles;
  const std::vector<ivec3> split = quads_to_triangles(shape.quads);
  triangles.insert(triangles.end(), split.begin(), split.end());
  return triangles;
}

// Gives corners the normals of the solid: taken a little within their triangle, they are
// those of its side where an edge meets. Corners of a vertex with nearly one normal
// stay one vertex.
void add_normals(shape_data& shape, const sdf& surface, int threads) {
  constexpr float one_normal = 0.9995f;
  std::vector<std::array<vec3, 3>> corner_normals(shape.triangles.size());
  parallel_for(
      shape.triangles.size(), threads,
      [&](std::size_t i) {
        std::array<dvec3, 3> v;
        for (int k = 0; k < 3; ++k) {
          v[static_cast<std::size_t>(k)] =
              shape.positions[static_cast<std::size_t>(shape.triangles[i][k])];
        }
        const dvec3 middle = (v[0] + v[1] + v[2]) / 3.0;
        const vec3 flat = triangle_normal(vec3(v[0]), vec3(v[1]), vec3(v[2]));
        for (std::size_t k = 0; k < 3; ++k) {
          const vec3 n(gradient(surface, v[k] + 0.2 * (middle - v[k])));
          corner_normals[i][k] = n == vec3{0, 0, 0} ? flat : n;
        }
      },
      1024);
  // the vertices that a vertex has become, as a list
  std::vector<int> next(shape.positions.size(), invalid_id);
  std::vector<bool> used(shape.positions.size(), false);
  shape.normals.assign(shape.positions.size(), vec3{0, 0, 0});
  for (std::size_t i = 0; i < shape.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const vec3 n = corner_normals[i][static_cast<std::size_t>(k)];
      int v = shape.triangles[i][k];
      const auto at = [](int x) { return static_cast<std::size_t>(x); };
      while (used[at(v)] && glm::dot(shape.normals[at(v)], n) < one_normal &&
             next[at(v)] != invalid_id) {
        v = next[at(v)];
      }
      if (used[at(v)] && glm::dot(shape.normals[at(v)], n) < one_normal) {
        next[at(v)] = static_cast<int>(shape.positions.size());
        shape.positions.push_back(shape.positions[at(v)]);
        v = next[at(v)];
        next.push_back(invalid_id);
        used.push_back(false);
        shape.normals.push_back({0, 0, 0});
      }
      if (!used[at(v)]) {
        used[at(v)] = true;
        shape.normals[at(v)] = n;
      }
      shape.triangles[i][k] = v;
    }
  }
}

}  // namespace

sdf make_sdf(const scene_data& scene, const solid_data& solid, int threads, warning_list& warnings,
             solid_parts* parts) {
  return make_tree(scene, solid, [&](const shape_data& shape) {
    const bvh tree = make_bvh(triangles_of(shape), shape.positions, {.threads = threads});
    const mesh_solid mesh(tree, {.threads = threads});
    if (mesh.method() == inside_method::boundary || mesh.method() == inside_method::moments) {
      warnings.push_back(fmt::format(
          "solid '{}': the mesh '{}' is open ({} boundary edges); its holes are closed where its "
          "winding number is 1/2",
          solid.name, shape.name, mesh.boundary_edges()));
    }
    if (parts != nullptr) {
      ++parts->meshes;
      parts->open_meshes += mesh.method() != inside_method::crossings;
      parts->tree_bytes += tree.bytes();
      parts->winding_bytes += mesh.bytes();
    }
    return sdf_mesh(mesh);
  });
}

dbox3 solid_bounds(const scene_data& scene, const solid_data& solid) {
  const sdf tree = make_tree(scene, solid, [](const shape_data& shape) {
    dbox3 box;
    for (const vec3& p : shape.positions) {
      if (is_finite(p)) box = merge(box, dvec3(p));
    }
    if (is_empty(box)) return sdf_empty();
    return sdf_function([](const dvec3&) { return 0.0; }, box);
  });
  return properties(tree).bounds;
}

shape_data tesselate_solid(const solid_data& solid, const sdf& surface, int threads) {
  const dbox3 bounds = properties(surface).bounds;
  const std::string name = "solid '" + solid.name + "'";
  if (is_empty(bounds)) throw std::invalid_argument(name + " is empty");
  if (!is_finite(bounds)) {
    throw std::invalid_argument(name + " is infinite; intersect it with something that is not");
  }
  const dvec3 extent = bounds.max - bounds.min;
  const double margin = 1e-3 * std::max({extent.x, extent.y, extent.z});
  contour_options options;
  options.min = bounds.min - margin;
  options.max = bounds.max + margin;
  options.resolution = solid.resolution;
  options.threads = threads;
  const contour_mesh mesh =
      contour([&](const dvec3& p) { return signed_distance(surface, p); }, options);
  if (mesh.triangles.empty()) {
    throw std::invalid_argument(name + " is empty, or smaller than a cell of its resolution of " +
                                std::to_string(solid.resolution));
  }
  shape_data shape;
  shape.name = solid.name;
  shape.triangles = mesh.triangles;
  shape.positions.assign(mesh.positions.begin(), mesh.positions.end());
  add_normals(shape, surface, threads);
  return shape;
}

}  // namespace wisp
