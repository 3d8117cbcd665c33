// Growing hair on meshes.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "wisp/scene/groom.h"
#include "wisp/scene/io.h"

namespace {

using namespace wisp;

// A unit square in x and z, facing up, of n^2 quads.
shape_data make_patch(int n, bool texcoords) {
  shape_data mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      const vec2 p = vec2(i, j) / static_cast<float>(n);
      mesh.positions.push_back({p.x, 0, p.y});
      if (texcoords) mesh.texcoords.push_back(p);
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i;
      mesh.quads.push_back({a, a + n + 1, a + n + 2, a + 1});
    }
  }
  return mesh;
}

// A unit sphere by longitude and latitude, with a seam of double vertices.
shape_data make_sphere(int n) {
  shape_data mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= 2 * n; ++i) {
      const float theta = pi * static_cast<float>(j) / static_cast<float>(n);
      const float phi = i == 2 * n ? 0 : pi * static_cast<float>(i) / static_cast<float>(n);
      const float s = j == 0 || j == n ? 0 : std::sin(theta);
      mesh.positions.push_back({s * std::cos(phi), std::cos(theta), -s * std::sin(phi)});
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < 2 * n; ++i) {
      const int a = j * (2 * n + 1) + i, b = a + 2 * n + 1;
      mesh.triangles.push_back({a, b, b + 1});
      mesh.triangles.push_back({a, b + 1, a + 1});
    }
  }
  return mesh;
}

// A point of a strand at parameter t in [0, 1].
vec3 eval_strand(const shape_data& hair, std::size_t k, float t) {
  const uint32_t begin = hair.strands[k];
  const uint32_t pieces = hair.strands[k + 1] - begin - 3;
  const float x = t * static_cast<float>(pieces);
  const uint32_t piece = std::min(static_cast<uint32_t>(x), pieces - 1);
  const float u = x - static_cast<float>(piece), v = 1 - u;
  const vec3* p = hair.positions.data() + begin + piece;
  return (v * v * v * p[0] + (3 * u * u * u - 6 * u * u + 4) * p[1] +
          (-3 * u * u * u + 3 * u * u + 3 * u + 1) * p[2] + u * u * u * p[3]) /
         6.0f;
}

float strand_length(const shape_data& hair, std::size_t k) {
  float length = 0;
  constexpr int n = 200;
  for (int i = 0; i < n; ++i) {
    length += glm::distance(eval_strand(hair, k, static_cast<float>(i) / n),
                            eval_strand(hair, k, static_cast<float>(i + 1) / n));
  }
  return length;
}

bool same_bits(const shape_data& a, const shape_data& b) {
  return a.strands == b.strands && a.positions == b.positions && a.radius == b.radius &&
         a.texcoords == b.texcoords;
}

groom_params busy_params() {
  groom_params p;
  p.strands = 600;
  p.points = 20;
  p.length = {0.3f, 0.5f};
  p.radius = {0.004f, 0.001f};
  p.curl_radius = 0.02f;
  p.curl_turns = 3;
  p.clump = 0.7f;
  p.gravity = 1.5f;
  p.noise = 0.02f;
  p.frizz = 0.003f;
  p.lift = 0.3f;
  p.comb = {0, 0, -0.5f};
  p.part = vec4{1, 0, 0, 0.1f};
  p.volume = 0.03f;
  p.seed = 9;
  return p;
}

}  // namespace

TEST_CASE("groom: what it makes is a valid shape") {
  for (int points : {4, 5, 7, 16, 64}) {
    CAPTURE(points);
    groom_params p = busy_params();
    p.points = points;
    if (points < 12) p.curl_turns = 0.25f;
    const shape_data hair = grow_groom(make_patch(4, true), p);
    CHECK(hair.basis == curve_basis::bspline);
    CHECK(strand_count(hair) == 600);
    REQUIRE(hair.positions.size() == 600u * static_cast<std::size_t>(points));
    CHECK(hair.strands.back() == hair.positions.size());
    CHECK(hair.radius.size() == hair.positions.size());
    CHECK(hair.texcoords.size() == hair.positions.size());
    CHECK(hair.normals.empty());
    bool good = true;
    for (std::size_t i = 0; i < hair.positions.size(); ++i) {
      good = good && is_finite(hair.positions[i]) && hair.radius[i] >= 0 &&
             hair.radius[i] <= p.radius.x * (1 + 1 / static_cast<float>(points - 3));
    }
    CHECK(good);
  }
}

TEST_CASE("groom: the same at any number of threads, another for another seed") {
  const shape_data sphere = make_sphere(24);
  groom_params p = busy_params();
  p.threads = 1;
  const shape_data one = grow_groom(sphere, p);
  p.threads = 4;
  const shape_data four = grow_groom(sphere, p);
  CHECK(same_bits(one, four));
  p.seed = 10;
  CHECK_FALSE(same_bits(one, grow_groom(sphere, p)));
}

