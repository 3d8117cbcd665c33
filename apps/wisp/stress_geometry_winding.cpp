// Winding numbers and inside tests, against whole numbers, closed forms and the sum of
// all solid angles.

#include <cmath>

#include "stress_geometry.h"
#include "stress_geometry_exact.h"
#include "wisp/geometry/fast_winding.h"
#include "wisp/geometry/inside.h"
#include "wisp/geometry/winding_number.h"

using namespace wisp;

namespace {

winding winding_of(const stress_mesh& m, double tolerance = 1e-6) {
  return make_winding(make_bvh(m.triangles, m.positions), {.tolerance = tolerance});
}

bool in_cube(const dvec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 1; }

void near_the_surface(geometry_rows& table) {
  const stress_mesh m = bumpy_mesh(3);
  const winding w = winding_of(m);
  table.add_count("winding number of a closed mesh wrong, 1e-12 from faces, edges and vertices",
                  20000, [&](std::size_t i, rng_state& rng) {
                    const dvec3 p =
                        point_on(m, rand_index(rng, 512), static_cast<int>(i % 3), rng) +
                        1e-12 * random_direction(rng);
                    const double exact = exact_winding(m, p);
                    return winding_number(w, p) != std::round(exact) ||
                           std::abs(exact - std::round(exact)) > 1e-3;
                  });
  const stress_mesh cube = cube_mesh(3);
  const winding lattice = winding_of(cube);
  table.add_count("winding number wrong, rays through edges and vertices of a lattice", 50000,
                  [&](std::size_t, rng_state& rng) {
                    dvec3 p;
                    // between lattice planes along one axis at the most, on none of the cube
                    do {
                      for (int k = 0; k < 3; ++k) p[k] = 0.125 * (rand_index(rng, 33) - 16.0);
                      if (rand_index(rng, 2) == 0) p[rand_index(rng, 3)] += 0.0371;
                    } while (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) == 1);
                    return winding_number(lattice, p) != (in_cube(p) ? 1.0 : 0.0);
                  });
}

// Cubes that cut each other, some given twice, and some of these and others inside out.
void shells(geometry_rows& table) {
  stress_mesh many;
  std::vector<dvec3> centers;
  std::vector<double> numbers;
  rng_state rng = shape_rng(5);
  for (int i = 0; i < 12; ++i) {
    const stress_mesh cube = moved(cube_mesh(1), 1, random_in_cube(rng, 1.5));
    centers.push_back(cube.positions[0] + 1.0);
    numbers.push_back((i % 2 == 0 ? 1 : -1) * (i % 3 == 0 ? 2 : 1));
    for (int k = 0; k < std::abs(numbers.back()); ++k) {
      many = joined(many, numbers.back() > 0 ? cube : inside_out(cube));
    }
  }
  const winding w = winding_of(many);
  table.add_count("winding number wrong, twelve shells across each other, doubled, inside out",
                  100000, [&](std::size_t, rng_state& points) {
                    const dvec3 p = random_in_cube(points, 3);
                    double expected = 0;
                    for (std::size_t k = 0; k < centers.size(); ++k) {
                      if (in_cube(p - centers[k])) expected += numbers[k];
                    }
                    return winding_number(w, p) != expected;
                  });
}

void sizes(geometry_rows& table) {
  const stress_mesh cube = cube_mesh(1);
  const winding tiny = winding_of(moved(cube, 1e-30)), huge = winding_of(moved(cube, 1e30));
  table.add_count("winding number wrong, meshes of sizes 1e-30 and 1e30", 100000,
                  [&](std::size_t i, rng_state& rng) {
                    const dvec3 p = random_in_cube(rng, 2);
                    const double w = i % 2 == 0 ? winding_number(tiny, p * 1e-30)
                                                : winding_number(huge, p * 1e30);
                    return w != (in_cube(p) ? 1.0 : 0.0);
                  });
  const dvec3 away{1e6, -1e6, 0.5e6};
  const winding moved_away = winding_of(moved(cube, 1, away)), near = winding_of(cube);
  table.add_count("winding number wrong, a mesh 1e6 sizes from the origin", 50000,
                  [&](std::size_t, rng_state& rng) {
                    const dvec3 p = random_in_cube(rng, 2) + away;
                    return winding_number(moved_away, p) != (in_cube(p - away) ? 1.0 : 0.0);
                  });
  table.add_count("winding number not 0, from 1e6 to 1e30 sizes away", 50000,
                  [&](std::size_t, rng_state& rng) {
                    const dvec3 far = random_direction(rng) * magnitude(rng, 6, 30);
                    return winding_number(near, far) != 0;
                  });
}

// Of the dome, from (0, 0, z): 1 in it, but for the solid angle of its opening, which is
// that of a pyramid on a regular polygon of n corners.
double dome_on_axis(int n, double z) {
  const double h = std::abs(z), slope = std::tan(stress_pi / n) * h / std::hypot(h, 1);
  const double part = (stress_pi - n * std::atan(slope)) / (2 * stress_pi);
  return z < 0 ? part : z < 1 ? 1 - part : -part;
}

