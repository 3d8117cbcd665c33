// The vector code of ball_kernels.h: up to eight directions or points at a time.

// Vectors whose size the compiler does not know are no wider than what NEON has.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/ball_lanes.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include <array>
#include <numbers>

#include "src/ball_kernels.h"
#include "src/ball_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace wisp::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using lanes = hn::CappedTag<double, kernel_lanes>;
using doubles = hn::Vec<lanes>;

HWY_INLINE doubles set(double x) { return hn::Set(lanes(), x); }
HWY_INLINE doubles load(const double* p) { return hn::LoadU(lanes(), p); }
HWY_INLINE void store(doubles v, double* p) { hn::StoreU(v, lanes(), p); }

struct vec_lanes {
  doubles x, y, z;
};
HWY_INLINE vec_lanes load(const point_lanes& p, std::size_t j) {
  return {load(p.x + j), load(p.y + j), load(p.z + j)};
}
HWY_INLINE doubles dot(const vec_lanes& a, const vec_lanes& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}
HWY_INLINE doubles dot(const dvec3& a, const vec_lanes& b) {
  return dot(vec_lanes{set(a.x), set(a.y), set(a.z)}, b);
}
// |a - s b|^2
HWY_INLINE doubles distance2(const dvec3& a, double s, const vec_lanes& b) {
  const doubles t = set(s);
  const vec_lanes d{hn::NegMulAdd(t, b.x, set(a.x)), hn::NegMulAdd(t, b.y, set(a.y)),
                    hn::NegMulAdd(t, b.z, set(a.z))};
  return dot(d, d);
}

void poisson(const dvec3& y, double R, const point_lanes& nu, double* HWY_RESTRICT result) {
  const double r = glm::length(y);
  const doubles shared = set(R * (R - r) * (R + r));
  for (std::size_t j = 0; j < nu.count; j += hn::Lanes(lanes())) {
    const doubles d2 = distance2(y, R, load(nu, j));
    store(hn::Div(shared, hn::Mul(d2, hn::Sqrt(d2))), result + j);
  }
}

// P_(l + 1) = first[l] t P_l - second[l] P_(l - 1)
struct bonnet {
  std::array<double, series_terms + 2> first, second;
  constexpr bonnet() {
    for (std::size_t l = 0; l < first.size(); ++l) {
      const auto n = static_cast<double>(l);
      first[l] = (2 * n + 1) / (n + 1);
      second[l] = n / (n + 1);
    }
  }
};
constexpr bonnet recurrence;

// Clenshaw's sum of Legendre polynomials (A Note on the Summation of Chebyshev Series,
// 1955) for `vectors` vectors of cosines, so that their steps overlap; term(l, i) is the
// factor of P_l.
template <std::size_t vectors, typename Term>
HWY_INLINE void sum_legendre(const std::array<doubles, vectors>& cosines, int count,
                             const Term& term, std::array<doubles, vectors>& sums) {
  std::array<doubles, vectors> above;
  for (auto& v : above) v = hn::Zero(lanes());
  for (auto& v : sums) v = hn::Zero(lanes());
  for (int l = count - 1; l >= 0; --l) {
    const auto i = static_cast<std::size_t>(l);
    const doubles a = set(recurrence.first[i]), b = set(recurrence.second[i + 1]);
    for (std::size_t v = 0; v < vectors; ++v) {
      const doubles rest = hn::NegMulAdd(b, above[v], term(i, v));
      above[v] = sums[v];
      sums[v] = hn::MulAdd(hn::Mul(a, cosines[v]), sums[v], rest);
    }
  }
}

// Calls f<vectors>(j) for all of 0 .. count - 1, four vectors at a time, then one.
template <typename F>
HWY_INLINE void for_vectors(std::size_t count, const F& f) {
  const std::size_t n = hn::Lanes(lanes());
  std::size_t j = 0;
  for (; j + 4 * n <= count; j += 4 * n) f.template operator()<4>(j);
  for (; j < count; j += n) f.template operator()<1>(j);
}

void series(const double* HWY_RESTRICT terms, int count, const dvec3& axis, const point_lanes& nu,
            double* HWY_RESTRICT result) {
  const std::size_t n = hn::Lanes(lanes());
  for_vectors(nu.count, [&]<std::size_t vectors>(std::size_t j) {
    std::array<doubles, vectors> cosines, sums;
    for (std::size_t v = 0; v < vectors; ++v) cosines[v] = dot(axis, load(nu, j + v * n));
    sum_legendre<vectors>(
        cosines, count, [&](std::size_t l, std::size_t) { return set(terms[l]); }, sums);
    for (std::size_t v = 0; v < vectors; ++v) store(sums[v], result + j + v * n);
  });
}

constexpr double over_4pi = 0.25 / std::numbers::pi;

