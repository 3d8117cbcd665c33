#include "surface.h"

#include <algorithm>

#include "hair_material.h"
#include "wisp/geometry/mesh.h"
#include "wisp/render/image.h"

namespace wisp {

namespace {

// Interpolation as Embree parametrises triangles and quads (two triangles).
struct face_corners {
  std::array<std::size_t, 3> index;
  std::array<float, 3> weight;
};

face_corners find_corners(const shape_data& shape, const ray_hit& hit) {
  auto at = [](int i) { return static_cast<std::size_t>(i); };
  float u = hit.uv.x, v = hit.uv.y;
  if (hit.kind == element_kind::triangle) {
    ivec3 t = shape.triangles[hit.element];
    return {{at(t.x), at(t.y), at(t.z)}, {1 - u - v, u, v}};
  }
  ivec4 q = shape.quads[hit.element];
  if (u + v <= 1) return {{at(q.x), at(q.y), at(q.w)}, {1 - u - v, u, v}};
  return {{at(q.z), at(q.w), at(q.y)}, {u + v - 1, 1 - u, 1 - v}};
}

template <typename T>
T blend(const std::vector<T>& data, const face_corners& c) {
  return data[c.index[0]] * c.weight[0] + data[c.index[1]] * c.weight[1] +
         data[c.index[2]] * c.weight[2];
}

// Tangent frame of a face's texture coordinates: tangent, and the sign of the
// bitangent against cross(normal, tangent).
vec4 texture_tangent(const shape_data& shape, const face_corners& c) {
  if (!shape.tangents.empty()) return blend(shape.tangents, c);
  vec3 p = shape.positions[c.index[1]] - shape.positions[c.index[0]];
  vec3 q = shape.positions[c.index[2]] - shape.positions[c.index[0]];
  vec2 s = shape.texcoords[c.index[1]] - shape.texcoords[c.index[0]];
  vec2 t = shape.texcoords[c.index[2]] - shape.texcoords[c.index[0]];
  float det = s.x * t.y - s.y * t.x;
  if (det == 0 || !std::isfinite(det)) return {0, 0, 0, 1};
  vec3 tu = (p * t.y - q * s.y) / det;
  vec3 tv = (q * s.x - p * t.x) / det;
  vec3 n = glm::cross(p, q);
  // v grows downwards in images: the bitangent of a normal map points up.
  return {tu, glm::dot(glm::cross(n, tu), -tv) < 0 ? -1.0f : 1.0f};
}

void eval_face(const render_scene& scene, const ray3& ray, const ray_hit& hit, surface_point& p) {
  const auto& instance = scene.scene.instances[static_cast<std::size_t>(hit.instance)];
  const auto& shape = scene.scene.shapes[static_cast<std::size_t>(instance.shape)];
  face_corners c = find_corners(shape, hit);
  p.position = transform_point(instance.frame, blend(shape.positions, c));
  p.geometric_normal = transform_normal(
      instance.frame, triangle_normal(shape.positions[c.index[0]], shape.positions[c.index[1]],
                                      shape.positions[c.index[2]]));
  if (p.geometric_normal == vec3{0, 0, 0}) p.geometric_normal = normalize_or_zero(-ray.d);
  p.normal = p.geometric_normal;
  if (!shape.normals.empty()) {
    vec3 n = transform_normal(instance.frame, normalize_or_zero(blend(shape.normals, c)));
    if (n != vec3{0, 0, 0}) p.normal = n;
  }
  if (!shape.texcoords.empty()) p.texcoord = blend(shape.texcoords, c);
  if (!shape.colors.empty()) p.color = blend(shape.colors, c);

  const auto& material = scene.scene.materials[static_cast<std::size_t>(p.material)];
  if (material.normal_tex != invalid_id && !shape.texcoords.empty()) {
    const auto& texture = scene.scene.textures[static_cast<std::size_t>(material.normal_tex)];
    vec3 m = vec3(eval_texture(texture, p.texcoord, true)) * 2.0f - 1.0f;
    vec4 tangent = texture_tangent(shape, c);
    vec3 t = transform_vector(instance.frame, vec3(tangent));
    t = normalize_or_zero(t - p.normal * glm::dot(p.normal, t));
    if (t != vec3{0, 0, 0}) {
      vec3 b = glm::cross(p.normal, t) * tangent.w;
      vec3 n = normalize_or_zero(t * m.x + b * m.y + p.normal * m.z);
      if (n != vec3{0, 0, 0}) p.normal = n;
    }
  }
}

// Colours, texture coordinates and what else belongs to a strand, as far as
// shading asks.
void eval_strand_attributes(const render_scene& scene, const shape_data& shape,
                            const curve_geometry& curves, const ray_hit& hit, surface_point& p) {
  float u = hit.uv.x;
  if (!curves.colors.empty()) p.color = eval_curve_attribute(curves, curves.colors, hit.element, u);
  if (!curves.roughness.empty())
    p.roughness = eval_curve_attribute(curves, curves.roughness, hit.element, u);
  const auto& material = scene.scene.materials[static_cast<std::size_t>(p.material)];
  bool is_hair = material.type == material_type::hair;
  bool along = curves.along && (shape.texcoords.empty() || (is_hair && material.hair.strand_uv));
  if (!curves.texcoords.empty() && !along)
    p.texcoord = eval_curve_attribute(curves, curves.texcoords, hit.element, u);
  if (curves.strands.empty()) return;
  uint32_t copy = scene.copies[static_cast<std::size_t>(hit.instance)];
  uint32_t strand = find_strand(curves, hit.element);
  p.strand_number = strand_number(copy, strand, variation_stream);
  if (along)
    p.texcoord = {place_on_strand(curves, strand, hit.element, u),
                  strand_number(copy, strand, texcoord_stream)};
}

void eval_strand(const render_scene& scene, const ray3& ray, const ray_hit& hit, surface_point& p) {
  const auto& instance = scene.scene.instances[static_cast<std::size_t>(hit.instance)];
  const auto& shape = scene.scene.shapes[static_cast<std::size_t>(instance.shape)];
  const auto& curves = scene.accel->curves(instance.shape);
  curve_point c = eval_curve(curves, hit.element, static_cast<double>(hit.uv.x));
  const frame3& f = instance.frame;

  // The axis point and the ray in world space, in double: far from a thin fibre a
  // float offset would have no digits left.
  auto to_world = [&](const dvec3& v) {
    return dvec3(f[0]) * v.x + dvec3(f[1]) * v.y + dvec3(f[2]) * v.z;
  };
  dvec3 axis = to_world(c.position) + dvec3(f[3]);
  dvec3 derivative = to_world(c.derivative);
  double length = glm::length(derivative);
  dvec3 tangent = length > 0 ? derivative / length : dvec3(0, 0, 1);
  dvec3 d = dvec3(ray.d);
  dvec3 across = glm::cross(-d, tangent);
  double sine = glm::length(across);
  if (sine > 1e-9) {
    across /= sine;
  } else {  // along the fibre every side is alike
    across = dvec3(basis_from_z(vec3(tangent))[0]);
  }
  double scale = std::cbrt(std::abs(static_cast<double>(glm::determinant(rotation(f)))));
  double radius = c.radius * scale;
  // Distance of the ray's line from the axis, signed along `across`.
  double offset = glm::dot(dvec3(ray.o) - axis, across);
  p.h = radius > 0 ? static_cast<float>(std::clamp(offset / radius, -1.0, 1.0)) : 0.0f;
  p.radius = static_cast<float>(radius);
  p.position = vec3(axis + across * (radius * static_cast<double>(p.h)));

  // Shading follows the smooth strand.
  dvec3 smooth = to_world(smooth_tangent(curves, hit.element, static_cast<double>(hit.uv.x)));
  tangent = glm::length(smooth) > 0 ? glm::normalize(smooth) : tangent;
  dvec3 turned = glm::cross(-d, tangent);
  across = glm::length(turned) > 1e-9
               ? glm::normalize(turned)
               : glm::normalize(across - tangent * glm::dot(across, tangent));
  p.tangent = vec3(tangent);
  p.across = vec3(across);
  vec3 facing = vec3(glm::cross(tangent, across));  // towards the viewer, across the strand
  if (curves.profile == curve_profile::round) {
    float depth = std::sqrt(std::max(0.0f, 1 - p.h * p.h));
    p.normal = normalize_or_zero(p.across * p.h + facing * depth);
    p.position += facing * (p.radius * depth);
  } else {
    p.normal = facing;
  }
  p.geometric_normal = p.normal;

  eval_strand_attributes(scene, shape, curves, hit, p);
}

void paint_surface(const render_scene& scene, const ray_hit& hit, surface_point& p) {
  const auto& instance = scene.scene.instances[static_cast<std::size_t>(hit.instance)];
  const auto& paint = scene.scene.shapes[static_cast<std::size_t>(instance.shape)].paint;
  if (!paint.color || hit.kind == element_kind::strand) return;
  const vec3 position = instance.frame == identity_frame
                            ? p.position
                            : transform_point(inverse(instance.frame), p.position);
  const int cut = hit.kind == element_kind::solid ? static_cast<int>(hit.element) - 1 : -1;
  p.color *= paint.color(position, cut);
  p.unlit = paint.unlit;
}

}  // namespace

surface_point eval_surface(const render_scene& scene, const ray3& ray, const ray_hit& hit) {
  surface_point p;
  p.instance = hit.instance;
  p.kind = hit.kind;
  const auto& instance = scene.scene.instances[static_cast<std::size_t>(hit.instance)];
  p.material = instance.material;
  switch (hit.kind) {
    case element_kind::strand:
      eval_strand(scene, ray, hit, p);
      break;
    case element_kind::point: {
      p.position = ray.o + ray.d * hit.t;
      p.normal = p.geometric_normal = normalize_or_zero(hit.ng);
      const auto& shape = scene.scene.shapes[static_cast<std::size_t>(instance.shape)];
      auto vertex = static_cast<std::size_t>(shape.points[hit.element]);
      if (!shape.texcoords.empty()) p.texcoord = shape.texcoords[vertex];
      if (!shape.colors.empty()) p.color = shape.colors[vertex];
      break;
    }
    case element_kind::solid:
      p.position = ray.o + ray.d * hit.t;
      p.normal = p.geometric_normal = normalize_or_zero(hit.ng);
      break;
    default:
      eval_face(scene, ray, hit, p);
      break;
  }
  paint_surface(scene, hit, p);
  // Materials without an inside are seen from both sides.
  const auto& material = scene.scene.materials[static_cast<std::size_t>(p.material)];
  if (!is_transmissive(material.type) && glm::dot(p.normal, ray.d) > 0) p.normal = -p.normal;
  return p;
}

ray3 spawn_ray(const surface_point& point, const vec3& direction, const vec3& towards, float tmax) {
  if (point.kind == element_kind::strand) {
    // A tube is left at most a diameter / cos(theta) ahead. So is the ribbon that
    // faces the new ray: it holds the axis, which the ray passes at most half as
    // far ahead, and its pieces have caps. At grazing angles the skip is bounded.
    float skip = 2.1f * point.radius;
    float along = glm::dot(direction, point.tangent);
    float cos2 = std::max(1 - along * along, 1e-6f);
    float size = std::max(std::abs(point.position.x),
                          std::max(std::abs(point.position.y), std::abs(point.position.z)));
    float start = std::min(skip / std::sqrt(cos2), 10 * skip) + size * 1e-6f;
    return {point.position, direction, start, tmax};
  }
  float size = std::max(std::abs(point.position.x),
                        std::max(std::abs(point.position.y), std::abs(point.position.z)));
  float offset = std::max(size * 2e-6f, 1e-30f);
  bool outside = glm::dot(towards, point.geometric_normal) > 0;
  return {point.position + point.geometric_normal * (outside ? offset : -offset), direction, 0,
          tmax};
}

}  // namespace wisp
