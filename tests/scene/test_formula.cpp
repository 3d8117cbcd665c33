#include "wisp/scene/formula.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "wisp/core/rng.h"

using namespace wisp;

namespace {

bool has(const std::string& text, const std::string& part) {
  const bool found = text.find(part) != std::string::npos;
  if (!found) MESSAGE("'", text, "' lacks '", part, "'");
  return found;
}

}  // namespace

TEST_CASE("scene formula: values are those of the same expression in C++") {
  using std::cos, std::exp, std::sin, std::sqrt;
  constexpr double pi = 3.14159265358979323846, e = 2.71828182845904523536;
  struct sample {
    const char* text;
    std::function<double(double, double, double)> value;
  };
  const std::vector<sample> samples = {
      {"x", [](double x, double, double) { return x; }},
      {" y\t+\nz ", [](double, double y, double z) { return y + z; }},
      {"10*exp(-100*(x^2+y^2+z^2))",
       [](double x, double y, double z) { return 10 * exp(-100 * (x * x + y * y + z * z)); }},
      {"sin(20*y) > 0", [](double, double y, double) { return sin(20 * y) > 0 ? 1.0 : 0.0; }},
      {"-x^2", [](double x, double, double) { return -(x * x); }},
      {"2^x^2", [](double x, double, double) { return std::pow(2, x * x); }},
      {"2^-x", [](double x, double, double) { return std::pow(2, -x); }},
      {"x - -y", [](double x, double y, double) { return x + y; }},
      {"x - y - z", [](double x, double y, double z) { return x - y - z; }},
      {"x / y / z", [](double x, double y, double z) { return x / y / z; }},
      {"x > 0 && y > 0 || z > 0",
       [](double x, double y, double z) { return (x > 0 && y > 0) || z > 0 ? 1.0 : 0.0; }},
      {"(x <= y) + (x >= y) + (x == y) + (x != y)",
       [](double x, double y, double) {
         return double(x <= y) + double(x >= y) + double(x == y) + double(x != y);
       }},
      {"x > 0 ? y : x < -0.5 ? z : 7",
       [](double x, double y, double z) { return x > 0      ? y
                                                 : x < -0.5 ? z
                                                            : 7.0; }},
      {"(x > 0 ? 1 : 2) * (y > 0 ? 3 : z > 0 ? 4 : 5)",
       [](double x, double y, double z) {
         return (x > 0 ? 1.0 : 2.0) * (y > 0 ? 3.0 : z > 0 ? 4.0 : 5.0);
       }},
      {"pi*x + e*y + 1e-3*z",
       [](double x, double y, double z) { return pi * x + e * y + 1e-3 * z; }},
      {"mod(x, 0.25)", [](double x, double, double) { return x - 0.25 * std::floor(x / 0.25); }},
      {"clamp(x, -0.25, 0.5)",
       [](double x, double, double) { return std::min(std::max(x, -0.25), 0.5); }},
      {"floor (x) + ceil(y) + rint(z)",
       [](double x, double y, double z) { return std::floor(x) + std::ceil(y) + std::rint(z); }},
      {"pow(abs(x), y) + hypot(y, z) + erf(z)",
       [](double x, double y, double z) {
         return std::pow(std::abs(x), y) + std::hypot(y, z) + std::erf(z);
       }},
      {"atan2(y, x) + ln(abs(z)) + log(abs(z)) + log10(abs(x)) + log2(abs(x))",
       [](double x, double y, double z) {
         return std::atan2(y, x) + 2 * std::log(std::abs(z)) + std::log10(std::abs(x)) +
                std::log2(std::abs(x));
       }},
      {"min(x, y, z) + max(x, y) + sum(x, y, z) + avg(x, y) + sign(z)",
       [](double x, double y, double z) {
         return std::min({x, y, z}) + std::max(x, y) + x + y + z + (x + y) / 2 + (z > 0) - (z < 0);
       }},
      {"tan(x) + sinh(y) + cosh(z) + tanh(x) + asin(x) + acos(y) + atan(z) + cbrt(x)",
       [](double x, double y, double z) {
         return std::tan(x) + std::sinh(y) + std::cosh(z) + std::tanh(x) + std::asin(x) +
                std::acos(y) + std::atan(z) + std::cbrt(x);
       }},
      {"sqrt(x^2 + y^2) - cos(3*pi*z)",
       [](double x, double y, double z) { return sqrt(x * x + y * y) - cos(3 * pi * z); }}};
  rng_state rng = make_rng(3);
  for (const auto& [text, value] : samples) {
    CAPTURE(text);
    const formula f{std::string(text)};
    CHECK_FALSE(f.constant());
    CHECK(f.text() == text);
    std::vector<dvec3> points;
    for (int i = 0; i < 200; ++i) {
      const double x = 2 * rand1d(rng) - 1, y = 2 * rand1d(rng) - 1, z = 2 * rand1d(rng) - 1;
      points.push_back({x, y, z});
    }
    std::vector<double> results(points.size());
    f.evaluate(points, results);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const dvec3 p = points[i];
      const double wanted = value(p.x, p.y, p.z);
      REQUIRE(std::abs(f(p) - wanted) <= 1e-13 * (1 + std::abs(wanted)));
      REQUIRE(results[i] == f(p));
    }
    CHECK_THROWS_AS(f.evaluate(points, std::span(results).first(3)), std::invalid_argument);
  }
}

