#include "sim/cell_sky.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "atmosphere/refraction.h"
#include "sim/elapsed_time.h"
#include "sim/solver_arena.h"
#include "sim/spectral_lanes.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;

}  // namespace

CellSky::~CellSky() = default;

CellSky::CellSky(const SceneModel& model, const RunControl& control) : model_(model) {
  const Scene& scene = model_.scene;
  const SolverOptions& solver = scene.solver;
  const auto start = Clock::now();
  arena_ = std::make_unique<SolverArena>(solver.threads);
  sun_.elevation_rad = model_.sun_elevation_rad;
  observer_height_km_ = observer_altitude_km(scene);

  options_.scattering_orders = solver.scattering_orders.value_or(options_.scattering_orders);
  options_.rayleigh = solver.air_phase == "rayleigh";
  options_.similarity = solver.aerosol_phase == "similarity";
  options_.rescale = solver.active_shell_weighting == "rescale";
  if (model_.ground_albedo.empty()) {
    model_.ground_albedo.assign(model_.medium.wavelengths(), scene.earth.ground_albedo);
  }
  if (solver.ground_light) options_.ground_albedo = model_.ground_albedo;
  optics_ = make_exchange_optics(model_.medium, options_);
  beam_ = beam_medium(model_.medium, optics_);

  arena_->arena.execute([&] {
    find_direct_sun();
    control.report("sunlight", 0.0);
    auto stage = Clock::now();
    DirectSunlightOptions beam_options;
    beam_options.refractive_spreading = scene.atmosphere.refractive_spreading;
    sunlight_ = std::make_unique<DirectSunlight>(beam_, beam_options);
    summary_.stage_seconds.emplace_back("direct sunlight", seconds_since(stage));
    control.check();

    CellGridOptions grid;
    grid.azimuth_divisions = solver.azimuth_divisions;
    grid.inner_radius_km = solver.inner_radius_m * 1e-3;
    grid.observer_height_km = observer_height_km_;
    grid.active_shell_stride = solver.active_shell_stride;
    grid.group_shells = !options_.rescale;
    grid.cell_height_km = solver.cell_height_km;
    grid.cell_means = solver.cell_optics == "mean";
    grid_ = std::make_unique<CellGrid>(model_.medium, grid);
    std::unique_ptr<CellGrid> all_cells;
    if (options_.rescale || solver.gather == "cells") {
      CellGridOptions every = grid;
      every.active_shell_stride = 1;
      every.cell_height_km = 0;
      all_cells = std::make_unique<CellGrid>(model_.medium, every);
    }
    exchange_ = solve_exchange(model_.medium, *grid_, all_cells.get(), *sunlight_, sun_, optics_,
                               options_, control);
    summary_.stage_seconds.emplace_back("exchange: first event",
                                        exchange_.report.first_event_seconds);
    summary_.stage_seconds.emplace_back("exchange: kernels", exchange_.report.kernels_seconds);
    summary_.stage_seconds.emplace_back("exchange: passes", exchange_.report.passes_seconds);

    GatherInputs gather;
    gather.medium = &model_.medium;
    gather.grid = grid_.get();
    gather.sunlight = sunlight_.get();
    gather.optics = &optics_;
    gather.exchange = &exchange_;
    gather.sun = sun_;
    gather.observer_height_km = observer_height_km_;
    gather.ground_albedo = model_.ground_albedo;
    gather.refraction = scene.atmosphere.refraction;
    stage = Clock::now();
    view_gather_ = std::make_unique<ViewGather>(gather);
    if (solver.gather == "cells") {
      cell_gather_ = std::make_unique<CellGather>(gather, *all_cells);
      summary_.stage_seconds.emplace_back("gather from cells", seconds_since(stage));
    }
  });
  summarise(seconds_since(start));
}

