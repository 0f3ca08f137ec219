// What a scene file says: plain options with defaults, and their validation.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "sim/models/bruneton_options.h"
#include "sim/models/hoffman_preetham_options.h"
#include "sim/models/model_options.h"
#include "sim/models/nishita_options.h"
#include "sim/models/preetham_options.h"

namespace twilight {

/// Place and time of the observer. Either latitude, longitude and time are all
/// given, or [sun] elevation_deg is.
struct ObserverOptions {
  std::optional<double> latitude_deg;   ///< geodetic (WGS84), -90..90
  std::optional<double> longitude_deg;  ///< east positive, -180..360
  /// Above sea level, the ground of the model. From -500: below sea level the observer stands on
  /// the ground, which lies at that height all around, and the air goes on down to it (Death
  /// Valley, -86 m; the Dead Sea, -430 m). Below the top for "cells", else to 4e7 (orbit).
  double height_m = 0.0;
  std::optional<std::string> time;  ///< RFC 3339 with offset, "2003-12-08T17:00:00+01:00"
};

struct SunOptions {
  std::optional<double> elevation_deg;  ///< geometric (no refraction), -90..90
  double azimuth_deg = 180.0;  ///< clockwise from north; only with elevation_deg. South: the
                               ///< middle of a lat-long map
  /// "gueymard2004", "kurucz1992", "astm_g173", "tsis1_hsrs" or "unit" (1 W m^-2 nm^-1).
  /// Gueymard (2004) covers 280..1000 nm and agrees with TSIS-1 within about 1 %.
  std::string spectrum = "gueymard2004";
  /// Sky light averaged over the limb-darkened disc (0.53 deg), not from a point. Unset: true,
  /// false for "cells", which cannot.
  std::optional<bool> disc_average;
};

struct EarthOptions {
  std::optional<double> radius_km;  ///< 1000..70000; unset: the ellipsoid's radius of curvature in
                                    ///< the Sun's azimuth, or 6371 where no place is given
  double ground_albedo = 0.1;       ///< Lambertian, 0..1; 0.1 = vegetated land
  /// A spectral albedo in place of ground_albedo: wavelengths (strictly increasing) and
  /// reflectances 0..1, as many; linear between, constant beyond. Both empty: ground_albedo.
  std::vector<double> albedo_wavelengths_nm;
  std::vector<double> albedo_spectrum;
};

struct AtmosphereOptions {
  /// "us_standard", "tropical", "midlatitude_summer", "midlatitude_winter",
  /// "subarctic_summer", "subarctic_winter" (AFGL), or "exponential" (the
  /// paper's exp(-h/8 km)); "scratchapixel", "scratchapixel_code" or "bruneton2008" (those models'
  /// own air, haze and Earth, see [two_constituent_air], which replace aerosols, ozone and top_km).
  std::string profile = "us_standard";
  /// A profile of one's own in place of `profile`, in uvspec's format
  /// (atmosphere/uvspec_profile.h); relative to the scene file.
  std::optional<std::string> profile_file;
  /// 1..120 for AFGL profiles, 1..200 for "exponential", 1..its own top for profile_file; 100:
  /// sunlit air above the zenith down to a Sun of -10 deg
  double top_km = 100.0;
  int layers = 100;  ///< 1..500
  /// "graded" (equal steps of the integral of density^(1/4): fine below, never
  /// coarse above), "equal-air-mass" (the paper's recursion), "even".
  std::string layer_spacing = "graded";
  std::string layer_optics =
      "mean";  ///< of the density over each layer, or at its "centre" (the paper)
  std::optional<double> ozone_du;  ///< 0..1000; unset: the profile's own column, 300 for
                                   ///< "exponential"
  std::string ozone = "layered";   ///< "layered" (slant path) or "vertical" (the paper's filter)
  /// Nitrogen dioxide column, Dobson units (2.687e16 cm^-2), 0..5; unset: the profile's own, none
  /// for "exponential". 0.2 is clean air, 1 a polluted city.
  std::optional<double> nitrogen_dioxide_du;
  bool refraction = true;  ///< of sunlight and of view rays
  /// Refraction spreads sunlight (neighbouring rays bend differently): its irradiance is scaled by
  /// the Jacobian of the ray map. false: bending alone (the paper).
  bool refractive_spreading = true;
  std::string refractive_index = "ciddor";  ///< "ciddor" or "haber2005" (the formula as printed)
  /// King factor of air ("king"), or one depolarisation ratio in [0, 6/7)
  std::optional<double> depolarisation;       ///< unset = "king"
  std::optional<std::string> optical_layers;  ///< CSV that replaces profile and aerosols; relative
                                              ///< to the scene file
};

struct AerosolOptions {
  /// "none" or one of the ten OPAC types: continental_clean, continental_average,
  /// continental_polluted, urban, desert, maritime_clean, maritime_polluted,
  /// maritime_tropical, arctic, antarctic
  std::string type = "continental_average";
  /// Mixture file (aerosols/mixture_file.h) in place of `type`, which is then not looked at;
  /// relative to the scene file.
  std::optional<std::string> mixture;
  /// Of the mixing layer, and of a mixture file's layers that name none, 0..99.
  double relative_humidity_percent = 80.0;
  /// "mixing-layer" (of the mixing layer as above, of the layers above it OPAC's, of a mixture
  /// file's layers theirs) or "profile": in every layer that of the atmosphere's water vapour at
  /// that height, at most 99 %. The paper has the former.
  std::string humidity = "mixing-layer";
  std::optional<double> optical_depth_550nm;  ///< 0..100: scales the whole aerosol column to this
  /// Of the column between 440 and 870 nm, -1..4: scales the coarse particles against the fine
  /// ones; the optical depth at 550 nm stays, or is optical_depth_550nm.
  std::optional<double> angstrom_exponent;
  /// "mie" (the mixture's scattering matrix, with polarisation) or "henyey-greenstein". Unset:
  /// "mie", "henyey-greenstein" for "cells", which know no other, and for optical_layers.
  std::optional<std::string> phase;
  /// Which of the type's layers take part: the mixing layer, the free troposphere above it (to
  /// 12 km) and the stratosphere (12..35 km). optical_depth_550nm is that of all of them.
  bool mixing_layer = true, free_troposphere = true, stratosphere = true;
};

/// A layer of one component, even in height, on top of the aerosols above: none of their keys
/// changes it.
struct AddedLayerOptions {
  double optical_depth_550nm = 0.0;      ///< 0..10; 0 = no such layer
  double bottom_km = 0.0, top_km = 0.0;  ///< 0..120, bottom below top
};

/// Sulphuric acid droplets (OPAC's SUSO as in its stratosphere, effective radius 0.24 um) after an
/// eruption: within the 15..25 km where SAGE II saw Pinatubo's at mid-latitudes (McCormick,
/// Thomason & Trepte 1995, Nature 373, 399).
struct VolcanicSulfateOptions : AddedLayerOptions {
  VolcanicSulfateOptions() : AddedLayerOptions{0.0, 18.0, 23.0} {}
};

/// Mineral dust from afar (OPAC's MITR, effective radius 2.4 um) in the Saharan air layer, which
/// lies above the marine air, up to 5..6 km (Carlson & Prospero 1972, J. Appl. Meteorol. 11, 283).
struct DustLayerOptions : AddedLayerOptions {
  DustLayerOptions() : AddedLayerOptions{0.0, 2.0, 5.0} {}
};

struct SpectrumOptions {
  /// Strictly increasing, 280..1000 nm, 1..64 of them.
  std::vector<double> wavelengths_nm = {380, 410, 440, 470, 500, 530, 560, 590,
                                        620, 650, 680, 710, 740, 760, 780};
  /// Those of wavelengths_nm that are solved, its first and last among them; the others are
  /// interpolated (SpectralSky). Empty: all.
  std::vector<double> solved_nm;
};

struct SolverOptions {
  /// "cells" (the paper), "orders" (the reference: successive orders on the plane of altitude and
  /// solar zenith angle), "monte-carlo" (the independent judge), or a published model: "preetham",
  /// "cie-clear", "cie-overcast", "nishita", "hoffman-preetham", "bruneton", or
  /// "fit:coefficients.json" (one that `twilight fit` made; relative to the scene file).
  std::string method = "cells";
  int azimuth_divisions = 120;  ///< S, even, 4..360; 120 = the paper's 3 degrees
  /// Scattering events followed, 1..500. Unset: 8 for "cells"; for "orders" until the rest is
  /// below order_tolerance; for "monte-carlo" until roulette ends the path; 5 for "bruneton", with
  /// which its authors give their times.
  std::optional<int> scattering_orders;
  int active_shell_stride = 4;  ///< 1..32; 1 = every shell exchanges
  /// "quadrature": an active shell carries the weight of the passive ones it
  /// stands for; "rescale": the paper's ratio of total to active power (Sec. 5).
  std::string active_shell_weighting = "quadrature";
  double inner_radius_m = 1000.0;      ///< 1..10000; 100 reproduces the paper's shell counts
  std::string air_phase = "rayleigh";  ///< "rayleigh" or "isotropic" (the paper) in every order
  /// "truncated" (delta-M, degree 2, every event) or "similarity" (the paper: Henyey-Greenstein
  /// for the first event, then isotropic with everything scaled by 1 - g, Eq. 2)
  std::string aerosol_phase = "truncated";
  bool ground_light = true;  ///< the ground's reflection lights the air; false: dropped (the paper)
  std::string cell_optics = "mean";  ///< "mean" over the cell, or "centre" (the paper)
  /// No exchange cell taller than this: rings of far shells are divided in
  /// elevation. 0 = never (the paper).
  double cell_height_km = 4.0;
  /// "exact-single": single scattering marched along the view ray plus the
  /// cells' multiple scattering; "cells": everything from the cells (Sec. 4.7).
  std::string gather = "exact-single";
  /// Unset: true; false for "cells", which are scalar.
  std::optional<bool> polarisation;

