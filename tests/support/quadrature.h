#pragma once

// Integrals of functions with narrow peaks whose places are known.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace wisp::test {

// Gauss-Legendre nodes and weights on [0, 1].
template <std::size_t N>
struct gauss_rule {
  std::array<double, N> x, w;
  gauss_rule() {
    for (std::size_t i = 0; i < N; i++) {
      constexpr auto n = static_cast<double>(N);
      double x_i = std::cos(3.14159265358979323846 * (static_cast<double>(i) + 0.75) / (n + 0.5));
      double d = 0;
      for (int k = 0; k < 50; k++) {
        double p0 = 1, p1 = x_i;
        for (std::size_t j = 2; j <= N; j++) {
          auto m = static_cast<double>(j);
          double p2 = ((2 * m - 1) * x_i * p1 - (m - 1) * p0) / m;
          p0 = p1;
          p1 = p2;
        }
        d = n * (x_i * p1 - p0) / (x_i * x_i - 1);
        x_i -= p1 / d;
      }
      x[i] = (1 - x_i) / 2;
      w[i] = 1 / ((1 - x_i * x_i) * d * d);
    }
  }
};

struct peak {
  double at, width;
};

// Points and weights on [a, b] in panels that shrink towards each peak and have
// an edge there.
struct rule_1d {
  std::vector<double> x, w;
};
inline rule_1d make_rule(double a, double b, const std::vector<peak>& peaks) {
  static const gauss_rule<8> gauss;
  std::vector<double> edges = {a, b};
  for (const peak& p : peaks) {
    edges.push_back(std::clamp(p.at, a, b));
    for (double s = p.width; s < b - a; s *= 2) {
      edges.push_back(std::clamp(p.at - s, a, b));
      edges.push_back(std::clamp(p.at + s, a, b));
    }
  }
  std::sort(edges.begin(), edges.end());
  rule_1d rule;
  for (std::size_t k = 0; k + 1 < edges.size(); k++) {
    double size = edges[k + 1] - edges[k];
    if (size <= 0) continue;
    for (std::size_t i = 0; i < gauss.x.size(); i++) {
      rule.x.push_back(edges[k] + size * gauss.x[i]);
      rule.w.push_back(size * gauss.w[i]);
    }
  }
  return rule;
}

}  // namespace wisp::test
