// bench_geometry [MESH ...]
//
// Closest points, bounds, winding numbers and inside tests: million queries a second on
// one thread (and batches on all), median of five. MESH is any mesh file that wisp
// reads; points come from MESH.box.f64 and MESH.near.f64 beside it (make_meshes.py
// writes them) or are drawn here: uniform in the bounding box, and on the surface moved
// along its normal by a normal deviate of 0.005 of the box's diagonal. Without a mesh a
// bumpy ball of 4,000 to 1.1 million triangles is measured.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "support/meshes.h"
#include "wisp/core/rng.h"
#include "wisp/geometry/closest_point.h"
#include "wisp/geometry/distance_grid.h"
#include "wisp/geometry/fast_winding.h"
#include "wisp/geometry/winding_number.h"

using namespace wisp;
using wisp::bench::load;
using wisp::bench::make_ball;
using wisp::bench::mesh_data;
using wisp::bench::now;

namespace {

struct point_set {
  const char* name;
  std::vector<dvec3> points;
};

std::vector<dvec3> read_points(const std::filesystem::path& path) {
  std::vector<dvec3> points(std::filesystem::file_size(path) / sizeof(dvec3));
  std::ifstream(path, std::ios::binary)
      .read(reinterpret_cast<char*>(points.data()),
            static_cast<std::streamsize>(points.size() * sizeof(dvec3)));
  return points;
}

std::vector<point_set> make_points(const mesh_data& m, const bvh& tree, const std::string& path) {
  std::vector<point_set> sets = {{"box", {}}, {"near", {}}};
  for (point_set& s : sets) {
    auto file = std::filesystem::path(path).replace_extension(std::string(s.name) + ".f64");
    if (!path.empty() && std::filesystem::exists(file)) s.points = read_points(file);
  }
  rng_state rng = make_rng(1);
  const dvec3 low = tree.min(), size = tree.max() - low;
  const auto random = [&] { return rand1d(rng); };
  while (sets[0].points.size() < 50000) {
    const double x = random(), y = random(), z = random();
    sets[0].points.push_back(low + size * dvec3{x, y, z});
  }
  while (sets[1].points.size() < 50000) {
    const ivec3 t = m.triangles[rand_index(rng, static_cast<uint32_t>(m.triangles.size()))];
    const auto at = [&](int i) { return m.positions[static_cast<std::size_t>(i)]; };
    double u = random(), v = random();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const dvec3 n = glm::cross(at(t.y) - at(t.x), at(t.z) - at(t.x));
    const double deviate =
        std::sqrt(-2 * std::log(1 - random())) * std::cos(6.28318530717959 * random());
    if (glm::length(n) == 0) continue;
    sets[1].points.push_back(at(t.x) + u * (at(t.y) - at(t.x)) + v * (at(t.z) - at(t.x)) +
                             n / glm::length(n) * (deviate * 0.005 * glm::length(size)));
  }
  return sets;
}

template <typename Body>
double median_seconds(const Body& body) {
  std::vector<double> times;
  for (int i = 0; i < 5; ++i) {
    const double start = now();
    body();
    times.push_back(now() - start);
  }
  std::sort(times.begin(), times.end());
  return times[2];
}

void measure(const mesh_data& m, const std::string& path) {
  bvh tree;
  const double build_1 = median_seconds([&] { tree = make_bvh(m.triangles, m.positions, {1}); });
  const double build = median_seconds([&] { tree = make_bvh(m.triangles, m.positions); });
  winding exact;
  const double exact_build = median_seconds([&] { exact = make_winding(tree); });
  fast_winding fast;
  const double fast_build = median_seconds([&] { fast = make_fast_winding(tree); });
  fmt::print("\n{} ({} boundary edges)\n", m.name, exact.boundary_edges());
  fmt::print("tree: {:.3f} s on one thread, {:.3f} s on all, {:.1f} MB\n", build_1, build,
             static_cast<double>(tree.bytes()) / 1e6);
  fmt::print("winding numbers: exact {:.3f} s, {:.2f} MB; fast {:.3f} s, {:.1f} MB\n\n",
             exact_build, static_cast<double>(exact.bytes()) / 1e6, fast_build,
             static_cast<double>(fast.bytes()) / 1e6);
  fmt::print("| million queries a second | box | near |\n| --- | ---: | ---: |\n");
  const auto sets = make_points(m, tree, path);
  const auto row = [&](const std::string& name, const auto& body) {
    std::string line = fmt::format("| {} |", name);
    for (const point_set& s : sets) {
      const double seconds = median_seconds([&] { body(s.points); });
      line += fmt::format(" {:.3g} |", static_cast<double>(s.points.size()) / seconds / 1e6);
    }
    fmt::print("{}\n", line);
    std::fflush(stdout);
  };
  using points = std::vector<dvec3>;
  std::vector<closest_point_result> found(sets[0].points.size());
  std::vector<distance_bounds> bounds(found.size());
  std::vector<double> w(found.size());
  const auto each = [](const points& p, auto& out, const auto& query) {
    for (std::size_t i = 0; i < p.size(); ++i) out[i] = query(p[i]);
  };
  row("closest point", [&](const points& p) {
    each(p, found, [&](const dvec3& x) { return closest_point(tree, x); });
  });
  row("closest point, batch", [&](const points& p) { closest_points(tree, p, found); });
  row("closest point, batch, all threads",
      [&](const points& p) { closest_points(tree, p, found, {}, 0); });
  row("bounds, tolerance 0.2", [&](const points& p) {
    each(p, bounds, [&](const dvec3& x) { return bound_distance(tree, x, 0.2); });
  });
  row("bounds, tolerance 0.2, batch",
      [&](const points& p) { bound_distances(tree, p, bounds, 0.2); });
  const distance_grid grid(tree);
  row("bounds, tolerance 0.2, by a grid that is filled", [&](const points& p) {
    each(p, bounds, [&](const dvec3& x) { return bound_distance(grid, x, 0.2); });
  });
  row("exact winding number", [&](const points& p) {
    each(p, w, [&](const dvec3& x) { return winding_number(exact, x); });
  });
  row("fast winding number", [&](const points& p) {
    each(p, w, [&](const dvec3& x) { return fast_winding_number(fast, x); });
  });
  double error = 0;
  for (const point_set& s : sets) {
    for (const dvec3& p : s.points) {
      error = std::max(error, std::abs(fast_winding_number(fast, p) - winding_number(exact, p)));
    }
  }
  fmt::print("\nlargest error of the fast winding number: {:.2g}\n", error);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    fmt::print("{}, {} threads\n", geometry_target(), std::thread::hardware_concurrency());
    for (int i = 1; i < argc; ++i) measure(load(argv[i]), argv[i]);
    if (argc == 1) {
      for (const int n : {45, 90, 186, 372, 742}) measure(make_ball(n), "");
    }
  } catch (const std::exception& e) {
    fmt::print(stderr, "bench_geometry: {}\n", e.what());
    return EXIT_FAILURE;
  }
}
