#pragma once

#include <array>
#include <utility>

#include "sdf_node.h"

namespace wisp {

// The minimum of two values with its edge rounded, see sdf.h.
inline double smooth_min(double a, double b, double blend) {
  const double h = std::max(blend - std::abs(a - b), 0.0);
  return std::min(a, b) - h * h / (4 * blend);
}

// The values near the least one, sorted, with their operands. Most are few: memory is
// asked for only where more than 32 operands meet within the blend.
struct near_values {
  struct entry {
    double value;
    const sdf_node* operand;
  };
  std::array<entry, 32> few;
  std::size_t count = 0;
  std::vector<entry> many = {};  // when they are not

  entry* begin() { return many.empty() ? few.data() : many.data(); }
  entry* end() { return begin() + (many.empty() ? count : many.size()); }
  void insert(const entry& e, double blend) {
    const bool is_few = many.empty();
    if (is_few && count < few.size()) {
      few[count++] = e;
    } else {
      if (is_few) many.assign(few.begin(), few.end());
      many.push_back(e);
    }
    for (entry* i = end() - 1; i != begin() && i->value < (i - 1)->value; --i) {
      std::swap(*i, *(i - 1));
    }
    // what is farther than the blend from the least has no say
    const double limit = begin()->value + blend;
    while (!((end() - 1)->value < limit) && end() - begin() > 1) {
      if (many.empty()) {
        --count;
      } else {
        many.pop_back();
      }
    }
  }

  bool empty() const { return count == 0; }
  double fold(double blend) {
    double result = begin()->value;
    for (entry* e = begin() + 1; e < end(); ++e) result = smooth_min(result, e->value, blend);
    return result;
  }
  dvec3 gradient(const dvec3& p, double blend) {
    if (empty()) return {0, 0, 0};
    double a = begin()->value;
    dvec3 g = begin()->operand->gradient(p);
    for (entry* e = begin() + 1; e < end(); ++e) {
      // the derivative of smooth_min by the larger operand
      const double h = std::max(blend - std::abs(a - e->value), 0.0) / (2 * blend);
      const double share = e->value < a ? 1 - h : h;
      g = (1 - share) * g + share * e->operand->gradient(p);
      a = smooth_min(a, e->value, blend);
    }
    const double l = glm::length(g);
    return l > 0 ? g / l : g;
  }
};

}  // namespace wisp
