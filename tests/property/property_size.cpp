#include "property_size.h"

#include <rapidcheck.h>

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

std::vector<Scene> draw_scenes(std::size_t n, const std::function<Scene()>& draw) {
  const char* seed = std::getenv("TWILIGHT_PROPERTY_SEED");
  rc::Random random(seed == nullptr ? 20031208 : std::stoull(seed));
  const auto generator = rc::gen::exec(draw);
  std::vector<Scene> scenes;
  for (std::size_t i = 0; i < n; ++i) {
    scenes.push_back(generator(random.split(), rc::kNominalSize).value());
  }
  return scenes;
}

}  // namespace twilight
