// Skies of one atmosphere under many Suns, from one field.
#pragma once

#include <memory>
#include <vector>

#include "output/colour.h"
#include "sim/orders_sky.h"
#include "sim/scene_model.h"
#include "tests/validation/validation.h"

namespace twilight::validation {

/// Sixteen wavelengths for photometry, 380..755 nm in steps of 25.
std::vector<double> photopic_wavelengths_nm();

/// Skies by the orders method; the field is solved at the first Sun asked for.
class SkySequence {
 public:
  /// The scene's Sun and method do not matter.
  explicit SkySequence(Scene scene);

  /// The sky under another Sun (geometric elevation, deg); valid until the next call.
  const OrdersSky& under(double sun_elevation_deg);

  const SceneModel& model() const { return model_; }
  double solve_seconds() const { return solve_seconds_; }

  /// Sun and sky on a horizontal surface, lux, and the zenith's or any view's luminance, cd/m^2,
  /// of a sky that under() gave.
  double illuminance_lux(const OrdersSky& sky) const;
  double luminance_cd_m2(const OrdersSky& sky, const ViewAngles& view) const;

 private:
  SceneModel model_;
  ColourIntegrator photopic_;
  std::shared_ptr<const OrdersField> field_;
  std::unique_ptr<OrdersSky> sky_;
  double solve_seconds_ = 0;
};

}  // namespace twilight::validation
