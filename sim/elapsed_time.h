// What a run takes, on the clock and of the processors.
#pragma once

#include <chrono>

namespace twilight {

using Clock = std::chrono::steady_clock;

/// Seconds on the clock since `start`.
double seconds_since(Clock::time_point start);

/// Processor seconds (user and system, all threads) of this process so far.
double processor_seconds();

}  // namespace twilight
