#pragma once

// Meshes for benchmarks of distances and of walks: files, and a ball that needs none.

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "wisp/geometry/mesh.h"
#include "wisp/scene/io.h"

namespace wisp::bench {

struct mesh_data {
  std::string name;
  std::vector<dvec3> positions;
  std::vector<ivec3> triangles;
};

inline double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// A ball of 2 n^2 triangles with bumps of two sizes.
inline mesh_data make_ball(int n) {
  mesh_data m;
  const int rows = n / 2, columns = 2 * n;
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double theta = 3.14159265358979 * j / rows, phi = 6.28318530717959 * i / columns;
      const double bump = 0.08 * std::sin(7 * theta) * std::cos(5 * phi) +
                          0.015 * std::sin(31 * theta) * std::cos(29 * phi);
      // the poles are one point, or the ball would be open there
      const double ring = j == 0 || j == rows ? 0 : std::sin(theta);
      const double r = 1 + bump * ring;
      m.positions.push_back(r * dvec3{ring * std::cos(phi), std::cos(theta), ring * std::sin(phi)});
    }
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int k = (i + 1) % columns, a = j * columns, b = a + columns;
      m.triangles.push_back({a + i, a + k, b + k});
      m.triangles.push_back({a + i, b + k, b + i});
    }
  }
  m.name = fmt::format("ball, {} triangles", m.triangles.size());
  return m;
}

inline mesh_data load(const std::string& path) {
  warning_list warnings;
  const shape_data shape = load_shape(path, warnings);
  mesh_data m;
  m.triangles = shape.triangles;
  const auto split = quads_to_triangles(shape.quads);
  m.triangles.insert(m.triangles.end(), split.begin(), split.end());
  m.positions.assign(shape.positions.begin(), shape.positions.end());
  m.name = fmt::format("{}, {} triangles", std::filesystem::path(path).stem().string(),
                       m.triangles.size());
  return m;
}

}  // namespace wisp::bench
