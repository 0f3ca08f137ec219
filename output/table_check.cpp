#include "output/table_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "output/hemisphere.h"
#include "output/table_sky.h"

namespace twilight {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kLeastShare = 0.01;

}  // namespace

TableTruth::TableTruth(const TableSource& source, std::vector<double> sun_elevation_deg)
    : altitude_km_(observer_altitude_km(source.model.scene)),
      suns_deg_(std::move(sun_elevation_deg)) {
  std::vector<ViewDirection> views;
  for (const WeightedView& v : hemisphere_views()) views.push_back(v.direction);
  const std::span<const double> sun = source.model.solar_irradiance;
  const std::size_t W = sun.size();
  for (const double deg : suns_deg_) {
    std::vector<double> light = source.sky.under(deg * kDegree)->radiance(views);
    std::vector<ChannelTriple> row;
    for (std::size_t v = 0; v < views.size(); ++v) {
      for (std::size_t w = 0; w < W; ++w) light[v * W + w] /= sun[w];
      row.push_back(source.channels.radiance(std::span<const double>(&light[v * W], W)));
    }
    light_.push_back(std::move(row));
  }
}

std::vector<TableError> TableTruth::errors(const std::string& name, const Reader& reader) const {
  const std::vector<WeightedView> views = hemisphere_views();
  std::vector<TableError> out;
  for (std::size_t s = 0; s < suns_deg_.size(); ++s) {
    std::vector<WeightedValue> values;
    double bias = 0, weight = 0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      const ChannelTriple read = reader(s, v);
      for (std::size_t c = 0; c < 3; ++c) {
        const double truth = light_[s][v][c];
        // A channel that the colour all but lacks has no relative error.
        if (truth <= kLeastShare * *std::ranges::max_element(light_[s][v])) continue;
        const double error = read[c] / truth - 1;
        values.push_back({std::abs(error), views[v].solid_angle_sr});
        bias += views[v].solid_angle_sr * error;
        weight += views[v].solid_angle_sr;
      }
    }
    if (values.empty()) continue;
    const Spread spread = spread_of(values);
    out.push_back({name, suns_deg_[s], spread.mean, spread.p95, spread.largest, bias / weight});
  }
  return out;
}

std::vector<TableError> TableTruth::errors(const std::string& name, const TableLayout& layout,
                                           const SkyTables& tables, bool half) const {
  const TableSky sky(layout, tables, half);
  const std::vector<WeightedView> views = hemisphere_views();
  const double r_km = layout.geometry().bottom_radius_km + altitude_km_;
  return errors(name, [&](std::size_t s, std::size_t v) {
    const auto [elevation, azimuth] = views[v].direction;
    const double sun = suns_deg_[s] * kDegree, mu_s = std::sin(sun), mu = std::sin(elevation);
    const double nu = mu * mu_s + std::cos(elevation) * std::cos(sun) * std::cos(azimuth);
    return sky.radiance(r_km, mu, mu_s, std::clamp(nu, -1.0, 1.0));
  });
}

std::vector<TableError> sky_view_errors(const TableSource& source, const Hillaire2020Layout& layout,
                                        const HillaireTables& tables, const std::string& name,
                                        bool half) {
  const TableTruth truth(source, tables.sun_elevation_deg);
  const std::vector<WeightedView> views = hemisphere_views();
  const double r_km = layout.bottom_radius_km() + observer_altitude_km(source.model.scene);
  return truth.errors(name, [&](std::size_t s, std::size_t v) {
    const auto [elevation, azimuth] = views[v].direction;
    const TexelPoint at =
        layout.sky_view_texel(r_km, {std::sin(elevation), std::cos(azimuth), false});
    return look_up(tables.sky_view[s], at, half);
  });
}

std::vector<std::size_t> slices_about(const TableLayout& layout, double altitude_km) {
  const double at =
      std::clamp(layout.scattering_r_texel(layout.geometry().bottom_radius_km + altitude_km), 0.0,
                 static_cast<double>(layout.sizes().r - 1));
  const auto low = static_cast<std::size_t>(at);
  std::vector<std::size_t> out = {low};
  if (at > static_cast<double>(low)) out.push_back(low + 1);
  return out;
}

CsvTable error_table(const std::vector<TableError>& errors) {
  CsvTable table({"tables", "sun_elevation_deg", "mean_relative_error", "p95_relative_error",
                  "largest_relative_error", "mean_signed_error"});
  for (const TableError& e : errors) {
    table.add_row({e.tables, e.sun_elevation_deg, e.mean, e.p95, e.largest, e.bias});
  }
  return table;
}

}  // namespace twilight
