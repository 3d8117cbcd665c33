#pragma once

#include <vector>

namespace wisp {

// Empties a vector, which nobody else may use meanwhile, and gives its memory back, which
// `v = {}` does not.
template <typename T>
void release(std::vector<T>& v) {
  std::vector<T>().swap(v);
}

}  // namespace wisp
