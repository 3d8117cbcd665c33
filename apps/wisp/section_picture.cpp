#include "section_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "colormap.h"
#include "section_field.h"
#include "section_ticks.h"

using wisp::dvec2;
using wisp::section_colors;
using wisp::vec2;
using wisp::vec3;

namespace {

constexpr vec3 paper = {1, 1, 1}, ink = {0.1f, 0.1f, 0.11f}, pale_ink = {0.42f, 0.42f, 0.44f};

constexpr float contour_width = 0.62f;  // of a line's

struct layout {
  int border = 3;      // cells around the section, for its outline
  int scale = 1;       // pixels for each cell
  float capital = 0;   // height of capitals
  float line = 0;      // width of lines
  vec2 body = {0, 0};  // top left of the section's cells
  vec2 body_size = {0, 0};
  float bar_top = 0, bar_bottom = 0, bar_left = 0, bar_width = 0;
  int width = 0, height = 0;
};

struct bar_data {
  bool shown = false;
  tick_labels text = {};
  std::vector<double> ticks = {};
  bool below = false, above = false;  // values are beyond the ends
};

float luma(const vec3& c) { return wisp::luminance(c * c); }

// Lines on a colour: white on dark ones, black on light ones.
vec3 line_color(section_colors map, float t) {
  return luma(eval_colormap(map, static_cast<double>(t))) < 0.35f ? vec3{1, 1, 1} : vec3{0, 0, 0};
}

std::size_t cell_count(const section_image& s) {
  return static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height);
}

// Vectors of two are shown by their length.
section_image with_lengths(const section_image& section) {
  section_image result = section;
  const std::size_t n = cell_count(section);
  result.channels = 1;
  result.value.resize(n);
  for (std::size_t i = 0; i < n; i++)
    result.value[i] = std::hypot(section.value[i], section.value[n + i]);
  if (!section.error.empty()) {
    result.error.resize(n);
    for (std::size_t i = 0; i < n; i++)
      result.error[i] = std::hypot(section.error[i], section.error[n + i]);
  }
  return result;
}

std::string caption(const section_image& section) {
  double low = wisp::infinity, high = -wisp::infinity, squares = 0, count = 0;
  for (const double v : section.value)
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  for (const double e : section.error)
    if (std::isfinite(e)) squares += e * e, count++;
  if (!(low <= high)) return "no values";
  auto text = low == high ? fmt::format("value {}", short_number(low))
                          : fmt::format("values {} to {}", short_number(low), short_number(high));
  if (squares > 0 && std::isfinite(squares))
    text += fmt::format(", standard error {}", short_number(std::sqrt(squares / count)));
  return text;
}

layout plan(const section_image& section, const section_style& style, const bar_data& bar,
            const std::string& foot) {
  layout l;
  const int longer = std::max(section.width, section.height);
  l.scale = std::max(1, (720 + longer - 1) / longer);
  if (l.scale > 60) l.border = 1;
  const float side = static_cast<float>(longer * l.scale);
  l.capital = std::max(10.0f, std::round(side / 62));
  l.line = std::max(1.2f, side / 560);
  const float unit = l.capital, margin = std::round(1.6f * unit);
  const float title = style.title.empty() ? 0 : std::round(2.6f * unit);
  l.body_size = {static_cast<float>(section.width * l.scale),
                 static_cast<float>(section.height * l.scale)};
  float inner = l.body_size.y;
  l.body = {margin, margin + title};
  float right = l.body.x + l.body_size.x;
  if (bar.shown) {
    const float least = std::min(side, 15 * unit);  // next to flat sections
    inner = std::max(inner, least);
    l.body.y += std::round((inner - l.body_size.y) / 2);
    const float factor = bar.text.factor.empty() ? 0 : 2.2f * unit;
    l.bar_top = margin + title + std::max(factor, 0.5f * unit);
    l.bar_bottom = margin + title + inner - 0.5f * unit;
    l.bar_left = std::round(right + 1.8f * unit);
    l.bar_width = std::round(1.5f * unit);
    float text = text_width(bar.text.factor, unit) - 1.1f * unit - l.bar_width;
    for (const auto& label : bar.text.labels) text = std::max(text, text_width(label, unit));
    right = l.bar_left + l.bar_width + 1.1f * unit + text;
  }
  right = std::max(right, margin + text_width(style.title, 1.25f * unit));
  right = std::max(right, margin + text_width(foot, 0.85f * unit));
  l.width = static_cast<int>(std::ceil(right + margin));
  l.height = static_cast<int>(std::ceil(margin + title + inner + 2.4f * unit + 0.9f * margin));
  return l;
}

