// What operations make of values: minima and maxima, and which operands can matter.

#include <array>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "sdf_node.h"

namespace wisp {

namespace {

constexpr int deepest = 1000;

using node_ptr = std::shared_ptr<const sdf_node>;

void set_depth(sdf_node& node, int deepest_operand) {
  node.depth = deepest_operand + 1;
  if (node.depth > deepest) throw std::length_error("sdf: nested more than 1000 deep");
}

// The minimum of two values with its edge rounded, see sdf.h.
double smooth_min(double a, double b, double blend) {
  const double h = std::max(blend - std::abs(a - b), 0.0);
  return std::min(a, b) - h * h / (4 * blend);
}

// The values near the least one, sorted, with their operands. Most are few.
struct near_values {
  struct entry {
    double value;
    const sdf_node* operand;
  };
  std::array<entry, 32> few;
  std::size_t count = 0;
  std::vector<entry> many = {};  // when they are not

  entry* begin() { return many.empty() ? few.data() : many.data(); }
  entry* end() { return begin() + (many.empty() ? count : many.size()); }
  void insert(const entry& e, double blend) {
    const bool is_few = many.empty();
    if (is_few && count < few.size()) {
      few[count++] = e;
    } else {
      if (is_few) many.assign(few.begin(), few.end());
      many.push_back(e);
    }
    for (entry* i = end() - 1; i != begin() && i->value < (i - 1)->value; --i) {
      std::swap(*i, *(i - 1));
    }
    // what is farther than the blend from the least has no say
    const double limit = begin()->value + blend;
    while (!((end() - 1)->value < limit) && end() - begin() > 1) {
      if (many.empty()) {
        --count;
      } else {
        many.pop_back();
      }
    }
  }

  bool empty() const { return count == 0; }
  double fold(double blend) {
    double result = begin()->value;
    for (entry* e = begin() + 1; e < end(); ++e) result = smooth_min(result, e->value, blend);
    return result;
  }
  dvec3 gradient(const dvec3& p, double blend) {
    if (empty()) return {0, 0, 0};
    double a = begin()->value;
    dvec3 g = begin()->operand->gradient(p);
    for (entry* e = begin() + 1; e < end(); ++e) {
      // the derivative of smooth_min by the larger operand
      const double h = std::max(blend - std::abs(a - e->value), 0.0) / (2 * blend);
      const double share = e->value < a ? 1 - h : h;
      g = (1 - share) * g + share * e->operand->gradient(p);
      a = smooth_min(a, e->value, blend);
    }
    const double l = glm::length(g);
    return l > 0 ? g / l : g;
  }
};

// The union of many, smooth for blend > 0.
struct union_node final : sdf_node {
  struct box_node {
    dbox3 box = {};
    uint32_t first = 0, count = 0;  // of a leaf: operands
    uint32_t right = 0;             // of an inner node; the left one follows it
  };
  std::vector<node_ptr> operands = {};  // those with infinite boxes first
  std::size_t boundless = 0;
  std::vector<box_node> tree = {};
  double blend = 0;

  union_node(std::vector<node_ptr>&& solids, double b);
  double at(const dvec3& p, double low, double high) const override;
  dvec3 gradient(const dvec3& p) const override;

