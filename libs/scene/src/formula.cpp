// Formulas by muParser (https://beltoforion.de/en/muparser). Its parsers read variables
// through pointers and keep a stack, so each thread gets one of its own.

#include "wisp/scene/formula.h"

#include <fmt/format.h>
#include <muParser.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

namespace wisp {

namespace {

double mod(double a, double b) { return a - b * std::floor(a / b); }
double clamp(double v, double low, double high) { return std::min(std::max(v, low), high); }

bool is_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

// Whole characters of UTF-8, without what would spoil a line.
std::string printable(std::string_view text, std::size_t most) {
  std::string result;
  for (char c : text.substr(0, most)) {
    const auto u = static_cast<unsigned char>(c);
    result += u < 0x20 || u == 0x7f ? ' ' : c;
  }
  if (text.size() > most) {
    while (!result.empty() && (static_cast<unsigned char>(result.back()) & 0x80) != 0) {
      result.pop_back();
    }
    result += "...";
  }
  return result;
}

std::string place_text(const std::string& text, std::size_t position) {
  // characters, not bytes
  const auto count = 1 + std::count_if(text.begin(), text.begin() + std::ptrdiff_t(position),
                                       [](char c) { return (c & 0xc0) != 0x80; });
  const std::string_view rest = std::string_view(text).substr(position);
  return fmt::format(
      "at character {} of \"{}\", {}", count, printable(text, 120),
      rest.empty() ? std::string("its end") : fmt::format("before \"{}\"", printable(rest, 24)));
}

void define_names(mu::Parser& parser) {
  parser.DefineConst("pi", std::numbers::pi);
  parser.DefineConst("e", std::numbers::e);
  parser.DefineFun("floor", static_cast<double (*)(double)>(std::floor));
  parser.DefineFun("ceil", static_cast<double (*)(double)>(std::ceil));
  parser.DefineFun("cbrt", static_cast<double (*)(double)>(std::cbrt));
  parser.DefineFun("erf", static_cast<double (*)(double)>(std::erf));
  parser.DefineFun("pow", static_cast<double (*)(double, double)>(std::pow));
  parser.DefineFun("hypot", static_cast<double (*)(double, double)>(std::hypot));
  parser.DefineFun("mod", mod);
  parser.DefineFun("clamp", clamp);
}

// One parser with variables of its own.
struct machine {
  dvec3 p = {0, 0, 0};
  mu::Parser parser = {};

  explicit machine(const std::string& text) {
    define_names(parser);
    parser.DefineVar("x", &p.x);
    parser.DefineVar("y", &p.y);
    parser.DefineVar("z", &p.z);
    parser.SetExpr(text);
    parser.Eval();  // becomes byte code
  }
  machine(const machine&) = delete;
  machine& operator=(const machine&) = delete;
};

// What muParser would take, but not as it is meant.
void check_text(const std::string& text) {
  const auto fail = [&](std::size_t position, const std::string& reason) {
    throw formula_error(text, position, reason);
  };
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
    fail(0, "the formula is empty");
  }
  if (text.size() > 5000) fail(5000, "the formula is longer than 5000 characters");
  struct level {
    bool arguments = false;   // of a function
    bool comparison = false;  // since the last && || ? : or comma
    std::size_t open = 0;
  };
  std::vector<level> levels(1);
  char before = ' ';  // the last character that is no blank
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i], next = i + 1 < text.size() ? text[i + 1] : ' ';
    if (std::isspace(static_cast<unsigned char>(c)) != 0) continue;
    level& here = levels.back();
    const auto compare = [&] {
      if (here.comparison) fail(i, "comparisons cannot be chained; write a < b && b < c");
      here.comparison = true;
    };
    switch (c) {
      case '(':
        levels.push_back({is_name(before), false, i});
        if (levels.size() > 200) fail(i, "parentheses are nested more than 200 deep");
        break;
      case ')':
        if (levels.size() == 1) fail(i, "there is no parenthesis for this one to close");
        levels.pop_back();
        break;
      case ',':
        if (!here.arguments) {
          fail(i,
               "a comma separates arguments of functions; several channels are an array of "
               "formulas, and decimals have a point");
        }
        here.comparison = false;
        break;
      case '=':
        if (std::string_view("<>!=").find(before) != std::string_view::npos) break;
        if (next != '=') fail(i, "a formula cannot assign; to compare, write ==");
        compare();
        break;
      case '<':
      case '>':
        compare();
        break;
      case '?':
      case ':':
        here.comparison = false;
        break;
      case '&':
      case '|':
        if (next != c && before != c) {
          fail(i, fmt::format("the operator is {0}{0}, written twice", c));
        }
        here.comparison = false;
        break;
      case '"':
      case '\'':
        fail(i, "a formula has no texts");
        break;
      case '!':
        if (next != '=') fail(i, "there is no operator !; write a == 0 for not a");
        compare();
        break;
      case '%':
        fail(i, "there is no operator %; write mod(a, b)");
        break;
      case '*':
        if (next == '*') fail(i, "there is no operator **; powers are a^b");
        break;
      default:
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) {
          fail(i, "formulas are of plain characters (ASCII)");
        }
        if (!is_name(c) && std::string_view("+-/^.").find(c) == std::string_view::npos) {
          fail(i, fmt::format("formulas have no {}", c));
        }
    }
    before = c;
  }
  if (levels.size() > 1) fail(levels.back().open, "this parenthesis is not closed");
}