TEST_CASE("groom: roots lie on the surface and carry its texture coordinates") {
  const groom_params p = busy_params();
  const shape_data hair = grow_groom(make_patch(3, true), p);
  for (std::size_t k = 0; k < strand_count(hair); ++k) {
    const vec3 root = eval_strand(hair, k, 0);
    CHECK(std::abs(root.y) < 1e-6f);
    CHECK(glm::distance(vec2(root.x, root.z), hair.texcoords[hair.strands[k]]) < 1e-5f);
  }
  const shape_data ball = grow_groom(make_sphere(40), p);
  for (std::size_t k = 0; k < strand_count(ball); ++k) {
    const float r = glm::length(eval_strand(ball, k, 0));
    CHECK(r <= 1 + 1e-5f);
    CHECK(r >= 0.996f);  // the faces cut below the sphere by 1 - cos^2(pi / 80)
  }
}

TEST_CASE("groom: roots are uniform over the area, whatever the faces") {
  // Three strips of very unlike faces: one of 2 triangles, one of 800 over the
  // middle, one of 2.
  shape_data mesh = make_patch(20, false);
  for (vec3& v : mesh.positions) v = {0.25f + 0.5f * v.x, 0, v.z};
  for (float x : {0.0f, 0.75f}) {
    const int a = static_cast<int>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(),
                          {{x, 0, 0}, {x, 0, 1}, {x + 0.25f, 0, 1}, {x + 0.25f, 0, 0}});
    mesh.quads.push_back({a, a + 1, a + 2, a + 3});
  }
  groom_params p;
  p.strands = 20000;
  p.points = 4;
  p.length = {0.01f, 0.01f};
  p.lift = 1;
  const shape_data hair = grow_groom(mesh, p);
  constexpr int n = 8;
  std::array<int, n* n> counts = {};
  for (std::size_t k = 0; k < strand_count(hair); ++k) {
    const vec3 root = eval_strand(hair, k, 0);
    const int i = std::clamp(static_cast<int>(root.x * n), 0, n - 1);
    const int j = std::clamp(static_cast<int>(root.z * n), 0, n - 1);
    ++counts[static_cast<std::size_t>(j * n + i)];
  }
  double chi2 = 0;
  const double expected = 20000.0 / (n * n);
  for (int c : counts) chi2 += (c - expected) * (c - expected) / expected;
  // 63 degrees of freedom: above 103.4 once in a thousand
  CHECK(chi2 < 103.4);
}

TEST_CASE("groom: straight hair has the lengths asked for") {
  groom_params p;
  p.strands = 500;
  p.length = {0.2f, 0.4f};
  for (float clump : {0.0f, 0.8f}) {
    for (float gravity : {0.0f, 2.0f}) {
      CAPTURE(clump);
      CAPTURE(gravity);
      p.clump = clump;
      p.gravity = gravity;
      p.lift = 0.7f;
      float shortest = infinity, longest = 0;
      const shape_data hair = grow_groom(make_sphere(32), p);
      for (std::size_t k = 0; k < strand_count(hair); ++k) {
        const float length = strand_length(hair, k);
        shortest = std::min(shortest, length);
        longest = std::max(longest, length);
      }
      CHECK(shortest >= 0.95f * 0.2f);
      CHECK(longest <= 1.05f * 0.4f);
      CHECK(longest - shortest > 0.1f);  // they do vary
    }
  }
}

TEST_CASE("groom: without gravity and with lift 1 a strand is straight along the normal") {
  groom_params p;
  p.strands = 50;
  p.lift = 1;
  const shape_data hair = grow_groom(make_patch(1, false), p);
  for (std::size_t k = 0; k < 50; ++k) {
    const vec3 way = eval_strand(hair, k, 1) - eval_strand(hair, k, 0);
    CHECK(glm::length(vec2(way.x, way.z)) < 1e-5f);
    CHECK(way.y == doctest::Approx(strand_length(hair, k)).epsilon(1e-4));
  }
}

TEST_CASE("groom: gravity bends strands down, more the more there is") {
  groom_params p;
  p.strands = 200;
  p.length = {0.5f, 0.5f};
  p.lift = 1;
  float before = infinity;
  for (float gravity : {0.0f, 0.3f, 1.0f, 3.0f}) {
    p.gravity = gravity;
    const shape_data hair = grow_groom(make_sphere(32), p);
    float height = 0;
    for (std::size_t k = 0; k < 200; ++k) {
      height += eval_strand(hair, k, 1).y - eval_strand(hair, k, 0).y;
    }
    CHECK(height < before - 1);
    before = height;
  }
  CHECK(before / 200 < -0.3f);
}

