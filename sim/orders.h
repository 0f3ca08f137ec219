// Successive orders of scattering on the plane of altitude and solar zenith angle.
#pragma once

#include "sim/direct_sunlight.h"
#include "sim/orders_field.h"
#include "sim/orders_medium.h"
#include "sim/orders_options.h"
#include "sim/run_control.h"

namespace twilight {

/// Solves for the light scattered once or more. Same bytes for any number of threads.
/// Throws Cancelled.
OrdersField solve_orders(const OrdersMedium& medium, const DirectSunlight& sunlight,
                         const OrdersOptions& options, const RunControl& control);

}  // namespace twilight
