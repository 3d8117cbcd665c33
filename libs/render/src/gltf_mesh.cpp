// Meshes of glTF 2.0 (section 3.7) as shapes: triangles, points and strands.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "gltf_internal.h"

namespace wisp::gltf_detail {

namespace {

constexpr float default_radius = 1.0f / 2000;  // of the diagonal of a shape's box

// One primitive, read and made safe: indices in range, positions finite.
struct primitive_data {
  std::vector<ivec3> triangles = {};
  std::vector<int> points = {};
  std::vector<std::vector<uint32_t>> strands = {};  // lists of vertices
  std::vector<vec3> positions = {};
  std::vector<vec3> normals = {};
  std::vector<vec2> texcoords = {};
  std::vector<vec4> colors = {};
  std::vector<vec4> tangents = {};
  std::vector<float> radius = {};
};

bool is_strand_mode(int mode) {
  return mode == TINYGLTF_MODE_LINE || mode == TINYGLTF_MODE_LINE_LOOP ||
         mode == TINYGLTF_MODE_LINE_STRIP;
}

int find_attribute(const tinygltf::Primitive& primitive, const std::string& name) {
  auto it = primitive.attributes.find(name);
  return it != primitive.attributes.end() ? it->second : -1;
}

template <typename Vec>
std::vector<Vec> to_vectors(const std::vector<float>& values) {
  constexpr auto n = static_cast<std::size_t>(Vec::length());
  std::vector<Vec> result(values.size() / n);
  for (std::size_t i = 0; i < result.size(); i++)
    for (std::size_t c = 0; c < n; c++) result[i][static_cast<int>(c)] = values[i * n + c];
  return result;
}

// The primitive's list of vertices: its indices, or all in order.
std::vector<uint32_t> element_vertices(const gltf_loader& loader,
                                       const tinygltf::Primitive& primitive, std::size_t vertices,
                                       const std::string& place) {
  std::vector<uint32_t> list;
  if (primitive.indices >= 0) {
    list = read_indices(loader.file, primitive.indices, place + ".indices");
    for (auto index : list)
      if (index >= vertices)
        fail(loader.file, place + ".indices",
             fmt::format("index {} is out of range: the primitive has {} vertices", index,
                         vertices));
  } else {
    list.resize(vertices);
    std::iota(list.begin(), list.end(), 0u);
  }
  return list;
}

std::vector<ivec3> make_triangles(const std::vector<uint32_t>& v, int mode) {
  std::vector<ivec3> triangles;
  auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    ivec3 t{static_cast<int>(v[a]), static_cast<int>(v[b]), static_cast<int>(v[c])};
    if (t.x != t.y && t.y != t.z && t.z != t.x) triangles.push_back(t);
  };
  if (mode == TINYGLTF_MODE_TRIANGLES)
    for (std::size_t i = 0; i + 2 < v.size(); i += 3) add(i, i + 1, i + 2);
  if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
    for (std::size_t i = 0; i + 2 < v.size(); i++) add(i, i + 1 + i % 2, i + 2 - i % 2);
  if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
    for (std::size_t i = 0; i + 2 < v.size(); i++) add(i + 1, i + 2, 0);
  return triangles;
}

std::vector<std::vector<uint32_t>> make_strands(const std::vector<uint32_t>& v, int mode,
                                                std::size_t vertices) {
  if (mode == TINYGLTF_MODE_LINE) {
    std::vector<std::pair<uint32_t, uint32_t>> segments;
    for (std::size_t i = 0; i + 1 < v.size(); i += 2) segments.emplace_back(v[i], v[i + 1]);
    return chain_segments(segments, vertices);
  }
  auto strand = v;
  if (mode == TINYGLTF_MODE_LINE_LOOP && strand.size() > 2) strand.push_back(strand.front());
  strand.erase(std::unique(strand.begin(), strand.end()), strand.end());
  return {strand};
}

// Drops elements with vertices that are not finite and strands without length.
void drop_bad_elements(gltf_loader& loader, primitive_data& data, const std::string& place) {
  const auto& positions = data.positions;
  auto bad = [&](auto i) { return !is_finite(positions[static_cast<std::size_t>(i)]); };
  std::size_t dropped = 0;
  dropped += std::erase_if(data.triangles,
                           [&](const ivec3& t) { return bad(t.x) || bad(t.y) || bad(t.z); });
  dropped += std::erase_if(data.points, bad);
  dropped += std::erase_if(data.strands, [&](const std::vector<uint32_t>& s) {
    return std::any_of(s.begin(), s.end(), bad);
  });
  if (dropped > 0)
    warn(loader, place,
         fmt::format("{} elements with vertices that are not finite are left out", dropped));
  dropped = std::erase_if(data.strands, [&](const std::vector<uint32_t>& s) {
    return std::all_of(s.begin(), s.end(),
                       [&](uint32_t i) { return positions[i] == positions[s[0]]; });
  });
  if (dropped > 0)
    warn(loader, place, fmt::format("{} strands without length are left out", dropped));
}

template <typename Vec>
std::vector<Vec> read_vectors(const gltf_loader& loader, const tinygltf::Primitive& primitive,
                              const std::string& name, std::size_t vertices,
                              const std::string& place) {
  int accessor = find_attribute(primitive, name);
  if (accessor < 0) return {};
  auto where = place + "." + name;
  auto result = to_vectors<Vec>(read_floats(loader.file, accessor, Vec::length(), where));
  if (result.size() != vertices)
    fail(loader.file, where,
         fmt::format("has {} elements, where POSITION has {}", result.size(), vertices));
  return result;
}

template <typename Vec>
bool all_finite(const std::vector<Vec>& values) {
  for (const auto& v : values)
    for (int c = 0; c < Vec::length(); c++)
      if (!std::isfinite(v[c])) return false;
  return true;
}

// u' = T R S u with the rotation counter-clockwise in the image, as the
// extension's example of the rotated lower left quadrant has it.
void map_texcoords(std::vector<vec2>& texcoords, const texcoord_mapping& mapping) {
  if (mapping.offset == vec2{0, 0} && mapping.scale == vec2{1, 1} && mapping.rotation == 0) return;
  float c = std::cos(mapping.rotation), s = std::sin(mapping.rotation);
  for (auto& uv : texcoords) {
    vec2 p = uv * mapping.scale;
    uv = vec2{c * p.x + s * p.y, -s * p.x + c * p.y} + mapping.offset;
  }
}

void read_attributes(gltf_loader& loader, const tinygltf::Primitive& primitive,
                     primitive_data& data, const std::string& place) {
  std::size_t n = data.positions.size();
  data.normals = read_vectors<vec3>(loader, primitive, "NORMAL", n, place);
  data.tangents = read_vectors<vec4>(loader, primitive, "TANGENT", n, place);
  auto mapping = get_texcoord_mapping(loader, primitive.material);
  data.texcoords =
      read_vectors<vec2>(loader, primitive, fmt::format("TEXCOORD_{}", mapping.set), n, place);
  map_texcoords(data.texcoords, mapping);
  if (int color = find_attribute(primitive, "COLOR_0"); color >= 0) {
    if (accessor_components(loader.file, color, place + ".COLOR_0") == 3) {
      for (const auto& rgb : read_vectors<vec3>(loader, primitive, "COLOR_0", n, place))
        data.colors.emplace_back(rgb, 1.0f);
    } else {
      data.colors = read_vectors<vec4>(loader, primitive, "COLOR_0", n, place);
    }
  }
  if (find_attribute(primitive, "_RADIUS") >= 0)
    for (const auto& r : read_vectors<glm::vec<1, float>>(loader, primitive, "_RADIUS", n, place))
      data.radius.push_back(r.x);

  auto check = [&](auto& values, const char* name) {
    if (all_finite(values)) return;
    warn(loader, place, fmt::format("{} has values that are not finite; it is left out", name));
    values.clear();
  };
  check(data.normals, "NORMAL");
  check(data.tangents, "TANGENT");
  check(data.texcoords, "TEXCOORD");
  check(data.colors, "COLOR_0");
}

std::optional<primitive_data> read_primitive(gltf_loader& loader,
                                             const tinygltf::Primitive& primitive,
                                             const std::string& place) {
  const auto& file = loader.file;
  int position = find_attribute(primitive, "POSITION");
  if (position < 0) {
    warn(loader, place, "has no POSITION; it is left out");
    return {};
  }
  if (primitive.extensions.count("KHR_draco_mesh_compression") != 0 &&
      static_cast<std::size_t>(position) < file.model.accessors.size() &&
      file.model.accessors[static_cast<std::size_t>(position)].bufferView < 0)
    fail(file, place,
         "is compressed with KHR_draco_mesh_compression, which is not supported; decompress the "
         "file first");
  if (!primitive.targets.empty())
    warn(loader, "meshes", "morph targets are not supported; the base shapes are used");

  primitive_data data;
  data.positions = to_vectors<vec3>(read_floats(file, position, 3, place + ".POSITION"));
  if (data.positions.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    fail(file, place, "has too many vertices");
  auto list = element_vertices(loader, primitive, data.positions.size(), place);
  switch (primitive.mode) {
    case TINYGLTF_MODE_POINTS:
      data.points.assign(list.begin(), list.end());
      break;
    case TINYGLTF_MODE_LINE:
    case TINYGLTF_MODE_LINE_LOOP:
    case TINYGLTF_MODE_LINE_STRIP:
      data.strands = make_strands(list, primitive.mode, data.positions.size());
      break;
    case TINYGLTF_MODE_TRIANGLES:
    case TINYGLTF_MODE_TRIANGLE_STRIP:
    case TINYGLTF_MODE_TRIANGLE_FAN:
      data.triangles = make_triangles(list, primitive.mode);
      break;
    default:
      fail(file, place + ".mode",
           fmt::format("{} is not one of glTF's modes, 0 to 6", primitive.mode));
  }
  drop_bad_elements(loader, data, place);
  read_attributes(loader, primitive, data, place);
  return data;
}

template <typename T>
void gather(std::vector<T>& to, const std::vector<T>& from, const std::vector<uint32_t>& vertices,
            std::size_t before, const T& otherwise) {
  // Once one primitive of a shape has an attribute, all vertices need it.
  if (from.empty() && to.empty()) return;
  to.resize(before, otherwise);
  for (auto v : vertices) to.push_back(from.empty() ? otherwise : from[v]);
}

// Appends the given vertices of a primitive to a shape.
void append_vertices(shape_data& shape, const primitive_data& data,
                     const std::vector<uint32_t>& vertices, bool strands) {
  std::size_t before = shape.positions.size();
  gather(shape.positions, data.positions, vertices, before, vec3{0});
  gather(shape.texcoords, data.texcoords, vertices, before, vec2{0});
  gather(shape.colors, data.colors, vertices, before, vec4{1});
  gather(shape.radius, data.radius, vertices, before, 0.0f);
  if (strands) return;  // curves make their own normals
  gather(shape.normals, data.normals, vertices, before, vec3{0});
  gather(shape.tangents, data.tangents, vertices, before, vec4{0});
}

void append_strands(shape_data& shape, const primitive_data& data) {
  if (shape.strands.empty()) shape.strands = {0};
  for (const auto& strand : data.strands) {
    append_vertices(shape, data, strand, true);
    shape.strands.push_back(static_cast<uint32_t>(shape.positions.size()));
  }
}

// Primitives of a mesh often share one large set of vertices: a shape gets
// those that its elements use.
shape_data make_face_shape(const primitive_data& data) {
  shape_data shape;
  std::vector<int> renamed(data.positions.size(), -1);
  std::vector<uint32_t> vertices;
  auto rename = [&](int v) {
    auto& name = renamed[static_cast<std::size_t>(v)];
    if (name < 0) {
      name = static_cast<int>(vertices.size());
      vertices.push_back(static_cast<uint32_t>(v));
    }
    return name;
  };
  shape.triangles.reserve(data.triangles.size());
  for (const auto& t : data.triangles) {
    int a = rename(t.x), b = rename(t.y), c = rename(t.z);
    shape.triangles.push_back({a, b, c});
  }
  shape.points.reserve(data.points.size());
  for (int p : data.points) shape.points.push_back(rename(p));
  append_vertices(shape, data, vertices, false);
  return shape;
}

// Radii that are missing or make no sense get a default that suits the size.
void set_radius(shape_data& shape) {
  if (shape.points.empty() && shape.strands.empty()) return;
  vec3 low{infinity}, high{-infinity};
  for (const auto& p : shape.positions) low = glm::min(low, p), high = glm::max(high, p);
  float diagonal = shape.positions.empty() ? 0 : glm::length(high - low);
  float radius = std::isfinite(diagonal) && diagonal > 0 ? diagonal * default_radius : 0.001f;
  shape.radius.resize(shape.positions.size(), 0.0f);
  for (auto& r : shape.radius)
    if (!(r > 0) || !std::isfinite(r)) r = radius;
}

}  // namespace

std::vector<std::vector<uint32_t>> chain_segments(
    const std::vector<std::pair<uint32_t, uint32_t>>& segments, std::size_t vertices) {
  // For each vertex the segments that touch it, as ranges of one list.
  std::vector<uint32_t> first(vertices + 1, 0), touching;
  auto is_empty = [](const auto& s) { return s.first == s.second; };
  for (const auto& s : segments)
    if (!is_empty(s)) first[s.first + 1]++, first[s.second + 1]++;
  std::partial_sum(first.begin(), first.end(), first.begin());
  touching.resize(first.back());
  auto next = first;
  for (std::size_t i = 0; i < segments.size(); i++) {
    if (is_empty(segments[i])) continue;
    touching[next[segments[i].first]++] = static_cast<uint32_t>(i);
    touching[next[segments[i].second]++] = static_cast<uint32_t>(i);
  }
  auto is_end = [&](uint32_t v) { return first[v + 1] - first[v] != 2; };

  std::vector<bool> done(segments.size(), false);
  std::vector<std::vector<uint32_t>> strands;
  auto walk = [&](std::size_t segment, uint32_t from) {
    std::vector<uint32_t> strand = {from};
    for (uint32_t at = from;;) {
      done[segment] = true;
      const auto& s = segments[segment];
      at = s.first == at ? s.second : s.first;
      strand.push_back(at);
      if (is_end(at)) break;
      std::size_t a = touching[first[at]], b = touching[first[at] + 1];
      if (done[a] && done[b]) break;  // a loop is closed
      segment = done[a] ? b : a;
    }
    strands.push_back(std::move(strand));
  };
  // Chains from the ends that their segments point away from; then those that
  // no such end begins; then loops.
  auto pass = [&](auto&& starts) {
    for (std::size_t i = 0; i < segments.size(); i++)
      if (!done[i] && !is_empty(segments[i])) starts(i, segments[i].first, segments[i].second);
  };
  pass([&](std::size_t i, uint32_t a, uint32_t) {
    if (is_end(a)) walk(i, a);
  });
  pass([&](std::size_t i, uint32_t, uint32_t b) {
    if (is_end(b)) walk(i, b);
  });
  pass([&](std::size_t i, uint32_t a, uint32_t) { walk(i, a); });
  return strands;
}

const std::vector<mesh_part>& get_mesh(gltf_loader& loader, int index) {
  if (auto it = loader.meshes.find(index); it != loader.meshes.end()) return it->second;
  const auto& mesh = loader.file.model.meshes[static_cast<std::size_t>(index)];
  std::vector<shape_data> shapes;
  std::vector<int> materials;
  // Strands come as one primitive each in some files: those of one material
  // make one shape.
  std::map<int, std::size_t> strand_shapes;
  for (std::size_t i = 0; i < mesh.primitives.size(); i++) {
    const auto& primitive = mesh.primitives[i];
    auto place = fmt::format("meshes[{}].primitives[{}]", index, i);
    auto data = read_primitive(loader, primitive, place);
    if (!data || (data->triangles.empty() && data->points.empty() && data->strands.empty()))
      continue;
    bool strands = is_strand_mode(primitive.mode);
    int material = get_material(loader, primitive.material, strands);
    if (strands) {
      auto [it, added] = strand_shapes.try_emplace(material, shapes.size());
      if (added) shapes.emplace_back(), materials.push_back(material);
      append_strands(shapes[it->second], *data);
    } else {
      shapes.push_back(make_face_shape(*data));
      materials.push_back(material);
    }
  }
  std::vector<mesh_part> parts;
  auto name = mesh.name.empty() ? fmt::format("mesh{}", index) : mesh.name;
  for (std::size_t i = 0; i < shapes.size(); i++) {
    set_radius(shapes[i]);
    shapes[i].name = shapes.size() == 1 ? name : fmt::format("{}.{}", name, i);
    parts.push_back({static_cast<int>(loader.scene.shapes.size()), materials[i]});
    loader.scene.shapes.push_back(std::move(shapes[i]));
  }
  return loader.meshes[index] = std::move(parts);
}

}  // namespace wisp::gltf_detail
