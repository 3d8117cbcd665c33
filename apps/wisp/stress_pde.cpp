#include "stress_pde.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "wisp/geometry/bvh.h"
#include "wisp/pde/greens.h"
#include "wisp/pde/solve.h"

namespace {

using namespace wisp;

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

// (1 - sinh kr / (r sinh k)) / c: the unit ball with f = -1 and g = 0.
double screened_ball(double r, double c) {
  const double k = std::sqrt(c);
  if (k < 1e-2) return (1 - r * r) / 6 - c * (7 - 10 * r * r + 3 * r * r * r * r) / 360;
  return (1 - std::exp(-k * (1 - r)) * std::expm1(-2 * k * r) / std::expm1(-2 * k) / r) / c;
}

pde_problem constant_source(const pde_domain& domain, double c) {
  pde_problem p;
  p.domain = domain;
  p.equation = pde_equation::screened_poisson;
  p.screening = c;
  p.boundary = [](const dvec3&) { return 0.0; };
  p.source = [](const dvec3&) { return -1.0; };
  return p;
}

pde_problem harmonic(const pde_domain& domain, const dvec3& center = {0, 0, 0}, double scale = 1) {
  pde_problem p;
  p.domain = domain;
  p.boundary = [=](const dvec3& x) {
    const dvec3 q = (x - center) / scale;
    return q.x * q.y + q.z;
  };
  return p;
}

// An octahedron refined to a ball.
struct ball_mesh {
  std::vector<dvec3> positions = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                  {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  std::vector<ivec3> triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                  {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};

  explicit ball_mesh(const dvec3& center = {0, 0, 0}, double radius = 1, int times = 4) {
    const auto at = [&](int i) { return positions[static_cast<std::size_t>(i)]; };
    for (int i = 0; i < times; ++i) {
      std::vector<ivec3> finer;
      for (const ivec3& f : triangles) {
        const int n = static_cast<int>(positions.size());
        for (int k = 0; k < 3; ++k) {
          positions.push_back(glm::normalize(at(f[k]) + at(f[(k + 1) % 3])));
        }
        finer.insert(finer.end(),
                     {{f[0], n, n + 2}, {n, f[1], n + 1}, {n + 2, n + 1, f[2]}, {n, n + 1, n + 2}});
      }
      triangles = finer;
    }
    for (dvec3& p : positions) p = center + radius * p;
  }
  pde_domain domain(domain_side side = domain_side::interior) const {
    return pde_domain(mesh_solid(make_bvh(triangles, positions)), side);
  }
};

struct pde_table {
  const stress_options& options;
  std::vector<stress_row> rows = {};

  void add(const std::string& what, const pde_problem& p, const dvec3& at, double expected,
           double epsilon = 0, std::uint64_t walks = 4096) {
    options.progress(what);
    solve_options o;
    o.walks = walks;
    o.seed = options.seed;
    o.threads = options.threads;
    o.epsilon = epsilon > 0 ? epsilon : 1e-7 * p.domain.size();
    const solution s = solve(p, {&at, 1}, o);
    const estimate& e = s.values[0];
    const double held = 5 * e.standard_error.x + 1e-5 * std::abs(expected);
    const bool counted = s.unfinished == 0 && e.status == point_status::ok;
    rows.push_back({what, fmt::format("{:.10g}", expected),
                    fmt::format("{:.10g} ± {:.1g}", e.mean.x, e.standard_error.x),
                    counted ? std::abs(e.mean.x - expected) : nan_value, held});
  }
  void add_exact(const std::string& what, const std::string& expected, const std::string& got) {
    rows.push_back({what, expected, got, expected == got ? 0.0 : 1.0, 0.5});
  }

