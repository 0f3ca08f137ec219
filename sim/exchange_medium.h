// Extinction of the medium as the kernels of the exchange read it.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// Extinction of the medium, laid out for the kernels: float, wavelengths in lanes.
struct ExchangeMedium {
  double earth_radius_km = 0;
  int layers = 0;
  std::size_t lanes = 0, wavelengths = 0;
  std::vector<double> largest;      ///< [layer]: extinction at the most opaque wavelength, km^-1
  std::vector<double> boundary_km;  ///< [layers + 1]
  std::vector<float> extinction;    ///< [layer][lane], km^-1
  std::vector<float> step;          ///< [boundary][lane]: extinction below minus above, km^-1
};

/// ext(layer, wavelength) in km^-1 of each layer, padded to `lanes`.
ExchangeMedium make_exchange_medium(const Medium& medium, std::size_t lanes,
                                    const LayerTable& extinction_per_km);

}  // namespace twilight
