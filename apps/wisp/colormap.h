#pragma once

#include <cstdint>

#include "wisp/core/math.h"
#include "wisp/scene/scene.h"

// The colour of t in [0, 1] (clamped; NaN: the colour of 0), in sRGB as a picture file
// stores it, [0, 1]. Within 2 / 255 of Matplotlib's maps of the same names.
wisp::vec3 eval_colormap(wisp::section_colors map, double t);
// The same as linear Rec. 709, as a renderer adds light.
wisp::vec3 eval_colormap_linear(wisp::section_colors map, double t);

float srgb_to_linear(float c);
float linear_to_srgb(float c);
