// Light gathered along a view ray (Haber et al. 2005, Sec. 4.7).
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "atmosphere/medium.h"
#include "atmosphere/refraction.h"
#include "sim/cell_grid.h"
#include "sim/direct_sunlight.h"
#include "sim/exchange.h"
#include "sim/gather_kernel.h"

namespace twilight {

/// A short piece of a view ray, midpoint values; from the observer outwards.
struct ViewStep {
  int layer = 0;
  double length_km = 0;
  double altitude_km = 0;
  double rho_km = 0, z_km = 0;  ///< midpoint about the observer's vertical axis
  double dir_r = 0, dir_z = 0;  ///< unit tangent, away from the observer
};

struct ViewPath {
  std::vector<ViewStep> steps;
  bool hits_ground = false;
  double ground_angle_rad = 0;  ///< central angle of the point where it meets the ground
  double ground_cosine = 0;
};

/// The (refracted) path of a view ray from the observer to the top or the ground, through a
/// continuous refractive index (RefractedRays::follow). Steps never cross a layer boundary and are
/// no longer than max_step_km. An observer above the top sees the path from where it enters.
ViewPath trace_view(const Medium& medium, const RefractedRays& rays, double observer_height_km,
                    double elevation_rad, double max_step_km);

/// The same, with the refractivity of wavelength `wavelength` (refraction = false: straight).
/// Builds the RefractedRays anew.
ViewPath trace_view(const Medium& medium, std::size_t wavelength, bool refraction,
                    double observer_height_km, double elevation_rad, double max_step_km);

/// What a gather needs; everything outlives the object.
struct GatherInputs {
  const Medium* medium = nullptr;
  const CellGrid* grid = nullptr;
  const DirectSunlight* sunlight = nullptr;
  const ExchangeOptics* optics = nullptr;
  const ExchangeResult* exchange = nullptr;
  SunGeometry sun;
  double observer_height_km = 0;
  std::vector<double> ground_albedo;  ///< per wavelength; empty = a black ground
  bool refraction = true;
  double max_step_km = 4.0;
};

/// Rings of cells between which the light at a step of a ray is interpolated.
struct StepCells {
  int count = 0;
  std::size_t ring[4];
  float weight[4];
};

/// Exact single scattering marched along the view ray plus multiple scattering
/// from the cells' field, interpolated at every step.
class ViewGather {
 public:
  explicit ViewGather(const GatherInputs& inputs);

  enum class Light {
    kAll,        ///< single scattering by the whole phase function, and multiple scattering
    kSingle,     ///< single scattering (and the ground's reflection of direct light) alone
    kTruncated,  ///< as kAll, single scattering by the truncated phase function: the sky that,
                 ///< with the beam less extinguished, carries exactly the energy of the exchange
  };

  /// What views of one elevation share: the path, the cells about every step, its sunlight's
  /// altitude; and the workspace of one thread. Building it costs as much as some three views.
  struct Ray {
    double elevation_rad = 0;
    ViewPath path;
    std::vector<StepCells> cells;
    std::vector<DirectSunlight::Level> level;
    GatherMarch march;
    std::vector<float> transmittance;
  };
  Ray ray(double elevation_rad) const;

  /// Radiance per unit solar irradiance, sr^-1, [lane].
  void radiance(Ray& ray, double relative_azimuth_rad, float* out, Light light = Light::kAll) const;
  void radiance(double elevation_rad, double relative_azimuth_rad, float* out,
                Light light = Light::kAll) const {
    Ray one = ray(elevation_rad);
    radiance(one, relative_azimuth_rad, out, light);
  }

  /// Emission of multiply scattered light towards the observer at a point of a ray at azimuth
  /// node j, km^-1 sr^-1 per unit irradiance, [lane].
  void multiple_emission(const ViewStep& step, int node, float* out) const;

 private:
  struct ShellRows {
    double log_r;
    bool altitude_bands;
    std::size_t first;
    std::vector<double> coordinate;
  };
  StepCells cells_about(const ViewStep& step) const;
  void add_emission(const ViewStep& step, const StepCells& cells, int j0, int j1, float f,
                    float* out) const;
  void add_ground(const Ray& ray, double azimuth_rad, int j0, int j1, float f, bool multiple,
                  float* out) const;

  GatherInputs in_;
  RefractedRays rays_;
  std::vector<ShellRows> shells_;
  std::vector<float> beam_extinction_;  // [layer][lane]
};

}  // namespace twilight
