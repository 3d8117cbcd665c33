#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "ply_file.h"

namespace wisp {

namespace {

std::optional<ply_type> type_named(std::string_view name) {
  struct entry {
    std::string_view name;
    ply_type type;
  };
  constexpr entry entries[] = {
      {"char", ply_type::i8},    {"int8", ply_type::i8},     {"uchar", ply_type::u8},
      {"uint8", ply_type::u8},   {"short", ply_type::i16},   {"int16", ply_type::i16},
      {"ushort", ply_type::u16}, {"uint16", ply_type::u16},  {"int", ply_type::i32},
      {"int32", ply_type::i32},  {"uint", ply_type::u32},    {"uint32", ply_type::u32},
      {"float", ply_type::f32},  {"float32", ply_type::f32}, {"double", ply_type::f64},
      {"float64", ply_type::f64}};
  for (const entry& e : entries) {
    if (e.name == name) return e.type;
  }
  return std::nullopt;
}

std::string_view text_of(std::span<const uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Splits the header into lines.
struct header_lines {
  std::string_view text;
  std::string_view newline;  // as the first line ends: a binary body may begin with any byte
  std::size_t at = 0;
  std::size_t number = 0;
};

bool next_line(header_lines& lines, std::string_view& line) {
  if (lines.at >= lines.text.size()) return false;
  const std::size_t end = lines.text.find(lines.newline, lines.at);
  line = lines.text.substr(lines.at, end == std::string_view::npos ? end : end - lines.at);
  lines.at = end == std::string_view::npos ? lines.text.size() : end + lines.newline.size();
  lines.number++;
  while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
  return true;
}

struct header_error {
  const header_lines& lines;
  const std::string& file;

  [[noreturn]] void operator()(const std::string& reason) const {
    throw file_error(file, fmt::format("line {}", lines.number), reason);
  }
};

ply_property read_property(text_words& words, const header_error& fail) {
  auto type = [&]() {
    const std::string_view word = next_word(words);
    const auto found = type_named(word);
    if (!found) {
      fail(
          fmt::format("{} is no type of PLY, which are char, uchar, short, ushort, int, uint, "
                      "float and double",
                      quote_word(word)));
    }
    return *found;
  };
  ply_property property;
  text_words ahead = words;
  if (next_word(ahead) == "list") {
    words = ahead;
    property.is_list = true;
    property.count_type = type();
    if (property.count_type == ply_type::f32 || property.count_type == ply_type::f64) {
      fail("the count of a list must have an integer type");
    }
  }
  property.type = type();
  property.name = next_word(words);
  if (property.name.empty()) fail("the property has no name");
  return property;
}

ply_format read_format(text_words& words, const header_error& fail) {
  const std::string_view word = next_word(words);
  if (word == "ascii") return ply_format::ascii;
  if (word == "binary_little_endian") return ply_format::little;
  if (word == "binary_big_endian") return ply_format::big;
  fail(fmt::format("the format must be ascii, binary_little_endian or binary_big_endian, not {}",
                   quote_word(word)));
}

ply_element read_element(text_words& words, const header_error& fail) {
  ply_element element;
  element.name = next_word(words);
  const std::string_view count = next_word(words);
  const auto [end, error] =
      std::from_chars(count.data(), count.data() + count.size(), element.count);
  if (error != std::errc() || end != count.data() + count.size()) {
    fail(fmt::format("the count of element {} must be a whole number, not {}",
                     quote_word(element.name), quote_word(count)));
  }
  return element;
}

}  // namespace

ply_header read_ply_header(std::span<const uint8_t> bytes, const std::string& file) {
  const std::string_view text = text_of(bytes);
  if (text.substr(0, 3) != "ply" || text.size() < 4 || !is_blank(text[3])) {
    throw file_error(file, "", "does not begin with the word ply and so is no PLY file");
  }
  const std::size_t first_end = text.find_first_of("\r\n");
  header_lines lines{text, "\n"};
  if (first_end != std::string_view::npos && text[first_end] == '\r') {
    lines.newline = text.substr(first_end, 2) == "\r\n" ? "\r\n" : "\r";
  }
  const header_error fail{lines, file};

  ply_header header;
  bool has_format = false;
  std::string_view line;
  next_line(lines, line);  // ply
  while (next_line(lines, line)) {
    text_words words{line.data(), line.data(), line.data() + line.size()};
    const std::string_view key = next_word(words);
    if (key.empty()) continue;
    if (key == "end_header") {
      if (!has_format) fail("the header ends without a line that begins with format");
      header.body = lines.at;
      return header;
    }
    if (key == "comment") {
      header.comments.emplace_back(words.at, words.end);
    } else if (key == "format") {
      header.format = read_format(words, fail);
      has_format = true;
    } else if (key == "element") {
      header.elements.push_back(read_element(words, fail));
    } else if (key == "property") {
      if (header.elements.empty()) fail("a property must come after its element");
      header.elements.back().properties.push_back(read_property(words, fail));
    } else if (key != "obj_info") {
      fail(
          fmt::format("{} is unknown; the header of a PLY file holds format, comment, obj_info, "
                      "element, property and end_header",
                      quote_word(key)));
    }
  }
  throw file_error(file, "", "the header has no end_header; is the file cut short?");
}

}  // namespace wisp
