#pragma once

// Reads typed values out of a JSON tree and reports what is wrong with its
// place, as in "materials[3].color". What a caller never asked for is reported
// as unknown, so that the list of known keys is the code that reads them.

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "wisp/core/error.h"
#include "wisp/core/math.h"

namespace wisp {

// Keeps the order of the file, which is the order of a keyed group's elements.
using json_tree = nlohmann::ordered_json;

// Reads a file as JSON. Throws file_error with the place "line L, column C" for
// text that is not JSON, and for brackets nested deeper than 200.
json_tree read_json_file(const std::filesystem::path& path);

// `name` in quotes, shortened and without control characters.
std::string quote_name(std::string_view name);

// The candidate that is closest to `word`, if it is close enough to be a slip.
std::optional<std::string> closest_word(std::string_view word,
                                        const std::vector<std::string>& candidates);
// "; did you mean 'x'?" or nothing.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

// What is known of the file that is being read.
class json_context {
 public:
  json_context(std::string file, warning_list& warnings)
      : file_(std::move(file)), warnings_(&warnings) {}

  const std::string& file() const { return file_; }
  [[noreturn]] void fail(const std::string& place, const std::string& reason) const {
    throw file_error(file_, place, reason);
  }
  void warn(const std::string& place, const std::string& text);

  // Unknown keys are collected, so that a slip that a script repeated in every
  // element is one warning.
  void unknown_key(const std::string& group, const std::string& place, const std::string& key,
                   const std::vector<std::string>& known);
  void report_unknown_keys();

 private:
  struct unknown {
    std::string group, key, place, hint;
    std::size_t count = 0;
  };
  std::string file_;
  warning_list* warnings_;
  std::vector<unknown> unknown_;
};

// A closed or open interval of numbers, and how to say it.
struct json_range {
  double min = -1e300;
  double max = 1e300;
  bool open_min = false;
  bool open_max = false;
};
inline constexpr json_range any_number = {};
inline constexpr json_range not_negative = {0, 1e300};
inline constexpr json_range positive = {0, 1e300, true};
inline constexpr json_range unit_interval = {0, 1};

// An object whose keys are read one by one. Each getter leaves `value` alone
// and returns false when the key is absent.
class json_object {
 public:
  // `group` names the kind of object for the warnings about unknown keys.
  json_object(json_context& context, const json_tree& tree, std::string place, std::string group);

  json_context& context() const { return *context_; }
  const std::string& place() const { return place_; }
  std::string place_of(std::string_view key) const;
  [[noreturn]] void fail(std::string_view key, const std::string& reason) const;
  void warn(std::string_view key, const std::string& text) const;

  // The value of a key, or null; the key counts as known from now on.
  const json_tree* find(std::string_view key);
  bool has(std::string_view key) { return find(key) != nullptr; }

  bool get(std::string_view key, bool& value);
  bool get(std::string_view key, int& value, int min, int max);
  bool get(std::string_view key, uint32_t& value);
  bool get(std::string_view key, std::string& value);
  bool get(std::string_view key, float& value, const json_range& range = any_number);
  bool get(std::string_view key, vec3& value, const json_range& range = any_number);
  bool get(std::string_view key, vec4& value, const json_range& range = any_number);
  // A number for both, or two numbers.
  bool get_pair(std::string_view key, vec2& value, const json_range& range = any_number);
  bool get(std::string_view key, std::vector<float>& value, std::size_t count);
  bool get(std::string_view key, double& value, const json_range& range = any_number);
  bool get(std::string_view key, dvec3& value, const json_range& range = any_number);
  bool get(std::string_view key, std::vector<double>& value, std::size_t count);
  // The index of one of the words, or an error that lists them.
  bool get_word(std::string_view key, int& value,
                std::initializer_list<std::pair<const char*, int>> words);

  // Keys that are right elsewhere: known, with a warning that says why nothing
  // comes of them here.
  void ignore(std::initializer_list<const char*> keys, const std::string& why);

  // Warns about the keys that nobody asked for. Keys that begin with _, $ or /
  // are comments.
  void finish();

 private:
  template <typename T>
  T number(const json_tree& tree, const std::string& place, const json_range& range) const;
  template <typename T>
  void numbers(std::string_view key, const json_tree& tree, T* values, std::size_t count,
               const json_range& range) const;

  json_context* context_;
  const json_tree* tree_;
  std::string place_;
  std::string group_;
  std::vector<std::string> known_;
};

}  // namespace wisp