 private:
  uint32_t build(std::size_t first, std::size_t count);
  // Calls visit(operand, limit) for operands that may have a value below limit(),
  // which visit lowers.
  template <typename Visit, typename Limit>
  void for_near(const dvec3& p, const Visit& visit, const Limit& limit) const;
  // What an operand counts for: outside of its box no less than the distance from it.
  static double operand_at(const sdf_node& o, const dvec3& p, double low, double high) {
    const double v = o.at(p, low, high);
    return o.about.exact_outside ? v : std::max(v, beyond_box(o, p, v));
  }
  static double beyond_box(const sdf_node& o, const dvec3& p, double v) {
    const double d = distance(o.about.bounds, p);
    return d > 0 ? d : v;
  }
  double smooth_at(const dvec3& p, double low, double high, near_values& values) const;
};

union_node::union_node(std::vector<node_ptr>&& solids, double b)
    : operands(std::move(solids)), blend(b) {
  about.exact_inside = operands.size() == 1 && operands[0]->about.exact_inside;
  int depth_below = 0;
  for (const node_ptr& o : operands) {
    about.exact_outside = about.exact_outside && o->about.exact_outside && blend == 0;
    about.bounds = merge(about.bounds, o->about.bounds);
    depth_below = std::max(depth_below, o->depth);
  }
  set_depth(*this, depth_below);
  if (blend > 0) {
    const double most = std::min(1.0, static_cast<double>(operands.size() - 1) / 4) * blend;
    about.bounds = grow(about.bounds, most);
  }
  const auto bounded =
      std::stable_partition(operands.begin(), operands.end(),
                            [](const node_ptr& o) { return !is_finite(o->about.bounds); });
  boundless = static_cast<std::size_t>(bounded - operands.begin());
  if (operands.size() > boundless) {
    tree.reserve(operands.size() - boundless);
    build(boundless, operands.size() - boundless);
  }
}

uint32_t union_node::build(std::size_t first, std::size_t count) {
  const auto index = static_cast<uint32_t>(tree.size());
  tree.push_back({});
  dbox3 box, centers;
  const auto center = [](const node_ptr& o) { return o->about.bounds.min + o->about.bounds.max; };
  for (std::size_t i = first; i < first + count; ++i) {
    box = merge(box, operands[i]->about.bounds);
    centers = merge(centers, center(operands[i]));
  }
  tree[index].box = box;
  if (count <= 2) {
    tree[index].first = static_cast<uint32_t>(first);
    tree[index].count = static_cast<uint32_t>(count);
    return index;
  }
  const dvec3 extent = centers.max - centers.min;
  const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  const auto begin = operands.begin() + static_cast<std::ptrdiff_t>(first);
  const auto half = static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(
      begin, begin + half, begin + static_cast<std::ptrdiff_t>(count),
      [&](const node_ptr& a, const node_ptr& b) { return center(a)[axis] < center(b)[axis]; });
  build(first, count / 2);
  const uint32_t right = build(first + count / 2, count - count / 2);
  tree[index].right = right;
  return index;
}

template <typename Visit, typename Limit>
void union_node::for_near(const dvec3& p, const Visit& visit, const Limit& limit) const {
  for (std::size_t i = 0; i < boundless; ++i) visit(*operands[i]);
  if (tree.empty()) return;
  struct waiting {
    uint32_t node;
    double distance;
  };
  std::array<waiting, 64> stack;  // halves: no deeper than the bits of a count
  std::size_t top = 0;
  stack[top++] = {0, distance(tree[0].box, p)};
  while (top > 0) {
    const waiting w = stack[--top];
    // what p lies in the box of may be below any limit
    if (w.distance > 0 && !(w.distance < limit())) continue;
    const box_node& n = tree[w.node];
    for (uint32_t i = n.first; i < n.first + n.count; ++i) {
      const double d = n.count == 1 ? 0 : distance(operands[i]->about.bounds, p);
      if (!(d > 0) || d < limit()) visit(*operands[i]);
    }
    if (n.count > 0) continue;
    waiting near = {w.node + 1, distance(tree[w.node + 1].box, p)};
    waiting far = {n.right, distance(tree[n.right].box, p)};
    if (far.distance < near.distance) std::swap(near, far);
    stack[top++] = far;
    stack[top++] = near;
  }
}

double union_node::smooth_at(const dvec3& p, double low, double high, near_values& values) const {
  double least = high;
  // what is farther than the blend from the least one does not matter
  for_near(
      p,
      [&](const sdf_node& o) {
        const double v = operand_at(o, p, low, least + blend);
        if (!(v < least + blend)) return;
        values.insert({v, &o}, blend);
        least = std::min(least, v);
      },
      [&] { return least + blend; });
  // those that were left out above `high` cannot bring it below
  return values.empty() ? high : std::min(values.fold(blend), high);
}

double union_node::at(const dvec3& p, double low, double high) const {
  if (blend > 0) {
    near_values values;
    return smooth_at(p, low, high, values);
  }
  double least = high;
  for_near(
      p, [&](const sdf_node& o) { least = std::min(least, operand_at(o, p, low, least)); },
      [&] { return least; });
  return least;
}

dvec3 union_node::gradient(const dvec3& p) const {
  if (blend > 0) {
    near_values values;
    smooth_at(p, -unbounded, unbounded, values);
    return values.gradient(p, blend);
  }
  const sdf_node* nearest = nullptr;
  double least = unbounded;
  for_near(
      p,
      [&](const sdf_node& o) {
        const double v = operand_at(o, p, -unbounded, least);
        if (v < least || nearest == nullptr) nearest = &o;
        least = std::min(least, v);
      },
      [&] { return least; });
  return nearest != nullptr ? nearest->gradient(p) : dvec3{0, 0, 0};
}

struct complement_node final : sdf_node {
  node_ptr of;
  explicit complement_node(node_ptr o) : of(std::move(o)) {
    about = {of->about.exact_inside, of->about.exact_outside, 1, infinite_box};
    set_depth(*this, of->depth);
  }
  double at(const dvec3& p, double low, double high) const override {
    return -of->at(p, -high, -low);
  }
  dvec3 gradient(const dvec3& p) const override { return -of->gradient(p); }
};

// An intersection is the complement of the complements' union, but for its box.
struct intersection_node final : sdf_node {
  std::vector<node_ptr> operands;
  double blend;

