#include "output/table_channels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "output/colour.h"
#include "solar/solar_spectrum.h"

namespace twilight {

TableSpectrum table_spectrum_from_name(const std::string& name) {
  if (name == "rgb") return TableSpectrum::kRgb;
  if (name == "wavelengths") return TableSpectrum::kWavelengths;
  throw std::invalid_argument(fmt::format("--spectrum {}: must be one of rgb, wavelengths", name));
}

TableChannels::TableChannels(const SceneModel& model, TableSpectrum spectrum)
    : spectrum_(spectrum) {
  const std::vector<double>& nm = model.medium.wavelength_nm;
  weight_.assign(nm.size(), {});
  if (spectrum == TableSpectrum::kRgb) {
    names_ = {"R", "G", "B"};
    const double per_distance = 1.0 / (model.sun_distance_au * model.sun_distance_au);
    const ColourIntegrator integrator(
        nm,
        [&](double at_nm) {
          return per_distance * solar_irradiance_w_m2_nm(model.scene.sun.spectrum, at_nm);
        },
        colour_observer_from_name(model.scene.output.colour_observer));
    for (std::size_t w = 0; w < nm.size(); ++w) {
      weight_[w] = linear_rec709(integrator.weights()[w]);
    }
  } else {
    constexpr ChannelTriple kWanted_nm = {680, 550, 440};
    std::array<std::size_t, 3> at{};
    for (std::size_t c = 0; c < 3; ++c) {
      at[c] = static_cast<std::size_t>(
          std::ranges::min_element(nm, {}, [&](double x) { return std::abs(x - kWanted_nm[c]); }) -
          nm.begin());
      wavelength_nm_[c] = nm[at[c]];
      names_[c] = fmt::format("{} nm", nm[at[c]]);
      weight_[at[c]][c] = model.solar_irradiance[at[c]];
    }
    if (at[0] == at[1] || at[1] == at[2]) {
      throw std::invalid_argument(fmt::format(
          "key 'spectrum.wavelengths_nm': {}, {} and {} nm are nearest to 680, 550 and 440: "
          "--spectrum wavelengths must have three of them",
          nm[at[0]], nm[at[1]], nm[at[2]]));
    }
  }
  solar_ = radiance<double>(std::vector<double>(nm.size(), 1.0));
}

std::string TableChannels::unit() const {
  return spectrum_ == TableSpectrum::kRgb
             ? "W m^-2 sr^-1, linear Rec. 709; white (1, 1, 1) is 683 cd/m^2"
             : "W m^-2 sr^-1 nm^-1";
}

ChannelTriple TableChannels::mean(std::span<const double> spectrum) const {
  ChannelTriple out = radiance<double>(spectrum);
  for (std::size_t c = 0; c < 3; ++c) out[c] /= solar_[c];
  return out;
}

}  // namespace twilight
