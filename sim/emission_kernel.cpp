#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/emission_kernel.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include <algorithm>

#include "hwy/highway.h"
#include "sim/emission_kernel.h"
#include "sim/for_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class T>
void AirModes(const AirEmission<T>& in, T* HWY_RESTRICT modes) {
  const std::size_t lanes = in.lanes, rows = mode_rows(in.degree), block = rows * lanes;
  const std::size_t stride = (in.polarised ? 3 : 1) * block;
  const T c = in.cos_theta, s = in.sin_theta;
  ForLanes<T>(lanes, [&](auto d) {
    const auto c2p1 = hn::Set(d, c * c + 1), s2 = hn::Set(d, s * s), sc2 = hn::Set(d, -2 * s * c);
    const auto minus_s2 = hn::Set(d, -s * s), two_s = hn::Set(d, 2 * s),
               minus_2c = hn::Set(d, -2 * c), half = hn::Set(d, T(0.5));
    for (std::size_t w = 0; w < lanes; w += hn::Lanes(d)) {
      const auto k = hn::LoadU(d, in.air_weight + w);
      for (std::size_t j = 0; j < in.nodes; ++j) {
        T* HWY_RESTRICT out = modes + j * stride + w;
        const T* HWY_RESTRICT C = in.coherency + j * 4 * lanes + w;
        const auto xx = hn::Mul(k, hn::LoadU(d, C)), yy = hn::Mul(k, hn::LoadU(d, C + lanes));
        const auto zz = hn::Mul(k, hn::LoadU(d, C + 2 * lanes)),
                   xz = hn::Mul(k, hn::LoadU(d, C + 3 * lanes));
        const auto S = hn::Mul(half, hn::Add(xx, yy)), D = hn::Mul(half, hn::Sub(xx, yy));
        hn::StoreU(hn::MulAdd(c2p1, S, hn::Mul(s2, zz)), d, out);
        hn::StoreU(hn::Mul(sc2, xz), d, out + lanes);
        hn::StoreU(hn::Mul(minus_s2, D), d, out + 2 * lanes);
        for (std::size_t m = 3; m < rows; ++m) hn::StoreU(hn::Zero(d), d, out + m * lanes);
        if (!in.polarised) continue;
        T* HWY_RESTRICT q = out + block;
        T* HWY_RESTRICT u = q + block;
        hn::StoreU(hn::Mul(s2, hn::Sub(zz, S)), d, q);
        hn::StoreU(hn::Mul(sc2, xz), d, q + lanes);
        hn::StoreU(hn::Mul(c2p1, D), d, q + 2 * lanes);
        hn::StoreU(hn::Zero(d), d, u);
        hn::StoreU(hn::Mul(two_s, xz), d, u + lanes);
        hn::StoreU(hn::Mul(minus_2c, D), d, u + 2 * lanes);
        for (std::size_t m = 3; m < rows; ++m) {
          hn::StoreU(hn::Zero(d), d, q + m * lanes);
          hn::StoreU(hn::Zero(d), d, u + m * lanes);
        }
      }
    }
  });
}

// The points share every load of a moment.
template <std::size_t kPoints, bool kPolarised, class T, class D>
HWY_INLINE void AddAerosolPoints(D d, const AerosolPoints<T>& in) {
  constexpr std::size_t kFields = kPolarised ? 3 : 1;
  const std::size_t lanes = in.lanes, block = mode_rows(in.degree) * lanes;
  const std::size_t count = mode_major_index(in.phase_degree, in.phase_degree, in.phase_degree) + 1;
  using V = hn::Vec<D>;
  for (std::size_t w = 0; w < lanes; w += hn::Lanes(d)) {
    for (std::size_t j = 0; j < in.nodes; ++j) {
      const T* HWY_RESTRICT moment = in.scattered + j * count * kFields * lanes + w;
      std::size_t at = 0;
      for (int m = 0; m <= in.phase_degree; ++m) {
        V si[kPoints], sq[kPoints], su[kPoints];
        for (std::size_t k = 0; k < kPoints; ++k) si[k] = sq[k] = su[k] = hn::Zero(d);
        for (int l = m; l <= in.phase_degree; ++l, ++at, moment += kFields * lanes) {
          const auto I = hn::LoadU(d, moment);
          if constexpr (kPolarised) {
            const auto E = hn::LoadU(d, moment + lanes), B = hn::LoadU(d, moment + 2 * lanes);
            for (std::size_t k = 0; k < kPoints; ++k) {
              const T* HWY_RESTRICT basis = in.basis[k] + 3 * at;
              const auto r = hn::Set(d, basis[1]), t = hn::Set(d, basis[2]);
              si[k] = hn::MulAdd(hn::Set(d, basis[0]), I, si[k]);
              sq[k] = hn::MulAdd(r, E, hn::MulAdd(t, B, sq[k]));
              su[k] = hn::MulAdd(t, E, hn::MulAdd(r, B, su[k]));
            }
          } else {
            for (std::size_t k = 0; k < kPoints; ++k) {
              si[k] = hn::MulAdd(hn::Set(d, in.basis[k][3 * at]), I, si[k]);
            }
          }
        }
        for (std::size_t k = 0; k < kPoints; ++k) {
          const auto weight = hn::LoadU(d, in.weight[k] + w);
          T* HWY_RESTRICT out =
              in.modes[k] + j * kFields * block + static_cast<std::size_t>(m) * lanes + w;
          const auto add = [&](T* to, V value) {
            hn::StoreU(hn::MulAdd(weight, value, hn::LoadU(d, to)), d, to);
          };
          add(out, si[k]);
          if constexpr (kPolarised) {
            add(out + block, sq[k]);
            add(out + 2 * block, su[k]);
          }
        }
      }
    }
  }
}

