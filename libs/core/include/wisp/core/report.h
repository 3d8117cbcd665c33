#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace wisp {

// One thing that can be built for a scene: whether it was, why or why not, and
// what it cost. Plain data: read by any number of threads, changed by one.
struct part_report {
  std::string name = "";
  bool built = false;
  std::string why = "";
  double seconds = 0;
  std::size_t bytes = 0;
};

}  // namespace wisp
