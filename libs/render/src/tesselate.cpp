// Subdivision surfaces with displacement, with the meaning that Yocto/GL gives
// to the same fields: texture coordinates keep their borders, positions and
// normals are refined by their own topologies.

#include "wisp/render/tesselate.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "wisp/core/rng.h"
#include "wisp/geometry/mesh.h"
#include "wisp/geometry/subdivide.h"
#include "wisp/render/image.h"

namespace wisp {

namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

[[noreturn]] void fail(const scene_data& scene, std::size_t index, const std::string& key,
                       const std::string& reason) {
  throw file_error(scene.path.string(), fmt::format("subdivs[{}]{}", index, key), reason);
}

void check_faces(const scene_data& scene, std::size_t index, const std::vector<ivec4>& quads,
                 std::size_t faces, std::size_t vertices, const char* what) {
  if (quads.empty() && what != std::string("position")) return;
  if (quads.size() != faces)
    fail(scene, index, "",
         fmt::format("has {} faces by {} and {} by position; the numbers must agree", quads.size(),
                     what, faces));
  for (std::size_t f = 0; f < faces; f++)
    for (int k = 0; k < 4; k++)
      if (quads[f][k] < 0 || at(quads[f][k]) >= vertices)
        fail(scene, index, "",
             fmt::format("face {} has the {} index {}; there are {}", f, what, quads[f][k],
                         vertices));
}

// A face counts as a triangle when its last two indices agree. Where a face is
// a quad by position and its normals or texture coordinates happen to agree
// there (or the other way round), refinement would split the two differently;
// so these follow the positions, with a copy of the vertex where one is needed.
template <typename T>
void follow_positions(const std::vector<ivec4>& quadspos, std::vector<ivec4>& quads,
                      std::vector<T>& vertices) {
  for (std::size_t f = 0; f < quads.size(); f++) {
    bool triangle = quadspos[f].z == quadspos[f].w;
    if (triangle) {
      quads[f].w = quads[f].z;
    } else if (quads[f].z == quads[f].w) {
      T copy = vertices[at(quads[f].z)];
      quads[f].w = static_cast<int>(vertices.size());
      vertices.push_back(copy);
    }
  }
}

template <typename T>
void refine(std::vector<ivec4>& quads, std::vector<T>& vertices, int levels, bool catmullclark,
            bool lock_boundary) {
  if (quads.empty()) return;
  quad_mesh<T> mesh{std::move(quads), std::move(vertices)};
  for (int level = 0; level < levels; level++)
    mesh = catmullclark ? subdivide_catmullclark(mesh, lock_boundary) : subdivide_linear(mesh);
  quads = std::move(mesh.quads);
  vertices = std::move(mesh.vertices);
}

// Moves each position by the mean over its face corners of what the texture
// says there, since texture coordinates may differ across a seam.
void displace(const scene_data& scene, std::size_t index, subdiv_data& subdiv) {
  if (subdiv.displacement_tex < 0 || at(subdiv.displacement_tex) >= scene.textures.size())
    fail(scene, index, ".displacement_tex",
         fmt::format("index {} is out of range; the scene has {} textures", subdiv.displacement_tex,
                     scene.textures.size()));
  const texture_data& texture = scene.textures[at(subdiv.displacement_tex)];
  if (texture.pixelsb.empty() && texture.pixelsf.empty())
    fail(scene, index, ".displacement_tex",
         fmt::format("the texture '{}' is not loaded", texture.name));
  if (subdiv.quadstexcoord.empty())
    fail(scene, index, ".displacement_tex",
         "the mesh has no texture coordinates, which displacement needs");

  float bias = texture.pixelsb.empty() ? 0.0f : 0.5f;
  std::vector<float> offset(subdiv.positions.size(), 0.0f);
  std::vector<int> count(subdiv.positions.size(), 0);
  for (std::size_t f = 0; f < subdiv.quadspos.size(); f++) {
    const ivec4& q = subdiv.quadspos[f];
    for (int k = 0; k < (q.z == q.w ? 3 : 4); k++) {
      vec4 value = eval_texture(texture, subdiv.texcoords[at(subdiv.quadstexcoord[f][k])], true);
      offset[at(q[k])] += (value.x + value.y + value.z) / 3 - bias;
      count[at(q[k])]++;
    }
  }
  std::vector<vec3> normals = vertex_normals({}, subdiv.quadspos, subdiv.positions);
  for (std::size_t v = 0; v < subdiv.positions.size(); v++) {
    if (count[v] == 0) continue;
    float d = subdiv.displacement * offset[v] / static_cast<float>(count[v]);
    if (std::isfinite(d)) subdiv.positions[v] += normals[v] * d;
  }
}

// Numbers the distinct (position, normal, texcoord) triples in the order in
// which the faces name them.
shape_data split_facevarying(const subdiv_data& subdiv) {
  shape_data shape;
  shape.quads.reserve(subdiv.quadspos.size());
  // The smallest power of two that holds the usual count twice; grows by need.
  std::size_t capacity = std::bit_ceil(subdiv.positions.size() * 2 + 16);
  std::vector<int> table(capacity, -1);
  std::vector<ivec3> corners;
  auto slot_of = [&](const ivec3& c) {
    uint64_t h = hash64((static_cast<uint64_t>(static_cast<uint32_t>(c.x)) << 32) |
                        static_cast<uint32_t>(c.z));
    h = hash64(h ^ static_cast<uint32_t>(c.y));
    std::size_t slot = static_cast<std::size_t>(h) & (capacity - 1);
    while (table[slot] >= 0 && corners[at(table[slot])] != c) slot = (slot + 1) & (capacity - 1);
    return slot;
  };
  auto vertex_of = [&](const ivec3& c) {
    std::size_t slot = slot_of(c);
    if (table[slot] >= 0) return table[slot];
    if (corners.size() * 2 >= capacity) {
      capacity *= 2;
      table.assign(capacity, -1);
      for (std::size_t i = 0; i < corners.size(); i++)
        table[slot_of(corners[i])] = static_cast<int>(i);
      slot = slot_of(c);
    }
    auto id = static_cast<int>(corners.size());
    corners.push_back(c);
    table[slot] = id;
    shape.positions.push_back(subdiv.positions[at(c.x)]);
    if (c.y >= 0) shape.normals.push_back(subdiv.normals[at(c.y)]);
    if (c.z >= 0) shape.texcoords.push_back(subdiv.texcoords[at(c.z)]);
    return id;
  };
  for (std::size_t f = 0; f < subdiv.quadspos.size(); f++) {
    ivec4 quad;
    for (int k = 0; k < 4; k++)
      quad[k] =
          vertex_of({subdiv.quadspos[f][k], subdiv.quadsnorm.empty() ? -1 : subdiv.quadsnorm[f][k],
                     subdiv.quadstexcoord.empty() ? -1 : subdiv.quadstexcoord[f][k]});
    shape.quads.push_back(quad);
  }
  return shape;
}

shape_data tesselate(const scene_data& scene, std::size_t index) {
  subdiv_data subdiv = scene.subdivs[index];
  std::size_t faces = subdiv.quadspos.size();
  check_faces(scene, index, subdiv.quadspos, faces, subdiv.positions.size(), "position");
  check_faces(scene, index, subdiv.quadsnorm, faces, subdiv.normals.size(), "normal");
  check_faces(scene, index, subdiv.quadstexcoord, faces, subdiv.texcoords.size(),
              "texture coordinate");
  if (subdiv.subdivisions < 0)
    fail(scene, index, ".subdivisions",
         fmt::format("is {}; it must be 0 or more", subdiv.subdivisions));
  if (count_subdiv_faces(subdiv) > max_subdiv_faces)
    fail(scene, index, ".subdivisions",
         fmt::format("{} subdivisions of {} faces make more than {} faces; use fewer",
                     subdiv.subdivisions, faces, max_subdiv_faces));

  bool displaced = subdiv.displacement != 0 && subdiv.displacement_tex != invalid_id;
  // The normals of the file belong to the unrefined, undisplaced surface.
  if (subdiv.subdivisions > 0 || displaced || subdiv.quadsnorm.empty()) {
    subdiv.quadsnorm = {};
    subdiv.normals = {};
  }
  follow_positions(subdiv.quadspos, subdiv.quadstexcoord, subdiv.texcoords);
  follow_positions(subdiv.quadspos, subdiv.quadsnorm, subdiv.normals);
  refine(subdiv.quadstexcoord, subdiv.texcoords, subdiv.subdivisions, subdiv.catmullclark, true);
  refine(subdiv.quadspos, subdiv.positions, subdiv.subdivisions, subdiv.catmullclark, false);
  if (displaced) displace(scene, index, subdiv);
  if (subdiv.smooth && subdiv.quadsnorm.empty() && !subdiv.quadspos.empty()) {
    subdiv.normals = vertex_normals({}, subdiv.quadspos, subdiv.positions);
    subdiv.quadsnorm = subdiv.quadspos;
  }
  return split_facevarying(subdiv);
}

}  // namespace

