#include "sim/models/cie_sky.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "sim/models/daylight_spectrum.h"
#include "sim/models/preetham_sky.h"

namespace twilight {
namespace {

using std::numbers::pi;

double indicatrix(double sun_angle_rad) {
  const double cosine = std::cos(sun_angle_rad);
  return 0.91 + 10 * std::exp(-3 * sun_angle_rad) + 0.45 * cosine * cosine;
}

}  // namespace

double cie_clear_luminance(double cos_zenith, double sun_angle_rad, double sun_zenith_angle_rad) {
  const double gradation = cos_zenith > 0 ? -std::expm1(-0.32 / cos_zenith) : 1.0;
  return indicatrix(sun_angle_rad) * gradation /
         (indicatrix(sun_zenith_angle_rad) * -std::expm1(-0.32));
}

double cie_overcast_luminance(double cos_zenith) { return (1 + 2 * cos_zenith) / 3; }

double overcast_zenith_luminance_cd_m2(double sun_elevation_rad) {
  return 123.0 + 8600.0 * std::sin(sun_elevation_rad);
}

CieSky::CieSky(const SceneModel& model)
    : HemisphereSky(model),
      clear_(model.scene.solver.method == "cie-clear"),
      zenith_(model.medium.wavelengths()),
      sun_transmittance_(model.medium.wavelengths()) {
  model_.sun_elevation_rad = daytime_elevation_rad(model_, summary_);
  const auto& given = model_.scene.cie.zenith_luminance_cd_m2;
  double luminance_cd_m2 = 0;
  if (clear_) {
    const double turbidity = model_turbidity(model_, summary_);
    const PreethamZenith zenith = preetham_zenith(turbidity, pi / 2 - model_.sun_elevation_rad);
    luminance_cd_m2 = given.value_or(zenith.luminance_cd_m2);
    const bool clipped = DaylightSpectrum(model_.medium.wavelength_nm)
                             .radiance(luminance_cd_m2, zenith.x, zenith.y, zenith_);
    if (clipped) summary_.clamps.emplace_back("radiance", "negative daylight spectrum taken as 0");
    sun_transmittance_ = clear_sun_transmittance(model_, turbidity, model_.sun_elevation_rad);
  } else {
    luminance_cd_m2 = given.value_or(overcast_zenith_luminance_cd_m2(model_.sun_elevation_rad));
    for (double& value : zenith_) {
      value = luminance_cd_m2 / (kDaylightEfficacy_lm_w * kFlatTristimulusY);
    }
  }
  summary_.figures.emplace_back("zenith", fmt::format("{:.0f} cd/m2", luminance_cd_m2));
}

void CieSky::spectrum(const ViewDirection& view, std::span<double> out) const {
  const double cosine = std::sin(view.elevation_rad);
  const double luminance = clear_ ? cie_clear_luminance(cosine, std::acos(cos_sun_angle(view)),
                                                        pi / 2 - model_.sun_elevation_rad)
                                  : cie_overcast_luminance(cosine);
  for (std::size_t w = 0; w < out.size(); ++w) out[w] = luminance * zenith_[w];
}

}  // namespace twilight
