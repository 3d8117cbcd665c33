// Signed closest points by angle-weighted pseudonormals: Baerentzen and Aanaes,
// Signed Distance Computation Using the Angle Weighted Pseudonormal, IEEE TVCG
// 11(3), 2005. Closest point on a triangle: Ericson, Real-Time Collision
// Detection, 2005, section 5.1.5.

#include "groom_surface.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "wisp/core/rng.h"
#include "wisp/geometry/mesh.h"

namespace wisp {

namespace {

constexpr uint32_t max_leaf = 4;

struct position_hash {
  std::size_t operator()(const vec3& p) const {
    uint32_t h = 0;
    for (int c = 0; c < 3; ++c) h = hash_combine(h, std::bit_cast<uint32_t>(p[c] + 0.0f));
    return h;
  }
};

// Vertices by position, and the triangles over them that have an area.
void weld(groom_surface& surface, const shape_data& mesh) {
  std::vector<ivec3> corners = mesh.triangles;
  const auto split = quads_to_triangles(mesh.quads);
  corners.insert(corners.end(), split.begin(), split.end());
  std::unordered_map<vec3, int, position_hash> index;
  auto vertex = [&](int v) {
    const vec3 p = mesh.positions[static_cast<std::size_t>(v)];
    const auto [it, added] = index.try_emplace(p, static_cast<int>(surface.positions.size()));
    if (added) surface.positions.push_back(p);
    return it->second;
  };
  const auto vertices = static_cast<int>(mesh.positions.size());
  for (const ivec3& t : corners) {
    bool usable = true;
    for (int c = 0; c < 3; ++c) {
      if (t[c] < 0 || t[c] >= vertices) {
        throw std::invalid_argument("groom: a face of the mesh has an index out of range");
      }
      usable = usable && is_finite(mesh.positions[static_cast<std::size_t>(t[c])]);
    }
    if (!usable) continue;
    const auto at = [&](int c) { return mesh.positions[static_cast<std::size_t>(t[c])]; };
    const vec3 normal = triangle_normal(at(0), at(1), at(2));
    if (normal == vec3{0, 0, 0}) continue;
    surface.triangles.push_back({vertex(t.x), vertex(t.y), vertex(t.z)});
    surface.corners.push_back(t);
    surface.face_normals.push_back(normal);
  }
}

const vec3& corner(const groom_surface& s, std::size_t triangle, int c) {
  return s.positions[static_cast<std::size_t>(s.triangles[triangle][c])];
}

void make_pseudonormals(groom_surface& s) {
  s.vertex_normals.assign(s.positions.size(), vec3{0, 0, 0});
  std::unordered_map<uint64_t, vec3> edges;
  auto key = [&](std::size_t t, int c) {
    const auto a = static_cast<uint64_t>(s.triangles[t][c]);
    const auto b = static_cast<uint64_t>(s.triangles[t][(c + 1) % 3]);
    return std::min(a, b) << 32 | std::max(a, b);
  };
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    for (int c = 0; c < 3; ++c) {
      const vec3 a = normalize_or_zero(corner(s, t, (c + 1) % 3) - corner(s, t, c));
      const vec3 b = normalize_or_zero(corner(s, t, (c + 2) % 3) - corner(s, t, c));
      const float angle = std::acos(std::clamp(glm::dot(a, b), -1.0f, 1.0f));
      s.vertex_normals[static_cast<std::size_t>(s.triangles[t][c])] += angle * s.face_normals[t];
      edges[key(t, c)] += s.face_normals[t];
    }
  }
  for (vec3& n : s.vertex_normals) n = normalize_or_zero(n);
  s.edge_normals.resize(s.triangles.size());
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    for (int c = 0; c < 3; ++c) {
      s.edge_normals[t][static_cast<std::size_t>(c)] = normalize_or_zero(edges[key(t, c)]);
    }
  }
}

