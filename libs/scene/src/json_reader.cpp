#include "json_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace wisp {

namespace {

// Levenshtein distance with swaps of neighbours as one step.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); j++) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); i++) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); j++) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = last;
    last = row;
  }
  return last[b.size()];
}

std::string type_name(const json_tree& tree) {
  switch (tree.type()) {
    case json_tree::value_t::null:
      return "null";
    case json_tree::value_t::boolean:
      return tree.get<bool>() ? "true" : "false";
    case json_tree::value_t::string:
      return "the text " + quote_name(tree.get_ref<const std::string&>());
    case json_tree::value_t::array:
      return fmt::format("an array of {}", tree.size());
    case json_tree::value_t::object:
      return "an object";
    default:
      return fmt::format("the number {}", tree.dump());
  }
}

std::string range_text(const json_range& range) {
  bool low = range.min > -1e300, high = range.max < 1e300;
  std::string min = fmt::format("{}", range.min), max = fmt::format("{}", range.max);
  if (low && high)
    return fmt::format("in {}{}, {}{}", range.open_min ? '(' : '[', min, max,
                       range.open_max ? ')' : ']');
  if (low) return range.open_min ? "greater than " + min : "at least " + min;
  return range.open_max ? "less than " + max : "at most " + max;
}

std::string without_case(std::string_view word) {
  std::string result(word);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

}  // namespace

std::string quote_name(std::string_view name) {
  std::string result = "'";
  for (char c : name.substr(0, 60)) result += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  // Not in the middle of a UTF-8 sequence.
  if (name.size() > 60) {
    while (result.size() > 1 && (static_cast<unsigned char>(result.back()) & 0xc0) == 0x80)
      result.pop_back();
    if (static_cast<unsigned char>(result.back()) >= 0xc0) result.pop_back();
    result += "...";
  }
  return result + "'";
}

std::optional<std::string> closest_word(std::string_view word,
                                        const std::vector<std::string>& candidates) {
  if (word.empty() || word.size() > 60) return {};
  std::string low = without_case(word);
  std::size_t best = std::max<std::size_t>(1, word.size() / 3) + 1;
  std::optional<std::string> result;
  for (const auto& candidate : candidates) {
    if (candidate.size() > 60) continue;
    std::size_t distance = edit_distance(low, without_case(candidate));
    if (distance >= best) continue;
    best = distance;
    result = candidate;
  }
  return result;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  auto near = closest_word(word, candidates);
  return near ? "; did you mean " + quote_name(*near) + "?" : "";
}

void json_context::warn(const std::string& place, const std::string& text) {
  warnings_->push_back(file_ + ": " + (place.empty() ? "" : place + ": ") + text);
}

void json_context::unknown_key(const std::string& group, const std::string& place,
                               const std::string& key, const std::vector<std::string>& known) {
  for (auto& entry : unknown_)
    if (entry.group == group && entry.key == key) {
      entry.count++;
      return;
    }
  if (unknown_.size() >= 100) {
    if (unknown_.size() == 100) unknown_.push_back({"", "", "", "", 0});
    unknown_.back().count++;
    return;
  }
  unknown_.push_back({group, key, place, suggestion(key, known), 1});
}

void json_context::report_unknown_keys() {
  for (const auto& entry : unknown_) {
    if (entry.group.empty() && entry.key.empty() && entry.place.empty()) {
      warn("", fmt::format("and {} more unknown keys", entry.count));
    } else {
      std::string more;
      if (entry.count > 1) more = fmt::format(" (here and in {} more)", entry.count - 1);
      warn(entry.place, "unknown key, ignored" + more + entry.hint);
    }
  }
  unknown_.clear();
}

json_object::json_object(json_context& context, const json_tree& tree, std::string place,
                         std::string group)
    : context_(&context), tree_(&tree), place_(std::move(place)), group_(std::move(group)) {
  if (!tree.is_object())
    context.fail(place_, fmt::format("is {}; it must be an object {{...}}", type_name(tree)));
}

std::string json_object::place_of(std::string_view key) const {
  std::string name;
  for (char c : key.substr(0, 60)) name += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  return place_.empty() ? name : place_ + "." + name;
}
void json_object::fail(std::string_view key, const std::string& reason) const {
  context_->fail(place_of(key), reason);
}
void json_object::warn(std::string_view key, const std::string& text) const {
  context_->warn(place_of(key), text);
}

const json_tree* json_object::find(std::string_view key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
  auto it = tree_->find(std::string(key));
  return it == tree_->end() ? nullptr : &*it;
}

template <typename T>
T json_object::number(const json_tree& tree, const std::string& place,
                      const json_range& range) const {
  if (!tree.is_number())
    context_->fail(place, fmt::format("is {}; it must be a number", type_name(tree)));
  auto value = tree.get<double>();
  if (!std::isfinite(value) || std::abs(value) > static_cast<double>(3.402823466e38f))
    context_->fail(place, "is too large; numbers go up to 3.4e38");
  // Checked as what will be used too, which may be a float.
  bool low = range.open_min ? value <= range.min : value < range.min;
  bool high = range.open_max ? value >= range.max : value > range.max;
  auto result = static_cast<T>(value);
  if (range.open_min && double{result} <= range.min) low = true;
  if (range.open_max && double{result} >= range.max) high = true;
  if (low || high)
    context_->fail(place, fmt::format("is {}; it must be {}", tree.dump(), range_text(range)));
  return result;
}

