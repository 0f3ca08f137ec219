#include <fmt/format.h>

#include <stdexcept>

#include "sim/models/bruneton_sky.h"
#include "sim/models/cie_sky.h"
#include "sim/models/fitted_sky.h"
#include "sim/models/hoffman_preetham_sky.h"
#include "sim/models/model_sky.h"
#include "sim/models/nishita_sky.h"
#include "sim/models/preetham_sky.h"

namespace twilight {

std::unique_ptr<Sky> make_model_sky(const SceneModel& model, const RunControl& control) {
  control.check();
  const std::string& method = model.scene.solver.method;
  if (method == "preetham") return std::make_unique<PreethamSky>(model);
  if (method == "cie-clear" || method == "cie-overcast") return std::make_unique<CieSky>(model);
  if (method == "nishita") return std::make_unique<NishitaSky>(model);
  if (method == "hoffman-preetham") return std::make_unique<HoffmanPreethamSky>(model);
  if (method == "bruneton") return std::make_unique<BrunetonSky>(model, control);
  if (method.starts_with(kFitMethodPrefix)) return make_fitted_sky(model);
  throw std::invalid_argument(fmt::format("key 'solver.method' = \"{}\": is not a method", method));
}

}  // namespace twilight
