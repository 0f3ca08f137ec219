// The aerosol above a place: OPAC's mixtures and their layers.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "aerosols/components.h"
#include "atmosphere/phase_matrix.h"

namespace twilight {

/// A height layer of one aerosol mixture. The coefficients are those at the height where
/// the profile is 1, i.e. extrapolated to z = 0; at height z inside [bottom_km, top_km] they
/// are value * exp(-z / scale_height_km) (Haber et al. 2005, Sec. 4.1.2), outside 0.
struct AerosolLayer {
  double bottom_km = 0.0;
  double top_km = 0.0;
  double scale_height_km = 0.0;           ///< infinity = constant with height
  std::vector<double> scattering_per_km;  ///< per wavelength
  std::vector<double> absorption_per_km;  ///< per wavelength
  std::vector<double> asymmetry;          ///< per wavelength, (-1, 1), same at all heights
};

/// Names of OPAC's aerosol types, e.g. "continental_clean"; ten of them. "none" is not one.
std::vector<std::string_view> aerosol_types();

/// Particles per cm^3 of each component at the ground for an OPAC type, in the order of
/// AerosolComponent (Hess, Koepke & Schult 1998). Throws std::invalid_argument for an unknown
/// type; the message lists the names.
std::array<double, kAerosolComponents> ground_number_densities_per_cm3(std::string_view type);

/// The aerosol of an OPAC type (Hess, Koepke & Schult 1998; Haber et al. 2005, Sec. 4.1.1
/// and Fig. 2) from the ground up: mixing layer at the relative humidity given (percent,
/// 0..99), free troposphere up to 12 km at 50 %, stratosphere 12..35 km at 0 %. Coefficients
/// add up over components; asymmetry is weighted with scattering. `wavelength_nm`: any
/// number of wavelengths, each 280..1000 nm, in any order; the layers' vectors follow it.
/// "none" gives no layers. Throws std::invalid_argument for an unknown type (the message
/// lists the names), a humidity or a wavelength out of range.
std::vector<AerosolLayer> opac_aerosol_layers(std::string_view type,
                                              double relative_humidity_percent,
                                              std::span<const double> wavelength_nm);

/// Scattering matrices of the layers of opac_aerosol_layers(), [layer][wavelength], for the same
/// arguments: those of the components (component_phases()) weighted with number density and
/// scattering coefficient. Between OPAC's humidities a component's matrix goes from class to class
/// as its asymmetry does in component_optics(). Every matrix is normalised and has the angles
/// phase_angles_rad(); its mean cosine is the layer's asymmetry within 3e-4. Takes 0.05 s per
/// wavelength for continental, 0.5 s for maritime mixtures on one core. Throws as
/// opac_aerosol_layers().
std::vector<std::vector<PhaseMatrix>> opac_aerosol_phases(std::string_view type,
                                                          double relative_humidity_percent,
                                                          std::span<const double> wavelength_nm);

/// Mean over [z0_km, z1_km] of the layer's height profile: exp(-z/Z) inside the layer, 0
/// outside, integrated exactly and divided by z1_km - z0_km. Dimensionless; times a
/// coefficient of the layer it gives the mean coefficient. Needs z0_km < z1_km, both
/// finite, else throws std::invalid_argument.
double mean_profile(const AerosolLayer& layer, double z0_km, double z1_km);

/// Vertical extinction optical depth of the layer between two heights in km (z0_km <= z1_km,
/// else throws std::invalid_argument), exact; `wavelength` indexes the layer's vectors and
/// throws std::out_of_range beyond their end.
double optical_depth_between(const AerosolLayer& layer, std::size_t wavelength, double z0_km,
                             double z1_km);

/// Vertical extinction optical depth of the whole layer; `wavelength` as above.
double optical_depth(const AerosolLayer& layer, std::size_t wavelength);

}  // namespace twilight
