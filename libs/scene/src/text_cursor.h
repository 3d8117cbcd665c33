#pragma once

// Words and numbers in a text of bytes, with lines for messages. '#' begins a
// comment that runs to the end of its line.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "wisp/core/error.h"

namespace wisp {

class text_cursor {
 public:
  text_cursor(std::span<const uint8_t> bytes, std::string file);

  bool at_end();            // nothing but space and comments is left
  std::string_view peek();  // the next word, empty at the end
  std::string_view word();  // the same, and goes past it; fails at the end
  void expect(std::string_view wanted);
  float number();    // any float, nan and inf included
  uint64_t count();  // a whole number >= 0
  [[noreturn]] void fail(const std::string& reason);

 private:
  void skip_space();

  std::string_view text_;
  std::string file_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

// The float that a word spells, as JSON, C or MSVC ("-1.#IND" is nan) would;
// false when it is none. Values beyond the range of float become infinite or 0.
bool parse_float(std::string_view word, float& value);

}  // namespace wisp
