#include "wisp/core/sampling.h"

#include <algorithm>

namespace wisp {

namespace {

// The largest float below 1.
constexpr float one_below = 0x1.fffffep-1f;

// Writes the running sum of n weights, scaled to end at 1; returns the sum.
double running_sum(const float* weights, std::size_t n, float* cdf) {
  double sum = 0;
  auto value = [&](std::size_t i) {
    return weights[i] > 0 && std::isfinite(weights[i]) ? static_cast<double>(weights[i]) : 0.0;
  };
  for (std::size_t i = 0; i < n; i++) sum += value(i);
  double scale = sum > 0 ? 1 / sum : 0;
  double running = 0;
  for (std::size_t i = 0; i < n; i++) {
    running += value(i);
    cdf[i] = static_cast<float>(running * scale);
  }
  if (sum > 0) {  // rounding must not leave a gap at the end, nor fill empty bins there
    std::size_t last = n;
    while (last > 0 && value(last - 1) == 0) last--;
    for (std::size_t i = last - 1; i < n; i++) cdf[i] = 1;
  }
  return sum;
}

std::size_t find_bin(const float* cdf, std::size_t n, float u) {
  auto i = static_cast<std::size_t>(std::upper_bound(cdf, cdf + n, u) - cdf);
  return std::min(i, n - 1);
}

float bin_width(const float* cdf, std::size_t i) { return i == 0 ? cdf[0] : cdf[i] - cdf[i - 1]; }

float bin_offset(const float* cdf, std::size_t i, float u) {
  float low = i == 0 ? 0 : cdf[i - 1];
  float width = cdf[i] - low;
  return width > 0 ? std::clamp((u - low) / width, 0.0f, one_below) : 0.0f;
}

}  // namespace

discrete_distribution make_discrete(std::span<const float> weights) {
  discrete_distribution d;
  d.cdf.resize(weights.size());
  if (weights.empty() || running_sum(weights.data(), weights.size(), d.cdf.data()) <= 0)
    d.cdf.clear();
  return d;
}

int sample_discrete(const discrete_distribution& d, float u, float* remapped) {
  if (d.cdf.empty()) return -1;
  auto i = find_bin(d.cdf.data(), d.cdf.size(), u);
  if (remapped) *remapped = bin_offset(d.cdf.data(), i, u);
  return static_cast<int>(i);
}

float discrete_pdf(const discrete_distribution& d, int index) {
  if (index < 0 || static_cast<std::size_t>(index) >= d.cdf.size()) return 0;
  return bin_width(d.cdf.data(), static_cast<std::size_t>(index));
}

distribution_2d make_distribution_2d(std::span<const float> weights, int width, int height) {
  distribution_2d d;
  auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  if (width <= 0 || height <= 0 || weights.size() != w * h) return d;
  d.width = width;
  d.height = height;
  d.cells.resize(w * h);
  std::vector<float> sums(h);
  for (std::size_t j = 0; j < h; j++)
    sums[j] = static_cast<float>(running_sum(&weights[j * w], w, &d.cells[j * w]));
  d.rows.resize(h);
  if (running_sum(sums.data(), h, d.rows.data()) <= 0) d = {};
  return d;
}

vec2 sample_2d(const distribution_2d& d, const vec2& u) {
  auto w = static_cast<std::size_t>(d.width), h = static_cast<std::size_t>(d.height);
  if (w == 0) return {0, 0};
  auto j = find_bin(d.rows.data(), h, u.y);
  const float* row = &d.cells[j * w];
  auto i = find_bin(row, w, u.x);
  return {
      std::min((static_cast<float>(i) + bin_offset(row, i, u.x)) / static_cast<float>(w),
               one_below),
      std::min((static_cast<float>(j) + bin_offset(d.rows.data(), j, u.y)) / static_cast<float>(h),
               one_below)};
}

float distribution_pdf(const distribution_2d& d, const vec2& p) {
  if (d.width == 0) return 0;
  auto w = static_cast<std::size_t>(d.width), h = static_cast<std::size_t>(d.height);
  auto cell = [](float x, std::size_t n) {
    auto i = static_cast<std::size_t>(std::clamp(x, 0.0f, 1.0f) * static_cast<float>(n));
    return std::min(i, n - 1);
  };
  auto j = cell(p.y, h), i = cell(p.x, w);
  return bin_width(d.rows.data(), j) * bin_width(&d.cells[j * w], i) * static_cast<float>(w) *
         static_cast<float>(h);
}

}  // namespace wisp
