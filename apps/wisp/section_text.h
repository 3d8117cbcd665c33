#pragma once

// Text in pictures without fonts: letters as strokes with round ends, drawn at any size.

#include <string_view>
#include <vector>

#include "wisp/core/math.h"

// A picture of sRGB colours, top row first, that things are drawn over.
struct canvas {
  int width = 0, height = 0;
  std::vector<wisp::vec3> pixels = {};

  canvas() = default;
  canvas(int width_, int height_, const wisp::vec3& color)
      : width(width_),
        height(height_),
        pixels(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), color) {}
  wisp::vec3& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

// Positions are in pixels, from the top left corner of the picture to the right and
// down. What lies beyond the picture is left out.
//
// A line of `width`, of any number of points, with round ends; one point is a dot.
// `cover` is how much of the colour there is where the line covers a pixel. Where the
// line crosses itself it is no darker.
void draw_line(canvas& picture, const std::vector<wisp::vec2>& points, float width,
               const wisp::vec3& color, float cover = 1);
void draw_lines(canvas& picture, const std::vector<std::vector<wisp::vec2>>& lines, float width,
                const wisp::vec3& color, float cover = 1);

enum struct text_align { left, center, right };
// UTF-8: what ASCII has, the minus sign, times, dots, raised digits, degree, Delta and
// nabla; a box for others. `size` is the height of a capital letter, `baseline` where
// the line of text begins, ends or has its middle.
void draw_text(canvas& picture, std::string_view text, const wisp::vec2& baseline, float size,
               const wisp::vec3& color, text_align align = text_align::left);
float text_width(std::string_view text, float size);
