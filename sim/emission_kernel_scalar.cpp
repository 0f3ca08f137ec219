// The kernels of emission_kernel.cpp once more, one wavelength at a time and without SIMD.
#include "sim/emission_kernel.h"

namespace twilight {

template <class T>
void air_modes_scalar(const AirEmission<T>& in, T* modes) {
  const std::size_t stokes = in.polarised ? 3 : 1, rows = mode_rows(in.degree),
                    block = rows * in.lanes;
  const double c = static_cast<double>(in.cos_theta), s = static_cast<double>(in.sin_theta);
  for (std::size_t j = 0; j < in.nodes; ++j) {
    for (std::size_t w = 0; w < in.lanes; ++w) {
      T* out = modes + j * stokes * block + w;
      const auto put = [&](std::size_t parameter, std::size_t m, double value) {
        out[parameter * block + m * in.lanes] = static_cast<T>(value);
      };
      for (std::size_t q = 0; q < stokes; ++q) {
        for (std::size_t m = 0; m < rows; ++m) put(q, m, 0);
      }
      const auto C = [&](std::size_t k) {
        return static_cast<double>(in.air_weight[w]) *
               static_cast<double>(in.coherency[(j * 4 + k) * in.lanes + w]);
      };
      const double mean = (C(0) + C(1)) / 2, half = (C(0) - C(1)) / 2, zz = C(2), xz = C(3);
      put(0, 0, (c * c + 1) * mean + s * s * zz);
      put(0, 1, -2 * s * c * xz);
      put(0, 2, -s * s * half);
      if (!in.polarised) continue;
      put(1, 0, s * s * (zz - mean));
      put(1, 1, -2 * s * c * xz);
      put(1, 2, (c * c + 1) * half);
      put(2, 1, 2 * s * xz);
      put(2, 2, -2 * c * half);
    }
  }
}

template <class T>
void add_aerosol_modes_scalar(const AerosolPoints<T>& in) {
  const std::size_t fields = in.polarised ? 3 : 1, block = mode_rows(in.degree) * in.lanes;
  const std::size_t count = mode_major_index(in.phase_degree, in.phase_degree, in.phase_degree) + 1;
  for (std::size_t k = 0; k < in.points; ++k) {
    for (std::size_t j = 0; j < in.nodes; ++j) {
      for (std::size_t w = 0; w < in.lanes; ++w) {
        for (int m = 0; m <= in.phase_degree; ++m) {
          double i = 0, q = 0, u = 0;
          for (int l = m; l <= in.phase_degree; ++l) {
            const std::size_t at = mode_major_index(in.phase_degree, l, m);
            const auto basis = [&](std::size_t n) {
              return static_cast<double>(in.basis[k][3 * at + n]);
            };
            const auto moment = [&](std::size_t field) {
              return static_cast<double>(
                  in.scattered[((j * count + at) * fields + field) * in.lanes + w]);
            };
            i += basis(0) * moment(0);
            if (!in.polarised) continue;
            q += basis(1) * moment(1) + basis(2) * moment(2);
            u += basis(2) * moment(1) + basis(1) * moment(2);
          }
          const auto weight = static_cast<double>(in.weight[k][w]);
          T* out = in.modes[k] + j * fields * block + static_cast<std::size_t>(m) * in.lanes + w;
          out[0] += static_cast<T>(weight * i);
          if (!in.polarised) continue;
          out[block] += static_cast<T>(weight * q);
          out[2 * block] += static_cast<T>(weight * u);
        }
      }
    }
  }
}

template void air_modes_scalar(const AirEmission<float>&, float*);
template void air_modes_scalar(const AirEmission<double>&, double*);
template void add_aerosol_modes_scalar(const AerosolPoints<float>&);
template void add_aerosol_modes_scalar(const AerosolPoints<double>&);

}  // namespace twilight
