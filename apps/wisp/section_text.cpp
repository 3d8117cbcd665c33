#include "section_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

namespace {

using wisp::vec2;
using wisp::vec3;

// Strokes of a letter whose capitals are 7 high, y upwards from the baseline: M x y and
// L x y as in SVG, C with two control points and an end, O and A an arc of an ellipse
// (center, radii, from and to in degrees) that begins a stroke or goes on with one, D a
// dot.
struct glyph {
  char32_t code;
  float width;
  const char* path;
};

constexpr glyph glyphs[] = {
    {' ', 1.0f, ""},
    {'!', 0.2f, "M 0 7 L 0 2.2 D 0 0.1"},
    {'"', 1.6f, "M 0 7 L 0 5 M 1.6 7 L 1.6 5"},
    {'#', 4.6f, "M 1.4 0 L 2 7 M 3 0 L 3.6 7 M 0.2 4.6 L 4.6 4.6 M 0 2.3 L 4.4 2.3"},
    {'$', 4.2f,
     "M 3.8 5.6 C 3.2 7 0.2 7 0.2 5.2 C 0.2 3.1 4.2 3.9 4.2 1.8 C 4.2 -0.1 0.6 -0.1 0 1.5 "
     "M 2.1 7.6 L 2.1 -0.7"},
    {'%', 6.2f, "M 5 7 L 1.2 0 O 1.3 5.6 1.3 1.4 0 360 O 4.9 1.4 1.3 1.4 0 360"},
    {'&', 5.0f,
     "M 5 0 L 1.1 4.4 C -0.2 6 1 7 2.1 7 C 3.6 7 3.9 5.2 2.4 4.4 C 0.6 3.4 0 2.7 0 1.8 "
     "C 0 -0.8 4.7 -0.8 4.8 2.9"},
    {'\'', 0.2f, "M 0 7 L 0 5"},
    {'(', 1.6f, "M 1.6 7.8 C -0.4 5.2 -0.4 1.4 1.6 -1.2"},
    {')', 1.6f, "M 0 7.8 C 2 5.2 2 1.4 0 -1.2"},
    {'*', 3.0f, "M 1.5 7 L 1.5 3.8 M 0.1 6.2 L 2.9 4.6 M 2.9 6.2 L 0.1 4.6"},
    {'+', 4.0f, "M 0.2 3 L 3.8 3 M 2 4.8 L 2 1.2"},
    {',', 0.5f, "M 0.4 0.2 L 0 -1.3"},
    {'-', 2.0f, "M 0 2.6 L 2 2.6"},
    {'.', 0.2f, "D 0.1 0.1"},
    {'/', 3.0f, "M 0 -0.8 L 3 7.5"},
    {'0', 4.0f, "O 2 3.5 2 3.5 0 360"},
    {'1', 4.0f, "M 0.7 5.6 L 2.4 7 L 2.4 0"},
    {'2', 4.0f, "O 2 5.1 1.9 1.9 168 -32 L 0.1 0 L 4 0"},
    {'3', 4.0f, "O 1.9 5.3 1.7 1.65 150 -90 A 2 1.83 2 1.83 90 -150"},
    {'4', 4.0f, "M 3.1 0 L 3.1 7 L 0 2 L 4.2 2"},
    {'5', 4.0f, "M 3.6 7 L 0.7 7 L 0.35 3.8 A 1.95 2.28 2.05 2.28 138 -145"},
    {'6', 4.0f, "M 3.1 6.9 C 1.2 6 0 4.3 0 2.2 O 2 2.2 2 2.2 0 360"},
    {'7', 4.0f, "M 0.1 7 L 3.9 7 L 1.3 0"},
    {'8', 4.0f, "O 2 5.3 1.7 1.7 0 360 O 2 1.8 2 1.8 0 360"},
    {'9', 4.0f, "M 0.9 0.1 C 2.8 1 4 2.7 4 4.8 O 2 4.8 2 2.2 0 360"},
    {':', 0.2f, "D 0.1 4.4 D 0.1 0.1"},
    {';', 0.5f, "D 0.4 4.4 M 0.4 0.2 L 0 -1.3"},
    {'<', 3.6f, "M 3.6 5 L 0 3 L 3.6 1"},
    {'=', 4.0f, "M 0.2 3.9 L 3.8 3.9 M 0.2 2 L 3.8 2"},
    {'>', 3.6f, "M 0 5 L 3.6 3 L 0 1"},
    {'?', 3.4f, "O 1.7 5.2 1.7 1.8 160 -50 C 1.9 3.2 1.6 2.8 1.6 2 D 1.6 0.1"},
    {'@', 6.6f,
     "M 4.7 4.6 L 4.5 2.4 C 4.5 1.2 6.6 1.2 6.6 3.2 A 3.3 3.2 3.3 3.4 0 310 O 3.3 3 1.3 1.5 0 360"},
    {'A', 5.0f, "M 0 0 L 2.5 7 L 5 0 M 0.9 2.4 L 4.1 2.4"},
    {'B', 4.4f,
     "M 2.2 3.65 L 0 3.65 L 0 7 L 2.2 7 A 2.2 5.32 1.8 1.68 90 -90 M 2.2 3.65 A 2.4 1.82 2 1.82 "
     "90 -90 L 0 0 L 0 3.65"},
    {'C', 5.0f, "O 2.8 3.5 2.8 3.5 46 314"},
    {'D', 4.8f, "M 0 0 L 0 7 L 1.7 7 A 1.7 3.5 3.1 3.5 90 -90 L 0 0"},
    {'E', 4.0f, "M 4 7 L 0 7 L 0 0 L 4 0 M 0 3.6 L 3.5 3.6"},
    {'F', 3.9f, "M 3.9 7 L 0 7 L 0 0 M 0 3.5 L 3.4 3.5"},
    {'G', 5.6f, "O 2.8 3.5 2.8 3.5 48 357 L 3.2 3.35"},
    {'H', 4.8f, "M 0 0 L 0 7 M 4.8 0 L 4.8 7 M 0 3.6 L 4.8 3.6"},
    {'I', 0.0f, "M 0 0 L 0 7"},
    {'J', 2.8f, "M 2.8 7 L 2.8 1.9 A 1.4 1.8 1.4 1.8 0 -165"},
    {'K', 4.5f, "M 0 0 L 0 7 M 4.2 7 L 0 2.6 M 1.5 4.1 L 4.5 0"},
    {'L', 3.7f, "M 0 7 L 0 0 L 3.7 0"},
    {'M', 5.8f, "M 0 0 L 0 7 L 2.9 1.8 L 5.8 7 L 5.8 0"},
    {'N', 4.8f, "M 0 0 L 0 7 L 4.8 0 L 4.8 7"},
    {'O', 5.8f, "O 2.9 3.5 2.9 3.5 0 360"},
    {'P', 4.2f, "M 0 0 L 0 7 L 2.3 7 A 2.3 5.1 1.9 1.9 90 -90 L 0 3.2"},
    {'Q', 5.8f, "O 2.9 3.5 2.9 3.5 0 360 M 3.7 1.9 L 5.7 -0.5"},
    {'R', 4.5f, "M 0 0 L 0 7 L 2.3 7 A 2.3 5.1 1.9 1.9 90 -90 L 0 3.2 M 2.3 3.2 L 4.5 0"},
    {'S', 4.2f,
     "M 3.9 5.7 C 3.3 7.6 0.2 7.5 0.2 5.3 C 0.2 3 4.2 4 4.2 1.8 C 4.2 -0.6 0.6 -0.6 0 1.4"},
    {'T', 4.8f, "M 0 7 L 4.8 7 M 2.4 7 L 2.4 0"},
    {'U', 4.6f, "M 0 7 L 0 2.4 A 2.3 2.3 2.3 2.35 180 360 L 4.6 7"},
    {'V', 4.8f, "M 0 7 L 2.4 0 L 4.8 7"},
    {'W', 7.0f, "M 0 7 L 1.75 0 L 3.5 6.6 L 5.25 0 L 7 7"},
    {'X', 4.6f, "M 0 7 L 4.6 0 M 4.6 7 L 0 0"},
    {'Y', 4.6f, "M 0 7 L 2.3 3.4 L 4.6 7 M 2.3 3.4 L 2.3 0"},
    {'Z', 4.4f, "M 0.1 7 L 4.3 7 L 0 0 L 4.4 0"},
    {'[', 1.4f, "M 1.4 7.8 L 0 7.8 L 0 -1.2 L 1.4 -1.2"},
    {'\\', 3.0f, "M 0 7.5 L 3 -0.8"},
    {']', 1.4f, "M 0 7.8 L 1.4 7.8 L 1.4 -1.2 L 0 -1.2"},
    {'^', 3.2f, "M 0 4.6 L 1.6 7 L 3.2 4.6"},
    {'_', 4.0f, "M 0 -1 L 4 -1"},
    {'`', 1.0f, "M 0 7.4 L 1 6.2"},
    {'a', 3.7f, "O 1.85 2.5 1.85 2.5 0 360 M 3.7 5 L 3.7 0"},
    {'b', 3.7f, "M 0 7.4 L 0 0 O 1.85 2.5 1.85 2.5 0 360"},
    {'c', 3.2f, "O 1.85 2.5 1.85 2.5 48 312"},
    {'d', 3.7f, "O 1.85 2.5 1.85 2.5 0 360 M 3.7 7.4 L 3.7 0"},
    {'e', 3.7f, "M 0.05 2.6 L 3.7 2.6 A 1.85 2.5 1.85 2.5 2 318"},
    {'f', 2.4f, "M 2.4 7.3 C 1.3 7.6 0.9 6.9 0.9 5.8 L 0.9 0 M 0 4.8 L 2.2 4.8"},
    {'g', 3.7f, "O 1.85 2.5 1.85 2.5 0 360 M 3.7 5 L 3.7 0 C 3.7 -2.7 0.9 -2.6 0.2 -1.5"},
    {'h', 3.4f, "M 0 7.4 L 0 0 M 0 2.9 C 0 5.6 3.4 5.9 3.4 3 L 3.4 0"},
    {'i', 0.0f, "M 0 5 L 0 0 D 0 7"},
    {'j', 1.0f, "M 1 5 L 1 -0.8 C 1 -2 0.4 -2.2 0 -2.1 D 1 7"},
    {'k', 3.4f, "M 0 7.4 L 0 0 M 3.2 5 L 0 1.9 M 1.2 3.05 L 3.4 0"},
    {'l', 0.0f, "M 0 7.4 L 0 0"},
    {'m', 5.6f,
     "M 0 5 L 0 0 M 0 3.1 C 0 5.6 2.8 5.7 2.8 3.1 L 2.8 0 M 2.8 3.1 C 2.8 5.6 5.6 5.7 5.6 3.1 "
     "L 5.6 0"},
    {'n', 3.4f, "M 0 5 L 0 0 M 0 2.9 C 0 5.6 3.4 5.9 3.4 3 L 3.4 0"},
    {'o', 3.7f, "O 1.85 2.5 1.85 2.5 0 360"},
    {'p', 3.7f, "M 0 5 L 0 -2.2 O 1.85 2.5 1.85 2.5 0 360"},
    {'q', 3.7f, "O 1.85 2.5 1.85 2.5 0 360 M 3.7 5 L 3.7 -2.2"},
    {'r', 2.1f, "M 0 5 L 0 0 M 0 2.8 C 0 4.5 1 5.2 2.1 4.9"},
    {'s', 3.2f,
     "M 3 4.2 C 2.5 5.3 0.15 5.4 0.15 3.7 C 0.15 2.1 3.2 2.9 3.2 1.3 C 3.2 -0.4 0.6 -0.4 0 0.9"},
    {'t', 2.4f, "M 0.9 6.6 L 0.9 1.5 C 0.9 0.1 1.6 -0.2 2.4 0.1 M 0 4.9 L 2.2 4.9"},
    {'u', 3.4f, "M 0 5 L 0 2 C 0 -0.9 3.4 -0.6 3.4 2.1 M 3.4 5 L 3.4 0"},
    {'v', 3.6f, "M 0 5 L 1.8 0 L 3.6 5"},
    {'w', 5.4f, "M 0 5 L 1.35 0 L 2.7 4.8 L 4.05 0 L 5.4 5"},
    {'x', 3.3f, "M 0 5 L 3.3 0 M 3.3 5 L 0 0"},
    {'y', 3.6f, "M 0 5 L 1.8 0.2 M 3.6 5 L 1.8 0.2 L 1.3 -1.1 C 1 -2 0.5 -2.2 0 -2.1"},
    {'z', 3.3f, "M 0 5 L 3.2 5 L 0 0 L 3.3 0"},
    {'{', 1.8f, "M 1.8 7.8 C 0.2 7.8 1.6 3.3 0 3.3 C 1.6 3.3 0.2 -1.2 1.8 -1.2"},
    {'|', 0.0f, "M 0 7.8 L 0 -1.2"},
    {'}', 1.8f, "M 0 7.8 C 1.6 7.8 0.2 3.3 1.8 3.3 C 0.2 3.3 1.6 -1.2 0 -1.2"},
    {'~', 3.6f, "M 0 2.6 C 0.8 4 1.5 3.6 1.8 3 C 2.1 2.4 2.8 2 3.6 3.4"},
    {0xb0, 1.8f, "O 0.9 6.1 0.9 0.9 0 360"},              // degree
    {0xb7, 0.2f, "D 0.1 3"},                              // middle dot
    {0xd7, 3.2f, "M 0 4.6 L 3.2 1.4 M 3.2 4.6 L 0 1.4"},  // times
    {0x394, 5.0f, "M 0 0 L 2.5 7 L 5 0 L 0 0 L 2.5 7"},   // Delta
    {0x2207, 5.0f, "M 0 7 L 2.5 0 L 5 7 L 0 7 L 2.5 0"},  // nabla
    {0x2212, 4.0f, "M 0.2 3 L 3.8 3"},                    // minus
    {0x2026, 3.6f, "D 0.1 0.1 D 1.8 0.1 D 3.5 0.1"},      // three dots
};
constexpr glyph unknown = {0, 3.6f, "M 0 0 L 0 7 L 3.6 7 L 3.6 0 L 0 0"};
constexpr float capital = 7, gap = 1.65f, stroke = 0.8f;

const glyph& find_glyph(char32_t code) {
  for (const glyph& g : glyphs)
    if (g.code == code) return g;
  return unknown;
}

// A letter as it is placed: raised digits are small others.
struct placed_glyph {
  const glyph* shape;
  float scale, rise;
};
placed_glyph place_glyph(char32_t code) {
  constexpr std::pair<char32_t, char32_t> raised[] = {
      {0xb9, '1'}, {0xb2, '2'}, {0xb3, '3'}, {0x2070, '0'}, {0x207b, 0x2212}};
  for (const auto& [high, plain] : raised)
    if (code == high) return {&find_glyph(plain), 0.62f, 3.6f};
  if (code >= 0x2074 && code <= 0x2079) return {&find_glyph('4' + (code - 0x2074)), 0.62f, 3.6f};
  return {&find_glyph(code), 1, 0};
}

// The next character of UTF-8; bytes that are none stand for themselves.
char32_t next_character(std::string_view& text) {
  const auto first = static_cast<unsigned char>(text[0]);
  std::size_t more = first >= 0xf0 ? 3 : first >= 0xe0 ? 2 : first >= 0xc0 ? 1 : 0;
  char32_t code = more == 0 ? first : static_cast<char32_t>(first & (0x3f >> more));
  if (more >= text.size()) more = 0, code = first;
  for (std::size_t i = 1; i <= more; i++)
    code = code << 6 | (static_cast<unsigned char>(text[i]) & 0x3f);
  text.remove_prefix(more + 1);
  return code;
}

using stroke_list = std::vector<std::vector<vec2>>;

void add_arc(std::vector<vec2>& line, const float* v) {
  constexpr int steps = 40;
  for (int i = 0; i <= steps; i++) {
    const float angle = (v[4] + (v[5] - v[4]) * static_cast<float>(i) / steps) * wisp::pi / 180;
    line.push_back({v[0] + v[2] * std::cos(angle), v[1] + v[3] * std::sin(angle)});
  }
}

void add_curve(std::vector<vec2>& line, const float* v) {
  constexpr int steps = 24;
  const vec2 a = line.back(), b = {v[0], v[1]}, c = {v[2], v[3]}, d = {v[4], v[5]};
  for (int i = 1; i <= steps; i++) {
    const float t = static_cast<float>(i) / steps, s = 1 - t;
    line.push_back(a * (s * s * s) + b * (3 * s * s * t) + c * (3 * s * t * t) + d * (t * t * t));
  }
}

stroke_list read_path(const char* path) {
  stroke_list strokes;
  const char* end = path + std::strlen(path);
  while (path < end) {
    const char command = *path++;
    if (command == ' ') continue;
    const int count = command == 'C' || command == 'O' || command == 'A' ? 6 : 2;
    float v[6] = {};
    for (int i = 0; i < count; i++) {
      while (*path == ' ') path++;
      path = std::from_chars(path, end, v[i]).ptr;
    }
    if (command == 'M' || command == 'D' || command == 'O' || strokes.empty())
      strokes.emplace_back();
    auto& line = strokes.back();
    if (command == 'C')
      add_curve(line, v);
    else if (count == 6)
      add_arc(line, v);
    else
      line.push_back({v[0], v[1]});
  }
  return strokes;
}

float squared_distance(const vec2& p, const vec2& a, const vec2& b) {
  const vec2 d = b - a;
  const float l2 = glm::dot(d, d);
  const float t = l2 > 0 ? std::clamp(glm::dot(p - a, d) / l2, 0.0f, 1.0f) : 0.0f;
  const vec2 q = p - a - t * d;
  return glm::dot(q, q);
}

// How much of each pixel of a rectangle lines cover.
struct cover_map {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // end exclusive
  std::vector<float> cover = {};

