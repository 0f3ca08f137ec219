// Rays of light bent by spherical layers of air.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// What becomes of a ray followed from a point out of the atmosphere.
struct RayTrace {
  bool hits_ground = false;  ///< it ends on the ground (or never leaves: see RefractedRays)
  double deflection_rad =
      0.0;  ///< total bending up to its end, >= 0 where density falls with height
  /// Zenith angle, at the start point, of the direction in which it leaves: apparent + deflection.
  double true_zenith_rad = 0.0;
  double perigee_km = 0.0;  ///< lowest altitude reached
};

/// A piece of a ray within one shell of air, on one side of its perigee; the direction is that of
/// travel, away from the start.
struct PathPiece {
  std::size_t layer = 0;
  double length_km = 0.0;
  double start_altitude_km = 0.0, end_altitude_km = 0.0;
  double start_angle_rad = 0.0, end_angle_rad = 0.0;    ///< central angle from the ray's start
  double start_zenith_rad = 0.0, end_zenith_rad = 0.0;  ///< of the direction, local vertical, 0..pi
};

/// A ray followed through the model.
struct RayPath {
  std::vector<PathPiece> pieces;  ///< in the order of travel, inside the model only
  bool hits_ground = false;
  double deflection_rad = 0.0;  ///< as RayTrace, with what bends above the model's top
};

/// Rays of one wavelength through a medium, by Bouguer's law n r sin(theta) = constant (Snell's law
/// for spherical layers; Haber et al. 2005, Sec. 4.4).
///
/// The refractive index is continuous: the layers' refractivities stand at the height where an
/// exponential through the neighbours takes the layer's mean; kinks in their logarithm (profiles
/// are tabulated) are smoothed by parabolas over 2 km on either side where layers are finer; a
/// natural cubic spline of the logarithm joins them, so that bending has a smooth derivative
/// (sunlight's spreading), a line beyond them, and falls off to 0 above the model's top with the
/// topmost scale height. So a horizontal ray inside a layer meets no step of n that could reflect
/// it. Layers are subdivided into shells of at most 0.1 km at the ground and more above, as the air
/// thins; within each shell n ~ r^-k, for which bending is exact, k / (1 - k) times the change of
/// atan(cot(theta)), plus what n's second derivative adds to first order (without it n's slope
/// would step from shell to shell, and with it sunlight's spreading); path length is exact to 1e-8,
/// near a perigee to 1e-4 of the shell's. Zero refractivity gives straight lines exactly.
///
/// Where n falls so fast that n r decreases with height (radii above about 25000 km, or strong
/// inversions), rays can be ducted: one that cannot leave counts as hits_ground, its path ends on
/// the ground or where it turns for the third time.
///
/// Immutable; safe to share between threads. Only the constructor allocates.
class RefractedRays {
 public:
  /// Throws std::invalid_argument for a wavelength index or a medium out of range (no layers,
  /// boundaries not rising from 0, negative or not finite refractivity). refraction = false: rays
  /// are straight whatever the refractivity.
  RefractedRays(const Medium& medium, std::size_t wavelength, bool refraction = true);

  /// Follows the ray that starts at altitude_km (>= 0, tested to 500) under the apparent zenith
  /// angle 0..pi out of the atmosphere or to the ground; downward rays pass their perigee. A
  /// horizontal ray (pi/2 exactly) goes up.
  /// path_km, of size medium.layers() or 0 (not wanted), is set to the length in each layer.
  /// Throws std::invalid_argument for values out of range.
  RayTrace trace_outward(double altitude_km, double apparent_zenith_rad,
                         std::span<double> path_km) const;

  /// The same ray piece by piece, one per shell and leg (no piece crosses a layer boundary or the
  /// perigee), for integrals along it: lengths, angles and deflection are those of trace_outward.
  /// Starts above the model's top run straight to where the air begins, their central angles
  /// counting from the start; no pieces where the ray misses the model.
  RayPath follow(double altitude_km, double apparent_zenith_rad) const;

  /// Refractive index at an altitude (>= 0), as the rays see it.
  double refractive_index(double altitude_km) const;

  /// Apparent zenith angle, 0..pi, under which light arrives from the true (unrefracted) zenith
  /// angle 0..pi at infinity: the search of Haber et al. (2005), Sec. 4.4, by bisection and false
  /// position, to 1e-7 rad. Empty when the Earth hides that direction.
  std::optional<double> apparent_zenith_rad(double altitude_km, double true_zenith_rad) const;

  /// Apparent zenith angle of the ray that grazes the ground (the astronomical horizon with the
  /// dip): pi/2 on the ground. Rays above it leave, rays below it end on the ground. In a ducting
  /// medium the limiting ray that leaves.
  double horizon_apparent_zenith_rad(double altitude_km) const;

  /// The shells, bottom up: shell j lies between boundaries j and j + 1.
  struct Boundary {
    double height_km;
    double v_km;  ///< n r - R: small enough for differences to stay exact
  };
  struct Shell {
    double exponent;        ///< m: n r ~ r^m; 1 without refraction
    double length_factor;   ///< 1 / (m n): length over the change of n r cos(theta)
    double bending_factor;  ///< (1 - m) / m
    double curvature;   ///< second derivative of n over u m^2 n^2, km^-3, u = R + v of the bottom
    std::size_t layer;  ///< kAboveModel beyond the top
  };
  static constexpr std::size_t kAboveModel = static_cast<std::size_t>(-1);
  std::span<const Boundary> boundaries() const { return boundary_; }
  std::span<const Shell> shells() const { return shell_; }
  bool refracting() const { return refracting_; }

 private:
  // Calls visit(Leg) for every shell a ray passes (see refraction.cpp) and returns what becomes of
  // it but for true_zenith_rad.
  template <typename Visit>
  RayTrace march(double altitude_km, double apparent_zenith_rad, const Visit& visit) const;

  // v at any height, and the shell of the boundary at or below it.
  double v_km(double height_km, std::size_t shell) const;
  std::size_t shell_at(double height_km) const;

  double radius_km_;
  std::size_t layers_;
  bool refracting_ = false;
  std::vector<Boundary> boundary_;
  std::vector<Shell> shell_;
};

/// RefractedRays(medium, wavelength).trace_outward(...). Builds the shells anew: in a loop keep a
/// RefractedRays.
RayTrace trace_outward(const Medium& medium, std::size_t wavelength, double altitude_km,
                       double apparent_zenith_rad, std::span<double> path_km);

/// RefractedRays(medium, wavelength).apparent_zenith_rad(...).
std::optional<double> apparent_zenith_rad(const Medium& medium, std::size_t wavelength,
                                          double altitude_km, double true_zenith_rad);

/// RefractedRays(medium, wavelength).horizon_apparent_zenith_rad(...).
double horizon_apparent_zenith_rad(const Medium& medium, std::size_t wavelength,
                                   double altitude_km);

/// Optical depth along a path: sum over layers of extinction x path_km (size medium.layers()).
/// Throws std::invalid_argument when the sizes differ.
double slant_optical_depth(const Medium& medium, std::size_t wavelength,
                           std::span<const double> path_km);

}  // namespace twilight
