#pragma once

#include "section_files.h"
#include "section_text.h"

// The most pixels on the longer side of what a picture shows of a section; larger ones
// are made smaller.
inline constexpr int max_picture_side = 4096;

// A section as a figure: colours, contour lines, the outline of the domain, the bar of
// the colour map with round numbers, title and range.
canvas draw_section(const section_image& section, const section_style& style);

// The colours of values: by the colour map over a range, by length for two channels; of
// three and more the colours that they are. sRGB; grey for what is not a number.
wisp::vec3 section_color(const wisp::dvec4& value, int channels, wisp::section_colors colormap,
                         const wisp::dvec2& range);
// The range of a style, or what is shown without one.
wisp::dvec2 section_range(const section_image& section, const section_style& style);
// A pixel for each cell, with contour lines `line` pixels wide; cells outside of the
// domain continue what is next to them.
canvas draw_texture(const section_image& section, const section_style& style,
                    const wisp::dvec2& range, float line);
