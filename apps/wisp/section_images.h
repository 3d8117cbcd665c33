#pragma once

// Sections as images, with the render component: colours and marks as .png, numbers as
// .exr. See section_files.h, which calls these.

#include <filesystem>

#include "section_files.h"

void save_section_image(const std::filesystem::path& path, const section_image& section,
                        const section_style& style);
void check_section_image(const std::filesystem::path& path);
