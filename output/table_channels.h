// The three channels of a renderer's sky tables.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "sim/scene_model.h"

namespace twilight {

using ChannelTriple = std::array<double, 3>;

enum class TableSpectrum {
  kRgb,          ///< linear Rec. 709, integrated over the spectrum ("precomputed luminance")
  kWavelengths,  ///< spectral radiance at the solved wavelengths nearest to 680, 550 and 440 nm
};

/// "rgb" or "wavelengths"; throws std::invalid_argument for another name.
TableSpectrum table_spectrum_from_name(const std::string& name);

/// From spectra per unit solar irradiance to channels.
class TableChannels {
 public:
  /// Of the model's solved wavelengths. Throws std::invalid_argument where kWavelengths finds the
  /// same wavelength twice.
  TableChannels(const SceneModel& model, TableSpectrum spectrum);

  TableSpectrum spectrum() const { return spectrum_; }
  /// Channel's name and the wavelength it holds, nm (0 for kRgb).
  const std::array<std::string, 3>& names() const { return names_; }
  const ChannelTriple& wavelength_nm() const { return wavelength_nm_; }
  /// Unit of radiance in the tables.
  std::string unit() const;

  /// Radiance of a spectrum of radiance over solar irradiance, sr^-1 [wavelength]. kRgb: may be
  /// negative where the colour lies outside Rec. 709.
  template <typename Number>
  ChannelTriple radiance(std::span<const Number> per_sunlight) const {
    ChannelTriple out{};
    for (std::size_t w = 0; w < weight_.size(); ++w) {
      for (std::size_t c = 0; c < 3; ++c) {
        out[c] += weight_[w][c] * static_cast<double>(per_sunlight[w]);
      }
    }
    return out;
  }
  /// Mean of a dimensionless spectrum under the channel's weights: radiance(t) / radiance(1).
  /// That of a transmittance is clamped to 0..1.
  ChannelTriple mean(std::span<const double> spectrum) const;
  /// Solar irradiance above the air, radiance(1).
  const ChannelTriple& solar_irradiance() const { return solar_; }

 private:
  TableSpectrum spectrum_;
  std::array<std::string, 3> names_;
  ChannelTriple wavelength_nm_{}, solar_{};
  std::vector<ChannelTriple> weight_;  // [wavelength]
};

}  // namespace twilight