TEST_CASE("scene formula: what does not vary is a number") {
  const std::vector<std::pair<std::string, double>> constants = {
      {"1", 1},           {".5", 0.5},       {"-2^2", -4},          {"2^3^2", 512},
      {"1e-300", 1e-300}, {"3 > 2", 1},      {"3 < 2 || 2 < 3", 1}, {"pi > 3 ? 5 : 6", 5},
      {"1 && 0", 0},      {"mod(-1, 3)", 2}, {"log(e)", 1}};
  for (const auto& [text, value] : constants) {
    CAPTURE(text);
    const formula f(text);
    CHECK(f.constant());
    CHECK(f({1, 2, 3}) == doctest::Approx(value).epsilon(1e-15));
  }
  CHECK(std::isnan(formula("sqrt(-1)")({0, 0, 0})));
  CHECK(std::isnan(formula("0/(x-x)")({0, 0, 0})));
  CHECK(formula("1/0")({0, 0, 0}) == std::numeric_limits<double>::infinity());
  CHECK(formula()({1, 1, 1}) == 0);
  CHECK(formula().constant());
}

TEST_CASE("scene formula: mistakes are told with their place") {
  struct mistake {
    const char* text;
    std::size_t position;
    const char* reason;
  };
  const std::vector<mistake> mistakes = {{"", 0, "empty"},
                                         {" \n", 0, "empty"},
                                         {"sin(20*", 3, "not closed"},
                                         {"sin(20*foo)", 7, "no variable foo"},
                                         {"foo(3)", 0, "no function foo"},
                                         {"X", 0, "no variable X"},
                                         {"x y", 2, "operator is missing"},
                                         {"2x", 1, "operator is missing"},
                                         {"x(3)", 1, "operator is missing"},
                                         {"1+", 2, "something is missing"},
                                         {"+", 1, "something is missing"},
                                         {"x > 0 &&", 8, "something is missing"},
                                         {"*2", 0, "before this operator"},
                                         {"()", 1, "before this parenthesis"},
                                         {"sin(x))", 6, "no parenthesis"},
                                         {"1,2", 1, "array of formulas"},
                                         {"min(x, y), 3", 9, "array of formulas"},
                                         {"(1, 2)", 2, "array of formulas"},
                                         {"min(1,,2)", 6, "before this comma"},
                                         {"x=3", 1, "write =="},
                                         {"x = y == z", 2, "write =="},
                                         {"x =+ 1", 2, "write =="},
                                         {"\"a\"", 0, "no texts"},
                                         {"sin()", 0, "too few"},
                                         {"y + sin(1,2)", 4, "too many"},
                                         {"min(sin(x), atan2(y))", 12, "too few"},
                                         {"sin", 0, "parentheses"},
                                         {"x ? 1", 5, "a ? b : c"},
                                         {"1 : 2", 3, "no ?"},
                                         {"0 < x < 1", 6, "a < b && b < c"},
                                         {"x == y == z", 7, "a < b && b < c"},
                                         {"x < y == z", 6, "a < b && b < c"},
                                         {"!x", 0, "a == 0"},
                                         {"x & y", 2, "&&"},
                                         {"x | y", 2, "||"},
                                         {"x % 2", 2, "mod(a, b)"},
                                         {"x**2", 1, "a^b"},
                                         {"x @ 2", 2, "have no @"},
                                         {"[x]", 0, "have no ["},
                                         {"1e", 0, "not a number"},
                                         {"1.2.3", 3, "operator is missing"},
                                         {"x\xc2\xb2", 1, "ASCII"},
                                         {"x \x01", 2, "ASCII"}};
  for (const auto& [text, position, reason] : mistakes) {
    CAPTURE(text);
    bool thrown = false;
    try {
      const formula f{std::string(text)};
    } catch (const formula_error& error) {
      thrown = true;
      CHECK(error.position() == position);
      CHECK(has(error.reason(), reason));
      CHECK(has(error.what(), "at character " + std::to_string(position + 1) + " of \""));
      CHECK(std::string(error.what()).find('\n') == std::string::npos);
    }
    CHECK(thrown);
  }
  // parentheses reset what is compared
  CHECK(formula("(x < y) == (y < z)")({1, 2, 3}) == 1);
  CHECK_THROWS_AS(formula(std::string(6000, '1')), formula_error);
  CHECK_THROWS_AS(formula(std::string(300, '(') + "x" + std::string(300, ')')), formula_error);
  CHECK(formula(std::string(150, '(') + "x" + std::string(150, ')'))({4, 0, 0}) == 4);
  CHECK_THROWS_AS(formula(std::string("x\0+1", 4)), formula_error);
  // characters are counted, not bytes
  try {
    const formula f("\xc2\xb2");
    FAIL_CHECK("is no formula");
  } catch (const formula_error& error) {
    CHECK(has(error.what(), "at character 1 of"));
  }
}

