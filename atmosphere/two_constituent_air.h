// The air of the real-time models: molecules and haze, each thinning exponentially.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// Air molecules and haze between two spheres, density exp(-h/H) each (Bruneton & Neyret 2008,
/// Eqs. 1-4; the Scratchapixel lesson on Nishita et al. 1993). No refraction, no gases. Molecules
/// scatter after Rayleigh without depolarisation, haze after Cornette and Shanks.
struct TwoConstituentAir {
  double ground_radius_km = 6360.0;
  double top_km = 60.0;  ///< above the ground
  double rayleigh_scale_height_km = 8.0;
  /// Sea-level scattering coefficients of the molecules: between (and beyond) the wavelengths a
  /// power law through the two nearest. Increasing wavelengths, at least one; one: lambda^-4.
  std::vector<double> rayleigh_wavelength_nm;
  std::vector<double> rayleigh_scattering_per_km;
  double mie_scale_height_km = 1.2;
  double mie_scattering_550nm_per_km = 0.02;  ///< at sea level
  double mie_angstrom_exponent = 0.0;         ///< of the haze: scattering ~ lambda^-exponent
  double mie_single_scattering_albedo = 0.9;  ///< 0 < ... <= 1
  double mie_asymmetry = 0.76;                ///< g of cornette_shanks(), (-1, 1)

  /// Sea-level scattering coefficients, km^-1, at a wavelength in nm (> 0).
  double rayleigh_per_km(double wavelength_nm) const;
  double mie_per_km(double wavelength_nm) const;
};

/// As published: "scratchapixel" (the lesson: 6360..6420 km, H 7.994 and 1.2 km, 5.8, 13.5 and
/// 33.1e-6 m^-1 at 680, 550, 440 nm, haze 21e-6 m^-1, extinction 1.1 times that, g 0.76),
/// "scratchapixel_code" (the same but 3.8e-6 m^-1 at 680 nm, as the lesson's listing has it) or
/// "bruneton2008" (their Sec. 2.1 and Fig. 6: 6360..6420 km, H 8 and 1.2 km, 5.8, 13.5 and
/// 33.1e-6 m^-1, haze 2e-5 m^-1, albedo 0.9, g 0.76). Nothing for other names.
///
/// The lesson contradicts itself twice. At 680 nm its text has 5.8e-6 and its listing 3.8e-6:
/// 5.8e-6 is what Rayleigh's law, given a line above, makes of 33.1e-6 at 440 nm, and what the
/// paper it takes its values from has. For haze its text has 210e-5 and its listing 21e-6 m^-1:
/// the former is a vertical optical depth of 2.5, a fog; the pictures are made with the latter. The
/// scale height of the molecules, 8 km in the text, is the listing's 7994 m.
std::optional<TwoConstituentAir> published_air(std::string_view name);

/// The same air in layers for the methods that see it so: each layer's mean. boundary_km from 0 to
/// air.top_km, strictly increasing. The haze carries its phase function as a tabulated matrix with
/// `phase_matrix` (scalar: p12 = 0), else as Henyey-Greenstein of the same mean cosine.
Medium layered(const TwoConstituentAir& air, std::span<const double> wavelength_nm,
               std::vector<double> boundary_km, bool phase_matrix);

}  // namespace twilight
