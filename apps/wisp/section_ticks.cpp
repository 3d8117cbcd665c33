#include "section_ticks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace {

std::string with_minus(std::string text) {
  if (!text.empty() && text[0] == '-') text.replace(0, 1, "\u2212");
  return text;
}

std::string raised(int exponent) {
  static constexpr const char* digits[] = {"\u2070", "\u00b9", "\u00b2", "\u00b3", "\u2074",
                                           "\u2075", "\u2076", "\u2077", "\u2078", "\u2079"};
  std::string text = exponent < 0 ? "\u207b" : "";
  for (const char c : std::to_string(std::abs(exponent))) text += digits[c - '0'];
  return text;
}

}  // namespace

std::vector<double> round_numbers(const wisp::dvec2& range, int count) {
  if (count < 1 || !(range.x < range.y)) return {};
  const double raw = (range.y / count - range.x / count);
  const double power = std::pow(10, std::floor(std::log10(raw)));
  if (!(power > 0) || !std::isfinite(power)) return {};
  double step = 10 * power, best = std::numeric_limits<double>::infinity();
  for (const double s : {1.0, 2.0, 2.5, 5.0, 10.0}) {
    const double off = std::abs(std::log(s * power / raw));
    if (off < best) best = off, step = s * power;
  }
  std::vector<double> numbers;
  const double slack = 1e-9 * step;
  const double first = std::ceil((range.x - slack) / step),
               last = std::floor((range.y + slack) / step);
  // beyond these there are no more digits to tell them apart
  if (!(std::max(std::abs(first), std::abs(last)) < 1e12)) return {};
  for (double i = first; i <= last; i++)
    numbers.push_back(std::clamp(i * step, range.x, range.y) + 0.0);
  return numbers;
}

tick_labels label_ticks(const std::vector<double>& ticks) {
  tick_labels result;
  if (ticks.empty()) return result;
  double most = 0, step = 0;
  for (const double t : ticks) most = std::max(most, std::abs(t));
  if (ticks.size() > 1)
    step = (ticks.back() - ticks.front()) / static_cast<double>(ticks.size() - 1);
  int exponent = 0;
  if (most > 0 && (most >= 1e5 || most < 1e-2)) {
    exponent = static_cast<int>(std::floor(std::log10(most) + 1e-9));
    result.factor = "\u00d710" + raised(exponent);
  }
  const double scale = std::pow(10.0, -exponent);
  int digits = 0;
  if (step > 0) {
    // until the step is whole, or no double has more
    while (digits < 12) {
      const double s = step * scale * std::pow(10, digits);
      if (std::abs(s - std::round(s)) < 1e-3 * std::max(1.0, s) && s > 0.5) break;
      digits++;
    }
  } else {
    digits = 3;
  }
  for (const double t : ticks) {
    const double value = std::abs(t) < 1e-9 * step ? 0.0 : t * scale;
    result.labels.push_back(with_minus(fmt::format("{:.{}f}", value, digits)));
  }
  return result;
}

std::string short_number(double value) {
  const double size = std::abs(value);
  if (size == 0) return "0";
  if (size >= 1e5 || size < 1e-3) {
    auto text = fmt::format("{:.2e}", value);
    const auto e = text.find('e');
    if (e == std::string::npos) return text;
    return with_minus(text.substr(0, e)) + "\u00d710" + raised(std::atoi(text.c_str() + e + 1));
  }
  return with_minus(size >= 1000 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value));
}
