#pragma once

// The scene: plain data in the manner of Yocto/GL, so that a file that Yocto/GL
// reads has the same meaning here. Elements refer to each other by index;
// invalid_id means none. Nothing here needs a renderer, an image library or a
// ray tracer. All lengths are in scene units, angles in radians unless a
// field says otherwise, colours linear Rec. 709. Y is up by convention. Any number of
// threads may read one at once; it is changed by one thread, which no other reads beside.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "wisp/core/error.h"
#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/hair/materials.h"

namespace wisp {

inline constexpr int invalid_id = -1;

// A camera looks along -z of its frame; x is right and y is up in the image.
struct camera_data {
  std::string name = "";
  frame3 frame = identity_frame;
  bool orthographic = false;
  float lens = 0.050f;     // focal length; the field of view is 2 atan(film / (2 lens))
  float film = 0.036f;     // the larger side of the film
  float aspect = 1.500f;   // width / height
  float focus = 10000.0f;  // distance of the plane in focus
  float aperture = 0;      // diameter of the lens; 0 is a pinhole
};

// A texture names its file; pixels are loaded only when something that is
// rendered refers to it (wisp::render, load_textures). Pixels are stored row by
// row, the top row first. Texture coordinate (0, 0) is the top left corner, and
// pixel centres lie at half-integers.
struct texture_data {
  std::string name = "";
  std::filesystem::path path = "";  // absolute, or relative to the working directory
  bool nearest = false;             // no interpolation
  bool clamp_s = false;             // clamp instead of repeat
  bool clamp_t = false;
  // Encoded image file held in memory (images embedded in .glb and data URIs);
  // used instead of `path` when not empty.
  std::vector<uint8_t> encoded = {};

  // Filled by load_textures. Of the two arrays one is used: `pixelsf` for
  // files with floating-point samples (linear), `pixelsb` for the others (sRGB
  // encoded; whether they are decoded is decided by what reads them: colours
  // are, normals, roughness and displacement are not).
  int width = 0;
  int height = 0;
  std::vector<vec4> pixelsf = {};
  std::vector<u8vec4> pixelsb = {};
};

// Types as in Yocto/GL, and hair.
enum struct material_type {
  matte,
  glossy,
  reflective,
  transparent,
  refractive,
  subsurface,
  volumetric,
  gltfpbr,
  hair
};

// Whose melanin absorption a concentration means (wisp::hair, absorption.h).
enum struct hair_pigment { pbrt, cycles, materialx };

// Parameters of a hair material. The absorption is the first that is given of
// sigma_a, color, melanin; with none, eumelanin 1.3. Where lobes are counted,
// R, TT, TRT are 0, 1, 2.
struct hair_data {
  std::optional<vec3> sigma_a = {};  // per unit fibre radius, >= 0
  std::optional<vec3> color = {};    // wanted colour of a thick mass of hair, in [0, 1]
  float eumelanin = 1.3f;            // concentrations, >= 0
  float pheomelanin = 0;
  hair_pigment pigment = hair_pigment::pbrt;
  float eta = 1.55f;    // index of refraction
  float beta_m = 0.3f;  // longitudinal roughness, [0, 1]
  float beta_n = 0.3f;  // azimuthal roughness, [0, 1]
  float alpha = 2;      // tilt of the scales, degrees

  // As in wisp::hair::hair_parameters.
  int p_max = 3;
  float coat = 0;
  std::array<vec3, 3> strength = {vec3{1}, vec3{1}, vec3{1}};
  std::array<vec2, 3> roughness = {vec2{-1}, vec2{-1}, vec2{-1}};

  // Variation from strand to strand, [0, 1]: with the strand's random number r the
  // absorption is multiplied by 1 + 2 (r - 1/2) random_color, and all roughnesses
  // by the same of random_roughness. `random` stands in for the number of every
  // strand.
  float random_color = 0;
  float random_roughness = 0;
  std::optional<float> random = {};

  // Textures are looked up at (u, v) of the strand even if the shape has texture
  // coordinates: u from 0 at the root to 1 at the tip, v a number of the strand.
  bool strand_uv = false;

