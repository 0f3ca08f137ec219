// A sky at more wavelengths than were solved.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "sim/sky.h"

namespace twilight {

/// Interpolates spectra between the wavelengths that were solved: what the air does to sunlight is
/// smooth where the Sun's own spectrum is not.
class SpectralInterpolation {
 public:
  /// Both strictly increasing; `solved` has at least one value and is among `wanted`, its ends too.
  /// Throws std::invalid_argument where a wanted wavelength lies beyond the solved ones.
  SpectralInterpolation(std::span<const double> solved_nm, std::span<const double> wanted_nm);

  std::size_t solved() const { return solved_; }
  std::size_t wanted() const { return stencils_.size(); }

  /// Cubic (Lagrange, four neighbours; fewer where there are not as many) in the logarithm of
  /// values >= 0, linear where one of them is 0.
  void logarithmic(std::span<const double> values, std::span<double> out) const;
  /// The same of values of either sign.
  void plain(std::span<const double> values, std::span<double> out) const;

 private:
  struct Stencil {
    std::size_t first = 0, count = 1;
    double weight[4] = {1, 0, 0, 0};
    std::size_t below = 0;  // the linear rule's
    double fraction = 0;
  };
  std::size_t solved_;
  std::vector<Stencil> stencils_;
};

/// Radiance, irradiance and transmittance over solar irradiance are interpolated in the logarithm,
/// Q / I and U / I as they are.
class SpectralSky : public Sky {
 public:
  SpectralSky(std::unique_ptr<Sky> solved, std::vector<double> wavelength_nm,
              std::vector<double> solar_irradiance);

  std::span<const double> wavelength_nm() const override { return wavelength_nm_; }
  std::span<const double> solar_irradiance() const override { return solar_irradiance_; }
  std::vector<double> radiance(std::span<const ViewDirection> views) const override;
  std::vector<double> map_radiance(std::span<const ViewDirection> views) const override;
  StokesRadiance stokes(std::span<const ViewDirection> views) const override;
  Irradiance irradiance() const override;
  double apparent_sun_elevation_rad() const override {
    return solved_->apparent_sun_elevation_rad();
  }
  std::vector<double> sun_transmittance() const override;
  const RunSummary& summary() const override { return solved_->summary(); }
  std::optional<AerialLight> aerial_light(const ViewDirection& view,
                                          double distance_km) const override;
  std::unique_ptr<Sky> with_sun_at(double sun_elevation_rad) const override;

 private:
  std::vector<double> per_sunlight(const std::vector<double>& values) const;

  std::unique_ptr<Sky> solved_;
  std::vector<double> wavelength_nm_, solar_irradiance_;
  SpectralInterpolation interpolation_;
};

}  // namespace twilight
