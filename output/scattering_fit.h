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

/// Texels of one (r, mu, mu_s): for every node of nu, C_* and single Mie of three channels.
struct ScatteringTexels {
  std::vector<std::array<double, 3>> star, mie;
  int clamped = 0;  ///< values that would have been negative
};

/// Radiance, of all that is scattered towards the viewer, and what of it is single Mie scattering
/// without its phase function, at a cosine of the view's angle from the Sun.
struct ScatteringSample {
  double weight = 0.0;
  std::array<double, 3> radiance{}, mie{};
};

/// The reader's evaluation is L(nu) = P_R C_*(nu) + P_M C_M(nu), both linear between nodes of nu,
/// and in kCombined C_M = C_* k C_M,r / C_*,r. This class knows the nodes, the samples and the
/// phase functions at them, and finds C_* and C_M >= 0.
class ScatteringFit {
 public:
  /// nu_nodes: at least 2, increasing from -1 to 1. proportionality: k by channel (1 for red).
  ScatteringFit(std::vector<double> nu_nodes, double mie_g, MieStorage storage,
                TableFilling filling, const std::array<double, 3>& proportionality);

  /// Cosines at which samples are wanted, increasing: the nodes first, then (kFitted) those
  /// between.
  const std::vector<double>& sample_nu() const { return sample_nu_; }
  /// samples: as sample_nu(). Radiances must be > 0 where weight > 0 or the fit leaves them out.
  ScatteringTexels texels(std::span<const ScatteringSample> samples) const;

 private:
  struct Place {
    std::size_t node;
    double share;                    // of the next node
    double rayleigh, mie, rest = 0;  // phase functions
  };
  void at_nodes(std::span<const ScatteringSample> samples, ScatteringTexels& out) const;
  void fit_pair(std::span<const ScatteringSample> samples, std::size_t channel,
                ScatteringTexels& out) const;
  void fit_star(std::span<const ScatteringSample> samples, std::size_t channel,
                ScatteringTexels& out) const;

  std::vector<double> nodes_, sample_nu_;
  MieStorage storage_;
  TableFilling filling_;
  std::array<double, 3> proportionality_;
  std::vector<Place> places_;
};

/// Least squares with x >= 0: minimises |A x - b|^2 + ridge sum_j (A'A)_jj (x_j - start_j)^2, by
/// Cholesky's factors of the normal equations and, where values fall below 0, an active set (they
/// are held at 0). normal = A'A, row-major n x n; right = A'b.
std::vector<double> nonnegative_least_squares(std::vector<double> normal, std::vector<double> right,
                                              std::span<const double> start, double ridge);

}  // namespace twilight
