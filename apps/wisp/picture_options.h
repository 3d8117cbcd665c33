#pragma once

// Options of pictures that commands share. All throw usage_error.

#include <string>

#include "wisp/render/trace.h"

// "W" or "WxH".
void parse_resolution(const std::string& text, wisp::trace_options& options);
// The first for an empty name.
int find_camera(const wisp::scene_data& scene, const std::string& name);
// Of box, tent, gaussian and blackman-harris.
wisp::pixel_filter filter_of(const std::string& name);