// What is wrong where muParser stopped, at `position`.
std::string reason_of(const mu::ParserError& error, const std::string& text, std::size_t position) {
  constexpr const char* no_operator = "an operator is missing here; products are written with *";
  std::string word;
  for (std::size_t i = position; i < text.size() && is_name(text[i]); ++i) word += text[i];
  switch (error.GetCode()) {
    case mu::ecUNASSIGNABLE_TOKEN: {
      if (word.empty()) return "this is no part of a formula";
      if (std::isdigit(static_cast<unsigned char>(word[0])) != 0) return "this is not a number";
      mu::Parser names;
      define_names(names);
      if (names.GetFunDef().count(word) != 0) {
        return fmt::format("{0} is a function; its arguments stand in parentheses, {0}(x)", word);
      }
      const bool call = position + word.size() < text.size() && text[position + word.size()] == '(';
      return fmt::format("there is no {} {}; the variables are x, y, z, the constants pi and e",
                         call ? "function" : "variable", printable(word, 24));
    }
    case mu::ecUNEXPECTED_EOF:
    case mu::ecINTERNAL_ERROR:
      return "something is missing here";
    case mu::ecUNEXPECTED_VAL:
    case mu::ecUNEXPECTED_VAR:
    case mu::ecUNEXPECTED_FUN:
      return no_operator;
    case mu::ecUNEXPECTED_PARENS:
      return position < text.size() && text[position] == '('
                 ? no_operator
                 : "something is missing before this parenthesis";
    case mu::ecUNEXPECTED_OPERATOR:
      return "something is missing before this operator";
    case mu::ecUNEXPECTED_ARG_SEP:
    case mu::ecUNEXPECTED_ARG:
      return "something is missing before this comma";
    case mu::ecTOO_FEW_PARAMS:
      return printable(error.GetToken(), 24) + " has too few arguments";
    case mu::ecTOO_MANY_PARAMS:
      return printable(error.GetToken(), 24) + " has too many arguments";
    case mu::ecMISSING_ELSE_CLAUSE:
    case mu::ecUNEXPECTED_CONDITIONAL:
      return "a condition is written a ? b : c";
    case mu::ecMISPLACED_COLON:
      return "there is no ? that the : before this belongs to";
    default:
      return printable(error.GetMsg(), 200);
  }
}

formula_error translate(const mu::ParserError& error, const std::string& text) {
  std::size_t position = text.size();
  if (error.GetPos() >= 0) position = std::min(position, static_cast<std::size_t>(error.GetPos()));
  // Errors of arguments come at the end of the call; the name is a better place.
  if (error.GetCode() == mu::ecTOO_FEW_PARAMS || error.GetCode() == mu::ecTOO_MANY_PARAMS) {
    const std::size_t at = text.rfind(error.GetToken(), position == 0 ? 0 : position - 1);
    if (at != std::string::npos) position = at;
  }
  return {text, position, reason_of(error, text, position)};
}

// muParser wants no blanks between a function and its parenthesis; places stay the same.
std::string join_calls(std::string text) {
  std::size_t name = std::string::npos;  // end of the last one, if only blanks follow
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (is_name(text[i])) {
      name = i + 1;
    } else if (text[i] == '(' && name != std::string::npos && name < i) {
      std::swap(text[name], text[i]);
      name = std::string::npos;
    } else if (std::isspace(static_cast<unsigned char>(text[i])) == 0) {
      name = std::string::npos;
    }
  }
  return text;
}

}  // namespace

formula_error::formula_error(const std::string& text, std::size_t position,
                             const std::string& reason)
    : std::invalid_argument(place_text(text, std::min(position, text.size())) + ": " + reason),
      position_(std::min(position, text.size())),
      reason_(reason) {}

struct formula_program {
  explicit formula_program(const std::string& text)
      : machines([text] { return std::make_unique<machine>(text); }) {}
  mutable tbb::enumerable_thread_specific<std::unique_ptr<machine>> machines;
};

formula::formula(const std::string& text) : text_(text) {
  check_text(text);
  const std::string joined = join_calls(text);
  try {
    machine first(joined);
    if (first.parser.GetNumResults() != 1) {
      throw formula_error(text, 0, "is several formulas; give an array for several channels");
    }
    if (first.parser.GetUsedVar().empty()) {
      value_ = first.parser.Eval();
    } else {
      program_ = std::make_shared<const formula_program>(joined);
    }
  } catch (const mu::ParserError& error) {
    throw translate(error, joined);
  }
}

double formula::evaluate(const dvec3& p) const {
  machine& m = *program_->machines.local();
  m.p = p;
  return m.parser.Eval();
}

void formula::evaluate(std::span<const dvec3> points, std::span<double> results) const {
  if (points.size() != results.size()) {
    throw std::invalid_argument("formula: as many results as points are needed");
  }
  if (program_ == nullptr) {
    std::fill(results.begin(), results.end(), value_);
    return;
  }
  machine& m = *program_->machines.local();
  for (std::size_t i = 0; i < points.size(); ++i) {
    m.p = points[i];
    results[i] = m.parser.Eval();
  }
}

}  // namespace wisp
