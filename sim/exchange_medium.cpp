#include "sim/exchange_medium.h"

#include <algorithm>

namespace twilight {

ExchangeMedium make_exchange_medium(const Medium& medium, std::size_t lanes,
                                    const LayerTable& extinction_per_km) {
  ExchangeMedium m;
  m.earth_radius_km = medium.earth_radius_km;
  m.layers = static_cast<int>(medium.layers());
  m.lanes = lanes;
  m.boundary_km = medium.boundary_km;
  const std::size_t n = medium.layers(), W = medium.wavelengths();
  m.wavelengths = W;
  m.largest.assign(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t w = 0; w < W; ++w)
      m.largest[i] = std::max(m.largest[i], extinction_per_km(i, w));
  }
  m.extinction.assign(n * lanes, 0.0F);
  m.step.assign((n + 1) * lanes, 0.0F);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t w = 0; w < W; ++w) {
      m.extinction[i * lanes + w] = static_cast<float>(extinction_per_km(i, w));
    }
  }
  for (std::size_t i = 1; i < n; ++i) {
    for (std::size_t w = 0; w < W; ++w) {
      m.step[i * lanes + w] = m.extinction[(i - 1) * lanes + w] - m.extinction[i * lanes + w];
    }
  }
  return m;
}

}  // namespace twilight
