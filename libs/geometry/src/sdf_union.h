#pragma once

#include <array>
#include <cstdint>

#include "sdf_near.h"
#include "sdf_node.h"

namespace wisp {

// The union of many, smooth for blend > 0, with a tree over their boxes.
struct union_node final : sdf_node {
  struct box_node {
    dbox3 box = {};
    uint32_t first = 0, count = 0;  // of a leaf: operands
    uint32_t right = 0;             // of an inner node; the left one follows it
  };
  std::vector<node_ptr> operands = {};  // first the deep ones, then those with infinite boxes
  std::size_t deep = 0, boundless = 0;
  std::size_t leaves = 0;  // operands, those of operands that are unions counted
  std::vector<box_node> tree = {};
  double blend = 0;
  double reach = 0;  // largest coordinate of a box in the tree

  union_node(std::vector<node_ptr>&& solids, double b);
  ~union_node() override;
  double at(const dvec3& p, double low, double high) const override;
  dvec3 gradient(const dvec3& p) const override;
  std::optional<sdf_request> resume(sdf_task& task, const double* operand,
                                    double& answer) const override;

 private:
  uint32_t build(std::size_t first, std::size_t count);
  // Calls visit(operand) for operands other than deep ones that may have a value of
  // no more than limit(), which visit lowers.
  template <typename Visit, typename Limit>
  void for_near(const dvec3& p, const Visit& visit, const Limit& limit) const;
  double sharp_at(const dvec3& p, double low, double high) const;
  // The values that matter for a value in [low, high], and the least of them and high.
  double collect(const dvec3& p, double low, double high, near_values& values) const;
  double folded(near_values& values, double high) const {
    // those that were left out above `high` cannot bring it below
    return values.empty() ? high : std::min(values.fold(blend), high);
  }
};

// An intersection is the complement of the complements' union, but for its box.
struct intersection_node final : sdf_node {
  std::shared_ptr<const union_node> of;

  intersection_node(std::shared_ptr<const union_node> complements, const dbox3& box);
  ~intersection_node() override { release(std::move(of)); }
  double at(const dvec3& p, double low, double high) const override {
    return no_less_than_box(about.bounds, p, -of->at(p, -high, -low));
  }
  dvec3 gradient(const dvec3& p) const override;
  std::optional<sdf_request> resume(sdf_task& task, const double* operand,
                                    double& answer) const override;
};

}  // namespace wisp
