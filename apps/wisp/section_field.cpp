#include "section_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace {

constexpr float none = std::numeric_limits<float>::quiet_NaN();

std::size_t size(int n) { return static_cast<std::size_t>(n); }

// Weights of cells around a pixel, of which there are `scale` in each cell.
struct weights_1d {
  int first = 0;
  std::array<float, 4> weight = {};
};

weights_1d spline_weights(int pixel, int scale) {
  const float x = (static_cast<float>(pixel) + 0.5f) / static_cast<float>(scale) - 0.5f;
  const float cell = std::floor(x), t = x - cell, s = 1 - t;
  return {static_cast<int>(cell) - 1,
          {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6,
           t * t * t / 6}};
}

weights_1d linear_weights(int pixel, int scale) {
  const float x = (static_cast<float>(pixel) + 0.5f) / static_cast<float>(scale) - 0.5f;
  const float cell = std::floor(x), t = x - cell;
  return {static_cast<int>(cell), {1 - t, t, 0, 0}};
}

template <typename Weights>
field_2d enlarge(const field_2d& field, int scale, Weights&& weights) {
  // rows first, then columns
  field_2d wide(field.width * scale, field.height), result(wide.width, field.height * scale);
  for (int x = 0; x < wide.width; x++) {
    const weights_1d w = weights(x, scale);
    for (int y = 0; y < field.height; y++) {
      float sum = 0;
      for (int k = 0; k < 4; k++)
        sum += w.weight[size(k)] * field.at(std::clamp(w.first + k, 0, field.width - 1), y);
      wide.at(x, y) = sum;
    }
  }
  for (int y = 0; y < result.height; y++) {
    const weights_1d w = weights(y, scale);
    for (int x = 0; x < result.width; x++) {
      float sum = 0;
      for (int k = 0; k < 4; k++)
        sum += w.weight[size(k)] * wide.at(x, std::clamp(w.first + k, 0, field.height - 1));
      result.at(x, y) = sum;
    }
  }
  return result;
}

// Sums of weight times value and of weights along one axis.
void blur_axis(field_2d& sum, field_2d& weight, const std::vector<float>& kernel, bool along_x) {
  const int radius = static_cast<int>(kernel.size()) - 1;
  const field_2d s = sum, w = weight;
  for (int y = 0; y < s.height; y++)
    for (int x = 0; x < s.width; x++) {
      float a = 0, b = 0;
      for (int k = -radius; k <= radius; k++) {
        const int i = along_x ? x + k : x, j = along_x ? y : y + k;
        if (i < 0 || j < 0 || i >= s.width || j >= s.height) continue;
        const float g = kernel[size(std::abs(k))];
        a += g * s.at(i, j), b += g * w.at(i, j);
      }
      sum.at(x, y) = a, weight.at(x, y) = b;
    }
}

}  // namespace

field_2d normalized_channel(const section_image& section, int channel, const wisp::dvec2& range,
                            int border) {
  field_2d field(section.width + 2 * border, section.height + 2 * border, none);
  const double* values =
      section.value.data() + size(channel) * size(section.width) * size(section.height);
  // halves, since the difference of two large numbers may not be one
  const double width = range.y / 2 - range.x / 2;
  for (int y = 0; y < section.height; y++)
    for (int x = 0; x < section.width; x++) {
      const double v = values[size(y) * size(section.width) + size(x)];
      if (std::isnan(v)) continue;
      const double t = (v / 2 - range.x / 2) / width;
      field.at(x + border, y + border) = static_cast<float>(std::clamp(t, -1e6, 1e6));
    }
  return field;
}

field_2d outline_field(const section_image& section, const field_2d& field, int border) {
  field_2d mask(field.width, field.height), unit(field.width, field.height, 1);
  if (section.distance.empty()) {
    for (std::size_t i = 0; i < mask.values.size(); i++)
      mask.values[i] = std::isnan(field.values[i]) ? 0.0f : 1.0f;
    const std::vector<float> kernel = {1, 0.6f, 0.14f};
    blur_axis(mask, unit, kernel, true);
    blur_axis(mask, unit, kernel, false);
    // no cell is lost, however thin the domain
    for (std::size_t i = 0; i < mask.values.size(); i++) {
      mask.values[i] /= unit.values[i];
      if (!std::isnan(field.values[i])) mask.values[i] = std::max(mask.values[i], 0.75f);
    }
    return mask;
  }
  for (int y = 0; y < section.height; y++)
    for (int x = 0; x < section.width; x++) {
      const double d = section.distance[size(y) * size(section.width) + size(x)] / section.cell;
      // within the frame, half a cell beyond the centers of its cells
      const int edge =
          std::min(std::min(x, section.width - 1 - x), std::min(y, section.height - 1 - y));
      const double inner = std::min(std::isnan(d) ? 0 : d, edge + 0.5);
      mask.at(x + border, y + border) = static_cast<float>(0.5 + std::clamp(inner, -2.0, 2.0) / 4);
    }
  // beyond it, as far out as the next cell is inside at most
  for (int y = 0; y < mask.height; y++)
    for (int x = 0; x < mask.width; x++) {
      const int cx = std::clamp(x, border, border + section.width - 1);
      const int cy = std::clamp(y, border, border + section.height - 1);
      const int away = std::max(std::abs(x - cx), std::abs(y - cy));
      if (away == 0) continue;
      const float out = 0.5f - (static_cast<float>(std::min(away, 2)) - 0.5f) / 4;
      mask.at(x, y) = std::min(out, mask.at(cx, cy));
    }
  return mask;
}

