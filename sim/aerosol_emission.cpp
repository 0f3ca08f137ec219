#include "sim/aerosol_emission.h"

#include <algorithm>
#include <numbers>

#include "sim/angular_moments.h"

namespace twilight {

template <class T>
void KernelBasis<T>::set(int degree, double theta_rad, bool emitted) {
  const AngularBasis basis = angular_basis(degree, theta_rad);
  for (auto* v : {&p, &r, &t}) v->resize(moment_count(degree));
  for (int l = 0; l <= degree; ++l) {
    for (int m = 0; m <= l; ++m) {
      const double factor = emitted ? (m > 0 ? 2 : 1) / (4 * std::numbers::pi) : 1.0;
      const std::size_t i = moment_index(l, m);
      p[i] = static_cast<T>(factor * basis.p[i]);
      r[i] = static_cast<T>(factor * basis.r[i]);
      t[i] = static_cast<T>(factor * basis.t[i]);
    }
  }
}

template <class T>
AerosolEmission<T>::AerosolEmission(std::span<const TruncatedPhase> kinds, int degree,
                                    std::size_t lanes)
    : kinds_(kinds), degree_(degree), lanes_(lanes) {
  for (auto* v : {&a1_, &b1_, &a2_, &a3_}) {
    v->resize((static_cast<std::size_t>(degree) + 1) * lanes);
  }
}

template <class T>
bool AerosolEmission<T>::weigh(const double* weight) {
  bool any = false;
  for (std::size_t q = 0; q < kinds_.size(); ++q) {
    const double* here = weight + q * lanes_;
    if (std::all_of(here, here + lanes_, [](double x) { return x == 0; })) continue;
    if (!any) {
      for (auto* v : {&a1_, &b1_, &a2_, &a3_}) std::fill(v->begin(), v->end(), T(0));
    }
    any = true;
    const TruncatedPhase& kind = kinds_[q];
    for (std::size_t k = 0; k < a1_.size(); ++k) {
      const double x = here[k % lanes_];
      a1_[k] += static_cast<T>(x * kind.a1[k]);
      b1_[k] += static_cast<T>(x * kind.b1[k]);
      a2_[k] += static_cast<T>(x * kind.a2[k]);
      a3_[k] += static_cast<T>(x * kind.a3[k]);
    }
  }
  return any;
}

template <class T>
void AerosolEmission<T>::emit(double theta_rad, int phase_degree, const T* moments,
                              SourceModesInput<T>& in) {
  basis_.set(degree_, theta_rad, true);
  in.degree = std::max(2, phase_degree);
  in.phase_degree = phase_degree;
  in.stored_phase_degree = degree_;
  in.moments = moments;
  in.p = basis_.p.data();
  in.r = basis_.r.data();
  in.t = basis_.t.data();
  in.a1 = a1_.data();
  in.b1 = b1_.data();
  in.a2 = a2_.data();
  in.a3 = a3_.data();
}

template struct KernelBasis<float>;
template struct KernelBasis<double>;
template class AerosolEmission<float>;
template class AerosolEmission<double>;

}  // namespace twilight
