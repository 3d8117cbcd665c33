#pragma once

// The meshes of the folder that WISP_TEST_DATA names: OBJ, STL and PLY, as far as
// its files need them. Files are trusted.

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "make_meshes.h"

namespace wisp::test {

inline mesh read_obj(std::istream& in) {
  mesh m;
  std::string line, word;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    words >> word;
    if (word == "v") {
      dvec3 p;
      words >> p.x >> p.y >> p.z;
      m.positions.push_back(p);
    } else if (word == "f") {
      std::vector<int> face;
      while (words >> word) {
        const int i = std::atoi(word.c_str());
        face.push_back(i > 0 ? i - 1 : static_cast<int>(m.positions.size()) + i);
      }
      for (std::size_t k = 2; k < face.size(); ++k) {
        m.triangles.push_back({face[0], face[k - 1], face[k]});
      }
    }
    word.clear();
  }
  return m;
}

template <typename T>
T take(const char*& at) {
  T x;
  std::memcpy(&x, at, sizeof(T));
  at += sizeof(T);
  return x;
}

inline mesh read_stl(const std::string& bytes) {
  mesh m;
  const char* at = bytes.data() + 80;
  const auto count = take<uint32_t>(at);
  for (uint32_t i = 0; i < count; ++i) {
    at += 12;
    dvec3 v[3];
    for (dvec3& p : v) {
      for (int a = 0; a < 3; ++a) p[a] = take<float>(at);
    }
    at += 2;
    add_triangle(m, v[0], v[1], v[2]);
  }
  return m;
}

// Of doubles or in ASCII, with x, y and z alone and faces of three vertices.
inline mesh read_ply(const std::string& bytes) {
  mesh m;
  std::istringstream in(bytes);
  std::string line;
  bool ascii = false;
  std::size_t vertices = 0, faces = 0;
  while (std::getline(in, line) && line != "end_header") {
    ascii = ascii || line.starts_with("format ascii");
    if (line.starts_with("element vertex ")) vertices = std::stoul(line.substr(15));
    if (line.starts_with("element face ")) faces = std::stoul(line.substr(13));
  }
  m.positions.resize(vertices);
  m.triangles.resize(faces);
  if (ascii) {
    for (dvec3& p : m.positions) in >> p.x >> p.y >> p.z;
    int n = 0;
    for (ivec3& t : m.triangles) in >> n >> t.x >> t.y >> t.z;
    return m;
  }
  const char* at = bytes.data() + in.tellg();
  for (dvec3& p : m.positions) {
    for (int a = 0; a < 3; ++a) p[a] = take<double>(at);
  }
  for (ivec3& t : m.triangles) {
    ++at;
    for (int k = 0; k < 3; ++k) t[k] = take<int>(at);
  }
  return m;
}

// Nothing where WISP_TEST_DATA is not set or has no such file.
inline std::optional<mesh> data_mesh(const char* name) {
  const char* folder = std::getenv("WISP_TEST_DATA");
  if (folder == nullptr) return {};
  const std::filesystem::path path = std::filesystem::path(folder) / "meshes" / name;
  std::ifstream in(path, std::ios::binary);
  if (!in) return {};
  const std::string kind = path.extension().string();
  mesh m;
  if (kind == ".obj") {
    m = read_obj(in);
  } else {
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    m = kind == ".ply" ? read_ply(bytes) : read_stl(bytes);
  }
  m.name = name;
  return m;
}

}  // namespace wisp::test
