// Fitted coefficients as a file that needs no code of ours.
#pragma once

#include <string>

#include "output/atomic_file.h"
#include "output/sky_fit.h"

namespace twilight {

/// The fit as JSON: form and its formula in words, quantity, unit, axes, wavelengths, the Sun's
/// spectrum and irradiance, coefficients [node][channel][k], normalisation [node][channel],
/// transmittance of direct sunlight [node][wavelength]; then per node what is known of its
/// goodness (errors, bounds that were hit, how the search ended), the scene and the version.
/// Numbers keep every bit; the bytes depend on the arguments alone. `version` is the program's.
std::string fit_json(const SkyFit& fit, const std::string& version);

/// Writes it; the commit is the caller's.
void write_fit(AtomicFile& file, const SkyFit& fit, const std::string& version);

}  // namespace twilight
