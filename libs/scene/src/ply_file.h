#pragma once

// The container of PLY: a header that declares elements with properties, and
// their values as text or binary of either endianness (Greg Turk, "The PLY
// Polygon File Format", 1994).

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "text_words.h"
#include "wisp/core/error.h"

namespace wisp {

enum struct ply_format { ascii, little, big };
enum struct ply_type : uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

struct ply_property {
  std::string name = "";
  ply_type type = ply_type::f32;
  bool is_list = false;
  ply_type count_type = ply_type::u8;  // of lists
};

struct ply_element {
  std::string name = "";
  uint64_t count = 0;
  std::vector<ply_property> properties = {};
};

struct ply_header {
  ply_format format = ply_format::ascii;
  std::vector<ply_element> elements = {};
  std::vector<std::string> comments = {};
  std::size_t body = 0;  // where the values begin
};

ply_header read_ply_header(std::span<const uint8_t> bytes, const std::string& file);

// The number of bytes of a value in a binary file.
std::size_t ply_size(ply_type type);

// List k holds values[ends[k - 1]] .. values[ends[k] - 1].
struct ply_lists {
  std::vector<std::size_t> ends = {};
  std::vector<int64_t> values = {};
};
inline std::span<const int64_t> ply_list(const ply_lists& lists, std::size_t k) {
  const std::size_t first = k == 0 ? 0 : lists.ends[k - 1];
  return {lists.values.data() + first, lists.ends[k] - first};
}

// Where the values of one property go; the first that is set. With none they
// are read over.
struct ply_sink {
  float* floats = nullptr;  // room for `count` values at a distance of `stride`
  std::size_t stride = 1;
  float scale = 1;
  std::vector<int64_t>* integers = nullptr;
  ply_lists* lists = nullptr;
};

// What no vertex index can be: a value that is not a whole number.
inline constexpr int64_t ply_not_an_index = INT64_MIN;

// Reads the values after the header, element by element.
class ply_body {
 public:
  ply_body(std::span<const uint8_t> bytes, const ply_header& header, std::string file);

  // Throws unless the rest of the file has room for the element, so that one
  // may allocate by its count.
  void check_room(const ply_element& element) const;
  // One sink for each property.
  void read(const ply_element& element, std::span<const ply_sink> sinks);

 private:
  template <ply_format format>
  void read_rows(const ply_element& element, std::span<const ply_sink> sinks);
  template <ply_format format>
  double scalar(ply_type type);
  double word_value(std::string_view word, ply_type type) const;
  std::size_t left() const { return static_cast<std::size_t>(text_.end - text_.at); }
  [[noreturn]] void fail_short(const std::string& what) const;
  std::string place() const;

  text_words text_;
  ply_format format_;
  std::string file_;
};

}  // namespace wisp
