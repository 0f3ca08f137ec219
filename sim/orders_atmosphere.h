// What every view of one solved atmosphere needs, whatever the Sun's place and the observer's.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "atmosphere/refraction.h"
#include "sim/direct_sunlight.h"
#include "sim/orders.h"
#include "sim/phase_table.h"
#include "sim/scene_model.h"
#include "sim/sunlit_air.h"
#include "sim/zenith_grid.h"

namespace twilight {

/// Wavelengths [first, last) that share the refracted rays of one of them: colours bend
/// differently, by 2 % from blue to red.
struct ColourRays {
  std::size_t first, last;
  RefractedRays rays;
};

/// The orders method's field, and the medium and direct sunlight that it was solved from.
struct SolvedAtmosphere {
  /// Solves the field, or takes one solved before for the same atmosphere, ground, wavelengths and
  /// grid. Of the model the Sun's and the observer's place do not matter. Runs on the current
  /// oneTBB arena; adds its stages' seconds to `summary`.
  /// Throws Cancelled when stopped; std::invalid_argument for an invalid model, or where the
  /// field's sizes do not fit it.
  SolvedAtmosphere(const SceneModel& model, std::shared_ptr<const OrdersField> field,
                   const RunControl& control, RunSummary& summary);

  Medium medium;  ///< as given, not truncated
  OrdersOptions options;
  OrdersMedium optics;
  std::unique_ptr<const DirectSunlight> sunlight;
  std::shared_ptr<const OrdersField> field;

  std::size_t lanes() const { return optics.lanes; }
  std::size_t wavelengths() const { return medium.wavelengths(); }
  /// What a summary tells of the field.
  std::vector<std::pair<std::string, std::string>> figures() const;

 private:
  void require_fit() const;
};

/// A solved atmosphere and all that looking at it needs: phase functions, direct sunlight along
/// views, and the field relative to its trace. Skies of one atmosphere under many Suns share it
/// (0.5 s to make for 8 wavelengths, a further sky milliseconds). Immutable once made, and safe to
/// share between threads.
class OrdersAtmosphere : public SolvedAtmosphere {
 public:
  /// As SolvedAtmosphere.
  OrdersAtmosphere(const SceneModel& model, std::shared_ptr<const OrdersField> field,
                   const RunControl& control, RunSummary& summary);
  OrdersAtmosphere(const OrdersAtmosphere&) = delete;
  OrdersAtmosphere& operator=(const OrdersAtmosphere&) = delete;

  std::size_t kind_count() const { return kinds.scattering_per_km.size(); }

  ZenithGrid zenith;
  std::unique_ptr<const SunlitAir> sunlit;
  AerosolKinds kinds;  ///< point into `medium`
  std::unique_ptr<const PhaseTable> phase, truncated_phase;
  std::vector<ColourRays> colours;
  std::size_t middle_colour = 0;
  /// Scattering coefficients, [layer][lane] and [layer][kind][lane].
  std::vector<float> air_per_km, kind_per_km;
  /// Altitude step of single scattering, km, [layer]: half a kilometre in clear air, down to 0.1 in
  /// haze, whose level sunlight changes within it when the Sun is low.
  std::vector<double> single_step_km;
  /// The field relative to its trace ([level][node][4 or moment][lane]), the trace on ZenithGrid's
  /// fine scale ([level][fine][lane]) and the ground's diffuse irradiance on it ([fine][lane]).
  std::vector<float> coherency, moments, reference, ground;
  /// Expansion coefficients of the kinds' truncated phase functions, [kind][a1, b1][l][lane].
  std::vector<float> kind_expansion;

  /// AngularBasis::p times (2 - delta_m0) / (4 pi) by moment_index, to 1e-4 (degree 24).
  void emission_basis(double zenith_rad, float* p) const;

 private:
  void relate_field();
  void tabulate_emission();
  std::vector<float> basis_;  // [zenith angle][moment_index]
};

OrdersOptions orders_options(const SceneModel& model);

}  // namespace twilight