  // Cycles' Principled Hair, in place of all of the above but `random` and
  // `strand_uv`: its melanin does not vary in proportion. Its own `random` is not
  // used.
  std::optional<hair::principled_hair<float>> principled = {};
};

// What a hair material is on a strand of random number r, with its roughnesses
// along and around the fibre multiplied by `factor`.
WISP_API hair::material<float> hair_on_strand(const hair_data& hair, float r = 0.5f,
                                              const vec2& factor = {1, 1});
// Whether r matters for the absorption, and for the lobes.
WISP_API bool color_varies(const hair_data& hair);
WISP_API bool roughness_varies(const hair_data& hair);

struct material_data {
  std::string name = "";
  material_type type = material_type::matte;
  vec3 emission = {0, 0, 0};  // radiance
  vec3 color = {0, 0, 0};
  float roughness = 0;  // squared before use, as in Yocto/GL
  float metallic = 0;
  float ior = 1.5f;
  vec3 scattering = {0, 0, 0};  // single-scattering albedo of the interior
  float scanisotropy = 0;       // Henyey-Greenstein g, (-1, 1)
  float trdepth = 0.01f;        // distance at which the interior transmits `color`
  float opacity = 1;
  hair_data hair = {};

  int emission_tex = invalid_id;
  int color_tex = invalid_id;  // alpha multiplies opacity
  // Green multiplies roughness, blue metallic, as in glTF; on hair red multiplies
  // beta_m and green beta_n.
  int roughness_tex = invalid_id;
  int sigma_a_tex = invalid_id;  // hair: multiplies the absorption; never decoded as sRGB
  int scattering_tex = invalid_id;
  int normal_tex = invalid_id;  // tangent space, green up as in glTF and Yocto/GL
};

enum struct curve_basis { linear, bezier, bspline, catmull_rom };

// How a strand is seen: a ribbon that turns to face each ray, or a tube.
enum struct curve_profile { flat, round };

// A solid is a tree of signed distances. Its nodes are those of
// wisp/geometry/sdf.h, with the same names and parameters.
enum struct solid_type {
  mesh,
  sphere,
  box,
  rounded_box,
  torus,
  capsule,
  cylinder,
  cone,
  plane,
  ellipsoid,
  unite,
  intersection,
  difference,
  smooth_union,
  smooth_intersection,
  smooth_difference,
  transform,
  offset,
  complement
};
struct solid_node {
  solid_type type = solid_type::sphere;
  int shape = invalid_id;          // mesh: closed or nearly so, counter-clockwise outside
  dvec3 a = {0, 0, 0};             // center, point, or first end of an axis
  dvec3 b = {0, 0, 0};             // half sizes, radii, normal, or second end of an axis
  double radius = 0;               // or major radius, blend, offset; of a cone at a
  double radius2 = 0;              // minor radius; of a cone at b
  glm::dmat4x3 frame = {};         // transform
  std::vector<int> operands = {};  // nodes that come before this one
};

// How the surface of a solid is rendered: as triangles of dual contouring, or by
// sphere tracing the solid itself.
enum struct solid_display { mesh, trace };
// A plane that what is shown of a solid is cut open by: nothing in front of it is seen.
struct solid_cut {
  dvec3 point = {0, 0, 0};
  dvec3 normal = {0, 0, 1};  // towards what is cut away
};
struct solid_data {
  std::string name = "";
  std::vector<solid_node> nodes = {};  // the last one is the solid
  solid_display display = solid_display::mesh;
  int resolution = 256;  // cells along the longest side of the mesh that shows it
  std::vector<solid_cut> cuts = {};
};

// Colours that a function gives to the surface of a shape where it is seen: of its faces,
// points and solids, not of strands.
struct surface_paint {
  // Linear colour and opacity at a point in the shape's own space; `cut` is the index of
  // the cut of a traced solid that the point is on, -1 elsewhere. They multiply those of
  // the material. Called from many threads at once.
  std::function<vec4(const vec3& position, int cut)> color = {};
  bool unlit = false;        // the colour is the radiance, and no light is reflected
  bool transparent = false;  // opacity may be below 1
};

// A shape holds faces, points and strands over one set of vertices, or is the
// surface of a solid.
//
// Strand k uses the vertices strands[k] <= i < strands[k + 1] in order; `strands`
// is empty or ends with the number of vertices that strands use. `basis` says
// what the vertices are: points on the curve (linear), cubic Bezier control
// points (3 n + 1 of them, shared ends), or control points of uniform cubic
// B-splines or Catmull-Rom splines (n + 3; the curve runs from near the second
// to near the last but one).
struct shape_data {
  std::string name = "";
  int solid = invalid_id;  // prepare_scene meshes or traces it

