// A sky at a few views: what tells one solution from another.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "output/hemisphere.h"
#include "sim/run_control.h"
#include "sim/scene_model.h"

namespace twilight {

/// The sky under one Sun at the views of hemisphere_views().
struct SunSample {
  double sun_elevation_deg = 0.0;      ///< geometric
  std::vector<double> radiance;        ///< W m^-2 sr^-1 nm^-1, [view][wavelength]
  std::vector<double> standard_error;  ///< as radiance, one sigma; empty without noise
  std::vector<double> xyz;             ///< CIE 1931, W m^-2 sr^-1, [view][X, Y, Z]
  /// Wall and processor time: to look up a field from this Sun on, and to gather the views.
  double setup_seconds = 0.0, view_seconds = 0.0;
  double setup_cpu_seconds = 0.0, view_cpu_seconds = 0.0;
};

struct SkySample {
  std::vector<double> wavelength_nm;
  std::vector<SunSample> suns;
  double peak_mib = 0.0;  ///< largest resident memory of the process that sampled
};

/// Solves the model and samples it under every Sun (geometric elevations, -90..90 deg; the model's
/// own elevation does not matter). "orders" solves one field for all of them, the other methods one
/// sky each. Throws as solve_sky.
SkySample sample_sky(SceneModel model, const std::vector<double>& sun_elevations_deg,
                     const RunControl& control = {});

/// As JSON text and back; numbers keep every bit. Reading throws std::runtime_error naming what is
/// missing or has a wrong size.
std::string to_json(const SkySample& sample);
SkySample sky_sample_from_json(const std::string& text);

/// How far a sky is from another, over the views: |L/L_ref - 1| in spectral radiance (over the
/// wavelengths both have) and in luminance, and CIEDE2000, weighted by solid angle. Colours are
/// seen with a D65 white of the luminance of the reference's brightest view (Y = 100), in both
/// skies the same. bias: solid-angle mean of L/L_ref - 1, signed.
struct SkyDifference {
  std::optional<Spread> radiance;  ///< none where no wavelength is shared
  std::optional<Spread> luminance, ciede2000;
  double radiance_bias = 0.0, luminance_bias = 0.0;
};

/// The difference of two samples under the same Sun; `wavelength_nm` are theirs. Views and
/// wavelengths at which the reference is dark (0) are left out; what has none left is empty. Throws
/// std::invalid_argument where sizes do not belong to hemisphere_views().
SkyDifference sky_difference(const SunSample& sky, const std::vector<double>& wavelength_nm,
                             const SunSample& reference,
                             const std::vector<double>& reference_wavelength_nm);

/// Solid-angle mean of standard error over radiance; 0 without noise.
double mean_relative_noise(const SunSample& sample);

}  // namespace twilight
