#include "output/machine.h"

#include <hwy/targets.h>
#include <sched.h>

#include <bit>
#include <fstream>

namespace twilight {
namespace {

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

}  // namespace

Machine this_machine() {
  Machine machine;
  machine.processor = processor();
  cpu_set_t allowed;
  if (::sched_getaffinity(0, sizeof(allowed), &allowed) == 0) machine.cores = CPU_COUNT(&allowed);
  // Better targets have lower bits.
  const auto targets = static_cast<unsigned long long>(hwy::SupportedTargets());
  machine.simd =
      targets == 0 ? "unknown" : hwy::TargetName(std::int64_t{1} << std::countr_zero(targets));
  return machine;
}

}  // namespace twilight
