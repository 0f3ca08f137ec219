// Options of solver.method = "hoffman-preetham".
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace twilight {

/// The haze over the air molecules.
struct HoffmanPreethamOptions {
  /// "none" or a row of their Table 1: "light haze", "heavy haze", "light fog", "heavy fog".
  std::string haze = "light haze";
  /// Scattering at the ground in place of the table's, three values 0..100 km^-1 at 650, 570 and
  /// 475 nm (their R, G, B); empty: the table's.
  std::vector<double> haze_scattering_per_km;
  double haze_absorption_per_km = 0.0;  ///< 0..100, grey; theirs reaches 0.05
  /// Their g, -1000..1000: in place of the table's (0 without haze).
  std::optional<double> asymmetry;
  /// "normalised": Henyey-Greenstein, integral 1, of the printed function's shape and bright
  /// towards the Sun; "printed": their function to the letter (see hoffman_preetham.h).
  std::string phase = "normalised";
};

}  // namespace twilight
