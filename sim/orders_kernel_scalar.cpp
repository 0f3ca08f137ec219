// The kernels of orders_kernel.cpp once more, one wavelength at a time and without SIMD: what the
// tests compare them with, and the shortest reading of what they do.
#include <algorithm>
#include <cmath>

#include "sim/angular_moments.h"
#include "sim/orders_kernel.h"
#include "sim/zenith_grid.h"

namespace twilight {

template <class T>
void gather_modes_scalar(const GatherInput<T>& in, T* out) {
  const std::size_t stokes = in.polarised ? 3 : 1;
  const std::size_t block = mode_rows(in.stored_degree) * in.lanes;
  for (std::size_t i = 0; i < in.pairs; ++i) {
    const double cc = static_cast<double>(in.cos_chi[i]), sc = static_cast<double>(in.sin_chi[i]);
    const double cf = static_cast<double>(in.cos_phi[i]), sf = static_cast<double>(in.sin_phi[i]);
    const double cp = static_cast<double>(in.cos_psi), sp = static_cast<double>(in.sin_psi);
    const double along = cp * sc * cf - sp * cc, across = sf * sc;
    const double chi = std::atan2(std::hypot(along, across), cc * cp + sc * sp * cf);
    const double azimuth = std::atan2(across, along);
    const double fine = chi * static_cast<double>(in.fine_per_radian);
    if (fine >= static_cast<double>(in.fine_end)) continue;
    const auto at = static_cast<std::size_t>(fine);
    const double f = fine - static_cast<double>(at);
    const auto taps =
        ZenithGrid::stencil(std::lerp(static_cast<double>(in.fine_position[at]),
                                      static_cast<double>(in.fine_position[at + 1]), f),
                            in.nodes);
    for (std::size_t w = 0; w < in.lanes; ++w) {
      const double reference =
          std::lerp(static_cast<double>(in.reference[at * in.lanes + w]),
                    static_cast<double>(in.reference[(at + 1) * in.lanes + w]), f);
      for (std::size_t q = 0; q < stokes; ++q) {
        double sum = 0;
        for (int m = 0; m <= in.degree; ++m) {
          const double wave = q == 2 ? std::sin(m * azimuth) : std::cos(m * azimuth);
          for (std::size_t k = 0; k < 4; ++k) {
            sum += wave * taps.weight[k] *
                   static_cast<double>(in.modes[(taps.first + k) * stokes * block + q * block +
                                                static_cast<std::size_t>(m) * in.lanes + w]);
          }
        }
        out[(i * stokes + q) * in.lanes + w] += static_cast<T>(reference * sum);
      }
    }
  }
}

template <class T>
void gather_beam_scalar(const BeamInput<T>& in, T* out) {
  const GatherInput<T>& g = in.gather;
  const std::size_t stokes = g.polarised ? 3 : 1;
  const auto number = [](T x) { return static_cast<double>(x); };
  for (std::size_t i = 0; i < g.pairs; ++i) {
    const double cc = number(g.cos_chi[i]), sc = number(g.sin_chi[i]);
    const double cf = number(g.cos_phi[i]), sf = number(g.sin_phi[i]);
    const double cp = number(g.cos_psi), sp = number(g.sin_psi);
    const double along = cp * sc * cf - sp * cc, across = sf * sc;
    const double chi = std::atan2(std::hypot(along, across), cc * cp + sc * sp * cf);
    const double azimuth = std::atan2(across, along);
    const double fine = chi * number(g.fine_per_radian);
    if (fine >= static_cast<double>(g.fine_end)) continue;
    const auto at = static_cast<std::size_t>(fine);
    const double f = fine - static_cast<double>(at);
    const double apparent =
        chi - std::lerp(number(in.lift_rad[at]), number(in.lift_rad[at + 1]), f);
    const double ca = std::cos(apparent), sa = std::sin(apparent);
    const double ct = number(in.cos_theta), st = number(in.sin_theta);
    const double c = std::clamp(ct * ca + st * sa * std::cos(azimuth), -1.0, 1.0);
    const double turn = std::atan2(-sa * std::sin(azimuth), sa * ct * std::cos(azimuth) - ca * st);
    for (std::size_t w = 0; w < g.lanes; ++w) {
      const double beam = std::lerp(number(g.reference[at * g.lanes + w]),
                                    number(g.reference[(at + 1) * g.lanes + w]), f);
      const double air = number(in.air_weight[w]) * 2 / 3, share = number(in.anisotropic_share[w]);
      double I = air * (share * 0.75 * (1 + c * c) + 1 - share);
      double Q = -air * share * 0.75 * (1 - c * c);
      const double x = std::min((c + 1) / 2 * static_cast<double>(in.phase_nodes - 1),
                                static_cast<double>(in.phase_nodes) - 1.001);
      const auto node = in.kinds > 0 ? static_cast<std::size_t>(x) : 0;
      for (std::size_t q = 0; q < in.kinds; ++q) {
        const T* p = in.phase + (in.kind[q] * in.phase_nodes + node) * 2 * g.lanes + w;
        const double weight = number(in.kind_weight[in.kind[q] * g.lanes + w]);
        const double fx = x - static_cast<double>(node);
        I += weight * std::lerp(number(p[0]), number(p[2 * g.lanes]), fx);
        Q += weight * std::lerp(number(p[g.lanes]), number(p[3 * g.lanes]), fx);
      }
      T* o = out + i * stokes * g.lanes + w;
      o[0] += static_cast<T>(beam * I);
      if (!g.polarised) continue;
      o[g.lanes] += static_cast<T>(beam * Q * std::cos(2 * turn));
      o[2 * g.lanes] += static_cast<T>(beam * Q * std::sin(2 * turn));
    }
  }
}

template <class T>
void add_moments_scalar(const MomentInput<T>& in, T* coherency, T* moments) {
  const std::size_t stokes = in.polarised ? 3 : 1, count = moment_count(in.phase_degree);
  for (std::size_t k = 0; k < in.directions; ++k) {
    const double c = static_cast<double>(in.cos_theta[k]), s = static_cast<double>(in.sin_theta[k]);
    for (std::size_t j = 0; j < in.nodes; ++j) {
      for (std::size_t q = 0; q < in.azimuths; ++q) {
        const double cf = static_cast<double>(in.cos_phi[q]),
                     sf = static_cast<double>(in.sin_phi[q]);
        const double v[3] = {c * cf, c * sf, -s}, h[3] = {-sf, cf, 0};
        const double phi = std::atan2(sf, cf);
        for (std::size_t w = 0; w < in.lanes; ++w) {
          const T* light = in.light[k] + (j * in.azimuths + q) * stokes * in.lanes + w;
          const double weight = static_cast<double>(in.weight[k]);
          const double I = weight * static_cast<double>(light[0]);
          const double Q = in.polarised ? weight * static_cast<double>(light[in.lanes]) : 0;
          const double U = in.polarised ? weight * static_cast<double>(light[2 * in.lanes]) : 0;
          const auto tensor = [&](int a, int b) {
            return 0.5 * ((I + Q) * v[a] * v[b] + (I - Q) * h[a] * h[b] +
                          U * (v[a] * h[b] + h[a] * v[b]));
          };
          T* C = coherency + j * 4 * in.lanes + w;
          C[0] += static_cast<T>(tensor(0, 0));
          C[in.lanes] += static_cast<T>(tensor(1, 1));
          C[2 * in.lanes] += static_cast<T>(tensor(2, 2));
          C[3 * in.lanes] += static_cast<T>(tensor(0, 2));
          if (in.phase_degree == 0) continue;
          T* M = moments + j * stokes * count * in.lanes + w;
          for (int m = 0; m <= in.phase_degree; ++m) {
            const double cm = std::cos(m * phi), sm = std::sin(m * phi);
            for (int l = m; l <= in.phase_degree; ++l) {
              const std::size_t i = moment_index(l, m);
              const T* basis = in.basis[k] + 3 * mode_major_index(in.phase_degree, l, m);
              M[i * in.lanes] += static_cast<T>(static_cast<double>(basis[0]) * I * cm);
              if (!in.polarised || l < 2) continue;
              const auto r = static_cast<double>(basis[1]), t = static_cast<double>(basis[2]);
              M[(count + i) * in.lanes] += static_cast<T>(r * Q * cm + t * U * sm);
              M[(2 * count + i) * in.lanes] += static_cast<T>(t * Q * cm + r * U * sm);
            }
          }
        }
      }
    }
  }
}

template void gather_modes_scalar(const GatherInput<float>&, float*);
template void gather_modes_scalar(const GatherInput<double>&, double*);
template void gather_beam_scalar(const BeamInput<float>&, float*);
template void gather_beam_scalar(const BeamInput<double>&, double*);
template void add_moments_scalar(const MomentInput<float>&, float*, float*);
template void add_moments_scalar(const MomentInput<double>&, double*, double*);

}  // namespace twilight
