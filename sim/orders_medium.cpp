#include "sim/orders_medium.h"

#include <algorithm>

#include "sim/spectral_lanes.h"

namespace twilight {

OrdersMedium make_orders_medium(const Medium& medium, std::span<const double> ground_albedo,
                                const OrdersOptions& options) {
  OrdersMedium result;
  const std::size_t lanes = padded_lanes(medium.wavelengths());
  const std::size_t layers = medium.layers(), wavelengths = medium.wavelengths();
  result.lanes = lanes;
  result.darkest_zenith_deg = options.darkest_zenith_deg;
  result.truncated = medium;
  const AerosolKinds kinds = aerosol_kinds(medium);
  if (!kinds.scattering_per_km.empty()) result.degree = options.phase_degree;
  result.kinds = truncate_phases(kinds, result.degree, lanes);
  result.anisotropic_share.assign(lanes, 0.0);
  result.ground_albedo.assign(lanes, 0.0);
  for (std::size_t w = 0; w < wavelengths; ++w) {
    const double rho = medium.depolarisation.empty() ? 0.0 : medium.depolarisation[w];
    result.anisotropic_share[w] = (1 - rho) / (1 + 0.5 * rho);
    result.ground_albedo[w] = ground_albedo[w];
  }
  PathOptics& optics = result.optics;
  optics.earth_radius_km = medium.earth_radius_km;
  optics.boundary_km = medium.boundary_km;
  optics.lanes = lanes;
  optics.kinds = kinds.scattering_per_km.size();
  const std::size_t columns = 1 + optics.kinds;
  optics.extinction_per_km.assign(layers * lanes, 0.0);
  optics.scattering_per_km.assign(layers * columns * lanes, 0.0);
  optics.kind_present.assign(layers * optics.kinds, 0);
  for (std::size_t i = 0; i < layers; ++i) {
    for (std::size_t w = 0; w < wavelengths; ++w) {
      optics.scattering_per_km[i * columns * lanes + w] = medium.air_scattering_per_km(i, w);
      double left = 0;
      for (std::size_t q = 0; q < optics.kinds; ++q) {
        const double all = kinds.scattering_per_km[q](i, w);
        const double kept = all * (1 - result.kinds[q].peak[w]);
        optics.scattering_per_km[(i * columns + 1 + q) * lanes + w] = kept;
        left += kept;
        if (all > 0) {
          optics.kind_present[i * optics.kinds + q] = 1;
          result.aerosol_top_km = std::max(result.aerosol_top_km, medium.boundary_km[i + 1]);
        }
      }
      result.truncated.aerosol_scattering_per_km(i, w) = left;
      optics.extinction_per_km[i * lanes + w] = result.truncated.extinction_per_km(i, w);
    }
  }
  return result;
}

}  // namespace twilight
