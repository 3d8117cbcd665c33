#pragma once

#include <cmath>
#include <cstdint>

namespace wisp {

// Running mean and variance (Welford 1962), stable for any number of samples. One is
// added to by one thread at a time; threads that have one each merge them at the end.
struct running_stats {
  uint64_t count = 0;
  double mean = 0;
  double m2 = 0;
};

inline void add_sample(running_stats& s, double x) {
  s.count++;
  double d = x - s.mean;
  s.mean += d / static_cast<double>(s.count);
  s.m2 += d * (x - s.mean);
}

// Joins two sets of samples (Chan et al. 1979).
inline void merge(running_stats& a, const running_stats& b) {
  if (b.count == 0) return;
  uint64_t n = a.count + b.count;
  double d = b.mean - a.mean;
  double nb = static_cast<double>(b.count) / static_cast<double>(n);
  a.mean += d * nb;
  a.m2 += b.m2 + d * d * static_cast<double>(a.count) * nb;
  a.count = n;
}

// Unbiased sample variance; 0 below two samples.
inline double variance(const running_stats& s) {
  return s.count > 1 ? s.m2 / static_cast<double>(s.count - 1) : 0;
}
// Standard error of the mean.
inline double standard_error(const running_stats& s) {
  return s.count > 1 ? std::sqrt(variance(s) / static_cast<double>(s.count)) : 0;
}

}  // namespace wisp
