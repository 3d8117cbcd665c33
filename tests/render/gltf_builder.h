#pragma once

// Small glTF files, made in memory, for the tests of the reader.

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "wisp/render/gltf.h"

namespace gltf_test {

using namespace wisp;
namespace fs = std::filesystem;

struct temporary_folder {
  fs::path path =
      fs::temp_directory_path() / ("wisp-test-gltf-" + std::to_string(std::random_device{}()));
  temporary_folder() { fs::create_directories(path); }
  temporary_folder(const temporary_folder&) = delete;
  temporary_folder& operator=(const temporary_folder&) = delete;
  ~temporary_folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

inline void write_all(const fs::path& path, const std::string& bytes) {
  std::ofstream out(path, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

inline std::string base64(const std::string& bytes) {
  const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t v = 0;
    for (std::size_t k = 0; k < 3; k++)
      v = v << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; k++)
      out += i + k <= bytes.size() ? digits[v >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

// Collects bytes, views and accessors, and writes the JSON around them.
struct builder {
  std::string bytes = "", views = "", accessors = "";
  int view_count = 0, accessor_count = 0;

  template <typename T>
  int view(const std::vector<T>& data, int stride = 0) {
    while (bytes.size() % 4) bytes += '\0';
    auto offset = bytes.size();
    bytes.append(reinterpret_cast<const char*>(data.data()), data.size() * sizeof(T));
    if (view_count++) views += ",";
    views += R"({"buffer":0,"byteOffset":)" + std::to_string(offset) + R"(,"byteLength":)" +
             std::to_string(data.size() * sizeof(T)) +
             (stride ? R"(,"byteStride":)" + std::to_string(stride) : "") + "}";
    return view_count - 1;
  }
  int accessor(int view, int type, std::size_t count, const std::string& shape,
               const std::string& more = "") {
    if (accessor_count++) accessors += ",";
    accessors += "{";
    if (view >= 0) accessors += R"("bufferView":)" + std::to_string(view) + ",";
    accessors += R"("componentType":)" + std::to_string(type) + R"(,"count":)" +
                 std::to_string(count) + R"(,"type":")" + shape + "\"" + more + "}";
    return accessor_count - 1;
  }
  int floats(const std::vector<float>& data, std::size_t n, const std::string& shape) {
    return accessor(view(data), 5126, data.size() / n, shape);
  }
  int vec3s(const std::vector<float>& data) { return floats(data, 3, "VEC3"); }
  int shorts(const std::vector<uint16_t>& data) {
    return accessor(view(data), 5123, data.size(), "SCALAR");
  }

  std::string json(const std::string& rest, bool with_uri) const {
    std::string out = R"({"asset":{"version":"2.0"})";
    if (!bytes.empty())
      out += R"(,"buffers":[{"byteLength":)" + std::to_string(bytes.size()) +
             (with_uri ? R"(,"uri":"data:application/octet-stream;base64,)" + base64(bytes) + "\""
                       : "") +
             "}]";
    if (view_count) out += R"(,"bufferViews":[)" + views + "]";
    if (accessor_count) out += R"(,"accessors":[)" + accessors + "]";
    return out + "," + rest + "}";
  }
  std::string glb(const std::string& rest) const {
    auto text = json(rest, false);
    auto data = bytes;
    while (text.size() % 4) text += ' ';
    while (data.size() % 4) data += '\0';
    std::string out = "glTF";
    auto u32 = [&](std::size_t v) {
      auto value = static_cast<uint32_t>(v);
      out.append(reinterpret_cast<const char*>(&value), 4);
    };
    u32(2), u32(12 + 8 + text.size() + 8 + data.size());
    u32(text.size()), out += "JSON" + text;
    u32(data.size()), out += std::string("BIN\0", 4) + data;
    return out;
  }
};

inline std::string mesh_scene(const std::string& primitives, const std::string& more = "") {
  return R"("scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"name":"m","primitives":[)" +
         primitives + "]}]" + more;
}

struct loaded {
  scene_data scene = {};
  warning_list warnings = {};
};

inline loaded load_text(const std::string& text, const char* name = "scene.gltf") {
  temporary_folder folder;
  auto path = folder.path / name;
  write_all(path, text);
  loaded result;
  result.scene = load_gltf_scene(path, result.warnings);
  return result;
}

inline std::string error_of(const std::string& text, const char* name = "scene.gltf") {
  try {
    load_text(text, name);
  } catch (const file_error& error) {
    return error.what();
  }
  return "";
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}
inline bool has_warning(const loaded& l, const std::string& part) {
  for (const auto& w : l.warnings)
    if (contains(w, part)) return true;
  return false;
}

inline const std::vector<float> square = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};

inline void check_vec(const vec3& a, const vec3& b) {
  for (int c = 0; c < 3; c++) CHECK(a[c] == doctest::Approx(b[c]).epsilon(1e-5));
}

}  // namespace gltf_test
