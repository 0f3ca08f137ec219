// The layout of 2017 with another mapping of the Sun, for twilight.
#pragma once

#include "output/bruneton2017_layout.h"

namespace twilight {

/// As Bruneton2017Layout but for the scattering table's mu_s axis, which runs in the solar zenith
/// angle z (degrees): u = 1 - t(z) / t(z_max), t = z / 3 up to kDusk_deg, growing three times as
/// fast beyond. It reaches solar zenith angle acos(mu_s_min), 108.5 degrees: the end of
/// astronomical twilight.
class TwilightLayout : public Bruneton2017Layout {
 public:
  static constexpr double kDusk_deg = 84.0;

  TwilightLayout(const LayoutSizes& sizes, const LayoutGeometry& geometry)
      : Bruneton2017Layout(sizes, geometry) {}

  std::string_view name() const override { return "twilight"; }
  std::vector<std::pair<std::string, std::string>> formulas() const override;
  double scattering_mu_s(double k) const override;
  double scattering_mu_s_texel(double mu_s) const override;

 private:
  double largest_t() const;
};

}  // namespace twilight
