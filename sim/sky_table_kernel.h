// Inner loops of the interpolated sky, and their scalar twins.
#pragma once

#include <cstddef>

#include "sim/sunlit_air.h"

namespace twilight {

/// Multiply scattered light that one point of a ray sends to its start, I alone, in Fourier modes
/// of azimuth: what air_modes() and add_aerosol_modes() give as their first Stokes parameter.
struct EmissionInput {
  std::size_t nodes = 0, lanes = 0;
  float cos_theta = 1, sin_theta = 0;
  const float* coherency = nullptr;   ///< [node][xx, yy, zz, xz][lane]
  const float* air_weight = nullptr;  ///< 3 / (8 pi) times the weight of air, [lane]
  /// Aerosol, or null: moments [node][moment][lane], E at `e_offset` moments from I (0: scalar);
  /// angular basis p with its factors, by moment_index; weighted coefficients [l][lane].
  const float* moments = nullptr;
  std::size_t moments_per_node = 0, e_offset = 0;
  int degree = 0;
  const float *p = nullptr, *a1 = nullptr, *b1 = nullptr;
};
/// modes[node][0..max(2, degree)][lane].
void emission_modes(const EmissionInput& in, float* modes);
void emission_modes_scalar(const EmissionInput& in, float* modes);

/// Such a point as one azimuth sees it.
struct EmissionTaps {
  const float* modes = nullptr;      ///< of the first of four nodes
  float weight[4]{};                 ///< of the nodes
  const float* cosines = nullptr;    ///< cos(m phi), [mode]
  const float* reference = nullptr;  ///< at the lower fine point, [lane]; the next one follows
  float share = 0;                   ///< of the next
  float share_per_rad = 0;           ///< change of `share` with the ray's central angle
};
/// light[azimuth][lane] += steep factor times modes; angle_shift_rad[lane] moves the point.
void add_emission(const EmissionTaps* taps, std::size_t azimuths, std::size_t modes,
                  std::size_t lanes, const float* angle_shift_rad, float* light);
void add_emission_scalar(const EmissionTaps* taps, std::size_t azimuths, std::size_t modes,
                         std::size_t lanes, const float* angle_shift_rad, float* light);

/// Sunlight at one point of a ray.
struct BeamTaps {
  SunlitAir::Taps sun;
  float above = 0;             ///< of SunlitAir::Place
  float share_per_rad = 0;     ///< change of sun.share with the ray's central angle
  float along = 0, below = 0;  ///< the Sun less its place at the observer, as SkyPoint
};
/// Path integrals of the beam: light[scatterer][lane] += scatter * beam, and place[along, below]
/// [scatterer][lane], the same times the Sun's change of place (sunlight is taken a little brighter
/// there, so that it is known at night).
struct BeamPath {
  std::size_t windows = 0, scatterers = 0, lanes = 0;
  const BeamTaps* taps = nullptr;
  const float* scatter = nullptr;                              ///< [window][scatterer][lane]
  const float *above_shift = nullptr, *angle_shift = nullptr;  ///< [window][lane]
};
constexpr float kNightBeam = 1e-15F;
void add_beam(const BeamPath& in, float* light, float* place);
void add_beam_scalar(const BeamPath& in, float* light, float* place);

/// One view among nodes. A node holds logarithms of the multiply scattered light and of every
/// scatterer's path integral, then the Sun's changes of place: [1 + 3 scatterers][lane].
struct SkyPoint {
  std::size_t nodes = 0;
  const float* node[16]{};
  float weight[16]{};
  std::size_t scatterers = 0, lanes = 0;
  /// The Sun along the view, below it in its vertical plane (e_theta), and across (sign left out):
  /// as it stands unrefracted.
  float along = 1, below = 0, across = 0;
  const float* anisotropic_share = nullptr;  ///< of air, [lane]
  const float* phase = nullptr;              ///< PhaseTable::values()
};
void sky_radiance(const SkyPoint& in, float* radiance);
void sky_radiance_scalar(const SkyPoint& in, float* radiance);

}  // namespace twilight
