// Skies with a formula, to test the outputs without a solver.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "sim/sky.h"

namespace twilight {

class FakeSky : public Sky {
 public:
  /// L/E0 of a view at a wavelength in nm, sr^-1.
  using Formula = std::function<double(const ViewDirection&, double wavelength_nm)>;

  FakeSky(std::vector<double> wavelength_nm, Formula formula)
      : wavelength_nm_(std::move(wavelength_nm)),
        solar_(wavelength_nm_.size(), 1.5),
        transmittance_(wavelength_nm_.size(), 0.0),
        formula_(std::move(formula)) {}

  void set_sun(double apparent_elevation_rad, double transmittance) {
    sun_elevation_rad_ = apparent_elevation_rad;
    transmittance_.assign(wavelength_nm_.size(), transmittance);
  }
  static double solar_irradiance_at(double) { return 1.5; }

  std::span<const double> wavelength_nm() const override { return wavelength_nm_; }
  std::span<const double> solar_irradiance() const override { return solar_; }
  std::vector<double> radiance(std::span<const ViewDirection> views) const override {
    views_asked_ += views.size();
    std::vector<double> result;
    for (const auto& view : views) {
      for (double nm : wavelength_nm_) result.push_back(1.5 * formula_(view, nm));
    }
    return result;
  }
  Irradiance irradiance() const override { return {}; }
  double apparent_sun_elevation_rad() const override { return sun_elevation_rad_; }
  std::vector<double> sun_transmittance() const override { return transmittance_; }
  const RunSummary& summary() const override { return summary_; }
  std::size_t views_asked() const { return views_asked_; }

 private:
  std::vector<double> wavelength_nm_;
  std::vector<double> solar_;
  std::vector<double> transmittance_;
  Formula formula_;
  double sun_elevation_rad_ = -0.1;
  RunSummary summary_;
  mutable std::size_t views_asked_ = 0;
};

inline std::vector<double> fifteen_wavelengths_nm() {
  return {380, 410, 440, 470, 500, 530, 560, 590, 620, 650, 680, 710, 740, 760, 780};
}

/// Looks like dusk: blue above, reddened light low towards the Sun, Earth's
/// shadow opposite. Not physics.
inline double dusk_formula(const ViewDirection& view, double wavelength_nm) {
  const double up = std::max(view.elevation_rad, 0.0);
  const double towards = 0.5 + 0.5 * std::cos(view.relative_azimuth_rad) * std::cos(up);
  const double rayleigh = std::pow(550.0 / wavelength_nm, 4.0);
  const double glow = std::exp(-up / 0.2) * towards * towards;
  const double reddening = std::exp(-rayleigh * (0.1 + 1.6 * glow));
  const double air = 1.0 - std::exp(-0.2 / (std::sin(up) + 0.05));
  const double ground = view.elevation_rad < 0.0 ? 0.05 : 1.0;
  return ground * 1e-5 * rayleigh * reddening * air * (0.4 + 30.0 * glow + towards);
}

}  // namespace twilight
