#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "stress_table.h"
#include "wisp/core/parallel.h"
#include "wisp/core/rng.h"

// The stiff and extreme cases of wisp::geometry, all computed now and held to closed
// forms, or to all triangles one by one in more digits than double has.
std::vector<stress_row> stress_geometry(const stress_options& options);

// What rows of geometry are made of: many points, of which the worst counts. Point i has
// random numbers of its own, so that rows are the same at any number of threads.
struct geometry_rows {
  const stress_options& options;
  std::vector<stress_row> rows = {};
  uint64_t stream = 0;

  // All of `full` from five million random calls on, a fiftieth at the least.
  std::size_t scaled(std::size_t full) const {
    const double share = std::clamp(static_cast<double>(options.calls) / 5e6, 0.02, 1.0);
    return static_cast<std::size_t>(share * static_cast<double>(full));
  }

  // f(i, rng) for every point, in the order of i.
  template <typename F>
  std::vector<double> each(const std::string& what, std::size_t count, const F& f) {
    options.progress("geometry: " + what);
    const uint64_t first = ++stream << 40;
    std::vector<double> found(count);
    wisp::parallel_for(
        count, options.threads,
        [&](std::size_t i) {
          wisp::rng_state rng = wisp::make_rng(options.seed, first + i);
          found[i] = f(i, rng);
        },
        16);
    return found;
  }

  // f is an error; the largest is held to `bound`.
  template <typename F>
  void add_worst(const std::string& what, std::size_t full, double bound, const F& f) {
    const std::size_t count = scaled(full);
    double worst = 0;
    for (const double e : each(what, count, f)) worst = larger_error(worst, e);
    rows.push_back({fmt::format("{}, worst of {} points", what, count), "0",
                    fmt::format("{:.2g}", worst), worst, bound});
  }
  // f tells whether a point is answered wrongly; none may be.
  template <typename F>
  void add_count(const std::string& what, std::size_t full, const F& f) {
    const std::size_t count = scaled(full);
    double wrong = 0;
    for (const double e : each(what, count, f)) wrong += e;
    rows.push_back(
        {fmt::format("{}, {} points", what, count), "none", fmt::format("{:g}", wrong), wrong, 0});
  }
  void add(const std::string& what, double expected, double got, double bound) {
    rows.push_back({what, fmt::format("{:.15g}", expected), fmt::format("{:.15g}", got),
                    expected == got ? 0 : std::abs(got - expected), bound});
  }
  void add_exact(const std::string& what, const std::string& expected, const std::string& got) {
    rows.push_back({what, expected, got, expected == got ? 0.0 : 1.0, 0});
  }
};

// Its parts, each in a file of its own.
void stress_geometry_closest(geometry_rows& table);
void stress_geometry_winding(geometry_rows& table);
void stress_geometry_solids(geometry_rows& table);
void stress_geometry_surfaces(geometry_rows& table);
