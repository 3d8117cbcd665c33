#include "obj_parse.h"

#include <fmt/format.h>

#include <charconv>
#include <limits>
#include <optional>
#include <string_view>

#include "text_cursor.h"
#include "text_words.h"

namespace wisp {

namespace {

constexpr int most = std::numeric_limits<int>::max();

struct obj_parser {
  std::string_view text = {};
  const std::string& file;
  std::size_t at = 0;
  uint32_t line = 0;       // of the file, from 1
  uint32_t next_line = 1;  // continued lines count, too
  std::string joined = {};

  [[noreturn]] void fail(const std::string& reason) const {
    throw file_error(file, fmt::format("line {}", line), reason);
  }
};

// One physical line without its end, which is \n, \r\n or \r.
std::string_view physical_line(obj_parser& p) {
  const std::size_t first = p.at;
  while (p.at < p.text.size() && p.text[p.at] != '\n' && p.text[p.at] != '\r') ++p.at;
  const std::string_view line = p.text.substr(first, p.at - first);
  if (p.at < p.text.size()) {
    p.at += p.text[p.at] == '\r' && p.at + 1 < p.text.size() && p.text[p.at + 1] == '\n' ? 2 : 1;
    p.next_line++;
  }
  return line;
}

// The next line with those that a backslash at its end adds.
bool logical_line(obj_parser& p, std::string_view& line) {
  if (p.at >= p.text.size()) return false;
  p.line = p.next_line;
  line = physical_line(p);
  if (line.empty() || line.back() != '\\') return true;
  p.joined.clear();
  while (!line.empty() && line.back() == '\\') {
    p.joined.append(line.substr(0, line.size() - 1));
    p.joined += ' ';
    if (p.at >= p.text.size()) {
      line = {};
      break;
    }
    line = physical_line(p);
  }
  p.joined.append(line);
  line = p.joined;
  return true;
}

// Numbers up to the end of the line or a comment; at most N are kept.
template <std::size_t N>
std::size_t read_numbers(const obj_parser& p, text_words& words, std::array<float, N>& values) {
  std::size_t count = 0;
  while (count < N) {
    const std::string_view word = next_word(words);
    if (word.empty() || word.front() == '#') break;
    if (!parse_float(word, values[count])) {
      p.fail(fmt::format("expected a number, not {}", quote_word(word)));
    }
    count++;
  }
  return count;
}

// An index as an index from 0: those below 0 count back from the last so far.
// Those above the last are allowed here, since it may follow.
int resolve(const obj_parser& p, std::string_view word, std::size_t count, const char* what) {
  int64_t index = 0;
  if (word.substr(0, 1) == "+") word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
  if (error != std::errc() || end != word.data() + word.size()) {
    p.fail(fmt::format("expected the index of a {}, not {}", what, quote_word(word)));
  }
  if (index == 0) p.fail(fmt::format("{} 0 is none: indices of OBJ files begin at 1", what));
  const int64_t resolved = index > 0 ? index - 1 : static_cast<int64_t>(count) + index;
  if (resolved < 0 || resolved > most) {
    p.fail(fmt::format("refers to {} {}, but there are {} before this line", what, index, count));
  }
  return static_cast<int>(resolved);
}

// position, position/texcoord, position//normal or position/texcoord/normal
obj_corner read_corner(const obj_parser& p, std::string_view word, const obj_content& content) {
  std::array<std::string_view, 3> parts = {};
  std::size_t n = 0;
  while (true) {
    const std::size_t slash = word.find('/');
    parts[n++] = word.substr(0, slash);
    if (slash == std::string_view::npos) break;
    word.remove_prefix(slash + 1);
    if (n == 3) p.fail("a vertex has at most three indices, position/texcoord/normal");
  }
  obj_corner corner;
  corner.position = resolve(p, parts[0], content.positions.size(), "vertex");
  if (!parts[1].empty()) {
    corner.texcoord = resolve(p, parts[1], content.texcoords.size(), "texture coordinate");
  }
  if (!parts[2].empty()) corner.normal = resolve(p, parts[2], content.normals.size(), "normal");
  return corner;
}

void read_element(const obj_parser& p, text_words& words, const obj_content& content,
                  obj_elements& elements) {
  const std::size_t before = elements.corners.size();
  while (true) {
    const std::string_view word = next_word(words);
    if (word.empty() || word.front() == '#') break;
    elements.corners.push_back(read_corner(p, word, content));
  }
  if (elements.corners.size() == before) p.fail("the element has no vertices");
  elements.ends.push_back(elements.corners.size());
  elements.lines.push_back(p.line);
}

void read_position(const obj_parser& p, text_words& words, obj_content& content) {
  std::array<float, 7> v = {};
  const std::size_t count = read_numbers(p, words, v);
  if (count < 3) p.fail("a vertex (v) needs three coordinates");
  content.positions.push_back({v[0], v[1], v[2]});
  const bool has_color = count >= 6;  // x y z r g b, as MeshLab writes
  if (has_color && content.colors.empty()) {
    content.colors.assign(content.positions.size() - 1, vec4{1, 1, 1, 1});
  }
  if (has_color) {
    content.colors.push_back({v[3], v[4], v[5], 1});
  } else if (!content.colors.empty()) {
    content.colors.push_back({1, 1, 1, 1});
  }
}

void check_range(const obj_content& content, const obj_elements& elements,
                 const std::string& file) {
  std::size_t k = 0;
  auto check = [&](int index, std::size_t count, const char* what) {
    if (index < 0 || static_cast<std::size_t>(index) < count) return;
    throw file_error(
        file, fmt::format("line {}", elements.lines[k]),
        fmt::format("refers to {} {}, but there are {}", what, int64_t{index} + 1, count));
  };
  for (; k < elements.ends.size(); ++k) {
    for (const obj_corner& corner : obj_element(elements, k)) {
      check(corner.position, content.positions.size(), "vertex");
      check(corner.texcoord, content.texcoords.size(), "texture coordinate");
      check(corner.normal, content.normals.size(), "normal");
    }
  }
}

}  // namespace

obj_content parse_obj(std::span<const uint8_t> bytes, const std::string& file,
                      warning_list& warnings) {
  obj_parser p{{reinterpret_cast<const char*>(bytes.data()), bytes.size()}, file};
  if (p.text.find('\0') != std::string_view::npos) {
    throw file_error(file, fmt::format("byte {}", p.text.find('\0')),
                     "is no text, which every OBJ file is");
  }
  obj_content content;
  uint32_t free_form = 0;  // the line of the first such statement
  std::string_view line;
  while (logical_line(p, line)) {
    text_words words{line.data(), line.data(), line.data() + line.size()};
    const std::string_view key = next_word(words);
    if (key == "v") {
      read_position(p, words, content);
    } else if (key == "vt") {
      std::array<float, 2> t = {};
      if (read_numbers(p, words, t) < 1) p.fail("a texture coordinate (vt) needs two numbers");
      content.texcoords.push_back({t[0], t[1]});
    } else if (key == "vn") {
      std::array<float, 3> n = {};
      if (read_numbers(p, words, n) < 3) p.fail("a normal (vn) needs three numbers");
      content.normals.push_back({n[0], n[1], n[2]});
    } else if (key == "f" || key == "fo") {
      read_element(p, words, content, content.faces);
    } else if (key == "l") {
      read_element(p, words, content, content.lines);
    } else if (key == "p") {
      read_element(p, words, content, content.points);
    } else if (key == "#" && next_word(words) == "wisp") {
      content.comments.push_back("wisp" + std::string(words.at, words.end));
    } else if ((key == "curv" || key == "curv2" || key == "surf") && free_form == 0) {
      free_form = p.line;
    }
  }
  if (free_form > 0) {
    warnings.push_back(
        fmt::format("{}: line {}: free-form curves and surfaces are not read, only f, l and p",
                    file, free_form));
  }
  if (std::max({content.positions.size(), content.texcoords.size(), content.normals.size(),
                content.faces.corners.size()}) > static_cast<std::size_t>(most)) {
    throw file_error(file, "", fmt::format("has more vertices than the {} that fit", most));
  }
  check_range(content, content.faces, file);
  check_range(content, content.lines, file);
  check_range(content, content.points, file);
  return content;
}

}  // namespace wisp
