// Closest points, bounds of distances and the grid of them, against all triangles.

#include <cmath>
#include <limits>

#include "stress_geometry.h"
#include "stress_geometry_exact.h"
#include "wisp/geometry/closest_point.h"
#include "wisp/geometry/distance_grid.h"

using namespace wisp;

namespace {

bvh tree_of(const stress_mesh& m) { return make_bvh(m.triangles, m.positions); }

double largest(const dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

// The error of a closest point: of its distance, as a part of the largest distance of
// the triangle's vertices, and of where it is said to be, as a part of that and of the
// coordinates, which cannot tell more.
double closest_error(const stress_mesh& m, const dvec3& p, const closest_point_result& r) {
  if (!r) return stress_inf;
  const double d = exact_distance(m, p);
  const auto t = static_cast<std::size_t>(r.element);
  double extent = 0;
  for (int k = 0; k < 3; ++k) extent = std::max(extent, glm::distance(m.corner(t, k), p));
  if (extent == 0) return r.distance == 0 ? 0 : stress_inf;
  const double apart = static_cast<double>(length(wide3(r.at.point) - wide3(p)));
  const double digits = extent + largest(p) + largest(r.at.point);
  const double wrong =
      larger_error(std::abs(r.distance - d) / extent, std::abs(apart - r.distance) / digits);
  return larger_error(wrong, std::abs(exact_distance(m, t, p) - d) / extent);
}

// From points about each of the meshes in turn.
void add_meshes(geometry_rows& table, const std::string& what, std::size_t full,
                const std::vector<stress_mesh>& meshes) {
  std::vector<bvh> trees;
  for (const stress_mesh& m : meshes) trees.push_back(tree_of(m));
  table.add_worst("closest point, " + what, full, 1e-15, [&](std::size_t i, rng_state& rng) {
    const std::size_t k = i % meshes.size();
    const dvec3 p = point_about(meshes[k], i / meshes.size(), rng);
    return closest_error(meshes[k], p, closest_point(trees[k], p));
  });
}

// All kinds, with a proper triangle among them.
stress_mesh without_area() {
  stress_mesh m;
  const dvec3 a{-1, 0, 0}, b{1, 0.5, 0}, c{0, 0.25, 0};
  add_triangle(m, a, a, a);
  add_triangle(m, a, b, b);
  add_triangle(m, a, b, a);
  add_triangle(m, a, b, c);
  add_triangle(m, b, c, a);
  add_triangle(m, a, b, {0, -1, 1});
  add_triangle(m, b * 3.0, b * 5.0, b * 7.0);
  return m;
}

void shapes(geometry_rows& table) {
  for (const double aspect : {1e6, 1e8}) {
    add_meshes(table, fmt::format("slivers of aspect {:g}", aspect), 10000,
               {sliver_mesh(60, aspect)});
  }
  add_meshes(table, "triangles that are points and segments", 10000, {without_area()});
  stress_mesh one;
  add_triangle(one, {0, 0, 0}, {1, 0, 0}, {0.2, 0.7, 0.1});
  add_meshes(table, "one triangle", 10000, {one});
  stress_mesh sheets;
  for (int i = 0; i < 4; ++i) sheets = joined(sheets, moved(cube_mesh(1), 1 + 1e-7 * i));
  add_meshes(table, "sheets 1e-7 apart", 5000, {sheets});
  stress_mesh broken = soup_mesh(60, 0.5);
  broken.positions[4].x = stress_nan;
  broken.positions[33].y = stress_inf;
  broken.positions[90].z = -stress_inf;
  add_meshes(table, "three triangles with a vertex that is NaN or infinite", 10000, {broken});
}

void sizes(geometry_rows& table) {
  const stress_mesh bumpy = bumpy_mesh(3);
  add_meshes(table, "meshes of sizes 1e-30 and 1e30", 8000,
             {moved(bumpy, 1e-30), moved(bumpy, 1e30)});
  add_meshes(table, "a mesh 1e6 sizes from the origin", 4000,
             {moved(bumpy, 1, {1e6, -1e6, 0.5e6})});
  const stress_mesh few = bumpy_mesh(2);
  const bvh tree = tree_of(few);
  table.add_worst("closest point, from 1e6 to 1e30 sizes away", 4000, 1e-15,
                  [&](std::size_t, rng_state& rng) {
                    const dvec3 p = random_direction(rng) * magnitude(rng, 6, 30);
                    return closest_error(few, p, closest_point(tree, p));
                  });
}

void promises(geometry_rows& table) {
  const stress_mesh cube = cube_mesh(2), bumpy = bumpy_mesh(3);
  const bvh tree = tree_of(bumpy), cubes = tree_of(cube);
  table.add_count("not the first of equally close triangles, on a lattice", 4000,
                  [&](std::size_t, rng_state& rng) {
                    dvec3 p;
                    for (int k = 0; k < 3; ++k) p[k] = 0.5 * (rand_index(rng, 9) - 4.0);
                    int first = -1;
                    const double d = exact_distance(cube, p);
                    for (std::size_t t = 0; first < 0; ++t) {
                      if (exact_distance(cube, t, p) == d) first = static_cast<int>(t);
                    }
                    return closest_point(cubes, p).element != first;
                  });
  table.add_count("closer_than wrong, at the distance and the next number", 20000,
                  [&](std::size_t i, rng_state& rng) {
                    const dvec3 p = point_about(bumpy, i, rng);
                    const double d = closest_point(tree, p).distance;
                    return closer_than(tree, p, d) ||
                           !closer_than(tree, p, std::nextafter(d, stress_inf));
                  });
  table.add_worst("bounds of a distance within 0.2, by how far they miss it", 5000, 1e-6,
                  [&](std::size_t i, rng_state& rng) {
                    const dvec3 p = point_about(bumpy, i, rng);
                    const double d = exact_distance(bumpy, p);
                    const distance_bounds b = bound_distance(tree, p, 0.2);
                    return std::max({0.0, 0.8 * b.upper - b.lower, b.lower - d, d - b.upper});
                  });
  const distance_grid grid(tree, {.resolution = 256});
  table.add_count("bound of the grid above the distance", 40000,
                  [&](std::size_t i, rng_state& rng) {
                    const dvec3 p = point_about(bumpy, i, rng);
                    return !(grid.lower_bound(p, 0.3) <= exact_distance(bumpy, p));
                  });
  table.add_count("bound of the grid, where it has one, less than 0.7 of the distance", 5000,
                  [&](std::size_t i, rng_state& rng) {
                    const dvec3 p = point_about(bumpy, i, rng);
                    const double bound = grid.lower_bound(p, 0.3);
                    return bound != 0 && !(bound >= 0.7 * exact_distance(bumpy, p) * (1 - 1e-15));
                  });
}

void batches(geometry_rows& table) {
  const stress_mesh bumpy = bumpy_mesh(3);
  const bvh tree = tree_of(bumpy);
  std::vector<dvec3> points;
  rng_state rng = make_rng(table.options.seed, 5);
  for (std::size_t i = 0; i < table.scaled(100000); ++i) {
    points.push_back(point_about(bumpy, i, rng));
  }
  std::vector<closest_point_result> batch(points.size());
  closest_points(tree, points, batch, {}, table.options.threads);
  table.add_count("closest point of a batch not that of a single query, to the bit", 100000,
                  [&](std::size_t i, rng_state&) {
                    const auto one = closest_point(tree, points[i]);
                    return batch[i].distance != one.distance || batch[i].element != one.element ||
                           batch[i].at.point != one.at.point;
                  });
}

void nothing(geometry_rows& table) {
  const bvh ball = tree_of(ball_mesh(2)), empty = tree_of({});
  const auto found = [](const closest_point_result& r) { return r || r.distance != stress_inf; };
  table.add_count(
      "something found from NaN or infinity, or in a mesh without triangles", 1000,
      [&](std::size_t i, rng_state& rng) {
        dvec3 p = random_in_cube(rng, 2);
        if (i % 4 == 0) return found(closest_point(empty, p));
        p[rand_index(rng, 3)] = i % 4 == 1 ? stress_nan : i % 4 == 2 ? stress_inf : -stress_inf;
        return found(closest_point(ball, p));
      });
}

}  // namespace

void stress_geometry_closest(geometry_rows& table) {
  shapes(table);
  sizes(table);
  promises(table);
  batches(table);
  nothing(table);
}
