#pragma once

#include <vector>

namespace wisp {

// Empties a vector and gives its memory back, which `v = {}` does not.
template <typename T>
void release(std::vector<T>& v) {
  std::vector<T>().swap(v);
}

}  // namespace wisp