template <class T>
void AddAerosolModes(const AerosolPoints<T>& in) {
  const auto run = [&](auto d, auto points) {
    if (in.polarised) {
      AddAerosolPoints<points(), true>(d, in);
    } else {
      AddAerosolPoints<points(), false>(d, in);
    }
  };
  ForLanes<T>(in.lanes, [&](auto d) {
    switch (in.points) {
      case 1:
        return run(d, std::integral_constant<std::size_t, 1>());
      case 2:
        return run(d, std::integral_constant<std::size_t, 2>());
      case 3:
        return run(d, std::integral_constant<std::size_t, 3>());
      default:
        return run(d, std::integral_constant<std::size_t, 4>());
    }
  });
}

template <class T>
int SignificantDegree(const AirEmission<T>& in, const T* HWY_RESTRICT modes, T share) {
  const auto degree = static_cast<std::size_t>(in.degree);
  const std::size_t block = mode_rows(in.degree) * in.lanes, stokes = in.polarised ? 3 : 1;
  std::size_t significant = 2;
  ForLanes<T>(in.lanes, [&](auto d) {
    const auto limit = hn::Set(d, share);
    for (std::size_t j = 0; j < in.nodes && significant < degree; ++j) {
      for (std::size_t w = 0; w < in.lanes; w += hn::Lanes(d)) {
        const T* HWY_RESTRICT at = modes + j * stokes * block + w;
        const auto floor = hn::Mul(limit, hn::Abs(hn::LoadU(d, at)));
        for (std::size_t m = degree; m > significant; --m) {
          auto most = hn::Abs(hn::LoadU(d, at + m * in.lanes));
          for (std::size_t q = 1; q < stokes; ++q) {
            most = hn::Max(most, hn::Abs(hn::LoadU(d, at + q * block + m * in.lanes)));
          }
          if (!hn::AllFalse(d, hn::Gt(most, floor))) significant = m;
        }
      }
    }
  });
  return static_cast<int>(significant);
}

// Dispatch tables hold plain functions.
void AirModesF(const AirEmission<float>& in, float* modes) { AirModes(in, modes); }
void AirModesD(const AirEmission<double>& in, double* modes) { AirModes(in, modes); }
void AddAerosolModesF(const AerosolPoints<float>& in) { AddAerosolModes(in); }
void AddAerosolModesD(const AerosolPoints<double>& in) { AddAerosolModes(in); }
int SignificantDegreeF(const AirEmission<float>& in, const float* modes, float share) {
  return SignificantDegree(in, modes, share);
}
int SignificantDegreeD(const AirEmission<double>& in, const double* modes, double share) {
  return SignificantDegree(in, modes, share);
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace twilight {

HWY_EXPORT(AirModesF);
HWY_EXPORT(AirModesD);
HWY_EXPORT(AddAerosolModesF);
HWY_EXPORT(AddAerosolModesD);
HWY_EXPORT(SignificantDegreeF);
HWY_EXPORT(SignificantDegreeD);

template <>
void air_modes(const AirEmission<float>& in, float* modes) {
  HWY_DYNAMIC_DISPATCH(AirModesF)(in, modes);
}
template <>
void air_modes(const AirEmission<double>& in, double* modes) {
  HWY_DYNAMIC_DISPATCH(AirModesD)(in, modes);
}
template <>
void add_aerosol_modes(const AerosolPoints<float>& in) {
  HWY_DYNAMIC_DISPATCH(AddAerosolModesF)(in);
}
template <>
void add_aerosol_modes(const AerosolPoints<double>& in) {
  HWY_DYNAMIC_DISPATCH(AddAerosolModesD)(in);
}
template <>
int significant_degree(const AirEmission<float>& in, const float* modes, float share) {
  return HWY_DYNAMIC_DISPATCH(SignificantDegreeF)(in, modes, share);
}
template <>
int significant_degree(const AirEmission<double>& in, const double* modes, double share) {
  return HWY_DYNAMIC_DISPATCH(SignificantDegreeD)(in, modes, share);
}

}  // namespace twilight
#endif
