#pragma once

// Round numbers along an axis.

#include <string>
#include <vector>

#include "wisp/core/math.h"

// Multiples of 1, 2, 2.5 or 5 times a power of ten within the range, `count` of them or
// about as many. None for count 0.
std::vector<double> round_numbers(const wisp::dvec2& range, int count);

// What is written beside the marks: as few digits as tell them apart, a true minus sign,
// and a power of ten that is common to all where they are very large or small.
struct tick_labels {
  std::vector<std::string> labels = {};
  std::string factor = "";  // such as x 10^-4; empty for 1
};
tick_labels label_ticks(const std::vector<double>& ticks);
// One number, to three digits.
std::string short_number(double value);
