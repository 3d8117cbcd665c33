#include "solve_result.h"

#include <fmt/format.h>

#include <cmath>

solve_summary summarize(const wisp::solution& solution, std::span<const wisp::dvec3> points,
                        const scene_problem& problem) {
  solve_summary result;
  double errors = 0, differences = 0;
  std::size_t error_count = 0, difference_count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const wisp::estimate& e = solution.values[i];
    result.outside += e.status == wisp::point_status::outside;
    result.singular += e.status == wisp::point_status::singular;
    result.undefined += e.status == wisp::point_status::undefined;
    result.unsolved += e.status == wisp::point_status::ok && e.walks == 0;
    if (e.status == wisp::point_status::outside) continue;
    const wisp::dvec4 exact = problem.exact ? problem.exact(points[i]) : wisp::dvec4{0};
    for (int c = 0; c < problem.problem.channels; ++c) {
      if (e.walks > 0 && std::isfinite(e.standard_error[c])) {
        errors += e.standard_error[c] * e.standard_error[c];
        ++error_count;
      }
      const double difference = e.mean[c] - exact[c];
      if (problem.exact && std::isfinite(difference)) {
        differences += difference * difference;
        ++difference_count;
      }
    }
  }
  const auto root = [](double sum, std::size_t count) {
    return count > 0 ? std::sqrt(sum / static_cast<double>(count))
                     : std::numeric_limits<double>::quiet_NaN();
  };
  result.error = root(errors, error_count);
  result.rmse = root(differences, difference_count);
  return result;
}

wisp::warning_list find_warnings(const wisp::solution& solution, const solve_summary& summary,
                                 std::size_t points, const wisp::solve_options& options) {
  wisp::warning_list warnings;
  if (solution.unfinished > 0) {
    warnings.push_back(fmt::format(
        "{} of {} walks did not end at the boundary within {} steps, or left through a hole of it, "
        "and may have biased the result; --max-steps or \"max_steps\" raises the limit",
        solution.unfinished, solution.walks, options.max_steps));
  }
  if (summary.undefined > 0) {
    warnings.push_back(fmt::format(
        "{} of {} points are nan, as walks met values of a formula or texture that are not numbers",
        summary.undefined, points));
  }
  if (summary.outside > 0) {
    warnings.push_back(fmt::format("{} of {} points are nan, as they are not in the domain",
                                   summary.outside, points));
  }
  if (summary.singular > 0) {
    warnings.push_back(fmt::format("{} of {} points are nan, as they are at a point source",
                                   summary.singular, points));
  }
  return warnings;
}

section_image make_image(const wisp::section_grid& grid, const wisp::solution& solution,
                         int channels) {
  section_image image;
  image.width = grid.width;
  image.height = grid.height;
  image.corner = grid.corner;
  image.right = grid.right;
  image.down = grid.down;
  image.normal = grid.normal;
  image.cell = grid.cell;
  image.channels = channels;
  const std::size_t cells =
      static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height);
  const auto planes = static_cast<std::size_t>(channels) * cells;
  image.value.assign(planes, std::numeric_limits<double>::quiet_NaN());
  image.error = image.value;
  image.steps.assign(cells, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    const wisp::estimate& e = solution.values[i];
    for (int c = 0; c < channels; ++c) {
      const std::size_t at = static_cast<std::size_t>(c) * cells + grid.cells[i];
      image.value[at] = e.mean[c];
      image.error[at] = e.standard_error[c];
    }
    image.steps[grid.cells[i]] = e.mean_steps;
  }
  return image;
}
