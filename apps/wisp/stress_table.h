#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

// One stiff or extreme case: what must come out, what came out, and how far that
// is from it against what the case is held to.
struct stress_row {
  std::string what, expected, got;
  double error = 0, bound = 0;
};

struct stress_options {
  uint64_t calls = 0;  // random calls
  uint64_t seed = 1;
  int threads = 0;  // 0: all
  // Told what is being done; never by two threads at once.
  std::function<void(const std::string&)> progress = [](const std::string&) {};
};

inline bool passes(const stress_row& row) { return row.error <= row.bound; }  // not for a NaN

// The larger of two errors; a NaN stays.
inline double larger_error(double a, double b) { return std::isnan(a) || b <= a ? a : b; }

// A Markdown table of the rows.
std::string stress_table(const std::vector<stress_row>& rows);