void CellSky::find_direct_sun() {
  const Medium& m = model_.medium;
  sun_transmittance_.assign(m.wavelengths(), 0.0);
  beam_transmittance_.assign(m.wavelengths(), 0.0);
  apparent_elevation_rad_ = sun_.elevation_rad;
  std::vector<double> path(m.layers());
  const double true_zenith = kPi / 2 - sun_.elevation_rad;
  for (std::size_t w = 0; w < m.wavelengths(); ++w) {
    const RefractedRays rays(m, w);
    const auto apparent = rays.apparent_zenith_rad(observer_height_km_, true_zenith);
    if (!apparent) continue;
    const RayTrace trace = rays.trace_outward(observer_height_km_, *apparent, path);
    if (trace.hits_ground) continue;
    const double filter =
        m.vertical_filter_optical_depth.empty() ? 0.0 : m.vertical_filter_optical_depth[w];
    sun_transmittance_[w] = std::exp(-slant_optical_depth(m, w, path) - filter);
    beam_transmittance_[w] = std::exp(-slant_optical_depth(beam_, w, path) - filter);
    if (w == m.wavelengths() / 2) apparent_elevation_rad_ = kPi / 2 - *apparent;
  }
}

std::span<const double> CellSky::wavelength_nm() const { return model_.medium.wavelength_nm; }
std::span<const double> CellSky::solar_irradiance() const { return model_.solar_irradiance; }

std::vector<double> CellSky::gather(std::span<const ViewDirection> views,
                                    ViewGather::Light light) const {
  const std::size_t W = model_.medium.wavelengths();
  std::vector<double> out(views.size() * W);
  // Views of one elevation share their ray; they are few enough to keep every thread busy.
  constexpr std::size_t kMostOfARay = 64;
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return views[i].elevation_rad; });
  std::vector<std::size_t> first;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || i - first.back() == kMostOfARay ||
        views[order[i]].elevation_rad != views[order[i - 1]].elevation_rad) {
      first.push_back(i);
    }
  }
  first.push_back(order.size());
  arena_->arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, first.size() - 1, [&](std::size_t group) {
      std::vector<float> lanes(optics_.lanes);
      const double elevation_rad = views[order[first[group]]].elevation_rad;
      // The cells hold no ground to look at: below the horizon the ray is followed.
      const bool from_cells =
          cell_gather_ && light == ViewGather::Light::kAll && elevation_rad >= 0;
      ViewGather::Ray ray;
      if (!from_cells) ray = view_gather_->ray(elevation_rad);
      for (std::size_t k = first[group]; k < first[group + 1]; ++k) {
        const std::size_t i = order[k];
        if (from_cells) {
          cell_gather_->radiance(elevation_rad, views[i].relative_azimuth_rad, lanes.data());
        } else {
          view_gather_->radiance(ray, views[i].relative_azimuth_rad, lanes.data(), light);
        }
        for (std::size_t w = 0; w < W; ++w) {
          const double value = static_cast<double>(lanes[w]) * model_.solar_irradiance[w];
          if (!(std::isfinite(value) && value >= 0)) {
            throw std::logic_error(fmt::format(
                "radiance {} at {} nm, view {} rad, {} rad", value, model_.medium.wavelength_nm[w],
                views[i].elevation_rad, views[i].relative_azimuth_rad));
          }
          out[i * W + w] = value;
        }
      }
    });
  });
  return out;
}

std::vector<double> CellSky::radiance(std::span<const ViewDirection> views) const {
  return gather(views, ViewGather::Light::kAll);
}

std::vector<double> CellSky::single_scattering(std::span<const ViewDirection> views) const {
  return gather(views, ViewGather::Light::kSingle);
}

