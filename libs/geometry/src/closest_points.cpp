// Batches: in the order of a curve through space, some at a time.

#include <hwy/cache_control.h>

#include <array>
#include <stdexcept>
#include <string>

#include "finish.h"
#include "wisp/core/parallel.h"
#include "wisp/geometry/closest_point.h"
#include "wisp/geometry/spatial_order.h"

namespace wisp {

namespace {

// A run of the points of a batch, and how far it has come.
template <typename Options, typename Result>
struct batch_run {
  const bvh& tree;
  std::span<const dvec3> points;
  std::span<const uint32_t> order;
  std::span<Result> results;
  const Options& options;
  std::size_t at = 0;

  // The index of the next point. Points and results lie all over memory, so that
  // those of some queries ahead are called for.
  uint32_t take() {
    constexpr std::size_t ahead = 8;
    if (at + ahead < order.size()) {
      hwy::Prefetch(&points[order[at + ahead]]);
      const auto* result = reinterpret_cast<const char*>(&results[order[at + ahead]]);
      for (std::size_t i = 0; i < sizeof(Result); i += 64) hwy::Prefetch(result + i);
    }
    return order[at++];
  }
};
constexpr std::size_t batch_size = 512;

void check_sizes(const char* name, std::size_t points, std::size_t results) {
  if (points == results) return;
  throw std::invalid_argument(std::string(name) + ": " + std::to_string(results) + " results for " +
                              std::to_string(points) + " points");
}

template <typename Options, typename Result, typename Body>
void in_batches(const bvh& tree, std::span<const dvec3> points, std::span<Result> results,
                const Options& options, int threads, const Body& body) {
  const int n = thread_count(threads);
  const std::vector<uint32_t> order = spatial_order(points, n);
  parallel_for((points.size() + batch_size - 1) / batch_size, n, [&](std::size_t i) {
    const std::size_t first = i * batch_size;
    const std::size_t count = std::min(batch_size, points.size() - first);
    batch_run<Options, Result> run{tree, points, std::span(order).subspan(first, count), results,
                                   options};
    body(run);
  });
}

using nearest_run = batch_run<closest_point_options, closest_point_result>;

// Neighbours along the curve help one another: a closest point of one bounds the
// distances of those that follow. With a tolerance it does not, as then what one finds
// would depend on the others.
class nearest_batch {
 public:
  explicit nearest_batch(const nearest_run& r) : run_(r) {}

  bool next(nearest_query& q) {
    while (run_.at < run_.order.size()) {
      const uint32_t i = run_.take();
      if (const auto special = special_case(run_.tree, run_.points[i], run_.options)) {
        run_.results[i] = *special;
        continue;
      }
      const bvh_data& data = *run_.tree.data();
      auto slot = std::find(slots_.begin(), slots_.end(), std::nullopt);
      slot->emplace(running{finish(data, run_.points[i]), i});
      start(q, (*slot)->best, data, data.normalized(run_.points[i]), run_.options);
      q.user = &*slot;
      if (found_ && q.shrink == 1) {
        const float near = glm::distance(q.p, last_) + 2 * q.margin;
        if (near < q.reach) {
          q.reach = near;
          q.limit2 = near * near;
        }
      }
      return true;
    }
    return false;
  }

  void done(const nearest_query& q) {
    auto& slot = *static_cast<std::optional<running>*>(q.user);
    closest_point_result& result = run_.results[slot->index];
    result = finish_up(q, slot->best, run_.tree, run_.points[slot->index], run_.options);
    if (result) {
      last_ = vec3(q.data->normalized(result.at.point));
      found_ = true;
    }
    slot.reset();
  }

 private:
  struct running {
    finish best;
    uint32_t index;
  };

  nearest_run run_;
  std::array<std::optional<running>, query_turns> slots_ = {};
  vec3 last_ = {0, 0, 0};  // a closest point, normalized
  bool found_ = false;
};

}  // namespace

void closest_points(const bvh& tree, std::span<const dvec3> points,
                    std::span<closest_point_result> results, const closest_point_options& options,
                    int threads) {
  check_sizes("closest_points", points.size(), results.size());
  in_batches(tree, points, results, options, threads, [](const nearest_run& r) {
    nearest_batch batch(r);
    query_source<nearest_query> source;
    source.user = &batch;
    source.next = [](void* user, nearest_query& q) {
      return static_cast<nearest_batch*>(user)->next(q);
    };
    source.done = [](void* user, const nearest_query& q) {
      static_cast<nearest_batch*>(user)->done(q);
    };
    run_all_nearest(source, r.options.tolerance > 0);
  });
}

void bound_distances(const bvh& tree, std::span<const dvec3> points,
                     std::span<distance_bounds> results, double tolerance, int threads) {
  check_sizes("bound_distances", points.size(), results.size());
  using run = batch_run<double, distance_bounds>;
  in_batches(tree, points, results, tolerance, threads, [](run r) {
    query_source<bounds_query> source;
    source.user = &r;
    source.next = [](void* user, bounds_query& q) {
      auto& b = *static_cast<run*>(user);
      while (b.at < b.order.size()) {
        q.index = b.take();
        const auto special = special_bounds(b.tree, b.points[q.index]);
        if (!special) {
          const bvh_data& data = *b.tree.data();
          start(q, data, data.normalized(b.points[q.index]), b.options);
          return true;
        }
        b.results[q.index] = *special;
      }
      return false;
    };
    source.done = [](void* user, const bounds_query& q) {
      auto& b = *static_cast<run*>(user);
      b.results[q.index] = finish_up(q, b.tree, b.points[q.index], b.options);
    };
    run_all_bounds(source);
  });
}

}  // namespace wisp
