#pragma once

// Meshes from files, for tests that run where there are some: as much of OBJ, STL and
// PLY as those need.

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "query_meshes.h"

namespace wisp_test {

inline void add_polygon(tri_mesh& m, const std::vector<int>& polygon) {
  for (std::size_t k = 2; k < polygon.size(); ++k) {
    m.triangles.push_back({polygon[0], polygon[k - 1], polygon[k]});
  }
}

inline tri_mesh read_obj(std::istream& in) {
  tri_mesh m;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "v") {
      dvec3 p = {0, 0, 0};
      words >> p.x >> p.y >> p.z;
      m.positions.push_back(p);
    } else if (word == "f") {
      std::vector<int> polygon;
      while (words >> word) {
        const int v = std::atoi(word.c_str());
        polygon.push_back(v < 0 ? static_cast<int>(m.positions.size()) + v : v - 1);
      }
      add_polygon(m, polygon);
    }
  }
  return m;
}

template <typename T>
T take(const std::string& bytes, std::size_t& at) {
  T x = {};
  if (at + sizeof(T) <= bytes.size()) std::memcpy(&x, bytes.data() + at, sizeof(T));
  at += sizeof(T);
  return x;
}

// Binary ones.
inline tri_mesh read_stl(const std::string& bytes) {
  tri_mesh m;
  std::size_t at = 80;
  const auto count = take<uint32_t>(bytes, at);
  for (uint32_t i = 0; i < count && at + 50 <= bytes.size(); ++i) {
    at += 12;
    const int v = static_cast<int>(m.positions.size());
    for (int k = 0; k < 3; ++k) {
      const auto x = take<float>(bytes, at), y = take<float>(bytes, at), z = take<float>(bytes, at);
      m.positions.push_back({x, y, z});
    }
    m.triangles.push_back({v, v + 1, v + 2});
    at += 2;
  }
  return m;
}

inline double take_number(const std::string& type, const std::string& bytes, std::size_t& at) {
  if (type == "float" || type == "float32") return take<float>(bytes, at);
  if (type == "double" || type == "float64") return take<double>(bytes, at);
  if (type == "uchar" || type == "uint8") return take<uint8_t>(bytes, at);
  if (type == "char" || type == "int8") return take<int8_t>(bytes, at);
  if (type == "short" || type == "int16") return take<int16_t>(bytes, at);
  if (type == "ushort" || type == "uint16") return take<uint16_t>(bytes, at);
  if (type == "uint" || type == "uint32") return take<uint32_t>(bytes, at);
  return take<int32_t>(bytes, at);
}

// ASCII and little-endian ones.
inline tri_mesh read_ply(const std::string& bytes) {
  struct property {
    std::string name, type, count;  // count: the type of a list's length
  };
  struct element {
    std::string name;
    std::size_t count = 0;
    std::vector<property> properties = {};
  };
  std::vector<element> elements;
  std::istringstream in(bytes);
  bool ascii = true;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string word, a, b, c;
    words >> word;
    if (word == "format") {
      words >> a;
      ascii = a == "ascii";
    } else if (word == "element") {
      element e;
      words >> e.name >> e.count;
      elements.push_back(e);
    } else if (word == "property" && !elements.empty()) {
      words >> a >> b;
      if (a == "list") {
        words >> c;
        std::string name;
        words >> name;
        elements.back().properties.push_back({name, c, b});
      } else {
        elements.back().properties.push_back({b, a, ""});
      }
    } else if (word == "end_header") {
      break;
    }
  }
  auto at = static_cast<std::size_t>(in.tellg());
  const auto number = [&](const std::string& type) {
    if (!ascii) return take_number(type, bytes, at);
    double x = 0;
    in >> x;
    return x;
  };
  tri_mesh m;
  for (const element& e : elements) {
    for (std::size_t i = 0; i < e.count; ++i) {
      dvec3 p = {0, 0, 0};
      for (const property& q : e.properties) {
        if (!q.count.empty()) {
          std::vector<int> polygon(static_cast<std::size_t>(number(q.count)));
          for (int& v : polygon) v = static_cast<int>(number(q.type));
          if (e.name == "face") add_polygon(m, polygon);
          continue;
        }
        const double x = number(q.type);
        if (q.name == "x") p.x = x;
        if (q.name == "y") p.y = x;
        if (q.name == "z") p.z = x;
      }
      if (e.name == "vertex") m.positions.push_back(p);
    }
  }
  return m;
}

// The mesh of a file in the folder that the environment variable WISP_TEST_DATA names,
// or in its folder `meshes`; nothing if there is none.
inline std::optional<tri_mesh> mesh_of_file(const std::string& name) {
  const char* folder = std::getenv("WISP_TEST_DATA");
  if (folder == nullptr) return std::nullopt;
  std::filesystem::path path = std::filesystem::path(folder) / "meshes" / name;
  if (!std::filesystem::exists(path)) path = std::filesystem::path(folder) / name;
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  if (path.extension() == ".obj") return read_obj(file);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return path.extension() == ".stl" ? read_stl(bytes) : read_ply(bytes);
}

inline const std::vector<std::string>& mesh_file_names() {
  static const std::vector<std::string> names = {
      "stanford-bunny.obj", "bunny_closed.obj",      "soup.stl",   "cube_with_fold.ply",
      "degenerated.obj",    "joined_tetrahedra.obj", "rabbit.obj", "cycloidal.ply"};
  return names;
}

}  // namespace wisp_test