  void screenings();
  void sizes();
  void walls();
  void meshes();
  void starts();
};

void pde_table::screenings() {
  const pde_domain ball(sdf_sphere({0, 0, 0}, 1));
  for (const double c : {0.0, 1e-10, 1e-6, 1e-4, 1.0, 1e4, 1e7, 1e10}) {
    const double epsilon = 1e-7 / std::max(1.0, std::sqrt(c));
    add(fmt::format("unit ball, f = -1, c = {:g}, r = 0.5", c), constant_source(ball, c),
        {0.5, 0, 0}, screened_ball(0.5, c), epsilon);
    if (c < 1 || c > 1e4) continue;
    add(fmt::format("the same, r = 0.999, c = {:g}", c), constant_source(ball, c), {0.999, 0, 0},
        screened_ball(0.999, c), epsilon);
  }
  for (const double radius : {1e-6, 1e-4, 1e6}) {
    for (const double x : {1e-8, 1.0, 1e4}) {
      const double c = x * x / (radius * radius);
      add(fmt::format("ball of radius {:g}, R √c = {:g}, in units of R²", radius, x),
          constant_source(pde_domain(sdf_sphere({0, 0, 0}, radius)), c), {0.5 * radius, 0, 0},
          radius * radius * screened_ball(0.5, x * x), radius * 1e-7 / std::max(1.0, x));
    }
  }
}

void pde_table::sizes() {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double offset : {0.0, 1e5}) {
      const dvec3 center = dvec3{offset, -offset, offset / 2} * scale;
      const dvec3 at{0.3, -0.4, 0.2};
      add(fmt::format("mesh of a ball, size {:g}, {:g} sizes from the origin", scale, offset),
          harmonic(ball_mesh(center, scale).domain(), center, scale), center + scale * at,
          at.x * at.y + at.z);
    }
  }
  const pde_domain ball(sdf_sphere({0, 0, 0}, 1));
  for (const double epsilon : {1e-3, 1e-5, 2e-7}) {
    // the bias that a shell has here: walks end where u is still about epsilon / 3 too low
    solve_options o;
    o.walks = 1 << 16;
    o.epsilon = epsilon;
    o.seed = options.seed;
    o.threads = options.threads;
    const dvec3 at{0.5, 0, 0};
    const estimate e = solve(constant_source(ball, 0), {&at, 1}, o).values[0];
    rows.push_back({fmt::format("unit ball, f = -1, shell of {:g}", epsilon), "0.125",
                    fmt::format("{:.10g} ± {:.1g}", e.mean.x, e.standard_error.x),
                    std::abs(e.mean.x - 0.125), 5 * e.standard_error.x + epsilon});
  }
}

void pde_table::walls() {
  const sdf shell[] = {sdf_sphere({0, 0, 0}, 1), sdf_sphere({0, 0, 0}, 1 - 1e-4)};
  pde_problem p;
  p.domain = pde_domain(sdf_difference(shell));
  p.boundary = [](const dvec3& x) { return 1 / glm::length(x); };
  const double middle = 1 - 0.5e-4;
  add("a gap of 1e-4 between walls, 1 / r", p, {0, 0, middle}, 1 / middle, 1e-8);
  p.domain = pde_domain(sdf_sphere({0, 0, 0}, 1), domain_side::exterior);
  for (const double r : {1.001, 10.0, 1e6}) {
    p.boundary = [](const dvec3& x) { return 1 / glm::distance(x, dvec3{0.5, 0, 0}); };
    add(fmt::format("outside of a ball, a harmonic field at a distance of {:g}", r), p, {0, 0, r},
        1 / std::hypot(r, 0.5));
  }
  // lap r = 2 / r, lap log r = 1 / r^2
  p = constant_source(pde_domain(sdf_sphere({0, 0, 0}, 1)), 0);
  p.source = [](const dvec3& x) { return 2 / glm::length(x); };
  add("a source with a pole, 2 / r, at it", p, {0, 0, 0}, -1);
  p.source = [](const dvec3& x) { return 1 / glm::dot(x, x); };
  add("a source with a pole, 1 / r², r = 0.5", p, {0, 0.5, 0}, std::log(0.5));
}

