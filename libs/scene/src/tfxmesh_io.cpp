// TressFX collision meshes, .tfxmesh, as the TressFX exporter for Maya writes
// them: text with '#' comments,
//   numOfBones B        index name                                  (B lines)
//   numOfVertices V     index x y z nx ny nz, 4 joints, 4 weights   (V lines)
//   numOfTriangles T    index a b c                                 (T lines)
// Bones and weights are read over. There are no texture coordinates.

#include <fmt/format.h>

#include "shape_formats.h"
#include "text_cursor.h"

namespace wisp {

shape_data read_tfxmesh(std::span<const uint8_t> bytes, const std::string& file,
                        warning_list& warnings) {
  text_cursor text(bytes, file);
  shape_data shape;
  while (!text.at_end()) {
    const std::string_view key = text.word();
    if (key != "numOfBones" && key != "numOfVertices" && key != "numOfTriangles") {
      text.fail(fmt::format("expected numOfBones, numOfVertices or numOfTriangles, not \"{}\"",
                            key.substr(0, 40)));
    }
    // Counts are believed line by line: the end of the file stops a wrong one.
    const uint64_t count = text.count();
    for (uint64_t i = 0; i < count; ++i) {
      if (text.count() != i) text.fail(fmt::format("expected index {}", i));
      if (key == "numOfBones") {
        text.word();
      } else if (key == "numOfVertices") {
        vec3 position, normal;
        for (int c = 0; c < 3; ++c) position[c] = text.number();
        for (int c = 0; c < 3; ++c) normal[c] = text.number();
        for (int c = 0; c < 8; ++c) text.number();
        shape.positions.push_back(position);
        shape.normals.push_back(normal);
      } else {
        ivec3 triangle;
        for (int c = 0; c < 3; ++c) {
          const uint64_t vertex = text.count();
          if (vertex >= shape.positions.size()) {
            text.fail(fmt::format("triangle {} refers to vertex {}, but there are {} vertices", i,
                                  vertex, shape.positions.size()));
          }
          triangle[c] = static_cast<int>(vertex);
        }
        shape.triangles.push_back(triangle);
      }
    }
  }
  if (shape.triangles.empty()) {
    warnings.push_back(fmt::format("{}: the mesh has no triangles", file));
  }
  return shape;
}

}  // namespace wisp
