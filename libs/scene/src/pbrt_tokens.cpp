// pbrt-v4 input file format: https://pbrt.org/fileformat-v4

#include "pbrt_tokens.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <utility>

namespace wisp {

namespace {

constexpr std::size_t max_include_depth = 16;
constexpr int max_includes = 4096;

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
bool ends_word(char c) { return is_space(c) || c == '"' || c == '[' || c == ']' || c == '#'; }

// The number that a whole word spells.
bool parse_number(std::string_view word, double& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc() && end == word.data() + word.size() && !word.empty()) return true;
  if (error != std::errc::result_out_of_range) return false;
  const std::size_t exponent = word.find_first_of("eE");
  const bool tiny =
      exponent != std::string_view::npos && exponent + 1 < word.size() && word[exponent + 1] == '-';
  value = tiny ? 0 : std::numeric_limits<double>::infinity();
  if (word.front() == '-') value = -value;
  return true;
}

bool begins_number(std::string_view word) {
  const char c = word.front();
  return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.';
}

}  // namespace

pbrt_tokens::pbrt_tokens(std::string text, std::string file)
    : base_(std::filesystem::path(file).parent_path()) {
  sources_.push_back({std::move(text), std::move(file)});
}

void pbrt_tokens::fail(const std::string& reason) const {
  throw file_error(sources_.back().file, fmt::format("line {}", sources_.back().line), reason);
}

pbrt_token pbrt_tokens::read() {
  while (true) {
    source& s = sources_.back();
    while (s.at < s.text.size() && (is_space(s.text[s.at]) || s.text[s.at] == '#')) {
      if (s.text[s.at] == '#') {
        while (s.at < s.text.size() && s.text[s.at] != '\n') ++s.at;
      } else {
        s.line += s.text[s.at] == '\n';
        ++s.at;
      }
    }
    if (s.at < s.text.size()) break;
    if (sources_.size() == 1) return {};
    sources_.pop_back();
  }
  source& s = sources_.back();
  const char c = s.text[s.at];
  if (c == '[' || c == ']') {
    ++s.at;
    return {c == '[' ? pbrt_token_type::open : pbrt_token_type::close};
  }
  if (c == '"') {
    std::string text;
    for (++s.at; s.at < s.text.size() && s.text[s.at] != '"'; ++s.at) {
      if (s.text[s.at] == '\n') fail("a string does not end on its line; a closing \" is missing");
      if (s.text[s.at] == '\\' && s.at + 1 < s.text.size() && s.text[s.at + 1] != '\n') ++s.at;
      text.push_back(s.text[s.at]);
    }
    if (s.at >= s.text.size()) fail("the file ends within a string; a closing \" is missing");
    ++s.at;
    return {pbrt_token_type::text, std::move(text)};
  }
  const std::size_t begin = s.at;
  while (s.at < s.text.size() && !ends_word(s.text[s.at])) ++s.at;
  const std::string_view word = std::string_view(s.text).substr(begin, s.at - begin);
  if (!begins_number(word)) return {pbrt_token_type::word, std::string(word)};
  double value = 0;
  if (!parse_number(word, value)) fail(fmt::format("\"{}\" is no number", word.substr(0, 40)));
  return {pbrt_token_type::number, "", value};
}

const pbrt_token& pbrt_tokens::peek() {
  if (!ahead_) ahead_ = read();
  return *ahead_;
}

pbrt_token pbrt_tokens::next() {
  if (!ahead_) return read();
  pbrt_token token = std::move(*ahead_);
  ahead_.reset();
  return token;
}

double pbrt_tokens::number() {
  const pbrt_token token = next();
  if (token.type != pbrt_token_type::number) fail("expected a number");
  return token.number;
}

std::vector<double> pbrt_tokens::numbers(std::size_t count) {
  const bool brackets = peek().type == pbrt_token_type::open;
  if (brackets) next();
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(number());
  if (brackets && next().type != pbrt_token_type::close) {
    fail(fmt::format("expected ] after {} numbers", count));
  }
  return values;
}

std::string pbrt_tokens::text() {
  pbrt_token token = next();
  if (token.type != pbrt_token_type::text) fail("expected a string in quotes");
  return std::move(token.text);
}

std::vector<pbrt_parameter> pbrt_tokens::parameters() {
  std::vector<pbrt_parameter> list;
  while (peek().type == pbrt_token_type::text) {
    pbrt_parameter p;
    const std::string declaration = text();
    const std::size_t type_begin = declaration.find_first_not_of(" \t");
    const std::size_t type_end = declaration.find_first_of(" \t", type_begin);
    const std::size_t name_begin = declaration.find_first_not_of(" \t", type_end);
    if (type_begin == std::string::npos || name_begin == std::string::npos) {
      fail(fmt::format("parameter \"{}\" should be \"TYPE NAME\"", declaration.substr(0, 80)));
    }
    p.type = declaration.substr(type_begin, type_end - type_begin);
    const std::size_t name_end = declaration.find_first_of(" \t", name_begin);
    p.name = declaration.substr(
        name_begin, name_end == std::string::npos ? std::string::npos : name_end - name_begin);
    auto take = [&] {
      pbrt_token token = next();
      if (token.type == pbrt_token_type::number) {
        p.numbers.push_back(token.number);
      } else if (token.type == pbrt_token_type::text ||
                 (token.type == pbrt_token_type::word &&
                  (token.text == "true" || token.text == "false"))) {
        p.texts.push_back(std::move(token.text));
      } else {
        fail(
            fmt::format("parameter \"{}\" wants numbers, strings, true or false, in brackets if "
                        "there are several",
                        declaration.substr(0, 80)));
      }
    };
    if (peek().type == pbrt_token_type::open) {
      next();
      while (peek().type != pbrt_token_type::close) take();
      next();
    } else {
      take();
    }
    list.push_back(std::move(p));
  }
  return list;
}

void pbrt_tokens::skip_arguments() {
  auto is_argument = [](const pbrt_token& t) {
    if (t.type == pbrt_token_type::word) return t.text == "true" || t.text == "false";
    return t.type != pbrt_token_type::end;
  };
  while (is_argument(peek())) next();
}

void pbrt_tokens::include(const std::string& name) {
  if (sources_.size() >= max_include_depth) {
    fail(fmt::format("includes go deeper than {} files; does a file include itself?",
                     max_include_depth));
  }
  if (++includes_ > max_includes)
    fail(fmt::format("more than {} files are included", max_includes));
  if (name.ends_with(".gz")) {
    fail(fmt::format("the included file {} is compressed; unpack it first", name));
  }
  const std::filesystem::path path = base_ / name;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    fail(fmt::format("the included file {} does not exist", path.string()));
  }
  std::ifstream stream(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream.good() && !stream.eof()) {
    fail(fmt::format("the included file {} cannot be read", path.string()));
  }
  sources_.push_back({std::move(text), path.string()});
}

}  // namespace wisp
