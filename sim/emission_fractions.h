// Where the light that a cell emits evenly goes, if nothing scatters it.
#pragma once

#include <cstddef>

#include "sim/cell_grid.h"
#include "sim/exchange_medium.h"

namespace twilight {

/// Transmitted fractions of isotropic emission at a ring's point, [wavelength]: to the ground, and
/// out of the cells' domain, by quadrature over directions.
void emission_fractions(const ExchangeMedium& medium, const CellGrid& grid, const CellRing& ring,
                        std::size_t wavelengths, double* escape, double* ground);

}  // namespace twilight