void fill_outwards(field_2d& field, int rounds) {
  double sum = 0, count = 0;
  for (const float v : field.values)
    if (!std::isnan(v)) sum += static_cast<double>(v), count++;
  const float mean = count > 0 ? static_cast<float>(sum / count) : 0.0f;
  for (int round = 0; round < rounds; round++) {
    std::vector<std::pair<std::size_t, float>> found;
    for (int y = 0; y < field.height; y++)
      for (int x = 0; x < field.width; x++) {
        if (!std::isnan(field.at(x, y))) continue;
        float total = 0, weight = 0;
        for (int j = std::max(y - 1, 0); j <= std::min(y + 1, field.height - 1); j++)
          for (int i = std::max(x - 1, 0); i <= std::min(x + 1, field.width - 1); i++) {
            const float v = field.at(i, j);
            if (std::isnan(v)) continue;
            const float w = i == x || j == y ? 1.0f : 0.5f;
            total += w * v, weight += w;
          }
        if (weight > 0) found.emplace_back(field.index(x, y), total / weight);
      }
    if (found.empty()) break;
    for (const auto& [i, v] : found) field.values[i] = v;
  }
  for (float& v : field.values)
    if (std::isnan(v)) v = mean;
}

field_2d blur(const field_2d& field, float sigma) {
  std::vector<float> kernel;
  for (int k = 0; k <= static_cast<int>(std::ceil(3 * sigma)); k++) {
    const float x = static_cast<float>(k) / sigma;
    kernel.push_back(std::exp(-x * x / 2));
  }
  field_2d sum = field, weight(field.width, field.height, 1);
  for (std::size_t i = 0; i < sum.values.size(); i++)
    if (std::isnan(sum.values[i])) sum.values[i] = weight.values[i] = 0;
  blur_axis(sum, weight, kernel, true);
  blur_axis(sum, weight, kernel, false);
  for (std::size_t i = 0; i < sum.values.size(); i++)
    sum.values[i] = std::isnan(field.values[i]) || weight.values[i] <= 0
                        ? none
                        : sum.values[i] / weight.values[i];
  return sum;
}

field_2d enlarge_linear(const field_2d& field, int scale) {
  return scale == 1 ? field : enlarge(field, scale, linear_weights);
}

field_2d enlarge_smooth(const field_2d& field, int scale) {
  return enlarge(field, scale, spline_weights);
}

section_image reduce(const section_image& section, int factor) {
  section_image small = section;
  small.width = (section.width + factor - 1) / factor;
  small.height = (section.height + factor - 1) / factor;
  small.cell = section.cell * factor;
  const std::size_t from = size(section.width) * size(section.height);
  const std::size_t to = size(small.width) * size(small.height);
  auto shrink = [&](const std::vector<double>& data, std::vector<double>& out) {
    out.assign(data.size() / from * to, std::numeric_limits<double>::quiet_NaN());
    for (std::size_t c = 0; c < data.size() / from; c++)
      for (int y = 0; y < small.height; y++)
        for (int x = 0; x < small.width; x++) {
          double sum = 0;
          int count = 0, all = 0;
          for (int j = y * factor; j < std::min((y + 1) * factor, section.height); j++)
            for (int i = x * factor; i < std::min((x + 1) * factor, section.width); i++) {
              const double v = data[c * from + size(j) * size(section.width) + size(i)];
              all++;
              if (!std::isnan(v)) sum += v, count++;
            }
          if (2 * count >= all) out[c * to + size(y) * size(small.width) + size(x)] = sum / count;
        }
  };
  shrink(section.value, small.value);
  shrink(section.error, small.error);
  shrink(section.steps, small.steps);
  shrink(section.distance, small.distance);
  return small;
}

std::vector<std::vector<wisp::vec2>> find_level(const field_2d& field, const field_2d* mask,
                                                float level) {
  std::vector<std::vector<wisp::vec2>> lines;
  for (int y = 0; y + 1 < field.height; y++)
    for (int x = 0; x + 1 < field.width; x++) {
      // around the square, from the top left
      const std::array<wisp::ivec2, 4> corner = {wisp::ivec2{x, y}, wisp::ivec2{x + 1, y},
                                                 wisp::ivec2{x + 1, y + 1}, wisp::ivec2{x, y + 1}};
      std::array<float, 4> v;
      int above = 0;
      bool inside = mask == nullptr;
      for (std::size_t k = 0; k < 4; k++) {
        v[k] = field.at(corner[k].x, corner[k].y) - level;
        above += v[k] > 0;
        inside = inside || mask->at(corner[k].x, corner[k].y) > 0.5f;
      }
      if (above == 0 || above == 4 || !inside) continue;
      std::vector<wisp::vec2> cut;
      for (std::size_t k = 0; k < 4; k++) {
        const std::size_t n = (k + 1) % 4;
        if ((v[k] > 0) == (v[n] > 0)) continue;
        const float t = v[k] / (v[k] - v[n]);
        cut.push_back(glm::mix(wisp::vec2(corner[k]), wisp::vec2(corner[n]), t) + 0.5f);
      }
      if (cut.size() == 2) {
        lines.push_back(cut);
      } else if (cut.size() == 4) {
        // a saddle: the middle tells which corners belong together
        const bool middle = v[0] + v[1] + v[2] + v[3] > 0;
        const std::size_t shift = middle == (v[0] > 0) ? 0 : 1;
        lines.push_back({cut[shift], cut[(shift + 1) % 4]});
        lines.push_back({cut[(shift + 2) % 4], cut[(shift + 3) % 4]});
      }
    }
  return lines;
}
