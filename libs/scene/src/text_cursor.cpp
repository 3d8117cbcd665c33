#include "text_cursor.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

namespace wisp {

namespace {

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f' || c == '\0';
}

}  // namespace

bool parse_float(std::string_view word, float& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  double wide = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), wide);
  if (error == std::errc::result_out_of_range) {
    // from_chars leaves the value alone; the exponent's sign tells which end
    const std::size_t exponent = word.find_first_of("eE");
    const bool tiny = exponent != std::string_view::npos && exponent + 1 < word.size() &&
                      word[exponent + 1] == '-';
    wide = tiny ? 0 : std::numeric_limits<double>::infinity();
    if (word.front() == '-') wide = -wide;
  } else if (error != std::errc() || end == word.data()) {
    return false;
  }
  if (end != word.data() + word.size()) {
    if (*end != '#') return false;
    wide = std::numeric_limits<double>::quiet_NaN();  // -1.#IND, 1.#QNAN, 1.#INF
  }
  constexpr double largest = std::numeric_limits<float>::max();
  value = wide > largest    ? std::numeric_limits<float>::infinity()
          : wide < -largest ? -std::numeric_limits<float>::infinity()
                            : static_cast<float>(wide);
  return true;
}

text_cursor::text_cursor(std::span<const uint8_t> bytes, std::string file)
    : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), file_(std::move(file)) {}

void text_cursor::skip_space() {
  while (at_ < text_.size()) {
    const char c = text_[at_];
    if (c == '#') {
      while (at_ < text_.size() && text_[at_] != '\n') ++at_;
    } else if (is_space(c)) {
      line_ += c == '\n';
      ++at_;
    } else {
      return;
    }
  }
}

bool text_cursor::at_end() {
  skip_space();
  return at_ >= text_.size();
}

std::string_view text_cursor::peek() {
  skip_space();
  std::size_t end = at_;
  while (end < text_.size() && !is_space(text_[end])) ++end;
  return text_.substr(at_, end - at_);
}

std::string_view text_cursor::word() {
  const std::string_view w = peek();
  if (w.empty()) fail("the file ends where more was announced; is it cut short?");
  at_ += w.size();
  return w;
}

void text_cursor::expect(std::string_view wanted) {
  const std::string_view w = word();
  if (w != wanted) fail(fmt::format("expected \"{}\", not \"{}\"", wanted, w.substr(0, 40)));
}

float text_cursor::number() {
  const std::string_view w = word();
  float value = 0;
  if (!parse_float(w, value)) fail(fmt::format("expected a number, not \"{}\"", w.substr(0, 40)));
  return value;
}

uint64_t text_cursor::count() {
  const std::string_view w = word();
  uint64_t value = 0;
  const auto [end, error] = std::from_chars(w.data(), w.data() + w.size(), value);
  if (error != std::errc() || end != w.data() + w.size()) {
    fail(fmt::format("expected a whole number, not \"{}\"", w.substr(0, 40)));
  }
  return value;
}

void text_cursor::fail(const std::string& reason) {
  throw file_error(file_, fmt::format("line {}", line_), reason);
}

}  // namespace wisp
