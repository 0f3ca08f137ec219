// Options of the published sky models (solver.method "preetham", "nishita", ...).
#pragma once

#include <optional>
#include <string>

namespace twilight {

/// What the published models share.
struct ModelOptions {
  /// "published": the model's own air, as its text gives it, for "nishita" and "bruneton"; "scene":
  /// the scene's atmosphere and aerosols. optical_layers and a profile that names published air are
  /// taken either way. The models with no air of their own derive their turbidity from the scene's
  /// unless it is given.
  std::string air = "published";
  /// Outside a model's range (a Sun below the horizon, turbidities it was not fitted to, observers
  /// above the ground): "error", or "clamp" to its edge, which summary and images then record.
  std::string out_of_range = "error";
};

/// Changes to the air of atmosphere.profile "scratchapixel" or "bruneton2008" and of the methods
/// "nishita" and "bruneton" with their published air; unset: as published. Other planets are made
/// of these and earth.radius_km.
struct TwoConstituentOptions {
  std::optional<double> top_km;                            ///< 1..1000
  std::optional<double> rayleigh_scale_height_km;          ///< 0.1..100
  std::optional<double> rayleigh_scattering_550nm_per_km;  ///< 0..10, then as lambda^-4
  std::optional<double> mie_scale_height_km;               ///< 0.1..100
  std::optional<double> mie_scattering_550nm_per_km;       ///< 0..10
  std::optional<double> mie_angstrom_exponent;             ///< -4..4
  std::optional<double> mie_single_scattering_albedo;      ///< 0.01..1
  std::optional<double> mie_asymmetry;                     ///< g of Cornette-Shanks, -0.99..0.99
};

}  // namespace twilight
