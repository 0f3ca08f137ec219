// Options of solver.method "preetham", "cie-clear" and "cie-overcast".
#pragma once

#include <optional>
#include <string>

namespace twilight {

struct PreethamOptions {
  /// T = (tau_m + tau_h) / tau_m at 550 nm, 1..100 (the sky was fitted to 2..6). Unset: that of the
  /// scene's air (sim/models/turbidity.h). Of "preetham" and "cie-clear".
  std::optional<double> turbidity;
  /// "scene": the Sun's elevation as for every method; "preetham": by their appendix A.6 where a
  /// place and time are given (azimuths stay the scene's). Of "preetham" alone.
  std::string sun_position = "scene";
};

struct CieOptions {
  /// Of the zenith, 0..1e6. Unset: Preetham's Y_z for "cie-clear", Krochmann & Seidl's for
  /// "cie-overcast".
  std::optional<double> zenith_luminance_cd_m2;
};

}  // namespace twilight
