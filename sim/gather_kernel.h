// The SIMD kernel of the view ray's march, and its scalar twin.
#pragma once

#include <cstddef>
#include <vector>

namespace twilight {

/// One view ray, laid out for the kernel. Arrays of pointers index steps.
struct GatherMarch {
  std::size_t lanes = 0;
  int steps = 0;
  std::vector<float> length_km;
  std::vector<int> layer;
  std::vector<float> sun_depth;  ///< [step][lane]; kShadow where no sunlight arrives
  std::vector<float> multiple;   ///< [step][lane] emission of multiply scattered light, km^-1 sr^-1
  float cosine = 0;              ///< of the single-scattering angle (the unrefracted view)
  std::vector<unsigned char> lit;  ///< [step]
};

/// Per-layer coefficients, [layer][lane], km^-1.
struct GatherOptics {
  const float* extinction = nullptr;
  const float* air = nullptr;
  const float* aerosol = nullptr;
  const float* asymmetry = nullptr;
  const float* rayleigh_x2 = nullptr;  ///< [lane]
  /// Given, sunlight is scattered by (s0 + s1 cos + s2 (cos^2 - 1/3)) / (4 pi) instead: the
  /// truncated phase function, whose forward peak stays in the beam.
  const float* s0 = nullptr;
  const float* s1 = nullptr;
  const float* s2 = nullptr;
};

/// radiance[lane] += sum over steps of T (E p beta + multiple) (1 - exp(-tau)) / beta_e;
/// transmittance[lane] is multiplied by that of the ray.
void march(const GatherMarch& ray, const GatherOptics& optics, float* radiance,
           float* transmittance);
void march_scalar(const GatherMarch& ray, const GatherOptics& optics, float* radiance,
                  float* transmittance);

/// multiple[lane] = (s0 J + s1 F.w + s2 w.S.w) / (4 pi) of the weighted sum of the fields of
/// `corners` cells; w = (dir_r, 0, dir_z) is the direction of travel. moments = 1: J only.
void cell_emission(const float* const* fields, const float* weights, int corners, int moments,
                   std::size_t lanes, const float* s0, const float* s1, const float* s2,
                   float dir_r, float dir_z, float* out);

/// out[lane] = the weighted sum of four spectra: bilinear interpolation.
void weighted_sum(const float* const* rows, const float* weights, std::size_t lanes, float* out);

}  // namespace twilight
