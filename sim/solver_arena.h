// The threads that a solver may use.
#pragma once

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>

namespace twilight {

/// A oneTBB arena of solver.threads threads, at most as many as there are processors; all of them
/// where it is 0. A type of its own, for headers to name without oneTBB's.
struct SolverArena {
  explicit SolverArena(int threads)
      : arena(threads > 0 ? std::min(threads, tbb::info::default_concurrency())
                          : tbb::task_arena::automatic) {}
  tbb::task_arena arena;
};

}  // namespace twilight
