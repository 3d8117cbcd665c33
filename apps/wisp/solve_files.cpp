#include "solve_files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>

#include "wisp/core/error.h"

namespace fs = std::filesystem;

namespace {

// Without blanks around it, and without quotes.
std::string_view trim(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') {
    text.remove_prefix(1);
    text.remove_suffix(1);
  }
  return text;
}

std::string shown(std::string_view text) {
  std::string result;
  for (char c : text.substr(0, 40)) {
    result +=
        static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f ? '?' : c;
  }
  return "'" + result + (text.size() > 40 ? "..." : "") + "'";
}

// Calls visit(index, field) for the fields of a line; gives back how many there are.
template <typename F>
std::size_t split(std::string_view line, F&& visit) {
  std::size_t count = 0;
  for (;;) {
    const auto comma = line.find(',');
    visit(count++, trim(line.substr(0, comma)));
    if (comma == std::string_view::npos) return count;
    line.remove_prefix(comma + 1);
  }
}

constexpr std::size_t no_column = ~std::size_t{0};

struct table_columns {
  std::vector<std::size_t> of = {};  // of each name, or no_column
  std::size_t count = 0;
};

bool same_name(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

table_columns read_header(const std::string& file, std::size_t number, std::string_view line,
                          std::span<const std::string> names, std::size_t needed) {
  const auto fail = [&](const std::string& reason) {
    throw wisp::file_error(file, fmt::format("line {}", number), reason);
  };
  table_columns columns;
  columns.of.assign(names.size(), no_column);
  columns.count = split(line, [&](std::size_t i, std::string_view name) {
    for (std::size_t c = 0; c < names.size(); ++c) {
      if (!same_name(name, names[c])) continue;
      if (columns.of[c] != no_column) fail(fmt::format("names the column {} twice", name));
      columns.of[c] = i;
    }
  });
  for (std::size_t c = 0; c < needed; ++c) {
    if (columns.of[c] == no_column) {
      fail(fmt::format("is {}, without a column {}; it must name the columns, as in {}",
                       shown(line), names[c], fmt::join(names.first(needed), ",")));
    }
  }
  return columns;
}

double parse_number(const std::string& file, std::size_t number, const std::string& name,
                    std::string_view text) {
  const auto fail = [&](const std::string& reason) {
    throw wisp::file_error(file, fmt::format("line {}", number), reason);
  };
  if (text.empty()) fail(fmt::format("has no {}; it must be a number", name));
  std::string_view digits = text;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool whole = end == digits.data() + digits.size();
  if (error == std::errc::result_out_of_range && whole) {
    fail(fmt::format("{} is {}, beyond what numbers can be", name, shown(text)));
  }
  if (error != std::errc() || !whole) {
    fail(fmt::format("{} is {}; it must be a number", name, shown(text)));
  }
  return value;
}

std::string read_text(const fs::path& path) {
  std::error_code code;
  const auto status = fs::status(path, code);
  if (!fs::exists(status)) throw wisp::file_error(path.string(), "", "there is no such file");
  if (fs::is_directory(status)) {
    throw wisp::file_error(path.string(), "", "is a folder; points are a .csv file");
  }
  std::ifstream in(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!in.is_open() || in.bad()) throw wisp::file_error(path.string(), "", "cannot be read");
  return text;
}

}  // namespace

number_table load_table(const fs::path& path, std::span<const std::string> names,
                        std::size_t needed) {
  const std::string text = read_text(path);
  const std::string file = path.string();
  std::string_view rest = text;
  if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3);
  number_table table;
  table_columns columns;
  std::vector<std::string_view> fields(names.size());
  for (std::size_t number = 1; !rest.empty(); ++number) {
    // lines end with \n, \r\n or, of old, \r
    const auto end = rest.find_first_of("\r\n");
    const std::string_view line = rest.substr(0, end);
    const bool pair = end != std::string_view::npos && rest.substr(end).starts_with("\r\n");
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + (pair ? 2 : 1));
    if (trim(line).empty() || trim(line)[0] == '#') continue;
    if (columns.count == 0) {
      columns = read_header(file, number, line, names, needed);
      for (const std::size_t c : columns.of) table.known.push_back(c != no_column);
      continue;
    }
    const std::size_t count = split(line, [&](std::size_t i, std::string_view field) {
      for (std::size_t c = 0; c < names.size(); ++c)
        if (columns.of[c] == i) fields[c] = field;
    });
    if (count != columns.count) {
      throw wisp::file_error(file, fmt::format("line {}", number),
                             fmt::format("has {} column{}, but the first line names {}", count,
                                         count == 1 ? "" : "s", columns.count));
    }
    for (std::size_t c = 0; c < names.size(); ++c) {
      table.numbers.push_back(table.known[c] ? parse_number(file, number, names[c], fields[c])
                                             : std::numeric_limits<double>::quiet_NaN());
    }
    ++table.rows;
  }
  if (columns.count == 0) {
    throw wisp::file_error(file, "",
                           fmt::format("is empty; its first line must name the columns {}",
                                       fmt::join(names.first(needed), ",")));
  }
  if (table.rows == 0) throw wisp::file_error(file, "", "has no points after its first line");
  return table;
}

