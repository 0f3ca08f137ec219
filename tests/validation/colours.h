// Colours of the twilight sky by the orders method: the zenith's blue, the purple light, the
// Earth's shadow and the Belt of Venus.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "output/colour.h"
#include "sim/orders_sky.h"
#include "sim/scene_model.h"
#include "tests/validation/validation.h"

namespace twilight::validation {

using Chromaticity = std::array<double, 2>;  ///< CIE 1931 x, y

inline constexpr Chromaticity kEqualEnergyWhite = {1.0 / 3, 1.0 / 3};

/// The air whose colours are looked at: the U.S. Standard Atmosphere with a column of ozone and an
/// OPAC type, its stratospheric sulphate (12..35 km) changed at will.
struct ColourAir {
  std::string name;
  std::string aerosol = "none";
  double ozone_du = 300;
  double stratosphere_factor = 1;    ///< times the type's own aerosol above 12 km, >= 0
  bool tropospheric_aerosol = true;  ///< false: none below 12 km
};

/// Colour of one direction of the sky.
struct SkyColour {
  Chromaticity xy = {};
  double luminance_cd_m2 = 0;
  LinearRgb rgb = {};            ///< Rec. 709, not gamut-mapped, of Y = 1
  std::vector<double> radiance;  ///< W m^-2 sr^-1 nm^-1, per wavelength
  double red_over_blue = 0;      ///< (L/E0) at 650 nm over that at 450 nm
};

/// Skies of one air under many Suns, from one field.
class ColourSkies {
 public:
  /// `scene` gives wavelengths, ground and the solver's grid; Sun, ozone and aerosol are replaced.
  /// `fields`: a folder where solved fields are kept under the air's name (netCDF) and found
  /// again; empty: none. Throws as build_scene_model.
  ColourSkies(Scene scene, ColourAir air, std::filesystem::path fields = {});

  /// The sky's colours with the Sun at a geometric elevation, deg, one for each view.
  std::vector<SkyColour> look(double sun_deg, std::span<const ViewAngles> views);
  SkyColour zenith(double sun_deg);

  /// L/E0 of a colour at a wavelength in nm within the scene's: lambda^4 L/E0 linear between them.
  double relative_radiance(const SkyColour& colour, double wavelength_nm) const;

  /// Chromaticity of sunlight above the air.
  Chromaticity sunlight() const;
  /// Moves the observer, m above the ground; the field stays.
  void set_height_m(double height_m) { model_.scene.observer.height_m = height_m; }

  const SceneModel& model() const { return model_; }
  /// The sky of the last look().
  const Sky& sky() const { return *sky_; }
  const ColourAir& air() const { return air_; }
  double solve_seconds() const { return solve_seconds_; }
  /// Optical depth at 550 nm (linear between wavelengths) of all aerosol, and of that above 12 km.
  double aerosol_optical_depth(double bottom_km = 0) const;

 private:
  const OrdersSky& under(double sun_deg);

  ColourAir air_;
  SceneModel model_;
  ColourIntegrator integrator_;
  std::filesystem::path fields_;
  std::shared_ptr<const OrdersField> field_;
  std::unique_ptr<OrdersSky> sky_;
  double sky_sun_deg_ = 1e9, sky_height_m_ = -1;
  double solve_seconds_ = 0;
};

/// Share of ozone in the blue of a sky: of the displacement of its chromaticity from white, the
/// part that ozone brings, along the direction of the whole (Lange, Rozanov & von Savigny 2023,
/// Atmos. Chem. Phys. 23, 14829). 0 without ozone; above 1 where the sky would be yellower than
/// white without it.
double ozone_share(const Chromaticity& without, const Chromaticity& with,
                   const Chromaticity& white);

/// Distance from white towards the blue end, positive: bluer than white. The direction is that
/// from white to the spectral locus at 470 nm, (0.1241, 0.0578).
double blueness(const Chromaticity& xy, const Chromaticity& white);

/// min(R, B) / G of the linear Rec. 709 colour: 1 for white, above 1 only where both red and blue
/// outweigh green (purple, pink), below it for blue, green, yellow, orange and red.
double purple_index(const SkyColour& colour);

/// The antisolar sky from the horizon up, by its ratio of red to blue.
struct BeltOfVenus {
  bool exists = false;  ///< a maximum 3 % above the smallest ratio below it, or more
  double belt_deg = 0;  ///< elevation of that maximum; of several the most prominent
  double belt_red_over_blue = 0, belt_x = 0;
  double below_red_over_blue = 0, below_x = 0;  ///< smallest in the segment below
  double shadow_deg = 0;  ///< where the ratio grows fastest between the two: the shadow's edge
};

/// Looks for the belt in colours at growing elevations, deg.
BeltOfVenus find_belt(std::span<const double> elevation_deg, std::span<const SkyColour> colours);

/// Elevations from..to in equal steps, both ends within.
std::vector<double> steps(double from, double to, double step);
std::vector<ViewAngles> vertical(std::span<const double> elevation_deg, double azimuth_deg);

}  // namespace twilight::validation
