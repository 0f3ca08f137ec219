// Multiple scattering: the exchange of light between cells (Haber et al. 2005, Sec. 4.6, 5).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "atmosphere/medium.h"
#include "sim/cell_grid.h"
#include "sim/direct_sunlight.h"
#include "sim/exchange_kernel.h"
#include "sim/run_control.h"

namespace twilight {

/// How scattering inside the exchange is modelled.
struct ExchangeOptions {
  int scattering_orders = 8;  ///< scattering events followed, the first included
  /// Air scatters by the Rayleigh phase function in every event, or isotropically.
  bool rayleigh = true;
  /// Aerosol phase function: false = delta-M truncated to degree 2 in every event;
  /// true = the paper's: Henyey-Greenstein for the first event, then isotropic
  /// with scattering and extinction scaled by 1 - g (Eq. 2).
  bool similarity = false;
  /// true: the paper's rule I_all/I_active for what passive shells would add (Sec. 5).
  bool rescale = false;
  /// Lambertian, 0..1, per wavelength; empty = a black ground.
  std::vector<double> ground_albedo;
  /// Azimuthal modes of a ring pair weaker than this are dropped, and its azimuth samples thinned
  /// accordingly (azimuth_sampling). 0 = none.
  double azimuth_tolerance = 1e-3;
};

/// Optical coefficients of each layer as the exchange uses them, [layer][lane], km^-1.
/// Scattering into direction w of light with moments J, F, S (traceless) is
/// (s0 J + s1 F.w + s2 w.S.w) / (4 pi).
struct ExchangeOptics {
  std::size_t lanes = 0;
  std::vector<float> s0, s1, s2;
  std::vector<float> air;          ///< air scattering
  std::vector<float> aerosol;      ///< aerosol scattering, unscaled
  std::vector<float> asymmetry;    ///< of the aerosol
  std::vector<float> rayleigh_x2;  ///< [lane] second Legendre coefficient of air (0 if isotropic)
  LayerTable extinction;           ///< of light under way between cells
  LayerTable beam_extinction;      ///< of sunlight and of the view ray
};
/// Coefficients of every layer for the given options: delta-M (f = g^3 for g > 0) or similarity (1
/// - g) scaling, Rayleigh with the medium's depolarisation or isotropic air.
ExchangeOptics make_exchange_optics(const Medium& medium, const ExchangeOptions& options);

/// The medium whose extinction the direct beam and the view ray feel: the
/// medium itself, or with the delta-M forward peak of the aerosol taken out.
Medium beam_medium(const Medium& medium, const ExchangeOptics& optics);

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
  double setup_seconds = 0, first_event_seconds = 0, passes_seconds = 0;
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