  std::vector<int> points = {};
  std::vector<ivec3> triangles = {};
  std::vector<ivec4> quads = {};  // a quad with z == w is the triangle x y z
  std::vector<uint32_t> strands = {};
  curve_basis basis = curve_basis::linear;
  curve_profile profile = curve_profile::flat;

  // One entry for each vertex, or none.
  std::vector<vec3> positions = {};
  std::vector<vec3> normals = {};
  std::vector<vec2> texcoords = {};
  std::vector<vec4> colors = {};  // linear
  std::vector<float> radius = {};
  std::vector<vec4> tangents = {};   // xyz, and w = the sign of the bitangent
  std::vector<vec2> roughness = {};  // of strands: factors >= 0 on beta_m and beta_n of hair

  surface_paint paint = {};
};

inline std::size_t strand_count(const shape_data& s) {
  return s.strands.empty() ? 0 : s.strands.size() - 1;
}
// Number of curve pieces of a strand with `points` vertices; 0 when the count
// does not fit the basis.
inline uint32_t segment_count(curve_basis basis, uint32_t points) {
  switch (basis) {
    case curve_basis::linear:
      return points >= 2 ? points - 1 : 0;
    case curve_basis::bezier:
      return points >= 4 && points % 3 == 1 ? (points - 1) / 3 : 0;
    default:
      return points >= 4 ? points - 3 : 0;
  }
}

// A subdivision surface, refined at load into the shape it names.
struct subdiv_data {
  std::string name = "";
  std::vector<ivec4> quadspos = {};
  std::vector<ivec4> quadsnorm = {};
  std::vector<ivec4> quadstexcoord = {};
  std::vector<vec3> positions = {};
  std::vector<vec3> normals = {};
  std::vector<vec2> texcoords = {};
  int subdivisions = 0;
  bool catmullclark = true;
  bool smooth = true;
  float displacement = 0;
  int displacement_tex = invalid_id;
  int shape = invalid_id;
};

// An instance shows a shape; or a section, without a shape and not always with a
// material.
struct instance_data {
  std::string name = "";
  frame3 frame = identity_frame;
  int shape = invalid_id;
  int material = invalid_id;
  int section = invalid_id;
};

// A function of position, with one to four channels. One of: formulas
// (wisp/scene/formula.h), one for each channel or one for all; the colours of a mesh's
// vertices; a texture at a mesh's texture coordinates. Both of the last have three.
struct field_data {
  std::vector<std::string> formulas = {};
  bool vertex_colors = false;
  int texture = invalid_id;
  int shape = invalid_id;  // the mesh, of colours and textures
};
inline bool is_given(const field_data& f) {
  return !f.formulas.empty() || f.vertex_colors || f.texture != invalid_id;
}

// Boundary value problems. The sign is that of
//   Laplace            lap u = 0
//   Poisson            lap u = f
//   screened Poisson   lap u - c u = f
//   biharmonic         lap lap u = 0
// with u = g, and for the last lap u = h, on the boundary. Strengths have one entry for
// each channel; those beyond are 0.
enum struct problem_equation { laplace, poisson, screened_poisson, biharmonic };
struct point_source_data {
  dvec3 position = {0, 0, 0};
  dvec4 strength = {1, 0, 0, 0};
};
struct curve_source_data {
  std::vector<dvec3> points = {};  // joined by segments, or
  int shape = invalid_id;          // the strands of a shape
  dvec4 strength = {1, 0, 0, 0};   // for each unit of length
};
struct mesh_source_data {
  int shape = invalid_id;
  dvec4 strength = {1, 0, 0, 0};  // for each unit of area
};
// Where f is concentrated, a Gaussian of standard deviation `radius`.
struct source_peak_data {
  dvec3 center = {0, 0, 0};
  double radius = 1;
  double weight = 1;
};
struct problem_data {
  std::string name = "";
  // The domain is the inside, or the outside, of a solid or of a mesh.
  int solid = invalid_id;
  int shape = invalid_id;
  bool exterior = false;
  problem_equation equation = problem_equation::laplace;
  double screening = 0;                // c >= 0
  int channels = 1;                    // 1 to 4
  field_data boundary = {};            // g
  field_data boundary_laplacian = {};  // h
  field_data source = {};              // f
  field_data exact = {};               // u, where it is known
  std::vector<point_source_data> point_sources = {};
  std::vector<curve_source_data> curve_sources = {};
  std::vector<mesh_source_data> mesh_sources = {};
  std::vector<source_peak_data> source_peaks = {};
  dvec4 infinity = {0, 0, 0, 0};  // what u tends to far away, in exterior problems
  // How it is solved, unless a command says otherwise.
  double epsilon = 0;  // width of the shell in which walks end; 0: 1e-4 of the size
  int walks = 64;
  int max_steps = 1024;
};

// A plane cut through the domain of a problem.
enum struct section_colors { viridis, coolwarm, magma, plasma, inferno, cividis, turbo, gray };
struct section_data {
  std::string name = "";
  int problem = invalid_id;
  dvec3 origin = {0, 0, 0};
  dvec3 normal = {0, 0, 1};  // towards the viewer
  dvec3 up = {0, 0, 0};      // upwards in pictures; zero: y, or -z for a normal along y
  dvec2 size = {0, 0};       // width and height; 0: those of the domain
  int resolution = 256;      // cells along the longer side
  section_colors colormap = section_colors::viridis;
  std::optional<dvec2> range = {};  // values of the ends of the colour map
  int contours = 10;                // contour lines; 0: none
  bool lit = false;                 // shaded by the scene's light, or shown as it is
};

// A distant sphere of radiance `emission` times the lat-long texture, whose
// top row is +y of the frame.
struct environment_data {
  std::string name = "";
  frame3 frame = identity_frame;
  vec3 emission = {0, 0, 0};
  int emission_tex = invalid_id;
};

enum struct light_type { point, spot, directional };

// Lights without extent (glTF KHR_lights_punctual). They shine along -z of
// their frame; a point light shines everywhere.
struct light_data {
  std::string name = "";
  frame3 frame = identity_frame;
  light_type type = light_type::point;
  vec3 intensity = {1, 1, 1};  // radiant intensity (point, spot) or irradiance (directional)
  float range = infinity;      // no light beyond it
  float inner_cone = 0;        // spot: half angles
  float outer_cone = pi / 4;
};

struct scene_data {
  std::filesystem::path path = "";  // the file it came from
  std::string copyright = "";

  std::vector<camera_data> cameras = {};
  std::vector<texture_data> textures = {};
  std::vector<material_data> materials = {};
  std::vector<shape_data> shapes = {};
  std::vector<subdiv_data> subdivs = {};
  std::vector<solid_data> solids = {};
  std::vector<instance_data> instances = {};
  std::vector<environment_data> environments = {};
  std::vector<light_data> lights = {};
  std::vector<problem_data> problems = {};
  std::vector<section_data> sections = {};
};

// The smallest box that holds all instances, {min, max}; min > max when there
// is nothing. Only finite vertices count.
WISP_API std::array<vec3, 2> scene_bounds(const scene_data& scene);

// A camera that sees all of the scene from the front, at 35 degrees.
WISP_API camera_data default_camera(const scene_data& scene);

}  // namespace wisp
