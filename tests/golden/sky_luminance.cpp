#include "tests/golden/sky_luminance.h"

#include <numbers>

#include "output/photometry.h"
#include "solar/solar_spectrum.h"

namespace twilight {
namespace {

ColourIntegrator photopic(const SceneModel& model) {
  return ColourIntegrator(
      model.medium.wavelength_nm,
      [&](double nm) { return solar_irradiance_w_m2_nm(model.scene.sun.spectrum, nm); },
      ColourObserver::kCie1931);
}

}  // namespace

double DefaultSky::zenith_luminance_cd_m2() const {
  const ViewDirection zenith{std::numbers::pi / 2, 0.0};
  return luminance_cd_m2(photopic(model), sky->radiance({&zenith, 1}), model.solar_irradiance);
}

double DefaultSky::global_illuminance_lux() const {
  const Irradiance parts = sky->irradiance();
  std::vector<double> global = parts.direct;
  for (std::size_t w = 0; w < global.size(); ++w) global[w] += parts.diffuse[w];
  return illuminance_lux(photopic(model), global, model.solar_irradiance);
}

DefaultSky solve_default_sky(double sun_elevation_deg, const std::string& aerosol_type) {
  Scene scene;
  scene.sun.elevation_deg = sun_elevation_deg;
  scene.aerosols.type = aerosol_type;
  DefaultSky result;
  result.model = build_scene_model(scene);
  result.sky = solve_sky(result.model);
  return result;
}

}  // namespace twilight
