// Single scattering of sunlight by aerosol: p11 and p12 of every kind and wavelength, for look-ups.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/orders.h"

namespace twilight {

/// p11 and p12 against scattering angle, 0..pi, interpolated linearly on a scale that crowds in the
/// forward peak; averaged over the Sun's disc within 10 degrees of it where asked.
class PhaseTable {
 public:
  /// The full phase functions of the medium's kinds times 1 (not delta-M's 1 - f), or the
  /// truncated ones times (1 - f): either way to be multiplied with the full scattering
  /// coefficient.
  PhaseTable(const AerosolKinds& kinds, const OrdersMedium& medium, const OrdersOptions& options,
             bool truncated);

  /// p11[lane] and p12[lane] of a kind.
  void at(std::size_t kind, double scattering_angle_rad, float* p11, float* p12) const;

  /// The table itself: node k stands at the angle pi (k / (kNodes - 1))^2;
  /// [kind][node][p11, p12][lane].
  static constexpr std::size_t kNodes = 4096;
  const float* values() const { return value_.data(); }

 private:
  std::size_t lanes_;
  std::vector<float> value_;  // [kind][node][p11, p12][lane]
};

}  // namespace twilight
