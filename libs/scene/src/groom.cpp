// Strands on a mesh: area-weighted roots, clumps around guides (Ward et al., A
// Survey on Hair Modeling, IEEE TVCG 13(2), 2007, sections 3 and 4), a simple
// fall under gravity over the surface, and helices for curls.

#include "wisp/scene/groom.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <unordered_map>

#include "groom_strand.h"
#include "groom_surface.h"
#include "wisp/core/parallel.h"
#include "wisp/core/rng.h"

namespace wisp {

namespace {

void require(bool good, const char* what, const char* should) {
  if (!good) throw std::invalid_argument(fmt::format("groom: {} should be {}", what, should));
}

void check(const groom_params& p) {
  auto in_unit = [](float x) { return x >= 0 && x <= 1; };
  auto size = [](float x) { return x >= 0 && std::isfinite(x); };
  require(p.strands >= 1, "strands", "at least 1");
  require(p.points >= 4 && p.points <= 4096, "points", "from 4 to 4096");
  require(int64_t{p.strands} * p.points <= 0xffffffffll, "strands times points", "below 2^32");
  require(p.length.x > 0 && p.length.y >= p.length.x && std::isfinite(p.length.y), "length",
          "[shortest, longest], both above 0");
  require(size(p.radius.x) && size(p.radius.y), "radius", "[root, tip], neither below 0");
  require(p.taper > 0 && std::isfinite(p.taper), "taper", "above 0");
  require(size(p.curl_radius), "curl_radius", "at least 0");
  require(size(p.curl_turns), "curl_turns", "at least 0");
  require(p.curl_radius == 0 || 2.5f * p.curl_turns <= static_cast<float>(p.points - 3),
          "curl_turns", "at most (points - 3) / 2.5; with fewer points a turn has no shape");
  require(in_unit(p.curl_randomness), "curl_randomness", "in [0, 1]");
  require(in_unit(p.clump), "clump", "in [0, 1]");
  require(size(p.clump_size), "clump_size", "at least 0");
  require(size(p.gravity), "gravity", "at least 0");
  require(is_finite(p.down) && (p.gravity == 0 || p.down != vec3{0, 0, 0}), "down",
          "a direction other than zero");
  require(size(p.noise), "noise", "at least 0");
  require(size(p.frizz), "frizz", "at least 0");
  require(in_unit(p.lift), "lift", "in [0, 1]");
  require(is_finite(p.comb), "comb", "finite");
  require(size(p.volume), "volume", "at least 0");
  require(size(p.region_fade), "region_fade", "at least 0");
  auto plane = [](const std::optional<vec4>& v) {
    return !v || (is_finite(vec3(*v)) && std::isfinite(v->w) && vec3(*v) != vec3{0, 0, 0});
  };
  require(plane(p.part), "part", "a plane [x, y, z, w] with a normal other than zero");
  require(plane(p.density_axis), "density_axis", "[x, y, z, cosine] with an axis other than zero");
  require(plane(p.region_plane), "region_plane",
          "a plane [x, y, z, w] with a normal other than zero");
}

struct clumping {
  std::vector<uint32_t> guides = {};    // strands that are guides
  std::vector<uint32_t> guide_of = {};  // for each strand, an index into guides
};

// A root becomes a guide unless a guide on its side of the parting is nearer
// than `size`, so that a root's own cell and its neighbours always hold
// its guide (dart throwing; Cook, Stochastic Sampling, 1986).
clumping thin_guides(const std::vector<groom_root>& roots, const groom_params& params, float size) {
  struct cell_hash {
    std::size_t operator()(const ivec3& c) const {
      uint32_t h = hash32(static_cast<uint32_t>(c.x));
      h = hash_combine(h, static_cast<uint32_t>(c.y));
      return hash_combine(h, static_cast<uint32_t>(c.z));
    }
  };
  std::unordered_map<ivec3, std::vector<uint32_t>, cell_hash> cells;
  vec3 low = roots[0].position;
  for (const groom_root& r : roots) low = glm::min(low, r.position);
  auto cell_of = [&](const vec3& p) {
    return ivec3((p - low) / size);  // p >= low: no floor is needed
  };
  auto side = [&](const vec3& p) {
    return params.part && glm::dot(vec3(*params.part), p) < params.part->w;
  };
  clumping result;
  auto nearest = [&](const vec3& p) {
    const ivec3 center = cell_of(p);
    uint32_t best = 0xffffffffu;
    float best_d2 = size * size;
    for (int i = 0; i < 27; ++i) {
      const auto cell = cells.find(center + ivec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
      if (cell == cells.end()) continue;
      for (uint32_t g : cell->second) {
        const vec3 q = roots[result.guides[g]].position;
        const float d2 = glm::dot(p - q, p - q);
        if (d2 < best_d2 && side(p) == side(q)) {
          best = g;
          best_d2 = d2;
        }
      }
    }
    return best;
  };
  for (uint32_t k = 0; k < roots.size(); ++k) {
    if (nearest(roots[k].position) != 0xffffffffu) continue;
    cells[cell_of(roots[k].position)].push_back(static_cast<uint32_t>(result.guides.size()));
    result.guides.push_back(k);
  }
  result.guide_of.resize(roots.size());
  for (uint32_t k = 0; k < roots.size(); ++k) {
    const uint32_t g = nearest(roots[k].position);
    // a guide is 0 from itself, which is nearer than any size > 0
    result.guide_of[k] = g;
  }
  return result;
}

clumping make_clumps(const std::vector<groom_root>& roots, const groom_params& params) {
  vec3 low = roots[0].position, high = low;
  for (const groom_root& r : roots) {
    low = glm::min(low, r.position);
    high = glm::max(high, r.position);
  }
  const float extent = std::max(max_component(high - low), 1e-20f);
  // cells are counted in int
  const float smallest = extent * 1e-6f;
  if (params.clump_size > 0) {
    return thin_guides(roots, params, std::max(params.clump_size, smallest));
  }
  const float wanted = std::max(static_cast<float>(roots.size()) / 40, 1.0f);
  float size = extent / std::sqrt(wanted);
  clumping clumps = thin_guides(roots, params, size);
  for (int i = 0; i < 4; ++i) {  // the count goes with 1 / size^2
    const float ratio = static_cast<float>(clumps.guides.size()) / wanted;
    if (ratio > 0.9f && ratio < 1.1f) break;
    size = std::max(size * std::sqrt(ratio), smallest);
    clumps = thin_guides(roots, params, size);
  }
  return clumps;
}

strand_traits make_traits(const groom_root& root, uint32_t strand, uint32_t guide,
                          const groom_params& params) {
  // Streams apart from those of the roots.
  rng_state own = make_rng(params.seed ^ 0x5bd1e995u, strand);
  rng_state shared = make_rng(params.seed ^ 0x2545f491u, guide);
  const bool clumped = params.clump > 0;
  auto signed_unit = [](rng_state& rng) { return 2 * rand1f(rng) - 1; };
  strand_traits t;
  t.root = root;
  t.clump_seed = next_uint(shared);
  t.own_seed = next_uint(own);

  const float shared_length = rand1f(shared), own_length = rand1f(own);
  const float rel = clumped ? 0.6f * shared_length + 0.4f * own_length : own_length;
  t.length = params.length.x + (params.length.y - params.length.x) * rel;
  t.length *= 0.4f + 0.6f * root.density;

  const float shared_layer = rand1f(shared), own_layer = rand1f(own);
  t.layer = 0.15f + 0.85f * (clumped ? 0.6f * shared_layer + 0.4f * own_layer : own_layer);

  // A few strands stray from their clump.
  const float stray = rand1f(own);
  t.clump = params.clump * (stray < 0.04f ? 0.3f : 1 - 0.25f * rand1f(own));
  t.frizz = params.frizz * std::min(-std::log(1 - stray) + 0.2f, 4.0f);

  const float random = params.curl_randomness;
  const float shared_phase = rand1f(shared), own_phase = signed_unit(own);
  t.phase = pi * random * (clumped ? 2 * shared_phase - 1 + 0.4f * own_phase : own_phase);
  const float pitch = 1 + 0.25f * random * signed_unit(shared) + 0.1f * random * signed_unit(own);
  t.turns = std::min(params.curl_turns * pitch, static_cast<float>(params.points - 3) / 2.25f);
  t.curl_radius = params.curl_turns > 0
                      ? params.curl_radius * (1 + 0.4f * random * signed_unit(shared) +
                                              0.3f * random * signed_unit(own))
                      : 0.0f;
  t.jitter_angle = std::min(4 * params.noise / params.length.y, 0.25f) * rand1f(own);
  t.jitter_turn = 2 * pi * rand1f(own);
  return t;
}

}  // namespace

shape_data grow_groom(const shape_data& mesh, const groom_params& params) {
  check(params);
  if (!mesh.texcoords.empty() && mesh.texcoords.size() != mesh.positions.size()) {
    throw std::invalid_argument("groom: the mesh has not one texture coordinate for each vertex");
  }
  const groom_surface surface = make_groom_surface(mesh);
  const std::vector<groom_root> roots = place_roots(surface, mesh, params);
  const bool clumped = params.clump > 0;
  const clumping clumps = clumped ? make_clumps(roots, params) : clumping{};

  // A strand of n points is a curve of n - 3 pieces; its path is simulated in
  // smaller steps where those are long.
  const int pieces = params.points - 3;
  const int stride = std::max((20 + pieces - 1) / pieces, 1);
  const int steps = pieces * stride;
  const float guide_step = params.length.y / static_cast<float>(steps);
  const auto strands = static_cast<std::size_t>(params.strands);

  auto guide_of = [&](std::size_t k) {
    return clumped ? clumps.guides[clumps.guide_of[k]] : static_cast<uint32_t>(k);
  };
  std::vector<strand_path> guides(clumps.guides.size());
  auto grow_guide = [&](std::size_t g) {
    const uint32_t k = clumps.guides[g];
    const strand_traits traits = make_traits(roots[k], k, k, params);
    guides[g] = grow_path(surface, params, traits, params.length.y, steps);
  };
  parallel_for(guides.size(), params.threads, grow_guide, 16);

  shape_data shape;
  const auto points = static_cast<std::size_t>(params.points);
  shape.basis = curve_basis::bspline;
  shape.positions.resize(strands * points);
  shape.radius.resize(strands * points);
  if (!mesh.texcoords.empty()) shape.texcoords.resize(strands * points);
  shape.strands.resize(strands + 1);
  auto grow_strand = [&](std::size_t k) {
    const uint32_t guide = guide_of(k);
    const strand_traits traits = make_traits(roots[k], static_cast<uint32_t>(k), guide, params);
    strand_path path = grow_path(surface, params, traits, traits.length, steps);
    if (clumped) {
      path = follow_guide(surface, params, traits, path, guides[clumps.guide_of[k]], guide_step);
    }
    // One reference for the clump, so that its curls turn together, and one that
    // changes smoothly over the surface.
    const vec3 normal = roots[guide].normal;
    vec3 reference = normalize_or_zero(glm::cross(params.down, normal));
    if (reference == vec3{0, 0, 0}) reference = basis_from_z(normal)[0];
    path = add_detail(surface, params, traits, path, stride, reference);
    const std::vector<vec3> control = interpolate_bspline(path);
    for (std::size_t i = 0; i < points; ++i) {
      // control point i belongs to parameter i - 1 of the pieces
      const float s = (static_cast<float>(i) - 1) / static_cast<float>(pieces);
      const float grown = std::pow(std::clamp(s, 0.0f, 1.0f), params.taper);
      const std::size_t at = k * points + i;
      shape.positions[at] = control[i];
      shape.radius[at] = params.radius.x * (1 - grown) + params.radius.y * grown;
      if (!mesh.texcoords.empty()) shape.texcoords[at] = roots[k].texcoord;
    }
  };
  parallel_for(strands, params.threads, grow_strand, 64);
  for (std::size_t k = 0; k <= strands; ++k) shape.strands[k] = static_cast<uint32_t>(k * points);

  // Phantoms continue the radius linearly, but not below 0.
  for (std::size_t k = 0; k < strands; ++k) {
    float* r = shape.radius.data() + k * points;
    r[0] = std::max(2 * r[1] - r[2], 0.0f);
    r[points - 1] = std::max(2 * r[points - 2] - r[points - 3], 0.0f);
  }
  return shape;
}

}  // namespace wisp