  intersection_node(std::vector<node_ptr>&& solids, double b)
      : operands(std::move(solids)), blend(b) {
    about.bounds = infinite_box;
    about.exact_outside = operands.size() == 1 && operands[0]->about.exact_outside;
    int depth_below = 0;
    for (const node_ptr& o : operands) {
      about.exact_inside = about.exact_inside && o->about.exact_inside && blend == 0;
      about.bounds = intersect(about.bounds, o->about.bounds);
      depth_below = std::max(depth_below, o->depth);
    }
    if (is_empty(about.bounds)) about.bounds = {};
    set_depth(*this, depth_below);
  }
  double at(const dvec3& p, double low, double high) const override {
    if (blend > 0) {
      near_values values;
      return smooth_at(p, low, high, values);
    }
    double most = low;
    for (const node_ptr& o : operands) {
      most = std::max(most, o->at(p, most, high));
      if (most >= high) break;
    }
    return most;
  }
  dvec3 gradient(const dvec3& p) const override {
    if (blend > 0) {
      near_values values;
      smooth_at(p, -unbounded, unbounded, values);
      return values.gradient(p, blend);
    }
    const sdf_node* largest = operands[0].get();
    double most = -unbounded;
    for (const node_ptr& o : operands) {
      const double v = o->at(p, most, unbounded);
      if (v > most) largest = o.get();
      most = std::max(most, v);
    }
    return largest->gradient(p);
  }

 private:
  // In negated values, so that it is a minimum.
  double smooth_at(const dvec3& p, double low, double high, near_values& values) const {
    double least = -low;
    for (const node_ptr& o : operands) {
      const double v = -o->at(p, -(least + blend), high);
      if (!(v < least + blend)) continue;
      values.insert({v, o.get()}, blend);
      least = std::min(least, v);
    }
    return values.empty() ? low : std::max(-values.fold(blend), low);
  }
};

struct offset_node final : sdf_node {
  node_ptr of;
  double by;
  offset_node(node_ptr o, double r) : of(std::move(o)), by(r) {
    about = {of->about.exact_outside && by >= 0, of->about.exact_inside && by <= 0, 1,
             grow(of->about.bounds, std::max(by, 0.0))};
    set_depth(*this, of->depth);
  }
  double at(const dvec3& p, double low, double high) const override {
    return of->at(p, low + by, high + by) - by;
  }
  dvec3 gradient(const dvec3& p) const override { return of->gradient(p); }
};

struct transform_node final : sdf_node {
  node_ptr of;
  glm::dmat3 to_local, to_world;
  dvec3 origin;
  double scale;  // the least that a length in local space becomes

  transform_node(const glm::dmat4x3& frame, node_ptr o);
  dvec3 local(const dvec3& p) const { return to_local * (p - origin); }
  double at(const dvec3& p, double low, double high) const override {
    return scale * of->at(local(p), low / scale, high / scale);
  }
  dvec3 gradient(const dvec3& p) const override {
    // of a function of to_local (p - o): its transpose
    const dvec3 g = of->gradient(local(p)) * to_local;
    const double l = glm::length(g);
    return l > 0 ? g / l : g;
  }
};

// The least singular value of a matrix, as the square root of the least eigenvalue of
// its Gram matrix, and the largest.
std::pair<double, double> singular_range(const glm::dmat3& m) {
  glm::dmat3 a = glm::transpose(m) * m;
  for (int sweep = 0; sweep < 50; ++sweep) {  // Jacobi's rotations
    double off = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = i + 1; j < 3; ++j) {
        off = std::max(off, std::abs(a[i][j]) / std::sqrt(a[i][i] * a[j][j]));
        if (a[i][j] == 0) continue;
        const double theta = (a[j][j] - a[i][i]) / (2 * a[i][j]);
        const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::hypot(theta, 1.0));
        const double c = 1 / std::hypot(t, 1.0), s = t * c;
        glm::dmat3 r(1.0);
        r[i][i] = r[j][j] = c;
        r[j][i] = s;
        r[i][j] = -s;
        a = glm::transpose(r) * a * r;
      }
    }
    if (off < 1e-15) break;
  }
  const double low = std::min({a[0][0], a[1][1], a[2][2]});
  const double high = std::max({a[0][0], a[1][1], a[2][2]});
  return {std::sqrt(std::max(low, 0.0)), std::sqrt(high)};
}