TEST_CASE("groom: curls have the stated radius and number of turns") {
  groom_params p;
  p.strands = 40;
  p.points = 60;
  p.length = {0.5f, 0.5f};
  p.lift = 1;
  p.curl_radius = 0.03f;
  p.curl_turns = 6;
  p.curl_randomness = 0;
  const shape_data hair = grow_groom(make_patch(1, false), p);
  for (std::size_t k = 0; k < 40; ++k) {
    const vec3 root = eval_strand(hair, k, 0);
    double turned = 0;
    vec2 last = {0, 0};
    for (int i = 0; i <= 600; ++i) {
      const float t = static_cast<float>(i) / 600;
      const vec3 p3 = eval_strand(hair, k, t) - root;
      const vec2 q = {p3.x, p3.z};
      if (t > 0.25f) CHECK(glm::length(q) == doctest::Approx(0.03f).epsilon(0.03));
      if (i > 30) turned += std::atan2(last.x * q.y - last.y * q.x, glm::dot(last, q));
      last = q;
    }
    CHECK(std::abs(turned) / (2 * pi) == doctest::Approx(6 * 0.95).epsilon(0.02));
  }
}

TEST_CASE("groom: strands stay out of a sphere") {
  const shape_data sphere = make_sphere(48);
  groom_params straight;
  straight.strands = 1500;
  straight.points = 24;
  straight.length = {0.6f, 1.2f};
  straight.gravity = 3;
  straight.lift = 0.05f;
  groom_params busy = busy_params();
  busy.strands = 1500;
  for (const groom_params& p : {straight, busy}) {
    const shape_data hair = grow_groom(sphere, p);
    float deepest = infinity;
    for (std::size_t k = 0; k < strand_count(hair); ++k) {
      for (int i = 0; i <= 100; ++i) {
        deepest = std::min(deepest, glm::length(eval_strand(hair, k, static_cast<float>(i) / 100)));
      }
    }
    CHECK(deepest > 0.995f);  // faces lie up to 0.0022 below the sphere
  }
}

TEST_CASE("groom: strands of a clump come together towards their tips") {
  groom_params p;
  p.strands = 800;
  p.length = {0.3f, 0.3f};
  p.lift = 1;
  auto spread = [&](float clump, float t) {
    p.clump = clump;
    const shape_data hair = grow_groom(make_patch(1, false), p);
    // mean distance to the nearest other strand
    double sum = 0;
    for (std::size_t a = 0; a < 800; a += 4) {
      float nearest = infinity;
      for (std::size_t b = 0; b < 800; ++b) {
        if (a == b) continue;
        nearest =
            std::min(nearest, glm::distance(eval_strand(hair, a, t), eval_strand(hair, b, t)));
      }
      sum += static_cast<double>(nearest);
    }
    return sum / 200;
  };
  CHECK(spread(0.9f, 0) == doctest::Approx(spread(0, 0)).epsilon(1e-3));
  CHECK(spread(0.9f, 1) < 0.65 * spread(0, 1));
}

TEST_CASE("groom: hair grows in its region only, thinner in its fade") {
  const shape_data sphere = make_sphere(32);
  groom_params p;
  p.strands = 4000;
  p.points = 4;
  p.length = {0.1f, 0.1f};
  p.region_min = {-infinity, -infinity, -0.5f};
  p.region_plane = vec4{0, 2, 0, 0.4f};  // y >= 0.2
  p.region_fade = 0.2f;
  p.density_axis = vec4{3, 0, 0, -0.5f};
  const shape_data hair = grow_groom(sphere, p);
  int low = 0, middle = 0;
  float shortest_low = infinity;
  for (std::size_t k = 0; k < strand_count(hair); ++k) {
    const vec3 root = eval_strand(hair, k, 0);
    CHECK(root.z >= -0.5001f);
    CHECK(root.y >= 0.1999f);
    CHECK(root.x >= -0.56f);
    // zones of a sphere of the same height have the same area
    low += root.y < 0.26f;
    middle += root.y >= 0.42f && root.y < 0.48f;
    if (root.y < 0.22f) shortest_low = std::min(shortest_low, strand_length(hair, k));
  }
  CHECK(low > 0);
  CHECK(3 * low < middle);
  CHECK(shortest_low < 0.06f);

  p.region_min = {2, 2, 2};
  CHECK_THROWS_AS(grow_groom(sphere, p), std::invalid_argument);
}

