// The air as the tables of Bruneton & Neyret see it: a Rayleigh term, a Mie term, absorption.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sim/models/bruneton_mapping.h"
#include "sim/scene_model.h"

namespace twilight {

/// Coefficients against altitude, and their sums along straight rays. From the published air of two
/// constituents, exactly, or from a scene's layers. The model has one phase function for all
/// aerosol at a wavelength: of layered air Henyey-Greenstein with the asymmetry averaged over the
/// column, weighted with scattering.
class BrunetonAir {
 public:
  explicit BrunetonAir(const SceneModel& model);

  const BrunetonSphere& sphere() const { return sphere_; }
  std::size_t wavelengths() const { return rayleigh_.size(); }
  /// Whether coefficients jump between layers.
  bool layered() const { return !boundaries_are_free_; }

  /// Scattering coefficients at a radius, km^-1, [wavelength].
  void scattering(double radius_km, std::span<double> rayleigh, std::span<double> mie) const;
  /// Integrals of both and of the extinction along the ray from radius_km with cosine mu (it may
  /// exceed 1, see bruneton_continued_ray) between two distances (km) on it; dimensionless,
  /// [wavelength]. Layers: exact; exponentials: 1e-7 of it.
  struct Columns {
    std::vector<double> rayleigh, mie, extinction;
  };
  void columns(double radius_km, double mu, double from_km, double to_km, Columns& out) const;

  /// Ground-level scattering coefficients for the proportionality rule, km^-1.
  std::span<const double> ground_rayleigh() const { return rayleigh_; }
  std::span<const double> ground_mie() const { return mie_; }

  /// sr^-1 at an angle's cosine; the asymmetry g of a wavelength, and whether 1 + cos^2 belongs to
  /// it (Cornette-Shanks) or not (Henyey-Greenstein).
  double mie_phase(std::size_t wavelength, double cos_angle) const;
  double asymmetry(std::size_t wavelength) const { return asymmetry_[wavelength]; }
  bool cornette_shanks_phase() const { return two_.has_value(); }

 private:
  void add_piece(double impact_squared, double from, double to, std::size_t shell,
                 std::span<double, 2> densities, Columns& out) const;

  BrunetonSphere sphere_;
  std::optional<TwoConstituentAir> two_;
  Medium medium_;
  bool boundaries_are_free_ = true;
  std::vector<double> shell_radius_;  // boundaries, ground first
  std::vector<double> rayleigh_, mie_, asymmetry_;
};

/// Rayleigh's phase function, sr^-1 (Eq. 2).
double bruneton_rayleigh_phase(double cos_angle);

}  // namespace twilight
