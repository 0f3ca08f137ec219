// The optical description of the air that every solver shares.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/phase_matrix.h"

namespace twilight {

/// A dense table [layer][wavelength], row-major.
class LayerTable {
 public:
  LayerTable() = default;
  LayerTable(std::size_t layers, std::size_t wavelengths, double value = 0.0)
      : wavelengths_(wavelengths), values_(layers * wavelengths, value) {}

  double& operator()(std::size_t layer, std::size_t wavelength) {
    return values_[layer * wavelengths_ + wavelength];
  }
  double operator()(std::size_t layer, std::size_t wavelength) const {
    return values_[layer * wavelengths_ + wavelength];
  }
  std::size_t size() const { return values_.size(); }

 private:
  std::size_t wavelengths_ = 0;
  std::vector<double> values_;
};

/// Spherical shells of constant optical properties around the Earth
/// (Haber et al. 2005, Sec. 4.1.2). Layer i spans
/// [boundary_km[i], boundary_km[i+1]] above the sphere of radius
/// earth_radius_km; boundary_km[0] = 0 is the ground.
/// Every coefficient is the layer's mean, in km^-1, and is >= 0.
struct Medium {
  double earth_radius_km = 6371.0;
  std::vector<double> wavelength_nm;  ///< size W, vacuum-air difference ignored
  std::vector<double> boundary_km;    ///< size N+1, strictly increasing from 0

  LayerTable air_scattering_per_km;  ///< Rayleigh
  LayerTable aerosol_scattering_per_km;
  LayerTable aerosol_absorption_per_km;
  LayerTable aerosol_asymmetry;        ///< Henyey-Greenstein g, (-1, 1)
  LayerTable gas_absorption_per_km;    ///< ozone, nitrogen dioxide
  LayerTable refractivity;             ///< n - 1 at the layer's mean density
  std::vector<double> depolarisation;  ///< of air, per wavelength, in [0, 6/7)

  /// Kinds of aerosol with a tabulated scattering matrix, [kind][wavelength], and the scattering
  /// coefficient of each kind, [kind](layer, wavelength); the kinds add up to
  /// aerosol_scattering_per_km. Both empty: every aerosol scatters after Henyey and Greenstein
  /// with aerosol_asymmetry, and leaves the light unpolarised.
  std::vector<std::vector<PhaseMatrix>> aerosol_phase;
  std::vector<LayerTable> aerosol_kind_scattering_per_km;

  /// Vertical ozone optical depth above the model per wavelength, the paper's
  /// filter (Sec. 4.3), applied once to sunlight; empty where ozone is layered.
  std::vector<double> vertical_filter_optical_depth;

  // State of each layer, size N, for reports; empty for a user's own layers.
  std::vector<double> pressure_hpa;
  std::vector<double> temperature_k;
  std::vector<double> relative_humidity;  ///< 0..1 over liquid water

  /// Gives every table the size layers() x wavelengths() and sets it to 0; boundary_km and
  /// wavelength_nm come first.
  void zero_tables() {
    const LayerTable zero(layers(), wavelengths());
    air_scattering_per_km = zero;
    aerosol_scattering_per_km = zero;
    aerosol_absorption_per_km = zero;
    aerosol_asymmetry = zero;
    gas_absorption_per_km = zero;
    refractivity = zero;
  }

  std::size_t layers() const { return boundary_km.empty() ? 0 : boundary_km.size() - 1; }
  std::size_t wavelengths() const { return wavelength_nm.size(); }
  double top_km() const { return boundary_km.back(); }

  /// Extinction coefficient, km^-1: scattering plus absorption of all constituents.
  double extinction_per_km(std::size_t layer, std::size_t wavelength) const {
    return air_scattering_per_km(layer, wavelength) + aerosol_scattering_per_km(layer, wavelength) +
           aerosol_absorption_per_km(layer, wavelength) + gas_absorption_per_km(layer, wavelength);
  }
};

}  // namespace twilight
