// A solved sky: what every solver hands to the outputs.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace twilight {

/// A view direction at the observer. Elevation -pi/2..pi/2 (apparent, as seen);
/// azimuth relative to the Sun, 0 = towards it, growing clockwise seen from above.
struct ViewDirection {
  double elevation_rad = 0.0;
  double relative_azimuth_rad = 0.0;
};

/// Horizontal irradiances at the observer per wavelength, W m^-2 nm^-1.
struct Irradiance {
  std::vector<double> direct;
  std::vector<double> diffuse;
};

/// Stokes parameters of sky light, W m^-2 sr^-1 nm^-1, each [view][wavelength]. Q is positive for
/// an electric field in the vertical plane of the view, U for one 45 degrees clockwise of it
/// as the observer sees it. Q and U are empty where a solver is scalar, standard_error (of I,
/// one sigma) where it has no noise.
struct StokesRadiance {
  std::vector<double> i, q, u;
  std::vector<double> standard_error;
};

/// What the air between the observer and a distant object does (aerial perspective): the share of
/// the object's light that arrives, and the light that the air adds, W m^-2 sr^-1 nm^-1, both per
/// wavelength.
struct AerialLight {
  std::vector<double> transmittance, inscattered;
};

/// Where a solved sky came from: figures a run prints and an image's attributes carry.
struct RunSummary {
  std::vector<std::pair<std::string, double>> stage_seconds;
  std::vector<std::pair<std::string, std::string>> figures;  ///< label, value with unit
  /// What a published model was asked outside its range, and what was taken: key, sentence.
  std::vector<std::pair<std::string, std::string>> clamps;
};

class Sky {
 public:
  virtual ~Sky() = default;
  virtual std::span<const double> wavelength_nm() const = 0;
  /// Solar irradiance above the atmosphere, W m^-2 nm^-1, per wavelength.
  virtual std::span<const double> solar_irradiance() const = 0;
  /// Sky radiance, W m^-2 sr^-1 nm^-1, [view][wavelength]; every value finite
  /// and >= 0. Runs on the solver's threads; the same bytes for any number.
  virtual std::vector<double> radiance(std::span<const ViewDirection> views) const = 0;
  /// As radiance(), for maps of the sky: many directions, which a solver may interpolate between
  /// fewer (its summary then says so).
  virtual std::vector<double> map_radiance(std::span<const ViewDirection> views) const {
    return radiance(views);
  }
  /// As radiance(), with polarisation and standard error where the solver knows them;
  /// q^2 + u^2 <= i^2.
  virtual StokesRadiance stokes(std::span<const ViewDirection> views) const {
    return {radiance(views), {}, {}, {}};
  }
  virtual Irradiance irradiance() const = 0;
  /// Apparent (refracted) elevation of the Sun's centre, rad, and transmittance of
  /// the direct beam per wavelength (0 behind the Earth), refractive spreading apart: that flattens
  /// the disc and leaves its radiance alone.
  virtual double apparent_sun_elevation_rad() const = 0;
  virtual std::vector<double> sun_transmittance() const = 0;
  virtual const RunSummary& summary() const = 0;
  /// Aerial perspective over distance_km (>= 0) along a view; the path ends at the ground if that
  /// is nearer. Nothing where the method knows none.
  virtual std::optional<AerialLight> aerial_light(const ViewDirection& view,
                                                  double distance_km) const {
    static_cast<void>(view), static_cast<void>(distance_km);
    return std::nullopt;
  }
  /// The same air, ground and observer under another Sun (geometric elevation, rad; its azimuth,
  /// distance and irradiance stay), where that shares work with this sky; null where it must be
  /// solved anew. Throws as the solver's constructor does.
  virtual std::unique_ptr<Sky> with_sun_at(double sun_elevation_rad) const {
    static_cast<void>(sun_elevation_rad);
    return nullptr;
  }
};

}  // namespace twilight
