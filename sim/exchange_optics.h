// Scattering and extinction as the exchange between cells uses them.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"

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

}  // namespace twilight
