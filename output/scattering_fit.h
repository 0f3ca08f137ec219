// Texels of a scattering table so that its reader gives given radiances.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace twilight {

/// How the reader finds single Mie scattering.
enum class MieStorage {
  kCombined,  ///< alpha holds its red; the others by a proportionality rule (Bruneton & Neyret
              ///< 2008, Sec. 4, "Angular precision")
  kSeparate,  ///< a table of its own, three channels
};

enum class TableFilling {
  kNodes,   ///< texels are what the solver has there: exact at the nodes
  kFitted,  ///< texels that make the interpolated sky fit best between the nodes in nu
};

/// Texels of one (r, mu): for every node of mu_s and nu, C_* and single Mie of three channels.
struct ScatteringTexels {
  std::vector<std::array<double, 3>> star, mie;  ///< [mu_s][nu]
  std::size_t clamped = 0;                       ///< values that would have been negative
};

/// Radiance, of all that is scattered towards the viewer, and what of it is single Mie scattering
/// without its phase function, at a cosine of the view's angle from the Sun.
struct ScatteringSample {
  double weight = 0.0;
  std::array<double, 3> radiance{}, mie{};
  /// Of the radiance, what air scatters once and all scatter more often.
  std::array<double, 3> smooth{};
};

/// The reader's evaluation is L = P_R C_* + P_M C_M, both linear between nodes of mu_s and of nu,
/// and in kCombined C_M = C_* k C_M,r / C_*,r. This class says where the light has to be known and
/// finds C_* and C_M >= 0: at the nodes as given, or so that the sum of squared relative errors
/// over nodes and the places between them is least.
class ScatteringFit {
 public:
  /// suns_between: samples wanted inside each interval of mu_s (its nodes are one more than these
  /// intervals, of which there is at least one), for kFitted. nu_nodes: at least 2, increasing from
  /// -1 to 1. proportionality: k by channel (1 for red).
  ScatteringFit(const std::vector<int>& suns_between, std::vector<double> nu_nodes, double mie_g,
                MieStorage storage, TableFilling filling,
                const std::array<double, 3>& proportionality);

  /// Texel coordinates of Suns, increasing, and cosines from the Sun (the nodes of nu first) at
  /// which samples are wanted.
  const std::vector<double>& sample_sun() const { return sample_sun_; }
  const std::vector<double>& sample_nu() const { return sample_nu_; }
  /// samples: [sun][nu]; those with a radiance of 0 are left out of the fit. sun_scale: factors
  /// that the reader multiplies with, [sun]; empty: 1. Texels come without them.
  ScatteringTexels texels(std::span<const ScatteringSample> samples,
                          std::span<const std::array<double, 3>> sun_scale = {}) const;
  /// Root of the samples' weighted mean squared relative error, over three channels.
  double error(std::span<const ScatteringSample> samples, const ScatteringTexels& texels) const;

 private:
  struct Place {
    std::size_t node;
    double share;  // of the next node
  };
  struct Row;
  Row row(std::size_t sun, std::size_t nu) const;
  void at_nodes(std::span<const ScatteringSample> samples, ScatteringTexels& out) const;
  void fit(std::span<const ScatteringSample> samples, std::size_t channel, bool with_mie,
           ScatteringTexels& out) const;

  std::size_t suns_;
  std::vector<double> nodes_, sample_sun_, sample_nu_;
  std::vector<std::size_t> node_sun_;  // where the nodes are among sample_sun_
  MieStorage storage_;
  TableFilling filling_;
  std::array<double, 3> proportionality_;
  std::vector<Place> sun_place_, nu_place_;
  std::vector<double> rayleigh_, mie_;  // phase functions, [nu]
  std::vector<double> nu_weight_;       // share of the directions, about 1 outside the aureole
};

/// Normal equations of a least squares problem whose rows touch unknowns fewer than `band` apart.
struct BandedSystem {
  std::size_t size, band;
  std::vector<double> lower;  ///< [i][band]: A'A (i, i - band + 1 .. i)
  std::vector<double> right;  ///< A'b

  BandedSystem(std::size_t n, std::size_t w) : size(n), band(w), lower(n * w, 0.0), right(n, 0.0) {}
  double& at(std::size_t i, std::size_t j) { return lower[i * band + band - 1 + j - i]; }
};

/// Least squares with x >= 0: minimises |A x - b|^2 + ridge sum_j (A'A)_jj (x_j - start_j)^2, by
/// Cholesky's factors and, where values fall below 0, an active set (they are then held at 0).
std::vector<double> nonnegative_least_squares(BandedSystem system, std::span<const double> start,
                                              double ridge);

}  // namespace twilight