void make_tree(groom_surface& s) {
  std::vector<vec3> centers(s.triangles.size());
  for (std::size_t t = 0; t < centers.size(); ++t) {
    centers[t] = (corner(s, t, 0) + corner(s, t, 1) + corner(s, t, 2)) / 3.0f;
  }
  s.order.resize(s.triangles.size());
  std::iota(s.order.begin(), s.order.end(), 0u);
  s.nodes.push_back({.first = 0, .count = static_cast<uint32_t>(s.order.size())});
  for (std::size_t i = 0; i < s.nodes.size(); ++i) {  // nodes grows within the loop
    groom_surface::node node = s.nodes[i];
    node.min = vec3{infinity, infinity, infinity};
    node.max = -node.min;
    vec3 low = node.min, high = node.max;
    for (uint32_t j = node.first; j < node.first + node.count; ++j) {
      for (int c = 0; c < 3; ++c) {
        node.min = glm::min(node.min, corner(s, s.order[j], c));
        node.max = glm::max(node.max, corner(s, s.order[j], c));
      }
      low = glm::min(low, centers[s.order[j]]);
      high = glm::max(high, centers[s.order[j]]);
    }
    if (node.count > max_leaf) {
      const vec3 size = high - low;
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      const uint32_t half = node.count / 2, first = node.first;
      const auto begin = s.order.begin() + first;
      std::nth_element(begin, begin + half, begin + node.count, [&](uint32_t a, uint32_t b) {
        return centers[a][axis] != centers[b][axis] ? centers[a][axis] < centers[b][axis] : a < b;
      });
      const uint32_t count = node.count;
      node.first = static_cast<uint32_t>(s.nodes.size());
      node.count = 0;
      s.nodes.push_back({.first = first, .count = half});
      s.nodes.push_back({.first = first + half, .count = count - half});
    }
    s.nodes[i] = node;
  }
}

struct triangle_point {
  vec3 position;
  int feature;  // 0 face, 1 to 3 edges 01 12 20, 4 to 6 vertices
};

triangle_point closest_on_triangle(const vec3& p, const vec3& a, const vec3& b, const vec3& c) {
  const vec3 ab = b - a, ac = c - a, ap = p - a;
  const float d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {a, 4};
  const vec3 bp = p - b;
  const float d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {b, 5};
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return {a + ab * (d1 / (d1 - d3)), 1};
  const vec3 cp = p - c;
  const float d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {c, 6};
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return {a + ac * (d2 / (d2 - d6)), 3};
  const float va = d3 * d6 - d5 * d4;
  const float e = d4 - d3, f = d5 - d6;
  if (va <= 0 && e >= 0 && f >= 0 && e + f > 0) return {b + (c - b) * (e / (e + f)), 2};
  const float sum = va + vb + vc;
  if (!(sum > 0)) return {a, 4};
  return {a + ab * (vb / sum) + ac * (vc / sum), 0};
}

float box_distance2(const groom_surface::node& n, const vec3& p) {
  const vec3 d = glm::max(glm::max(n.min - p, p - n.max), vec3{0, 0, 0});
  return glm::dot(d, d);
}

vec3 feature_normal(const groom_surface& s, uint32_t triangle, int feature) {
  if (feature == 0) return s.face_normals[triangle];
  if (feature < 4) return s.edge_normals[triangle][static_cast<std::size_t>(feature - 1)];
  return s.vertex_normals[static_cast<std::size_t>(s.triangles[triangle][feature - 4])];
}

// Density of hair at a point of the region, 0 outside it.
float region_density(const groom_params& p, const vec3& position, const vec3& normal) {
  for (int c = 0; c < 3; ++c) {
    if (!(position[c] >= p.region_min[c] && position[c] <= p.region_max[c])) return 0;
  }
  if (p.density_axis) {
    const vec3 axis = normalize_or_zero(vec3(*p.density_axis));
    if (glm::dot(normal, axis) < p.density_axis->w) return 0;
  }
  if (!p.region_plane) return 1;
  const float length = glm::length(vec3(*p.region_plane));
  const float depth = (glm::dot(vec3(*p.region_plane), position) - p.region_plane->w) / length;
  if (depth < 0) return 0;
  if (depth >= p.region_fade) return 1;
  const float t = depth / p.region_fade;
  return 0.1f + 0.9f * t * t * (3 - 2 * t);
}

// Whether a point of the triangle may lie in the region.
bool may_hold_roots(const groom_surface& s, std::size_t t, const groom_params& p) {
  const vec3 a = corner(s, t, 0), b = corner(s, t, 1), c = corner(s, t, 2);
  const vec3 low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
  for (int i = 0; i < 3; ++i) {
    if (high[i] < p.region_min[i] || low[i] > p.region_max[i]) return false;
  }
  if (p.density_axis &&
      glm::dot(s.face_normals[t], normalize_or_zero(vec3(*p.density_axis))) < p.density_axis->w) {
    return false;
  }
  if (!p.region_plane) return true;
  const vec3 n = vec3(*p.region_plane);
  return std::max({glm::dot(n, a), glm::dot(n, b), glm::dot(n, c)}) >= p.region_plane->w;
}

}  // namespace

