#pragma once

// Sections as files: pictures with a colour map (.png), numbers (.exr), and what ParaView
// reads (.vti).

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "wisp/core/math.h"
#include "wisp/scene/scene.h"

// A solution on the cells of a plane. Cells are row by row from the top left; each of
// the arrays holds `channels` planes of width * height numbers, one after the other. NaN
// where a cell's center is outside of the domain.
struct section_image {
  int width = 0, height = 0;
  wisp::dvec3 corner = {0, 0, 0};  // top left of the grid, not of a center
  wisp::dvec3 right = {1, 0, 0}, down = {0, -1, 0}, normal = {0, 0, 1};  // unit
  double cell = 1;                                                       // side of a cell
  int channels = 1;
  std::vector<double> value = {};
  std::vector<double> error = {};  // standard errors; may be empty
  std::vector<double> steps = {};  // mean steps of a walk, one plane; may be empty
  // Signed distances of the centers of cells from the boundary of the domain, positive
  // inside, for an outline without stairs (section_outline.h); may be empty.
  std::vector<double> distance = {};
};

struct section_style {
  wisp::section_colors colormap = wisp::section_colors::viridis;
  std::optional<wisp::dvec2> range = {};  // of the ends of the map; none: see default_range
  int contours = 10;                      // lines over the range, about; 0: none
  std::string title = "";                 // of the picture; none if empty
  // Text for the headers of .png and .exr.
  std::vector<std::pair<std::string, std::string>> metadata = {};
};

// The range of values that colours show where none is given: the least and the largest
// finite one; if a few of them (noise, poles) lie far outside of what 99 % have, that. Of
// coolwarm, whose middle means zero, symmetric if there are values of both signs. {0, 1}
// for no value.
wisp::dvec2 default_range(const section_image& section, wisp::section_colors colormap);

// By ending: .vti, and with the render component .png and .exr. The file appears whole or not at
// all. Throws wisp::file_error, also for other endings, and std::invalid_argument for arrays of
// wrong sizes.
void save_section(const std::filesystem::path& path, const section_image& section,
                  const section_style& style = {});
bool can_save_section(const std::filesystem::path& path);
bool is_section_image(const std::filesystem::path& path);  // whether it can be saved or not
// Throws what save_section would throw for this name, to be called before hours of work.
void check_section_output(const std::filesystem::path& path);
