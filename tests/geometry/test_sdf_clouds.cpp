#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/geometry/sdf.h"

// Values against the distance of the nearest of many points of the surface, which come
// from parametrisations that know nothing of distances.

using namespace wisp;

namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr std::size_t cloud_size = 4000;
constexpr int queries = 200;
#else
constexpr std::size_t cloud_size = 40000;
constexpr int queries = 600;
#endif
constexpr double tau = 6.283185307179586;

double uniform(rng_state& rng, double low, double high) { return low + (high - low) * rand1d(rng); }
dvec3 random_point(rng_state& rng, double size) {
  const double x = uniform(rng, -size, size), y = uniform(rng, -size, size);
  return {x, y, uniform(rng, -size, size)};
}
dvec3 on_sphere(rng_state& rng) {
  const double z = uniform(rng, -1, 1), a = uniform(rng, 0, tau), r = std::sqrt(1 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

using sampler = std::function<dvec3(rng_state&)>;
struct specimen {
  std::string name;
  sdf solid;
  sampler sample;
  double gap;  // what the cloud leaves between its points, at most
};

// A cone between heights 0 and h along x, then moved to a with its axis along n.
dvec3 on_cone(rng_state& rng, const dvec3& a, const dvec3& b, double ra, double rb) {
  const dvec3 d = b - a, n = glm::normalize(d);
  const dvec3 u = glm::normalize(glm::cross(n, dvec3{0.3, -0.5, 0.8})), v = glm::cross(n, u);
  const double angle = uniform(rng, 0, tau), part = rand1d(rng);
  double r, t;
  if (part < 0.2) {
    r = ra * std::sqrt(rand1d(rng)), t = 0;
  } else if (part < 0.4) {
    r = rb * std::sqrt(rand1d(rng)), t = 1;
  } else {
    t = rand1d(rng), r = ra + t * (rb - ra);
  }
  return a + t * d + r * (std::cos(angle) * u + std::sin(angle) * v);
}

dvec3 on_box(rng_state& rng, const dvec3& half) {
  dvec3 p = random_point(rng, 1) * half;
  const int axis = static_cast<int>(3 * rand1d(rng));
  p[axis] = p[axis] < 0 ? -half[axis] : half[axis];
  return p;
}

std::vector<specimen> specimens() {
  const dvec3 c = {0.1, -0.2, 0.15}, half = {0.5, 0.3, 0.2};
  const dvec3 a = {-0.4, -0.3, 0.1}, b = {0.5, 0.2, -0.2};
  const dvec3 n = glm::normalize(dvec3{1, 2, -0.5});
  const dvec3 u = glm::normalize(glm::cross(n, dvec3{0, 0, 1})), w = glm::cross(n, u);
  std::vector<specimen> s;
  s.push_back({"sphere", sdf_sphere(c, 0.6),
               [=](rng_state& rng) { return c + 0.6 * on_sphere(rng); }, 0.08});
  s.push_back(
      {"box", sdf_box(c, half), [=](rng_state& rng) { return c + on_box(rng, half); }, 0.08});
  s.push_back({"rounded box", sdf_rounded_box(c, half, 0.15),
               [=](rng_state& rng) {
                 // the support of its normal and a point of the face of that
                 const dvec3 m = on_sphere(rng);
                 dvec3 q = glm::sign(m) * (half - 0.15);
                 const int axis = static_cast<int>(4 * rand1d(rng));
                 if (axis == 3) return c + q + 0.15 * m;
                 const int other = (axis + 1) % 3, third = (axis + 2) % 3;
                 q[other] *= uniform(rng, -1, 1);
                 dvec3 flat = {0, 0, 0};
                 if (rand1d(rng) < 0.7) {
                   q[third] *= uniform(rng, -1, 1);
                   flat[axis] = m[axis] < 0 ? -1 : 1;
                 } else {
                   const double angle = uniform(rng, 0, tau / 4);
                   flat[axis] = std::copysign(std::cos(angle), m[axis]);
                   flat[third] = std::copysign(std::sin(angle), m[third]);
                 }
                 return c + q + 0.15 * flat;
               },
               0.1});
  for (const double minor : {0.2, 0.5}) {
    s.push_back({"torus", sdf_torus(c, n, 0.5, minor),
                 [=](rng_state& rng) {
                   const double x = uniform(rng, 0, tau), y = uniform(rng, 0, tau);
                   const dvec3 out = std::cos(x) * u + std::sin(x) * w;
                   return c + (0.5 + minor * std::cos(y)) * out + minor * std::sin(y) * n;
                 },
                 0.12});
  }
  s.push_back({"capsule", sdf_capsule(a, b, 0.25),
               [=](rng_state& rng) {
                 const dvec3 m = on_sphere(rng), d = glm::normalize(b - a);
                 if (rand1d(rng) < 0.5) return (glm::dot(m, d) < 0 ? a : b) + 0.25 * m;
                 const dvec3 side = glm::normalize(m - glm::dot(m, d) * d);
                 return a + rand1d(rng) * (b - a) + 0.25 * side;
               },
               0.08});
  s.push_back({"cylinder", sdf_cylinder(a, b, 0.3),
               [=](rng_state& rng) { return on_cone(rng, a, b, 0.3, 0.3); }, 0.08});
  s.push_back({"cone", sdf_cone(a, b, 0.1, 0.5),
               [=](rng_state& rng) { return on_cone(rng, a, b, 0.1, 0.5); }, 0.1});
  s.push_back({"flat cone", sdf_cone(a, a + 0.1 * (b - a), 0.1, 0.9),
               [=](rng_state& rng) { return on_cone(rng, a, a + 0.1 * (b - a), 0.1, 0.9); }, 0.12});
  s.push_back({"pointed cone", sdf_cone(a, b, 0.4, 0),
               [=](rng_state& rng) { return on_cone(rng, a, b, 0.4, 0); }, 0.1});
  s.push_back(
      {"plane", sdf_plane(c, n),
       [=](rng_state& rng) { return c + uniform(rng, -4, 4) * u + uniform(rng, -4, 4) * w; }, 0.2});
  for (const dvec3& e : {dvec3{0.6, 0.3, 0.2}, dvec3{0.2, 0.2, 0.7}, dvec3{0.05, 0.6, 0.3}}) {
    s.push_back({"ellipsoid", sdf_ellipsoid(c, e),
                 [=](rng_state& rng) { return c + e * on_sphere(rng); }, 0.12});
  }
  return s;
}

double nearest(const std::vector<dvec3>& cloud, const dvec3& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const dvec3& q : cloud) {
    const dvec3 d = q - p;
    least = std::min(least, glm::dot(d, d));
  }
  return std::sqrt(least);
}

// Values are nowhere above the distance of the cloud, and where they should be exact
// not far below it.
void check_cloud(const std::string& name, const sdf& solid, const std::vector<dvec3>& cloud,
                 double gap, double rounding) {
  CAPTURE(name);
  const sdf_properties about = properties(solid);
  rng_state rng = make_rng(91);
  int above = 0, below = 0, off = 0, exact = 0;
  for (const dvec3& q : cloud) {
    off += !(std::abs(signed_distance(solid, q)) <= rounding);
    off += !(distance(about.bounds, q) <= rounding);
  }
  for (int i = 0; i < queries; ++i) {
    dvec3 p = random_point(rng, i % 4 == 0 ? 2.5 : 1);
    if (i % 4 == 1) p = cloud[static_cast<std::size_t>(i)] + random_point(rng, 0.05);
    const double v = signed_distance(solid, p), d = nearest(cloud, p);
    above += !(distance_bound(solid, p) <= d + rounding);
    if (v > 0 ? about.exact_outside : about.exact_inside) {
      ++exact;
      below += !(std::abs(v) >= d - gap);
      // near the surface and far from it the gap costs less
      if (std::abs(v) > 0.5) below += !(std::abs(v) >= d - 0.5 * gap);
    }
  }
  CHECK(off == 0);
  CHECK(above == 0);
  CHECK(below == 0);
  if (about.exact_outside) CHECK(exact > queries / 3);
}

std::vector<dvec3> cloud_of(const sampler& sample, std::size_t count, unsigned seed) {
  rng_state rng = make_rng(seed);
  std::vector<dvec3> cloud;
  for (std::size_t i = 0; i < count; ++i) cloud.push_back(sample(rng));
  return cloud;
}

}  // namespace

