// Straight rays between the field's levels, and what each point of them adds.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "atmosphere/medium.h"
#include "atmosphere/refraction.h"

namespace twilight {

/// A point of a ray at which the source is taken; always on a level of the source's altitude grid
/// (a point between two levels is two samples that share its weight).
struct PathSample {
  int level = 0;
  double central_angle_rad = 0;  ///< from the ray's start
  double zenith_rad = 0;         ///< of the look direction, at the point
};

/// How the source runs between the samples of a ray. Light already scattered is smooth: kCubic
/// through four neighbours; direct sunlight has edges: kLinear.
enum class SourceShape { kLinear, kCubic };

/// Weights of the scattering coefficients along one ray: the integral over the ray of
/// exp(-optical depth) times the coefficient times the source is the sum over samples of weight
/// times source at the sample. Weights are exact for a source that is linear along
/// the ray between neighbouring samples, or cubic, as SourceShape says.
struct SampledPath {
  std::vector<PathSample> samples;
  /// [sample][1 + kinds][lane]: of the air, then of each kind of aerosol.
  std::vector<double> weight;
  bool hits_ground = false;
  double ground_angle_rad = 0;               ///< central angle of the point on the ground
  std::vector<double> ground_transmittance;  ///< [lane]
  std::vector<double> scratch;
};

/// Optical coefficients as rays see them, lanes padded with zeros.
struct PathOptics {
  double earth_radius_km = 0;
  std::vector<double> boundary_km;  ///< of the layers
  std::size_t lanes = 0, kinds = 0;
  std::vector<double> extinction_per_km;  ///< [layer][lane]
  std::vector<double> scattering_per_km;  ///< [layer][1 + kinds][lane]: air, kinds of aerosol
  std::vector<char> kind_present;         ///< [layer][kind]
};

/// Follows the straight ray from altitude_km under zenith_rad (0..pi) to the ground or the last
/// boundary, with a sample at every level it crosses, at its perigee, and no further
/// apart than max_angle_rad of central angle. `level_km` increases from 0 to the top.
void sample_path(const PathOptics& optics, std::span<const double> level_km, double altitude_km,
                 double zenith_rad, double max_angle_rad, SourceShape shape, SampledPath& path);

/// The same for a refracted ray.
void sample_path(const PathOptics& optics, std::span<const double> level_km, const RayPath& ray,
                 double max_angle_rad, SourceShape shape, SampledPath& path);

}  // namespace twilight
