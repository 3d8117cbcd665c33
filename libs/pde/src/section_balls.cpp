#include "section_balls.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "wisp/core/parallel.h"

namespace wisp {

namespace {

// Points within this part of a ball's radius need no ball of their own.
constexpr double covered = 0.45;
// Screened equations forget over 1 / k: balls are no larger than this many times it.
constexpr double screened_reach = 3;
// What a walk costs for each point that takes it, in units of what it costs to make.
constexpr double gather_cost = 0.002;

}  // namespace

bool are_small(double k, const section_grid& grid) {
  return served * screened_reach / k < 2 * grid.cell;
}

// The largest balls first; a point that none covers yet gets one.
section_balls make_balls(const walk_context& context, const section_grid& grid,
                         ball_kernel_type type, int threads) {
  const std::size_t n = grid.points.size();
  section_balls result;
  result.places.resize(n);
  parallel_for(
      n, threads, [&](std::size_t i) { result.places[i] = place_point(context, grid.points[i]); },
      64);
  const auto radius_of = [&](std::size_t i) {
    const double r = result.places[i].radius;
    return context.k > 0 ? std::min(r, screened_reach / context.k) : r;
  };
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return radius_of(a) > radius_of(b); });
  constexpr std::uint32_t none = ~std::uint32_t{0};
  std::vector<std::uint32_t> point_at(
      static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height), none);
  for (std::size_t i = 0; i < n; ++i) point_at[grid.cells[i]] = static_cast<std::uint32_t>(i);

  std::vector<char> is_covered(n, 0);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;  // point, ball
  for (const std::uint32_t i : order) {
    if (is_covered[i] || result.places[i].status != point_status::ok) continue;
    const double R = radius_of(i);
    const auto b = static_cast<std::uint32_t>(result.balls.size());
    result.balls.push_back({i, R, kernel_ball(type, R, context.k)});
    const int x = static_cast<int>(grid.cells[i] % static_cast<std::uint32_t>(grid.width));
    const int y = static_cast<int>(grid.cells[i] / static_cast<std::uint32_t>(grid.width));
    const int reach = static_cast<int>(std::min(served * R / grid.cell, 1e6));
    for (int row = std::max(y - reach, 0); row <= std::min(y + reach, grid.height - 1); ++row) {
      for (int column = std::max(x - reach, 0); column <= std::min(x + reach, grid.width - 1);
           ++column) {
        const std::uint32_t p =
            point_at[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.width) +
                     static_cast<std::size_t>(column)];
        if (p == none || result.places[p].status != point_status::ok) continue;
        const double distance = glm::distance(grid.points[p], grid.points[i]);
        if (distance > served * R) continue;
        pairs.emplace_back(p, b);
        if (distance <= covered * R) is_covered[p] = 1;
      }
    }
  }
  result.first.assign(n + 1, 0);
  for (const auto& [p, b] : pairs) ++result.first[p + 1];
  std::partial_sum(result.first.begin(), result.first.end(), result.first.begin());
  result.serving.resize(pairs.size());
  std::vector<std::uint32_t> next(result.first.begin(), result.first.end() - 1);
  for (const auto& [p, b] : pairs) result.serving[next[p]++] = b;
  return result;
}

// The variance of the kernel is like this, and that of a walk does not depend on where in
// the ball the point is.
double ball_weight(const section_ball& ball, const dvec3& y) {
  const double q = glm::dot(y, y) / (ball.radius * ball.radius);
  return static_cast<double>(ball.walks) * (1 - q) * (1 - q) / (1 + q);
}

// As many as make the sum of the cells' variances least, where what a ball adds to it falls
// as one over its walks. A walk from a distance R of the boundary ends farther than s > R
// away with a probability of about R / s, so that its variance is about proportional to R.
// All this is settled before the first walk, so that no estimate leans on what others found.
void share_out(section_balls& all, const section_grid& grid, std::size_t block) {
  std::vector<section_ball>& balls = all.balls;
  const auto weight = [&](std::uint32_t p, const section_ball& b) {
    return ball_weight(b, grid.points[p] - grid.points[b.center]);
  };
  std::vector<double> variance(balls.size(), 0), cost(balls.size(), 1);
  for (std::uint32_t p = 0; p < grid.points.size(); ++p) {
    double sum = 0;
    for (std::uint32_t s = all.first[p]; s < all.first[p + 1]; ++s)
      sum += weight(p, balls[all.serving[s]]);
    for (std::uint32_t s = all.first[p]; s < all.first[p + 1]; ++s) {
      const section_ball& b = balls[all.serving[s]];
      const double w = weight(p, b);
      variance[all.serving[s]] += w * b.radius / (sum * sum);
      cost[all.serving[s]] += gather_cost;
    }
  }
  double total = 0;
  for (const double c : cost) total += c;
  const auto walks_of = [&](std::size_t b, double scale) {
    const double wanted = scale * std::sqrt(variance[b] / cost[b]);
    // Half of the mean at least, as where few walks go far, few tell what their error is;
    // and pairs of opposite ones.
    const auto least = static_cast<double>(std::max<std::size_t>((block + 1) / 2, 2));
    return std::clamp(std::round(wanted), least, static_cast<double>(max_block));
  };
  // the scale, by bisection of its logarithm
  double low = -100, high = 100;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    double sum = 0;
    for (std::size_t b = 0; b < balls.size(); ++b) sum += cost[b] * walks_of(b, std::exp(middle));
    (sum < total * static_cast<double>(block) ? low : high) = middle;
  }
  for (std::size_t b = 0; b < balls.size(); ++b) {
    balls[b].walks = static_cast<std::size_t>(walks_of(b, std::exp(low)));
  }
}

}  // namespace wisp
