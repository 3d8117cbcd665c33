#pragma once

// Checks of option values.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>

// CLI11's own checks let NaN pass and print limits of three hundred digits.
inline CLI::Validator check_number(double least, const std::string& range,
                                   double most = std::numeric_limits<double>::max()) {
  return {[=](const std::string& text) -> std::string {
            char* end = nullptr;
            const double value = std::strtod(text.c_str(), &end);
            const bool whole = !text.empty() && *end == '\0';
            if (whole && value >= least && value <= most) return "";
            return fmt::format("'{}' must be a number {}", text, range);
          },
          "", ""};
}

// strtoull, which CLI11 calls, makes 2^64 - 1 of -1.
inline CLI::Validator check_whole(std::uint64_t least, std::uint64_t most) {
  return {[=](const std::string& text) -> std::string {
            std::uint64_t value = 0;
            const auto [end, error] =
                std::from_chars(text.data(), text.data() + text.size(), value);
            if (error == std::errc() && end == text.data() + text.size() && value >= least &&
                value <= most)
              return "";
            return fmt::format("'{}' must be a whole number from {} to {}", text, least, most);
          },
          "", ""};
}
