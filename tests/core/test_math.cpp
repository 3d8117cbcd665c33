#include <doctest/doctest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "wisp/core/math.h"
#include "wisp/core/parallel.h"
#include "wisp/core/rng.h"
#include "wisp/core/statistics.h"

using namespace wisp;

TEST_CASE("core: frames invert and compose") {
  auto rng = make_rng(1);
  auto random = [&] { return vec3{rand1f(rng), rand1f(rng), rand1f(rng)} * 2.0f - 1.0f; };
  for (int i = 0; i < 100; i++) {
    frame3 f{random() + vec3{2, 0, 0}, random() + vec3{0, 2, 0}, random() + vec3{0, 0, 2},
             random()};
    vec3 p = random();
    CHECK(glm::length(transform_point(inverse(f), transform_point(f, p)) - p) < 1e-5f);
    CHECK(glm::length(transform_point(compose(f, f), p) -
                      transform_point(f, transform_point(f, p))) < 1e-4f);
    // A normal stays at right angles to what is in its plane, mirrored or not.
    frame3 mirrored = f;
    mirrored[0] = -mirrored[0];
    vec3 n = glm::normalize(random()), t = glm::cross(n, random());
    for (const auto& g : {f, mirrored}) {
      CHECK(std::abs(glm::dot(transform_normal(g, n), transform_vector(g, t))) < 1e-4f);
      CHECK(glm::dot(transform_normal(g, n), transform_vector(g, n)) > 0);
    }
  }
}

TEST_CASE("core: a basis is orthonormal and right-handed for any axis") {
  auto rng = make_rng(2);
  std::vector<vec3> axes = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, 1e-20f, -1}};
  for (int i = 0; i < 1000; i++)
    axes.push_back(glm::normalize(vec3{rand1f(rng), rand1f(rng), rand1f(rng)} - 0.5f));
  for (const auto& z : axes) {
    mat3 b = basis_from_z(z);
    CHECK(std::abs(glm::dot(b[0], b[1])) < 1e-6f);
    CHECK(glm::length(glm::cross(b[0], b[1]) - b[2]) < 1e-5f);
  }
}

TEST_CASE("core: running statistics join to those of the whole") {
  auto rng = make_rng(4);
  running_stats whole, parts[3];
  for (int i = 0; i < 999; i++) {
    double x = 1e6 + rand1d(rng);
    add_sample(whole, x);
    add_sample(parts[i % 3], x);
  }
  merge(parts[0], parts[1]);
  merge(parts[0], parts[2]);
  CHECK(parts[0].count == whole.count);
  CHECK(parts[0].mean == doctest::Approx(whole.mean).epsilon(1e-14));
  CHECK(variance(parts[0]) == doctest::Approx(variance(whole)).epsilon(1e-6));
  CHECK(variance(whole) == doctest::Approx(1.0 / 12).epsilon(0.1));
}

TEST_CASE("core: parallel_for visits each index once and passes exceptions on") {
  for (int threads : {1, 2, 5}) {
    std::vector<std::atomic<int>> seen(10007);
    parallel_for(seen.size(), threads, [&](std::size_t i) { seen[i]++; });
    for (auto& s : seen) CHECK(s == 1);
    CHECK_THROWS_AS(parallel_for(100, threads,
                                 [](std::size_t i) {
                                   if (i == 50) throw std::runtime_error("stop");
                                 }),
                    std::runtime_error);
  }
}