Irradiance CellSky::irradiance() const {
  // Hemisphere by midpoints in elevation (denser towards the horizon) and azimuth.
  constexpr int kRows = 40, kColumns = 60;
  std::vector<ViewDirection> views;
  std::vector<double> weight;
  for (int i = 0; i < kRows; ++i) {
    const double e0 = kPi / 2 * std::pow(static_cast<double>(i) / kRows, 1.5);
    const double e1 = kPi / 2 * std::pow(static_cast<double>(i + 1) / kRows, 1.5);
    for (int j = 0; j < kColumns; ++j) {
      views.push_back({0.5 * (e0 + e1), kPi * (j + 0.5) / kColumns});
      // integral of sin(e) cos(e) de over the ring, both mirror halves
      weight.push_back(0.5 * (std::pow(std::sin(e1), 2) - std::pow(std::sin(e0), 2)) * 2 * kPi /
                       kColumns);
    }
  }
  const std::size_t W = model_.medium.wavelengths();
  Irradiance result;
  result.direct.assign(W, 0.0);
  result.diffuse.assign(W, 0.0);
  // Truncated phase functions leave the forward peak in the beam, which the diffuse share then
  // takes from it: global irradiance is that of the exchange, direct that of the true beam.
  const bool truncated = !cell_gather_ && !options_.similarity;
  const auto values =
      gather(views, truncated ? ViewGather::Light::kTruncated : ViewGather::Light::kAll);
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t w = 0; w < W; ++w) result.diffuse[w] += weight[i] * values[i * W + w];
  }
  double sine = std::max(0.0, std::sin(apparent_elevation_rad_));
  if (model_.scene.atmosphere.refractive_spreading) {
    sine *= sunlight_->spreading(observer_height_km_, kPi / 2 - sun_.elevation_rad);
  }
  for (std::size_t w = 0; w < W; ++w) {
    result.direct[w] = model_.solar_irradiance[w] * sun_transmittance_[w] * sine;
    if (truncated) {
      const double beam = model_.solar_irradiance[w] * beam_transmittance_[w] * sine;
      result.diffuse[w] += std::max(0.0, beam - result.direct[w]);
    }
  }
  return result;
}

void CellSky::summarise(double total_seconds) {
  const ExchangeReport& r = exchange_.report;
  auto& f = summary_.figures;
  f.emplace_back("shells", fmt::format("{} ({} active)", r.shells, r.active_shells));
  f.emplace_back("rings", r.rings > 0
                              ? fmt::format("{} ({} active), {} of ground", r.rings, r.active_rings,
                                            r.ground_rings)
                              : fmt::format("{}, {} of ground", r.active_rings, r.ground_rings));
  if (r.cells > 0) f.emplace_back("cells", fmt::format("{}", r.cells));
  f.emplace_back("active cells", fmt::format("{}", r.active_cells));
  f.emplace_back("azimuthal modes", fmt::format("{}", r.azimuth_modes));
  f.emplace_back("kernel evaluations",
                 fmt::format("{:.4g}", static_cast<double>(r.kernel_evaluations)));
  const std::size_t w = model_.medium.wavelengths() / 2;
  std::string shares;
  for (std::size_t k = 1; k < r.event_power.size(); ++k) {
    const double before = r.event_power[k - 1][w];
    shares +=
        fmt::format("{}{:.3g}", k > 1 ? ", " : "", before > 0 ? r.event_power[k][w] / before : 0.0);
  }
  f.emplace_back(
      fmt::format("power of each event over the one before, {} nm", model_.medium.wavelength_nm[w]),
      shares);
  // The paper's claim, up to 20 %, ends where the Sun goes down: say what it is here.
  const ViewDirection zenith{kPi / 2, 0.0};
  const double all = radiance({&zenith, 1})[w], single = single_scattering({&zenith, 1})[w];
  f.emplace_back(
      fmt::format("multiple over single scattering, zenith, {} nm", model_.medium.wavelength_nm[w]),
      single > 0 ? fmt::format("{:.3g}", all / single - 1) : "no single scattering");
  if (!r.rescale_factor.empty()) {
    f.emplace_back("active-shell rescaling of the second event",
                   fmt::format("{:.3g}", r.rescale_factor[w]));
  }
  summary_.stage_seconds.emplace_back("solve, in all", total_seconds);
}

}  // namespace twilight
