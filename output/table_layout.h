// Where the texels of a real-time renderer's sky tables stand.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace twilight {

/// Texels along every axis; the defaults are those of Bruneton & Neyret (2008), Sec. 6, which the
/// implementation of 2017 kept.
struct LayoutSizes {
  std::size_t transmittance_mu = 256, transmittance_r = 64;
  std::size_t r = 32, mu = 128, mu_s = 32, nu = 8;  ///< scattering; mu is even
  std::size_t irradiance_mu_s = 64, irradiance_r = 16;

  /// Every axis times a factor (the scattering table's nu by its intervals: 8 -> 15 for 2).
  LayoutSizes scaled(double factor) const;
};

/// Geometry that a layout's formulas need.
struct LayoutGeometry {
  double bottom_radius_km = 6360.0, top_radius_km = 6420.0;
  double mu_s_min = 0.0;  ///< cosine of the largest solar zenith angle held
};

/// A place of a 2D table: x along the row (cosine), y across rows (altitude). Texel coordinates: 0
/// at the centre of the first texel, size - 1 at the last one's.
struct TexelPoint {
  double x = 0.0, y = 0.0;
};
/// Distance from the planet's centre, km, and the cosine of a zenith angle (of view or Sun).
struct RadiusCosine {
  double r_km = 0.0, cosine = 0.0;
};

/// The precomputed-scattering layouts: transmittance T(r, mu), irradiance E(r, mu_s) and
/// scattering S(r, mu, mu_s, nu), the last packed as a 3D texture of (nu mu_s) x mu x r texels with
/// mu_s running fastest. Formulas are straight-line geometry; each function takes what its inverse
/// gives.
class TableLayout {
 public:
  virtual ~TableLayout() = default;

  virtual std::string_view name() const = 0;
  /// The mappings as text: quantity, formula with texel centres.
  virtual std::vector<std::pair<std::string, std::string>> formulas() const = 0;

  virtual RadiusCosine transmittance_at(TexelPoint texel) const = 0;
  virtual TexelPoint transmittance_texel(RadiusCosine view) const = 0;
  virtual RadiusCosine irradiance_at(TexelPoint texel) const = 0;
  virtual TexelPoint irradiance_texel(RadiusCosine sun) const = 0;

  /// Scattering, axis by axis. The lower half of the mu axis holds the views that meet the ground.
  double scattering_r_km(double k) const;
  double scattering_r_texel(double r_km) const;
  virtual double scattering_mu(double r_km, double j) const = 0;
  virtual double scattering_mu_texel(double r_km, double mu, bool meets_ground) const = 0;
  bool meets_ground_texel(double j) const { return j < 0.5 * static_cast<double>(sizes_.mu); }
  virtual double scattering_mu_s(double k) const = 0;
  /// Clamped to the table's range.
  virtual double scattering_mu_s_texel(double mu_s) const = 0;
  double scattering_nu(double l) const;
  double scattering_nu_texel(double nu) const;

  /// Whether the straight ray from r_km under the cosine mu meets the ground.
  bool meets_ground(double r_km, double mu) const;

  const LayoutSizes& sizes() const { return sizes_; }
  const LayoutGeometry& geometry() const { return geometry_; }
  /// Length of the horizontal ray from the ground to the top, km (H of the paper).
  double horizon_km() const { return horizon_km_; }

 protected:
  /// Throws std::invalid_argument for radii, sizes (each at least 2, mu even and at least 4) or a
  /// mu_s_min out of [-1, 0).
  TableLayout(const LayoutSizes& sizes, const LayoutGeometry& geometry);
  /// Distance from a radius to the horizon, km (rho).
  double rho_km(double r_km) const;

 private:
  LayoutSizes sizes_;
  LayoutGeometry geometry_;
  double horizon_km_;
};

/// Names that make_layout() knows.
const std::vector<std::string>& layout_names();

/// "bruneton2008", "bruneton2017" or "twilight". largest_solar_zenith_deg: 90..120; 0: the layout's
/// own (101.5 for bruneton2008, whose formula has no other; 102; 108.5). Throws
/// std::invalid_argument for other names and values out of range.
std::unique_ptr<TableLayout> make_layout(std::string_view name, const LayoutSizes& sizes,
                                         double bottom_radius_km, double top_radius_km,
                                         double largest_solar_zenith_deg = 0.0);

}  // namespace twilight
