// libFuzzer target for the mesh readers: the first byte picks the format, the
// rest is the file. What is read must be sound after cleaning, and must keep its
// elements when it is written and read again.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>

#include "../../libs/scene/src/shape_formats.h"

namespace {

using namespace wisp;

using bytes_view = std::span<const uint8_t>;

bytes_view view(const std::string& s) {
  return {reinterpret_cast<const uint8_t*>(s.data()), s.size()};
}

void require(bool condition) {
  if (!condition) std::abort();
}

// Shapes without strands lose their basis.
bool same_strands(const shape_data& a, const shape_data& b) {
  return a.strands == b.strands && (a.strands.empty() || a.basis == b.basis);
}

std::size_t face_count(const shape_data& s) { return s.triangles.size() + s.quads.size(); }

void check_round_trip(const shape_data& shape) {
  warning_list warnings;
  const shape_data again = read_ply(view(write_ply(shape, "ply", warnings)), "ply", warnings);
  require(face_count(again) == face_count(shape));
  require(again.points == shape.points);
  require(same_strands(again, shape));
  require(again.positions == shape.positions);
  const shape_data third = read_obj(view(write_obj(shape, "obj", warnings)), "obj", warnings);
  require(face_count(third) == face_count(shape));
  require(third.points.size() == shape.points.size());
  require(same_strands(third, shape));
  if (shape.strands.empty() && shape.points.empty()) {
    read_stl(view(write_stl(shape, "stl", warnings)), "stl", warnings);
  }
}

void run(uint8_t format, bytes_view bytes) {
  warning_list warnings;
  if (format >= 3) {
    subdiv_data subdiv = format == 3 ? read_ply_subdiv(bytes, "ply", warnings)
                                     : read_obj_subdiv(bytes, "obj", warnings);
    clean_subdiv(subdiv, "subdiv", warnings);
    require(subdiv.quadsnorm.empty() || subdiv.quadsnorm.size() == subdiv.quadspos.size());
    require(subdiv.quadstexcoord.empty() || subdiv.quadstexcoord.size() == subdiv.quadspos.size());
    return;
  }
  shape_data shape = format == 0   ? read_ply(bytes, "ply", warnings)
                     : format == 1 ? read_obj(bytes, "obj", warnings)
                                   : read_stl(bytes, "stl", warnings);
  clean_shape(shape, "shape", warnings);
  check_shape(shape, "shape");
  for (const vec3& p : shape.positions) require(is_finite(p));
  check_round_trip(shape);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  try {
    run(data[0] % 5, {data + 1, size - 1});
  } catch (const file_error&) {
  }
  return 0;
}
