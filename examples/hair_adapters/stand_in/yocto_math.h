// A stand-in for Yocto/GL's yocto_math.h and yocto_geometry.h: the names and signatures
// that yocto_hair.h uses, and no more.

#pragma once

#include <cmath>

namespace yocto {

struct vec2f {
  float x = 0, y = 0;
};
struct vec3f {
  float x = 0, y = 0, z = 0;
};
struct frame3f {
  vec3f x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1}, o = {0, 0, 0};
};
struct ray3f {
  vec3f o = {0, 0, 0}, d = {0, 0, 1};
};

inline vec3f operator-(const vec3f& a) { return {-a.x, -a.y, -a.z}; }
inline vec3f operator+(const vec3f& a, const vec3f& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline vec3f operator-(const vec3f& a, const vec3f& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline vec3f operator*(const vec3f& a, float b) { return {a.x * b, a.y * b, a.z * b}; }
inline vec3f operator/(const vec3f& a, float b) { return {a.x / b, a.y / b, a.z / b}; }
inline float dot(const vec3f& a, const vec3f& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline vec3f cross(const vec3f& a, const vec3f& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(const vec3f& a) { return std::sqrt(dot(a, a)); }
inline vec3f normalize(const vec3f& a) { return length(a) > 0 ? a / length(a) : a; }

// A frame whose z is v.
inline frame3f frame_fromz(const vec3f& o, const vec3f& v) {
  frame3f f;
  f.z = normalize(v);
  f.x = normalize(cross(std::abs(f.z.x) > 0.5f ? vec3f{0, 1, 0} : vec3f{1, 0, 0}, f.z));
  f.y = cross(f.z, f.x);
  f.o = o;
  return f;
}
inline vec3f transform_direction(const frame3f& f, const vec3f& v) {
  return normalize(f.x * v.x + f.y * v.y + f.z * v.z);
}

}  // namespace yocto
