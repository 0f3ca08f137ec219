// The look-up tables of "A Scalable and Production Ready Sky and Atmosphere Rendering Technique"
// (Hillaire 2020).
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "output/sky_tables.h"
#include "sim/run_control.h"

namespace twilight {

/// Mappings of the public implementation's shaders. Transmittance: Bruneton's of 2017 with texel i
/// of n at u = (i + 1/2) / n. Multiple scattering: u_x = (cos(solar zenith) + 1) / 2, u_y =
/// altitude over the air's height. Sky view: the horizon in the middle row, rows crowding at it.
class Hillaire2020Layout {
 public:
  struct Sizes {
    std::size_t transmittance_mu = 256, transmittance_r = 64, multiple = 32, sky_width = 192,
                sky_height = 108;
    Sizes scaled(double factor) const;
  };
  /// Throws std::invalid_argument unless 0 < bottom < top and every size is 2..4096.
  Hillaire2020Layout(const Sizes& sizes, double bottom_radius_km, double top_radius_km);

  RadiusCosine transmittance_at(TexelPoint texel) const;
  TexelPoint transmittance_texel(RadiusCosine view) const;
  /// Of the multiple scattering table; the look-up's texels differ from the writer's by at most
  /// 1/66 of one, as in the public shaders.
  RadiusCosine multiple_at(TexelPoint texel) const;
  TexelPoint multiple_texel(RadiusCosine sun) const;
  /// Of the sky view from r: cosines of the view's zenith angle and of its azimuth from the Sun.
  struct SkyView {
    double mu = 0.0, cos_azimuth = 1.0;
    bool meets_ground = false;
  };
  SkyView sky_view_at(double r_km, TexelPoint texel) const;
  TexelPoint sky_view_texel(double r_km, const SkyView& view) const;

  std::vector<std::pair<std::string, std::string>> formulas() const;
  const Sizes& sizes() const { return sizes_; }
  double bottom_radius_km() const { return bottom_; }
  double top_radius_km() const { return top_; }

 private:
  Sizes sizes_;
  double bottom_, top_, horizon_km_;
};

struct HillaireTables {
  Texture transmittance, multiple;
  /// One per Sun: light scattered towards the viewer at the scene's observer, without the ground's.
  std::vector<Texture> sky_view;
  std::vector<double> sun_elevation_deg;
  double seconds = 0.0;
};

/// Fills them. `multiple` is the mean radiance over all directions of light that has been scattered
/// or reflected at least once, per unit solar illuminance, sr^-1: what a renderer multiplies with
/// the scattering coefficient. It is that of delta-M's truncated phase functions: light in their
/// forward peak counts as sunlight still. Throws Cancelled when stopped.
HillaireTables fill_hillaire_tables(const TableSource& source, const Hillaire2020Layout& layout,
                                    const std::vector<double>& sun_elevation_deg,
                                    const RunControl& control);

}  // namespace twilight
