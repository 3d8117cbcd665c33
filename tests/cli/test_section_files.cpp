// Sections as files: colour maps, round numbers, pictures, and numbers that come back.

#include <doctest/doctest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>

#include "colormap.h"
#include "section_files.h"
#include "section_picture.h"
#include "section_ticks.h"
#include "wisp/core/error.h"
#include "wisp/render/image.h"

using namespace wisp;
namespace fs = std::filesystem;

namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

struct temporary_folder {
  fs::path path;
  temporary_folder() {
    std::string name = (fs::temp_directory_path() / "wisp-section-XXXXXX").string();
    path = mkdtemp(name.data());
  }
  ~temporary_folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  temporary_folder(const temporary_folder&) = delete;
  temporary_folder& operator=(const temporary_folder&) = delete;
};

// A disk of values u(x, y) + channel, of radius 0.9.
template <typename F>
section_image make_section(int width, int height, int channels, F&& u) {
  section_image s;
  s.width = width, s.height = height, s.channels = channels;
  s.cell = 2.0 / std::max(width, height);
  s.corner = {-1, 1, 0.5};
  const auto cells = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  s.value.assign(cells * static_cast<std::size_t>(channels), nan_value);
  s.error = s.value;
  s.steps.assign(cells, nan_value);
  for (std::size_t i = 0; i < cells; i++) {
    const auto w = static_cast<std::size_t>(width);
    const double x = -1 + (static_cast<double>(i % w) + 0.5) * s.cell;
    const double y = 1 - (static_cast<double>(i / w) + 0.5) * s.cell;
    if (std::hypot(x, y) > 0.9) continue;
    for (int c = 0; c < channels; c++) {
      s.value[static_cast<std::size_t>(c) * cells + i] = u(x, y) + c;
      s.error[static_cast<std::size_t>(c) * cells + i] = 0.25 + c;
    }
    s.steps[i] = 7;
  }
  return s;
}

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

std::size_t file_count(const fs::path& folder) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

}  // namespace

TEST_CASE("sections: colour maps are those of Matplotlib") {
  // at i / 255
  constexpr std::array<int, 10> at = {0, 20, 51, 85, 102, 153, 170, 204, 235, 255};
  const std::map<section_colors, std::array<unsigned, 10>> tables = {
      {section_colors::viridis,
       {0x440154, 0x481d6f, 0x414487, 0x31688e, 0x2a788e, 0x22a884, 0x35b779, 0x7ad151, 0xcae11f,
        0xfde725}},
      {section_colors::coolwarm,
       {0x3b4cc0, 0x536edd, 0x7b9ff9, 0xaac7fd, 0xc0d4f5, 0xf2cbb7, 0xf7b89c, 0xee8468, 0xd0473d,
        0xb40426}},
      {section_colors::magma,
       {0x000004, 0x0e0b2b, 0x3b0f70, 0x721f81, 0x8c2981, 0xde4968, 0xf1605d, 0xfe9f6d, 0xfed89a,
        0xfcfdbf}},
      {section_colors::plasma,
       {0x0d0887, 0x38049a, 0x6a00a8, 0x9c179e, 0xb12a90, 0xe16462, 0xed7953, 0xfca636, 0xfbd724,
        0xf0f921}},
      {section_colors::inferno,
       {0x000004, 0x10092d, 0x420a68, 0x781c6d, 0x932667, 0xdd513a, 0xed6925, 0xfca50a, 0xf4e156,
        0xfcffa4}},
      {section_colors::cividis,
       {0x00224e, 0x003070, 0x35456c, 0x575d6d, 0x666970, 0x948e77, 0xa59c74, 0xc8b866, 0xead34c,
        0xfee838}},
      {section_colors::turbo,
       {0x30123b, 0x424bb5, 0x3e9bfe, 0x1ae4b6, 0x46f884, 0xe1dd37, 0xfaba39, 0xf05b12, 0xb71d02,
        0x7a0403}}};
  for (const auto& [map, colors] : tables)
    for (std::size_t i = 0; i < at.size(); i++) {
      const vec3 c = eval_colormap(map, at[i] / 255.0) * 255.0f;
      CAPTURE(static_cast<int>(map));
      CAPTURE(at[i]);
      for (int k = 0; k < 3; k++)
        CHECK(std::abs(c[k] - static_cast<float>(colors[i] >> (16 - 8 * k) & 255)) < 2.5f);
    }
  CHECK(eval_colormap(section_colors::gray, 0.25) == vec3(0.25f));
  CHECK(eval_colormap(section_colors::gray, -3) == vec3(0));
  CHECK(eval_colormap(section_colors::gray, 3) == vec3(1));
  CHECK(eval_colormap(section_colors::gray, nan_value) == vec3(0));
  for (int i = 0; i < 256; i++) {
    const float c = static_cast<float>(i) / 255;
    CHECK(linear_to_srgb(srgb_to_linear(c)) == doctest::Approx(c).epsilon(1e-5));
  }
}

