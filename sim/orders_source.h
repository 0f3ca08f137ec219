// Light about to be scattered by one order.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "sim/direct_sunlight.h"
#include "sim/orders_grid.h"
#include "sim/orders_medium.h"
#include "sim/orders_options.h"
#include "sim/sun_disc_profile.h"

namespace twilight {

/// Direct sunlight at one altitude after the other; averaged over the Sun's disc where asked.
class BeamRows {
 public:
  BeamRows(const DirectSunlight& sunlight, const OrdersOptions& options,
           std::span<const double> wavelength_nm);
  /// Irradiance normal to the beam over that above the atmosphere on the fine zenith scale of
  /// ZenithGrid, beam[fine][lane].
  void row(double altitude_km, std::span<float> beam) const;

 private:
  const DirectSunlight& sunlight_;
  std::size_t wavelengths_;
  std::optional<DiscAverage> disc_;
};

/// Direct sunlight on levels finer than the field's, for it has edges.
template <class T>
struct BeamSource {
  std::vector<double> level_km;
  /// Fewer of these levels, by index and altitude, where the Sun is high.
  std::vector<std::size_t> day_level;
  std::vector<double> day_level_km;
  std::vector<T> irradiance;     ///< normal to the beam, [level][fine][lane]
  std::vector<std::size_t> end;  ///< [level], fine points from which it is 0
  std::vector<T> lift_rad;       ///< zenith angle of the Sun less its apparent one, [level][fine]
  std::vector<T> ground;         ///< irradiance of the ground, [fine][lane]
};

template <class T>
BeamSource<T> beam_source(const OrdersGrid<T>& grid, const OrdersMedium& medium,
                          const DirectSunlight& sunlight, const OrdersOptions& options);

/// Light that has been scattered before, relative to a reference that falls as steeply as it does:
/// the trace of its coherency tensor.
template <class T>
struct ScatteredSource {
  std::vector<T> coherency;  ///< as air scatters it, [level][node][4][lane]
  std::vector<T> reference;  ///< [level][fine][lane]
  std::vector<T> ground;     ///< irradiance of the ground, [fine][lane]
  int phase_degree = 0;      ///< of the moments that aerosols scatter
  /// What each kind of aerosol makes of the moments, see AerosolPoints: [aerosol level][kind] is
  /// the place in `scattered`, or kAbsent where the kind is far from the level.
  static constexpr std::size_t kAbsent = static_cast<std::size_t>(-1);
  std::vector<std::size_t> scattered_at;
  std::vector<T> scattered;
};

/// phase_degree: moments above it are left out.
template <class T>
ScatteredSource<T> scattered_source(const OrdersGrid<T>& grid, const OrdersMedium& medium,
                                    const IncomingLight<T>& light, int phase_degree);

}  // namespace twilight