TEST_CASE("geometry: primitives are the distance of sampled surfaces") {
  for (const specimen& s : specimens()) {
    const double wide = cloud_size < 10000 ? 2 : 1;
    check_cloud(s.name, s.solid, cloud_of(s.sample, cloud_size, 5), s.gap * wide, 1e-12);
  }
}

TEST_CASE("geometry: operations are bounds of the distance of sampled surfaces") {
  const auto all = specimens();
  const std::vector<specimen> few = {all[0], all[1], all[3], all[6], all[10]};
  std::vector<sdf> solids;
  for (const specimen& s : few) solids.push_back(s.solid);
  const auto kept = [&](const std::function<bool(std::size_t, const std::vector<double>&)>& keep) {
    std::vector<dvec3> cloud;
    for (std::size_t i = 0; i < few.size(); ++i) {
      for (const dvec3& q : cloud_of(few[i].sample, cloud_size / 2, 7)) {
        std::vector<double> v;
        for (const sdf& s : solids) v.push_back(signed_distance(s, q));
        if (keep(i, v)) cloud.push_back(q);
      }
    }
    return cloud;
  };
  const auto united = kept([](std::size_t i, const std::vector<double>& v) {
    for (std::size_t j = 0; j < v.size(); ++j) {
      if (j != i && v[j] < 0) return false;
    }
    return true;
  });
  const auto met = kept([](std::size_t i, const std::vector<double>& v) {
    for (std::size_t j = 0; j < v.size(); ++j) {
      if (j != i && v[j] > 0) return false;
    }
    return true;
  });
  const auto carved = kept([](std::size_t i, const std::vector<double>& v) {
    for (std::size_t j = 0; j < v.size(); ++j) {
      if (j != i && (j == 0 ? v[j] > 0 : v[j] < 0)) return false;
    }
    return true;
  });
  REQUIRE(met.size() > cloud_size / 20);
  REQUIRE(carved.size() > cloud_size / 20);
  const double wide = cloud_size < 10000 ? 2.5 : 1;
  check_cloud("union", sdf_union(solids), united, 0.25 * wide, 1e-12);
  check_cloud("intersection", sdf_intersection(solids), met, 0.2 * wide, 1e-12);
  check_cloud("difference", sdf_difference(solids), carved, 0.25 * wide, 1e-12);
  std::vector<sdf> complements;
  for (const sdf& s : solids) complements.push_back(sdf_complement(s));
  check_cloud("complements", sdf_complement(sdf_intersection(complements)), united, 0.25 * wide,
              1e-12);
}

