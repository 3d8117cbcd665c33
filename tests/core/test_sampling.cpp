#include <doctest/doctest.h>

#include <set>
#include <vector>

#include "support/statistics.h"
#include "wisp/core/rng.h"
#include "wisp/core/sampler.h"
#include "wisp/core/sampling.h"

using namespace wisp;

TEST_CASE("core: Sobol sets are stratified in one and two dimensions") {
  // A (0, 2)-net: 256 samples put one in each cell of every 2^a x 2^b grid.
  for (uint32_t seed : {1u, 77u, 12345u})
    for (uint32_t set : {0u, 1u, 9u}) {
      for (uint32_t block : {0u, 3u})
        for (uint32_t a = 0; a <= 8; a++) {
          std::set<std::pair<uint32_t, uint32_t>> cells;
          for (uint32_t i = 0; i < 256; i++) {
            vec4 u = sample_4d({seed, block * 256 + i}, set);
            cells.insert({static_cast<uint32_t>(u.x * static_cast<float>(1u << a)),
                          static_cast<uint32_t>(u.y * static_cast<float>(1u << (8 - a)))});
          }
          CHECK(cells.size() == 256);
        }
      for (int k = 0; k < 4; k++) {
        std::set<uint32_t> bins;
        for (uint32_t i = 0; i < 256; i++)
          bins.insert(static_cast<uint32_t>(sample_4d({seed, i}, set)[k] * 256));
        CHECK(bins.size() == 256);
      }
    }
}

TEST_CASE("core: samples stay below 1, and sets and pixels are independent") {
  // Correlation of n = 4096 pairs has standard deviation 1/64; 20 tests at
  // 4.5 sigma raise a false alarm with probability 1.4e-4.
  auto correlation = [](auto&& f, auto&& g) {
    double sum = 0;
    for (uint32_t i = 0; i < 4096; i++) sum += (f(i) - 0.5) * (g(i) - 0.5) * 12;
    return sum / 4096;
  };
  for (uint32_t k = 0; k < 20; k++) {
    auto f = [k](uint32_t i) { return double(sample_4d({pixel_seed(1, k, 0), i}, 2)[0]); };
    auto g = [k](uint32_t i) { return double(sample_4d({pixel_seed(1, k, 0), i}, 3)[int(k % 4)]); };
    CHECK(std::abs(correlation(f, g)) < 4.5 / 64);
  }
  for (uint32_t i = 0; i < 100000; i++) {
    vec4 u = sample_4d({i * 7919u, i}, i % 50);
    for (int k = 0; k < 4; k++) {
      CHECK(u[k] >= 0);
      CHECK(u[k] < 1);
    }
  }
}

TEST_CASE("core: the generator's streams are uniform") {
  // 20 chi-square tests of 64 bins; false alarm 1e-4 together.
  double level = test::sidak(1e-4, 20);
  for (uint64_t stream = 0; stream < 20; stream++) {
    auto rng = make_rng(5, stream);
    std::vector<double> counts(64, 0), expected(64, 100);
    for (int i = 0; i < 6400; i++) counts[std::size_t(rand1f(rng) * 64)]++;
    CHECK(test::chi_square_p_value(counts, expected) > level);
  }
}

TEST_CASE("core: discrete distributions draw what their density says") {
  std::vector<float> weights = {0, 1, 3, 0, 0.5f, 7, 0};
  auto d = make_discrete(weights);
  std::vector<double> counts(7, 0), expected(7, 0);
  for (int i = 0; i < 7; i++) {
    CHECK(discrete_pdf(d, i) == doctest::Approx(weights[std::size_t(i)] / 11.5).epsilon(1e-6));
    expected[std::size_t(i)] = 100000 * weights[std::size_t(i)] / 11.5;
  }
  auto rng = make_rng(3);
  for (int i = 0; i < 100000; i++) {
    float rest = -1;
    int k = sample_discrete(d, rand1f(rng), &rest);
    CHECK(rest >= 0);
    CHECK(rest < 1);
    counts[std::size_t(k)]++;
  }
  CHECK(test::chi_square_p_value(counts, expected) > 1e-4);
  CHECK(sample_discrete(d, 0) == 1);
  CHECK(sample_discrete(d, 0x1.fffffep-1f) == 5);
  std::vector<float> nothing(3, 0);
  CHECK(make_discrete(nothing).cdf.empty());
  CHECK(sample_discrete(make_discrete(nothing), 0.5f) == -1);
}

TEST_CASE("core: the two-dimensional distribution integrates to one and matches its samples") {
  int w = 8, h = 5;
  std::vector<float> weights(40);
  auto rng = make_rng(11);
  for (auto& x : weights) x = rand1f(rng) < 0.3f ? 0.0f : rand1f(rng);
  auto d = make_distribution_2d(weights, w, h);
  double sum = 0;
  std::vector<double> counts(40, 0), expected(40, 0);
  for (int j = 0; j < h; j++)
    for (int i = 0; i < w; i++) {
      double p =
          double(distribution_pdf(d, {(float(i) + 0.5f) / float(w), (float(j) + 0.5f) / float(h)}));
      sum += p / (w * h);
      expected[std::size_t(j * w + i)] = p / (w * h) * 200000;
    }
  CHECK(sum == doctest::Approx(1).epsilon(1e-5));
  for (int i = 0; i < 200000; i++) {
    vec2 p = sample_2d(d, {rand1f(rng), rand1f(rng)});
    counts[std::size_t(int(p.y * float(h)) * w + int(p.x * float(w)))]++;
    CHECK(distribution_pdf(d, p) > 0);
  }
  CHECK(test::chi_square_p_value(counts, expected) > 1e-4);
}