using line_list = std::vector<std::vector<vec2>>;

line_list moved(line_list lines, const vec2& by) {
  for (auto& line : lines)
    for (vec2& p : line) p += by;
  return lines;
}

// Contour lines of noisy numbers tremble: the noise that the errors tell of is smoothed to
// a small part of the distance between lines, as far as that blurs by a few cells only.
float contour_blur(const section_image& section, const dvec2& range, std::size_t count) {
  constexpr float least = 0.7f, most = 5;
  std::vector<double> errors;
  for (const double e : section.error)
    if (std::isfinite(e)) errors.push_back(e);
  if (errors.empty() || count == 0) return least;
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  const double step = (range.y - range.x) / static_cast<double>(count);
  const double wanted = *middle / (2 * std::sqrt(3.14159) * 0.03 * step);
  return static_cast<float>(std::clamp(wanted, double{least}, double{most}));
}

// Of the field at a place in pixels, for each pixel.
float slope(const field_2d& field, const vec2& place) {
  const int x = std::clamp(static_cast<int>(place.x), 1, field.width - 2);
  const int y = std::clamp(static_cast<int>(place.y), 1, field.height - 2);
  return std::hypot(field.at(x + 1, y) - field.at(x - 1, y),
                    field.at(x, y + 1) - field.at(x, y - 1)) /
         2;
}

void draw_contours(canvas& picture, const layout& l, const section_image& section,
                   const field_2d& field, const field_2d& mask, const section_style& style,
                   const dvec2& range) {
  const auto levels = round_numbers(range, style.contours);
  if (levels.empty()) return;
  field_2d smooth = blur(field, contour_blur(section, range, levels.size()));
  fill_outwards(smooth, 3);
  const field_2d fine = enlarge_smooth(smooth, l.scale);
  const vec2 origin = l.body - static_cast<float>(l.border * l.scale);
  const double step = levels.size() > 1 ? levels[1] - levels[0] : range.y - range.x;
  const float width = contour_width * l.line;
  for (const double level : levels) {
    const auto t = static_cast<float>((level - range.x) / (range.y - range.x));
    if (t < 0.002f || t > 0.998f) continue;
    // Lines fade where there is no room for them, at jumps above all.
    constexpr int shades = 4;
    line_list lines[shades];
    for (auto& line : find_level(fine, &mask, t)) {
      const float apart =
          static_cast<float>(step / (range.y - range.x)) / std::max(slope(fine, line[0]), 1e-9f);
      const float shade = std::clamp(apart / width - 1.5f, 0.0f, 1.0f);
      if (const int k = static_cast<int>(std::round(shade * shades)); k > 0)
        lines[k - 1].push_back(std::move(line));
    }
    for (int k = 0; k < shades; k++)
      draw_lines(picture, moved(std::move(lines[k]), origin), width, line_color(style.colormap, t),
                 0.55f * static_cast<float>(k + 1) / shades);
  }
}

