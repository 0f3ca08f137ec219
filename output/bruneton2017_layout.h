// The tables of "Precomputed Atmospheric Scattering: a New Implementation" (Bruneton 2017).
#pragma once

#include "output/table_layout.h"

namespace twilight {

/// The mappings of the implementation of 2017: distances to the nearest boundary of the air, over
/// their range, for mu; the distance that the Sun's ray from the ground has to the top for mu_s.
/// Every axis puts its end points on the centres of the first and last texel.
class Bruneton2017Layout : public TableLayout {
 public:
  /// Throws as TableLayout.
  Bruneton2017Layout(const LayoutSizes& sizes, const LayoutGeometry& geometry);

  std::string_view name() const override { return "bruneton2017"; }
  std::vector<std::pair<std::string, std::string>> formulas() const override;
  RadiusCosine transmittance_at(TexelPoint texel) const override;
  TexelPoint transmittance_texel(RadiusCosine view) const override;
  RadiusCosine irradiance_at(TexelPoint texel) const override;
  TexelPoint irradiance_texel(RadiusCosine sun) const override;
  double scattering_mu(double r_km, double j) const override;
  double scattering_mu_texel(double r_km, double mu, bool meets_ground) const override;
  double scattering_mu_s(double k) const override;
  double scattering_mu_s_texel(double mu_s) const override;

 private:
  /// Distance from r to the top under mu, km, and the cosine that has it.
  double to_top_km(double r_km, double mu) const;
  double mu_of_top(double r_km, double distance_km) const;
  double largest_a() const;  ///< A of the mu_s mapping
};

}  // namespace twilight
