#pragma once

// A bounding volume hierarchy over triangles, line segments or points, for
// closest points (closest_point.h), winding numbers (winding_number.h) and inside
// tests (inside.h).
//
// Eight children to a node, eight elements to a leaf. Each child is bounded by a
// box and, around the same centre, by a flat cylinder whose axis is the mean normal
// of what it holds: a box alone cannot tell the many pieces of a smooth surface
// apart that are nearly equally far from a point, and a query would visit more of
// them the finer the mesh; the cylinder is as thin as the piece is flat.
// Built in parallel by the surface area heuristic (Wald, On fast Construction of
// SAH-based Bounding Volume Hierarchies, 2007), binary, and made wide at the least
// cost (Ylitie et al., Efficient Incoherent Ray Traversal on GPUs Through
// Compressed Wide BVHs, 2017, section 3.1).
//
// Precision: the tree is in single precision, relative to the centre and size of
// what it holds, with bounds that are rounded outwards. Vertices are kept as given,
// in double (in float where all of them are floats), and every answer that is not said to be a
// bound is finished there; so what is far from the origin, or tiny, or huge, loses nothing.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"

namespace wisp {

enum struct bvh_element { triangle, segment, point };

struct bvh_options {
  int threads = 0;  // to build with; 0: all
};

struct bvh_data;  // within the library

// An immutable tree; copies share it. Any number of threads may query it at once.
// A default one is empty, as is one over nothing.
class WISP_API bvh {
 public:
  bvh() = default;
  explicit bvh(std::shared_ptr<const bvh_data> data) : data_(std::move(data)) {}

  // Elements that queries can find: those given, without those that have a vertex
  // that is not finite. Triangles without area are kept, as the segments or points
  // that they are.
  std::size_t size() const;
  bool empty() const { return size() == 0; }
  bvh_element element() const;
  // Elements left out for a vertex that is not finite.
  std::size_t left_out() const;
  // The smallest box that holds all; min > max for an empty tree.
  dvec3 min() const;
  dvec3 max() const;
  // Memory that the tree holds, its copy of the vertices included.
  std::size_t bytes() const;

  const bvh_data* data() const { return data_.get(); }

 private:
  std::shared_ptr<const bvh_data> data_ = {};
};

// The tree over triangles of `positions`. Cost: O(n log n), about half a second for
// a million triangles on two threads. Throws std::invalid_argument for an index that
// is not of a vertex, and std::length_error for 2^31 elements or more.
WISP_API bvh make_bvh(std::span<const ivec3> triangles, std::span<const dvec3> positions,
                      const bvh_options& options = {});
WISP_API bvh make_bvh(std::span<const ivec3> triangles, std::span<const vec3> positions,
                      const bvh_options& options = {});
// The tree over line segments, and over points.
WISP_API bvh make_segment_bvh(std::span<const ivec2> segments, std::span<const dvec3> positions,
                              const bvh_options& options = {});
WISP_API bvh make_point_bvh(std::span<const dvec3> points, const bvh_options& options = {});

// The same tree with its vertices moved: much cheaper than to build, and as right,
// but slower to query the more the shape has changed. Elements that were left out
// stay out; vertices must stay finite. Throws std::invalid_argument where the number
// of positions is not that of the tree, or a vertex of an element is not finite.
WISP_API bvh refit(const bvh& tree, std::span<const dvec3> positions,
                   const bvh_options& options = {});

// The instruction set that queries use, as Highway names it ("AVX2").
WISP_API const char* geometry_target();

}  // namespace wisp
