// Sunlight scattered for the first time in the cells (Haber et al. 2005, Sec. 4.6.2).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/exchange.h"

namespace twilight {

/// Power that every cell scatters out of the direct beam, per unit solar irradiance, km^2.
struct FirstEvent {
  /// Moments of the emission at each azimuth node, [ring][node][moment][lane]: air (and aerosol
  /// unless it is kept apart), or light reflected by ground patches.
  std::vector<float> source;
  std::vector<float> aerosol_power;  ///< [air ring][node][lane], if kept apart
  std::vector<float> asymmetry;      ///< [air ring][lane], of the aerosol
  std::vector<unsigned char> lit;    ///< [air ring][node]: any sunlight at all
  std::vector<double> power;         ///< [wavelength]: all air cells together, aerosol included
};

/// Evaluates the first `rings` rings of the grid (air, then ground). Cell means sample the
/// sunlight within the cell, else it is taken at the centre. With separate_aerosol the aerosol's
/// share is kept apart, for the paper's Henyey-Greenstein pass. ground_albedo: 0..1 per lane.
/// moments: 1 or kMoments.
FirstEvent first_event(const Medium& medium, const CellGrid& grid, std::size_t rings,
                       const DirectSunlight& sunlight, const SunGeometry& sun,
                       const ExchangeOptics& optics, bool separate_aerosol,
                       std::span<const float> ground_albedo, int moments);

}  // namespace twilight