void open_meshes(geometry_rows& table) {
  const int n = 32;
  const stress_mesh dome = dome_mesh(n);
  const winding exact = winding_of(dome, 0), usual = winding_of(dome);
  table.add_worst("winding number on the axis of half a ball, from 1e-9 to 1e6 sizes", 20000, 1e-13,
                  [&](std::size_t i, rng_state& rng) {
                    double z = magnitude(rng, -9, 6) * (i % 2 == 0 ? -1 : 1);
                    if (z > 0.9 && z < 1.1) z = 0.5;
                    return std::abs(winding_number(exact, {0, 0, z}) - dome_on_axis(n, z));
                  });
  table.add_worst("winding number of half a ball, within 1e-6 as asked", 4000, 1e-6,
                  [&](std::size_t i, rng_state& rng) {
                    const dvec3 p =
                        i % 6 == 5 ? random_in_cube(rng, 1e3) : point_about(dome, i, rng);
                    return std::abs(winding_number(usual, p) - exact_winding(dome, p));
                  });
  stress_mesh one;
  add_triangle(one, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const winding single = winding_of(one, 0);
  // a hundredth from its edges, where rounding of p turns to as much of an angle
  table.add_worst("winding number of one triangle, from 1e-12 to 1e3 above its face", 20000, 1e-13,
                  [&](std::size_t i, rng_state& rng) {
                    double u = uniform(rng, 0.01, 0.98), v = uniform(rng, 0.01, 0.98);
                    if (u + v > 0.99) {
                      u = 0.99 - u;
                      v = 0.99 - v;
                    }
                    const double z = magnitude(rng, -12, 3) * (i % 2 == 0 ? -1 : 1);
                    const dvec3 p{std::abs(u), std::abs(v), z};
                    return std::abs(winding_number(single, p) - exact_winding(one, p));
                  });
  stress_mesh broken = soup_mesh(60, 0.5);
  broken.positions[4].x = stress_nan;
  broken.positions[33].y = stress_inf;
  const winding left = winding_of(broken, 0);
  table.add_worst("winding number of a soup with vertices that are NaN or infinite", 10000, 1e-12,
                  [&](std::size_t, rng_state& rng) {
                    const dvec3 p = random_in_cube(rng, 2);
                    return std::abs(winding_number(left, p) - exact_winding(broken, p));
                  });
}

void fast(geometry_rows& table) {
  const stress_mesh ball = ball_mesh(6), dome = dome_mesh(64);
  const fast_winding whole[3] = {
      make_fast_winding(make_bvh(ball.triangles, ball.positions), {.order = 1}),
      make_fast_winding(make_bvh(ball.triangles, ball.positions), {.order = 2}),
      make_fast_winding(make_bvh(ball.triangles, ball.positions), {.order = 3})};
  // the ball's faces lie within 1e-3 of the sphere
  const auto point = [](rng_state& rng) {
    dvec3 p;
    do p = random_in_cube(rng, 1.1);
    while (std::abs(glm::length(p) - 1) < 2e-3);
    return p;
  };
  const double bounds[3] = {0.061, 1.6 * 0.036, 0.0032};  // of fast_winding.h, beta = 2.35
  for (std::size_t order = 1; order <= 3; ++order) {
    table.add_worst(fmt::format("fast winding number of a ball, 32,768 triangles, order {}", order),
                    100000, bounds[order - 1], [&](std::size_t, rng_state& rng) {
                      const dvec3 p = point(rng);
                      const double w = glm::length(p) < 1 ? 1 : 0;
                      return std::abs(fast_winding_number(whole[order - 1], p) - w);
                    });
  }
  const fast_winding open = make_fast_winding(make_bvh(dome.triangles, dome.positions));
  table.add_worst("fast winding number of half a ball, order 3", 2000, bounds[2],
                  [&](std::size_t, rng_state& rng) {
                    const dvec3 p = point(rng);
                    return std::abs(fast_winding_number(open, p) - exact_winding(dome, p));
                  });
}

void inside_tests(geometry_rows& table) {
  const stress_mesh bumpy = bumpy_mesh(3);
  const bvh tree = make_bvh(bumpy.triangles, bumpy.positions);
  const inside_test test(tree);
  const winding w = make_winding(tree);
  table.add_count("inside test not as all crossings of a slanted ray", 100000,
                  [&](std::size_t, rng_state& rng) {
                    const dvec3 p = random_in_cube(rng, 1.2);
                    const int crossed = crossing_sum(bumpy, p, random_direction(rng));
                    return inside(test, p).inside != (crossed != 0) ||
                           winding_number(w, p) != crossed;
                  });
  const stress_mesh half = dome_mesh(32);
  const inside_test open(make_bvh(half.triangles, half.positions));
  table.add_count("inside test of half a ball not as its solid angle", 10000,
                  [&](std::size_t, rng_state& rng) {
                    const dvec3 p = random_in_cube(rng, 1.2);
                    const double exact = exact_winding(half, p);
                    if (std::abs(std::abs(exact) - 0.5) < 1e-5) return false;  // either will do
                    return inside(open, p).inside != (std::abs(exact) > 0.5);
                  });
}

void nothing(geometry_rows& table) {
  const winding w = winding_of(ball_mesh(2)), empty;
  const fast_winding fast = make_fast_winding(w.tree());
  const dvec3 nan{stress_nan, 0, 0}, far{0, stress_inf, 0}, origin{0, 0, 0};
  table.add_exact(
      "winding numbers of NaN, exact and fast, at infinity, and of an empty mesh", "nan, nan, 0, 0",
      fmt::format("{:g}, {:g}, {:g}, {:g}", winding_number(w, nan), fast_winding_number(fast, nan),
                  winding_number(w, far), winding_number(empty, origin)));
}

}  // namespace

void stress_geometry_winding(geometry_rows& table) {
  near_the_surface(table);
  shells(table);
  sizes(table);
  open_meshes(table);
  fast(table);
  inside_tests(table);
  nothing(table);
}
