#pragma once

// What the parts of the glTF reader share. The reader is in layers:
//   gltf_file.cpp      bytes, JSON, buffers, images: after it, tinygltf's model
//   gltf_accessor.cpp  typed arrays out of buffers, bounds-checked
//   gltf_material.cpp  materials and textures
//   gltf_mesh.cpp      primitives to shapes
//   gltf.cpp           nodes, cameras, lights: the scene

#include <tiny_gltf.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "wisp/core/error.h"
#include "wisp/scene/scene.h"

namespace wisp::gltf_detail {

// An image as the file names it: a uri (of a file, or data), or a buffer view.
struct gltf_image {
  std::string name = "";
  std::string uri = "";
  int buffer_view = -1;
};

// A parsed file. Buffers and images are kept out of tinygltf's hands, which
// would decode every image and does not check all of their bounds.
struct gltf_file {
  std::filesystem::path path = "";
  tinygltf::Model model = {};
  std::vector<uint8_t> bytes = {};                 // the file itself, for .glb
  std::vector<std::vector<uint8_t>> storage = {};  // buffers of other files and data URIs
  std::vector<std::span<const uint8_t>> buffers = {};
  std::vector<gltf_image> images = {};
  std::size_t data_bytes = 0;  // of the file and all buffers
  bool has_animations = false;
  bool has_skins = false;
};

// gltf_file.cpp

[[noreturn]] void fail(const gltf_file& file, const std::string& place, const std::string& reason);
gltf_file read_gltf_file(const std::filesystem::path& path, warning_list& warnings);
// A whole regular file. Throws file_error in the name of `file` and `place`.
std::vector<uint8_t> read_bytes(const std::filesystem::path& path, const std::string& file,
                                const std::string& place);
bool is_data_uri(const std::string& uri);
// The bytes of a base64 data URI; none when it is malformed.
std::optional<std::vector<uint8_t>> decode_data_uri(const std::string& uri);
// The file that a relative uri names. Throws for network addresses.
std::filesystem::path resolve_uri(const gltf_file& file, const std::string& uri,
                                  const std::string& place);

// gltf_accessor.cpp

// The bytes of a buffer view.
std::span<const uint8_t> view_bytes(const gltf_file& file, int view, const std::string& place);
// Number of components (1 to 4, 4, 9, 16) of an accessor.
int accessor_components(const gltf_file& file, int accessor, const std::string& place);
// All elements as floats, `components` each; normalised integers are scaled.
std::vector<float> read_floats(const gltf_file& file, int accessor, int components,
                               const std::string& place);
std::vector<uint32_t> read_indices(const gltf_file& file, int accessor, const std::string& place);

// How a material's textures look coordinates up (KHR_texture_transform).
struct texcoord_mapping {
  int set = 0;
  vec2 offset = {0, 0};
  vec2 scale = {1, 1};
  float rotation = 0;
  bool operator==(const texcoord_mapping&) const = default;
};

// A shape with its material, as instances of a mesh use them.
struct mesh_part {
  int shape = invalid_id;
  int material = invalid_id;
};

struct gltf_loader {
  const gltf_file& file;
  scene_data& scene;
  warning_list& warnings;

  std::map<std::pair<int, bool>, int> materials = {};  // (glTF material, of strands)
  std::map<std::tuple<int, bool, bool, bool, bool>, int> textures = {};
  std::map<int, std::vector<mesh_part>> meshes = {};
  std::set<std::string> warned = {};
};

// Adds a warning with its place, once.
void warn(gltf_loader& loader, const std::string& place, const std::string& reason);

// gltf_material.cpp

// The scene's material for a glTF material (-1: the default one), made on first
// use. Strands get a hair material.
int get_material(gltf_loader& loader, int material, bool strands);
texcoord_mapping get_texcoord_mapping(const gltf_loader& loader, int material);
// A member of a JSON object of tinygltf, or the default.
double get_number(const tinygltf::Value& object, const std::string& key, double otherwise);

// gltf_mesh.cpp

// The scene's shapes and materials for a mesh, made on first use.
const std::vector<mesh_part>& get_mesh(gltf_loader& loader, int mesh);
// Joins line segments that share end points into strands: lists of vertices,
// in the order and direction in which their segments come. Where more than two
// segments meet, strands end. Closed loops repeat their first vertex.
std::vector<std::vector<uint32_t>> chain_segments(
    const std::vector<std::pair<uint32_t, uint32_t>>& segments, std::size_t vertices);

}  // namespace wisp::gltf_detail