void harmonic(const dvec3& y, double R, const point_lanes& z, double* HWY_RESTRICT result) {
  const doubles one = set(1), r2 = set(glm::dot(y, y)), RR = set(R * R);
  for (std::size_t j = 0; j < z.count; j += hn::Lanes(lanes())) {
    const vec_lanes p = load(z, j);
    const doubles near = hn::Div(one, hn::Sqrt(distance2(y, 1, p)));
    // r^2 b^2 - 2 R^2 y.z + R^4
    const doubles yz = dot(y, p);
    const doubles mirrored = hn::MulAdd(r2, dot(p, p), hn::Mul(RR, hn::Sub(hn::Sub(RR, yz), yz)));
    const doubles far = hn::Div(set(R), hn::Sqrt(hn::Max(mirrored, set(0))));
    store(hn::Mul(hn::Max(hn::Sub(near, far), set(0)), set(over_4pi)), result + j);
  }
}

void screened(const dvec3& y, double k, const double* HWY_RESTRICT terms, int count,
              const point_lanes& z, const double* HWY_RESTRICT products,
              double* HWY_RESTRICT result) {
  const std::size_t n = hn::Lanes(lanes());
  const double r = glm::length(y);
  const dvec3 axis = r > 0 ? y / r : dvec3{0};
  for_vectors(z.count, [&]<std::size_t vectors>(std::size_t j) {
    std::array<doubles, vectors> cosines, sums;
    for (std::size_t v = 0; v < vectors; ++v) {
      const vec_lanes p = load(z, j + v * n);
      const doubles b2 = hn::Max(dot(p, p), set(1e-300));
      cosines[v] = hn::Div(dot(axis, p), hn::Sqrt(b2));
    }
    sum_legendre<vectors>(
        cosines, count,
        [&](std::size_t l, std::size_t v) {
          return hn::Mul(set(terms[l]), load(products + l * z.count + j + v * n));
        },
        sums);
    for (std::size_t v = 0; v < vectors; ++v) {
      const doubles d = hn::Sqrt(distance2(y, 1, load(z, j + v * n)));
      const doubles free = hn::Div(hn::Exp(lanes(), hn::Mul(set(-k), d)), d);
      store(hn::Mul(hn::Max(hn::Sub(free, sums[v]), set(0)), set(over_4pi)), result + j + v * n);
    }
  });
}

void extend(double k, const double* HWY_RESTRICT rise, int rows, const point_lanes& z,
            double* HWY_RESTRICT products) {
  for (std::size_t j = 0; j < z.count; j += hn::Lanes(lanes())) {
    const vec_lanes p = load(z, j);
    const doubles c = hn::Mul(set(k), hn::Sqrt(dot(p, p)));
    // i_l / i_(l - 1) at c, downwards as in rising_ratios
    const int start = rows + 16;
    const doubles from = set(start + 0.5);
    doubles ratio =
        hn::Div(c, hn::Add(set(start), hn::Sqrt(hn::MulAdd(from, from, hn::Mul(c, c)))));
    for (int l = start - 1; l > 0; --l) {
      ratio = hn::Div(c, hn::MulAdd(c, ratio, set(2 * l + 1)));
      if (l < rows) store(ratio, products + static_cast<std::size_t>(l) * z.count + j);
    }
    doubles product = load(products + j);
    for (std::size_t l = 1; l < static_cast<std::size_t>(rows); ++l) {
      double* row = products + l * z.count + j;
      product = hn::Mul(product, hn::Div(load(row), set(rise[l])));
      store(product, row);
    }
  }
}

double sum(const double* HWY_RESTRICT a, const double* HWY_RESTRICT b, std::size_t n) {
  doubles total = hn::Zero(lanes());
  for (std::size_t j = 0; j < n; j += hn::Lanes(lanes())) {
    total = hn::MulAdd(load(a + j), load(b + j), total);
  }
  return hn::GetLane(hn::SumOfLanes(lanes(), total));
}

}  // namespace
}  // namespace wisp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wisp {
namespace {
HWY_EXPORT(poisson);
HWY_EXPORT(series);
HWY_EXPORT(harmonic);
HWY_EXPORT(screened);
HWY_EXPORT(extend);
HWY_EXPORT(sum);
}  // namespace

void poisson_kernels(const dvec3& y, double R, const point_lanes& nu, double* result) {
  HWY_DYNAMIC_DISPATCH(poisson)(y, R, nu, result);
}
void legendre_series(const double* terms, int count, const dvec3& axis, const point_lanes& nu,
                     double* result) {
  HWY_DYNAMIC_DISPATCH(series)(terms, count, axis, nu, result);
}
void harmonic_greens(const dvec3& y, double R, const point_lanes& z, double* result) {
  HWY_DYNAMIC_DISPATCH(harmonic)(y, R, z, result);
}
void screened_greens(const dvec3& y, double k, const double* terms, int count, const point_lanes& z,
                     const double* products, double* result) {
  HWY_DYNAMIC_DISPATCH(screened)(y, k, terms, count, z, products, result);
}
void extend_products(double k, const double* rise, int rows, const point_lanes& z,
                     double* products) {
  HWY_DYNAMIC_DISPATCH(extend)(k, rise, rows, z, products);
}
double sum_of_products(const double* a, const double* b, std::size_t n) {
  return HWY_DYNAMIC_DISPATCH(sum)(a, b, n);
}

}  // namespace wisp
#endif  // HWY_ONCE
