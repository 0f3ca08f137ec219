// Multiple scattering: the exchange of light between cells (Haber et al. 2005, Sec. 4.6, 5).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "atmosphere/medium.h"
#include "sim/cell_grid.h"
#include "sim/direct_sunlight.h"
#include "sim/exchange_optics.h"
#include "sim/field_moments.h"
#include "sim/run_control.h"

namespace twilight {

/// Scattered light arriving in every cell, per unit solar irradiance: moments at the
/// azimuth nodes j = 0..S/2 of each ring.
struct CellField {
  std::size_t lanes = 0;
  int nodes = 0, moments = 1;
  std::vector<float> values;  ///< [air ring][node][moment][lane]
  const float* at(std::size_t ring, int node) const {
    return &values[((ring * static_cast<std::size_t>(nodes) + static_cast<std::size_t>(node)) *
                    static_cast<std::size_t>(moments)) *
                   lanes];
  }
};

struct ExchangeReport {
  std::size_t cells = 0, active_cells = 0, rings = 0, active_rings = 0, ground_rings = 0;
  int shells = 0, active_shells = 0, azimuth_modes = 0;
  std::uint64_t kernel_evaluations = 0;  ///< ring pairs x azimuth differences x wavelengths
  double first_event_seconds = 0, kernels_seconds = 0, passes_seconds = 0;
  /// Power scattered in each event, [event][wavelength], per unit irradiance, km^2.
  std::vector<std::vector<double>> event_power;
  std::vector<double> escaped, ground_absorbed;  ///< per wavelength, km^2; isotropic emission only
  std::vector<double> rescale_factor;            ///< of the first pass, per wavelength
  double clipped_row_share = 0;  ///< rows whose kernels brought more than interacts: shortened
};

struct ExchangeResult {
  CellField field;
  /// Exitance of the ground by diffuse light, per unit solar irradiance, [ground ring][node][lane].
  std::vector<float> ground_exitance;
  ExchangeReport report;
};

/// Geometry of the Sun for the cells.
struct SunGeometry {
  double elevation_rad = 0;  ///< geometric, at the observer
};

/// Cosine of the solar zenith angle at a point (rho, azimuth from the Sun's, z).
double cos_solar_zenith(const SunGeometry& sun, double earth_radius_km, double observer_height_km,
                        double rho_km, double azimuth_rad, double z_km);

/// Follows the scattering orders. The result is the sum over all orders of the
/// light that arrives scattered (at least once) in the cells. Runs on the
/// current oneTBB arena; the same bytes for any number of threads.
///
/// all_cells, the grid with every shell active, is needed for `rescale` only (else null).
ExchangeResult solve_exchange(const Medium& medium, const CellGrid& grid, const CellGrid* all_cells,
                              const DirectSunlight& sunlight, const SunGeometry& sun,
                              const ExchangeOptics& optics, const ExchangeOptions& options,
                              const RunControl& control);

}  // namespace twilight
