#pragma once

// Meshes for the tests of winding numbers and signed distances: made, or read from the
// folder that WISP_TEST_DATA names. The readers know as much of OBJ, PLY and STL as
// the files there need.

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "wisp/core/math.h"
#include "wisp/geometry/bvh.h"

namespace wisp::test_meshes {

struct mesh {
  std::vector<dvec3> positions = {};
  std::vector<ivec3> triangles = {};
  bvh tree() const { return make_bvh(triangles, positions, {.threads = 1}); }
};

inline int count(std::size_t n) { return static_cast<int>(n); }

inline void append(mesh& m, const mesh& other) {
  const int first = count(m.positions.size());
  m.positions.insert(m.positions.end(), other.positions.begin(), other.positions.end());
  for (const ivec3& t : other.triangles) m.triangles.push_back(t + first);
}
inline mesh inverted(mesh m) {
  for (ivec3& t : m.triangles) std::swap(t.x, t.y);
  return m;
}
inline mesh moved(mesh m, double scale, const dvec3& by) {
  for (dvec3& p : m.positions) p = p * scale + by;
  return m;
}
// Every triangle with vertices of its own.
inline mesh unshared(const mesh& m) {
  mesh r;
  for (const ivec3& t : m.triangles) {
    const int n = count(r.positions.size());
    for (int k = 0; k < 3; ++k) r.positions.push_back(m.positions[static_cast<std::size_t>(t[k])]);
    r.triangles.push_back({n, n + 1, n + 2});
  }
  return r;
}
// Without the triangles that `gone` says.
template <typename Gone>
mesh without(mesh m, const Gone& gone) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < m.triangles.size(); ++i) {
    if (!gone(i)) m.triangles[kept++] = m.triangles[i];
  }
  m.triangles.resize(kept);
  return m;
}

// u and v run around, counter-clockwise outside.
inline mesh torus(double major, double minor, int nu, int nv) {
  mesh m;
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      const double u = 2 * std::numbers::pi * i / nu, v = 2 * std::numbers::pi * j / nv;
      const double r = major + minor * std::cos(v);
      m.positions.push_back({r * std::cos(u), r * std::sin(u), minor * std::sin(v)});
      const auto at = [&](int a, int b) { return a % nu * nv + b % nv; };
      m.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      m.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return m;
}

inline mesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
}

inline mesh sphere(int steps, double radius = 1) {
  mesh m;
  m.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  m.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                 {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int s = 0; s < steps; ++s) {
    std::map<std::array<int, 2>, int> middles;
    std::vector<ivec3> finer;
    const auto middle = [&](int a, int b) {
      const auto [it, added] = middles.emplace(std::array<int, 2>{std::min(a, b), std::max(a, b)},
                                               count(m.positions.size()));
      if (added) {
        m.positions.push_back(glm::normalize(m.positions[static_cast<std::size_t>(a)] +
                                             m.positions[static_cast<std::size_t>(b)]));
      }
      return it->second;
    };
    for (const ivec3& t : m.triangles) {
      const int a = middle(t.x, t.y), b = middle(t.y, t.z), c = middle(t.z, t.x);
      finer.push_back({t.x, a, c});
      finer.push_back({a, t.y, b});
      finer.push_back({c, b, t.z});
      finer.push_back({a, b, c});
    }
    m.triangles = finer;
  }
  for (dvec3& p : m.positions) p *= radius;
  return m;
}

// The surface of a set of unit cubes at whole coordinates.
struct voxels {
  int side;
  std::vector<char> full;
  bool at(int x, int y, int z) const {
    const auto in = [&](int i) { return i >= 0 && i < side; };
    return in(x) && in(y) && in(z) &&
           full[static_cast<std::size_t>((z * side + y) * side + x)] != 0;
  }
};
inline mesh surface(const voxels& v) {
  mesh m;
  for (int z = 0; z < v.side; ++z) {
    for (int y = 0; y < v.side; ++y) {
      for (int x = 0; x < v.side; ++x) {
        if (!v.at(x, y, z)) continue;
        for (int a = 0; a < 3; ++a) {
          for (int side = 0; side < 2; ++side) {
            ivec3 next{x, y, z};
            next[a] += side == 1 ? 1 : -1;
            if (v.at(next.x, next.y, next.z)) continue;
            const int n = count(m.positions.size());
            for (int corner = 0; corner < 4; ++corner) {
              dvec3 p{x, y, z};
              p[a] += side;
              p[(a + 1) % 3] += corner == 1 || corner == 2 ? 1 : 0;
              p[(a + 2) % 3] += corner >= 2 ? 1 : 0;
              m.positions.push_back(p);
            }
            if (side == 1) {
              m.triangles.push_back({n, n + 1, n + 2});
              m.triangles.push_back({n, n + 2, n + 3});
            } else {
              m.triangles.push_back({n, n + 2, n + 1});
              m.triangles.push_back({n, n + 3, n + 2});
            }
          }
        }
      }
    }
  }
  return m;
}