  float& at(int x, int y) {
    return cover[static_cast<std::size_t>(y - y0) * static_cast<std::size_t>(x1 - x0) +
                 static_cast<std::size_t>(x - x0)];
  }
};

int pixel(float x, int most) {
  return static_cast<int>(std::clamp(std::floor(x), 0.0f, static_cast<float>(most)));
}

void add_segment(cover_map& map, const vec2& a, const vec2& b, float half) {
  const float reach = half + 1;
  const int x0 = std::max(map.x0, pixel(std::min(a.x, b.x) - reach, map.x1));
  const int x1 = std::min(map.x1, pixel(std::max(a.x, b.x) + reach + 1, map.x1));
  const int y0 = std::max(map.y0, pixel(std::min(a.y, b.y) - reach, map.y1));
  const int y1 = std::min(map.y1, pixel(std::max(a.y, b.y) + reach + 1, map.y1));
  // lines thinner than a pixel fade
  const float most = std::min(1.0f, 2 * half), h = std::max(half, 0.5f);
  for (int y = y0; y < y1; y++)
    for (int x = x0; x < x1; x++) {
      const vec2 p = {static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f};
      const float d = std::sqrt(squared_distance(p, a, b));
      float& c = map.at(x, y);
      c = std::max(c, most * std::clamp(h + 0.5f - d, 0.0f, 1.0f));
    }
}

}  // namespace

