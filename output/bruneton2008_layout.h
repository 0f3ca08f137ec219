// The tables of Bruneton & Neyret (2008).
#pragma once

#include "output/table_layout.h"
#include "sim/models/bruneton_mapping.h"

namespace twilight {

/// The mappings of "Precomputed Atmospheric Scattering" (Sec. 4, "Parameterization") for
/// scattering (sim/models/bruneton_mapping). The paper gives none for T and E: theirs are those of
/// the authors' public program, by its look-ups. The smallest mu_s is -0.2 (a Sun at -11.5
/// degrees).
class Bruneton2008Layout : public TableLayout {
 public:
  /// Throws as TableLayout.
  Bruneton2008Layout(const LayoutSizes& sizes, double bottom_radius_km, double top_radius_km);

  std::string_view name() const override { return "bruneton2008"; }
  std::vector<std::pair<std::string, std::string>> formulas() const override;
  RadiusCosine transmittance_at(TexelPoint texel) const override;
  TexelPoint transmittance_texel(RadiusCosine view) const override;
  RadiusCosine irradiance_at(TexelPoint texel) const override;
  TexelPoint irradiance_texel(RadiusCosine sun) const override;
  /// Texels nearer than the nearest boundary stand for no view: the vertical one is given.
  double scattering_mu(double r_km, double j) const override;
  double scattering_mu_texel(double r_km, double mu, bool meets_ground) const override;
  double scattering_mu_s(double k) const override;
  double scattering_mu_s_texel(double mu_s) const override;

 private:
  BrunetonSphere sphere() const;
};

}  // namespace twilight