TEST_CASE("geometry: maps and smooth operations are bounds of the distance of their surfaces") {
  const auto all = specimens();
  const std::vector<sdf> few = {all[0].solid, all[1].solid, all[3].solid, all[6].solid};
  const glm::dmat4x3 turned = {0, 0.7, 0, -0.7, 0, 0, 0, 0, -0.7, 0.1, 0.2, -0.1};
  const glm::dmat4x3 sheared = {0.5, 0, 0.1, 0.3, 1.2, 0, 0, -0.2, 0.8, 0.1, 0.2, -0.1};
  const sdf smooth = sdf_smooth_union(few, 0.2);
  const std::vector<std::pair<std::string, sdf>> solids = {
      {"turned", sdf_transform(turned, all[1].solid)},
      {"sheared", sdf_transform(sheared, all[3].solid)},
      {"grown", sdf_offset(sdf_union(few), 0.1)},
      {"shrunk", sdf_offset(all[1].solid, -0.1)},
      {"chain", sdf_offset(sdf_transform(sheared, sdf_offset(all[1].solid, 0.05)), -0.02)},
      {"inverted", sdf_complement(sdf_transform(turned, sdf_complement(all[3].solid)))},
      {"smooth union", smooth},
      {"smooth intersection", sdf_smooth_intersection({few.data(), 3}, 0.2)},
      {"smooth difference", sdf_smooth_difference(few, 0.2)},
      {"nested", sdf_transform(sheared, smooth)},
  };
  for (const auto& [name, solid] : solids) {
    std::vector<dvec3> cloud;
    rng_state rng = make_rng(11);
    for (std::size_t i = 0; i < cloud_size / 4; ++i) {
      const auto q = project(solid, random_point(rng, 1.2));
      if (q) cloud.push_back(q->point);
    }
    CAPTURE(name);
    REQUIRE(cloud.size() > cloud_size / 5);
    check_cloud(name, solid, cloud, 0.5, 1e-8);
  }
}

TEST_CASE("geometry: gradients are those of differences") {
  auto all = specimens();
  std::vector<sdf> solids;
  for (const specimen& s : all) solids.push_back(s.solid);
  const std::vector<sdf> few = {solids[0], solids[1], solids[3], solids[6]};
  solids.push_back(sdf_union(few));
  solids.push_back(sdf_intersection({few.data(), 3}));
  solids.push_back(sdf_difference(few));
  solids.push_back(sdf_smooth_union(few, 0.2));
  solids.push_back(sdf_smooth_difference(few, 0.2));
  solids.push_back(sdf_transform({0.5, 0, 0.1, 0.3, 1.2, 0, 0, -0.2, 0.8, 0, 0, 0}, solids[3]));
  solids.push_back(sdf_complement(sdf_offset(solids[1], 0.1)));
  rng_state rng = make_rng(13);
  for (std::size_t k = 0; k < solids.size(); ++k) {
    CAPTURE(k);
    int off = 0, creases = 0;
    for (int i = 0; i < 2000; ++i) {
      const dvec3 p = random_point(rng, 1.5);
      const double h = 1e-6, v = signed_distance(solids[k], p);
      dvec3 forward, back;
      for (int a = 0; a < 3; ++a) {
        dvec3 d{0};
        d[a] = h;
        forward[a] = signed_distance(solids[k], p + d) - v;
        back[a] = v - signed_distance(solids[k], p - d);
      }
      if (glm::distance(forward, back) > 1e-4 * h) {  // a crease
        ++creases;
        continue;
      }
      const dvec3 g = gradient(solids[k], p);
      off += !(std::abs(glm::length(g) - 1) < 1e-9);
      off += !(glm::distance(g, glm::normalize(forward + back)) < 1e-4);
    }
    CHECK(off == 0);
    CHECK(creases < 100);
  }
}
