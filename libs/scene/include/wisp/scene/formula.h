#pragma once

// Functions of position that are given as text: "sin(20*y) > 0".
//
// What a formula may hold: the variables x, y, z; the constants pi and e; numbers; + - *
// / and ^ (powers, from the right; -x^2 is -(x^2)); comparisons, && and ||, which are 0
// or 1; condition ? a : b; and the functions
//   sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh
//   exp ln (log is the same) log2 log10 sqrt cbrt pow hypot erf
//   abs sign floor ceil rint mod min max sum avg clamp
// where mod(a, b) is in [0, b), clamp(a, low, high), and min, max, sum, avg take any
// number of arguments.
//
// All is in double and goes by IEEE 754: 1/0 is infinite, sqrt(-1) is not a number.

#include <cstddef>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

#include "wisp/core/export.h"
#include "wisp/core/math.h"

namespace wisp {

// Thrown for a text that is not a formula. what() tells the place, its surroundings and
// the reason in one line: at character 8 of "sin(20*foo)", before "foo)": ...
class WISP_API formula_error : public std::invalid_argument {
 public:
  formula_error(const std::string& text, std::size_t position, const std::string& reason);
  std::size_t position() const { return position_; }  // counted from 0; the length at the end
  const std::string& reason() const { return reason_; }

 private:
  std::size_t position_;
  std::string reason_;
};

struct formula_program;  // within the library

// A compiled formula. Copies share it; any number of threads may evaluate it at once,
// without locks. A formula without variables costs nothing. A default one is 0.
class WISP_API formula {
 public:
  formula() = default;
  // Throws formula_error.
  explicit formula(const std::string& text);

  double operator()(const dvec3& p) const { return program_ == nullptr ? value_ : evaluate(p); }
  // The same for each of `points`; the spans must have one size (std::invalid_argument).
  void evaluate(std::span<const dvec3> points, std::span<double> results) const;

  // Whether the value is the same everywhere.
  bool constant() const { return program_ == nullptr; }
  const std::string& text() const { return text_; }

 private:
  double evaluate(const dvec3& p) const;

  std::string text_ = "0";
  double value_ = 0;
  std::shared_ptr<const formula_program> program_ = {};
};

}  // namespace wisp
