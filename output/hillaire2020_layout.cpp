#include "output/hillaire2020_layout.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "output/bruneton2017_layout.h"
#include "sim/elapsed_time.h"
#include "sim/zenith_grid.h"

namespace twilight {
namespace {

using std::numbers::pi;
// Altitude that the public shaders keep from either boundary, km.
constexpr double kOffset_km = 0.01;

double to_unit(double u, std::size_t n) {
  const auto size = static_cast<double>(n);
  return (u - 0.5 / size) * (size / (size - 1));
}

// Not the inverse of to_unit: the public shaders divide by n + 1 here.
double from_unit(double u, std::size_t n) {
  const auto size = static_cast<double>(n);
  return (u + 0.5 / size) * (size / (size + 1));
}

double centre(double texel, std::size_t n) { return (texel + 0.5) / static_cast<double>(n); }
double texel_of(double u, std::size_t n) { return u * static_cast<double>(n) - 0.5; }

// The transmittance table of 2017, whose texels are asked for between their centres.
Bruneton2017Layout mapping_2017(const Hillaire2020Layout::Sizes& sizes, double bottom, double top) {
  LayoutSizes n;
  n.transmittance_mu = sizes.transmittance_mu;
  n.transmittance_r = sizes.transmittance_r;
  return {n, {bottom, top, -0.2}};
}

// Seen by one observer, without the ground; views below the horizontal are stretched as in
// apparent_elevation_rad().
Texture fill_sky_view(const TableSource& source, const Hillaire2020Layout& layout,
                      double sun_elevation_rad) {
  Texture out(layout.sizes().sky_width, layout.sizes().sky_height);
  const double h = observer_altitude_km(source.model.scene);
  const double r = layout.bottom_radius_km() + h;
  const OrdersAtmosphere& air = *source.sky.atmosphere();
  const auto sky = source.sky.under(sun_elevation_rad);
  const double geometric = -std::acos(std::min(1.0, layout.bottom_radius_km() / r));
  const double apparent =
      pi / 2 - air.colours[air.middle_colour].rays.horizon_apparent_zenith_rad(h);
  // Upwards the sky may be interpolated; downwards the ground's light has to stay out.
  std::vector<ViewDirection> up, down;
  std::vector<float*> up_texels, down_texels;
  for (std::size_t y = 0; y < out.height; ++y) {
    for (std::size_t x = 0; x < out.width; ++x) {
      const auto view = layout.sky_view_at(r, {static_cast<double>(x), static_cast<double>(y)});
      out.at(x, y)[3] = 1;
      if (view.meets_ground && h <= 0) continue;
      const double elevation = apparent_elevation_rad(std::asin(view.mu), geometric, apparent);
      constexpr double kClear_rad = 1e-7;
      const double apart = view.meets_ground ? std::min(elevation, apparent - kClear_rad)
                           : h > 0           ? std::max(elevation, apparent + kClear_rad)
                                             : std::max(elevation, 0.0);
      (apart >= 0 ? up : down).push_back({apart, std::acos(view.cos_azimuth)});
      (apart >= 0 ? up_texels : down_texels).push_back(out.at(x, y));
    }
  }
  const std::span<const double> sun = source.model.solar_irradiance;
  const auto store = [&](std::vector<double> light, const std::vector<float*>& texels) {
    for (std::size_t v = 0; v < texels.size(); ++v) {
      const std::span<double> ratio(&light[v * sun.size()], sun.size());
      for (std::size_t w = 0; w < sun.size(); ++w) ratio[w] /= sun[w];
      const ChannelTriple rgb = source.channels.radiance(std::span<const double>(ratio));
      for (std::size_t c = 0; c < 3; ++c) {
        texels[v][c] = static_cast<float>(std::max(0.0, rgb[c]));
      }
    }
  };
  store(sky->map_radiance(up), up_texels);
  store(sky->scattered_radiance(down), down_texels);
  return out;
}

Texture fill_multiple(const TableSource& source, const Hillaire2020Layout& layout) {
  const std::size_t n = layout.sizes().multiple;
  Texture out(n, n);
  const OrdersAtmosphere& air = *source.sky.atmosphere();
  const std::vector<double>& levels = air.field->altitude_km;
  constexpr double kFine_rad = ZenithGrid::kFineStep_deg * pi / 180;
  const std::size_t W = air.wavelengths(), L = air.lanes();
  std::vector<double> mean(W);
  for (std::size_t y = 0; y < n; ++y) {
    for (std::size_t x = 0; x < n; ++x) {
      const auto [r, cosine] = layout.multiple_at({static_cast<double>(x), static_cast<double>(y)});
      const double h = std::clamp(r - layout.bottom_radius_km(), 0.0, levels.back());
      const auto above = std::upper_bound(levels.begin() + 1, levels.end() - 1, h);
      const auto i = static_cast<std::size_t>(above - levels.begin() - 1);
      const double g = (h - levels[i]) / (levels[i + 1] - levels[i]);
      const double u = std::min(std::acos(std::clamp(cosine, -1.0, 1.0)) / kFine_rad,
                                static_cast<double>(ZenithGrid::kFineSize) - 1.001);
      const auto k = static_cast<std::size_t>(u);
      const double f = u - static_cast<double>(k);
      for (std::size_t w = 0; w < W; ++w) {
        const auto at = [&](std::size_t level) {
          const float* row = &air.reference[(level * ZenithGrid::kFineSize + k) * L + w];
          return std::lerp(static_cast<double>(row[0]), static_cast<double>(row[L]), f);
        };
        mean[w] = std::lerp(at(i), at(i + 1), g) / (4 * pi);
      }
      const ChannelTriple rgb = source.channels.mean(mean);
      float* texel = out.at(x, y);
      for (std::size_t c = 0; c < 3; ++c) texel[c] = static_cast<float>(std::max(0.0, rgb[c]));
      texel[3] = 1;
    }
  }
  return out;
}

}  // namespace

Hillaire2020Layout::Sizes Hillaire2020Layout::Sizes::scaled(double factor) const {
  const auto times = [&](std::size_t n) {
    return std::max<std::size_t>(
        4, static_cast<std::size_t>(std::lround(factor * static_cast<double>(n))));
  };
  return {times(transmittance_mu), times(transmittance_r), times(multiple), times(sky_width),
          times(sky_height)};
}

Hillaire2020Layout::Hillaire2020Layout(const Sizes& sizes, double bottom_radius_km,
                                       double top_radius_km)
    : sizes_(sizes), bottom_(bottom_radius_km), top_(top_radius_km) {
  if (!(bottom_ > 0 && top_ > bottom_)) {
    throw std::invalid_argument("table geometry: radii must increase from above 0");
  }
  for (const std::size_t n : {sizes.transmittance_mu, sizes.transmittance_r, sizes.multiple,
                              sizes.sky_width, sizes.sky_height}) {
    if (n < 2 || n > 4096) {
      throw std::invalid_argument("table sizes: each axis must have 2..4096 texels");
    }
  }
  horizon_km_ = std::sqrt((top_ - bottom_) * (top_ + bottom_));
}

RadiusCosine Hillaire2020Layout::transmittance_at(TexelPoint texel) const {
  const Bruneton2017Layout mapping = mapping_2017(sizes_, bottom_, top_);
  return mapping.transmittance_at(
      {centre(texel.x, sizes_.transmittance_mu) * static_cast<double>(sizes_.transmittance_mu - 1),
       centre(texel.y, sizes_.transmittance_r) * static_cast<double>(sizes_.transmittance_r - 1)});
}

TexelPoint Hillaire2020Layout::transmittance_texel(RadiusCosine view) const {
  const TexelPoint at = mapping_2017(sizes_, bottom_, top_).transmittance_texel(view);
  return {
      texel_of(at.x / static_cast<double>(sizes_.transmittance_mu - 1), sizes_.transmittance_mu),
      texel_of(at.y / static_cast<double>(sizes_.transmittance_r - 1), sizes_.transmittance_r)};
}

RadiusCosine Hillaire2020Layout::multiple_at(TexelPoint texel) const {
  const double u = to_unit(centre(texel.x, sizes_.multiple), sizes_.multiple);
  const double v = to_unit(centre(texel.y, sizes_.multiple), sizes_.multiple);
  return {bottom_ + std::clamp(v + kOffset_km, 0.0, 1.0) * (top_ - bottom_ - kOffset_km),
          2 * u - 1};
}

TexelPoint Hillaire2020Layout::multiple_texel(RadiusCosine sun) const {
  const double u = std::clamp(0.5 * sun.cosine + 0.5, 0.0, 1.0);
  const double v = std::clamp((sun.r_km - bottom_) / (top_ - bottom_), 0.0, 1.0);
  return {texel_of(from_unit(u, sizes_.multiple), sizes_.multiple),
          texel_of(from_unit(v, sizes_.multiple), sizes_.multiple)};
}

Hillaire2020Layout::SkyView Hillaire2020Layout::sky_view_at(double r, TexelPoint texel) const {
  const double u = std::clamp(to_unit(centre(texel.x, sizes_.sky_width), sizes_.sky_width), 0., 1.);
  const double v =
      std::clamp(to_unit(centre(texel.y, sizes_.sky_height), sizes_.sky_height), 0.0, 1.0);
  const double beta = std::acos(std::sqrt(std::max(0.0, (r - bottom_) * (r + bottom_))) / r);
  const double horizon = pi - beta;
  SkyView view;
  view.meets_ground = v >= 0.5;
  const double s = view.meets_ground ? 2 * v - 1 : 1 - 2 * v;
  view.mu = std::cos(view.meets_ground ? horizon + beta * s * s : horizon * (1 - s * s));
  view.cos_azimuth = std::clamp(1 - 2 * u * u, -1.0, 1.0);
  return view;
}

TexelPoint Hillaire2020Layout::sky_view_texel(double r, const SkyView& view) const {
  const double beta = std::acos(std::sqrt(std::max(0.0, (r - bottom_) * (r + bottom_))) / r);
  const double horizon = pi - beta, zenith = std::acos(std::clamp(view.mu, -1.0, 1.0));
  const double v = view.meets_ground
                       ? 0.5 + 0.5 * std::sqrt(std::max(0.0, (zenith - horizon) / beta))
                       : 0.5 - 0.5 * std::sqrt(std::max(0.0, 1 - zenith / horizon));
  const double u = std::sqrt(std::max(0.0, 0.5 - 0.5 * view.cos_azimuth));
  return {texel_of(from_unit(u, sizes_.sky_width), sizes_.sky_width),
          texel_of(from_unit(v, sizes_.sky_height), sizes_.sky_height)};
}

std::vector<std::pair<std::string, std::string>> Hillaire2020Layout::formulas() const {
  return {
      {"H", "sqrt(top_radius^2 - bottom_radius^2); rho = sqrt(r^2 - bottom_radius^2)"},
      {"transmittance",
       "texel i of n at u = (i + 1/2) / n; u_mu = (d - (top_radius - r)) / (rho + H - (top_radius "
       "- "
       "r)), d = distance from r under mu to top_radius; u_r = rho / H"},
      {"multiple scattering",
       "texel i of n at u = i / (n - 1): u_x = (cos(solar zenith) + 1) / 2, r = bottom_radius + "
       "min(u_y + 0.01, 1) (top_radius - bottom_radius - 0.01 km)"},
      {"sky view",
       "texel i of n at u = i / (n - 1): cos(azimuth from the Sun) = 1 - 2 u_x^2; v = u_y < 1/2: "
       "zenith angle = horizon (1 - (1 - 2 v)^2); else horizon + (pi - horizon) (2 v - 1)^2, "
       "horizon "
       "= pi - acos(rho / r)"}};
}

HillaireTables fill_hillaire_tables(const TableSource& source, const Hillaire2020Layout& layout,
                                    const std::vector<double>& sun_elevation_deg,
                                    const RunControl& control) {
  const auto start = Clock::now();
  HillaireTables out;
  out.sun_elevation_deg = sun_elevation_deg;
  control.report("transmittance", 0);
  out.transmittance =
      fill_transmittance(source, layout.sizes().transmittance_mu, layout.sizes().transmittance_r,
                         [&](TexelPoint texel) { return layout.transmittance_at(texel); });
  out.multiple = fill_multiple(source, layout);
  for (std::size_t s = 0; s < sun_elevation_deg.size(); ++s) {
    control.check();
    control.report("sky views",
                   static_cast<double>(s) / static_cast<double>(sun_elevation_deg.size()));
    out.sky_view.push_back(fill_sky_view(source, layout, sun_elevation_deg[s] * pi / 180));
  }
  out.seconds = seconds_since(start);
  return out;
}

}  // namespace twilight
