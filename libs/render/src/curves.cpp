#include <algorithm>

#include "accel.h"

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

dvec4 apply(const dvec4& w, const vec4* v) {
  return dvec4(v[0]) * w.x + dvec4(v[1]) * w.y + dvec4(v[2]) * w.z + dvec4(v[3]) * w.w;
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
void straighten(curve_geometry& curves, const shape_data& shape, const std::vector<vec4>& points) {
  uint32_t step = shape.basis == curve_basis::bezier ? 3 : 1;
  bool colors = !shape.colors.empty();
  auto add = [&](std::size_t first, double u) {
    dvec4 w = eval_basis(shape.basis, u).value;
    dvec4 p = apply(w, &points[first]);
    p.w = std::max(p.w, 0.0);
    curves.vertices.push_back(vec4(p));
    if (colors) curves.colors.push_back(vec4(apply(w, &shape.colors[first])));
  };
  for (std::size_t k = 0; k + 1 < shape.strands.size(); k++) {
    uint32_t first = shape.strands[k];
    uint32_t spans = segment_count(shape.basis, shape.strands[k + 1] - first);
    if (!shape.texcoords.empty())
      curves.strands.push_back(static_cast<uint32_t>(curves.vertices.size()));
    for (uint32_t span = 0; span < spans; span++, first += step) {
      int pieces = count_pieces(shape.basis, &points[first]);
      for (int i = 0; i < pieces; i++) {
        curves.segments.push_back(static_cast<uint32_t>(curves.vertices.size()));
        add(first, static_cast<double>(i) / pieces);
      }
    }
    if (spans > 0) add(first - step, 1);
  }
  curves.basis = curve_basis::linear;
  curves.vertices.shrink_to_fit();
  curves.segments.shrink_to_fit();
}

}  // namespace

curve_geometry take_curves(shape_data& shape) {
  curve_geometry curves;
  curves.basis = shape.basis;
  curves.profile = shape.profile;
  std::size_t used = shape.strands.empty() ? 0 : shape.strands.back();
  std::vector<vec4> points(used);
  for (std::size_t i = 0; i < used; i++)
    points[i] = vec4(shape.positions[i], i < shape.radius.size() ? shape.radius[i] : 0.001f);
  if (shape.triangles.empty() && shape.quads.empty() && shape.points.empty()) {
    shape.positions = {};
    shape.radius = {};
  }
  if (shape.basis != curve_basis::linear && shape.profile == curve_profile::flat) {
    straighten(curves, shape, points);
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
  if (!shape.texcoords.empty())
    curves.strands.assign(shape.strands.begin(), shape.strands.end() - 1);
  curves.colors = shape.colors;
  return curves;
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
