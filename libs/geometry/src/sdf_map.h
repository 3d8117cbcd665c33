#pragma once

// Transforms, offsets and complements: what changes a point and a value. A chain of
// them is one node.

#include <stdexcept>
#include <utility>

#include "sdf_node.h"

namespace wisp {

// The least and the largest singular value of a matrix with entries of about 1, by
// rotations that make its columns orthogonal (Hestenes 1958): unlike eigenvalues of the
// Gram matrix they keep small ones right.
inline std::pair<double, double> singular_range(glm::dmat3 m) {
  for (int sweep = 0; sweep < 60; ++sweep) {
    double off = 0;
    for (int i = 0; i < 2; ++i) {
      for (int j = i + 1; j < 3; ++j) {
        const double a = glm::dot(m[i], m[i]), b = glm::dot(m[j], m[j]);
        const double c = glm::dot(m[i], m[j]);
        if (c == 0) continue;
        off = std::max(off, std::abs(c) / std::sqrt(a * b));
        const double theta = (b - a) / (2 * c);
        const double t =
            std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(1 + theta * theta));
        const double cosine = 1 / std::sqrt(1 + t * t), sine = t * cosine;
        const dvec3 u = m[i];
        m[i] = cosine * u - sine * m[j];
        m[j] = sine * u + cosine * m[j];
      }
    }
    if (off < 1e-15) break;
  }
  const double x = glm::length(m[0]), y = glm::length(m[1]), z = glm::length(m[2]);
  return {std::min({x, y, z}), std::max({x, y, z})};
}

// scale * of(to_local (p - origin)) + shift, negative scales for complements.
struct map_node final : sdf_node {
  node_ptr of;
  glm::dmat3 to_local{1.0}, to_world{1.0};
  dvec3 origin{0};
  double scale = 1, shift = 0;
  double longest = 1;   // what a length in local space becomes at most
  bool uniform = true;  // distances are preserved but for the scale

  ~map_node() override { release(std::move(of)); }

  dvec3 local(const dvec3& p) const { return to_local * (p - origin); }
  sdf_request request(const dvec3& p, double low, double high) const {
    const double a = (low - shift) / scale, b = (high - shift) / scale;
    return {of.get(), local(p), std::min(a, b), std::max(a, b)};
  }
  double answer(const dvec3& p, double v) const {
    const double own = scale * v + shift;
    return uniform ? own : no_less_than_box(about.bounds, p, own);
  }
  double at(const dvec3& p, double low, double high) const override {
    const sdf_request r = request(p, low, high);
    return answer(p, of->at(r.p, r.low, r.high));
  }
  std::optional<sdf_request> resume(sdf_task& task, const double* operand,
                                    double& result) const override {
    const sdf_request& asked = task.asked;
    if (operand == nullptr) return request(asked.p, asked.low, asked.high);
    result = answer(asked.p, *operand);
    return {};
  }
  dvec3 gradient(const dvec3& p) const override {
    if (!uniform && distance(about.bounds, p) > 0) {
      if (scale * value(*of, local(p)) + shift < distance(about.bounds, p)) {
        return direction_from(about.bounds, p);
      }
    }
    // of a function of to_local (p - origin): its transpose
    const dvec3 g = of->gradient(local(p)) * to_local * (scale < 0 ? -1.0 : 1.0);
    const double l = glm::length(g);
    return l > 0 ? g / l : g;
  }
};

// A map of `of`, and of what it maps if it is one; without effect as yet, but for the
// properties, which are those of `of`.
std::shared_ptr<map_node> make_map(const node_ptr& of);
// The node with its box, once all else is set; or what it maps, if it changes nothing.
node_ptr finish_map(std::shared_ptr<map_node>&& map);

}  // namespace wisp
