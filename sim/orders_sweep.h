// One order of scattering: all light of a source that arrives on the field's grid.
#pragma once

#include "sim/orders_grid.h"
#include "sim/orders_medium.h"
#include "sim/orders_source.h"
#include "sim/run_control.h"

namespace twilight {

/// Light of the beam scattered, or reflected by the ground where `ground_light`, once. Same bytes
/// for any number of threads. Throws Cancelled.
template <class T>
IncomingLight<T> sweep(const OrdersGrid<T>& grid, const OrdersMedium& medium,
                       const BeamSource<T>& source, bool ground_light, const RunControl& control);

/// The same for light that was scattered before.
template <class T>
IncomingLight<T> sweep(const OrdersGrid<T>& grid, const OrdersMedium& medium,
                       const ScatteredSource<T>& source, bool ground_light,
                       const RunControl& control);

}  // namespace twilight
