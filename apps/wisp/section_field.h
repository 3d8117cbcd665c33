#pragma once

// Numbers on the cells of a section as fields that can be drawn at any resolution.

#include <cstddef>
#include <vector>

#include "section_files.h"

// Row by row from the top.
struct field_2d {
  int width = 0, height = 0;
  std::vector<float> values = {};

  field_2d() = default;
  field_2d(int width_, int height_, float value = 0)
      : width(width_),
        height(height_),
        values(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), value) {}
  float& at(int x, int y) { return values[index(x, y)]; }
  float at(int x, int y) const { return values[index(x, y)]; }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
};

// Channel `channel` as (v - low) / (high - low), with `border` more cells on each side.
// NaN outside.
field_2d normalized_channel(const section_image& section, int channel, const wisp::dvec2& range,
                            int border);
// Above 1/2 where the field is a number, below elsewhere, so that the level 1/2 is the
// outline of the domain: from the section's distances where it has them, else 1 and 0,
// softened over neighbours.
field_2d outline_field(const section_image& section, const field_2d& field, int border);
// Numbers for cells outside by those next to them, so far as `rounds` cells; farther out
// the mean of all.
void fill_outwards(field_2d& field, int rounds);
// Gaussian of this width in cells; cells outside have no weight.
field_2d blur(const field_2d& field, float sigma);
// `scale` pixels for each cell: straight between the centers of cells; or by cubic
// B-splines, smooth and a little softer.
field_2d enlarge_linear(const field_2d& field, int scale);
field_2d enlarge_smooth(const field_2d& field, int scale);
// Means over `factor` cells in each direction; NaN where most of them are.
section_image reduce(const section_image& section, int factor);

// The lines where a field that lives at the centers of pixels takes a value, as segments
// in pixels, where `mask` is above 1/2 (marching squares). Nothing of a field that does
// not cross it.
std::vector<std::vector<wisp::vec2>> find_level(const field_2d& field, const field_2d* mask,
                                                float level);
