// What a JSON scene lays over strands that it read from a file: a basis and radii.

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "json_scene.h"

namespace wisp {

namespace {

// values[i] = old values[from[i]]
template <typename T>
void gather(std::vector<T>& values, const std::vector<uint32_t>& from) {
  if (values.empty()) return;
  std::vector<T> result;
  result.reserve(from.size());
  for (uint32_t i : from) result.push_back(values[i]);
  values = std::move(result);
}

}  // namespace

void apply_basis(const json_context& context, const std::string& place, curve_basis basis,
                 shape_data& shape) {
  if (basis == curve_basis::linear || basis == shape.basis) return;
  std::size_t strands = strand_count(shape);
  if (basis == curve_basis::bezier) {
    for (std::size_t s = 0; s < strands; s++) {
      uint32_t points = shape.strands[s + 1] - shape.strands[s];
      if (segment_count(basis, points) == 0)
        context.fail(place, fmt::format("strand {} has {} points, and Bezier curves have 3 n + 1; "
                                        "\"bspline\" and \"catmull_rom\" take any number",
                                        s, points));
    }
    shape.basis = basis;
    return;
  }

  // The phantoms mirror the neighbour of an end in that end, which makes both
  // kinds of curve begin (and end) exactly there: (2 p0 - p1 + 4 p0 + p1) / 6 = p0.
  uint32_t old_used = shape.strands.back();
  std::size_t extra = 2 * strands;
  if (shape.positions.size() + extra > std::numeric_limits<uint32_t>::max())
    context.fail(place, "the strands have more points than can be counted with 32 bits");
  std::vector<uint32_t> from, moved(shape.positions.size());
  from.reserve(shape.positions.size() + extra);
  std::vector<uint32_t> first(1, 0);
  first.reserve(strands + 1);
  for (std::size_t s = 0; s < strands; s++) {
    uint32_t begin = shape.strands[s], end = shape.strands[s + 1];
    from.push_back(begin);
    for (uint32_t i = begin; i < end; i++) {
      moved[i] = static_cast<uint32_t>(from.size());
      from.push_back(i);
    }
    from.push_back(end - 1);
    first.push_back(static_cast<uint32_t>(from.size()));
  }
  for (std::size_t i = old_used; i < shape.positions.size(); i++) {
    moved[i] = static_cast<uint32_t>(from.size());
    from.push_back(static_cast<uint32_t>(i));
  }
  gather(shape.positions, from);
  gather(shape.normals, from);
  gather(shape.texcoords, from);
  gather(shape.colors, from);
  gather(shape.radius, from);
  gather(shape.tangents, from);
  gather(shape.roughness, from);
  for (std::size_t s = 0; s < strands; s++) {
    auto& p = shape.positions;
    std::size_t begin = first[s], end = first[s + 1];
    p[begin] = 2.0f * p[begin + 1] - p[begin + 2];
    p[end - 1] = 2.0f * p[end - 2] - p[end - 3];
  }
  auto move = [&](int i) { return static_cast<int>(moved[static_cast<std::size_t>(i)]); };
  for (int& i : shape.points) i = move(i);
  for (ivec3& t : shape.triangles) t = {move(t.x), move(t.y), move(t.z)};
  for (ivec4& q : shape.quads) q = {move(q.x), move(q.y), move(q.z), move(q.w)};
  shape.strands = std::move(first);
  shape.basis = basis;
}

void apply_radius(const vec2& radius, shape_data& shape) {
  if (shape.radius.size() != shape.positions.size())
    shape.radius.assign(shape.positions.size(), radius.x);
  for (int i : shape.points) shape.radius[static_cast<std::size_t>(i)] = radius.x;
  // Curves of these bases run from the second to the last but one point.
  bool phantoms = shape.basis == curve_basis::bspline || shape.basis == curve_basis::catmull_rom;
  for (std::size_t s = 0; s + 1 < shape.strands.size(); s++) {
    uint32_t begin = shape.strands[s], end = shape.strands[s + 1];
    float skip = phantoms ? 1.0f : 0.0f;
    float last = static_cast<float>(end - begin) - 1 - 2 * skip;
    for (uint32_t i = begin; i < end; i++) {
      float t = last > 0 ? (static_cast<float>(i - begin) - skip) / last : 0.0f;
      t = std::clamp(t, 0.0f, 1.0f);
      shape.radius[i] = radius.x + (radius.y - radius.x) * t;
    }
  }
}

}  // namespace wisp
