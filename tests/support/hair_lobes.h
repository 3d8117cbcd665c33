#pragma once

// Other renderers draw a lobe with a probability in proportion to a weighted
// sum of A_p over the colour channels; wisp by a length. This puts their
// probabilities in the place of ours, to compare densities.

#include "wisp/hair/bsdf.h"

namespace wisp_test {

template <typename T>
void draw_lobes_by_sum(wisp::hair::hair_hit<T>& hit, int p_max, const glm::vec<3, T>& weight) {
  T sum = 0;
  for (std::size_t p = 0; p <= static_cast<std::size_t>(p_max); p++) {
    hit.ap[p].w = glm::dot(glm::vec<3, T>(hit.ap[p]), weight);
    sum += hit.ap[p].w;
  }
  for (std::size_t p = 0; p <= static_cast<std::size_t>(p_max); p++) hit.ap[p].w /= sum;
}

}  // namespace wisp_test
