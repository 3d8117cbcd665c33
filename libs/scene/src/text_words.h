#pragma once

// Words of a text, fast: lines are counted only when something is wrong.

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace wisp {

struct text_words {
  const char* begin = nullptr;
  const char* at = nullptr;
  const char* end = nullptr;
};

inline bool is_blank(char c) { return static_cast<unsigned char>(c) <= ' '; }

inline text_words words_of(std::span<const uint8_t> bytes, std::size_t offset = 0) {
  const char* begin = reinterpret_cast<const char*>(bytes.data());
  return {begin, begin + offset, begin + bytes.size()};
}

// The next word, empty at the end of the text.
inline std::string_view next_word(text_words& text) {
  while (text.at != text.end && is_blank(*text.at)) ++text.at;
  const char* first = text.at;
  while (text.at != text.end && !is_blank(*text.at)) ++text.at;
  return {first, static_cast<std::size_t>(text.at - first)};
}

// Goes past the end of the line.
inline void skip_line(text_words& text) {
  while (text.at != text.end && *text.at != '\n' && *text.at != '\r') ++text.at;
}

// The line of the last word, "line 12", for a message.
inline std::string line_place(const text_words& text) {
  return "line " + std::to_string(1 + std::count(text.begin, text.at, '\n'));
}

// For words in a message: no longer than a line, and printable.
inline std::string quote_word(std::string_view word) {
  std::string text = "\"";
  for (char c : word.substr(0, 40)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (word.size() > 40 ? "...\"" : "\"");
}

}  // namespace wisp