void draw_lines(canvas& picture, const std::vector<std::vector<vec2>>& lines, float width,
                const vec3& color, float cover) {
  vec2 low = vec2(wisp::infinity), high = vec2(-wisp::infinity);
  for (const auto& line : lines)
    for (const vec2& p : line) low = glm::min(low, p), high = glm::max(high, p);
  if (!(low.x <= high.x)) return;
  const float reach = width / 2 + 2;
  cover_map map;
  map.x0 = pixel(low.x - reach, picture.width), map.x1 = pixel(high.x + reach, picture.width);
  map.y0 = pixel(low.y - reach, picture.height), map.y1 = pixel(high.y + reach, picture.height);
  if (map.x0 >= map.x1 || map.y0 >= map.y1) return;
  map.cover.resize(static_cast<std::size_t>(map.x1 - map.x0) *
                   static_cast<std::size_t>(map.y1 - map.y0));
  for (const auto& line : lines) {
    if (line.size() == 1) add_segment(map, line[0], line[0], width / 2);
    for (std::size_t i = 1; i < line.size(); i++) add_segment(map, line[i - 1], line[i], width / 2);
  }
  for (int y = map.y0; y < map.y1; y++)
    for (int x = map.x0; x < map.x1; x++)
      if (float c = map.at(x, y) * cover; c > 0)
        picture.at(x, y) = glm::mix(picture.at(x, y), color, c);
}

