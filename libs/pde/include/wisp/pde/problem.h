#pragma once

// Boundary value problems in three dimensions. The sign is that of
//
//   Laplace            lap u = 0
//   Poisson            lap u = f
//   screened Poisson   lap u - c u = f,  c >= 0
//   biharmonic         lap lap u = 0
//
// with u = g on the boundary and, for the biharmonic equation, lap u = h there. A
// positive source pulls u down. Positions, shells and distances are in the units of the
// domain.
//
// All is in double: walks divide distances by one another over many orders of
// magnitude, and Green's functions of stiff equations span hundreds of them.

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <type_traits>
#include <utility>
#include <vector>

#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/pde/domain.h"

namespace wisp {

// Data of up to four channels that share their walks: a number, a vector, a colour.
// Channels beyond those of a problem are 0.
inline constexpr int max_channels = 4;

namespace pde_detail {
inline dvec4 to_channels(double v) { return {v, 0, 0, 0}; }
template <glm::length_t n, typename T, glm::qualifier Q>
dvec4 to_channels(const glm::vec<n, T, Q>& v) {
  dvec4 all{0};
  for (glm::length_t i = 0; i < n; ++i) all[i] = static_cast<double>(v[i]);
  return all;
}

// A function of P that many threads may call: const, with numbers as its value.
template <typename F, typename P>
concept field_of = std::copy_constructible<F> && requires(const F& f, const P& p) {
  pde_detail::to_channels(f(p));
};

// Whether there is a function to call: not in a null pointer, nor in an empty
// std::function. Lambdas that turn into a pointer always have one.
template <typename F>
bool is_there(const F& f) {
  if constexpr (std::is_pointer_v<F> ||
                (
                    requires { static_cast<bool>(f); } && !requires { +f; })) {
    return static_cast<bool>(f);
  } else {
    return true;
  }
}
}  // namespace pde_detail

// A function on the boundary: of a position or of a boundary_point, with one to four
// numbers as its value (double, dvec2, dvec3, dvec4; float ones are taken as well). It is
// called from many threads at once, so that its operator() has to be const: no mutable
// lambdas. An empty std::function or a null pointer makes an empty field, which
// check_problem refuses; to call one throws std::bad_function_call.
class boundary_field {
 public:
  boundary_field() = default;
  template <typename F>
  requires(!std::same_as<F, boundary_field> &&
           (pde_detail::field_of<F, boundary_point> || pde_detail::field_of<F, dvec3>))
      boundary_field(F f) {
    if (!pde_detail::is_there(f)) return;
    call_ = [f = std::move(f)](const boundary_point& p) {
      if constexpr (pde_detail::field_of<F, boundary_point>) {
        return pde_detail::to_channels(f(p));
      } else {
        return pde_detail::to_channels(f(p.position));
      }
    };
  }
  explicit operator bool() const { return static_cast<bool>(call_); }
  dvec4 operator()(const boundary_point& p) const { return call_(p); }

 private:
  std::function<dvec4(const boundary_point&)> call_ = {};
};

// The same in space, of a position.
class space_field {
 public:
  space_field() = default;
  template <typename F>
  requires(!std::same_as<F, space_field> && pde_detail::field_of<F, dvec3>) space_field(F f) {
    if (!pde_detail::is_there(f)) return;
    call_ = [f = std::move(f)](const dvec3& p) { return pde_detail::to_channels(f(p)); };
  }
  explicit operator bool() const { return static_cast<bool>(call_); }
  dvec4 operator()(const dvec3& p) const { return call_(p); }

 private:
  std::function<dvec4(const dvec3&)> call_ = {};
};

enum struct pde_equation { laplace, poisson, screened_poisson, biharmonic };

// Sources that are added to f. Parts outside of the domain have no effect.
struct point_source {
  dvec3 position = {0, 0, 0};
  dvec4 strength = {1, 0, 0, 0};  // f = strength * delta
};
struct curve_source {
  std::vector<dvec3> points = {};  // joined by segments; two or more
  dvec4 strength = {1, 0, 0, 0};   // for each unit of length
};
struct mesh_source {
  std::vector<dvec3> positions = {};
  std::vector<std::array<uint32_t, 3>> triangles = {};
  dvec4 strength = {1, 0, 0, 0};  // for each unit of area
};
// Where the volumetric source is concentrated: some of its samples are drawn there,
// combined with those of the Green's function by the balance heuristic. Changes the
// variance alone.
struct source_peak {
  dvec3 center = {0, 0, 0};
  double radius = 1;  // standard deviation of a Gaussian, > 0
  double weight = 1;  // relative to other peaks, > 0
};

// Any number of threads may solve one problem at once, as long as nobody changes it; its
// functions are then called from all of them.
struct pde_problem {
  pde_domain domain = {};
  pde_equation equation = pde_equation::laplace;
  double screening = 0;  // c >= 0, of the screened Poisson equation
  int channels = 1;      // 1 to max_channels

  boundary_field boundary = {};            // g; needed
  boundary_field boundary_laplacian = {};  // h; needed by the biharmonic equation
  space_field source = {};                 // f; an empty one is 0. (Screened) Poisson
  std::vector<point_source> point_sources = {};
  std::vector<curve_source> curve_sources = {};
  std::vector<mesh_source> mesh_sources = {};
  std::vector<source_peak> source_peaks = {};

  // What u tends to far away from a bounded boundary, in exterior problems. 0 for
  // screened problems with c > 0, which tend to nothing else.
  dvec4 infinity = {0, 0, 0, 0};
};

// Throws std::invalid_argument, in a sentence, for a problem that is not one: an empty
// domain, no boundary values, c < 0 or not finite, sources of an equation that has none,
// an exterior biharmonic problem, numbers that are not finite. It does not call the
// problem's functions; where they give no number, estimates are `undefined`.
WISP_API void check_problem(const pde_problem& problem);

}  // namespace wisp
