#include "tests/validation/sky_sequence.h"

#include "output/photometry.h"
#include "solar/solar_spectrum.h"

namespace twilight::validation {
namespace {

Scene by_orders(Scene scene) {
  scene.solver.method = "orders";
  if (!scene.sun.elevation_deg) scene.sun.elevation_deg = 0;
  return scene;
}

}  // namespace

std::vector<double> photopic_wavelengths_nm() {
  std::vector<double> nm;
  for (int k = 0; k < 16; ++k) nm.push_back(380 + 25 * k);
  return nm;
}

SkySequence::SkySequence(Scene scene)
    : model_(build_scene_model(by_orders(std::move(scene)))),
      photopic_(
          model_.medium.wavelength_nm,
          [this](double nm) { return solar_irradiance_w_m2_nm(model_.scene.sun.spectrum, nm); },
          ColourObserver::kCie1931) {}

const OrdersSky& SkySequence::under(double sun_elevation_deg) {
  const Stopwatch watch;
  model_.sun_elevation_rad = sun_elevation_deg * kRadPerDeg;
  sky_ = std::make_unique<OrdersSky>(model_, field_, RunControl{});
  if (!field_) solve_seconds_ = watch.seconds();
  field_ = sky_->field();
  return *sky_;
}

double SkySequence::illuminance_lux(const OrdersSky& sky) const {
  Irradiance light = sky.irradiance();
  for (std::size_t w = 0; w < light.direct.size(); ++w) light.direct[w] += light.diffuse[w];
  return twilight::illuminance_lux(photopic_, light.direct, model_.solar_irradiance);
}

double SkySequence::luminance_cd_m2(const OrdersSky& sky, const ViewAngles& view) const {
  const ViewDirection direction = view.direction();
  return twilight::luminance_cd_m2(photopic_, sky.radiance({&direction, 1}),
                                   model_.solar_irradiance);
}

}  // namespace twilight::validation
