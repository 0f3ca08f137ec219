// The aerosol above a place: OPAC's mixtures and their layers.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "aerosols/components.h"
#include "aerosols/height_profile.h"
#include "aerosols/mixture_component.h"
#include "atmosphere/phase_matrix.h"

namespace twilight {

/// Optics of a mixture, per wavelength.
struct MixtureOptics {
  std::vector<double> scattering_per_km;
  std::vector<double> absorption_per_km;
  std::vector<double> asymmetry;  ///< (-1, 1)
};

/// A height layer of one aerosol mixture: its coefficients where the profile is 1 (for an
/// exponential one extrapolated to z = 0), and the profile they are multiplied with.
struct AerosolLayer : MixtureOptics {
  HeightProfile profile;
};

/// Relative humidity of a layer's particles.
struct LayerHumidity {
  enum class Source {
    kScene,       ///< aerosols.relative_humidity_percent of the scene
    kPercent,     ///< `percent`
    kAtmosphere,  ///< the atmosphere's own at every height
    kTable        ///< the table below, linear between its heights, constant beyond
  };
  Source source = Source::kScene;
  double percent = 0.0;  ///< 0..99
  std::vector<double> heights_km, percents;
};

/// A height layer before its optics are known. Amounts are those where the profile is 1.
struct MixtureLayer {
  HeightProfile profile;
  LayerHumidity humidity;
  std::vector<ComponentAmount> amounts;
  /// Scales the layer to this optical depth.
  std::optional<double> optical_depth_550nm;
};

/// What a scattering matrix belongs to: components at one humidity.
struct Mixture {
  std::vector<ComponentAmount> amounts;
  double relative_humidity_percent = 0.0;
};

/// Names of OPAC's aerosol types, e.g. "continental_clean"; ten of them. "none" is not one.
std::vector<std::string_view> aerosol_types();

/// Particles per cm^3 of each component at the ground for an OPAC type, in the order of
/// AerosolComponent (Hess, Koepke & Schult 1998). Throws std::invalid_argument for an unknown
/// type; the message lists the names.
std::array<double, kAerosolComponents> ground_number_densities_per_cm3(std::string_view type);

/// The layers of an OPAC type: mixing layer at the humidity of the scene (kScene), free troposphere
/// up to 12 km at 50 %, stratosphere 12..35 km at 0 %. "none" gives no layers. Throws
/// std::invalid_argument for an unknown type; the message lists the names.
std::vector<MixtureLayer> opac_mixture_layers(std::string_view type);

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

/// Vertical extinction optical depth of the layer between two heights in km (z0_km <= z1_km,
/// else throws std::invalid_argument), exact; `wavelength` indexes the layer's vectors and
/// throws std::out_of_range beyond their end.
double optical_depth_between(const AerosolLayer& layer, std::size_t wavelength, double z0_km,
                             double z1_km);

/// Vertical extinction optical depth of the whole layer; `wavelength` as above.
double optical_depth(const AerosolLayer& layer, std::size_t wavelength);

}  // namespace twilight