TEST_CASE("scene formula: any text is a formula or an error") {
  const std::string letters = "xyz0123456789.+-*/^()<>=!&|?:, e\"'%$_sincosmaxpi\t\n\x7f\xff";
  rng_state rng = make_rng(11);
  int good = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text;
    const int length = 1 + static_cast<int>(rand1d(rng) * 12);
    for (int k = 0; k < length; ++k) {
      text += letters[static_cast<std::size_t>(rand1d(rng) * static_cast<float>(letters.size()))];
    }
    try {
      const formula f(text);
      static_cast<void>(f({1, 2, 3}));
      ++good;
    } catch (const formula_error& error) {
      REQUIRE(error.position() <= text.size());
    }
  }
  CHECK(good > 100);
}

TEST_CASE("scene formula: threads do not meet") {
  const formula f("x + 10*y + 100*z");
  std::vector<std::thread> threads;
  std::vector<int> wrong(8, 0);
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&f, &wrong, t] {
      const formula copy = f;
      for (int i = 0; i < 20000; ++i) {
        const dvec3 p(t, i, t + i);
        if (copy(p) != p.x + 10 * p.y + 100 * p.z) ++wrong[static_cast<std::size_t>(t)];
      }
    });
  }
  for (auto& thread : threads) thread.join();
  for (const int w : wrong) CHECK(w == 0);
}