transform_node::transform_node(const glm::dmat4x3& frame, node_ptr o) : of(std::move(o)) {
  to_world = glm::dmat3(frame[0], frame[1], frame[2]);
  origin = frame[3];
  const auto [low, high] = singular_range(to_world);
  if (!(low > 1e-12 * high)) {
    throw std::invalid_argument("transform: the axes of the frame lie in a plane");
  }
  to_local = glm::inverse(to_world);
  const bool uniform = high - low < 1e-12 * high;
  scale = uniform ? std::cbrt(std::abs(glm::determinant(to_world))) : low * (1 - 1e-12);
  about.exact_outside = of->about.exact_outside && uniform;
  about.exact_inside = of->about.exact_inside && uniform;
  const dbox3& b = of->about.bounds;
  if (is_empty(b)) {
    about.bounds = {};
  } else if (!is_finite(b)) {
    about.bounds = infinite_box;
  } else {
    const dvec3 center = origin + to_world * ((b.min + b.max) / 2.0);
    const dvec3 half = (b.max - b.min) / 2.0;
    dvec3 reach{0};
    for (int a = 0; a < 3; ++a) reach += glm::abs(to_world[a]) * half[a];
    about.bounds = {center - reach, center + reach};
  }
  set_depth(*this, of->depth);
}

std::vector<node_ptr> nodes_of(std::span<const sdf> solids, const char* what) {
  if (solids.empty()) throw std::invalid_argument(std::string(what) + ": needs a solid or more");
  std::vector<node_ptr> result;
  for (const sdf& s : solids) result.push_back(s.shared());
  return result;
}

std::vector<node_ptr> first_and_complements(std::span<const sdf> solids, const char* what) {
  std::vector<node_ptr> result = nodes_of(solids, what);
  for (std::size_t i = 1; i < result.size(); ++i) {
    result[i] = std::make_shared<complement_node>(result[i]);
  }
  return result;
}

// Operands of a union of unions are operands of one, so that one tree holds all.
std::vector<node_ptr> flattened(std::vector<node_ptr>&& solids) {
  std::vector<node_ptr> result;
  for (node_ptr& s : solids) {
    const auto* u = dynamic_cast<const union_node*>(s.get());
    if (u != nullptr && u->blend == 0) {
      result.insert(result.end(), u->operands.begin(), u->operands.end());
    } else {
      result.push_back(std::move(s));
    }
  }
  return result;
}

}  // namespace

sdf sdf_union(std::span<const sdf> solids) {
  auto operands = flattened(nodes_of(solids, "union"));
  // an empty solid adds nothing, and its box holds nothing
  std::erase_if(operands, [](const node_ptr& o) { return is_empty(o->about.bounds); });
  if (operands.empty()) return sdf_empty();
  if (operands.size() == 1) return sdf(operands[0]);
  return sdf(std::make_shared<union_node>(std::move(operands), 0.0));
}
sdf sdf_smooth_union(std::span<const sdf> solids, double blend) {
  check_positive(blend, "smooth union: blend");
  auto operands = nodes_of(solids, "smooth union");
  std::erase_if(operands, [](const node_ptr& o) { return is_empty(o->about.bounds); });
  if (operands.empty()) return sdf_empty();
  if (operands.size() == 1) return sdf(operands[0]);
  return sdf(std::make_shared<union_node>(std::move(operands), blend));
}
sdf sdf_intersection(std::span<const sdf> solids) {
  if (solids.size() == 1) return solids[0];
  return sdf(std::make_shared<intersection_node>(nodes_of(solids, "intersection"), 0.0));
}
sdf sdf_smooth_intersection(std::span<const sdf> solids, double blend) {
  check_positive(blend, "smooth intersection: blend");
  if (solids.size() == 1) return solids[0];
  return sdf(std::make_shared<intersection_node>(nodes_of(solids, "smooth intersection"), blend));
}
sdf sdf_difference(std::span<const sdf> solids) {
  if (solids.size() == 1) return solids[0];
  return sdf(std::make_shared<intersection_node>(first_and_complements(solids, "difference"), 0.0));
}
sdf sdf_smooth_difference(std::span<const sdf> solids, double blend) {
  check_positive(blend, "smooth difference: blend");
  if (solids.size() == 1) return solids[0];
  return sdf(std::make_shared<intersection_node>(first_and_complements(solids, "smooth difference"),
                                                 blend));
}
sdf sdf_transform(const glm::dmat4x3& frame, const sdf& of) {
  for (int c = 0; c < 4; ++c) check_finite(frame[c], "transform: frame");
  return sdf(std::make_shared<transform_node>(frame, of.shared()));
}
sdf sdf_offset(const sdf& of, double by) {
  check_finite(by, "offset: by");
  return sdf(std::make_shared<offset_node>(of.shared(), by));
}
sdf sdf_complement(const sdf& of) { return sdf(std::make_shared<complement_node>(of.shared())); }

}  // namespace wisp