TEST_CASE("groom: a parting divides") {
  groom_params p;
  p.strands = 500;
  p.lift = 0.2f;
  p.part = vec4{1, 0, 0, 0.5f};
  const shape_data hair = grow_groom(make_patch(2, false), p);
  for (std::size_t k = 0; k < strand_count(hair); ++k) {
    const vec3 root = eval_strand(hair, k, 0), tip = eval_strand(hair, k, 1);
    CHECK((root.x < 0.5f) == (tip.x < root.x));
  }
}

TEST_CASE("groom: bad parameters are named") {
  const shape_data mesh = make_patch(1, false);
  auto complaint = [&](auto&& change) {
    groom_params p;
    change(p);
    try {
      grow_groom(mesh, p);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  using str = std::string;
  CHECK(complaint([](groom_params&) {}).empty());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(complaint([](groom_params& p) { p.strands = 0; }).find("strands") != str::npos);
  CHECK(complaint([](groom_params& p) { p.points = 3; }).find("points") != str::npos);
  CHECK(complaint([](groom_params& p) { p.length = {0.2f, 0.1f}; }).find("length") != str::npos);
  CHECK(complaint([&](groom_params& p) { p.length.y = nan; }).find("length") != str::npos);
  CHECK(complaint([](groom_params& p) { p.radius.x = -1; }).find("radius") != str::npos);
  CHECK(complaint([](groom_params& p) { p.clump = 2; }).find("clump") != str::npos);
  CHECK(complaint([&](groom_params& p) { p.gravity = nan; }).find("gravity") != str::npos);
  CHECK(complaint([](groom_params& p) { p.lift = -0.1f; }).find("lift") != str::npos);
  CHECK(complaint([](groom_params& p) {
          p.curl_radius = 1;
          p.curl_turns = 6;
        }).find("curl_turns") != str::npos);
  CHECK(complaint([](groom_params& p) { p.part = vec4{0, 0, 0, 1}; }).find("part") != str::npos);

  shape_data flat = mesh;
  for (vec3& v : flat.positions) v.z = 0;
  CHECK_THROWS_AS(grow_groom(flat, {}), std::invalid_argument);
  CHECK_THROWS_AS(grow_groom(shape_data{}, {}), std::invalid_argument);
  shape_data broken = mesh;
  broken.quads[0].x = 99;
  CHECK_THROWS_AS(grow_groom(broken, {}), std::invalid_argument);
}

TEST_CASE("groom: huge, tiny and broken meshes do no harm") {
  for (float scale : {1e-6f, 1e6f}) {
    CAPTURE(scale);
    shape_data mesh = make_sphere(16);
    for (vec3& v : mesh.positions) v *= scale;
    mesh.positions.push_back(vec3{infinity, 0, 0});
    mesh.triangles.push_back({0, 1, static_cast<int>(mesh.positions.size()) - 1});
    mesh.triangles.push_back({0, 0, 0});
    groom_params p = busy_params();
    for (float* x : {&p.length.x, &p.length.y, &p.radius.x, &p.radius.y, &p.curl_radius, &p.noise,
                     &p.frizz, &p.volume}) {
      *x *= scale;
    }
    p.part->w *= scale;
    const shape_data hair = grow_groom(mesh, p);
    bool good = true;
    for (std::size_t i = 0; i < hair.positions.size(); ++i) {
      good = good && is_finite(hair.positions[i]) && std::isfinite(hair.radius[i]);
    }
    CHECK(good);
  }
}

TEST_CASE("groom: on a scanned head") {
  const char* data = std::getenv("WISP_TEST_DATA");
  if (data == nullptr) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  warning_list warnings;
  const shape_data head = load_shape(
      std::filesystem::path(data) / "hair" / "lee-perry-smith" / "LeePerrySmith.obj", warnings);
  groom_params p;
  p.strands = 2000;
  p.points = 24;
  p.length = {3.2f, 4.6f};
  p.radius = {0.004f, 0.002f};
  p.clump = 0.6f;
  p.gravity = 2;
  p.lift = 0.2f;
  p.comb = {0, 0, -0.9f};
  p.part = vec4{1, 0, 0, 0.4f};
  p.volume = 0.3f;
  p.region_plane = vec4{0, 0.86f, -0.52f, 1.05f};
  p.region_min = {-1.75f, -3, -4};
  p.region_max = {1.75f, 9, 9};
  p.region_fade = 0.25f;
  const shape_data hair = grow_groom(head, p);
  CHECK(hair.texcoords.size() == hair.positions.size());
  double fall = 0;
  for (std::size_t k = 0; k < strand_count(hair); ++k) {
    const vec3 tip = eval_strand(hair, k, 1);
    REQUIRE(is_finite(tip));
    fall += static_cast<double>(tip.y - eval_strand(hair, k, 0).y);
  }
  CHECK(fall / 2000 < -1.5);
}
