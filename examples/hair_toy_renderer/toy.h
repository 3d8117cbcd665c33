// What a renderer has anyway: vectors of its own, random numbers, a picture.

#pragma once

#include <cmath>
#include <cstdint>

namespace toy {

struct vec {
  float x = 0, y = 0, z = 0;
};
inline vec operator+(vec a, vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline vec operator-(vec a, vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline vec operator-(vec a) { return {-a.x, -a.y, -a.z}; }
inline vec operator*(vec a, vec b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline vec operator*(vec a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline float dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline vec cross(vec a, vec b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(vec a) { return std::sqrt(dot(a, a)); }
inline vec normalize(vec a) { return a * (1 / length(a)); }
inline vec lerp(vec a, vec b, float t) { return a * (1 - t) + b * t; }
inline float largest(vec a) { return std::fmax(a.x, std::fmax(a.y, a.z)); }

// Any unit vector that is perpendicular to the unit vector a.
inline vec perpendicular(vec a) {
  return normalize(std::abs(a.x) > 0.5f ? cross(a, {0, 1, 0}) : cross(a, {1, 0, 0}));
}

// splitmix64: small, and the same everywhere.
struct random_numbers {
  std::uint64_t state = 0;
  float next() {
    std::uint64_t x = state += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return static_cast<float>((x ^ (x >> 31)) >> 40) * 0x1p-24f;
  }
};

}  // namespace toy
