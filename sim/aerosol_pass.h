// The paper's first aerosol event between two rings: Henyey-Greenstein about the sunlight.
#pragma once

#include "sim/azimuth_sampling.h"
#include "sim/ring_pair_kernel.h"

namespace twilight {

/// First aerosol event of the paper: source power [S/2+1][lane] scattered by
/// Henyey-Greenstein about the Sun's direction (elevation e) towards the target
/// ring: field[target azimuth][lane] += sum over sources. Direct summation, as the
/// emission depends on both azimuths. Sources with lit = 0 send nothing.
/// Relative error of the single-precision Henyey-Greenstein factor: 1e-4 at g = 0.85.
void first_event_pass(const RingPairKernel& kernel, const AzimuthModes& azimuth, const float* power,
                      const unsigned char* lit, const float* asymmetry, double sun_elevation_rad,
                      float* field);
void first_event_pass_scalar(const RingPairKernel& kernel, int azimuth_divisions,
                             const float* power, const unsigned char* lit, const float* asymmetry,
                             double sun_elevation_rad, float* field);

}  // namespace twilight
