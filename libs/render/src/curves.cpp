#include <algorithm>

#include "accel.h"
#include "wisp/core/memory.h"

namespace wisp {

namespace {

// Weights of the four control points, and of the derivative.
struct basis_weights {
  dvec4 value, derivative;
};

basis_weights eval_basis(curve_basis basis, double u) {
  double s = 1 - u;
  switch (basis) {
    case curve_basis::bezier:
      return {{s * s * s, 3 * s * s * u, 3 * s * u * u, u * u * u},
              {-3 * s * s, 3 * s * (s - 2 * u), 3 * u * (2 * s - u), 3 * u * u}};
    case curve_basis::bspline:
      return {dvec4(s * s * s, 4 + u * u * (3 * u - 6), 4 + s * s * (3 * s - 6), u * u * u) / 6.0,
              dvec4(-s * s, u * (3 * u - 4), s * (4 - 3 * s), u * u) / 2.0};
    default:  // Catmull-Rom
      return {dvec4(-u * s * s, 2 + u * u * (3 * u - 5), 2 + s * s * (3 * s - 5), -s * u * u) / 2.0,
              dvec4(-s * (1 - 3 * u), u * (9 * u - 10), s * (10 - 9 * s), -u * (2 - 3 * u)) / 2.0};
  }
}

template <glm::length_t N>
glm::vec<N, double> apply(const dvec4& w, const glm::vec<N, float>* v) {
  using T = glm::vec<N, double>;
  return T(v[0]) * w.x + T(v[1]) * w.y + T(v[2]) * w.z + T(v[3]) * w.w;
}

constexpr double tolerance = 0.2;  // of the radius
constexpr int max_pieces = 16;

// How many straight pieces a cubic needs: its distance from n chords is at most
// max |c''| / (8 n^2), and c'' is largest at an end.
int count_pieces(curve_basis basis, const vec4* v) {
  dvec3 p0 = dvec3(v[0]), p1 = dvec3(v[1]), p2 = dvec3(v[2]), p3 = dvec3(v[3]);
  dvec3 start, end;  // second derivatives
  switch (basis) {
    case curve_basis::bezier:
      start = 6.0 * (p0 - 2.0 * p1 + p2);
      end = 6.0 * (p1 - 2.0 * p2 + p3);
      break;
    case curve_basis::bspline:
      start = p0 - 2.0 * p1 + p2;
      end = p1 - 2.0 * p2 + p3;
      break;
    default:
      start = 2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3;
      end = -p0 + 4.0 * p1 - 5.0 * p2 + 2.0 * p3;
      break;
  }
  double bend = std::sqrt(std::max(glm::dot(start, start), glm::dot(end, end)));
  double radius = std::max({v[0].w, v[1].w, v[2].w, v[3].w, 0.0f});
  double n = std::sqrt(bend / (8 * tolerance * radius));
  if (!(n < max_pieces)) return radius > 0 ? max_pieces : 1;
  return std::max(1, static_cast<int>(std::ceil(n)));
}

// Chains of straight pieces instead of cubics. Returns for each new vertex the
// first control point of its span and the place on it, if asked for.
void straighten(curve_geometry& curves, const shape_data& shape, const std::vector<vec4>& points,
                const strand_use& use) {
  uint32_t step = shape.basis == curve_basis::bezier ? 3 : 1;
  bool colors = !shape.colors.empty(), roughness = !shape.roughness.empty();
  bool texcoords = use.texcoords && !shape.texcoords.empty();
  float place = 0;
  auto add = [&](std::size_t first, double u) {
    dvec4 w = eval_basis(shape.basis, u).value;
    dvec4 p = apply(w, &points[first]);
    p.w = std::max(p.w, 0.0);
    curves.vertices.push_back(vec4(p));
    if (colors) curves.colors.push_back(vec4(apply(w, &shape.colors[first])));
    if (texcoords) curves.texcoords.push_back(vec2(apply(w, &shape.texcoords[first])));
    if (roughness)
      curves.roughness.push_back(glm::max(vec2(apply(w, &shape.roughness[first])), 0.0f));
    if (use.along) curves.places.push_back(place);
  };
  for (std::size_t k = 0; k + 1 < shape.strands.size(); k++) {
    uint32_t first = shape.strands[k];
    uint32_t spans = segment_count(shape.basis, shape.strands[k + 1] - first);
    if (use.index || use.along)
      curves.strands.push_back(static_cast<uint32_t>(curves.vertices.size()));
    for (uint32_t span = 0; span < spans; span++, first += step) {
      int pieces = count_pieces(shape.basis, &points[first]);
      for (int i = 0; i < pieces; i++) {
        curves.segments.push_back(static_cast<uint32_t>(curves.vertices.size()));
        place = (static_cast<float>(span) + static_cast<float>(i) / static_cast<float>(pieces)) /
                static_cast<float>(spans);
        add(first, static_cast<double>(i) / pieces);
      }
    }
    place = 1;
    if (spans > 0) add(first - step, 1);
  }
  if (!curves.strands.empty())
    curves.strands.push_back(static_cast<uint32_t>(curves.vertices.size()));
  curves.basis = curve_basis::linear;
  curves.vertices.shrink_to_fit();
  curves.segments.shrink_to_fit();
}

}  // namespace

curve_geometry take_curves(shape_data& shape, const strand_use& use) {
  curve_geometry curves;
  curves.along = use.along;
  curves.basis = shape.basis;
  curves.profile = shape.profile;
  std::size_t used = shape.strands.empty() ? 0 : shape.strands.back();
  std::vector<vec4> points(used);
  for (std::size_t i = 0; i < used; i++)
    points[i] = vec4(shape.positions[i], i < shape.radius.size() ? shape.radius[i] : 0.001f);
  if (shape.triangles.empty() && shape.quads.empty() && shape.points.empty()) {
    release(shape.positions);
    release(shape.radius);
  }
  if (shape.basis != curve_basis::linear && shape.profile == curve_profile::flat) {
    straighten(curves, shape, points, use);
    return curves;
  }
  uint32_t step = shape.basis == curve_basis::bezier ? 3 : 1;
  for (std::size_t k = 0; k + 1 < shape.strands.size(); k++) {
    uint32_t first = shape.strands[k];
    uint32_t count = segment_count(shape.basis, shape.strands[k + 1] - first);
    for (uint32_t i = 0; i < count; i++) curves.segments.push_back(first + i * step);
  }
  curves.segments.shrink_to_fit();
  curves.vertices = std::move(points);
  if (use.index || use.along) curves.strands = shape.strands;
  if (use.texcoords) curves.texcoords = shape.texcoords;
  curves.colors = shape.colors;
  curves.roughness = shape.roughness;
  return curves;
}

std::vector<strand_use> find_strand_use(const scene_data& scene) {
  std::vector<strand_use> result(scene.shapes.size());
  for (const auto& instance : scene.instances) {
    auto index = static_cast<std::size_t>(instance.shape);
    const auto& shape = scene.shapes[index];
    if (strand_count(shape) == 0) continue;
    const auto& m = scene.materials[static_cast<std::size_t>(instance.material)];
    bool hair = m.type == material_type::hair;
    bool textured = m.color_tex != invalid_id || m.emission_tex != invalid_id ||
                    m.roughness_tex != invalid_id || (hair && m.sigma_a_tex != invalid_id) ||
                    (!hair && m.scattering_tex != invalid_id);
    if (textured) {
      bool along = shape.texcoords.empty() || (hair && m.hair.strand_uv);
      result[index].along |= along;
      result[index].texcoords |= !along;
    }
    if (hair && (color_varies(m.hair) || roughness_varies(m.hair))) result[index].index = true;
  }
  return result;
}

curve_point eval_curve(const curve_geometry& curves, uint32_t segment, double u) {
  std::size_t i = curves.segments[segment];
  const auto& v = curves.vertices;
  if (curves.basis == curve_basis::linear) {
    dvec4 a = dvec4(v[i]), b = dvec4(v[i + 1]);
    dvec4 p = a + (b - a) * u;
    return {dvec3(p), dvec3(b - a), p.w};
  }
  basis_weights w = eval_basis(curves.basis, u);
  dvec4 p = apply(w.value, &v[i]);
  dvec3 d = dvec3(apply(w.derivative, &v[i]));
  if (glm::dot(d, d) == 0) d = dvec3(v[i + 3] - v[i]);  // doubled control points
  return {dvec3(p), d, p.w};
}

namespace {

template <typename T>
T eval_attribute(const curve_geometry& curves, const std::vector<T>& values, uint32_t segment,
                 float u) {
  std::size_t i = curves.segments[segment];
  if (curves.basis == curve_basis::linear) return glm::mix(values[i], values[i + 1], u);
  return T(apply(eval_basis(curves.basis, static_cast<double>(u)).value, &values[i]));
}

}  // namespace

vec4 eval_curve_attribute(const curve_geometry& curves, const std::vector<vec4>& values,
                          uint32_t segment, float u) {
  return eval_attribute(curves, values, segment, u);
}
vec2 eval_curve_attribute(const curve_geometry& curves, const std::vector<vec2>& values,
                          uint32_t segment, float u) {
  return eval_attribute(curves, values, segment, u);
}

uint32_t find_strand(const curve_geometry& curves, uint32_t segment) {
  auto end = curves.strands.end() - 1;
  auto it = std::upper_bound(curves.strands.begin(), end, curves.segments[segment]);
  return static_cast<uint32_t>(it - curves.strands.begin()) - 1;
}

float place_on_strand(const curve_geometry& curves, uint32_t strand, uint32_t segment, float u) {
  uint32_t vertex = curves.segments[segment];
  if (!curves.places.empty()) return glm::mix(curves.places[vertex], curves.places[vertex + 1], u);
  uint32_t first = curves.strands[strand];
  uint32_t spans = segment_count(curves.basis, curves.strands[strand + 1] - first);
  uint32_t span = (vertex - first) / (curves.basis == curve_basis::bezier ? 3 : 1);
  return (static_cast<float>(span) + u) / static_cast<float>(spans);
}

dvec3 smooth_tangent(const curve_geometry& curves, uint32_t segment, double u) {
  if (curves.basis != curve_basis::linear) return eval_curve(curves, segment, u).derivative;
  std::size_t i = curves.segments[segment];
  const auto& v = curves.vertices;
  auto piece = [&](std::size_t k) { return normalize_or_zero(vec3(v[k + 1] - v[k])); };
  vec3 own = piece(i);
  // Towards the neighbour on the nearer side: half way at the joint.
  std::size_t s = segment;
  bool before = u < 0.5 && s > 0 && curves.segments[s - 1] + 1 == i;
  bool after = u >= 0.5 && s + 1 < curves.segments.size() && curves.segments[s + 1] == i + 1;
  if (!before && !after) return dvec3(own);
  vec3 joint = own + piece(before ? i - 1 : i + 1);
  double towards = std::abs(2 * u - 1);
  return dvec3(own) * (1 - towards) + dvec3(joint) * (0.5 * towards);
}

}  // namespace wisp