void draw_line(canvas& picture, const std::vector<vec2>& points, float width, const vec3& color,
               float cover) {
  draw_lines(picture, {points}, width, color, cover);
}

float text_width(std::string_view text, float size) {
  float width = 0;
  while (!text.empty()) {
    const placed_glyph g = place_glyph(next_character(text));
    width += (g.shape->width + gap) * g.scale;
  }
  return std::max(0.0f, width - gap) * size / capital;
}

void draw_text(canvas& picture, std::string_view text, const vec2& baseline, float size,
               const vec3& color, text_align align) {
  const float unit = size / capital;
  float x = baseline.x;
  if (align == text_align::center) x -= text_width(text, size) / 2;
  if (align == text_align::right) x -= text_width(text, size);
  while (!text.empty()) {
    const placed_glyph g = place_glyph(next_character(text));
    stroke_list lines, dots;
    for (auto& line : read_path(g.shape->path)) {
      for (vec2& p : line)
        p = {x + p.x * g.scale * unit, baseline.y - (p.y * g.scale + g.rise) * unit};
      (line.size() == 1 ? dots : lines).push_back(std::move(line));
    }
    // raised digits keep some of their weight
    const float weight = stroke * unit * std::sqrt(g.scale);
    draw_lines(picture, lines, weight, color);
    draw_lines(picture, dots, weight * 1.35f, color);
    x += (g.shape->width + gap) * g.scale * unit;
  }
}
