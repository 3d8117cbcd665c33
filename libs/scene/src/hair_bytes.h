#pragma once

// Little-endian values in a block of bytes, for the binary formats of hair.
// Offsets are 64-bit so that products of two header fields cannot wrap.

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "wisp/core/math.h"

namespace wisp {

inline uint16_t get_u16(std::span<const uint8_t> bytes, uint64_t at) {
  const uint8_t* p = bytes.data() + at;
  return static_cast<uint16_t>(p[0] | (p[1] << 8));
}
inline uint32_t get_u32(std::span<const uint8_t> bytes, uint64_t at) {
  const uint8_t* p = bytes.data() + at;
  return static_cast<uint32_t>(p[0]) | (static_cast<uint32_t>(p[1]) << 8) |
         (static_cast<uint32_t>(p[2]) << 16) | (static_cast<uint32_t>(p[3]) << 24);
}
inline float get_f32(std::span<const uint8_t> bytes, uint64_t at) {
  return std::bit_cast<float>(get_u32(bytes, at));
}
inline vec3 get_vec3(std::span<const uint8_t> bytes, uint64_t at) {
  return {get_f32(bytes, at), get_f32(bytes, at + 4), get_f32(bytes, at + 8)};
}
// True where `count` items of `size` bytes from `at` lie within the bytes.
// count and size are below 2^32 and 2^16, so that the product cannot wrap.
inline bool holds(std::span<const uint8_t> bytes, uint64_t at, uint64_t count, uint64_t size) {
  return at <= bytes.size() && count * size <= bytes.size() - at;
}

inline void put_u16(std::string& out, uint16_t v) {
  out.push_back(static_cast<char>(v & 0xff));
  out.push_back(static_cast<char>(v >> 8));
}
inline void put_u32(std::string& out, uint32_t v) {
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<char>((v >> (8 * i)) & 0xff));
}
inline void put_f32(std::string& out, float v) { put_u32(out, std::bit_cast<uint32_t>(v)); }
inline void put_vec3(std::string& out, const vec3& v) {
  put_f32(out, v.x);
  put_f32(out, v.y);
  put_f32(out, v.z);
}

}  // namespace wisp
