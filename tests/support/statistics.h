#pragma once

// Statistical tests with a stated rate of false alarms.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace wisp::test {

// Upper tail of the chi-square distribution with k degrees of freedom, by the
// regularised incomplete gamma function (series and continued fraction).
inline double chi_square_tail(double x, double k) {
  double a = k / 2, z = x / 2;
  if (z <= 0) return 1;
  double front = std::exp(a * std::log(z) - z - std::lgamma(a));
  if (z < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 10000 && term > sum * 1e-16; n++) {
      term *= z / (a + n);
      sum += term;
    }
    return 1 - front * sum;
  }
  double b = z + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int i = 1; i < 10000; i++) {
    double an = -i * (i - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    double delta = c * d;
    h *= delta;
    if (std::abs(delta - 1) < 1e-16) break;
  }
  return front * h;
}

// The p-value of counts against expected counts. Cells that expect fewer than 5
// are pooled, smallest first. A count where nothing is expected gives 0.
inline double chi_square_p_value(const std::vector<double>& counts,
                                 const std::vector<double>& expected) {
  std::vector<std::size_t> order(counts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](auto i, auto j) { return expected[i] < expected[j]; });
  double pooled_count = 0, pooled_expected = 0, statistic = 0;
  int cells = 0;
  auto add = [&](double count, double expect) {
    statistic += (count - expect) * (count - expect) / expect;
    cells++;
  };
  for (auto i : order) {
    if (expected[i] == 0) {
      if (counts[i] > 0) return 0;
      continue;
    }
    if (expected[i] < 5 || (pooled_expected > 0 && pooled_expected < 5)) {
      pooled_count += counts[i];
      pooled_expected += expected[i];
    } else {
      add(counts[i], expected[i]);
    }
  }
  if (pooled_expected > 0) add(pooled_count, pooled_expected);
  return cells > 1 ? chi_square_tail(statistic, cells - 1) : 1;
}

// The significance of each of n tests such that all together raise a false alarm
// with probability `rate` (Sidak).
inline double sidak(double rate, int tests) { return 1 - std::pow(1 - rate, 1.0 / tests); }

}  // namespace wisp::test
