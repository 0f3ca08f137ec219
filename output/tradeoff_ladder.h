// The ladder of settings whose cost and error `twilight tradeoff` measures.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/scene.h"

namespace twilight {

enum class RungKind {
  kSetting,        ///< resolution, or how far something is followed
  kApproximation,  ///< physics left out or simplified, mostly the paper's
  kMethod,         ///< a solver at the scene's own settings, or several settings together
};
std::string_view rung_kind_name(RungKind kind);

/// What a rung needs of the scene to say anything.
enum class RungNeeds { kNothing, kAerosols, kProfile };

/// One way to compute the scene: the scene with `overrides` on top.
struct Rung {
  std::string name;   ///< unique, of letters, digits, "-" and "."; also names its file
  std::string group;  ///< what is varied, "azimuth divisions"
  std::string label;  ///< the value, or the approximation in words
  RungKind kind = RungKind::kSetting;
  std::string method;                  ///< "orders", "cells" or "monte-carlo"
  std::vector<std::string> overrides;  ///< "KEY=VALUE" as --set takes them, the method's included
  RungNeeds needs = RungNeeds::kNothing;
  /// The rung that differs by this approximation alone; empty for other kinds.
  std::string baseline = {};
};

/// Every rung, the plain methods first; `quick`: a few of them.
std::vector<Rung> tradeoff_ladder(bool quick);

/// Why a rung says nothing of a scene ("the scene has no aerosol"), or nothing where it does.
std::optional<std::string> why_inapplicable(const Rung& rung, const Scene& scene);

/// Overrides that make a ladder quick, before the user's own.
std::vector<std::string> quick_base_overrides();

/// Overrides of the scene that make the reference by the method of orders: half the scene's solar
/// zenith step and at most 0.5 deg, 1.6 times its levels and directions in zenith angle (not quick:
/// at least 80 and 48), 1.34 times its phase degree (32), 200 layers (quick: twice the scene's), a
/// top of 120 km or the scene's own if higher, a tenth of its order tolerance, as many scattering
/// orders as that takes, and, not quick, a wavelength between each two of the scene's.
std::vector<std::string> orders_reference_overrides(const Scene& scene, bool quick);

/// Overrides that make the reference by Monte Carlo, at the scene's target_relative_error.
std::vector<std::string> monte_carlo_reference_overrides();

}  // namespace twilight
