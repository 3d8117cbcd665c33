#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

#include "ply_file.h"
#include "text_cursor.h"

namespace wisp {

namespace {

template <typename T>
double load_as(const char* at, bool swap) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), at, sizeof(T));
  if (swap) std::reverse(raw.begin(), raw.end());
  return static_cast<double>(std::bit_cast<T>(raw));
}

// Doubles hold every index exactly; converting others would be undefined.
int64_t to_index(double value) {
  constexpr double largest = 0x1p53;
  if (!(std::abs(value) <= largest) || value != std::floor(value)) return ply_not_an_index;
  return static_cast<int64_t>(value);
}

// Values beyond the range of float become infinite; converting them would be
// undefined.
float to_float(double value) {
  constexpr double largest = std::numeric_limits<float>::max();
  if (value > largest) return std::numeric_limits<float>::infinity();
  if (value < -largest) return -std::numeric_limits<float>::infinity();
  return static_cast<float>(value);
}

}  // namespace

std::size_t ply_size(ply_type type) {
  switch (type) {
    case ply_type::i8:
    case ply_type::u8:
      return 1;
    case ply_type::i16:
    case ply_type::u16:
      return 2;
    case ply_type::f64:
      return 8;
    default:
      return 4;
  }
}

ply_body::ply_body(std::span<const uint8_t> bytes, const ply_header& header, std::string file)
    : text_(words_of(bytes, header.body)), format_(header.format), file_(std::move(file)) {}

std::string ply_body::place() const {
  if (format_ == ply_format::ascii) return line_place(text_);
  return fmt::format("byte {}", text_.at - text_.begin);
}

void ply_body::fail_short(const std::string& what) const {
  throw file_error(file_, place(), fmt::format("the file ends within {}; is it cut short?", what));
}

void ply_body::check_room(const ply_element& element) const {
  // Text needs a digit and a separator for each value, but for the last.
  uint64_t row = 0;
  for (const ply_property& p : element.properties) {
    row += format_ == ply_format::ascii ? 2 : ply_size(p.is_list ? p.count_type : p.type);
  }
  const uint64_t room = left() + (format_ == ply_format::ascii ? 1u : 0u);
  if (row > 0 && element.count > room / row) {
    throw file_error(
        file_, place(),
        fmt::format("the header announces {} of element {}, which need at least {} bytes each, but "
                    "{} bytes are left; is the file cut short?",
                    element.count, quote_word(element.name), row, left()));
  }
}

double ply_body::word_value(std::string_view word, ply_type type) const {
  if (type != ply_type::f32 && type != ply_type::f64) {
    int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc() && end == word.data() + word.size()) {
      return static_cast<double>(value);
    }
  }
  float value = 0;
  if (!parse_float(word, value)) {
    throw file_error(file_, place(), fmt::format("expected a number, not {}", quote_word(word)));
  }
  return value;
}

template <ply_format format>
double ply_body::scalar(ply_type type) {
  if constexpr (format == ply_format::ascii) {
    const std::string_view word = next_word(text_);
    if (word.empty()) fail_short("the values that its header announces");
    return word_value(word, type);
  } else {
    constexpr bool swap =
        (format == ply_format::little) != (std::endian::native == std::endian::little);
    const std::size_t size = ply_size(type);
    if (left() < size) fail_short("the values that its header announces");
    const char* at = text_.at;
    text_.at += size;
    switch (type) {
      case ply_type::i8:
        return load_as<int8_t>(at, swap);
      case ply_type::u8:
        return load_as<uint8_t>(at, swap);
      case ply_type::i16:
        return load_as<int16_t>(at, swap);
      case ply_type::u16:
        return load_as<uint16_t>(at, swap);
      case ply_type::i32:
        return load_as<int32_t>(at, swap);
      case ply_type::u32:
        return load_as<uint32_t>(at, swap);
      case ply_type::f32:
        return load_as<float>(at, swap);
      case ply_type::f64:
        return load_as<double>(at, swap);
    }
    return 0;
  }
}

template <ply_format format>
void ply_body::read_rows(const ply_element& element, std::span<const ply_sink> sinks) {
  for (std::size_t row = 0; row < element.count; ++row) {
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      const ply_property& property = element.properties[k];
      const ply_sink& sink = sinks[k];
      if (!property.is_list) {
        const double value = scalar<format>(property.type);
        if (sink.floats) {
          sink.floats[row * sink.stride] = to_float(value) * sink.scale;
        } else if (sink.integers) {
          sink.integers->push_back(to_index(value));
        }
        continue;
      }
      const int64_t count = to_index(scalar<format>(property.count_type));
      const std::size_t size = format == ply_format::ascii ? 1 : ply_size(property.type);
      if (count < 0) {
        throw file_error(
            file_, place(),
            fmt::format("a list of element {} has a count that is no whole number >= 0",
                        quote_word(element.name)));
      }
      if (static_cast<uint64_t>(count) > left() / size) {
        fail_short(
            fmt::format("a list of {} values of element {}", count, quote_word(element.name)));
      }
      for (int64_t i = 0; i < count; ++i) {
        const double value = scalar<format>(property.type);
        if (sink.lists) sink.lists->values.push_back(to_index(value));
      }
      if (sink.lists) sink.lists->ends.push_back(sink.lists->values.size());
    }
  }
}

void ply_body::read(const ply_element& element, std::span<const ply_sink> sinks) {
  if (element.properties.empty()) return;
  check_room(element);
  switch (format_) {
    case ply_format::ascii:
      return read_rows<ply_format::ascii>(element, sinks);
    case ply_format::little:
      return read_rows<ply_format::little>(element, sinks);
    case ply_format::big:
      return read_rows<ply_format::big>(element, sinks);
  }
}

}  // namespace wisp
