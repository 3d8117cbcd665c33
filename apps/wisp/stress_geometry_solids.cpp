// Signed distances: primitives and meshes against closed forms, trees of operations
// against points of the surface that bisection finds without them.

#include <array>
#include <cmath>
#include <functional>

#include "stress_geometry.h"
#include "stress_geometry_exact.h"
#include "wisp/geometry/sdf.h"
#include "wisp/geometry/signed_distance.h"

using namespace wisp;

namespace {

using real = long double;
using real3 = glm::vec<3, real>;

// Closed forms, apart from the library's: of p in a frame with z along the axis.
real box_form(const real3& p, const real3& half) {
  const real3 q = glm::abs(p) - half;
  const real x = std::max(q.x, real(0)), y = std::max(q.y, real(0)), z = std::max(q.z, real(0));
  return std::sqrt(x * x + y * y + z * z) + std::min(std::max({q.x, q.y, q.z}), real(0));
}
real torus_form(const real3& p, real major, real minor) {
  return std::hypot(std::hypot(p.x, p.y) - major, p.z) - minor;
}
// From 0 to (0, 0, length).
real capsule_form(const real3& p, real length, real radius) {
  return std::hypot(std::hypot(p.x, p.y), p.z - std::clamp(p.z, real(0), length)) - radius;
}
real cylinder_form(const real3& p, real length, real radius) {
  const real across = std::hypot(p.x, p.y) - radius, along = std::max(-p.z, p.z - length);
  return across > 0 && along > 0 ? std::hypot(across, along) : std::max(across, along);
}

// An axis (1, 2, 2) / 3 and two across, all exact in real but for their third.
real3 in_frame(const dvec3& p) {
  const real3 q(p);
  return {(2 * q.x + q.y - 2 * q.z) / 3, (-2 * q.x + 2 * q.y - q.z) / 3,
          (q.x + 2 * q.y + 2 * q.z) / 3};
}

dvec3 any_place(rng_state& rng) { return random_direction(rng) * magnitude(rng, -9, 6); }

template <typename F>
void add_form(geometry_rows& table, const std::string& what, const sdf& solid, const F& form) {
  table.add_worst("signed distance of " + what + ", 1e-9 to 1e6 sizes away", 100000, 2e-15,
                  [&](std::size_t i, rng_state& rng) {
                    const dvec3 p = i % 2 == 0 ? any_place(rng) : random_in_cube(rng, 2);
                    return std::abs(signed_distance(solid, p) - static_cast<double>(form(p))) /
                           (1 + glm::length(p));
                  });
}

void primitives(geometry_rows& table) {
  const dvec3 axis{1, 2, 2};
  add_form(table, "a box", sdf_box({0, 0, 0}, {1, 0.5, 1e-6}), [](const dvec3& p) {
    return box_form(real3(p), real3(dvec3{1, 0.5, 1e-6}));
  });
  add_form(table, "a slanted torus", sdf_torus({0, 0, 0}, axis, 0.7, 0.2),
           [](const dvec3& p) { return torus_form(in_frame(p), 0.7, 0.2); });
  add_form(table, "a slanted capsule", sdf_capsule({0, 0, 0}, axis / 2.0, 0.25),
           [](const dvec3& p) { return capsule_form(in_frame(p), 1.5, 0.25); });
  add_form(table, "a slanted cylinder", sdf_cylinder({0, 0, 0}, axis / 2.0, 0.25),
           [](const dvec3& p) { return cylinder_form(in_frame(p), 1.5, 0.25); });
  const std::array all = {dvec3{1, 0.5, 0.25}, dvec3{1, 1e-3, 1e-6}, dvec3{2e-9, 1, 0.999999}};
  std::vector<sdf> ellipsoids;
  for (const dvec3& radii : all) ellipsoids.push_back(sdf_ellipsoid({0, 0, 0}, radii));
  table.add_worst(
      "signed distance of ellipsoids, radii from 1 : 2 : 4 to 1 : 5e8 : 5e8", 20000, 2e-15,
      [&](std::size_t i, rng_state& rng) {
        const dvec3& radii = all[i % 3];
        const dvec3 p = i % 4 == 0   ? any_place(rng)
                        : i % 4 == 1 ? random_in_cube(rng, 1) * radii
                                     : random_in_cube(rng, 1) * magnitude(rng, -9, 0);
        return std::abs(signed_distance(ellipsoids[i % 3], p) - exact_ellipsoid(radii, p)) /
               (1 + glm::length(p));
      });
}

// A solid and whether a point is in it, by formulas that know nothing of the solid.
struct carved_solid {
  sdf solid = {};
  std::function<bool(const real3&)> holds = {};
};

carved_solid carved() {
  const std::array torus = {sdf_torus({0, 0, 0}, {0, 0, 1}, 0.6, 0.2),
                            sdf_capsule({0, 0, 0}, {0, 0, 1}, 0.25)};
  const std::array parts = {sdf_smooth_union(torus, 0.2), sdf_sphere({0.6, 0, 0}, 0.3),
                            sdf_box({-0.6, 0, 0}, {0.1, 0.4, 0.1})};
  return {sdf_difference(parts), [](const real3& p) {
            const real a = torus_form(p, 0.6, 0.2), b = capsule_form(p, 1, 0.25);
            const real k = 0.2, h = std::max(k - std::abs(a - b), real(0));
            return std::min(a, b) - h * h / (4 * k) < 0 &&
                   glm::length(p - real3(dvec3{0.6, 0, 0})) > real(0.3) &&
                   box_form(p - real3(dvec3{-0.6, 0, 0}), real3(dvec3{0.1, 0.4, 0.1})) > 0;
          }};
}

// Points of the surface in the box of `half`, by bisection between points on both sides.
std::vector<dvec3> surface_points(const carved_solid& s, std::size_t count, const dvec3& half,
                                  uint64_t seed) {
  std::vector<dvec3> points;
  rng_state rng = make_rng(seed, 11);
  while (points.size() < count) {
    real3 in(random_in_cube(rng, 1) * half), out(random_in_cube(rng, 1) * half);
    if (!s.holds(in) || s.holds(out)) continue;
    for (int k = 0; k < 80; ++k) {
      const real3 middle = (in + out) / real(2);
      (s.holds(middle) ? in : out) = middle;
    }
    points.push_back(dvec3(in));
  }
  return points;
}

// |value| at p against the nearest of the points, of which the next one is at most
// 1e-12 to 10 sizes away: how much of the ball about p reaches beyond the surface.
// And the side, away from the surface.
void add_bound(geometry_rows& table, const std::string& what, const carved_solid& s,
               const dvec3& box) {
  const double half = std::max({box.x, box.y, box.z});
  const auto surface = surface_points(s, 1000, box, table.options.seed);
  table.add_worst("a safe ball reaches beyond the surface by, " + what, 50000, 4e-15,
                  [&](std::size_t i, rng_state& rng) {
                    const dvec3 p = surface[i % surface.size()] +
                                    random_direction(rng) * (half * magnitude(rng, -12, 1));
                    double nearest = stress_inf;
                    for (const dvec3& q : surface) {
                      nearest = std::min(nearest, glm::distance(p, q));
                    }
                    const double value = std::abs(signed_distance(s.solid, p));
                    return std::max(0.0, value - nearest) / (half + glm::length(p));
                  });
  table.add_count("side wrong, " + what, 50000, [&](std::size_t, rng_state& rng) {
    const dvec3 p = random_in_cube(rng, 1) * box;
    const double value = signed_distance(s.solid, p);
    return std::abs(value) > 1e-13 * half && (value < 0) != s.holds(real3(p));
  });
}

void trees(geometry_rows& table) {
  const carved_solid whole = carved();
  add_bound(table, "a difference from a smooth union", whole, dvec3{1.3});
  // turned by the frame of in_frame, scaled by a power of two, and moved
  for (const double scale : {0x1p-20, 0x1p20}) {
    glm::dmat4x3 frame{dvec3{2, 1, -2} / 3.0 * scale, dvec3{-2, 2, -1} / 3.0 * scale,
                       dvec3{1, 2, 2} / 3.0 * scale, dvec3{0}};
    add_bound(table, fmt::format("the same turned and scaled by {:.3g}", scale),
              {sdf_transform(frame, whole.solid),
               [=](const real3& p) {
                 const real3 q = p / real(scale);
                 return whole.holds({(2 * q.x + q.y - 2 * q.z) / 3, (-2 * q.x + 2 * q.y - q.z) / 3,
                                     (q.x + 2 * q.y + 2 * q.z) / 3});
               }},
              dvec3{1.3 * scale});
  }
  const glm::dmat4x3 flat{dvec3{1, 0, 0}, dvec3{0.5, 1, 0}, dvec3{0, 0, 1e-3}, dvec3{0}};
  add_bound(table, "the same sheared and 1e-3 as high",
            {sdf_transform(flat, whole.solid),
             [=](const real3& p) {
               return whole.holds({p.x - p.y / 2, p.y, p.z / real(1e-3)});
             }},
            {1.9, 1.3, 1.3e-3});
  // a rounded box less a smaller one: the offsets of both are exact outside
  const std::array boxes = {sdf_offset(sdf_box({0, 0, 0}, {0.5, 0.5, 0.5}), 0.2),
                            sdf_offset(sdf_box({0.4, 0, 0}, {0.3, 0.3, 0.3}), -0.1)};
  add_bound(table, "a box grown by 0.2 less a box shrunk by 0.1",
            {sdf_difference(boxes),
             [](const real3& p) {
               const real3 half(dvec3{0.5}), hole(dvec3{0.3});
               return box_form(p, half) < real(0.2) &&
                      !(box_form(p - real3(dvec3{0.4, 0, 0}), hole) < real(-0.1));
             }},
            dvec3{0.8});
}

void meshes(geometry_rows& table) {
  const stress_mesh cube = cube_mesh(2);
  const auto solid_of = [](const stress_mesh& m) {
    return mesh_solid(make_bvh(m.triangles, m.positions));
  };
  const mesh_solid cubes[3] = {solid_of(cube), solid_of(inside_out(cube)),
                               solid_of(joined(cube, cube))};
  table.add_worst("signed distance of a mesh of a cube, as it is, inside out and doubled", 50000,
                  2e-15, [&](std::size_t i, rng_state& rng) {
                    const dvec3 p = i % 2 == 0 ? any_place(rng) : random_in_cube(rng, 2);
                    const real d = box_form(real3(p), real3(dvec3{1}));
                    return std::abs(signed_distance(cubes[i % 3], p) - static_cast<double>(d)) /
                           (1 + glm::length(p));
                  });
  const dvec3 away{1e6, -1e6, 0.5e6};
  const mesh_solid far = solid_of(moved(cube, 1, away));
  table.add_worst("signed distance of a cube 1e6 sizes from the origin", 50000, 2e-15,
                  [&](std::size_t, rng_state& rng) {
                    const dvec3 p = random_in_cube(rng, 2) + away;
                    const real d = box_form(real3(p) - real3(away), real3(dvec3{1}));
                    return std::abs(signed_distance(far, p) - static_cast<double>(d));
                  });
  const sdf whole = carved().solid;
  const dvec3 nan{0, stress_nan, 0}, infinite{0, stress_inf, 0};
  table.add_exact(
      "signed distance of an empty mesh; of NaN from a mesh; of NaN, infinity from a tree",
      "inf, nan, nan, nan",
      fmt::format("{:g}, {:g}, {:g}, {:g}", signed_distance(mesh_solid(), {0, 0, 0}),
                  std::abs(signed_distance(far, nan)), std::abs(signed_distance(whole, nan)),
                  std::abs(signed_distance(whole, infinite))));
}

}  // namespace

void stress_geometry_solids(geometry_rows& table) {
  primitives(table);
  trees(table);
  meshes(table);
}