TEST_CASE("sections: marks are round numbers with as few digits as tell them apart") {
  CHECK(round_numbers({0, 1}, 5) == std::vector<double>{0, 0.2, 0.4, 0.2 * 3, 0.8, 1});
  CHECK(round_numbers({-1.42, 1.68}, 6).size() == 6);
  CHECK(round_numbers({0, 1}, 0).empty());
  CHECK(round_numbers({1, 1}, 5).empty());
  for (const dvec2 range : {dvec2{0, 1e-300}, dvec2{-1e300, 1e300}, dvec2{1e9, 1e9 + 1},
                            dvec2{-3e-7, 5e-7}, dvec2{1, 1 + 1e-15}}) {
    const auto ticks = round_numbers(range, 5);
    CHECK(ticks.size() <= 12);
    for (const double t : ticks) CHECK((t >= range.x && t <= range.y));
    CHECK(label_ticks(ticks).labels.size() == ticks.size());
  }
  const auto plain = label_ticks({-0.5, 0, 0.5});
  CHECK(plain.labels == std::vector<std::string>{"\u22120.5", "0.0", "0.5"});
  CHECK(plain.factor.empty());
  const auto small = label_ticks({-2e-5, -1e-5, 0});
  CHECK(small.labels == std::vector<std::string>{"\u22122", "\u22121", "0"});
  CHECK(small.factor == "\u00d710\u207b\u2075");
}

TEST_CASE("sections: the range of colours leaves out a few values far away") {
  auto s = make_section(100, 100, 1, [](double x, double) { return x; });
  dvec2 range = default_range(s, section_colors::viridis);
  CHECK(range.x == doctest::Approx(-0.89));
  CHECK(range.y == doctest::Approx(0.89));
  s.value[50 * 100 + 50] = 1e6;
  range = default_range(s, section_colors::viridis);
  CHECK(range.y < 1);
  s.value[50 * 100 + 50] = std::numeric_limits<double>::infinity();
  CHECK(default_range(s, section_colors::viridis).y < 1);
  for (double& v : s.value) v += 0.4;
  range = default_range(s, section_colors::coolwarm);
  CHECK(range.x == -range.y);
  const auto constant = make_section(20, 20, 1, [](double, double) { return 3.0; });
  range = default_range(constant, section_colors::coolwarm);
  CHECK(range.x < 3);
  CHECK(range.y > 3);
  s.value.assign(s.value.size(), nan_value);
  CHECK(default_range(s, section_colors::viridis) == dvec2{0, 1});
}

