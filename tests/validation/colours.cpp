#include "tests/validation/colours.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "output/field_file.h"
#include "output/photometry.h"
#include "solar/solar_spectrum.h"

namespace twilight::validation {
namespace {

constexpr double kTropopauseKm = 12.0;  // OPAC's stratospheric layer begins here

Scene scene_of(Scene scene, const ColourAir& air) {
  scene.solver.method = "orders";
  scene.sun.elevation_deg = 0;
  scene.atmosphere.ozone_du = air.ozone_du;
  scene.aerosols.type = air.aerosol;
  return scene;
}

// OPAC's stratosphere is the last kind of aerosol; a layer that straddles the tropopause has a
// part of both.
void change_aerosol(Medium& medium, const ColourAir& air) {
  if (air.stratosphere_factor == 1 && air.tropospheric_aerosol) return;
  if (medium.aerosol_phase.size() < 2) {
    throw std::invalid_argument(
        "stratosphere_factor and tropospheric_aerosol need an OPAC type "
        "with Mie phase, not " +
        air.aerosol);
  }
  const LayerTable now = medium.aerosol_kind_scattering_per_km.back();
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    const bool above = medium.boundary_km[i] >= kTropopauseKm;
    for (std::size_t w = 0; w < medium.wavelengths(); ++w) {
      double& absorption = medium.aerosol_absorption_per_km(i, w);
      if (above) absorption *= air.stratosphere_factor;
      if (!above && !air.tropospheric_aerosol) absorption = 0;  // sulphate hardly absorbs
      const double others =
          air.tropospheric_aerosol ? medium.aerosol_scattering_per_km(i, w) - now(i, w) : 0.0;
      const double stratospheric = air.stratosphere_factor * now(i, w);
      medium.aerosol_kind_scattering_per_km.back()(i, w) = stratospheric;
      medium.aerosol_scattering_per_km(i, w) = std::max(0.0, others) + stratospheric;
    }
  }
  if (air.tropospheric_aerosol) return;
  medium.aerosol_phase.erase(medium.aerosol_phase.begin(), medium.aerosol_phase.end() - 1);
  medium.aerosol_kind_scattering_per_km.erase(medium.aerosol_kind_scattering_per_km.begin(),
                                              medium.aerosol_kind_scattering_per_km.end() - 1);
}

}  // namespace

ColourSkies::ColourSkies(Scene scene, ColourAir air, std::filesystem::path fields)
    : air_(std::move(air)),
      model_(build_scene_model(scene_of(std::move(scene), air_))),
      integrator_(
          model_.medium.wavelength_nm,
          [this](double nm) { return solar_irradiance_w_m2_nm(model_.scene.sun.spectrum, nm); },
          ColourObserver::kCie1931),
      fields_(std::move(fields)) {
  change_aerosol(model_.medium, air_);
}

const OrdersSky& ColourSkies::under(double sun_deg) {
  const double height_m = model_.scene.observer.height_m;
  if (sky_ && sky_sun_deg_ == sun_deg && sky_height_m_ == height_m) return *sky_;
  sky_sun_deg_ = sun_deg;
  sky_height_m_ = height_m;
  const std::filesystem::path file = fields_ / (air_.name + ".nc");
  if (!field_ && !fields_.empty() && std::filesystem::exists(file)) {
    field_ = std::make_shared<const OrdersField>(read_field(file, model_));
  }
  const bool solve = !field_;
  const Stopwatch watch;
  model_.sun_elevation_rad = sun_deg * kRadPerDeg;
  sky_ = std::make_unique<OrdersSky>(model_, field_, RunControl{});
  field_ = sky_->field();
  if (solve) {
    solve_seconds_ = watch.seconds();
    if (!fields_.empty()) write_field(file, *field_, model_);
  }
  return *sky_;
}

std::vector<SkyColour> ColourSkies::look(double sun_deg, std::span<const ViewAngles> views) {
  const OrdersSky& sky = under(sun_deg);
  std::vector<ViewDirection> directions;
  for (const ViewAngles& v : views) directions.push_back(v.direction());
  const std::vector<double> radiance = sky.radiance(directions);
  const std::size_t W = model_.medium.wavelengths();
  std::vector<SkyColour> colours(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    SkyColour& c = colours[v];
    c.radiance.assign(radiance.begin() + static_cast<std::ptrdiff_t>(v * W),
                      radiance.begin() + static_cast<std::ptrdiff_t>((v + 1) * W));
    const Tristimulus xyz = integrator_.xyz(c.radiance, model_.solar_irradiance);
    c.xy = chromaticity(xyz);
    c.luminance_cd_m2 = kLuminousEfficacy_lm_w * xyz[1];
    c.rgb = linear_rec709({xyz[0] / xyz[1], 1.0, xyz[2] / xyz[1]});
    c.red_over_blue = relative_radiance(c, 650) / relative_radiance(c, 450);
  }
  return colours;
}

SkyColour ColourSkies::zenith(double sun_deg) {
  const ViewAngles up{90, 0};
  return look(sun_deg, {&up, 1}).front();
}

