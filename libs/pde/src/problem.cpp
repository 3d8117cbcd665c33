#include "wisp/pde/problem.h"

#include <cmath>
#include <stdexcept>

#include "domain_data.h"

namespace wisp {

namespace {

template <typename V>
bool all_finite(const V& v) {
  for (int i = 0; i < V::length(); ++i) {
    if (!std::isfinite(v[i])) return false;
  }
  return true;
}

[[noreturn]] void fail(const char* message) { throw std::invalid_argument(message); }

void check_sources(const pde_problem& p) {
  const bool any =
      p.source || !p.point_sources.empty() || !p.curve_sources.empty() || !p.mesh_sources.empty();
  if (any && (p.equation == pde_equation::laplace || p.equation == pde_equation::biharmonic)) {
    fail("the Laplace and biharmonic equations have no source; the Poisson equation has");
  }
  for (const auto& s : p.point_sources) {
    if (!all_finite(s.position) || !all_finite(s.strength)) {
      fail("a point source needs a finite position and strength");
    }
  }
  for (const auto& s : p.curve_sources) {
    if (s.points.size() < 2) fail("a curve source needs two points or more");
    if (!all_finite(s.strength)) fail("a curve source needs a finite strength");
    for (const dvec3& q : s.points) {
      if (!all_finite(q)) fail("a curve source needs finite points");
    }
  }
  for (const auto& s : p.mesh_sources) {
    if (!all_finite(s.strength)) fail("a mesh source needs a finite strength");
    for (const auto& t : s.triangles) {
      for (const std::uint32_t i : t) {
        if (i >= s.positions.size()) fail("a mesh source has a triangle with a vertex too many");
        if (!all_finite(s.positions[i])) fail("a mesh source needs finite points");
      }
    }
  }
  for (const auto& s : p.source_peaks) {
    if (!all_finite(s.center) || !(s.radius > 0) || !std::isfinite(s.radius) || !(s.weight > 0) ||
        !std::isfinite(s.weight)) {
      fail("a source peak needs a finite center, and a radius and a weight above 0");
    }
  }
}

}  // namespace

void check_problem(const pde_problem& p) {
  if (p.domain.empty()) fail("the domain is empty: it needs a solid with a surface");
  if (p.channels < 1 || p.channels > max_channels) fail("channels should be 1 to 4");
  if (!p.boundary) fail("boundary values are missing: `boundary` is no function");
  switch (p.equation) {
    case pde_equation::laplace:
    case pde_equation::poisson:
    case pde_equation::screened_poisson:
    case pde_equation::biharmonic:
      break;
    default:
      fail("there is no such equation");
  }
  if (!(p.screening >= 0) || !std::isfinite(p.screening)) {
    fail("the screening c should be finite and not negative");
  }
  if (p.screening > 0 && p.equation != pde_equation::screened_poisson) {
    fail("a screening belongs to the screened Poisson equation");
  }
  if (!all_finite(p.infinity)) fail("the value at infinity should be finite");
  const bool exterior = p.domain.side() == domain_side::exterior;
  if (p.equation == pde_equation::biharmonic) {
    if (!p.boundary_laplacian) {
      fail("the biharmonic equation needs the Laplacian of u on the boundary as well");
    }
    if (exterior)
      fail("exterior biharmonic problems have no solution that tends to a value far away");
  }
  if (exterior && p.screening > 0 && p.infinity != dvec4{0, 0, 0, 0}) {
    fail("a screened problem tends to 0 far away, not to another value at infinity");
  }
  check_sources(p);
}

}  // namespace wisp