  // "orders": steps of its grids. The defaults are within 0.2 % of much finer
  // grids down to a Sun of -12 degrees (tests/validation, grid convergence).
  double zenith_step_deg = 1.0;   ///< solar zenith step about the terminator, 0.1..3
  int altitude_levels = 50;       ///< levels of the field, 4..400
  int polar_directions = 32;      ///< incoming directions in zenith angle, 8..128
  int azimuth_directions = 16;    ///< and in azimuth over half a turn, 4..64
  int phase_degree = 24;          ///< of the aerosol phase function in multiple scattering, 2..64
  double order_tolerance = 1e-3;  ///< largest relative error of the series, 1e-8..0.1
  bool single_precision = true;   ///< the field in float; false = double
  /// Light scattered twice on fewer directions, three times or more on half the levels too.
  bool coarse_orders = true;
  int sunlight_nodes = 512;  ///< angles at which the bending of sunlight is traced, 64..2048
  /// Solar zenith angle beyond which the field is night, 60..130; 126: 1e-12 of the day's light.
  /// What is darker is not seen by an observer under a higher Sun.
  double darkest_zenith_deg = 126.0;
  /// Maps interpolate between directions chosen for 0.1 % (99.9 % of them; 0.5 % at worst); false:
  /// every pixel is gathered. Single views always are.
  bool view_interpolation = true;

