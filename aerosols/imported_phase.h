// Scattering matrices from elsewhere, made to be what PhaseMatrix promises.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "aerosols/particle_optics.h"

namespace twilight {

/// A matrix whose normalisation is off by no more is scaled; beyond it is refused. OPAC's 112
/// angles and libRadtran's single precision need per cents; a wrong unit is off by factors.
inline constexpr double kPhaseNormalisationTolerance = 0.05;
/// How far below 0 a phase function of mean 1 may swing (a series cut short) and be set to 0.
inline constexpr double kPhaseBelowZero = 0.01;
/// sqrt(p12^2 + p33^2 + p34^2) may exceed p11 by this share (and by kPhaseBelowZero), in which case
/// the three are scaled down to it.
inline constexpr double kPhaseBeyondP11 = 0.02;
/// Largest difference of a file's asymmetry from the mean cosine of its phase function: OPAC's is
/// a coarse sum, up to 0.012 off (README.md).
inline constexpr double kAsymmetryTolerance = 0.05;

/// Throws what is wrong with an element ("angle", "p11", "p12", ...) of a matrix.
using RefuseElement = std::function<void(std::string_view element, const std::string& what)>;

/// Checks a matrix and makes it fulfil PhaseMatrix: angles from 0 to 180 degrees (to 1e-3 degrees)
/// strictly increasing, every value finite, p11 not negative, no more polarised than possible,
/// normalised for the linear interpolant. Calls `refuse`, which throws, for what it cannot mend
/// within the bounds above.
void normalise_imported(PhaseMatrix& phase, const RefuseElement& refuse);

/// p33 of a matrix of which p11 alone is known, and p12 and p34 are taken to be 0:
/// p11 2c / (1 + c^2), c = cos(angle), as Rayleigh's: symmetry asks for +p11 forward and -p11 back.
std::vector<double> unpolarised_p33(std::span<const double> angle_rad, std::span<const double> p11);

/// The matrix on phase_angles_rad() of Legendre series, value = sum of moment_l P_l(cos(angle)),
/// the factor 2l + 1 being part of the moments; moments of p12, p33, p34 may be empty: 0, all three
/// of them: unpolarised_p33(). At most 5001 moments. Normalised as above.
PhaseMatrix phase_of_moments(const std::array<std::vector<double>, 4>& moments,
                             const RefuseElement& refuse);

/// Every table's sizes, order and ranges as ParticleOptics says, coefficients finite, not
/// negative and not all zero, asymmetry within (-1, 1) and that of the phase function. Throws
/// std::invalid_argument "FILE: WHAT".
void require_particle_optics(const ParticleOptics& optics, const std::string& file);

/// One table of the humidities of several, of the same wavelengths and kind, in rising order.
/// Throws std::invalid_argument "FILE: ..." for those that differ.
ParticleOptics joined_humidities(std::vector<ParticleOptics> tables, const std::string& file);

}  // namespace twilight
