#include "sim/aerosol_emission.h"

#include <numbers>

#include "sim/angular_moments.h"

namespace twilight {

template <class T>
void fill_mode_basis(int degree, double theta_rad, bool emitted, std::vector<T>& basis) {
  const AngularBasis functions = angular_basis(degree, theta_rad);
  basis.resize(3 * moment_count(degree));
  std::size_t at = 0;
  for (int m = 0; m <= degree; ++m) {
    const double factor = emitted ? (m > 0 ? 2 : 1) / (4 * std::numbers::pi) : 1.0;
    for (int l = m; l <= degree; ++l, at += 3) {
      const std::size_t i = moment_index(l, m);
      basis[at] = static_cast<T>(factor * functions.p[i]);
      basis[at + 1] = static_cast<T>(factor * functions.r[i]);
      basis[at + 2] = static_cast<T>(factor * functions.t[i]);
    }
  }
}

template <class T>
void scatter_moments(const ArrivingMoments<T>& arriving, const TruncatedPhase& kind, int degree,
                     T* scattered) {
  const std::size_t lanes = arriving.lanes, stored = moment_count(arriving.stored_degree) * lanes;
  const std::size_t stokes = arriving.polarised ? 3 : 1;
  std::vector<double> inverse(lanes, 1.0);
  for (std::size_t j = 0; j < arriving.nodes; ++j) {
    for (std::size_t w = 0; w < lanes && arriving.trace != nullptr; ++w) {
      const double trace = arriving.trace[j * lanes + w];
      inverse[w] = trace > 0 ? 1 / trace : 0;
    }
    const T* node = arriving.moments + j * stokes * stored;
    for (int m = 0; m <= degree; ++m) {
      for (int l = m; l <= degree; ++l, scattered += stokes * lanes) {
        const T* I = node + moment_index(l, m) * lanes;
        const std::size_t row = static_cast<std::size_t>(l) * lanes;
        for (std::size_t w = 0; w < lanes; ++w) {
          if (!(inverse[w] > 0)) continue;
          const double i = inverse[w] * static_cast<double>(I[w]);
          if (!arriving.polarised) {
            scattered[w] = static_cast<T>(kind.a1[row + w] * i);
            continue;
          }
          const double e = inverse[w] * static_cast<double>(I[stored + w]);
          const double b = inverse[w] * static_cast<double>(I[2 * stored + w]);
          scattered[w] = static_cast<T>(kind.a1[row + w] * i + kind.b1[row + w] * e);
          scattered[lanes + w] = static_cast<T>(kind.b1[row + w] * i + kind.a2[row + w] * e);
          scattered[2 * lanes + w] = static_cast<T>(kind.a3[row + w] * b);
        }
      }
    }
  }
}

template void fill_mode_basis(int, double, bool, std::vector<float>&);
template void fill_mode_basis(int, double, bool, std::vector<double>&);
template void scatter_moments(const ArrivingMoments<float>&, const TruncatedPhase&, int, float*);
template void scatter_moments(const ArrivingMoments<double>&, const TruncatedPhase&, int, double*);

}  // namespace twilight
