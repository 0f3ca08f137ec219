// Photon paths followed backwards from the observer.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "atmosphere/medium.h"
#include "sim/monte_carlo_importance.h"
#include "sim/monte_carlo_leg.h"
#include "sim/monte_carlo_random.h"
#include "sim/monte_carlo_rays.h"
#include "sim/monte_carlo_scattering.h"
#include "sim/monte_carlo_stokes.h"
#include "sim/monte_carlo_sunlight.h"
#include "solar/limb_darkening.h"

namespace twilight {

/// Everything a path needs to know. The observer stands above the centre of the Earth on the z
/// axis; the Sun is in the plane y = 0, towards +x.
struct MonteCarloWorld {
  const Medium* medium = nullptr;
  const MonteCarloSunlight* sunlight = nullptr;
  const MonteCarloScattering* scattering = nullptr;
  const MonteCarloImportance* importance = nullptr;
  std::vector<double> ground_albedo;  ///< per wavelength
  Vec3 sun{0, 0, 1};                  ///< true direction of its centre
  double sun_radius_rad = 0;          ///< 0: a point
  std::vector<LimbDarkening> limb;    ///< per wavelength
  bool polarised = true;
  int most_orders = 0;  ///< 0: no limit
  double observer_height_km = 0;
};

/// The bent ray of one view, per wavelength, and where along it paths begin to scatter. Single
/// scattering is taken on each wavelength's own ray; paths go on from the middle wavelength's
/// (their rays part by 0.01 deg at the horizon). Where that dispersion sends some wavelengths to
/// the ground and others past it, all take the middle one's ray.
class MonteCarloView {
 public:
  /// Apparent elevation, and azimuth from the Sun clockwise seen from above.
  MonteCarloView(const MonteCarloWorld& world, double elevation_rad, double azimuth_rad);

  /// Nothing but space along it.
  bool empty() const { return empty_; }

 private:
  friend class MonteCarloPath;
  struct Point {
    Vec3 position, up, direction, axis;
    double height_km, cos_chi, optical_depth;
    std::size_t layer;
  };
  Point point(std::size_t wavelength, double path_km) const;
  void weigh_pieces();

  const MonteCarloWorld* world_;
  Vec3 horizontal_{1, 0, 0};
  double zenith_rad_ = 0;
  bool empty_ = true, one_ray_ = true;
  std::size_t middle_ = 0;
  std::vector<BentRays::Trace> ray_;        // [wavelength]
  std::vector<std::vector<double>> depth_;  // [wavelength][piece], before it
  std::vector<LegPiece> piece_;  // of the middle wavelength's ray; lit_sum is the probability
  ReferenceValues weight_{};     // 1 / expected radiance
};

/// Sums of one batch: [quantity][wavelength] with I, Q, U and I by order 1..5, 6 and more.
inline constexpr std::size_t kPathQuantities = 9;

/// Follows paths; one object per thread (its buffers are reused).
class MonteCarloPath {
 public:
  explicit MonteCarloPath(const MonteCarloWorld& world);

  /// Adds one path's contributions, E0 = 1, to sums (kPathQuantities x wavelengths).
  void follow(const MonteCarloView& view, PathRandom& random, double* sums);

 private:
  struct State {
    Vec3 position, up, direction, axis;
    double height_km, cos_chi;
    std::size_t layer;
    bool on_ground;
  };
  Vec3 random_sun(PathRandom& random);
  void add_scattered(const State& at, const Vec3& sun, std::size_t first, std::size_t last,
                     int order, double* sums);
  void add_ground(const Vec3& up, const Vec3& sun, std::size_t first, std::size_t last, int order,
                  double* sums);
  Vec3 apparent_sun(const Vec3& up, const Vec3& sun, double cos_chi, double cos_apparent) const;
  bool choose_continuation(const MonteCarloView& view, State& air, const State& ground,
                           bool has_air, bool has_ground, PathRandom& random);
  bool turn(const MonteCarloView& view, State& at, PathRandom& random);
  void scale(const std::vector<double>& factor, double common);
  void add(std::size_t row, std::size_t w, double value, int order, double* sums) const {
    sums[row * W_ + w] += value;
    if (row == 0) {
      sums[(3 + static_cast<std::size_t>(order < 6 ? order - 1 : 5)) * W_ + w] += value;
    }
  }

  const MonteCarloWorld* world_;
  std::size_t W_, G_;
  std::size_t rows_, columns_;
  StokesWeights weights_;
  std::vector<double> irradiance_, cosine_, limb_, depth_;
  std::vector<double> air_factor_, ground_factor_;  // of the leg's collision, of its ground
  std::vector<double> m_;                           // six scattering arrays
  ScatteringMatrices matrices_;
  LegCutter cutter_;
  MonteCarloImportance::LegLight light_;
  std::vector<double> extinction_;  // [layer][wavelength]
  std::vector<double> scattering_;
  bool any_albedo_ = false;
};

}  // namespace twilight
