#pragma once

// Rays against the scene. The only user of Embree is embree.cpp behind this.

#include <cstdint>
#include <memory>
#include <vector>

#include "wisp/core/math.h"
#include "wisp/core/report.h"
#include "wisp/geometry/sdf.h"
#include "wisp/scene/scene.h"

namespace wisp {

struct ray3 {
  vec3 o = {0, 0, 0};
  vec3 d = {0, 0, 1};
  float tmin = 0;
  float tmax = infinity;
};

enum struct element_kind : uint32_t { triangle = 0, quad = 1, strand = 2, point = 3, solid = 4 };

struct ray_hit {
  int instance = invalid_id;
  element_kind kind = element_kind::triangle;
  // triangle, quad, point, or curve segment; of a solid 0, or 1 + the index of a cut
  uint32_t element = 0;
  vec2 uv = {0, 0};  // as in Embree; for strands u is along the segment
  float t = infinity;
  vec3 ng = {0, 0, 0};  // Embree's geometric normal in world space, not normalised
};

// The strands of a shape as the ray tracer wants them: also what shading reads.
struct curve_geometry {
  curve_basis basis = curve_basis::linear;
  curve_profile profile = curve_profile::flat;
  std::vector<vec4> vertices = {};      // xyz, radius
  std::vector<uint32_t> segments = {};  // first vertex of each segment
  // Of the vertices; empty where nothing asks for them.
  std::vector<vec4> colors = {};
  std::vector<vec2> texcoords = {};
  std::vector<vec2> roughness = {};
  // The place of a vertex on its strand, 0 at the root and 1 at the tip, by the
  // parameter of the curve: only with `along`, which says that it is asked for, and
  // only of chains of pieces; else it follows from `strands`.
  bool along = false;
  std::vector<float> places = {};
  // First vertex of each strand and the end of the last.
  std::vector<uint32_t> strands = {};
};

// What shading asks about the strands of a shape.
struct strand_use {
  bool texcoords = false;  // texture coordinates of the file
  bool along = false;      // root to tip, in their place
  bool index = false;      // which strand
};
// One for each shape.
std::vector<strand_use> find_strand_use(const scene_data& scene);

// Ribbons of every basis become chains of straight pieces, as many as keep them
// within a fifth of the radius of the curve: rays meet these faster, and with
// the exact offset from the axis. Tubes keep their basis. Takes positions and
// radii out of a shape that is all strands.
curve_geometry take_curves(shape_data& shape, const strand_use& use);

// Position, derivative and radius of a curve segment at u in [0, 1], in double.
struct curve_point {
  dvec3 position;
  dvec3 derivative;
  double radius;
};
curve_point eval_curve(const curve_geometry& curves, uint32_t segment, double u);
// The direction of the strand for shading: as the derivative, but without the
// corners of straight pieces.
dvec3 smooth_tangent(const curve_geometry& curves, uint32_t segment, double u);
// An attribute of the vertices, and the place from root to tip.
vec4 eval_curve_attribute(const curve_geometry& curves, const std::vector<vec4>& values,
                          uint32_t segment, float u);
vec2 eval_curve_attribute(const curve_geometry& curves, const std::vector<vec2>& values,
                          uint32_t segment, float u);
// The strand of a segment, by bisection; needs strand_use::index or along.
uint32_t find_strand(const curve_geometry& curves, uint32_t segment);
float place_on_strand(const curve_geometry& curves, uint32_t strand, uint32_t segment, float u);

// A solid that rays are traced against.
struct traced_solid {
  sdf solid = {};
  std::vector<solid_cut> cuts = {};
};

class ray_accel {
 public:
  // Takes positions and radii of pure strand shapes out of the scene. `solids` are
  // those of the shapes that are to be traced, one for each shape, or none at all.
  ray_accel(scene_data& scene, std::vector<traced_solid>&& solids, int threads, bool compact,
            std::vector<part_report>& parts);
  ~ray_accel();
  ray_accel(const ray_accel&) = delete;
  ray_accel& operator=(const ray_accel&) = delete;

  bool intersect(const ray3& ray, ray_hit& hit) const;
  bool occluded(const ray3& ray) const;

  // One for each shape; without segments for shapes without strands.
  const curve_geometry& curves(int shape) const;

 private:
  struct impl;
  std::unique_ptr<impl> impl_;
};

// Whether the surface of a shape is traced.
bool is_traced(const scene_data& scene, const shape_data& shape);
// Whether a shape stays in its own space even if it is used once.
inline bool keeps_space(const scene_data& scene, const shape_data& shape) {
  return is_traced(scene, shape) || shape.paint.color;
}

// Which kinds of elements the instances of a scene show.
struct element_use {
  // unique, not per instance
  std::size_t triangles = 0, quads = 0, strands = 0, points = 0, solids = 0;
  std::size_t instanced = 0;  // instances that share their shape with another
};
element_use count_elements(const scene_data& scene);

}  // namespace wisp
