// The clear, aerosol-free atmosphere as a medium.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

struct AirOptions {
  std::string profile = "us_standard";        ///< a name of Profile::names()
  std::string profile_file;                   ///< read_uvspec_profile() instead; empty: none
  double top_km = 100.0;                      ///< 1..120, "exponential" 1..200
  int layers = 100;                           ///< 1..500
  std::string layer_spacing = "graded";       ///< "graded", "equal-air-mass" or "even"
  std::string layer_optics = "mean";          ///< "mean" over the layer or value at its "centre"
  std::optional<double> ozone_du;             ///< 0..1000; unset: the profile's own column, 300 for
                                              ///< "exponential"
  std::string ozone = "layered";              ///< "layered" or "vertical" (the paper's filter)
  std::optional<double> nitrogen_dioxide_du;  ///< 0..5; unset: the profile's own column, none for
                                              ///< "exponential"
  std::string refractive_index = "ciddor";    ///< "ciddor" or "haber2005"
  bool refraction = true;                     ///< false: refractivity 0
  std::optional<double> depolarisation;       ///< [0, 6/7); unset: from the King factor
  double earth_radius_km = 6371.0;            ///< 1000..70000
  /// Ground below sea level, 0..1: every height (top_km, snap_boundaries_km, the medium's) counts
  /// from that ground, and the profile goes on down to it.
  double ground_depth_km = 0.0;
  std::vector<double> snap_boundaries_km;  ///< see layer_boundaries_km()
};

/// Air (Rayleigh), ozone, nitrogen dioxide and refractivity of a model atmosphere in layers (Haber
/// et al. 2005, Secs. 4.1.2, 4.3-4.5.1), at wavelengths 280..1000 nm, strictly increasing. The
/// aerosol tables have their size and are zero.
///
/// Scattering is number density times rayleigh_cross_section_cm2(). The whole ozone column
/// (options.ozone_du, or the profile's own up to its top) lies between 0 and top_km, in the shape
/// of the profile there, so that sum of absorption x thickness is exactly cross section x column;
/// with ozone "vertical" it makes the filter above the model instead and the layers absorb nothing.
/// Nitrogen dioxide likewise, always layered; a column of either in an atmosphere that has none of
/// its own ("exponential": no nitrogen dioxide) has the shape of the US standard's.
/// Refractivity is always of the layer's mean density, whatever layer_optics says.
/// Throws std::invalid_argument naming the quantity, its value and the allowed range.
Medium make_air(const AirOptions& options, std::span<const double> wavelength_nm);

}  // namespace twilight
