// One object and many threads of the program's own: each thread asks the same tree,
// solid, domain, problem, formula and prepared scene, at the same time as the others,
// and has the answers that one thread has. Lazily filled parts (the grid of distances)
// are filled by all of them at once.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/geometry/closest_point.h"
#include "wisp/geometry/distance_grid.h"
#include "wisp/geometry/fast_winding.h"
#include "wisp/geometry/inside.h"
#include "wisp/geometry/sdf.h"
#include "wisp/geometry/signed_distance.h"
#include "wisp/hair/bsdf.h"
#include "wisp/pde/section.h"
#include "wisp/pde/solve.h"
#if defined(WITH_SCENE)
#include "wisp/scene/formula.h"
#endif
#if defined(WITH_RENDER)
#include "wisp/render/trace.h"
#include "wisp/scene/groom.h"
#endif

namespace {

using namespace wisp;
using numbers = std::vector<double>;

constexpr int thread_number = 4;
// Of those that calls make for themselves. ThreadSanitizer does not see what TBB, which is
// not built with it, does to order them.
#if defined(__SANITIZE_THREAD__)
constexpr int inner_threads = 1;
#else
constexpr int inner_threads = 0;
#endif
bool all_fine = true;

// The work by one thread, on an object of its own, and then by several on another, which
// nobody has asked before. make() gives the work on a new object.
void compare(const char* name, const std::function<std::function<numbers()>()>& make) {
  const numbers expected = make()();
  const std::function<numbers()> work = make();
  std::array<numbers, thread_number> got;
  std::vector<std::thread> threads;
  for (numbers& g : got) threads.emplace_back([&g, &work] { g = work(); });
  for (std::thread& t : threads) t.join();
  bool fine = !expected.empty();
  for (const numbers& g : got) fine = fine && g == expected;
  std::printf("%-16s %6zu numbers by %d threads: %s\n", name, expected.size(), thread_number,
              fine ? "the same" : "DIFFERENT");
  all_fine = all_fine && fine;
}

// A ball of triangles.
bvh make_ball() {
  constexpr int rings = 24, sides = 48;
  std::vector<dvec3> positions;
  std::vector<ivec3> triangles;
  for (int r = 0; r <= rings; ++r) {
    for (int s = 0; s < sides; ++s) {
      const double theta = 3.14159265358979 * r / rings, phi = 2 * 3.14159265358979 * s / sides;
      positions.push_back(
          {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
      if (r == rings) continue;
      const int next = (s + 1) % sides, a = r * sides + s, b = r * sides + next;
      triangles.push_back({a, a + sides, b + sides});
      triangles.push_back({a, b + sides, b});
    }
  }
  bvh_options options;
  options.threads = inner_threads;
  return make_bvh(triangles, positions, options);
}

std::vector<dvec3> make_points(std::size_t count) {
  std::vector<dvec3> points(count);
  auto rng = make_rng(7, 1);
  for (dvec3& p : points) {
    for (int a = 0; a < 3; ++a) p[a] = 2.4 * static_cast<double>(rand1f(rng)) - 1.2;
  }
  return points;
}

// f of each point, on what `make` makes.
template <typename Make, typename F>
std::function<std::function<numbers()>()> for_each_point(Make make, F f) {
  return [=] {
    return [object = make(), f] {
      numbers result;
      for (const dvec3& p : make_points(2000)) result.push_back(f(object, p));
      return result;
    };
  };
}

void compare_geometry() {
  inside_options one;
  one.threads = inner_threads;
  compare("bvh", for_each_point(make_ball, [](const bvh& tree, const dvec3& p) {
            return closest_point(tree, p).distance;
          }));
  compare("mesh_solid", for_each_point([one] { return mesh_solid(make_ball(), one); },
                                       [](const mesh_solid& m, const dvec3& p) {
                                         return signed_distance(m, p);
                                       }));
  compare("fast_winding", for_each_point(
                              [] {
                                fast_winding_options options;
                                options.threads = inner_threads;
                                return make_fast_winding(make_ball(), options);
                              },
                              [](const fast_winding& fast, const dvec3& p) {
                                return fast_winding_number(fast, p);
                              }));
  compare("distance_grid", for_each_point([] { return distance_grid(make_ball()); },
                                          [](const distance_grid& grid, const dvec3& p) {
                                            return grid.bound_distance(p, 0.3).lower;
                                          }));
  compare("sdf", for_each_point(
                     [one] {
                       const std::array<sdf, 3> parts = {sdf_mesh(mesh_solid(make_ball(), one)),
                                                         sdf_torus({0, 0, 0}, {0, 0, 1}, 1, 0.2),
                                                         sdf_box({1, 0, 0}, {0.3, 0.3, 0.3})};
                       return sdf_smooth_union(parts, 0.1);
                     },
                     [](const sdf& solid, const dvec3& p) {
                       return signed_distance(solid, p) + gradient(solid, p).x;
                     }));
}

pde_problem make_heat() {
  inside_options one;
  one.threads = inner_threads;
  pde_problem heat;
  heat.domain = pde_domain(mesh_solid(make_ball(), one));
  heat.equation = pde_equation::poisson;
  heat.boundary = [](const dvec3& p) { return p.x * p.x; };
  heat.source = [](const dvec3& p) { return std::exp(-glm::dot(p, p)); };
  return heat;
}

void compare_pde() {
  compare("pde_domain", for_each_point([] { return make_heat().domain; },
                                       [](const pde_domain& domain, const dvec3& p) {
                                         return domain.clearance(p, 0.3) + domain.contains(p);
                                       }));
  compare("solve", [] {
    return [heat = make_heat()] {
      solve_options options;
      options.walks = 32;
      options.threads = inner_threads;
      numbers result;
      for (const estimate& e : solve(heat, make_points(100), options).values) {
        if (e.status == point_status::ok) result.push_back(e.mean.x);
      }
      return result;
    };
  });
  compare("solve_section", [] {
    return [heat = make_heat()] {
      section_plane plane;
      plane.resolution = 24;
      section_options options;
      options.solve.walks = 8;
      options.solve.threads = inner_threads;
      const section_grid grid = make_section_grid(heat.domain, plane, inner_threads);
      numbers result;
      for (const estimate& e : solve_section(heat, grid, options).values) {
        result.push_back(e.mean.x);
      }
      return result;
    };
  });
}

void compare_hair() {
  compare("hair_bsdf",
          for_each_point([] { return hair::make_hair_bsdf(hair::hair_parameters<double>{}); },
                         [](const hair::hair_bsdf<double>& bsdf, const dvec3& p) {
                           const auto hit = hair::make_hair_hit(bsdf, dvec3{0.2, 0.4, 0.9}, 0.3,
                                                                glm::normalize(p + 0.01));
                           return hair::eval_hair(bsdf, hit, dvec3{0.6, 0, 0.8}).x;
                         }));
}

#if defined(WITH_SCENE)
void compare_scene() {
  compare("formula", for_each_point([] { return formula("sin(x) * y + exp(-z * z)"); },
                                    [](const formula& f, const dvec3& p) { return f(p); }));
}
#endif

#if defined(WITH_RENDER)
// A triangle and a strand of hair under a sky.
render_scene prepare() {
  scene_data scene;
  camera_data camera;
  camera.frame[3] = {0, 0, 2};
  scene.cameras.push_back(camera);
  shape_data triangle;
  triangle.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
  triangle.triangles = {{0, 1, 2}};
  shape_data ground = triangle;
  for (vec3& p : ground.positions) p.z = -1;
  scene.shapes = {triangle, ground};
  groom_params groom;
  groom.strands = 50;
  groom.threads = inner_threads;
  scene.shapes.push_back(grow_groom(triangle, groom));
  scene.materials.emplace_back().color = {0.5f, 0.7f, 0.2f};
  scene.materials.emplace_back().type = material_type::hair;
  for (int i = 0; i < 3; ++i) {
    instance_data instance;
    instance.shape = i;
    instance.material = i / 2;
    scene.instances.push_back(instance);
  }
  scene.environments.emplace_back().emission = {1, 1, 1};
  warning_list warnings;
  prepare_options options;
  options.threads = inner_threads;
  return prepare_scene(std::move(scene), options, warnings);
}

numbers trace(const render_scene& scene) {
  trace_options options;
  options.width = 32;
  options.height = 18;
  options.samples = 8;
  options.threads = inner_threads;
  trace_state state = make_trace_state(scene, options);
  trace_image(state, scene, options);
  const image_data image = get_image(state);
  return numbers(image.pixels.begin(), image.pixels.end());
}

// One scene, and a state for each thread; then a scene for each.
void compare_render() {
  compare("render_scene", [] {
    auto scene = std::make_shared<render_scene>(prepare());
    return [scene] { return trace(*scene); };
  });
  compare("prepare_scene", [] { return [] { return trace(prepare()); }; });
}
#endif

}  // namespace

int main() {
  compare_geometry();
  compare_pde();
  compare_hair();
#if defined(WITH_SCENE)
  compare_scene();
#endif
#if defined(WITH_RENDER)
  compare_render();
#endif
  return all_fine ? 0 : 1;
}
