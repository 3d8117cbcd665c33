// Sphere tracing where rays graze, and meshes of solids.

#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "stress_geometry.h"
#include "stress_geometry_shapes.h"
#include "wisp/geometry/contour.h"
#include "wisp/geometry/sphere_trace.h"

using namespace wisp;

namespace {

// A ray that passes the origin at a distance of `impact`, from `from` before that.
sdf_ray passing(rng_state& rng, double impact, double from) {
  const dvec3 along = random_direction(rng);
  const dvec3 across = glm::normalize(glm::cross(along, random_direction(rng)));
  return {across * impact - along * from, along};
}

void grazing(geometry_rows& table) {
  const sdf ball = sdf_sphere({0, 0, 0}, 1);
  // at a shallow angle rounding of the distance moves the hit by as much over its sine
  table.add_worst("hit of a ray that enters a ball by 1e-6 to 0.01, times its sine", 10000, 2e-13,
                  [&](std::size_t, rng_state& rng) {
                    const sdf_ray ray = passing(rng, 1 - magnitude(rng, -6, -2), 3);
                    const glm::vec<3, long double> o(ray.origin), v(ray.direction);
                    const long double a = glm::dot(v, v), b = glm::dot(o, v);
                    const long double root = std::sqrt(b * b - a * (glm::dot(o, o) - 1));
                    const trace_result r = sphere_trace(ball, ray);
                    if (r.end != trace_end::hit || r.at.from_inside) return stress_inf;
                    return static_cast<double>(std::abs(r.at.t - (-b - root) / a) * root);
                  });
  table.add_count("hit of a ray that passes a ball at 1e-6 to 0.01", 10000,
                  [&](std::size_t, rng_state& rng) {
                    const sdf_ray ray = passing(rng, 1 + magnitude(rng, -6, -2), 3);
                    return sphere_trace(ball, ray).end != trace_end::miss;
                  });
  // pi / sqrt(gap / 2) steps: more than a ray has
  table.add_count("hit of a ray that passes a ball at 1e-8", 5000,
                  [&](std::size_t, rng_state& rng) {
                    return sphere_trace(ball, passing(rng, 1 + 1e-8, 3)).end == trace_end::hit;
                  });
  table.add_count(
      "not a miss of such a ray with steps enough", 1000, [&](std::size_t, rng_state& rng) {
        const sphere_trace_options patient{.max_steps = 1 << 17};
        return sphere_trace(ball, passing(rng, 1 + 1e-8, 3), patient).end != trace_end::miss;
      });
}

void thin_and_far(geometry_rows& table) {
  const sdf ball = sdf_sphere({0, 0, 0}, 1), slab = sdf_box({0, 0, 0}, {1, 1, 1e-6});
  table.add_worst("hit of a sheet 2e-6 thick at 0.001 to 1 radians, times the sine", 10000, 2e-13,
                  [&](std::size_t, rng_state& rng) {
                    const double angle = magnitude(rng, -3, 0);
                    const double turn = uniform(rng, 0, 2 * stress_pi);
                    const dvec3 at{uniform(rng, -0.5, 0.5), uniform(rng, -0.5, 0.5), 1e-6};
                    const dvec3 v{std::cos(angle) * std::cos(turn),
                                  std::cos(angle) * std::sin(turn), -std::sin(angle)};
                    const sdf_ray ray{at - 2.0 * v, v};
                    const trace_result r = sphere_trace(slab, ray);
                    if (r.end != trace_end::hit || r.at.from_inside) return stress_inf;
                    return std::abs(r.at.t + (ray.origin.z - 1e-6) / v.z) * -v.z;
                  });
  table.add_worst("hit of a ball from 1e3 to 1e9 sizes away, as a part of that", 100000, 4e-15,
                  [&](std::size_t, rng_state& rng) {
                    const double from = magnitude(rng, 3, 9);
                    const dvec3 v = random_direction(rng);
                    const trace_result r = sphere_trace(ball, {-from * v, v});
                    if (r.end != trace_end::hit || r.at.from_inside) return stress_inf;
                    return std::abs(r.at.t - (from - 1)) / from;
                  });
  table.add_count("hit of a ray with a NaN or infinity or without direction", 5000,
                  [&](std::size_t i, rng_state& rng) {
                    sdf_ray ray = passing(rng, 0.5, 3);
                    if (i % 3 == 0) ray.direction = {0, 0, 0};
                    if (i % 3 == 1) ray.direction.y = stress_nan;
                    if (i % 3 == 2) ray.origin.x = stress_inf;
                    return sphere_trace(ball, ray).end != trace_end::miss;
                  });
}

// What is wrong with a mesh that should be closed: directed edges that have not one
// opposite each, triangles that have a vertex twice, and the Euler characteristic if it is
// known.
int flaws(const contour_mesh& m, std::optional<int> euler) {
  std::map<std::pair<int, int>, int> edges;
  int found = m.triangles.empty() ? 1 : 0;
  for (const ivec3& t : m.triangles) {
    if (t.x == t.y || t.y == t.z || t.z == t.x) ++found;
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [edge, times] : edges) {
    if (times != 1 || !edges.contains({edge.second, edge.first})) ++found;
  }
  const int count = static_cast<int>(m.positions.size()) + static_cast<int>(m.triangles.size()) -
                    static_cast<int>(edges.size()) / 2;
  return found + std::abs(count - euler.value_or(count));
}

// Positive where triangles face outwards.
double volume(const contour_mesh& m) {
  double sum = 0;
  const auto at = [&](int i) { return m.positions[static_cast<std::size_t>(i)]; };
  for (const ivec3& t : m.triangles) sum += glm::dot(at(t.x), glm::cross(at(t.y), at(t.z)));
  return sum / 6;
}

void add_flaws(geometry_rows& table, const std::string& what, const contour_mesh& m,
               std::optional<int> euler) {
  const int found = flaws(m, euler);
  table.rows.push_back(
      {fmt::format("open edges, handles, {}, {} triangles", what, m.triangles.size()), "none",
       fmt::format("{}", found), static_cast<double>(found), 0});
}

void balls(geometry_rows& table) {
  for (const int resolution : {16, 128}) {
    const double away = resolution == 16 ? 1e6 : 0;
    const dvec3 center{away, -away, away / 2};
    const contour_mesh m = contour([&](const dvec3& p) { return glm::distance(p, center) - 1; },
                                   {.min = center - 1.25,
                                    .max = center + 1.25,
                                    .resolution = resolution,
                                    .threads = table.options.threads});
    const std::string what = fmt::format("mesh of a ball in {}³ cells{}", resolution,
                                         away > 0 ? ", 1e6 sizes from the origin" : "");
    add_flaws(table, what, m, 2);
    // A vertex is of the planes that touch the ball at crossings of its cell's edges, no
    // farther than a diagonal from them: 3 cell^2 / 2 out at the most; a triangle spans no
    // more than two diagonals, and so lies no farther in.
    const double cell = 2.5 / resolution;
    double worst = 0;
    int inwards = 0;
    for (const ivec3& t : m.triangles) {
      dvec3 v[3];
      for (int k = 0; k < 3; ++k) {
        v[k] = m.positions[static_cast<std::size_t>(t[k])] - center;
        worst = larger_error(worst, std::abs(glm::length(v[k]) - 1));
      }
      const dvec3 middle = (v[0] + v[1] + v[2]) / 3.0;
      worst = larger_error(worst, std::abs(glm::length(middle) - 1));
      inwards += glm::dot(middle, glm::cross(v[1] - v[0], v[2] - v[0])) < 0 ? 1 : 0;
    }
    table.rows.push_back({"distance from the sphere, " + what, "0", fmt::format("{:.2g}", worst),
                          worst, 1.5 * cell * cell});
    table.rows.push_back({"triangles that face inwards, " + what, "none",
                          fmt::format("{}", inwards), static_cast<double>(inwards), 0});
  }
}

double cube_value(const dvec3& p) {
  return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) - 1;
}
// Two balls that touch at the origin.
double touching_value(const dvec3& p) {
  return std::min(glm::distance(p, {-0.5, 0, 0}), glm::distance(p, {0.5, 0, 0})) - 0.5;
}
double without_octant_value(const dvec3& p) {
  return p.x > 0 && p.y > 0 && p.z > 0 ? stress_nan : glm::length(p) - 1;
}

void contours(geometry_rows& table) {
  table.options.progress("geometry: meshes of solids");
  balls(table);
  const contour_options box{
      .min = dvec3{-1.3}, .max = dvec3{1.3}, .resolution = 24, .threads = table.options.threads};
  const contour_mesh cube = contour(cube_value, box);
  double off = 0;
  for (const dvec3& p : cube.positions) off = larger_error(off, std::abs(cube_value(p)));
  table.rows.push_back({"distance of vertices from a cube, mesh of it in 24³ cells", "0",
                        fmt::format("{:.2g}", off), off, 1e-9});
  table.add("volume of that mesh, edges and corners included", 8, volume(cube), 1e-8);
  // one solid or two: either will do
  add_flaws(table, "mesh of two balls that touch in a point", contour(touching_value, box), {});
  add_flaws(table, "mesh of a ball that is NaN in an eighth", contour(without_octant_value, box),
            2);
}

}  // namespace

void stress_geometry_surfaces(geometry_rows& table) {
  grazing(table);
  thin_and_far(table);
  contours(table);
}
