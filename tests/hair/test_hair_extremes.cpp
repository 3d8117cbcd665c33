// Combinations of the ends of all ranges, one after the other, where random calls
// (test_hair_rounding.cpp, `wisp stress`) meet only pairs of them; in float and
// double, and what lies outside of the ranges.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <utility>
#include <vector>

#include "wisp/core/rng.h"
#include "wisp/hair/bsdf.h"
#include "wisp/hair/rounding.h"

using namespace wisp;
using namespace wisp::hair;

namespace {

template <typename T>
constexpr T below_one = 1 - std::numeric_limits<T>::epsilon() / 2;

template <typename T>
bool sound(const glm::vec<3, T>& value, T pdf) {
  bool good = std::isfinite(pdf) && pdf >= 0;
  for (int k = 0; k < 3; k++) good = good && std::isfinite(value[k]) && value[k] >= 0;
  return good;
}

// Poles with every sign of zero, beside the poles by one unit of rounding and by
// the least numbers there are, and a few places between.
template <typename T>
std::vector<glm::vec<3, T>> directions() {
  T least = std::numeric_limits<T>::denorm_min(), small = std::numeric_limits<T>::min();
  std::vector<glm::vec<3, T>> w;
  for (T x : {T(1), T(-1)}) {
    for (T y : {T(0), T(-0.0)})
      for (T z : {T(0), T(-0.0)}) w.push_back({x, y, z});
    w.push_back({x, least, 0});
    w.push_back({x, 0, -small});
    // Whose squares have lost digits.
    T root = std::sqrt(small) / 100;
    w.push_back({x, root, 3 * root});
    T inside = x * below_one<T>, across = std::sqrt((1 - inside) * (1 + inside));
    w.push_back({inside, across, 0});
    w.push_back({inside, 0, -across});
  }
  for (T s : {T(1), T(-1)}) {
    w.push_back({0, s, 0});
    w.push_back({0, -0.0f, s});
    w.push_back({T(0.6) * s, T(0.48), T(-0.64)});
  }
  return w;
}

struct faults {
  int value = 0, direction = 0, density = 0;
};

// All materials, hits and numbers of `stride` apart in the list of combinations.
template <typename T>
faults combinations(int stride) {
  faults found;
  const auto all = directions<T>();
  T eps = std::numeric_limits<T>::epsilon();
  const std::initializer_list<T> betas = {0, T(min_roughness), T(1e-3), below_one<T>, 1};
  const std::array<T, 4> numbers = {0, eps / 2, T(0.5), below_one<T>};
  int counter = 0;
  for (T beta_m : betas)
    for (T beta_n : betas)
      for (T eta : {T(1), 1 + eps, T(1.55), T(3)})
        for (T alpha : {T(0), T(2), T(-90)})
          for (int variant = 0; variant < 4; variant++) {
            hair_parameters<T> k = {eta, beta_m, beta_n, alpha, 1 + counter % max_p_max};
            if (variant == 1) k.coat = 1;
            if (variant == 2) k.strength[std::size_t(counter % 3)] = glm::vec<3, T>(0);
            if (variant == 3) k.strength.fill(glm::vec<3, T>(0));
            auto bsdf = make_hair_bsdf(k);
            for (T h : {T(-1), T(-0.0), below_one<T>, T(1)})
              for (T sigma : {T(0), T(1e-30), T(1), T(1e4)})
                for (std::size_t d = 0; d < all.size(); d++) {
                  if (++counter % stride != 0) continue;
                  auto hit = make_hair_hit<T>(bsdf, {sigma, 0, T(1e4)}, h, all[d]);
                  auto f = eval_hair_with_pdf<T>(bsdf, hit,
                                                 all[std::size_t(counter / stride) % all.size()]);
                  found.value += !sound(f.value, f.pdf);
                  auto number = [&](int i) {
                    return numbers[std::size_t(counter / stride >> 2 * i) % 4];
                  };
                  glm::vec<4, T> u = {number(0), number(1), number(2), number(3)};
                  for (bool two : {false, true}) {
                    auto s = two ? sample_hair_with_pdf<T>(bsdf, hit, glm::vec<2, T>(u))
                                 : sample_hair_with_pdf<T>(bsdf, hit, u);
                    found.value += !sound(s.value, s.pdf);
                    found.density += !(s.pdf > 0);
                    found.direction += !(std::abs(glm::length(s.direction) - 1) < 8 * eps);
                    f = eval_hair_with_pdf<T>(bsdf, hit, s.direction);
                    found.value += !sound(f.value, f.pdf);
                  }
                }
          }
  return found;
}

}  // namespace

