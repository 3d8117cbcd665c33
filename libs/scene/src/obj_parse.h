#pragma once

// The statements of an OBJ file that shapes need, as they are in the file.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "wisp/core/error.h"
#include "wisp/core/math.h"

namespace wisp {

// Indices from 0; -1 where there is none.
struct obj_corner {
  int position = -1;
  int texcoord = -1;
  int normal = -1;

  bool operator==(const obj_corner&) const = default;
};

// Element k has corners[ends[k - 1]] .. corners[ends[k] - 1].
struct obj_elements {
  std::vector<obj_corner> corners = {};
  std::vector<std::size_t> ends = {};
  std::vector<uint32_t> lines = {};  // of the file
};
inline std::span<const obj_corner> obj_element(const obj_elements& elements, std::size_t k) {
  const std::size_t first = k == 0 ? 0 : elements.ends[k - 1];
  return {elements.corners.data() + first, elements.ends[k] - first};
}

struct obj_content {
  std::vector<vec3> positions = {};
  std::vector<vec4> colors = {};  // none or one for each position
  std::vector<vec2> texcoords = {};
  std::vector<vec3> normals = {};
  obj_elements faces = {}, lines = {}, points = {};
  std::vector<std::string> comments = {};  // that begin with "wisp "
};

// All indices of the result are in range.
obj_content parse_obj(std::span<const uint8_t> bytes, const std::string& file,
                      warning_list& warnings);

}  // namespace wisp
