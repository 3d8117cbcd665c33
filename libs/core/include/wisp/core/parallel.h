#pragma once

#include <cstddef>
#include <functional>

#include "wisp/core/export.h"

namespace wisp {

// Calls body(i) for i in [0, count) over up to `threads` threads of a TBB arena
// (0: all of the machine's). Work is stolen in grains of `grain` indices; the
// order is unspecified, so body(i) must write only what belongs to i. An
// exception in a body is rethrown here. Any number of threads may call it at once, and
// bodies may; each call has an arena of its own.
WISP_API void parallel_for(std::size_t count, int threads,
                           const std::function<void(std::size_t)>& body, std::size_t grain = 1);

// The number of threads that `threads` (0: all) means on this machine: no more
// than it runs at once. Safe to call from any thread.
WISP_API int thread_count(int threads);

}  // namespace wisp