std::vector<wisp::dvec3> load_points(const fs::path& path) {
  static const std::array<std::string, 3> names = {"x", "y", "z"};
  const number_table table = load_table(path, names, names.size());
  std::vector<wisp::dvec3> points;
  points.reserve(table.rows);
  for (std::size_t i = 0; i < table.numbers.size(); i += 3) {
    points.push_back({table.numbers[i], table.numbers[i + 1], table.numbers[i + 2]});
  }
  return points;
}

namespace {

class table_writer {
 public:
  explicit table_writer(const fs::path& path)
      : path_(path),
        beside_(path.parent_path() / fmt::format(".wisp-{}.csv.tmp", getpid())),
        out_(beside_, std::ios::binary) {}
  ~table_writer() {
    std::error_code ignored;
    if (!done_) fs::remove(beside_, ignored);
  }
  table_writer(const table_writer&) = delete;
  table_writer& operator=(const table_writer&) = delete;

  void name(std::string_view name) { field(name); }
  void number(double v) {
    if (std::isnan(v)) {
      field("nan");
    } else {
      separate();
      fmt::format_to(std::back_inserter(buffer_), "{}", v);
    }
  }
  void count(std::uint64_t n) {
    separate();
    fmt::format_to(std::back_inserter(buffer_), "{}", n);
  }
  void end_row() {
    buffer_.push_back('\n');
    first_ = true;
    if (buffer_.size() > (1 << 20)) flush();
  }
  void finish() {
    flush();
    out_.close();
    if (!out_) {
      throw wisp::file_error(path_.string(), "",
                             "cannot be written; does the folder exist, is there room?");
    }
    std::error_code error;
    fs::rename(beside_, path_, error);
    if (error) throw wisp::file_error(path_.string(), "", "cannot be written: " + error.message());
    done_ = true;
  }

 private:
  void separate() {
    if (!first_) buffer_.push_back(',');
    first_ = false;
  }
  void field(std::string_view text) {
    separate();
    buffer_.append(text.data(), text.data() + text.size());
  }
  void flush() {
    out_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    buffer_.clear();
  }

  fs::path path_, beside_;
  std::ofstream out_;
  fmt::memory_buffer buffer_;
  bool first_ = true, done_ = false;
};

}  // namespace

void save_points(const fs::path& path, std::span<const wisp::dvec3> points,
                 const wisp::solution& solution, int channels, const wisp::space_field& exact) {
  table_writer table(path);
  const bool gradient = !solution.gradients.empty();
  const auto names = [&](const char* name) {
    for (int c = 0; c < channels; ++c) {
      table.name(channels == 1 ? std::string(name) : fmt::format("{}_{}", name, c));
    }
  };
  for (const char* name : {"x", "y", "z"}) table.name(name);
  names("value");
  names("std_error");
  for (const char* name : {"walks", "mean_steps"}) table.name(name);
  if (gradient) {
    for (const char* name : {"gx", "gy", "gz", "gx_error", "gy_error", "gz_error"}) names(name);
  }
  if (exact) names("exact");
  table.end_row();

  for (std::size_t i = 0; i < points.size(); ++i) {
    const wisp::estimate& e = solution.values[i];
    for (int k = 0; k < 3; ++k) table.number(points[i][k]);
    for (int c = 0; c < channels; ++c) table.number(e.mean[c]);
    for (int c = 0; c < channels; ++c) table.number(e.standard_error[c]);
    table.count(e.walks);
    const bool has_value = e.walks > 0 || e.status == wisp::point_status::boundary;
    table.number(has_value ? e.mean_steps : std::numeric_limits<double>::quiet_NaN());
    if (gradient) {
      const wisp::gradient_estimate& g = solution.gradients[i];
      const bool known = e.walks > 0 && e.status == wisp::point_status::ok;
      const auto put = [&](const auto& values) {
        for (int k = 0; k < 3; ++k)
          for (int c = 0; c < channels; ++c)
            table.number(known ? values[static_cast<std::size_t>(c)][k]
                               : std::numeric_limits<double>::quiet_NaN());
      };
      put(g.mean);
      put(g.standard_error);
    }
    if (exact) {
      // the formula means nothing outside
      const wisp::dvec4 u = e.status == wisp::point_status::outside
                                ? wisp::dvec4{std::numeric_limits<double>::quiet_NaN()}
                                : exact(points[i]);
      for (int c = 0; c < channels; ++c) table.number(u[c]);
    }
    table.end_row();
  }
  table.finish();
}
