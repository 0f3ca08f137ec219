// What a mixture is made of: OPAC's components, own microphysics, imported tables.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "aerosols/component_optics.h"
#include "aerosols/component_phase.h"
#include "aerosols/components.h"
#include "aerosols/particle_optics.h"
#include "aerosols/size_distribution.h"

namespace twilight {

/// Particles of this effective radius (dry, um) or more are coarse: between the fine and the
/// coarse mode of AERONET's retrievals, which part them at 0.44..0.99 um (Dubovik et al. 2006, J.
/// Geophys. Res. 111, D11208). OPAC's INSO, SSAM, SSCM, MIAM, MICM and MITR are, with 0.7 um and
/// more; its others stay below 0.25 um.
inline constexpr double kCoarseEffectiveRadius_um = 0.5;

/// One kind of particle. Its optics are those of a unit amount: one particle cm^-3, or what per()
/// says. Between its states, tabulated in humidity, optics and scattering matrix are interpolated
/// as component_optics() says.
class MixtureComponent {
 public:
  virtual ~MixtureComponent() = default;

  virtual std::string_view name() const = 0;
  /// Components of one identity have the same optics: the name under which results are kept.
  virtual std::string_view identity() const = 0;
  virtual OpticsPer per() const { return OpticsPer::kParticlePerCm3; }
  /// Relative humidities of its states, percent, strictly increasing; one if it takes up no water.
  virtual std::span<const double> humidities_percent() const = 0;
  virtual bool coarse() const = 0;
  /// Mass of dry matter in one particle cm^-3, ug m^-3; unset: not known.
  virtual std::optional<double> dry_mass_ug_per_m3() const = 0;
  /// Optics at a humidity, where a table holds them; unset: integrate() has to.
  virtual std::optional<ComponentOptics> tabulated(double relative_humidity_percent,
                                                   double wavelength_nm) const = 0;
  /// Optics of a state by Mie's theory. Throws std::logic_error where tables hold them.
  virtual ComponentOptics integrate(std::size_t state, double wavelength_nm) const;
  /// Scattering matrix of a state, where a table holds it; unset: spheres() says of what.
  virtual std::optional<PhaseMatrix> tabulated_phase(std::size_t state, double wavelength_nm) const;
  /// The spheres of a state. Throws std::logic_error where tables hold the matrix.
  virtual SpheresAtWavelength spheres(std::size_t state, double wavelength_nm) const;
};

/// A component and how much of it there is where the height profile is 1, in the unit of its
/// per().
struct ComponentAmount {
  std::shared_ptr<const MixtureComponent> component;
  double amount = 0.0;
};

/// OPAC's component, its optics those of the shipped table. Dry mass: of the radii up to 7.5 um,
/// with the densities of Hess, Koepke & Schult (1998), Table 1c, whose mass per particle it is
/// (dry; theirs of sea salt too).
std::shared_ptr<const MixtureComponent> opac_component(AerosolComponent component);
/// That of a code ("WASO"), or none.
std::shared_ptr<const MixtureComponent> find_opac_component(std::string_view code);

/// n and k of m = n - i k against wavelength, linear between.
struct RefractiveIndexTable {
  std::vector<double> wavelength_nm;  ///< strictly increasing
  std::vector<double> real, imaginary;

  /// Throws std::invalid_argument outside the table, naming both.
  std::complex<double> at(double wavelength_nm) const;
};

/// The microphysics of an own component.
struct Microphysics {
  std::string name;
  /// Of the dry particle, per particle: a lognormal distribution is cut, not renormalised, at its
  /// limits, as OPAC's are.
  SizeDistribution sizes;
  RefractiveIndexTable index;  ///< of the dry matter
  double density_g_cm3 = 0.0;  ///< of the dry matter; 0 = not known
  /// Radius over dry radius at relative humidities, 0 % with factor 1 first; both empty: none.
  std::vector<double> humidity_percent, radius_growth_factor;
  /// Tells distributions apart: all numbers that made `sizes`.
  std::string sizes_text;
};

/// A component of own microphysics. Water is mixed in by volume: radii grow by the factor g, and
/// m = m_water + (m_dry - m_water) / g^3 (Haenel 1976, Adv. Geophys. 19, 73; OPAC's rule). Throws
/// std::invalid_argument where sizes, index or growth are out of range.
std::shared_ptr<const MixtureComponent> own_component(Microphysics microphysics);

/// A component of an imported table; `content` tells tables apart. Without scattering matrices
/// they are Henyey & Greenstein's, and polarise nothing. Humidities and wavelengths outside the
/// table are refused where they are asked for; a table of one humidity serves all. It is coarse
/// where its Angstrom exponent between 440 and 870 nm (or the table's ends) is below 1.
std::shared_ptr<const MixtureComponent> table_component(ParticleOptics table, std::string content);

/// Integral of r^3 dN over that of r^2 dN, um.
double effective_radius_um(const SizeDistribution& sizes);

/// Refractive index of water, Hale & Querry (1973), Appl. Opt. 12, 555, Table I; 250..1000 nm.
const RefractiveIndexTable& water_refractive_index();

}  // namespace twilight
