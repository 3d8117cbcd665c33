// From bytes to a JSON tree, with errors that say where and what.

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <system_error>

#include "json_reader.h"

namespace wisp {

namespace {

constexpr int max_depth = 200;

std::string place_in(const std::string& text, std::size_t offset) {
  offset = std::min(offset, text.size());
  auto end = text.begin() + static_cast<std::ptrdiff_t>(offset);
  auto line = std::count(text.begin(), end, '\n') + 1;
  std::size_t start = offset == 0 ? std::string::npos : text.rfind('\n', offset - 1);
  return fmt::format("line {}, column {}", line,
                     offset - (start == std::string::npos ? 0 : start + 1) + 1);
}

std::string read_text(const std::filesystem::path& path) {
  std::error_code code;
  auto status = std::filesystem::status(path, code);
  if (!std::filesystem::exists(status))
    throw file_error(path.string(), "", "there is no such file");
  if (std::filesystem::is_directory(status))
    throw file_error(path.string(), "", "is a folder; a scene is a .json file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw file_error(path.string(), "", "cannot be opened for reading");
  std::string text;
  std::vector<char> block(1 << 16);
  while (stream.read(block.data(), static_cast<std::streamsize>(block.size())) ||
         stream.gcount() > 0)
    text.append(block.data(), static_cast<std::size_t>(stream.gcount()));
  if (stream.bad()) throw file_error(path.string(), "", "cannot be read to its end");
  return text;
}

// Brackets are counted outside strings before parsing, since trees are walked
// and freed by functions whose depth is that of the file.
void check_depth(const std::string& file, const std::string& text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); i++) {
    char c = text[i];
    if (in_string) {
      if (c == '\\')
        i++;
      else if (c == '"')
        in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > max_depth)
        throw file_error(
            file, place_in(text, i),
            fmt::format("brackets are nested more than {} deep; a scene needs about ten",
                        max_depth));
    } else if (c == ']' || c == '}') {
      depth--;
    }
  }
}

// The parser's message without its prefix, printable, of bounded length (it
// quotes the last token, which may be megabytes).
std::string plain_message(std::string message) {
  for (const char* start : {"syntax error", "number overflow"})
    if (auto at = message.find(start); at != std::string::npos) {
      message.erase(0, at);
      break;
    }
  for (char& c : message)
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '?';
  if (message.size() > 240)
    message = message.substr(0, 120) + " ... " + message.substr(message.size() - 110);
  return message;
}

}  // namespace

json_tree read_json_file(const std::filesystem::path& path) {
  std::string text = read_text(path);
  std::string file = path.string();
  auto first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first == std::string::npos) throw file_error(file, "", "is empty; a scene is a JSON object");
  if (text.find('\0') != std::string::npos || (text[first] != '{' && text[first] != '['))
    throw file_error(file, place_in(text, first),
                     "is not a JSON text; a scene in JSON begins with '{' (and is UTF-8)");
  check_depth(file, text);
  try {
    return json_tree::parse(text);
  } catch (const json_tree::parse_error& error) {
    throw file_error(file, place_in(text, error.byte > 0 ? error.byte - 1 : 0),
                     plain_message(error.what()));
  } catch (const json_tree::exception& error) {
    // A number that no double holds; this exception quotes it without its place.
    std::string what = error.what();
    auto quote = what.find('\'');
    std::size_t at = std::string::npos;
    if (quote != std::string::npos)
      at = text.find(what.substr(quote + 1, what.rfind('\'') - quote - 1));
    throw file_error(file, at == std::string::npos ? "" : place_in(text, at), plain_message(what));
  }
}

}  // namespace wisp
