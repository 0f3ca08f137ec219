#include "sim/exchange_optics.h"

#include <algorithm>

#include "sim/spectral_lanes.h"

namespace twilight {

ExchangeOptics make_exchange_optics(const Medium& medium, const ExchangeOptions& options) {
  ExchangeOptics o;
  const std::size_t n = medium.layers(), W = medium.wavelengths();
  const std::size_t L = padded_lanes(W);
  o.lanes = L;
  for (auto* v : {&o.s0, &o.s1, &o.s2, &o.air, &o.aerosol, &o.asymmetry}) v->assign(n * L, 0.0F);
  o.rayleigh_x2.assign(L, 0.0F);
  o.extinction = LayerTable(n, W);
  o.beam_extinction = LayerTable(n, W);
  for (std::size_t w = 0; w < W; ++w) {
    // Legendre coefficient of (3/4)(1 + cos^2) is 1/10; depolarised air: Bucholtz (1995) Eq. 12.
    const double rho = medium.depolarisation.empty() ? 0.0 : medium.depolarisation[w];
    const double gamma = rho / (2 - rho);
    const double x2 = options.rayleigh ? (1 - gamma) / (10 * (1 + 2 * gamma)) : 0.0;
    o.rayleigh_x2[w] = static_cast<float>(x2);
    for (std::size_t i = 0; i < n; ++i) {
      const double air = medium.air_scattering_per_km(i, w);
      const double aerosol = medium.aerosol_scattering_per_km(i, w);
      const double g = medium.aerosol_asymmetry(i, w);
      const double absorbed =
          medium.aerosol_absorption_per_km(i, w) + medium.gas_absorption_per_km(i, w);
      double scaled = aerosol, a1 = 0, a2 = 0;
      if (options.similarity) {
        scaled = aerosol * (1 - g);
      } else {
        // Delta-M (Wiscombe 1977): the moments of degree 3 and above go into the beam.
        const double f = g > 0 ? g * g * g : 0.0;
        scaled = aerosol * (1 - f);
        a1 = (g - f) / (1 - f);
        a2 = (g * g - f) / (1 - f);
      }
      const std::size_t at = i * L + w;
      o.air[at] = static_cast<float>(air);
      o.aerosol[at] = static_cast<float>(aerosol);
      o.asymmetry[at] = static_cast<float>(g);
      o.s0[at] = static_cast<float>(air + scaled);
      o.s1[at] = static_cast<float>(3 * scaled * a1);
      o.s2[at] = static_cast<float>(7.5 * (air * x2 + scaled * a2));
      o.extinction(i, w) = air + scaled + absorbed;
      o.beam_extinction(i, w) =
          options.similarity ? air + aerosol + absorbed : air + scaled + absorbed;
    }
  }
  return o;
}

Medium beam_medium(const Medium& medium, const ExchangeOptics& optics) {
  Medium beam = medium;
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    for (std::size_t w = 0; w < medium.wavelengths(); ++w) {
      beam.aerosol_scattering_per_km(i, w) = std::max(
          0.0, optics.beam_extinction(i, w) - medium.air_scattering_per_km(i, w) -
                   medium.aerosol_absorption_per_km(i, w) - medium.gas_absorption_per_km(i, w));
    }
  }
  return beam;
}

}  // namespace twilight
