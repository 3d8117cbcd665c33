#include "section_outline.h"

#include <algorithm>
#include <cstdint>

#include "wisp/core/parallel.h"

std::vector<double> section_distances(const wisp::pde_domain& domain,
                                      const wisp::section_grid& grid, int threads) {
  const auto w = static_cast<std::size_t>(grid.width), h = static_cast<std::size_t>(grid.height);
  std::vector<std::uint8_t> inside(w * h, 0);
  for (const auto cell : grid.cells) inside[cell] = 1;
  const double most = 2 * grid.cell;
  std::vector<double> distance(w * h);
  const auto row = [&](std::size_t y) {
    for (std::size_t x = 0; x < w; x++) {
      const std::uint8_t side = inside[y * w + x];
      distance[y * w + x] = side ? most : -most;
      bool near = false;
      for (std::size_t j = y - std::min<std::size_t>(y, 2); j <= std::min(y + 2, h - 1); j++)
        for (std::size_t i = x - std::min<std::size_t>(x, 2); i <= std::min(x + 2, w - 1); i++)
          near = near || inside[j * w + i] != side;
      if (!near) continue;
      const wisp::dvec3 p = cell_center(grid, static_cast<int>(x), static_cast<int>(y));
      const auto boundary = domain.find_boundary(p, most);
      if (!boundary.ends) continue;
      const double d = std::min(glm::distance(p, boundary.at.position), most);
      distance[y * w + x] = side ? d : -d;
    }
  };
  wisp::parallel_for(h, threads, row);
  return distance;
}
