#pragma once

// Whether points are inside of a mesh, for meshes that are closed, open,
// self-intersecting, doubled, inverted or soups: by winding numbers, found in the
// cheapest way that is right for the mesh.

#include <cstddef>
#include <memory>
#include <span>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/geometry/bvh.h"
#include "wisp/geometry/winding_number.h"

namespace wisp {

// What a winding number w says. With `nonzero`, a mesh turned inside out and one given
// twice are solid as they look, and so are parts that lie in each other; a cavity is
// one if its surface faces the other way than that around it. With `positive`, only
// what goes around counter-clockwise seen from outside is solid: a mesh turned inside
// out has no inside. With `even_odd`, each layer is the opposite of the last, whatever
// way it faces.
enum struct fill_rule {
  nonzero,   // |w| >= 1/2
  positive,  // w >= 1/2
  even_odd   // w is nearer to an odd number than to an even one, or as near
};

// How winding numbers are found.
enum struct inside_method {
  nothing,    // there are no triangles
  crossings,  // the mesh is closed: crossings of one ray, exact
  boundary,   // it is open: crossings of one ray, and its boundary to 1e-6
  moments     // its boundary is everywhere, as that of a soup: fast winding numbers
              // (fast_winding.h), to about 1e-3
};

struct inside_options {
  fill_rule rule = fill_rule::nonzero;
  int threads = 0;  // to build with; 0: all
};

struct inside_result {
  bool inside = false;
  double winding = 0;
  // How far the winding number is from the nearest one at which the answer would
  // change: twice the distance, at most 1. 1 for whole numbers, as around a closed
  // mesh; 0 where the answer could as well be the other one. Less than 1 tells that
  // the mesh is open, or its faces turned against one another.
  double confidence = 1;
};

struct inside_data;  // within the library

// What inside tests of a mesh need. Immutable; copies share it, and any number of
// threads may ask it at once. A default one is of an empty mesh.
class WISP_API inside_test {
 public:
  inside_test() = default;
  // Throws std::invalid_argument for a tree that is not over triangles.
  explicit inside_test(const bvh& tree, const inside_options& options = {});

  const bvh& tree() const;
  inside_method method() const;
  // Why that one: a sentence.
  const char* reason() const;
  fill_rule rule() const;
  // Of the mesh, with multiplicity; 0 for a closed one.
  std::size_t boundary_edges() const;
  // Memory held besides the tree.
  std::size_t bytes() const;

  const inside_data* data() const { return data_.get(); }

 private:
  std::shared_ptr<const inside_data> data_ = {};
};

// What the rule makes of a winding number. NaN: outside, with a confidence of 0.
WISP_API inside_result judge_winding(double winding, fill_rule rule);

// Outside of the box of a closed mesh at once; else see method(). On the surface of a
// closed mesh it is the answer for a point next to it. A p with a NaN is outside, with
// a winding number of NaN and a confidence of 0.
WISP_API inside_result inside(const inside_test& test, const dvec3& p);

// The same for each of `points`, on `threads` threads (0: all). The spans must have
// one size (std::invalid_argument).
WISP_API void inside_all(const inside_test& test, std::span<const dvec3> points,
                         std::span<inside_result> results, int threads = 1);

}  // namespace wisp
