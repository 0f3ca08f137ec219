// A scene made physical: Sun, local Earth radius, optical medium.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "aerosols/known_phases.h"
#include "atmosphere/medium.h"
#include "atmosphere/two_constituent_air.h"
#include "sim/orders_field.h"
#include "sim/run_control.h"
#include "sim/scene.h"
#include "sim/sky.h"

namespace twilight {

/// Above this the Sun is placed as from this height: solar/place.h knows no higher ones.
inline constexpr double kHighestPlaceM = 200000.0;

/// Everything a solver needs, resolved from a scene.
struct SceneModel {
  Scene scene;                     ///< as validated; defaults in place
  double sun_elevation_rad = 0.0;  ///< geometric (without refraction), topocentric
  double sun_azimuth_rad = 0.0;    ///< clockwise from north
  double sun_distance_au = 1.0;
  Medium medium;  ///< earth_radius_km included
  /// Where the medium is published air in layers: that air itself.
  std::optional<TwoConstituentAir> two_constituent_air;
  std::vector<double> ground_albedo;     ///< Lambertian, 0..1, per wavelength
  std::vector<double> solar_irradiance;  ///< at the actual distance, W m^-2 nm^-1, per wavelength
};

/// Where the Sun stands over the observer, and the Earth's curve there.
struct PlacedSun {
  double elevation_rad = 0.0;  ///< geometric
  double azimuth_rad = 0.0;    ///< clockwise from north
  double distance_au = 1.0;
  double earth_radius_km = 6371.0;
};

/// Of a valid scene, from its place and time or its [sun]; of the Earth's radius where
/// earth.radius_km is unset.
PlacedSun placed_sun(const Scene& scene);

/// Wavelengths that are solved: spectrum.solved_nm, or all.
const std::vector<double>& solved_wavelengths_nm(const SpectrumOptions& spectrum);

/// Resolves a valid scene. The medium has the wavelengths that are solved, and of `known` those
/// phases that it holds. Throws std::invalid_argument (value and range named) where
/// the scene asks for what the tables do not hold, std::runtime_error on file errors.
SceneModel build_scene_model(const Scene& scene, KnownPhases* known = nullptr);

/// Solves the sky with the scene's solver.method. Throws Cancelled when stopped.
std::unique_ptr<Sky> solve_sky(const SceneModel& model, const RunControl& control = {});

/// A sky of the "orders" method and the field it looks its light up in.
struct FieldSky {
  std::unique_ptr<Sky> sky;
  std::shared_ptr<const OrdersField> field;
};

/// A field alone, and how it was solved.
struct SolvedField {
  std::shared_ptr<const OrdersField> field;
  RunSummary summary;
};

/// Solves the field of a scene whose solver.method is "orders". Throws std::invalid_argument for
/// another method, Cancelled when stopped.
SolvedField solve_field(const SceneModel& model, const RunControl& control = {});

/// The same with the sky of the model's Sun and observer.
FieldSky solve_sky_and_field(const SceneModel& model, const RunControl& control = {});

/// The sky of the model (its Sun, its observer) from a field solved before for the same atmosphere
/// and ground (read_field in output/field_file.h makes sure of that). Throws as solve_field.
FieldSky sky_from_field(const SceneModel& model, std::shared_ptr<const OrdersField> field,
                        const RunControl& control = {});

/// A solved atmosphere that skies of many Suns and observers share (sim/orders_atmosphere.h).
class OrdersAtmosphere;
std::shared_ptr<const OrdersAtmosphere> solve_atmosphere(const SceneModel& model,
                                                         const RunControl& control = {});
/// The sky of the model (its Sun, its observer) in an atmosphere that was solved for a model with
/// the same medium, ground and solver: bit for bit what solve_sky() of the model gives.
/// Milliseconds. Throws as solve_field.
std::unique_ptr<Sky> sky_in_atmosphere(const SceneModel& model,
                                       std::shared_ptr<const OrdersAtmosphere> atmosphere,
                                       const RunControl& control = {});

}  // namespace twilight
