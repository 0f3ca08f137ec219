// Where the light comes from, roughly: what the Monte Carlo's paths are drawn towards.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "atmosphere/medium.h"
#include "sim/monte_carlo_leg.h"
#include "sim/monte_carlo_scattering.h"
#include "sim/monte_carlo_sunlight.h"

namespace twilight {

/// At most this many wavelengths steer the paths of all.
inline constexpr std::size_t kMostReferences = 3;
using ReferenceValues = std::array<double, kMostReferences>;

/// A piece of a leg with the light it sends along the leg, per reference wavelength weighted.
struct LegPiece {
  double start_km, length_km;
  std::size_t layer;
  double lit_sum;       ///< expected light up to and including this piece
  double analogue_sum;  ///< probability of scattering up to and including it
};

/// Rough estimates of the light field of one medium under a Sun: the sunlight and the mean radiance
/// of light scattered isotropically a few times, at any altitude and solar zenith angle, and the
/// sky's distribution over directions there. They only choose where paths go; every choice has a
/// known density with which the path's weight is divided, so their errors cost time, never
/// truth. Per reference wavelength.
class MonteCarloImportance {
 public:
  /// cos_chi_observer: the paths begin near this solar zenith angle. Runs on the current oneTBB
  /// arena; check is called now and then.
  MonteCarloImportance(const Medium& medium, std::span<const std::size_t> reference,
                       std::span<const double> ground_albedo, const MonteCarloSunlight& sunlight,
                       const MonteCarloScattering& scattering, double cos_chi_observer,
                       const std::function<void()>& check);

  std::size_t references() const { return reference_.size(); }
  std::span<const std::size_t> reference() const { return reference_; }

  /// A leg's pieces with the light each sends.
  struct LegLight {
    std::vector<LegPiece> pieces;
    ReferenceValues lit{};            ///< light received along the whole leg, E0 = 1, sr^-1
    ReferenceValues transmittance{};  ///< of the whole leg
    ReferenceValues analogue{};       ///< probability of scattering along it
    double lit_total = 0, analogue_total = 0;  ///< sums over references with their weights
  };
  /// Cut crossings of a leg into pieces and weigh them. cosine_start = cos of the solar zenith
  /// angle times the radius, km, at the start; cosine_slope its change per km: (direction . Sun).
  /// phase_air, phase_aerosol: 4 pi x phase function between leg and Sun; weight: of each
  /// reference wavelength.
  void weigh(std::span<const LegCrossing> crossings, double cosine_start, double cosine_slope,
             double phase_air, const ReferenceValues& phase_aerosol, const ReferenceValues& weight,
             LegLight& out) const;

  /// 4 pi x the column's aerosol phase function, capped, to be given to weigh().
  ReferenceValues aerosol_phase(double cosine) const;

  /// Sunlight and mean scattered radiance at the middle of a layer, one after the other per
  /// reference.
  const float* source(std::size_t layer, double cos_chi, double& fraction) const;
  double scattered(std::size_t layer, double cos_chi, std::size_t reference) const;
  double ground_scattered(double cos_chi, std::size_t reference) const;
  double scattering_per_km(std::size_t layer, std::size_t reference) const {
    return scattering_[layer * reference_.size() + reference];
  }

  /// The nodes of the directional guide around a point, with shares that add up to 1.
  struct Guide {
    std::array<std::size_t, 4> node{};
    std::array<double, 4> share{};
    double dip_rad = 0;  ///< of the horizon, which the nodes' elevations are counted from
  };
  Guide guide(double height_km, bool on_ground, double cos_chi) const;
  /// Draws the sine of the elevation and the azimuth from the Sun (rad, either side) after a
  /// mixture of the nodes, from three uniform numbers; and its density, sr^-1.
  void sample_direction(const Guide& guide, std::size_t reference, double u, double v, double w,
                        double& sine, double& azimuth) const;
  /// Per reference wavelength.
  ReferenceValues direction_density_per_sr(const Guide& guide, double sine,
                                           double cos_azimuth) const;

  struct Bins;

 private:
  double dip_rad(double height_km) const;
  void sweep(bool last, const std::function<void()>& check);

  std::vector<std::size_t> reference_;
  const MonteCarloSunlight* sunlight_;
  const MonteCarloScattering* scattering_model_;
  std::vector<double> boundary_km_;
  double radius_km_;
  std::vector<double> albedo_;                         // [reference]
  std::vector<double> extinction_, scattering_, air_;  // [layer][reference]
  std::vector<float> source_;                          // [layer][cosine][reference][sun, rest]
  std::vector<float> ground_sun_, ground_source_;      // [cosine][reference]
  std::vector<double> node_height_km_, node_chi_rad_;
  std::vector<double> node_mean_;  // [altitude][chi][reference]
  std::vector<float> guide_;       // [node][reference][bin], cumulative
};

}  // namespace twilight