void draw_body(canvas& picture, const layout& l, const section_image& section,
               const section_style& style, const dvec2& range) {
  const bool colors = section.channels >= 3;
  std::vector<field_2d> fields;
  for (int c = 0; c < (colors ? 3 : 1); c++)
    fields.push_back(normalized_channel(section, c, range, l.border));
  const field_2d original = fields[0];
  const field_2d mask = enlarge_linear(outline_field(section, original, l.border), l.scale);
  for (field_2d& field : fields) {
    fill_outwards(field, l.border);
    field = enlarge_linear(field, l.scale);
  }
  const vec2 origin = l.body - static_cast<float>(l.border * l.scale);
  const auto x0 = static_cast<int>(origin.x), y0 = static_cast<int>(origin.y);
  for (int y = 0; y < mask.height; y++)
    for (int x = 0; x < mask.width; x++) {
      // under the outline, whose middle is at 1/2
      if (mask.at(x, y) <= 0.5f) continue;
      const int px = x + x0, py = y + y0;
      if (px < 0 || py < 0 || px >= picture.width || py >= picture.height) continue;
      vec3 color;
      if (colors) {
        for (int c = 0; c < 3; c++)
          color[c] =
              linear_to_srgb(std::clamp(fields[static_cast<std::size_t>(c)].at(x, y), 0.0f, 1.0f));
      } else {
        color = eval_colormap(style.colormap, static_cast<double>(fields[0].at(x, y)));
      }
      picture.at(px, py) = color;
    }
  if (!colors) draw_contours(picture, l, section, original, mask, style, range);
  draw_lines(picture, moved(find_level(mask, nullptr, 0.5f), origin), l.line, ink);
}

// Some of the contour lines, so that their marks agree with the numbers.
std::vector<double> bar_ticks(const dvec2& range, int contours) {
  const auto levels = round_numbers(range, contours);
  if (levels.size() < 2) return round_numbers(range, 5);
  const double step = levels[1] - levels[0];
  for (const double every : {1, 2, 5, 10, 20, 50, 100, 200, 500}) {
    std::vector<double> ticks;
    for (const double level : levels)
      if (std::abs(std::remainder(std::round(level / step), every)) < 0.5) ticks.push_back(level);
    if (ticks.size() <= 8) return ticks.size() >= 2 ? ticks : round_numbers(range, 5);
  }
  return round_numbers(range, 5);
}

void draw_bar(canvas& picture, const layout& l, const bar_data& bar, const section_style& style,
              const dvec2& range) {
  const float left = l.bar_left, right = l.bar_left + l.bar_width, tip = 0.55f * l.bar_width;
  const float top = l.bar_top + (bar.above ? tip : 0);
  const float bottom = l.bar_bottom - (bar.below ? tip : 0);
  const float middle = (left + right) / 2;
  for (int y = static_cast<int>(l.bar_top); y <= static_cast<int>(l.bar_bottom); y++) {
    const float center = static_cast<float>(y) + 0.5f;
    const vec3 color =
        eval_colormap(style.colormap, static_cast<double>((bottom - center) / (bottom - top)));
    // triangles at ends that values go beyond
    float half = l.bar_width / 2;
    if (bar.above && center < top) half *= std::max(0.0f, (center - l.bar_top) / tip);
    if (bar.below && center > bottom) half *= std::max(0.0f, (l.bar_bottom - center) / tip);
    if (center < l.bar_top || center > l.bar_bottom) continue;
    for (int x = static_cast<int>(middle - half); x < static_cast<int>(middle + half); x++)
      if (x >= 0 && y >= 0 && x < picture.width && y < picture.height) picture.at(x, y) = color;
  }
  auto height = [&](double value) {
    return bottom - (bottom - top) * static_cast<float>((value - range.x) / (range.y - range.x));
  };
  for (const double level : round_numbers(range, style.contours)) {
    const auto t = static_cast<float>((level - range.x) / (range.y - range.x));
    if (t < 0.002f || t > 0.998f) continue;
    draw_line(picture, {{left, height(level)}, {right, height(level)}}, contour_width * l.line,
              line_color(style.colormap, t), 0.55f);
  }
  std::vector<vec2> outline = {{left, top}};
  if (bar.above) outline.push_back({middle, l.bar_top});
  outline.push_back({right, top}), outline.push_back({right, bottom});
  if (bar.below) outline.push_back({middle, l.bar_bottom});
  outline.push_back({left, bottom}), outline.push_back({left, top});
  draw_line(picture, outline, 0.8f * l.line, ink);

  const float unit = l.capital;
  for (std::size_t i = 0; i < bar.ticks.size(); i++) {
    const float y = height(bar.ticks[i]);
    draw_line(picture, {{right, y}, {right + 0.5f * unit, y}}, 0.8f * l.line, ink);
    draw_text(picture, bar.text.labels[i], {right + 1.1f * unit, y + unit / 2}, unit, ink);
  }
  draw_text(picture, bar.text.factor, {left, l.bar_top - 0.9f * unit}, unit, ink);
}

}  // namespace

