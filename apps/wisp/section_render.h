#pragma once

// Instances of sections in pictures: the solid cut open, its surface coloured by the
// boundary function and the cut by the solution.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "wisp/core/error.h"
#include "wisp/core/report.h"
#include "wisp/scene/scene.h"

struct section_render_options {
  int camera = 0;
  wisp::ivec2 size = {1280, 720};  // of the picture, in pixels
  std::uint64_t walks = 0;         // for each cell; 0: those of the problem
  std::uint64_t seed = 0;
  int threads = 0;
  // Called while walks are made, with a line of text; false stops.
  std::function<bool(const std::string&)> on_progress = {};
};

bool shows_sections(const wisp::scene_data& scene);

// Solves the sections that instances show, with cells no larger than the pixels that the
// nearest part of them falls on (but at most 2048 along a side), and replaces each such
// instance by instances of shapes that can be rendered. Adds to the report what was built
// for it. Returns false if it was stopped. Throws wisp::file_error.
bool render_sections(wisp::scene_data& scene, const section_render_options& options,
                     std::vector<wisp::part_report>& parts, wisp::warning_list& warnings);

// Puts the uncut solids in the place of sections, without solving anything, and tells what
// would be built: enough for wisp::plan_parts.
void plan_sections(wisp::scene_data& scene, std::vector<wisp::part_report>& parts);
