#pragma once

// Solutions as the summary, the report and pictures tell of them.

#include <cstddef>
#include <limits>
#include <span>

#include "pde_scene.h"
#include "section_files.h"
#include "wisp/core/error.h"
#include "wisp/pde/section.h"
#include "wisp/pde/solve.h"

// What the summary and the report tell of a solution; errors are root mean squares over
// points and channels.
struct solve_summary {
  std::size_t outside = 0, singular = 0, undefined = 0, unsolved = 0;
  double error = std::numeric_limits<double>::quiet_NaN();
  double rmse = std::numeric_limits<double>::quiet_NaN();
};

solve_summary summarize(const wisp::solution& solution, std::span<const wisp::dvec3> points,
                        const scene_problem& problem);

// Of walks that did not end, and points without a value.
wisp::warning_list find_warnings(const wisp::solution& solution, const solve_summary& summary,
                                 std::size_t points, const wisp::solve_options& options);

section_image make_image(const wisp::section_grid& grid, const wisp::solution& solution,
                         int channels);
