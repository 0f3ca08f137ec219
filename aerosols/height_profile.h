// How the particles of a layer are spread over height.
#pragma once

#include <limits>
#include <vector>

namespace twilight {

/// Relative density of a layer's particles against height: 0 outside [bottom_km, top_km]; inside
/// exp(-z / scale_height_km) (Haber et al. 2005, Sec. 4.1.2; an amount given with it is that at
/// z = 0), or, where heights_km is not empty, relative_density, linear between those heights.
struct HeightProfile {
  double bottom_km = 0.0;
  double top_km = 0.0;
  double scale_height_km = std::numeric_limits<double>::infinity();  ///< infinity: constant
  std::vector<double> heights_km;        ///< strictly increasing, bottom_km first, top_km last
  std::vector<double> relative_density;  ///< as many, >= 0

  /// The profile at a height in km.
  double at(double z_km) const;
  /// Integral over [z0_km, z1_km] in km, exact; 0 where z1_km <= z0_km.
  double integral_km(double z0_km, double z1_km) const;
  /// Integral divided by the thickness, dimensionless. Needs z0_km < z1_km, both finite, else
  /// throws std::invalid_argument.
  double mean(double z0_km, double z1_km) const;
};

/// A profile of one tabulated shape. Throws std::invalid_argument unless there are two or more
/// heights, strictly increasing and finite, and as many densities, finite, >= 0 and not all 0.
HeightProfile tabulated_profile(std::vector<double> heights_km,
                                std::vector<double> relative_density);

}  // namespace twilight
