#pragma once

// Vector types of wisp: GLM's, in single precision for everything that a
// renderer touches. PDEs and distance queries use the double forms (dvec3).
// The functions are pure and safe to call from any thread.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>

namespace wisp {

using glm::dvec2;
using glm::dvec3;
using glm::dvec4;
using glm::ivec2;
using glm::ivec3;
using glm::ivec4;
using glm::mat3;
using glm::u8vec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;

inline constexpr float pi = 3.14159265358979323846f;
inline constexpr float infinity = std::numeric_limits<float>::infinity();

// An affine frame: columns x, y, z (axes) and o (origin), as Yocto/GL stores
// twelve numbers in a file.
using frame3 = glm::mat4x3;
inline constexpr frame3 identity_frame{vec3{1, 0, 0}, vec3{0, 1, 0}, vec3{0, 0, 1}, vec3{0, 0, 0}};

inline vec3 transform_point(const frame3& f, const vec3& p) {
  return f[0] * p.x + f[1] * p.y + f[2] * p.z + f[3];
}
inline vec3 transform_vector(const frame3& f, const vec3& v) {
  return f[0] * v.x + f[1] * v.y + f[2] * v.z;
}
inline mat3 rotation(const frame3& f) { return mat3{f[0], f[1], f[2]}; }

// v / |v|, and the zero vector for a vector that has no direction.
inline vec3 normalize_or_zero(const vec3& v) {
  float l2 = glm::dot(v, v);
  return l2 > 0 && std::isfinite(l2) ? v * (1 / std::sqrt(l2)) : vec3{0, 0, 0};
}

// Transforms a normal by the inverse transpose; the result has unit length.
inline vec3 transform_normal(const frame3& f, const vec3& n) {
  // cofactor matrix = det * inverse transpose, without the division
  return normalize_or_zero(n.x * glm::cross(f[1], f[2]) + n.y * glm::cross(f[2], f[0]) +
                           n.z * glm::cross(f[0], f[1])) *
         (glm::dot(glm::cross(f[0], f[1]), f[2]) < 0 ? -1.0f : 1.0f);
}

// The inverse of a frame with any invertible linear part.
inline frame3 inverse(const frame3& f) {
  mat3 m = glm::inverse(rotation(f));
  return frame3{m[0], m[1], m[2], -(m * f[3])};
}

// frame3 product: first b, then a.
inline frame3 compose(const frame3& a, const frame3& b) {
  return frame3{transform_vector(a, b[0]), transform_vector(a, b[1]), transform_vector(a, b[2]),
                transform_point(a, b[3])};
}

// An orthonormal basis with z as its third column, without a branch that
// shows (Duff et al., Building an Orthonormal Basis, Revisited, 2017).
inline mat3 basis_from_z(const vec3& z) {
  float sign = std::copysign(1.0f, z.z);
  float a = -1 / (sign + z.z);
  float b = z.x * z.y * a;
  return mat3{vec3{1 + sign * z.x * z.x * a, sign * b, -sign * z.x},
              vec3{b, sign + z.y * z.y * a, -z.y}, z};
}

// Relative luminance of linear Rec. 709 colour.
inline float luminance(const vec3& c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }
inline float max_component(const vec3& c) { return std::max(c.x, std::max(c.y, c.z)); }
inline bool is_finite(const vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace wisp
