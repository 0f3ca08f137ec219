// OPAC's published volume phase functions, for comparison.
#pragma once

#include <array>

#include "aerosols/components.h"

namespace twilight::opac {

/// Scattering angles of the rows below, degrees.
inline constexpr std::array<double, 9> kPhaseAngle_deg = {0, 1, 5, 20, 60, 90, 120, 150, 180};

/// One component at 550 nm: volume phase function in km^-1 sr^-1 per particle cm^-3, whose
/// integral over the sphere is the scattering coefficient; and by how much OPAC's own size integral
/// over few radii lets the figures scatter (seen as noise from angle to angle).
struct PublishedPhase {
  AerosolComponent component;
  double humidity_percent;
  double noise;
  std::array<double, 9> per_km_sr;
};

// Component files of OPAC 3.1a (M. Hess, P. Koepke, I. Schult 1998, Bull. Am. Meteorol. Soc. 79,
// 831-844), as carried by illumina.
// clang-format off
inline constexpr PublishedPhase kPublishedPhase[] = {
    {AerosolComponent::kWaterSoluble, 0, 0.002, {2.984e-06, 2.976e-06, 2.818e-06, 1.712e-06, 2.924e-07, 9.806e-08, 5.847e-08, 6.437e-08, 9.172e-08}},
    {AerosolComponent::kWaterSoluble, 80, 0.005, {1.213e-05, 1.207e-05, 1.098e-05, 5.284e-06, 5.639e-07, 1.638e-07, 9.606e-08, 1.194e-07, 1.456e-07}},
    {AerosolComponent::kSoot, 0, 0.002, {3.251e-08, 3.25e-08, 3.215e-08, 2.752e-08, 1.116e-08, 5.691e-09, 4.598e-09, 5.158e-09, 5.583e-09}},
    {AerosolComponent::kMineralNucleation, 0, 0.003, {7.344e-05, 7.319e-05, 6.808e-05, 3.573e-05, 4.611e-06, 1.452e-06, 8.56e-07, 1.053e-06, 1.842e-06}},
    {AerosolComponent::kSulfate, 0, 0.005, {0.0001038, 0.0001033, 9.281e-05, 4.117e-05, 3.921e-06, 1.128e-06, 6.678e-07, 9.525e-07, 1.255e-06}},
    {AerosolComponent::kMineralAccumulation, 0, 0.03, {0.04474, 0.03899, 0.0121, 0.0009219, 0.000126, 4.181e-05, 2.199e-05, 4.617e-05, 0.0002099}},
    {AerosolComponent::kInsoluble, 0, 0.04, {1.021, 0.4378, 0.02826, 0.001357, 0.0002056, 6.352e-05, 3.138e-05, 5.29e-05, 0.0002468}},
    {AerosolComponent::kMineralTransported, 0, 0.04, {0.1484, 0.1328, 0.02455, 0.00135, 0.0002035, 6.371e-05, 2.99e-05, 5.834e-05, 0.0003055}},
    {AerosolComponent::kSeaSaltAccumulation, 80, 0.04, {0.06887, 0.05771, 0.016, 0.001599, 0.0001273, 3.415e-05, 2.38e-05, 7.331e-05, 0.0001564}},
    {AerosolComponent::kMineralCoarse, 0, 0.09, {45.63, 7.296, 0.1365, 0.006969, 0.00128, 0.0003384, 0.0001653, 0.0001988, 0.0009514}},
    {AerosolComponent::kSeaSaltCoarse, 80, 0.11, {272.5, 21.75, 0.3318, 0.07104, 0.005034, 0.0006244, 0.0008444, 0.003505, 0.01037}},
};
// clang-format on

}  // namespace twilight::opac
