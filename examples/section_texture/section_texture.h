// A solution on a plane, as a texture that any thread may ask.

#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "wisp/pde/section.h"

// Immutable once it is made. Values are floats, as in any texture.
class section_texture {
 public:
  section_texture(const wisp::section_grid& grid, const wisp::solution& u)
      : corner_(grid.corner),
        right_(grid.right),
        down_(grid.down),
        cell_(grid.cell),
        width_(grid.width),
        height_(grid.height),
        texels_(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height)) {
    // Only cells in the domain have a value; the others stay without a weight.
    for (std::size_t i = 0; i < grid.cells.size(); i++) {
      const wisp::estimate& e = u.values[i];
      if (!std::isfinite(e.mean.x)) continue;
      texels_[grid.cells[i]] = {static_cast<float>(e.mean.x),
                                static_cast<float>(e.standard_error.x), true};
    }
  }

  struct texel {
    float value = 0, error = 0;
    bool known = false;
  };
  struct lookup {
    float value = 0;
    float error = 0;    // the largest standard error of the cells that are joined
    bool whole = true;  // all four cells had a value
  };

  // u and v from 0 to 1, from the top left as in the picture. Nothing outside of the domain.
  // Bilinear over the cells that have a value: at the rim fewer than four, whose weights
  // are made to sum to 1 again, so that neither NaN nor 0 bleeds in.
  std::optional<lookup> sample(double u, double v) const {
    if (!(u >= 0 && u <= 1 && v >= 0 && v <= 1)) return {};
    const double x = u * width_ - 0.5, y = v * height_ - 0.5;
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const double fx = x - x0, fy = y - y0;
    double sum = 0, weights = 0;
    lookup result;
    for (int k = 0; k < 4; k++) {
      const int i = x0 + k % 2, j = y0 + k / 2;
      const double weight = (k % 2 ? fx : 1 - fx) * (k / 2 ? fy : 1 - fy);
      const texel* t = find(i, j);
      if (!t) {
        result.whole = false;
        continue;
      }
      sum += weight * static_cast<double>(t->value);
      weights += weight;
      result.error = std::max(result.error, t->error);
    }
    // Nearer to cells without a value than to others: the point is outside, or may be.
    if (weights < 0.25) return {};
    result.value = static_cast<float>(sum / weights);
    return result;
  }

  // The same by a point of the plane, in world space.
  std::optional<lookup> sample(const wisp::dvec3& p) const {
    return sample(glm::dot(p - corner_, right_) / (cell_ * width_),
                  glm::dot(p - corner_, down_) / (cell_ * height_));
  }

  int width() const { return width_; }
  int height() const { return height_; }
  double cell() const { return cell_; }
  wisp::dvec3 point(double u, double v) const {
    return corner_ + right_ * (u * cell_ * width_) + down_ * (v * cell_ * height_);
  }

 private:
  const texel* find(int i, int j) const {
    if (i < 0 || i >= width_ || j < 0 || j >= height_) return nullptr;
    const auto place = static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) +
                       static_cast<std::size_t>(i);
    return texels_[place].known ? &texels_[place] : nullptr;
  }

  wisp::dvec3 corner_, right_, down_;
  double cell_ = 1;
  int width_ = 0, height_ = 0;
  std::vector<texel> texels_;
};
