// Sheets after Nielson, "Dual Marching Cubes", IEEE Visualization 2004; vertices
// after Ju, Losasso, Schaefer and Warren, "Dual Contouring of Hermite Data",
// SIGGRAPH 2002, and Schaefer and Warren, "Dual Contouring: The Secret Sauce",
// 2002 (the pseudoinverse about the mean of the crossings).

#include "contour_cell.h"

#include <algorithm>
#include <cmath>

namespace wisp::contouring {

namespace {

// Eigenvalues and -vectors of a symmetric matrix by Jacobi's rotations.
void diagonalize(std::array<dvec3, 3>& m, std::array<dvec3, 3>& vectors) {
  vectors = {dvec3{1, 0, 0}, dvec3{0, 1, 0}, dvec3{0, 0, 1}};  // columns
  double scale = m[0][0] + m[1][1] + m[2][2];
  for (int sweep = 0; sweep < 16; sweep++) {
    if (std::abs(m[0][1]) + std::abs(m[0][2]) + std::abs(m[1][2]) <= 1e-15 * scale) return;
    for (int p = 0; p < 2; p++)
      for (int q = p + 1; q < 3; q++) {
        auto i = static_cast<std::size_t>(p), j = static_cast<std::size_t>(q);
        if (std::abs(m[i][q]) <= 1e-300) continue;
        double theta = (m[j][q] - m[i][p]) / (2 * m[i][q]);
        double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (auto& row : m) {  // columns p and q
          double a = row[p], b = row[q];
          row[p] = c * a - s * b;
          row[q] = s * a + c * b;
        }
        dvec3 a = m[i], b = m[j];
        m[i] = c * a - s * b;
        m[j] = s * a + c * b;
        a = vectors[i], b = vectors[j];
        vectors[i] = c * a - s * b;
        vectors[j] = s * a + c * b;
      }
  }
}

bool in_box(const dvec3& p, const dvec3& size) {
  return p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x <= size.x && p.y <= size.y && p.z <= size.z;
}

}  // namespace

std::array<int, 4> face_edges(int axis, int side) {
  int b = (axis + 1) % 3, c = (axis + 2) % 3;
  return {b * 4 + 2 * side, c * 4 + side + 2, b * 4 + 1 + 2 * side, c * 4 + side};
}

std::array<int, 4> face_corners(int axis, int side) {
  int b = 1 << (axis + 1) % 3, c = 1 << (axis + 2) % 3, base = side << axis;
  return {base, base + b, base + b + c, base + c};
}

bool is_ambiguous(int signs, int axis, int side) {
  auto corners = face_corners(axis, side);
  int first = (signs >> corners[0]) & 1, second = (signs >> corners[1]) & 1;
  return first != second && ((signs >> corners[2]) & 1) == first &&
         ((signs >> corners[3]) & 1) == second;
}

bool cuts_first(int signs, int axis, int side, bool centre_inside) {
  bool corner_inside = ((signs >> face_corners(axis, side)[0]) & 1) != 0;
  return corner_inside != centre_inside;
}

cell_sheets find_sheets(int signs, const std::array<bool, 6>& first) {
  std::array<std::array<int, 2>, 12> next;
  std::array<int, 12> links = {};
  auto join = [&](int a, int b) {
    auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    next[i][static_cast<std::size_t>(links[i]++)] = b;
    next[j][static_cast<std::size_t>(links[j]++)] = a;
  };
  for (int axis = 0; axis < 3; axis++)
    for (int side = 0; side < 2; side++) {
      auto edges = face_edges(axis, side);
      auto corners = face_corners(axis, side);
      std::array<int, 4> crossed = {};
      std::size_t count = 0;
      for (std::size_t i = 0; i < 4; i++)
        if (((signs >> corners[i]) & 1) != ((signs >> corners[(i + 1) & 3]) & 1))
          crossed[count++] = edges[i];
      if (count == 2) {
        join(crossed[0], crossed[1]);
      } else if (count == 4) {
        bool shift = first[static_cast<std::size_t>(2 * axis + side)];
        join(edges[shift ? 3 : 0], edges[shift ? 0 : 1]);
        join(edges[shift ? 1 : 2], edges[shift ? 2 : 3]);
      }
    }
  cell_sheets sheets;
  sheets.of.fill(-1);
  for (std::size_t start = 0; start < 12; start++) {
    if (links[start] == 0 || sheets.of[start] >= 0) continue;
    // Each crossing has two links, one in each of its faces: walk round.
    auto at = start;
    while (sheets.of[at] < 0) {
      sheets.of[at] = sheets.count;
      auto a = static_cast<std::size_t>(next[at][0]), b = static_cast<std::size_t>(next[at][1]);
      at = sheets.of[a] < 0 ? a : b;
    }
    sheets.count++;
  }
  return sheets;
}

dvec3 fit_vertex(std::span<const tangent_plane> planes, const dvec3& size, bool sharp) {
  dvec3 mean = {0, 0, 0};
  for (const tangent_plane& plane : planes) mean += plane.point;
  mean = glm::clamp(mean / static_cast<double>(planes.size()), dvec3{0, 0, 0}, size);
  if (!sharp) return mean;

  std::array<dvec3, 3> m = {};
  dvec3 rhs = {0, 0, 0};
  for (const auto& [point, normal] : planes) {
    for (int k = 0; k < 3; k++) m[static_cast<std::size_t>(k)] += normal[k] * normal;
    rhs += normal * glm::dot(normal, point - mean);
  }
  double trace = m[0][0] + m[1][1] + m[2][2];
  if (!(trace > 0)) return mean;

  std::array<dvec3, 3> values = m, vectors;
  diagonalize(values, vectors);
  double largest = std::max({values[0][0], values[1][1], values[2][2]});
  dvec3 point = mean;
  for (int k = 0; k < 3; k++) {
    auto i = static_cast<std::size_t>(k);
    // 0.05 of the largest singular value: faces that meet at a flatter angle
    // are a smooth surface at this resolution.
    if (values[i][k] > 0.0025 * largest)
      point += vectors[i] * (glm::dot(vectors[i], rhs) / values[i][k]);
  }
  if (in_box(point, size)) return point;

  // The least-squares problem within the cell, by coordinate descent; the small
  // diagonal term holds what the planes leave free.
  dvec3 x = glm::clamp(point, dvec3{0, 0, 0}, size);
  double hold = 1e-4 * trace;
  for (int i = 0; i < 32; i++)
    for (int k = 0; k < 3; k++) {
      const dvec3& row = m[static_cast<std::size_t>(k)];
      dvec3 d = x - mean;
      double rest = rhs[k] - (glm::dot(row, d) - row[k] * d[k]);
      x[k] = std::clamp(mean[k] + rest / (row[k] + hold), 0.0, size[k]);
    }
  return x;
}

}  // namespace wisp::contouring
