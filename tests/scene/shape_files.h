#pragma once

// Files for the tests of shape formats.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "wisp/scene/io.h"

namespace wisp::test {

// A folder of a test's own that goes away with it.
struct scratch_folder {
  std::filesystem::path path;

  scratch_folder() {
    std::random_device device;
    path = std::filesystem::temp_directory_path() /
           ("wisp_shape_" + std::to_string(device()) + "_" + std::to_string(device()));
    std::filesystem::create_directories(path);
  }
  scratch_folder(const scratch_folder&) = delete;
  scratch_folder& operator=(const scratch_folder&) = delete;
  ~scratch_folder() {
    std::error_code error;
    std::filesystem::remove_all(path, error);
  }
};

inline void put_file(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream stream(path, std::ios::binary | std::ios::trunc);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  REQUIRE(stream.good());
}

inline std::string get_file(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

// What load_shape makes of a file of this name with these bytes.
inline shape_data load_bytes(const std::string& name, const std::string& bytes,
                             warning_list& warnings, const shape_read_options& options = {}) {
  const scratch_folder folder;
  put_file(folder.path / name, bytes);
  return load_shape(folder.path / name, warnings, options);
}

inline subdiv_data load_subdiv_bytes(const std::string& name, const std::string& bytes,
                                     warning_list& warnings) {
  const scratch_folder folder;
  put_file(folder.path / name, bytes);
  return load_subdiv_mesh(folder.path / name, warnings);
}

// The message of the file_error that loading must throw, without the file's name.
inline std::string load_error(const std::string& name, const std::string& bytes) {
  warning_list warnings;
  try {
    load_bytes(name, bytes, warnings);
  } catch (const file_error& error) {
    CHECK(error.file.find(name) != std::string::npos);
    return error.place + ": " + error.reason;
  }
  return "loaded";
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// Bytes of a value in either order.
template <typename T>
std::string raw(T value, bool big = false) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (big != (std::endian::native == std::endian::big)) std::reverse(bytes.begin(), bytes.end());
  return {bytes.data(), bytes.size()};
}

// A triangle, a quad and every attribute.
inline shape_data full_mesh() {
  shape_data shape;
  shape.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.1f}, {0, 1, 0.3f}, {0.5f, 2, 1e-7f}};
  shape.normals = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}, {0.6f, 0.8f, 0}};
  shape.texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5f, 0.25f}};
  shape.quads = {{0, 1, 2, 3}, {3, 2, 4, 4}};
  return shape;
}

// Two strands of 4 and 5 vertices.
inline shape_data two_strands(curve_basis basis) {
  shape_data shape;
  for (int i = 0; i < 9; ++i) {
    const float t = static_cast<float>(i);
    shape.positions.push_back({0.1f * t, t * t, 1 / (1 + t)});
    shape.radius.push_back(0.01f / (1 + t));
  }
  shape.strands = {0, 4, 9};
  shape.basis = basis;
  return shape;
}

}  // namespace wisp::test