void pde_table::meshes() {
  const dvec3 at{0.3, -0.4, 0.2};
  const double u = at.x * at.y + at.z;
  ball_mesh broken;
  const std::size_t n = broken.triangles.size();
  for (std::size_t i = 0; i < n; i += 7) {
    const ivec3 f = broken.triangles[i];
    broken.triangles.push_back(f);
    broken.triangles.push_back({f[0], f[0], f[1]});
  }
  broken.positions.push_back({nan_value, 0, 0});
  broken.triangles.push_back({0, 1, static_cast<int>(broken.positions.size()) - 1});
  add("doubled triangles, some without area, and a NaN vertex", harmonic(broken.domain()), at, u);
  ball_mesh inverted;
  for (ivec3& f : inverted.triangles) std::swap(f[1], f[2]);
  add("a mesh turned inside out", harmonic(inverted.domain()), at, u);
  ball_mesh crossing({-0.5, 0, 0});
  const ball_mesh other({0.5, 0, 0});
  const int first = static_cast<int>(crossing.positions.size());
  crossing.positions.insert(crossing.positions.end(), other.positions.begin(),
                            other.positions.end());
  for (const ivec3& f : other.triangles) crossing.triangles.push_back(f + first);
  add("two balls that intersect, in one mesh", harmonic(crossing.domain()), {0.8, 0.2, 0.3},
      0.8 * 0.2 + 0.3);
  ball_mesh open;
  std::erase_if(open.triangles, [&](const ivec3& f) {
    return open.positions[static_cast<std::size_t>(f[0])].z > 0.8;
  });
  const dvec3 center{0, 0, 0};
  const solution lost = solve(harmonic(open.domain()), {&center, 1}, {});
  add_exact("walks lost through a hole are counted", "some",
            lost.unfinished > 0 && std::isfinite(lost.values[0].mean.x) ? "some" : "none");
  solve_options few;
  few.max_steps = 2;
  add_exact(
      "walks of no more than 2 steps are counted", "some",
      solve(harmonic(ball_mesh().domain()), {&center, 1}, few).unfinished > 0 ? "some" : "none");
}

void pde_table::starts() {
  pde_problem p = constant_source(ball_mesh().domain(), 0);
  p.point_sources.push_back({{0.2, 0, 0}, {1, 0, 0, 0}});
  const std::array points = {dvec3{0, 0, 1}, dvec3{0, 0, 2}, dvec3{0.2, 0, 0},
                             dvec3{nan_value, 0, 0}};
  const solution s = solve(p, points, {});
  const auto name = [&](std::size_t i) -> std::string {
    switch (s.values[i].status) {
      case point_status::boundary:
        return "boundary";
      case point_status::outside:
        return "outside";
      case point_status::singular:
        return "singular";
      default:
        return "a value";
    }
  };
  add_exact("start on a vertex", "boundary", name(0));
  add_exact("start outside", "outside", name(1));
  add_exact("start at a point source", "singular", name(2));
  add_exact("start that is NaN", "outside", name(3));
  const sdf apart[] = {sdf_sphere({-5, 0, 0}, 1), sdf_sphere({5, 0, 0}, 1)};
  add("two balls apart, in one of them", harmonic(pde_domain(sdf_union(apart))), {5, 0.5, 0.2},
      2.7);
  std::string refused = "refused";
  try {
    solve(harmonic(pde_domain(sdf_intersection(apart))), points, {});
    refused = "solved";
  } catch (const std::invalid_argument&) {
  }
  add_exact("an empty intersection", "refused", refused);
}

}  // namespace

std::vector<stress_row> stress_pde(const stress_options& options) {
  pde_table table{options};
  table.screenings();
  table.sizes();
  table.walls();
  table.meshes();
  table.starts();
  return table.rows;
}