template <typename T>
void json_object::numbers(std::string_view key, const json_tree& tree, T* values, std::size_t count,
                          const json_range& range) const {
  if (!tree.is_array() || tree.size() != count)
    fail(key, fmt::format("is {}; it must be an array of {} numbers", type_name(tree), count));
  for (std::size_t i = 0; i < count; i++)
    values[i] = number<T>(tree[i], fmt::format("{}[{}]", place_of(key), i), range);
}

bool json_object::get(std::string_view key, bool& value) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  if (!tree->is_boolean())
    fail(key, fmt::format("is {}; it must be true or false", type_name(*tree)));
  value = tree->get<bool>();
  return true;
}

bool json_object::get(std::string_view key, int& value, int min, int max) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  double number = tree->is_number() ? tree->get<double>() : 0.5;
  if (number != std::floor(number))
    fail(key, fmt::format("is {}; it must be a whole number", type_name(*tree)));
  if (!(number >= min && number <= max))
    fail(key, fmt::format("is {}; it must be from {} to {}", tree->dump(), min, max));
  value = static_cast<int>(number);
  return true;
}

bool json_object::get(std::string_view key, uint32_t& value) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  double number = tree->is_number() ? tree->get<double>() : 0.5;
  if (!(number >= 0 && number <= 4294967295.0) || number != std::floor(number))
    fail(key,
         fmt::format("is {}; it must be a whole number from 0 to 4294967295", type_name(*tree)));
  value = static_cast<uint32_t>(number);
  return true;
}

bool json_object::get(std::string_view key, std::string& value) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  if (!tree->is_string()) fail(key, fmt::format("is {}; it must be a text", type_name(*tree)));
  value = tree->get<std::string>();
  return true;
}

bool json_object::get(std::string_view key, float& value, const json_range& range) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  value = number<float>(*tree, place_of(key), range);
  return true;
}

bool json_object::get(std::string_view key, double& value, const json_range& range) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  value = number<double>(*tree, place_of(key), range);
  return true;
}

bool json_object::get(std::string_view key, dvec3& value, const json_range& range) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  double v[3];
  numbers(key, *tree, v, 3, range);
  value = {v[0], v[1], v[2]};
  return true;
}

bool json_object::get(std::string_view key, vec3& value, const json_range& range) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  float v[3];
  numbers(key, *tree, v, 3, range);
  value = {v[0], v[1], v[2]};
  return true;
}

bool json_object::get(std::string_view key, vec4& value, const json_range& range) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  float v[4];
  numbers(key, *tree, v, 4, range);
  value = {v[0], v[1], v[2], v[3]};
  return true;
}

bool json_object::get_pair(std::string_view key, vec2& value, const json_range& range) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  if (tree->is_number()) {
    value = vec2{number<float>(*tree, place_of(key), range)};
  } else {
    if (!tree->is_array() || tree->size() != 2)
      fail(key,
           fmt::format("is {}; it must be a number or an array of 2 numbers", type_name(*tree)));
    float v[2];
    numbers(key, *tree, v, 2, range);
    value = {v[0], v[1]};
  }
  return true;
}

bool json_object::get(std::string_view key, std::vector<float>& value, std::size_t count) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  value.resize(count);
  numbers(key, *tree, value.data(), count, any_number);
  return true;
}

bool json_object::get(std::string_view key, std::vector<double>& value, std::size_t count) {
  const json_tree* tree = find(key);
  if (tree == nullptr) return false;
  value.resize(count);
  numbers(key, *tree, value.data(), count, any_number);
  return true;
}

bool json_object::get_word(std::string_view key, int& value,
                           std::initializer_list<std::pair<const char*, int>> words) {
  std::string word;
  if (!get(key, word)) return false;
  std::vector<std::string> names;
  std::string list;
  int last = -1;
  for (const auto& [name, number] : words) {
    if (word == name) {
      value = number;
      return true;
    }
    names.emplace_back(name);
    // The first word of each number is its name, the others are older names.
    if (number != last) list += (list.empty() ? "" : ", ") + names.back();
    last = number;
  }
  fail(key, fmt::format("is {}; it must be one of {}{}", quote_name(word), list,
                        suggestion(word, names)));
}

void json_object::ignore(std::initializer_list<const char*> keys, const std::string& why) {
  for (const char* key : keys)
    if (has(key)) warn(key, why);
}

void json_object::finish() {
  for (const auto& [key, value] : tree_->items()) {
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    if (!key.empty() && (key[0] == '_' || key[0] == '$' || key[0] == '/')) continue;
    context_->unknown_key(group_, place_of(key), key, known_);
  }
}

}  // namespace wisp
