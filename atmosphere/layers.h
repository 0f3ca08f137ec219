// Where the boundaries of the atmosphere's layers lie.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "atmosphere/profile.h"

namespace twilight {

/// Boundaries of `layers` layers, km: size layers + 1, from 0 to top_km exactly, strictly
/// increasing (Haber et al. 2005, Sec. 4.1.2). Spacing:
///  - "equal-air-mass": each layer holds the same integral of exp(-h / 8 km), the paper's recursion
///    H_{i+1} = -8 ln(exp(-H_i / 8) - M / 8), whatever the profile; never snapped;
///  - "even": equal thickness;
///  - "graded": equal integrals of the profile's air density to the power 1/4, so that thickness
///    grows with four times the scale height.
/// For "even" and "graded" the inner boundary nearest to each of snap_km (heights where the
/// aerosol changes abruptly) is moved there when the boundaries stay strictly increasing.
/// Throws std::invalid_argument for another spacing, layers outside 1..500, top_km outside
/// 1..profile.top_km() or a snap height that is not finite.
std::vector<double> layer_boundaries_km(const Profile& profile, std::string_view spacing,
                                        double top_km, int layers,
                                        std::span<const double> snap_km = {});

}  // namespace twilight
