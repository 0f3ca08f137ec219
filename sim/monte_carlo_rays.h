// Bent rays of one wavelength, integrated shell by shell for the Monte Carlo.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// One shell's piece of a bent ray. The ray's coordinate is x = n r cos(zenith angle), km, which
/// grows all along it.
struct BentPiece {
  std::size_t layer;        ///< of the medium, or BentRays::kOutside
  double x0_km, x1_km;      ///< at its two ends
  double path0_km;          ///< length of the ray inside the medium before it
  double length_km;         ///< its own (0 outside the medium)
  double bend0_rad;         ///< bending before it
  double bend_rad_per_km;   ///< bending per x
  double path_per_x;        ///< length per x
  double height_km, nr_km;  ///< n r at a height, of the shell's lower boundary
};

/// Rays through n(r) of one wavelength by Bouguer's law: n r sin(zenith angle) = b. The index is
/// the continuous one that every solver shares (see RefractedRays in atmosphere/refraction.h),
/// sampled at shells of at most 0.1 km (0.5 km above 30 km, 1 km above 60 km), in each of which n r
/// is linear in r. Then x = n r cos(zenith angle) is a coordinate without singularity at the
/// perigee: the length is dr/d(nr) dx, the bending -(n'/n) b / (nr d(nr)/dr) dx, whose coefficient
/// is linear in r. The shells err by about (shell / scale height)^2 / 12, 2e-5 of the bending.
/// Below the ground the index goes on for 3 km: rays that graze it there only serve to interpolate
/// smoothly.
class BentRays {
 public:
  static constexpr std::size_t kOutside = static_cast<std::size_t>(-1);

  /// Throws std::invalid_argument where the index falls so fast that rays are ducted.
  BentRays(const Medium& medium, std::size_t wavelength);

  bool refracting() const { return refracting_; }
  double radius_km() const { return radius_km_; }
  /// n r at a height, km: -3 km to infinity.
  double nr_km(double height_km) const;
  /// Bending of the ray from infinity to a height where its apparent zenith angle has this cosine
  /// and sine; negative cosine: it passed its perigee, which may lie underground to -3 km (deeper:
  /// that of -3 km). rad.
  double bending_rad(double height_km, double cosine, double sine) const;

  struct Trace {
    std::vector<BentPiece> pieces;
    double impact_km = 0;  ///< b
    double length_km = 0;  ///< inside the medium
    bool hits_ground = false;
    double bending_rad = 0;  ///< in all
  };
  /// The ray that leaves a height (0 to any) under an apparent zenith angle, to the ground or out.
  Trace trace(double height_km, double apparent_zenith_rad) const;

 private:
  std::size_t shell_at(double height_km) const;
  // Bending over b between two x of a shell.
  double bent(std::size_t shell, double x0, double x1, double impact_squared) const;

  double radius_km_;
  bool refracting_ = false;
  std::vector<double> height_km_, nr_km_, nr_squared_;  // boundaries
  std::vector<double> dr_dnr_;                          // shells
  std::vector<double> bend_, bend_slope_, middle_squared_;
  std::vector<std::size_t> layer_;
  std::size_t ground_ = 0;  // boundary of height 0
};

}  // namespace twilight
