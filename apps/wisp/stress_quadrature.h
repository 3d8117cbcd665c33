#pragma once

// Integrals of functions with narrow peaks whose places are known.

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

struct peak {
  double at, width;
};

// The integral of f over [a, b], by eight points of Gauss and Legendre in panels
// that shrink towards every peak.
template <typename F>
inline double integrate(double a, double b, const std::vector<peak>& peaks, F&& f) {
  constexpr std::array<double, 4> x = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                       0.9602898564975363};
  constexpr std::array<double, 4> w = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                       0.1012285362903763};
  std::vector<double> edges = {a, b, (a + b) / 2};
  for (const peak& p : peaks) {
    edges.push_back(std::clamp(p.at, a, b));
    for (double s = p.width; s < b - a; s *= 2)
      for (double edge : {p.at - s, p.at + s})
        if (edge > a && edge < b) edges.push_back(edge);
  }
  std::sort(edges.begin(), edges.end());
  double sum = 0;
  for (std::size_t k = 0; k + 1 < edges.size(); k++) {
    double half = (edges[k + 1] - edges[k]) / 2, mid = (edges[k + 1] + edges[k]) / 2;
    if (half <= 0) continue;
    for (std::size_t i = 0; i < 4; i++)
      sum += half * w[i] * (f(mid - half * x[i]) + f(mid + half * x[i]));
  }
  return sum;
}
