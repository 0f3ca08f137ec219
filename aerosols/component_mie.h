// Optics of an aerosol component from its microphysics.
#pragma once

#include <complex>

#include "aerosols/components.h"
#include "aerosols/size_distribution.h"

namespace twilight {

/// Optics of a component for a number density of 1 particle cm^-3.
struct ComponentOptics {
  double scattering_per_km = 0.0;
  double absorption_per_km = 0.0;
  double asymmetry = 0.0;  ///< scattering-weighted mean cosine, (-1, 1)

  double extinction_per_km() const { return scattering_per_km + absorption_per_km; }
  double single_scattering_albedo() const { return scattering_per_km / extinction_per_km(); }
};

/// Radii per e-fold of radius in the size integral of the shipped table.
inline constexpr int kRadiiPerEfold = 1600;

/// Extinction and asymmetry of a state at a wavelength in nm (250..1000): the cross sections
/// Q pi r^2 of mie_efficiencies() integrated over the size distribution by the midpoint rule
/// in ln r (Haber et al. 2005, Sec. 4.5.2: averaging the exact expressions over the
/// particles). The more radii, the better the ripple of large transparent spheres averages.
/// Throws std::invalid_argument for a wavelength out of range or radii_per_efold < 1.
ComponentOptics integrate_component(const ComponentState& state, double wavelength_nm,
                                    int radii_per_efold = kRadiiPerEfold);

/// The same integrals for spheres of any sizes and one refractive index m = n - i k relative to air
/// (k >= 0 absorbs), at a wavelength in nm; for dN/d ln r in cm^-3 the coefficients are km^-1.
/// Throws std::invalid_argument for radii_per_efold < 1, a range of radii or a wavelength that is
/// not positive, sizes that do not scatter, and what mie_efficiencies() refuses.
ComponentOptics integrate_spheres(const SizeDistribution& sizes, std::complex<double> index,
                                  double wavelength_nm, int radii_per_efold = kRadiiPerEfold);

}  // namespace twilight
