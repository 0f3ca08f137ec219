// Scattering matrices of the air and its aerosols, and how the Monte Carlo samples them.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// Differential scattering of every wavelength: pointers to arrays [wavelength], km^-1 sr^-1, of
///   [ a1 b1  0  0 ]
///   [ b1 a2  0  0 ]
///   [  0  0 a3 b2 ]
///   [  0  0 -b2 a4 ]
/// in the scattering plane's basis.
struct ScatteringMatrices {
  double *a1, *a2, *a3, *a4, *b1, *b2;
};

/// Rayleigh scattering with depolarisation (Hansen & Travis 1974, eq. 2.15) plus the aerosols of a
/// medium: tabulated matrices, or Henyey-Greenstein, which only scatters intensity into
/// unpolarised light.
class MonteCarloScattering {
 public:
  /// reference: up to 3 wavelength indices whose phase functions directions are drawn from.
  MonteCarloScattering(const Medium& medium, std::span<const std::size_t> reference);

  /// Fills all six (scalar = false) or a1 alone, wavelengths first..last - 1.
  void matrices(std::size_t layer, double cosine, std::size_t first, std::size_t last, bool scalar,
                const ScatteringMatrices& out) const;

  /// Cosine of a random scattering angle after (approximately) the phase function of a layer at a
  /// reference wavelength, from two uniform numbers; and its density, sr^-1.
  double sample_cosine(std::size_t layer, std::size_t reference, double u, double v) const;
  double density_per_sr(std::size_t layer, std::size_t reference, double cosine) const;

  /// The same for the aerosol alone, averaged over the column: the shape of the aureole.
  bool has_aerosol() const { return has_aerosol_; }
  double sample_aureole_cosine(std::size_t reference, double u, double v) const;
  double aureole_density_per_sr(std::size_t reference, double cosine) const;

  /// Whether any matrix turns linear into circular polarisation.
  bool circular() const { return !kinds_.empty(); }

 private:
  struct Kind {
    std::vector<double> angle_rad, cosine;
    std::vector<double> value;        // [angle][p11, p12, p33, p34][wavelength]
    std::vector<std::size_t> bucket;  // first interval of equal parts of the angle
    std::vector<double> cumulative;   // [reference][angle]
    std::size_t interval(double angle) const;
  };
  double kind_sample(const Kind& kind, std::size_t reference, double u) const;
  double kind_density(const Kind& kind, std::size_t reference, std::size_t interval) const;

  std::size_t wavelengths_;
  std::vector<std::size_t> reference_;
  std::vector<double> rayleigh_, isotropic_, circular_;  // Delta, 1 - Delta, Delta', [wavelength]
  std::vector<double> air_;                              // [layer][wavelength]
  std::vector<double> aerosol_, asymmetry_;              // Henyey-Greenstein, the same
  std::vector<Kind> kinds_;
  std::vector<std::vector<double>> kind_scattering_;  // [kind][layer][wavelength]
  std::vector<double> share_;             // [layer][reference][air, aerosol kinds...], cumulative
  std::vector<double> column_share_;      // [reference][kind], cumulative
  std::vector<double> column_asymmetry_;  // [reference]
  std::size_t constituents_;
  bool has_aerosol_ = false;
};

}  // namespace twilight
