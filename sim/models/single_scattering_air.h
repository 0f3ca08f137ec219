// The air as single scattering along straight rays sees it.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "sim/scene_model.h"

namespace twilight {

/// A straight line by its perigee, the point nearest to the planet's centre, and places on it by
/// their signed distance from there, s: r = hypot(perigee, s).
struct StraightLine {
  double perigee_radius_km;

  double radius_km(double s_km) const;
  /// Distance from the perigee at which the line is radius_km from the centre; 0 if it never is.
  double half_chord_km(double radius_km) const;
};

/// Integral of exp(-h / scale_height_km) along a line from s = from_km to to_km >= from_km, km; h
/// is the height above ground_radius_km. Sixteen Gauss-Legendre points of sqrt(r - perigee) on each
/// side of the perigee: relative error below 1e-7 for scale heights up to a tenth of the radius.
double exponential_column_km(const StraightLine& line, double from_km, double to_km,
                             double ground_radius_km, double scale_height_km);

/// What scatters and extinguishes between the ground and the top of the air. Heights are km above
/// the ground, coefficients km^-1, all spans of the size wavelengths().
class SingleScatteringAir {
 public:
  virtual ~SingleScatteringAir() = default;
  SingleScatteringAir(const SingleScatteringAir&) = delete;
  SingleScatteringAir& operator=(const SingleScatteringAir&) = delete;

  double ground_radius_km() const { return ground_radius_km_; }
  double top_radius_km() const { return top_radius_km_; }
  std::size_t wavelengths() const { return wavelengths_; }
  /// Heights at which an integral along a ray is best cut, increasing.
  std::span<const double> levels_km() const { return levels_km_; }
  /// Whether coefficients jump at every level and are constant between.
  virtual bool layered() const = 0;

  virtual void extinction(double height_km, std::span<double> per_km) const = 0;
  /// Optical depth along a line between two places; exact for layers, 1e-7 for exponentials.
  virtual void optical_depth(const StraightLine& line, double from_km, double to_km,
                             std::span<double> depth) const = 0;
  /// Scattering at one angle, for angular_scattering(): what stays the same along a straight ray.
  virtual std::vector<double> scattering_at(double cos_angle) const = 0;
  /// Sum over constituents of scattering coefficient times phase function, km^-1 sr^-1.
  virtual void angular_scattering(std::span<const double> scattering_at, double height_km,
                                  std::span<double> per_km_sr) const = 0;
  /// Optical depth of a filter that sunlight passes once, above the air.
  std::span<const double> sunlight_filter() const { return filter_; }

 protected:
  SingleScatteringAir(double ground_radius_km, double top_km, std::size_t wavelengths)
      : ground_radius_km_(ground_radius_km),
        top_radius_km_(ground_radius_km + top_km),
        wavelengths_(wavelengths),
        filter_(wavelengths, 0.0) {}

  double ground_radius_km_, top_radius_km_;
  std::size_t wavelengths_;
  std::vector<double> levels_km_, filter_;
};

/// The air of a model: its two exponential constituents where it has them, else its layers, with
/// Rayleigh's phase function (and depolarisation), the aerosol kinds' p11, or Henyey-Greenstein's
/// per layer. Throws nothing.
std::unique_ptr<const SingleScatteringAir> single_scattering_air(const SceneModel& model);

}  // namespace twilight
