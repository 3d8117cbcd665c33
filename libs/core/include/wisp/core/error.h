#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "wisp/core/export.h"

namespace wisp {

// The one exception that the readers and writers of wisp throw on bad input.
// what() is a full sentence for a person: "FILE: PLACE: REASON".
//   file    the path as the user gave it
//   place   where in the file: "line 12", "byte 160", "materials[3].color"; may be empty
//   reason  what is wrong and what would be right
// Const ones may be read from any number of threads at once.
class WISP_API file_error : public std::runtime_error {
 public:
  file_error(std::string file_, std::string place_, std::string reason_)
      : std::runtime_error(file_ + ": " + (place_.empty() ? "" : place_ + ": ") + reason_),
        file(std::move(file_)),
        place(std::move(place_)),
        reason(std::move(reason_)) {}

  std::string file;
  std::string place;
  std::string reason;
};

// What a reader noticed and worked around. Each entry is one line for a
// person, with the file and the place. Libraries never print: the caller does.
// A list is added to by one call at a time.
using warning_list = std::vector<std::string>;

}  // namespace wisp