groom_surface make_groom_surface(const shape_data& mesh) {
  groom_surface surface;
  weld(surface, mesh);
  if (surface.triangles.empty()) {
    throw std::invalid_argument("groom: the mesh has no faces of positive area to grow hair on");
  }
  make_pseudonormals(surface);
  make_tree(surface);
  return surface;
}

std::optional<surface_point> closest_surface_point(const groom_surface& s, const vec3& p,
                                                   float radius) {
  float best = radius * radius;
  triangle_point found = {};
  uint32_t triangle = 0;
  bool any = false;
  struct entry {
    uint32_t node;
    float distance2;
  };
  // halving bounds the depth by 32, so that the stack is large enough
  std::array<entry, 64> stack;
  std::size_t top = 0;
  stack[top++] = {0, box_distance2(s.nodes[0], p)};
  while (top != 0) {
    const entry e = stack[--top];
    if (e.distance2 >= best) continue;
    const groom_surface::node& node = s.nodes[e.node];
    if (node.count == 0) {
      entry near = {node.first, box_distance2(s.nodes[node.first], p)};
      entry far = {node.first + 1, box_distance2(s.nodes[node.first + 1], p)};
      if (far.distance2 < near.distance2) std::swap(near, far);
      if (far.distance2 < best) stack[top++] = far;
      if (near.distance2 < best) stack[top++] = near;
      continue;
    }
    for (uint32_t j = node.first; j < node.first + node.count; ++j) {
      const uint32_t t = s.order[j];
      const auto q = closest_on_triangle(p, corner(s, t, 0), corner(s, t, 1), corner(s, t, 2));
      const float d2 = glm::dot(p - q.position, p - q.position);
      if (d2 < best) {
        best = d2;
        found = q;
        triangle = t;
        any = true;
      }
    }
  }
  if (!any) return {};
  surface_point result;
  result.position = found.position;
  result.normal = feature_normal(s, triangle, found.feature);
  const bool outside = glm::dot(p - found.position, result.normal) >= 0;
  result.distance = outside ? std::sqrt(best) : -std::sqrt(best);
  const vec3 away = normalize_or_zero(outside ? p - found.position : found.position - p);
  if (best > 0 && away != vec3{0, 0, 0}) result.normal = away;
  return result;
}

std::vector<groom_root> place_roots(const groom_surface& surface, const shape_data& mesh,
                                    const groom_params& params) {
  std::vector<std::size_t> candidates;
  std::vector<ivec3> triangles;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (!may_hold_roots(surface, t, params)) continue;
    candidates.push_back(t);
    triangles.push_back(surface.triangles[t]);
  }
  const char* nothing =
      "groom: the region (its box, plane and density axis) leaves no part of the mesh";
  if (candidates.empty()) throw std::invalid_argument(nothing);
  const mesh_area_sampler sampler = make_area_sampler(triangles, surface.positions);

  std::vector<groom_root> roots(static_cast<std::size_t>(params.strands));
  for (std::size_t k = 0; k < roots.size(); ++k) {
    rng_state rng = make_rng(params.seed, k);
    // What a strand's root is must not depend on how often others were rejected.
    constexpr int max_tries = 20000;
    bool placed = false;
    for (int i = 0; i < max_tries && !placed; ++i) {
      const float rel = rand1f(rng);
      vec2 ruv;
      ruv.x = rand1f(rng);
      ruv.y = rand1f(rng);
      const mesh_sample sample = sample_area(sampler, rel, ruv);
      const std::size_t t = candidates[static_cast<std::size_t>(sample.triangle)];
      const vec3 bary = {1 - sample.uv.x - sample.uv.y, sample.uv.x, sample.uv.y};
      groom_root& root = roots[k];
      root.position = vec3{0, 0, 0};
      vec3 normal = {0, 0, 0};
      vec2 texcoord = {0, 0};
      for (int c = 0; c < 3; ++c) {
        const auto v = static_cast<std::size_t>(surface.triangles[t][c]);
        root.position += bary[c] * surface.positions[v];
        normal += bary[c] * surface.vertex_normals[v];
        if (!mesh.texcoords.empty()) {
          texcoord += bary[c] * mesh.texcoords[static_cast<std::size_t>(surface.corners[t][c])];
        }
      }
      root.texcoord = texcoord;
      root.normal = normalize_or_zero(normal);
      if (glm::dot(root.normal, surface.face_normals[t]) <= 0) {
        root.normal = surface.face_normals[t];
      }
      root.density = region_density(params, root.position, surface.face_normals[t]);
      placed = rand1f(rng) < root.density;
    }
    if (!placed) throw std::invalid_argument(nothing);
  }
  return roots;
}

}  // namespace wisp
