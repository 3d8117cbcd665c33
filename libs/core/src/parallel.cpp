#include "wisp/core/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace wisp {

// TBB makes no more workers than the machine runs at once, and grumbles on
// stderr when asked for more.
int thread_count(int threads) {
  int most = std::max(1, tbb::info::default_concurrency());
  return threads > 0 ? std::min(threads, most) : most;
}

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& body,
                  std::size_t grain) {
  if (count == 0) return;
  if (thread_count(threads) == 1) {
    for (std::size_t i = 0; i < count; i++) body(i);
    return;
  }
  tbb::task_arena arena(thread_count(threads));
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, std::max<std::size_t>(1, grain)),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (auto i = range.begin(); i != range.end(); i++) body(i);
                      });
  });
}

}  // namespace wisp
