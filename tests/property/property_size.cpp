#include "property_size.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

namespace twilight {

bool nightly() {
  const char* size = std::getenv("TWILIGHT_PROPERTY");
  return size != nullptr && std::string(size) == "nightly";
}

std::size_t scene_count(std::size_t ci) {
  const char* factor = std::getenv("TWILIGHT_PROPERTY_SCENES");
  if (factor == nullptr) return ci;
  return static_cast<std::size_t>(
      std::max(1.0, std::round(static_cast<double>(ci) * std::stod(factor))));
}

std::uint64_t scene_seed() {
  const char* seed = std::getenv("TWILIGHT_PROPERTY_SEED");
  return seed == nullptr ? 20031208 : std::stoull(seed);
}

}  // namespace twilight
