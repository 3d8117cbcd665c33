// What operations make of values: minima and maxima, and which operands can matter.

#include <stdexcept>
#include <string>
#include <utility>

#include "sdf_map.h"
#include "sdf_union.h"

namespace wisp {

union_node::union_node(std::vector<node_ptr>&& solids, double b)
    : operands(std::move(solids)), blend(b) {
  about.exact_inside = operands.size() == 1 && operands[0]->about.exact_inside;
  for (const node_ptr& o : operands) {
    about.exact_outside = about.exact_outside && o->about.exact_outside && blend == 0;
    about.bounds = merge(about.bounds, o->about.bounds);
    depth = std::max(depth, o->depth + 1);
    const auto* u = dynamic_cast<const union_node*>(o.get());
    leaves += u != nullptr ? u->leaves : 1;
  }
  if (blend > 0) {
    const double most = std::min(1.0, static_cast<double>(operands.size() - 1) / 4) * blend;
    about.bounds = grow(about.bounds, most);
  }
  const auto shallow = std::stable_partition(
      operands.begin(), operands.end(), [](const auto& o) { return o->depth >= recursion_limit; });
  const auto bounded = std::stable_partition(
      shallow, operands.end(), [](const auto& o) { return !is_finite(o->about.bounds); });
  deep = static_cast<std::size_t>(shallow - operands.begin());
  boundless = static_cast<std::size_t>(bounded - operands.begin());
  if (operands.size() > boundless) {
    tree.reserve(operands.size() - boundless);
    build(boundless, operands.size() - boundless);
    for (int a = 0; a < 3; ++a) {
      reach = std::max({reach, std::abs(tree[0].box.min[a]), std::abs(tree[0].box.max[a])});
    }
  }
}

union_node::~union_node() {
  if (depth <= recursion_limit) return;
  for (node_ptr& o : operands) release(std::move(o));
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
  for (std::size_t i = deep; i < boundless; ++i) visit(*operands[i]);
  if (tree.empty()) return;
  struct waiting {
    uint32_t node;
    double distance;
  };
  // what rounding may take from the distance of a box
  const double slack = 1e-14 * std::max({reach, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  // what p lies in the box of may be below any limit
  const auto matters = [&](double d) { return !(d > slack) || d - slack <= limit(); };
  std::array<waiting, 64> stack;  // halves: no deeper than the bits of a count
  std::size_t top = 0;
  stack[top++] = {0, distance(tree[0].box, p)};
  while (top > 0) {
    const waiting w = stack[--top];
    if (!matters(w.distance)) continue;
    const box_node& n = tree[w.node];
    for (uint32_t i = n.first; i < n.first + n.count; ++i) {
      if (n.count == 1 || matters(distance(operands[i]->about.bounds, p))) visit(*operands[i]);
    }
    if (n.count > 0) continue;
    waiting near = {w.node + 1, distance(tree[w.node + 1].box, p)};
    waiting far = {n.right, distance(tree[n.right].box, p)};
    if (far.distance < near.distance) std::swap(near, far);
    stack[top++] = far;
    stack[top++] = near;
  }
}

double union_node::collect(const dvec3& p, double low, double high, near_values& values) const {
  double least = high;
  // what is farther than the blend from the least one does not matter
  for_near(
      p,
      [&](const sdf_node& o) {
        const double v = o.at(p, low, least + blend);
        if (!(v < least + blend)) return;
        values.insert({v, &o}, blend);
        least = std::min(least, v);
      },
      [&] { return least + blend; });
  return least;
}

double union_node::sharp_at(const dvec3& p, double low, double high) const {
  double least = high;
  for_near(
      p,
      [&](const sdf_node& o) {
        if (least > low) least = std::min(least, o.at(p, low, least));
      },
      [&] { return least > low ? least : -unbounded; });
  return least;
}

double union_node::at(const dvec3& p, double low, double high) const {
  if (blend == 0) return sharp_at(p, low, high);
  near_values values;
  collect(p, low, high, values);
  return folded(values, high);
}

std::optional<sdf_request> union_node::resume(sdf_task& task, const double* operand,
                                              double& answer) const {
  const auto& [node, p, low, high] = task.asked;
  if (operand == nullptr) {
    if (blend > 0) {
      task.near = std::make_shared<near_values>();
      task.best = collect(p, low, high, *task.near);
    } else {
      task.best = sharp_at(p, low, high);
    }
  } else if (*operand < task.best + blend) {
    if (blend > 0) task.near->insert({*operand, operands[task.next - 1].get()}, blend);
    task.best = std::min(task.best, *operand);
  }
  while (task.next < deep) {
    const sdf_node& o = *operands[task.next++];
    const double d = distance(o.about.bounds, p);
    if (!(d > 0) || d <= task.best + blend) return sdf_request{&o, p, low, task.best + blend};
  }
  answer = blend > 0 ? folded(*task.near, high) : task.best;
  return {};
}

dvec3 union_node::gradient(const dvec3& p) const {
  if (blend > 0) {
    near_values values;
    collect(p, -unbounded, unbounded, values);
    return values.gradient(p, blend);
  }
  const sdf_node* nearest = nullptr;
  double least = unbounded;
  for_near(
      p,
      [&](const sdf_node& o) {
        const double v = o.at(p, -unbounded, least);
        if (v < least || nearest == nullptr) nearest = &o;
        least = std::min(least, v);
      },
      [&] { return least; });
  return nearest != nullptr ? nearest->gradient(p) : dvec3{0, 0, 0};
}

intersection_node::intersection_node(std::shared_ptr<const union_node> complements,
                                     const dbox3& box)
    : of(std::move(complements)) {
  // inside it is outside of the complements
  about = {of->about.exact_inside, of->about.exact_outside, 1, box};
  depth = of->depth + 1;
}

std::optional<sdf_request> intersection_node::resume(sdf_task& task, const double* operand,
                                                     double& answer) const {
  const sdf_request& asked = task.asked;
  if (operand == nullptr) return sdf_request{of.get(), asked.p, -asked.high, -asked.low};
  answer = no_less_than_box(about.bounds, asked.p, -*operand);
  return {};
}

dvec3 intersection_node::gradient(const dvec3& p) const {
  const double away = distance(about.bounds, p);
  if (away > 0 && -value(*of, p) < away) return direction_from(about.bounds, p);
  return -of->gradient(p);
}

std::shared_ptr<map_node> make_map(const node_ptr& of) {
  auto map = std::make_shared<map_node>();
  const auto* inner = dynamic_cast<const map_node*>(of.get());
  if (inner != nullptr) {
    map->of = inner->of;
    map->to_local = inner->to_local;
    map->to_world = inner->to_world;
    map->origin = inner->origin;
    map->scale = inner->scale;
    map->shift = inner->shift;
    map->uniform = inner->uniform;
  } else {
    map->of = of;
  }
  map->about = of->about;
  return map;
}

node_ptr finish_map(std::shared_ptr<map_node>&& map) {
  const bool same_points = map->to_local == glm::dmat3(1.0) && map->origin == dvec3{0};
  if (same_points && map->scale == 1 && map->shift == 0) return map->of;
  map->depth = map->of->depth + 1;
  const dbox3& b = map->of->about.bounds;
  if (map->scale < 0 || (!is_empty(b) && !is_finite(b))) {
    map->about.bounds = infinite_box;
  } else if (is_empty(b)) {
    map->about.bounds = {};
  } else {
    // {of < -shift / scale} lies no farther from the box of `of` than that
    const dvec3 center = map->origin + map->to_world * (0.5 * b.min + 0.5 * b.max);
    const dvec3 half = 0.5 * b.max - 0.5 * b.min;
    dvec3 reach{0};
    for (int a = 0; a < 3; ++a) reach += glm::abs(map->to_world[a]) * half[a];
    const double out = std::max(-map->shift / map->scale, 0.0) * map->longest;
    map->about.bounds = {center - reach - out, center + reach + out};
  }
  return map;
}

namespace {

// How long vectors become under a map at least and at most.
std::pair<double, double> lengths(const glm::dmat3& m) {
  double size = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) size = std::max(size, std::abs(m[i][j]));
  }
  if (!(size > 0)) return {0, 0};
  const auto [low, high] = singular_range(m / size);
  return {low * size, high * size};
}

void set_longest(map_node& map) {
  // |scale| where distances are preserved, but for rounding
  map.longest = map.uniform ? std::abs(map.scale) : lengths(map.to_world).second;
}

node_ptr complement_of(const node_ptr& of) {
  auto map = make_map(of);
  std::swap(map->about.exact_inside, map->about.exact_outside);
  map->scale = -map->scale;
  map->shift = -map->shift;
  set_longest(*map);
  return finish_map(std::move(map));
}

std::vector<node_ptr> nodes_of(std::span<const sdf> solids, const char* what) {
  if (solids.empty()) throw std::invalid_argument(std::string(what) + ": needs a solid or more");
  std::vector<node_ptr> result;
  for (const sdf& s : solids) result.push_back(s.shared());
  return result;
}

const union_node* sharp_union(const node_ptr& node) {
  const auto* u = dynamic_cast<const union_node*>(node.get());
  return u != nullptr && u->blend == 0 ? u : nullptr;
}

void add_leaves(const node_ptr& node, std::vector<node_ptr>& to) {
  const union_node* u = sharp_union(node);
  if (u == nullptr) return to.push_back(node);
  for (const node_ptr& o : u->operands) add_leaves(o, to);
}

// The operands of a union of unions. Small unions dissolve in it. Large ones stay, so
// that adding solids one by one does not build a tree over all of them each time; but
// each is more than twice as large as those before it together, so that there are few
// (Bentley and Saxe, Decomposable searching problems, 1980).
std::vector<node_ptr> flattened(std::vector<node_ptr>&& solids) {
  constexpr std::size_t small = 64;
  std::vector<node_ptr> loose, large;
  const auto add = [&](const node_ptr& s) {
    const union_node* u = sharp_union(s);
    if (u != nullptr && u->leaves > small) {
      large.push_back(s);
    } else {
      add_leaves(s, loose);
    }
  };
  for (const node_ptr& s : solids) {
    const union_node* u = sharp_union(s);
    if (u != nullptr && u->leaves > u->operands.size()) {
      for (const node_ptr& o : u->operands) add(o);
    } else {
      add(s);
    }
  }
  const auto leaves = [](const node_ptr& o) { return sharp_union(o)->leaves; };
  std::stable_sort(large.begin(), large.end(),
                   [&](const node_ptr& a, const node_ptr& b) { return leaves(a) < leaves(b); });
  std::vector<node_ptr> result;
  for (node_ptr& u : large) {
    if (2 * loose.size() >= leaves(u)) {
      add_leaves(u, loose);
    } else if (loose.size() > small) {
      result.push_back(std::make_shared<union_node>(std::move(loose), 0.0));
      loose.clear();
      result.push_back(std::move(u));
    } else {
      result.push_back(std::move(u));
    }
  }
  if (result.empty()) return loose;
  result.insert(result.end(), loose.begin(), loose.end());
  return result;
}

// An empty solid adds nothing, and its box holds nothing.
void erase_empty(std::vector<node_ptr>& solids) {
  std::erase_if(solids, [](const node_ptr& o) { return is_empty(o->about.bounds); });
}

sdf unite(std::vector<node_ptr>&& solids, double blend) {
  erase_empty(solids);
  if (solids.empty()) return sdf_empty();
  if (blend == 0) solids = flattened(std::move(solids));
  if (solids.size() == 1) return sdf(solids[0]);
  return sdf(std::make_shared<union_node>(std::move(solids), blend));
}

// The solid in `box` that is in none of `complements`.
sdf outside_of(std::vector<node_ptr>&& complements, const dbox3& box, double blend) {
  if (is_empty(box)) return sdf_empty();
  erase_empty(complements);
  if (blend == 0) complements = flattened(std::move(complements));
  if (complements.size() == 1 && sharp_union(complements[0]) == nullptr) {
    return sdf(complement_of(complements[0]));
  }
  // a union that is the only one left is what is looked for
  auto made = complements.size() == 1
                  ? std::dynamic_pointer_cast<const union_node>(complements[0])
                  : std::make_shared<const union_node>(std::move(complements), blend);
  return sdf(std::make_shared<intersection_node>(std::move(made), box));
}

// The complement of a node as operands of a union.
void add_complement(const node_ptr& node, double blend, std::vector<node_ptr>& to) {
  const auto* i = dynamic_cast<const intersection_node*>(node.get());
  if (i != nullptr && i->of->blend == 0 && blend == 0) {
    to.push_back(i->of);
  } else {
    to.push_back(complement_of(node));
  }
}

sdf intersect(std::span<const sdf> solids, const char* what, double blend) {
  const auto nodes = nodes_of(solids, what);
  if (nodes.size() == 1) return solids[0];
  dbox3 box = infinite_box;
  std::vector<node_ptr> complements;
  for (const node_ptr& n : nodes) {
    box = intersect(box, n->about.bounds);
    add_complement(n, blend, complements);
  }
  return outside_of(std::move(complements), box, blend);
}

sdf subtract(std::span<const sdf> solids, const char* what, double blend) {
  const auto nodes = nodes_of(solids, what);
  if (nodes.size() == 1) return solids[0];
  std::vector<node_ptr> complements;
  add_complement(nodes[0], blend, complements);
  complements.insert(complements.end(), nodes.begin() + 1, nodes.end());
  return outside_of(std::move(complements), nodes[0]->about.bounds, blend);
}

}  // namespace

sdf sdf_union(std::span<const sdf> solids) { return unite(nodes_of(solids, "union"), 0); }
sdf sdf_smooth_union(std::span<const sdf> solids, double blend) {
  check_positive(blend, "smooth union: blend");
  return unite(nodes_of(solids, "smooth union"), blend);
}
sdf sdf_intersection(std::span<const sdf> solids) { return intersect(solids, "intersection", 0); }
sdf sdf_smooth_intersection(std::span<const sdf> solids, double blend) {
  check_positive(blend, "smooth intersection: blend");
  return intersect(solids, "smooth intersection", blend);
}
sdf sdf_difference(std::span<const sdf> solids) { return subtract(solids, "difference", 0); }
sdf sdf_smooth_difference(std::span<const sdf> solids, double blend) {
  check_positive(blend, "smooth difference: blend");
  return subtract(solids, "smooth difference", blend);
}

sdf sdf_transform(const glm::dmat4x3& frame, const sdf& of) {
  for (int c = 0; c < 4; ++c) check_finite(frame[c], "transform: frame");
  const glm::dmat3 m(frame[0], frame[1], frame[2]);
  const auto [low, high] = lengths(m);
  if (!(low > 1e-12 * high)) {
    throw std::invalid_argument("transform: the axes of the frame lie in a plane");
  }
  const bool uniform = high - low < 1e-12 * high;
  // no longer than the least that a length becomes, but for the rounding of singular values
  const double scale = uniform ? 0.5 * (low + high) : low - 1e-15 * high;
  auto map = make_map(of.shared());
  map->uniform = map->uniform && uniform;
  map->about.exact_outside = map->about.exact_outside && uniform;
  map->about.exact_inside = map->about.exact_inside && uniform;
  map->scale *= scale;
  map->shift *= scale;
  map->origin = frame[3] + m * map->origin;
  map->to_world = m * map->to_world;
  // scaled, as the determinant of small axes may vanish
  map->to_local = map->to_local * (glm::inverse(m / high) / high);
  set_longest(*map);
  return sdf(finish_map(std::move(map)));
}

sdf sdf_offset(const sdf& of, double by) {
  check_finite(by, "offset: by");
  auto map = make_map(of.shared());
  map->about.exact_outside = map->about.exact_outside && by >= 0;
  map->about.exact_inside = map->about.exact_inside && by <= 0;
  map->shift -= by;
  set_longest(*map);
  return sdf(finish_map(std::move(map)));
}

sdf sdf_complement(const sdf& of) { return sdf(complement_of(of.shared())); }

}  // namespace wisp