double ColourSkies::relative_radiance(const SkyColour& colour, double wavelength_nm) const {
  const std::vector<double>& nm = model_.medium.wavelength_nm;
  if (wavelength_nm < nm.front() || wavelength_nm > nm.back()) {
    throw std::invalid_argument("wavelength " + std::to_string(wavelength_nm) +
                                " nm is outside those of the scene");
  }
  const auto at = [&](std::size_t w) {
    return colour.radiance[w] / model_.solar_irradiance[w] * std::pow(nm[w] / wavelength_nm, 4);
  };
  const auto above =
      static_cast<std::size_t>(std::ranges::upper_bound(nm, wavelength_nm) - nm.begin());
  if (above == nm.size()) return at(nm.size() - 1);
  const double t = (wavelength_nm - nm[above - 1]) / (nm[above] - nm[above - 1]);
  return (1 - t) * at(above - 1) + t * at(above);
}

Chromaticity ColourSkies::sunlight() const {
  Tristimulus sum{};
  for (int nm = kFirstObserverWavelength_nm; nm <= kLastObserverWavelength_nm; ++nm) {
    const Tristimulus cmf = colour_matching(ColourObserver::kCie1931, nm);
    const double e = solar_irradiance_w_m2_nm(model_.scene.sun.spectrum, nm);
    for (std::size_t k = 0; k < 3; ++k) sum[k] += e * cmf[k];
  }
  return chromaticity(sum);
}

double ColourSkies::aerosol_optical_depth(double bottom_km) const {
  const Medium& m = model_.medium;
  const auto above = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
      std::ranges::upper_bound(m.wavelength_nm, 550.0) - m.wavelength_nm.begin(), 1,
      static_cast<std::ptrdiff_t>(m.wavelengths()) - 1));
  const double t =
      (550 - m.wavelength_nm[above - 1]) / (m.wavelength_nm[above] - m.wavelength_nm[above - 1]);
  double depth = 0;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    const double dz = m.boundary_km[i + 1] - std::max(bottom_km, m.boundary_km[i]);
    if (dz <= 0) continue;
    for (const auto& [w, share] : {std::pair{above - 1, 1 - t}, std::pair{above, t}}) {
      depth += dz * share * (m.aerosol_scattering_per_km(i, w) + m.aerosol_absorption_per_km(i, w));
    }
  }
  return depth;
}

double ozone_share(const Chromaticity& without, const Chromaticity& with,
                   const Chromaticity& white) {
  const double dx = with[0] - white[0], dy = with[1] - white[1];
  const double whole = dx * dx + dy * dy;
  if (!(whole > 0)) throw std::invalid_argument("the sky with ozone is as white as the white");
  return ((with[0] - without[0]) * dx + (with[1] - without[1]) * dy) / whole;
}

double blueness(const Chromaticity& xy, const Chromaticity& white) {
  constexpr Chromaticity kBlue = {0.1241, 0.0578};
  const double dx = kBlue[0] - white[0], dy = kBlue[1] - white[1];
  return ((xy[0] - white[0]) * dx + (xy[1] - white[1]) * dy) / std::hypot(dx, dy);
}

double purple_index(const SkyColour& colour) {
  return std::min(colour.rgb[0], colour.rgb[2]) / colour.rgb[1];
}

BeltOfVenus find_belt(std::span<const double> elevation_deg, std::span<const SkyColour> colours) {
  const std::size_t n = elevation_deg.size();
  if (n < 3 || colours.size() != n) {
    throw std::invalid_argument("a belt needs as many colours as elevations, three at least");
  }
  const auto ratio = [&](std::size_t k) { return colours[k].red_over_blue; };
  std::size_t top = 0, top_low = 0, low = 0;
  for (std::size_t k = 1; k + 1 < n; ++k) {
    if (ratio(k) < ratio(low)) low = k;
    const bool maximum = ratio(k) >= ratio(k - 1) && ratio(k) > ratio(k + 1);
    if (!maximum || ratio(k) / ratio(low) <= ratio(top) / ratio(top_low)) continue;
    top = k;
    top_low = low;
  }
  BeltOfVenus belt;
  belt.exists = ratio(top) > 1.03 * ratio(top_low);
  belt.belt_deg = elevation_deg[top];
  belt.belt_red_over_blue = ratio(top);
  belt.belt_x = colours[top].xy[0];
  belt.below_red_over_blue = ratio(top_low);
  belt.below_x = colours[top_low].xy[0];
  belt.shadow_deg = elevation_deg[top_low];
  double steepest = 0;
  for (std::size_t k = top_low + 1; k <= top; ++k) {
    const double slope =
        std::log(ratio(k) / ratio(k - 1)) / (elevation_deg[k] - elevation_deg[k - 1]);
    if (slope <= steepest) continue;
    steepest = slope;
    belt.shadow_deg = 0.5 * (elevation_deg[k] + elevation_deg[k - 1]);
  }
  return belt;
}

std::vector<double> steps(double from, double to, double step) {
  std::vector<double> values;
  const int n = static_cast<int>(std::lround(std::abs(to - from) / std::abs(step)));
  for (int k = 0; k <= n; ++k) values.push_back(from + (to - from) * k / n);
  return values;
}

std::vector<ViewAngles> vertical(std::span<const double> elevation_deg, double azimuth_deg) {
  std::vector<ViewAngles> views;
  for (const double e : elevation_deg) views.push_back({e, azimuth_deg});
  return views;
}

}  // namespace twilight::validation
