// How a long run reports progress and is told to stop.
#pragma once

#include <atomic>
#include <functional>
#include <stdexcept>
#include <string_view>

namespace twilight {

/// Thrown by a solver that was told to stop; no result exists.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("stopped") {}
};

struct RunControl {
  /// Called with the stage's name and its fraction done, 0..1, from any of the solver's threads,
  /// also at the same time.
  std::function<void(std::string_view stage, double fraction)> progress;
  /// Set to true (from a signal handler, say) to stop; may be null.
  const std::atomic<bool>* cancel = nullptr;

  void report(std::string_view stage, double fraction) const {
    if (progress) progress(stage, fraction);
  }
  void check() const {
    if (cancel != nullptr && cancel->load(std::memory_order_relaxed)) throw Cancelled();
  }
};

}  // namespace twilight