inline mesh soup(int triangles, double size, unsigned seed) {
  std::mt19937_64 g(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  mesh m;
  for (int i = 0; i < triangles; ++i) {
    const dvec3 c(u(g), u(g), u(g));
    for (int k = 0; k < 3; ++k) m.positions.push_back(c + size * dvec3(u(g), u(g), u(g)));
    m.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return m;
}

// Points around the box of a mesh, and some at coordinates that it has itself, so that
// axis-parallel rays meet vertices and edges.
inline std::vector<dvec3> points_around(const mesh& m, int n, unsigned seed, double grow = 0.2) {
  std::mt19937_64 g(seed);
  std::uniform_real_distribution<double> u(0, 1);
  dvec3 low{1e300}, high{-1e300};
  for (const dvec3& p : m.positions) {
    if (!std::isfinite(p.x + p.y + p.z)) continue;
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const auto vertex = [&] { return m.positions[g() % m.positions.size()]; };
  std::vector<dvec3> points;
  for (int i = 0; i < n; ++i) {
    dvec3 p;
    for (int a = 0; a < 3; ++a) {
      p[a] = low[a] + (high[a] - low[a]) * (u(g) * (1 + 2 * grow) - grow);
    }
    if (i % 4 == 1) {  // in line with a vertex
      const dvec3 v = vertex();
      const int keep = static_cast<int>(g() % 3);
      for (int a = 0; a < 3; ++a) p[a] = a == keep || !std::isfinite(v[a]) ? p[a] : v[a];
    } else if (i % 4 == 2) {  // in a plane with one
      const dvec3 v = vertex();
      const int take = static_cast<int>(g() % 3);
      if (std::isfinite(v[take])) p[take] = v[take];
    }
    points.push_back(p);
  }
  return points;
}

inline std::optional<std::string> data_folder() {
  const char* folder = std::getenv("WISP_TEST_DATA");
  if (folder == nullptr) return {};
  return std::string(folder) + "/meshes/";
}

inline std::string file_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void add_polygon(mesh& m, const std::vector<int>& face) {
  for (std::size_t i = 2; i < face.size(); ++i)
    m.triangles.push_back({face[0], face[i - 1], face[i]});
}

inline mesh read_obj(const std::string& path) {
  mesh m;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::istringstream s(line);
    std::string what;
    s >> what;
    if (what == "v") {
      dvec3 p;
      s >> p.x >> p.y >> p.z;
      m.positions.push_back(p);
    } else if (what == "f") {
      std::vector<int> face;
      for (std::string v; s >> v;) face.push_back(std::atoi(v.c_str()) - 1);
      add_polygon(m, face);
    }
  }
  return m;
}

inline mesh read_stl(const std::string& path) {
  mesh m;
  const std::string bytes = file_bytes(path);
  for (std::size_t at = 84; at + 50 <= bytes.size(); at += 50) {
    float f[9];
    std::memcpy(f, bytes.data() + at + 12, sizeof(f));
    const int n = count(m.positions.size());
    for (int k = 0; k < 3; ++k) m.positions.push_back({f[3 * k], f[3 * k + 1], f[3 * k + 2]});
    m.triangles.push_back({n, n + 1, n + 2});
  }
  return m;
}

// Vertex properties float, double or uchar, of which the first three are x, y and z;
// faces a list of uchar and int, then uchars.
inline mesh read_ply(const std::string& path) {
  mesh m;
  const std::string bytes = file_bytes(path);
  const std::size_t body = bytes.find("end_header\n") + 11;
  std::istringstream header(bytes.substr(0, body));
  std::size_t vertices = 0, faces = 0, stride = 0, scalar = 0, after = 0;
  bool of_faces = false, ascii = false;
  for (std::string line; std::getline(header, line);) {
    std::istringstream s(line);
    std::string what, type, name;
    s >> what >> type;
    if (what == "format") ascii = type == "ascii";
    if (what == "element") {
      of_faces = type == "face";
      s >> (of_faces ? faces : vertices);
    }
    if (what == "property" && type != "list") {
      const std::size_t size = type == "double" ? 8 : type == "float" ? 4 : 1;
      if (!of_faces && stride == 0) scalar = size;
      (of_faces ? after : stride) += size;
    }
  }
  if (ascii) {
    std::istringstream s(bytes.substr(body));
    for (std::size_t i = 0; i < vertices; ++i) {
      dvec3 p;
      s >> p.x >> p.y >> p.z;
      m.positions.push_back(p);
    }
    for (std::size_t i = 0; i < faces; ++i) {
      int n = 0;
      s >> n;
      std::vector<int> face(static_cast<std::size_t>(n));
      for (int& v : face) s >> v;
      add_polygon(m, face);
    }
    return m;
  }
  const char* at = bytes.data() + body;
  for (std::size_t i = 0; i < vertices; ++i, at += stride) {
    dvec3 p;
    for (int a = 0; a < 3; ++a) {
      float f = 0;
      if (scalar == 8) {
        std::memcpy(&p[a], at + 8 * a, 8);
      } else {
        std::memcpy(&f, at + 4 * a, 4);
        p[a] = f;
      }
    }
    m.positions.push_back(p);
  }
  for (std::size_t i = 0; i < faces; ++i) {
    std::vector<int> face(static_cast<unsigned char>(*at++));
    std::memcpy(face.data(), at, 4 * face.size());
    at += 4 * face.size() + after;
    add_polygon(m, face);
  }
  return m;
}

inline mesh read(const std::string& path) {
  const std::string end = path.substr(path.size() - 4);
  return end == ".obj" ? read_obj(path) : end == ".ply" ? read_ply(path) : read_stl(path);
}

}  // namespace wisp::test_meshes