TEST_CASE("sections: a picture shows the colours of values and paper around") {
  auto s = make_section(200, 200, 1, [](double, double) { return 0.5; });
  section_style style;
  style.range = dvec2{0, 1};
  style.contours = 0;
  canvas picture = draw_section(s, style);
  const vec3 wanted = eval_colormap(section_colors::viridis, 0.5);
  int same = 0;
  const int scale = 4;  // 720 pixels at least
  for (const vec3& c : picture.pixels) same += glm::distance(c, wanted) < 1e-6f;
  const double disk = pi * 0.9 * 0.9 * 100 * 100 * scale * scale;
  CHECK(same == doctest::Approx(disk).epsilon(0.02));
  CHECK(picture.at(0, 0) == vec3(1));
  CHECK(picture.width > 200 * scale);

  // of what has no values, of one cell, of infinite ones, of very flat ones: something
  s.value.assign(s.value.size(), nan_value);
  CHECK_FALSE(draw_section(s, {}).pixels.empty());
  for (const double v : {0.0, 1.0, 1e300, -std::numeric_limits<double>::infinity(),
                         std::numeric_limits<double>::denorm_min()}) {
    const auto one = make_section(1, 1, 1, [&](double, double) { return v; });
    CHECK_FALSE(draw_section(one, {}).pixels.empty());
    const auto flat = make_section(300, 2, 1, [&](double x, double) { return x > 0 ? v : 1; });
    CHECK_FALSE(draw_section(flat, {}).pixels.empty());
  }
  const auto lone = make_section(1, 1, 1, [](double, double) { return 0.5; });
  style.range = dvec2{0, 1};
  picture = draw_section(lone, style);
  same = 0;
  for (const vec3& c : picture.pixels) same += glm::distance(c, wanted) < 1e-6f;
  CHECK(same > 100000);

  // colours have no bar
  const auto colors = make_section(200, 200, 3, [](double, double) { return -0.5; });
  picture = draw_section(colors, {});
  CHECK(picture.width < 200 * scale + 100);
  CHECK(glm::distance(picture.at(picture.width / 2, 60 + 100 * scale),
                      vec3(0, linear_to_srgb(0.5f), 1)) < 1e-5f);
}

TEST_CASE("sections: contour lines are where the values are") {
  auto s = make_section(360, 360, 1, [](double x, double) { return x; });
  section_style style;
  style.range = dvec2{-1, 1};
  style.contours = 0;
  const canvas plain = draw_section(s, style);
  style.contours = 10;
  const canvas lined = draw_section(s, style);
  REQUIRE(lined.width == plain.width);
  REQUIRE(lined.height == plain.height);
  // along the middle row, left of the bar: lines at -0.8, -0.6, ... 0.8
  const int scale = 2;
  const float capital = std::round(720.0f / 62), margin = std::round(1.6f * capital);
  const int left = static_cast<int>(margin), y = left + 180 * scale;
  std::vector<double> places;
  for (int x = left; x < left + 360 * scale; x++) {
    const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(plain.width) +
                   static_cast<std::size_t>(x);
    if (glm::distance(plain.pixels[i], lined.pixels[i]) < 0.05f) continue;
    const double place = (x - left + 0.5) / (180.0 * scale) - 1;
    if (places.empty() || place - places.back() > 0.05) places.push_back(place);
  }
  REQUIRE(places.size() == 9);
  for (std::size_t k = 0; k < places.size(); k++)
    CHECK(places[k] == doctest::Approx(-0.8 + 0.2 * static_cast<double>(k)).epsilon(0.01));
}

