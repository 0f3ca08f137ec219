// Units that files of particle optics come in.
#pragma once

#include <optional>
#include <string_view>

#include "aerosols/particle_optics.h"

namespace twilight {

/// How many nm, degrees or per cent are one of `unit`: "um", "micrometer", "nm", "m"; "degree",
/// "rad"; "percent", "1". Nothing for an unknown unit. Blanks do not count.
std::optional<double> nm_in(std::string_view unit);
std::optional<double> degrees_in(std::string_view unit);
std::optional<double> percent_in(std::string_view unit);

/// What a coefficient in some unit belongs to, and what a number of 1 in it is in km^-1 of that.
struct CoefficientUnit {
  OpticsPer per;
  double per_km;
};

/// Coefficients per mass ("km^-1/(g/m^3)", "m2 g-1"), per particle ("km-1 cm3", or the cross
/// section "um2") and of an air with particles ("km-1"), the last as kExtinctionAt550nm. Nothing
/// for an unknown unit.
std::optional<CoefficientUnit> coefficient_unit(std::string_view unit);

/// The unit in which particle_optics files of this program hold coefficients: CF (UDUNITS) text.
std::string_view coefficient_unit_text(OpticsPer per);

}  // namespace twilight
