#pragma once

// Log-log plots of error against time, drawn by gnuplot.

#include <filesystem>
#include <span>
#include <string>

#include "study.h"

// Throws wisp::file_error where there is no gnuplot.
void check_gnuplot();

// Writes NAME.svg and NAME.png into the folder: the error of each run, a line through the
// budgets, of one study also the errors that it estimates itself, images as marks, and a
// guide of slope -1/2. Nothing where no run has an error above 0. Throws wisp::file_error.
void plot_studies(std::span<const study_result> studies, std::span<const std::string> names,
                  const std::filesystem::path& folder, const std::string& name);
void remove_plots(const std::filesystem::path& folder, const std::string& name);
