// A section through a solution, solved once and then asked as a texture by many threads,
// as a renderer would. Writes a picture of it; ends with 1 if a lookup is farther from the
// known solution than its error allows.
//
//   section_texture [FILE.ppm [WIDTH]]

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "section_texture.h"

namespace {

using wisp::dvec3;

// A rounded box without a ball.
double body(const dvec3& p) {
  const dvec3 q = glm::abs(p) - dvec3(0.8, 0.55, 0.45);
  const double box = glm::length(glm::max(q, 0.0)) + std::min(0.0, std::max({q.x, q.y, q.z}));
  const double hole = 0.3 - glm::distance(p, dvec3(0.3, 0.1, 0));
  return std::max(box - 0.15, hole);
}

// Harmonic; in the bounds of the body its slope and its bend are below these.
double exact(const dvec3& p) { return std::sin(3 * p.x) * std::cosh(3 * p.y) / 4 + p.x * p.z; }
constexpr double largest_slope = 8, largest_bend = 20;

struct color {
  double r = 0, g = 0, b = 0;
};
// From blue over white to red, with a line at each tenth.
color ramp(double value) {
  const double t = std::clamp(value / 1.5, -1.0, 1.0), a = std::abs(t);
  const color c = t < 0 ? color{1 - 0.85 * a, 1 - 0.65 * a, 1 - 0.25 * a}
                        : color{1 - 0.15 * a, 1 - 0.7 * a, 1 - 0.85 * a};
  const double line = std::abs(value * 10 - std::round(value * 10));
  const double shade = line < 0.06 ? 0.6 : 1;
  return {c.r * shade, c.g * shade, c.b * shade};
}

struct counts {
  std::atomic<int> inside = 0, wrong = 0, missed = 0, invented = 0;
};

color shade(const section_texture& texture, double u, double v, counts& count) {
  const dvec3 p = texture.point(u, v);
  const double depth = -body(p);
  const auto found = texture.sample(p);
  if (!found) {
    // Only where a neighbouring cell is outside may a point of the body have no value.
    if (depth > 1.5 * texture.cell()) count.missed++;
    return {0.16, 0.17, 0.2};
  }
  count.inside++;
  if (depth < -1.5 * texture.cell()) count.invented++;
  // Between four cells a lookup is as far off as the function bends, at the rim as far as
  // it changes; and there is the error of the walks.
  const double cell = texture.cell();
  const double allowed = 6 * static_cast<double>(found->error) +
                         (found->whole ? largest_bend * cell * cell / 4 : largest_slope * cell * 2);
  const double value = static_cast<double>(found->value);
  if (!(std::abs(value - exact(p)) <= allowed)) count.wrong++;
  return ramp(value);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string name = argc > 1 ? argv[1] : "section.ppm";
  const int width = argc > 2 ? std::atoi(argv[2]) : 320;
  if (width < 8 || width > 8192) {
    std::fprintf(stderr, "usage: section_texture [FILE.ppm [WIDTH]]\n");
    return 2;
  }

  // Once: a plane through the body, a value and its error for each cell.
  wisp::pde_problem problem;
  problem.domain = wisp::pde_domain(body, wisp::dbox3{{-1, -0.7, -0.6}, {1, 0.7, 0.6}});
  problem.boundary = exact;
  wisp::section_plane plane;
  plane.normal = {0.2, -0.1, 1};
  plane.resolution = 96;
  const wisp::section_grid grid = wisp::make_section_grid(problem.domain, plane);
  wisp::section_options options;
  options.solve.walks = 256;
  const wisp::solution solution = wisp::solve_section(problem, grid, options);
  const section_texture texture(grid, solution);
  std::printf("%d x %d cells, %zu of them in the domain, solved in %.2f s\n", grid.width,
              grid.height, grid.points.size(), solution.seconds);

  // Any number of times, from any thread: here by the rows of a picture.
  const int height = static_cast<int>(
      std::lround(static_cast<double>(width) * grid.height / static_cast<double>(grid.width)));
  std::vector<color> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  counts count;
  std::atomic<int> next_row = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; t++)
    threads.emplace_back([&] {
      for (int y = next_row++; y < height; y = next_row++)
        for (int x = 0; x < width; x++)
          pixels[static_cast<std::size_t>(y * width + x)] =
              shade(texture, (x + 0.5) / width, (y + 0.5) / height, count);
    });
  for (auto& t : threads) t.join();

  std::FILE* file = std::fopen(name.c_str(), "wb");
  if (!file) {
    std::fprintf(stderr, "section_texture: cannot write %s\n", name.c_str());
    return 1;
  }
  std::fprintf(file, "P6\n%d %d\n255\n", width, height);
  for (const color& c : pixels)
    for (double v : {c.r, c.g, c.b}) std::fputc(static_cast<int>(255 * v + 0.5), file);
  const bool written = std::ferror(file) == 0;
  if (std::fclose(file) != 0 || !written) {
    std::fprintf(stderr, "section_texture: cannot write %s\n", name.c_str());
    return 1;
  }

  std::printf("%d lookups with a value: %d beyond their error, %d missing, %d outside\n",
              count.inside.load(), count.wrong.load(), count.missed.load(), count.invented.load());
  const bool good =
      count.inside > 1000 && count.wrong == 0 && count.missed == 0 && count.invented == 0;
  return good ? 0 : 1;
}
