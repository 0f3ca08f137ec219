#include <fmt/format.h>

#include <stdexcept>

#include "sim/models/bruneton_sky.h"
#include "sim/models/model_sky.h"

namespace twilight {

std::unique_ptr<Sky> make_model_sky(const SceneModel& model, const RunControl& control) {
  control.check();
  const std::string& method = model.scene.solver.method;
  if (method == "bruneton") return std::make_unique<BrunetonSky>(model, control);
  throw std::invalid_argument(fmt::format("key 'solver.method' = \"{}\": is not a method", method));
}

}  // namespace twilight
