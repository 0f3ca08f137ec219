// Levels of quality: settings of the "orders" method with the seconds and errors they were measured
// to have.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "sim/scene.h"

namespace twilight {

/// Sun elevations at which the levels were measured, degrees.
inline constexpr std::array<double, 7> kQualitySun_deg = {30, 5, 0, -3, -6, -9, -12};

/// A level: the steps that it sets, and what was measured with them (sim/README.md, "Quality and
/// budget").
struct QualityLevel {
  std::string_view name;
  double zenith_step_deg;
  int altitude_levels, polar_directions, azimuth_directions, phase_degree;
  double order_tolerance;
  bool coarse_orders;
  int sunlight_nodes;

  /// Processor seconds (user, all threads) of 8 wavelengths in continental average air, polarised.
  double seconds;
  /// Error of the radiance over the hemisphere against finer steps: solid angle weighted mean and
  /// 95th percentile, the wavelength where it is largest, by kQualitySun_deg.
  struct Errors {
    std::array<double, 7> mean, percentile_95;
  };
  Errors clear, hazy, turbid;  ///< no aerosol; continental average; urban
};

/// The levels, from the coarsest.
std::span<const QualityLevel> quality_levels();

/// The level of a name. Throws std::invalid_argument listing the names for another.
const QualityLevel& quality_level(std::string_view name);

/// Optical depth at 550 nm of the most turbid air that the levels were measured in.
inline constexpr double kTurbidOpticalDepth = 0.6;

/// 95th percentile of a level's error with the Sun at an elevation (deg): the larger of the two
/// neighbouring measurements, linear in the aerosol's vertical optical depth (at 550 nm) between
/// clear, hazy and turbid air and proportional to it beyond.
double discretisation_error(const QualityLevel& level, double sun_elevation_deg,
                            double aerosol_optical_depth);

/// Sets the steps whose keys ("solver.zenith_step_deg") are free.
void apply_quality(const QualityLevel& level, const std::function<bool(std::string_view)>& free,
                   SolverOptions& solver);

/// The measurements as lines of text, for --help.
std::string quality_table();

}  // namespace twilight
