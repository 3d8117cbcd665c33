// Signed closest points by angle-weighted pseudonormals: Baerentzen and Aanaes,
// Signed Distance Computation Using the Angle Weighted Pseudonormal, IEEE TVCG
// 11(3), 2005.

#include "groom_surface.h"

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <unordered_map>

#include "wisp/core/rng.h"
#include "wisp/geometry/mesh.h"

namespace wisp {

namespace {

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

vec3 feature_normal(const groom_surface& s, const closest_point_result& r) {
  const auto triangle = static_cast<std::size_t>(r.element);
  const auto k = static_cast<std::size_t>(r.at.feature_index);
  switch (r.at.feature) {
    case mesh_feature::face:
      return s.face_normals[triangle];
    case mesh_feature::edge:
      return s.edge_normals[triangle][k];
    default:
      return s.vertex_normals[static_cast<std::size_t>(s.triangles[triangle][r.at.feature_index])];
  }
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
  surface.tree = make_bvh(surface.triangles, surface.positions);
  return surface;
}

std::optional<groom_surface_point> closest_surface_point(const groom_surface& s, const vec3& p,
                                                         float radius) {
  const auto r = closest_point(s.tree, dvec3(p), {.max_distance = radius});
  if (!r) return {};
  const dvec3 offset = dvec3(p) - r.at.point;
  groom_surface_point result;
  result.position = vec3(r.at.point);
  result.normal = feature_normal(s, r);
  const bool outside = glm::dot(offset, dvec3(result.normal)) >= 0;
  result.distance = static_cast<float>(outside ? r.distance : -r.distance);
  const vec3 away = normalize_or_zero(vec3(outside ? offset : -offset));
  if (away != vec3{0, 0, 0}) result.normal = away;
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
