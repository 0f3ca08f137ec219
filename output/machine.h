// The machine a measurement was made on.
#pragma once

#include <string>

namespace twilight {

struct Machine {
  std::string processor;  ///< model name as the system gives it
  int cores = 0;          ///< hardware threads this process may run on
  std::string simd;       ///< the widest instruction set the kernels find, "AVX3" (AVX-512), "AVX2"
};

/// Asks the running system; "unknown" where it does not say.
Machine this_machine();

}  // namespace twilight