TEST_CASE("sections: files hold the numbers") {
  temporary_folder folder;
  for (const int channels : {1, 3}) {
    const auto s = make_section(30, 20, channels, [](double x, double y) { return x + 10 * y; });
    const fs::path exr = folder.path / "a.exr", vti = folder.path / "a.vti";
    section_style style;
    style.title = "heat -- <of> & all";
    save_section(exr, s, style);
    save_section(vti, s, style);
    CHECK(file_count(folder.path) == 2);

    const image_data image = load_image(exr);
    CHECK(image.width == 30);
    const auto find = [&](const std::string& name) {
      const auto i = std::find(image.channels.begin(), image.channels.end(), name);
      REQUIRE(i != image.channels.end());
      return static_cast<std::size_t>(i - image.channels.begin());
    };
    const std::size_t n = image.channels.size();
    const std::size_t value = find(channels == 1 ? "value" : "value.G");
    const std::size_t error = find(channels == 1 ? "error" : "error.G");
    const std::size_t steps = find("steps"), inside = find("inside");
    const std::size_t plane = channels == 1 ? 0 : 600;
    for (std::size_t i = 0; i < 600; i++) {
      const double v = s.value[plane + i];
      CHECK(image.pixels[i * n + inside] == (std::isnan(v) ? 0.0f : 1.0f));
      if (std::isnan(v)) continue;
      CHECK(image.pixels[i * n + value] == static_cast<float>(v));
      CHECK(image.pixels[i * n + error] == static_cast<float>(s.error[plane + i]));
      CHECK(image.pixels[i * n + steps] == 7);
    }

    const std::string text = read_text(vti);
    CHECK(text.find("WholeExtent=\"0 29 0 19 0 0\"") != std::string::npos);
    CHECK(text.find("Direction=\"1 -0 0 0 1 0 0 -0 1\"") != std::string::npos);
    CHECK(text.find("heat \u2010\u2010 &lt;of> &amp; all") != std::string::npos);
    std::size_t at = text.find("encoding=\"raw\">\n_");
    REQUIRE(at != std::string::npos);
    at += 17;
    const auto read_size = [&] {
      std::uint64_t bytes = 0;
      REQUIRE(at + 8 <= text.size());
      std::memcpy(&bytes, text.data() + at, 8);
      at += 8;
      return bytes;
    };
    const auto components = static_cast<std::size_t>(channels);
    REQUIRE(read_size() == 600 * 8 * components);
    for (std::size_t y = 0; y < 20; y++)
      for (std::size_t x = 0; x < 30; x++)
        for (std::size_t c = 0; c < components; c++, at += 8) {
          double v = 0;
          std::memcpy(&v, text.data() + at, 8);
          const double wanted = s.value[c * 600 + (19 - y) * 30 + x];  // from the bottom up
          CHECK((v == wanted || (std::isnan(v) && std::isnan(wanted))));
        }
    REQUIRE(read_size() == 600 * 8 * components);
    at += 600 * 8 * components;
    REQUIRE(read_size() == 600 * 8);
    at += 600 * 8;
    REQUIRE(read_size() == 600);
    CHECK(text[at + 10 * 30 + 15] == 1);
    CHECK(text[at] == 0);
    CHECK(text.substr(at + 600) == "\n  </AppendedData>\n</VTKFile>\n");
  }
}

TEST_CASE("sections: wrong files and arrays are told of and leave nothing") {
  temporary_folder folder;
  auto s = make_section(8, 8, 1, [](double x, double) { return x; });
  CHECK(can_save_section("a.PNG"));
  CHECK_FALSE(can_save_section("a.csv"));
  CHECK_THROWS_AS(save_section(folder.path / "a.tiff", s), file_error);
  CHECK_THROWS_AS(save_section(folder.path / "no" / "a.vti", s), file_error);
  CHECK_THROWS_AS(save_section(folder.path / "no" / "a.png", s), file_error);
  fs::create_directory(folder.path / "b.vti");
  CHECK_THROWS_AS(save_section(folder.path / "b.vti", s), file_error);
  section_style style;
  style.range = dvec2{1, 1};
  CHECK_THROWS_AS(save_section(folder.path / "a.png", s, style), std::invalid_argument);
  s.value.pop_back();
  for (const char* name : {"a.png", "a.exr", "a.vti"})
    CHECK_THROWS_AS(save_section(folder.path / name, s), std::invalid_argument);
  CHECK(file_count(folder.path) == 1);
}