int64_t count_subdiv_faces(const subdiv_data& subdiv) {
  int64_t triangles = 0;
  for (const ivec4& q : subdiv.quadspos) triangles += q.z == q.w;
  auto total = static_cast<int64_t>(subdiv.quadspos.size());
  if (subdiv.subdivisions <= 0 || total == 0) return total;
  total = triangles * 3 + (total - triangles) * 4;
  for (int level = 1; level < subdiv.subdivisions && total <= max_subdiv_faces; level++) total *= 4;
  return total;
}

void tesselate_subdivs(scene_data& scene) {
  std::vector<bool> used(scene.shapes.size(), false);
  for (const auto& instance : scene.instances)
    if (instance.shape >= 0 && at(instance.shape) < used.size()) used[at(instance.shape)] = true;
  std::vector<int> last(scene.shapes.size(), invalid_id);
  for (std::size_t i = 0; i < scene.subdivs.size(); i++) {
    int shape = scene.subdivs[i].shape;
    if (shape >= 0 && at(shape) < last.size()) last[at(shape)] = static_cast<int>(i);
  }
  for (std::size_t s = 0; s < scene.shapes.size(); s++) {
    if (!used[s] || last[s] == invalid_id) continue;
    std::string name = std::move(scene.shapes[s].name);
    surface_paint paint = std::move(scene.shapes[s].paint);
    scene.shapes[s] = tesselate(scene, at(last[s]));
    scene.shapes[s].name = std::move(name);
    scene.shapes[s].paint = std::move(paint);
  }
}

}  // namespace wisp