TEST_CASE("hair: every combination of extremes gives sound values and samples") {
  // Of 460,800 combinations every third in float and every seventh in double; the
  // strides have no factor in common with the lists' lengths.
  auto check = [](const faults& found) {
    CHECK(found.value == 0);
    CHECK(found.direction == 0);
    CHECK(found.density == 0);
  };
  check(combinations<float>(3));
  check(combinations<double>(7));
}

TEST_CASE("hair: a million random calls in double") {
  auto rng = make_rng(303);
  auto unit = [&] { return rand1d(rng); };
  auto pick = [&](std::initializer_list<double> edges, double inside) {
    auto n = uint32_t(edges.size());
    uint32_t i = rand_index(rng, 2 * n);
    return i < n ? *(edges.begin() + i) : inside;
  };
  auto direction = [&] {
    double x = pick({1, -1, 0, below_one<double>}, 2 * unit() - 1), phi = 2 * pi_v<double> * unit();
    double c = std::sqrt((1 - x) * (1 + x));
    return glm::dvec3(x, c * std::cos(phi), c * std::sin(phi));
  };
  int unsound = 0, without = 0;
  hair_bsdf<double> bsdf;
  for (int i = 0; i < 1000000; i++) {
    if (i % 10 == 0) {
      hair_parameters<double> k;
      k.beta_m = pick({0, 1}, std::pow(10, -4 * unit()));
      k.beta_n = pick({0, 1}, std::pow(10, -4 * unit()));
      k.alpha = pick({0, 2, -3}, 40 * unit() - 20);
      k.eta = pick({1, 3}, 1 + 2 * unit());
      k.p_max = 1 + int(rand_index(rng, max_p_max));
      bsdf = make_hair_bsdf(k);
    }
    auto hit = make_hair_hit<double>(bsdf, {pick({0, 1e4}, unit()), 3 * unit(), 1e4 * unit()},
                                     pick({-1, 1, 0}, 2 * unit() - 1), direction());
    auto number = [&] { return pick({0, 0x1p-53, below_one<double>}, unit()); };
    if (i % 2 == 0) {
      auto f = eval_hair_with_pdf<double>(bsdf, hit, direction());
      unsound += !sound(f.value, f.pdf);
    } else {
      auto s = sample_hair_with_pdf<double>(bsdf, hit,
                                            glm::dvec4(number(), number(), number(), number()));
      unsound += !sound(s.value, s.pdf);
      without += !(s.pdf > 0);
    }
  }
  CHECK(unsound == 0);
  CHECK(without == 0);
}

TEST_CASE("hair: what lies outside of a range is taken as its end") {
  auto same = [](const hair_parameters<float>& a, const hair_parameters<float>& b, float h_a,
                 float h_b) {
    glm::vec3 wo = {0.28f, 0.0f, 0.96f}, wi = {-0.1f, 0.3f, 0.9486833f}, sigma = {0.1f, 0.5f, 2};
    auto one = [&](const hair_parameters<float>& k, float h) {
      auto bsdf = make_hair_bsdf(k);
      return eval_hair_with_pdf<float>(bsdf, make_hair_hit<float>(bsdf, sigma, h, wo), wi);
    };
    auto f = one(a, h_a), g = one(b, h_b);
    return f.value == g.value && f.pdf == g.pdf && sound(f.value, f.pdf);
  };
  const hair_parameters<float> usual;
  auto with = [&](auto&& change) {
    hair_parameters<float> k = usual;
    change(k);
    return k;
  };
  CHECK(same(usual, usual, 1.5f, 1));
  CHECK(same(usual, usual, -7, -1));
  CHECK(same(with([](auto& k) { k.eta = 0.5f; }), with([](auto& k) { k.eta = 1; }), 0.3f, 0.3f));
  CHECK(same(with([](auto& k) { k.beta_m = -1; }), with([](auto& k) { k.beta_m = 1e-4f; }), 0, 0));
  CHECK(same(with([](auto& k) { k.beta_n = 3; }), with([](auto& k) { k.beta_n = 1; }), 0, 0));
  CHECK(same(with([](auto& k) { k.coat = -1; }), usual, 0.2f, 0.2f));
  CHECK(same(with([](auto& k) { k.coat = 2; }), with([](auto& k) { k.coat = 1; }), 0.2f, 0.2f));
  CHECK(same(with([](auto& k) { k.p_max = -3; }), with([](auto& k) { k.p_max = 1; }), 0.2f, 0.2f));
  CHECK(same(with([](auto& k) { k.p_max = 99; }), with([](auto& k) { k.p_max = max_p_max; }), 0.2f,
             0.2f));
}

TEST_CASE("hair: the strongest coat is the least roughness, for R alone") {
  hair_parameters<double> k;
  auto plain = make_hair_bsdf(k);
  for (auto [coat, beta] : {std::pair{1.0, min_roughness}, {0.5, 0.15}, {0.0, 0.3}}) {
    k.coat = coat;
    auto bsdf = make_hair_bsdf(k);
    CHECK(bsdf.v[0] == doctest::Approx(longitudinal_variance(beta)).epsilon(1e-12));
    for (std::size_t p = 1; p <= 3; p++) CHECK(bsdf.v[p] == plain.v[p]);
  }
}

