#pragma once

// Samples of sources in balls: of a function of space by the Green's function or
// uniformly, of its peaks, and of curves and meshes by importance.

#include <span>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/geometry/bounds.h"
#include "wisp/pde/solve.h"

namespace wisp {

// A point of a source, its strength there for each unit of volume, area or length, and
// the density with which it was drawn; 0: the sample counts as 0.
struct source_sample {
  dvec3 point = {0, 0, 0};
  dvec4 f = {0, 0, 0, 0};
  double density = 0;
};

// Segments and triangles with a strength, in a tree that draws them in proportion to
// their measure, strength and an estimate of the Green's function.
class source_elements {
 public:
  // In parts no longer than `longest`, as points are drawn uniformly within each.
  void add(const dvec3& a, const dvec3& b, const dvec4& strength, double longest);
  void add(const dvec3& a, const dvec3& b, const dvec3& c, const dvec4& strength, double longest,
           int splits = 14);
  void build();
  bool empty() const { return elements_.empty(); }
  double weight() const { return nodes_.empty() ? 0 : nodes_[0].weight; }

  // A point of an element, and the density (per length or area) with which it was drawn
  // for a ball; false where no element comes near.
  bool draw(const dvec3& x, double radius, double k, rng_state& rng, source_sample& result) const;

 private:
  struct element {
    std::array<dvec3, 3> p = {};
    bool is_triangle = false;
    double measure = 0;
    dvec4 strength = {0, 0, 0, 0};
  };
  struct node {
    dbox3 box = {};
    double weight = 0;  // sum of measure times strength
    std::uint32_t right = 0;
    std::uint32_t element = 0;
    bool leaf = false;
  };
  std::vector<element> elements_ = {};
  std::vector<node> nodes_ = {};
  std::uint32_t build(std::uint32_t first, std::uint32_t count);
};

class source_set {
 public:
  source_set(const pde_problem& problem, const solve_options& options);

  bool empty() const { return !volume_ && elements_.empty() && balls_.empty(); }

  // An estimate of int G f over the ball of radius R around x.
  dvec4 sample_ball(const dvec3& x, double R, rng_state& rng) const;
  // The same, and for the gradient of the ball's center, int grad G f, channel by channel,
  // from a pair of points on opposite sides.
  dvec4 sample_first_ball(const dvec3& x, double R, rng_state& rng,
                          std::array<dvec3, max_channels>* gradient) const;
  // Of int G f over the outside of the sphere of radius R around `center`, from
  // center + away beyond it.
  dvec4 sample_outside(const dvec3& away, const dvec3& center, double R, rng_state& rng) const;

  // Point sources of the domain that are taken out of the problem: their field.
  dvec4 field(const dvec3& x) const;
  bool has_field() const { return !fields_.empty(); }
  // Adds the slope of the field to the gradient of each channel.
  void add_field_gradient(const dvec3& x, std::array<dvec3, max_channels>& gradient) const;
  bool on_point_source(const dvec3& x) const;

  // A point for int K f over the ball with any kernel K like G, drawn by importance for G
  // at its center: K(point) f / density estimates it. The first for the function of space,
  // the second for curves and meshes.
  source_sample draw_volume(const dvec3& x, double R, rng_state& rng) const;
  source_sample draw_element(const dvec3& x, double R, rng_state& rng) const;
  bool has_no_peaks() const { return peaks_.empty(); }
  bool has_elements() const { return !elements_.empty(); }
  bool has_volume() const { return static_cast<bool>(volume_); }
  dvec4 volume(const dvec3& p) const { return volume_(p); }

 private:
  double k_ = 0;
  source_sampling sampling_ = source_sampling::greens;
  space_field volume_ = {};

  std::vector<source_peak> peaks_ = {};
  std::vector<point_source> points_ = {};  // all in the domain
  std::vector<point_source> fields_ = {};  // taken out
  std::vector<point_source> balls_ = {};   // met in balls
  source_elements elements_ = {};
};

}  // namespace wisp
