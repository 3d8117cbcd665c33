// bench_pde [MESH ...]
//
// Walks on spheres from points uniform in a mesh, to a shell of 1e-3 of the diagonal of its
// box: thousand walks a second on one thread, median of five runs, each of some 300
// thousand walks.
//
//   plain     one walk after the other, each step with the exact distance from the tree
//   batches   all as in wisp, but without a grid: bounds of distances from the tree
//   first     what wisp does, from an empty grid on
//   wisp      the same once the grid is filled as far as walks come by
//
// All have the same bias and variance: their results are compared. Without a mesh bumpy
// balls are measured.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <thread>

#include "support/meshes.h"
#include "wisp/core/rng.h"
#include "wisp/pde/greens.h"
#include "wisp/pde/solve.h"

using namespace wisp;
using wisp::bench::mesh_data;
using wisp::bench::now;

namespace {

constexpr std::uint64_t walks_each = 16;
constexpr std::size_t point_count = 20000;

struct run {
  double seconds = 0, mean = 0, error = 0, steps = 0;
};

double g(const dvec3& p) { return std::sin(9 * p.x) + p.y * p.z; }
double f(const dvec3& p) { return std::cos(5 * p.y); }

// The walk of Sawhney and Crane 2020, algorithm 1, with Green's samples of the source.
run plain(const bvh& tree, double epsilon, std::span<const dvec3> points, bool source) {
  run r;
  double sum = 0, squares = 0, steps = 0;
  const double start = now();
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::uint64_t w = 0; w < walks_each; ++w) {
      rng_state rng = make_rng(i, w);
      dvec3 x = points[i];
      double u = 0;
      closest_point_result c = closest_point(tree, x);
      do {
        if (source) {
          const dvec3 y = x + sample_greens_radius(rng, c.distance, 0) * sample_direction(rng);
          u -= greens_mass(c.distance, 0) * f(y);
        }
        x += c.distance * sample_direction(rng);
        c = closest_point(tree, x);
        ++steps;
      } while (c.distance > epsilon);
      u += g(c.at.point);
      sum += u;
      squares += u * u;
    }
  }
  r.seconds = now() - start;
  const double n = static_cast<double>(points.size() * walks_each);
  r.mean = sum / n;
  r.error = std::sqrt((squares / n - r.mean * r.mean) / n);
  r.steps = steps / n;
  return r;
}

run with_wisp(const pde_problem& problem, double epsilon, std::span<const dvec3> points) {
  solve_options o;
  o.walks = walks_each;
  o.epsilon = epsilon;
  o.threads = 1;
  o.directions = first_directions::independent;
  o.control_variates = false;
  const double start = now();
  const solution s = solve(problem, points, o);
  run r;
  r.seconds = now() - start;
  for (const estimate& e : s.values) r.mean += e.mean.x / static_cast<double>(points.size());
  r.steps = static_cast<double>(s.steps) / static_cast<double>(s.walks);
  return r;
}

run median(int runs, const std::function<run()>& measure) {
  std::vector<run> all;
  for (int i = 0; i < runs; ++i) all.push_back(measure());
  std::nth_element(all.begin(), all.begin() + runs / 2, all.end(),
                   [](const run& a, const run& b) { return a.seconds < b.seconds; });
  return all[static_cast<std::size_t>(runs / 2)];
}

void measure(const mesh_data& m) {
  const bvh tree = make_bvh(m.triangles, m.positions);
  const mesh_solid solid(tree);
  const pde_domain domain(solid), without_grid(solid, domain_side::interior, {0});
  const double epsilon = 1e-3 * domain.size();
  std::vector<dvec3> points;
  rng_state rng = make_rng(1);
  while (points.size() < point_count) {
    const double x = rand1d(rng), y = rand1d(rng), z = rand1d(rng);
    const dvec3 p = tree.min() + dvec3{x, y, z} * (tree.max() - tree.min());
    if (domain.contains(p)) points.push_back(p);
  }
  fmt::print("\n{}\n", m.name);
  fmt::print("| equation | | thousand walks/s | steps | million steps/s | ratio | mean |\n");
  fmt::print("| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const bool source : {false, true}) {
    pde_problem p;
    p.boundary = g;
    if (source) p.source = f;
    p.equation = source ? pde_equation::poisson : pde_equation::laplace;
    double base = 0;
    const auto print = [&](const char* name, const run& r) {
      const double walks = static_cast<double>(points.size() * walks_each) / r.seconds;
      if (base == 0) base = walks;
      fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.2f} | {:.1f} | {:.5f} |\n",
                 source ? "Poisson" : "Laplace", name, walks / 1e3, r.steps, walks * r.steps / 1e6,
                 walks / base, r.mean);
      std::fflush(stdout);
    };
    const run slow = median(3, [&] { return plain(tree, epsilon, points, source); });
    print("plain", slow);
    p.domain = without_grid;
    print("batches", median(3, [&] { return with_wisp(p, epsilon, points); }));
    print("first", median(3, [&] {
            p.domain = pde_domain(solid);
            return with_wisp(p, epsilon, points);
          }));
    p.domain = domain;
    with_wisp(p, epsilon, points);
    const run fast = median(5, [&] { return with_wisp(p, epsilon, points); });
    print("wisp", fast);
    if (std::abs(fast.mean - slow.mean) > 6 * slow.error) {
      fmt::print("the means differ by more than six standard errors ({:.2g})\n", slow.error);
    }
    if (source) fmt::print("grid: {:.1f} MB\n", static_cast<double>(domain.bytes()) / 1e6);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    fmt::print("{}, one of {} threads\n", geometry_target(), std::thread::hardware_concurrency());
    for (int i = 1; i < argc; ++i) measure(wisp::bench::load(argv[i]));
    if (argc == 1) {
      for (const int n : {186, 742}) measure(wisp::bench::make_ball(n));
    }
  } catch (const std::exception& e) {
    fmt::print(stderr, "bench_pde: {}\n", e.what());
    return EXIT_FAILURE;
  }
}