  // "monte-carlo"
  double target_relative_error = 0.01;  ///< one sigma of each radiance, 1e-5..1
  /// Photons per view, 100..1e10; unset: until target_relative_error.
  std::optional<double> photons;
  int seed = 1;  ///< 0..2^31 - 1; the same seed gives the same bytes

  int threads = 0;  ///< 0 = every core; results do not depend on it
};

struct OutputOptions {
  std::string projection = "fisheye";  ///< "fisheye", "latlong", "octahedral" or "camera"
  int size = 512;  ///< 4..16384 pixels; height; a latlong map is twice as wide, [camera] its own
  /// "rgb", "xyz", or "rgb+spectral" / "xyz+spectral" (a second file holds the spectral layout)
  std::string channels = "rgb";
  std::string colour_observer = "cie1931";  ///< "cie1931" (2 deg) or "cie1964" (10 deg, the paper)
  bool sun_disc = false;                    ///< draw the solar disc (attenuated direct radiance)
};

/// The pinhole camera of output.projection = "camera"; level, square pixels.
struct CameraOptions {
  std::optional<double> azimuth_deg;  ///< clockwise from north, -360..360; unset: the Sun's
  double elevation_deg = 15.0;        ///< -90..90; 15: a third of the picture below the horizon
  double field_of_view_deg = 65.0;    ///< from bottom to top, 0.1..170; the Scratchapixel lesson's
  double aspect_ratio = 1.5;          ///< width over height, 0.2..5; 1.5: 36 x 24 mm film
};

/// How much error, or how many seconds, the user can afford: the program then chooses method and
/// settings and what it leaves out (sim/budget_plan.h).
struct BudgetOptions {
  std::optional<double> max_relative_error;  ///< 0.001..0.5, of radiance, see scene_requirements.h
  std::optional<double> max_seconds;         ///< 0.1..1e6
};

struct Scene {
  /// "draft", "fair", "standard", "high" or "reference": method "orders" and its steps
  /// (sim/quality.h), already put into `solver` by load_scene().
  std::optional<std::string> quality;
  BudgetOptions budget;
  ObserverOptions observer;
  SunOptions sun;
  EarthOptions earth;
  AtmosphereOptions atmosphere;
  AerosolOptions aerosols;
  VolcanicSulfateOptions volcanic_sulfate;
  DustLayerOptions dust_layer;
  SpectrumOptions spectrum;
  SolverOptions solver;
  ModelOptions models;
  TwoConstituentOptions two_constituent_air;
  PreethamOptions preetham;
  CieOptions cie;
  NishitaOptions nishita;
  HoffmanPreethamOptions hoffman_preetham;
  BrunetonOptions bruneton;
  OutputOptions output;
  CameraOptions camera;
};

/// One key's complaint: "solver.azimuth_divisions", and what is wrong with its
/// value, the value and the allowed range included.
struct SceneProblem {
  std::string key;
  std::string message;
};

/// The observer's height above the ground of the model, km: 0 below sea level.
double observer_altitude_km(const Scene& scene);
/// How far that ground lies below sea level, km: 0 for an observer above it.
double ground_depth_km(const Scene& scene);

/// Whether the method solves the transfer of light ("cells", "orders", "monte-carlo"); else it is a
/// published model.
bool solves_transfer(const Scene& scene);
/// Whether one solve serves every Sun: Sky::with_sun_at() gives a sky.
bool serves_every_sun(const Scene& scene);
/// The published air (atmosphere/two_constituent_air.h) that the scene takes in place of profile
/// and aerosols: its profile's, or that of a model with its own; empty for none.
std::string published_air_name(const Scene& scene);
/// Whether profile and aerosols do not matter: the user's own layers or published air.
bool replaces_profile(const Scene& scene);

/// Whether the scene names particles (of a type or mixture), and whether any (added layers too);
/// where replaces_profile(), they are not looked at.
bool has_column_aerosol(const Scene& scene);
bool has_aerosol(const Scene& scene);
/// Takes all of them out.
void remove_aerosols(Scene& scene);

/// The options as the scene's method takes them where they are unset.
bool polarised(const Scene& scene);
bool disc_averaged(const Scene& scene);
bool mie_phase(const Scene& scene);

/// The first thing wrong with the scene, or nothing. Checks every range given
/// above and the rules that join keys (place or elevation, not both).
std::optional<SceneProblem> validate(const Scene& scene);
/// Of its quality and budget alone.
std::optional<SceneProblem> validate_quality(const Scene& scene);

}  // namespace twilight
