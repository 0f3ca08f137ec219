// OPAC's published component optics, for comparison.
#pragma once

#include "aerosols/components.h"

namespace twilight::opac {

/// One row of OPAC's component files (Hess, Koepke & Schult 1998), per particle cm^-3.
struct PublishedOptics {
  AerosolComponent component;
  double humidity_percent, wavelength_nm;
  double extinction_per_km, single_scattering_albedo, asymmetry;
};

using enum AerosolComponent;
inline constexpr PublishedOptics kPublishedOptics[] = {
#include "opac_component_optics.inc"
};

}  // namespace twilight::opac
