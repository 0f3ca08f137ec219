// Phase functions of aerosols with their forward peak removed.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// The aerosol of a medium as kinds of one phase matrix each, whichever way the medium gives it.
struct AerosolKinds {
  std::vector<LayerTable> scattering_per_km;           ///< [kind](layer, wavelength)
  std::vector<std::vector<const PhaseMatrix*>> phase;  ///< [kind][wavelength]; empty: by g
  std::vector<std::vector<double>> asymmetry;          ///< [kind][wavelength], where by g
};

/// The result points into `medium`. Layers of one asymmetry make one kind where there are no
/// tables.
AerosolKinds aerosol_kinds(const Medium& medium);

/// A kind of aerosol, its forward peak removed (delta-M, Wiscombe 1977) at a degree: expansion
/// coefficients [l][lane] in the notation of AngularBasis, of a matrix normalised to 1.
/// Henyey-Greenstein scattering depolarises: it has a1 alone.
struct TruncatedPhase {
  std::vector<double> a1, b1, a2, a3;
  std::vector<double> peak;  ///< fraction of the scattering that counts as unscattered, [lane]
};

std::vector<TruncatedPhase> truncate_phases(const AerosolKinds& kinds, int degree,
                                            std::size_t lanes);

}  // namespace twilight
