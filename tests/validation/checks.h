// The subjects of the table, each in a file of its own.
#pragma once

#include <vector>

#include "tests/validation/validation.h"

namespace twilight::validation {

/// The project's 48 Rayleigh skies: by orders, order by order, by Monte Carlo.
std::vector<Section> open_cases_sections();

/// libRadtran's own spherical example.
std::vector<Section> libradtran_sections();

/// Natraj et al. (2009, 2012), Kokhanovsky et al. (2010), Adams & Kattawar (1978).
std::vector<Section> plane_parallel_sections();

/// "orders" against "monte-carlo", one section for each air and albedo, another for the Sun at
/// -15 and -18 degrees.
std::vector<Section> orders_against_monte_carlo_sections();

/// Clear-sky illuminance against the almanacs.
std::vector<Section> illuminance_sections();

/// Koomen et al. (1952), and variants of the scene.
std::vector<Section> koomen_sections();

/// Patat et al. (2006).
std::vector<Section> paranal_sections();

/// Every step of the orders' grids halved.
std::vector<Section> grid_convergence_sections();

/// Air mass, refraction, and the switches of the Sun.
std::vector<Section> refracted_sun_sections();

}  // namespace twilight::validation