TEST_CASE("hair: directions that rounding has made longer than 1") {
  // Their sine and cosine are limited to 1: nothing becomes the root of a negative.
  auto bsdf = make_hair_bsdf<float>({1.55f, 0.001f, 0.001f, 2, 3});
  for (float x : {1.0000001f, -1.000001f})
    for (float y : {0.0f, 1e-4f}) {
      auto hit = make_hair_hit<float>(bsdf, {0.1f, 1, 1}, 0.5f, {x, y, 0});
      auto f = eval_hair_with_pdf<float>(bsdf, hit, {-x, y, 1e-3f});
      CHECK(sound(f.value, f.pdf));
      auto s = sample_hair_with_pdf<float>(bsdf, hit, glm::vec4(0.9f, 0.1f, 0.7f, 0.5f));
      CHECK(sound(s.value, s.pdf));
      CHECK(s.pdf > 0);
    }
}

TEST_CASE("hair: opaque, absorbing hair reflects and nothing else") {
  // exp(-sigma path) is below every float: the lobes after R are 0, not a NaN, and
  // R alone is drawn.
  for (float sigma : {1e4f, 1e20f, std::numeric_limits<float>::max()})
    for (float h : {-1.0f, 0.0f, 0.99f, 1.0f}) {
      auto bsdf = make_hair_bsdf<float>({1.55f, 0.3f, 0.3f, 2, 3});
      auto hit = make_hair_hit<float>(bsdf, glm::vec3(sigma), h, {0.6f, 0.8f, 0});
      CHECK(std::abs(hit.ap[0].w - 1) < 2e-7f);
      for (std::size_t p = 1; p <= 3; p++) {
        CHECK(hit.ap[p].x == 0.0f);
        CHECK(hit.ap[p].w == 0.0f);
      }
      auto s = sample_hair_with_pdf<float>(
          bsdf, hit, glm::vec4(below_one<float>, below_one<float>, 0.5f, 0.5f));
      CHECK(sound(s.value, s.pdf));
      CHECK(s.pdf > 0);
    }
}

TEST_CASE("hair: without refraction nothing is reflected, at the edge too") {
  // eta = 1: all goes on as TT, straight through.
  auto bsdf = make_hair_bsdf<double>({1, 0.1, 0.1, 0, 3});
  for (double h : {-1.0, -0.5, 0.0, 0.999999, 1.0})
    for (double theta : {0.0, 0.7, 1.57}) {
      glm::dvec3 wo = {std::sin(theta), std::cos(theta), 0};
      auto hit = make_hair_hit<double>(bsdf, {0, 0, 0}, h, wo);
      CHECK(hit.ap[0].x + hit.ap[1].x + hit.ap[2].x + hit.ap[3].x ==
            doctest::Approx(1).epsilon(1e-12));
      if (std::abs(h) < 1) {
        CHECK(hit.ap[1].x == doctest::Approx(1).epsilon(1e-9));
        CHECK(std::abs(wrap_angle(hit.exit_phi[1] - pi_v<double>)) < 1e-7);
      }
    }
}

TEST_CASE("hair: the bound on rounding is tight enough to be of use") {
  // With its factor of 10, in samples: at roughness from 0.15 below 1e-4 of value
  // and density for 99 of 100, at 0.001 below 2 % for as many.
  auto rng = make_rng(88);
  std::array<std::vector<double>, 2> ratios;
  for (int i = 0; i < 20000; i++) {
    bool narrow = i % 2 == 1;
    double beta = narrow ? 1e-3 : 0.15 + 0.85 * rand1d(rng);
    auto bsdf = make_hair_bsdf<double>({1.55, beta, beta, 2, 3});
    double theta = 2 * rand1d(rng) - 1;
    auto hit = make_hair_hit<double>(bsdf, {0.2, 0.5, 1}, 2 * rand1d(rng) - 1,
                                     {std::sin(theta), std::cos(theta), 0});
    glm::dvec4 u = {rand1d(rng), rand1d(rng), rand1d(rng), rand1d(rng)};
    auto f = sample_hair_with_pdf<double>(bsdf, hit, u);
    auto bound = rounding_bound(bsdf, hit, f.direction);
    ratios[narrow ? 1 : 0].push_back(std::max(bound.value.y / f.value.y, bound.pdf / f.pdf));
  }
  for (auto& r : ratios) std::sort(r.begin(), r.end());
  CHECK(ratios[0][ratios[0].size() * 99 / 100] < 1e-4);
  CHECK(ratios[1][ratios[1].size() * 99 / 100] < 2e-2);
}