vec3 section_color(const wisp::dvec4& value, int channels, section_colors colormap,
                   const dvec2& range) {
  auto normalized = [&](double v) { return (v - range.x) / (range.y - range.x); };
  if (channels < 3) {
    const double t = normalized(channels == 2 ? std::hypot(value.x, value.y) : value.x);
    return std::isnan(t) ? vec3{0.5f} : eval_colormap(colormap, t);
  }
  vec3 color;
  for (int c = 0; c < 3; c++) {
    const double t = normalized(value[c]);
    color[c] = std::isnan(t) ? 0.5f : linear_to_srgb(static_cast<float>(std::clamp(t, 0.0, 1.0)));
  }
  return color;
}

dvec2 section_range(const section_image& section, const section_style& style) {
  if (style.range) return *style.range;
  if (section.channels >= 3) return {0, 1};
  return default_range(section.channels == 2 ? with_lengths(section) : section, style.colormap);
}

canvas draw_texture(const section_image& given, const section_style& style, const dvec2& range,
                    float line) {
  const section_image section = given.channels == 2 ? with_lengths(given) : given;
  layout l;
  l.border = 0;
  l.line = line / contour_width;
  std::vector<field_2d> fields;
  for (int c = 0; c < (section.channels >= 3 ? 3 : 1); c++)
    fields.push_back(normalized_channel(section, c, range, 0));
  const field_2d original = fields[0];
  for (field_2d& field : fields) fill_outwards(field, 3);
  canvas picture(section.width, section.height, paper);
  for (std::size_t i = 0; i < picture.pixels.size(); i++) {
    wisp::dvec4 value{0};
    for (std::size_t c = 0; c < fields.size(); c++)
      value[static_cast<int>(c)] = static_cast<double>(fields[c].values[i]);
    picture.pixels[i] = section_color(value, section.channels, style.colormap, {0, 1});
  }
  if (section.channels < 3) {
    const field_2d everywhere(section.width, section.height, 1);
    draw_contours(picture, l, section, original, everywhere, style, range);
  }
  return picture;
}

canvas draw_section(const section_image& given, const section_style& style) {
  section_image section = given;
  if (const int longer = std::max(given.width, given.height); longer > max_picture_side)
    section = reduce(given, (longer + max_picture_side - 1) / max_picture_side);
  if (section.channels == 2) section = with_lengths(section);
  const bool colors = section.channels >= 3;
  const dvec2 range = section_range(section, style);
  bar_data bar;
  bar.shown = !colors;
  if (bar.shown) {
    bar.ticks = bar_ticks(range, style.contours);
    bar.text = label_ticks(bar.ticks);
    const double slack = 1e-6 * (range.y - range.x);
    for (std::size_t i = 0; i < cell_count(section); i++) {
      bar.below = bar.below || section.value[i] < range.x - slack;
      bar.above = bar.above || section.value[i] > range.y + slack;
    }
  }
  const std::string foot = caption(given.channels == 2 ? section : given);
  const layout l = plan(section, style, bar, foot);
  canvas picture(l.width, l.height, paper);
  draw_body(picture, l, section, style, range);
  if (bar.shown) draw_bar(picture, l, bar, style, range);
  const float margin = std::round(1.6f * l.capital);
  if (!style.title.empty())
    draw_text(picture, style.title, {margin, margin + 1.25f * l.capital}, 1.25f * l.capital, ink);
  draw_text(picture, foot, {margin, static_cast<float>(l.height) - margin}, 0.85f * l.capital,
            pale_ink);
  return picture;
}
