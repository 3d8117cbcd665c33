#pragma once

// Studies as text and as pages that need no other file.

#include <filesystem>
#include <span>
#include <string>

#include "study.h"

// A table of budgets, what was fitted, and what it says, for stdout.
std::string study_text(const study_result& study);
std::string compare_text(std::span<const study_result> studies, std::span<const std::string> names,
                         std::span<const std::string> differences);

// Plots are read from the folder by the name that plot_studies was given, if they are
// there. Each page holds them, the tables, machines, commands and scenes.
std::string study_page(const study_result& study, const std::filesystem::path& folder);
std::string compare_page(std::span<const study_result> studies, std::span<const std::string> names,
                         std::span<const std::string> differences,
                         const std::filesystem::path& folder, const std::string& command);
