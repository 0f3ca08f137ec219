// The scattering matrix of an aerosol component from its microphysics.
#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

#include "aerosols/components.h"
#include "aerosols/size_distribution.h"
#include "atmosphere/phase_matrix.h"

namespace twilight {

/// Radii per e-fold in the size integral of a component's scattering matrix. Interference and
/// narrow resonances of transparent spheres average slowly: 3000 for coarse sea salt, 1600 for fine
/// sea salt, 300 for all others.
int phase_radii_per_efold(AerosolComponent component);

/// Scattering angles of every matrix below, rad: symmetric about 90 degrees, steps growing from
/// 0.02 degrees at both ends (forward peak, glory) to 1 degree.
std::span<const double> phase_angles_rad();

/// Scattering matrix of a state at a vacuum wavelength in nm (250..1000), averaged over the size
/// distribution (Bohren & Huffman 1983, Eq. 4.77, summed over the particles; Haber et al. 2005,
/// Sec. 4.5.2):
///   p11 ~ (|S2|^2 + |S1|^2) / 2,  p12 ~ (|S2|^2 - |S1|^2) / 2,
///   p33 ~ Re(S1 S2*),             p34 ~ Im(S2 S1*),
/// on phase_angles_rad(), midpoint rule in ln r, normalised for the linear interpolant as
/// PhaseMatrix asks. With phase_radii_per_efold() the elements are within 0.1 % of p11 beyond 3
/// degrees, coarse sea salt within 0.3 %; see README.md.
/// Throws std::invalid_argument for a wavelength out of range or radii_per_efold < 1.
PhaseMatrix integrate_component_phase(const ComponentState& state, double wavelength_nm,
                                      int radii_per_efold);

/// A state of component_states() (index) at a wavelength.
struct StateAtWavelength {
  std::size_t state = 0;
  double wavelength_nm = 0.0;
};

/// integrate_component_phase() with phase_radii_per_efold() for many states and wavelengths on all
/// threads; in the order of `wanted`, the same for any number of threads. Throws as above, and for
/// an unknown state.
std::vector<PhaseMatrix> component_phases(std::span<const StateAtWavelength> wanted);

/// Spheres of any sizes and one refractive index m = n - i k at a wavelength.
struct SpheresAtWavelength {
  SizeDistribution sizes;
  std::complex<double> index;
  double wavelength_nm = 0.0;
  int radii_per_efold = 300;
};

/// Scattering matrices of spheres, by the same integrals on all threads; in the order of `wanted`,
/// the same for any number of threads. Throws as integrate_spheres().
std::vector<PhaseMatrix> sphere_phases(std::span<const SpheresAtWavelength> wanted);

/// 1/2 integral of p11 sin(angle) d(angle) of the linear interpolant, exact; 1 for every matrix
/// of this library.
double phase_normalisation(const PhaseMatrix& phase);

/// Mean cosine of the scattering angle of the linear interpolant of p11, exact.
double phase_asymmetry(const PhaseMatrix& phase);

}  // namespace twilight
