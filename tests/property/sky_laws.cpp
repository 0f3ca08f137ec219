#include "sky_laws.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>
#include <stdexcept>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kCompared = 3;  // copies: as it is, brighter ground, other Sun
constexpr double kOtherSun = 0.37;

// A ground brighter by half of what is missing to white.
double brighter(double albedo) { return 0.5 * (1 + albedo); }

LayerTable with_copies(const LayerTable& table, std::size_t layers, std::size_t wavelengths,
                       std::size_t copies) {
  if (table.size() == 0) return table;
  LayerTable out(layers, wavelengths * copies);
  for (std::size_t i = 0; i < layers; ++i) {
    for (std::size_t w = 0; w < wavelengths * copies; ++w) out(i, w) = table(i, w / copies);
  }
  return out;
}

template <class T>
std::vector<T> with_copies(const std::vector<T>& values, std::size_t copies) {
  std::vector<T> out;
  for (const T& value : values) out.insert(out.end(), copies, value);
  return out;
}

// What a scene's numbers may differ by where they should be equal: single precision of the cells,
// the last orders left out, nothing.
double rounding(const Scene& scene) { return scene.solver.method == "monte-carlo" ? 1e-12 : 2e-6; }

class Judge {
 public:
  Judge(const Scene& scene, const SceneModel& model, const Sky& sky, std::size_t copies)
      : scene_(scene), model_(model), sky_(sky), copies_(copies), views_(law_views()) {}

  std::vector<BrokenLaw> broken;

  void look() {
    const std::size_t n = views_.size(), W = model_.medium.wavelengths();
    std::vector<ViewDirection> both = views_;
    for (const ViewDirection& v : views_) {
      both.push_back({v.elevation_rad, -v.relative_azimuth_rad});
    }
    const StokesRadiance s = sky_.stokes(both);
    if (s.i.size() != 2 * n * W) return add(Law::kFinite, "size of the radiance");
    const double brightest = *std::max_element(s.i.begin(), s.i.end());
    for (std::size_t k = 0; k < 2 * n; ++k) {
      for (std::size_t w = 0; w < W; ++w) at_view(s, k, w);
    }
    if (!std::isfinite(brightest)) return;
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t w = 0; w < W; ++w) mirror(s, k, w, brightest);
      if (copies_ < kCompared) continue;
      for (std::size_t w = 0; w < W; w += copies_) compare(s, k, w, brightest);
    }
  }

  void add_up() {
    const Irradiance e = sky_.irradiance();
    const auto transmittance = sky_.sun_transmittance();
    for (std::size_t w = 0; w < model_.medium.wavelengths(); ++w) {
      const double sun = model_.solar_irradiance[w];
      if (!std::isfinite(e.direct[w] + e.diffuse[w] + transmittance[w])) {
        add(Law::kFinite, text("irradiance ", e.direct[w], " + ", e.diffuse[w], ", transmittance ",
                               transmittance[w]));
      }
      if (!(e.direct[w] >= 0 && e.diffuse[w] >= 0)) {
        add(Law::kPositive, text("irradiance ", e.direct[w], " + ", e.diffuse[w]));
      }
      if (!(transmittance[w] >= 0 && transmittance[w] <= 1)) {
        add(Law::kPositive, text("transmittance ", transmittance[w]));
      }
      // Refraction concentrates a high Sun's light by n^2 at most.
      if (!(e.direct[w] <= 1.001 * sun)) {
        add(Law::kEnergy, text("direct irradiance ", e.direct[w], " of ", sun));
      }
    }
    if (!std::isfinite(sky_.apparent_sun_elevation_rad())) {
      add(Law::kFinite, "apparent elevation of the Sun");
    }
  }

  void add(Law law, std::string what) { broken.push_back({law, std::move(what)}); }

 private:
  template <class... T>
  static std::string text(const T&... parts) {
    std::ostringstream out;
    out.precision(9);
    (out << ... << parts);
    return out.str();
  }
  std::string where(std::size_t k, std::size_t w) const {
    const ViewDirection& v = views_[k % views_.size()];
    return text(" at elevation ", v.elevation_rad * 180 / kPi, ", azimuth ",
                v.relative_azimuth_rad * 180 / kPi, ", ", model_.medium.wavelength_nm[w], " nm");
  }

  void at_view(const StokesRadiance& s, std::size_t k, std::size_t w) {
    const std::size_t at = k * model_.medium.wavelengths() + w;
    const double i = s.i[at], q = s.q.empty() ? 0 : s.q[at], u = s.u.empty() ? 0 : s.u[at];
    if (!std::isfinite(i + q + u)) {
      add(Law::kFinite, text("(I, Q, U) = (", i, ", ", q, ", ", u, ")", where(k, w)));
    }
    if (!(i >= 0)) add(Law::kPositive, text("I = ", i, where(k, w)));
    if (!(q * q + u * u <= i * i * (1 + 1e-12))) {
      add(Law::kPolarised, text("(I, Q, U) = (", i, ", ", q, ", ", u, ")", where(k, w)));
    }
    // No column scatters more than it receives, and no aerosol of ours sends more than 20 times
    // that into a steradian straight on, nor any of Henyey and Greenstein's more than its peak. The
    // paper's cell centres and its rescaling keep no account of energy; a Monte Carlo of few
    // photons has noise; a Mie peak knows no such bound.
    const SolverOptions& solver = scene_.solver;
    const bool kept = solver.method == "cells" ? solver.active_shell_weighting == "quadrature" &&
                                                     solver.cell_optics == "mean"
                                               : solver.method == "orders" && !mie_phase(scene_);
    if (kept && !(i < most_per_sr(w) * model_.solar_irradiance[w])) {
      add(Law::kEnergy,
          text("I = ", i, " under a Sun of ", model_.solar_irradiance[w], where(k, w)));
    }
  }

  // The highest value of a phase function over 4 pi, (1 + g) / (4 pi (1 - g)^2), or 20.
  double most_per_sr(std::size_t w) const {
    double most = 20;
    for (std::size_t i = 0; i < model_.medium.layers(); ++i) {
      const double g = std::abs(model_.medium.aerosol_asymmetry(i, w));
      if (model_.medium.aerosol_scattering_per_km(i, w) == 0) continue;
      most = std::max(most, (1 + g) / (4 * kPi * (1 - g) * (1 - g)));
    }
    return most;
  }

  void mirror(const StokesRadiance& s, std::size_t k, std::size_t w, double brightest) {
    const std::size_t W = model_.medium.wavelengths();
    const std::size_t a = k * W + w, b = (views_.size() + k) * W + w;
    // Right and left draw other random numbers.
    double most = rounding(scene_) * brightest;
    if (!s.standard_error.empty()) {
      most += 8 * std::hypot(s.standard_error[a], s.standard_error[b]);
      // With 100 photons the error of the error is large; nor is it known where it is all but dark.
      constexpr double kDark = 1e-15;
      if (s.i[a] < kDark || s.i[b] < kDark ||
          s.standard_error[a] + s.standard_error[b] > 0.1 * (s.i[a] + s.i[b])) {
        return;
      }
      if (std::abs(s.i[a] - s.i[b]) > most) {
        add(Law::kMirror, text("I = ", s.i[a], ", ", s.i[b], " +- ", most / 8, where(k, w)));
      }
      return;
    }
    const bool even = std::abs(s.i[a] - s.i[b]) <= most;
    const bool linear =
        s.q.empty() || (std::abs(s.q[a] - s.q[b]) <= most && std::abs(s.u[a] + s.u[b]) <= most);
    if (!even || !linear) {
      add(Law::kMirror, text("I = ", s.i[a], ", ", s.i[b], " of ", brightest, where(k, w)));
    }
  }

  void compare(const StokesRadiance& s, std::size_t k, std::size_t w, double brightest) {
    const std::size_t at = k * model_.medium.wavelengths() + w;
    const double plain = s.i[at], white = s.i[at + 1], other = s.i[at + 2];
    // The orders left out differ between two grounds.
    const double tolerance =
        scene_.solver.method == "orders" ? scene_.solver.order_tolerance : rounding(scene_);
    // The paper's ratio of all power to that of active cells is not linear in the light.
    const bool linear = scene_.solver.active_shell_weighting != "rescale";
    if (linear && !(white >= plain * (1 - tolerance) - 1e-7 * brightest)) {
      add(Law::kAlbedo, text("ground ", model_.ground_albedo[w], ": ", plain, ", ground ",
                             model_.ground_albedo[w + 1], ": ", white, where(k, w)));
    }
    // Numbers below the normal range have few digits, or none.
    constexpr double kSubnormal = 1e-300;
    if (!(std::abs(other - kOtherSun * plain) <= rounding(scene_) * plain + kSubnormal)) {
      add(Law::kIrradiance,
          text(other, " under ", kOtherSun, " of the Sun of ", plain, where(k, w)));
    }
  }

  const Scene& scene_;
  const SceneModel& model_;
  const Sky& sky_;
  std::size_t copies_;
  std::vector<ViewDirection> views_;
};

bool same_bytes(const StokesRadiance& a, const StokesRadiance& b) {
  return a.i == b.i && a.q == b.q && a.u == b.u && a.standard_error == b.standard_error;
}

}  // namespace

const char* name(Law law) {
  switch (law) {
    case Law::kSolved:
      return "solved";
    case Law::kFinite:
      return "finite";
    case Law::kPositive:
      return "not negative";
    case Law::kMirror:
      return "mirror symmetric";
    case Law::kPolarised:
      return "degree of polarisation";
    case Law::kAlbedo:
      return "monotone in the albedo";
    case Law::kIrradiance:
      return "linear in the Sun's irradiance";
    case Law::kEnergy:
      return "energy";
    case Law::kThreads:
      return "same bytes for any threads";
  }
  return "";
}

std::vector<ViewDirection> law_views() {
  std::vector<ViewDirection> v;
  for (const double elevation_deg : {90.0, 45.0, 5.0, 0.0, -0.5, -90.0}) {
    for (const double azimuth_deg : {0.0, 90.0, 171.3}) {
      v.push_back({elevation_deg * kPi / 180, azimuth_deg * kPi / 180});
    }
  }
  return v;
}

SceneModel with_copies(const SceneModel& model, std::size_t copies) {
  SceneModel out = model;
  Medium& m = out.medium;
  const std::size_t N = m.layers(), W = m.wavelengths();
  for (LayerTable* t :
       {&m.air_scattering_per_km, &m.aerosol_scattering_per_km, &m.aerosol_absorption_per_km,
        &m.aerosol_asymmetry, &m.gas_absorption_per_km, &m.refractivity}) {
    *t = with_copies(*t, N, W, copies);
  }
  for (LayerTable& t : m.aerosol_kind_scattering_per_km) t = with_copies(t, N, W, copies);
  for (auto& phase : m.aerosol_phase) phase = with_copies(phase, copies);
  for (std::vector<double>* v :
       {&m.wavelength_nm, &m.depolarisation, &m.vertical_filter_optical_depth, &out.ground_albedo,
        &out.solar_irradiance, &out.scene.spectrum.wavelengths_nm}) {
    *v = with_copies(*v, copies);
  }
  return out;
}

Verdict judge(const DrawnScene& drawn, Depth depth) {
  Verdict verdict;
  const Scene& scene = drawn.scene;
  try {
    const std::size_t copies = depth == Depth::kGlance ? 1 : kCompared;
    SceneModel model = with_copies(build_scene_model(drawn), copies);
    for (std::size_t w = 0; copies > 1 && w < model.medium.wavelengths(); w += copies) {
      model.ground_albedo[w + 1] = brighter(model.ground_albedo[w]);
      model.solar_irradiance[w + 2] *= kOtherSun;
    }
    const auto sky = solve_sky(model);
    Judge j(scene, model, *sky, copies);
    j.look();
    if (depth == Depth::kThorough) {
      j.add_up();
      SceneModel two = model;
      two.scene.solver.threads = 2;
      const auto again = solve_sky(two);
      if (!same_bytes(sky->stokes(law_views()), again->stokes(law_views()))) {
        j.add(Law::kThreads, "1 and 2 threads differ");
      }
    }
    verdict.broken = std::move(j.broken);
  } catch (const std::invalid_argument& refusal) {
    verdict.refused = std::string(refusal.what()).starts_with("refractive index");
    if (!verdict.refused) verdict.broken.push_back({Law::kSolved, refusal.what()});
  } catch (const std::exception& error) {
    verdict.broken.push_back({Law::kSolved, error.what()});
  }
  return verdict;
}

namespace {

const std::function<void(Scene&)> kSceneEdits[] = {
    [](Scene& s) {
      s.aerosols = AerosolOptions();
      s.aerosols.type = "none";
    },
    [](Scene& s) { s.aerosols.optical_depth_550nm.reset(); },
    [](Scene& s) { s.aerosols.relative_humidity_percent = 80; },
    [](Scene& s) { s.spectrum.wavelengths_nm = {550}; },
    [](Scene& s) { s.spectrum.wavelengths_nm.resize(1); },
    [](Scene& s) { s.sun.spectrum = "unit"; },
    [](Scene& s) { s.sun.disc_average = false; },
    [](Scene& s) { s.sun.elevation_deg = std::round(*s.sun.elevation_deg); },
    [](Scene& s) { s.sun.elevation_deg = 0; },
    [](Scene& s) { s.earth.ground_albedo = 0; },
    [](Scene& s) { s.earth.ground_albedo = 1; },
    [](Scene& s) { s.earth.ground_albedo = std::round(10 * s.earth.ground_albedo) / 10; },
    [](Scene& s) { s.earth.radius_km.reset(); },
    [](Scene& s) { s.earth.radius_km = std::round(*s.earth.radius_km); },
    [](Scene& s) { s.observer.height_m = 0; },
    [](Scene& s) { s.observer.height_m = std::round(s.observer.height_m); },
    [](Scene& s) { s.atmosphere.profile = "exponential"; },
    [](Scene& s) { s.atmosphere.layers = 1; },
    [](Scene& s) { s.atmosphere.layers = std::max(1, s.atmosphere.layers / 2); },
    [](Scene& s) { s.atmosphere.layers = std::max(1, s.atmosphere.layers - 1); },
    [](Scene& s) { s.atmosphere.top_km = std::ceil(s.atmosphere.top_km); },
    [](Scene& s) { s.atmosphere.ozone_du.reset(); },
    [](Scene& s) { s.atmosphere.nitrogen_dioxide_du.reset(); },
    [](Scene& s) { s.atmosphere.depolarisation.reset(); },
    [](Scene& s) { s.atmosphere.refraction = false; },
    [](Scene& s) { s.atmosphere.layer_spacing = "even"; },
    [](Scene& s) { s.atmosphere.layer_optics = "mean"; },
    [](Scene& s) { s.atmosphere.ozone = "layered"; },
    [](Scene& s) { s.atmosphere.refractive_index = "ciddor"; },
    [](Scene& s) { s.atmosphere.refractive_spreading = true; },
    [](Scene& s) { s.solver.azimuth_divisions = std::max(4, s.solver.azimuth_divisions - 2); },
    [](Scene& s) { s.solver.active_shell_stride = 1; },
    [](Scene& s) { s.solver.inner_radius_m = 1000; },
    [](Scene& s) { s.solver.scattering_orders = 1; },
    [](Scene& s) { s.solver.scattering_orders = 2; },
    [](Scene& s) { s.solver.scattering_orders.reset(); },
    [](Scene& s) { s.solver.active_shell_weighting = "quadrature"; },
    [](Scene& s) { s.solver.aerosol_phase = "truncated"; },
    [](Scene& s) { s.solver.air_phase = "rayleigh"; },
    [](Scene& s) { s.solver.cell_optics = "mean"; },
    [](Scene& s) { s.solver.cell_height_km = 0; },
    [](Scene& s) { s.solver.gather = "exact-single"; },
    [](Scene& s) { s.solver.ground_light = true; },
    [](Scene& s) { s.solver.polarisation = false; },
    [](Scene& s) { s.solver.single_precision = false; },
    [](Scene& s) { s.solver.altitude_levels = 4; },
    [](Scene& s) { s.solver.polar_directions = 8; },
    [](Scene& s) { s.solver.azimuth_directions = 4; },
    [](Scene& s) { s.solver.phase_degree = 2; },
    [](Scene& s) { s.solver.order_tolerance = 0.1; },
    [](Scene& s) { s.solver.seed = 1; },
};

// Layers that are plainer than `m`: fewer, of fewer constituents, of round numbers.
std::vector<Medium> plainer_layers(const Medium& m) {
  std::vector<Medium> plainer;
  constexpr LayerTable Medium::*kTables[] = {
      &Medium::air_scattering_per_km, &Medium::aerosol_scattering_per_km,
      &Medium::gas_absorption_per_km, &Medium::aerosol_asymmetry};
  const std::size_t N = m.layers(), W = m.wavelengths();
  const auto some_layers = [&](std::size_t from, std::size_t to) {
    Medium p = m;
    const auto at = static_cast<std::ptrdiff_t>(from), end = static_cast<std::ptrdiff_t>(to);
    p.boundary_km.erase(p.boundary_km.begin() + at + 1, p.boundary_km.begin() + end + 1);
    p.zero_tables();
    for (const auto table : kTables) {
      for (std::size_t i = 0; i < p.layers(); ++i) {
        for (std::size_t w = 0; w < W; ++w)
          (p.*table)(i, w) = (m.*table)(i < from ? i : i + to - from, w);
      }
    }
    plainer.push_back(std::move(p));
  };
  if (W > 1) {
    for (std::size_t keep = 0; keep < W; ++keep) {
      Medium p = m;
      p.wavelength_nm = {m.wavelength_nm[keep]};
      p.depolarisation = {m.depolarisation[keep]};
      p.zero_tables();
      for (const auto table : kTables) {
        for (std::size_t i = 0; i < N; ++i) (p.*table)(i, 0) = (m.*table)(i, keep);
      }
      plainer.push_back(std::move(p));
    }
  }
  if (N > 1) some_layers(N / 2, N);
  if (N > 1) some_layers(0, N / 2);
  for (std::size_t i = 0; N > 1 && N <= 12 && i < N; ++i) some_layers(i, i + 1);
  for (const auto table : kTables) {
    Medium p = m;
    p.*table = LayerTable(N, W);
    plainer.push_back(std::move(p));
    for (std::size_t i = 0; N <= 12 && i < N; ++i) {
      for (std::size_t w = 0; w < W; ++w) {
        for (const double digits : {0.0, 1.0, 10.0, 100.0}) {
          Medium one = m;
          double& value = (one.*table)(i, w);
          if (std::abs(value) < 1e-12) continue;
          value = digits == 0 ? 0 : std::round(value * digits) / digits;
          if (value != (m.*table)(i, w)) plainer.push_back(std::move(one));
        }
      }
    }
  }
  return plainer;
}

using Clock = std::chrono::steady_clock;

// Whether `drawn` became plainer in one of these ways.
bool plainer_scene(DrawnScene& drawn, const std::function<bool(const DrawnScene&)>& still_broken,
                   Clock::time_point end) {
  bool changed = false;
  for (const auto& edit : kSceneEdits) {
    if (Clock::now() > end) return false;
    const Scene& scene = drawn.scene;
    DrawnScene tried = drawn;
    Scene& plainer = tried.scene;
    if (!scene.earth.radius_km) plainer.earth.radius_km = 6371;
    edit(plainer);
    if (!scene.earth.radius_km && plainer.earth.radius_km == 6371) plainer.earth.radius_km.reset();
    if (scene_settings(plainer) == scene_settings(scene)) continue;
    // The layers have wavelengths of their own.
    if (drawn.layers && plainer.spectrum.wavelengths_nm != scene.spectrum.wavelengths_nm) continue;
    if (validate(plainer) || !still_broken(tried)) continue;
    drawn = tried;
    changed = true;
  }
  return changed;
}

bool fewer_layers(DrawnScene& drawn, const std::function<bool(const DrawnScene&)>& still_broken,
                  Clock::time_point end) {
  if (!drawn.layers) return false;
  for (Medium& layers : plainer_layers(*drawn.layers)) {
    if (Clock::now() > end) return false;
    DrawnScene tried = drawn;
    tried.scene.spectrum.wavelengths_nm = layers.wavelength_nm;
    const bool below = 1e-3 * tried.scene.observer.height_m < layers.top_km();
    tried.layers = std::move(layers);
    if ((tried.scene.solver.method == "cells" && !below) || !still_broken(tried)) continue;
    drawn = std::move(tried);
    return true;
  }
  return false;
}

}  // namespace

DrawnScene simplest(DrawnScene drawn, const std::function<bool(const DrawnScene&)>& still_broken,
                    double most_seconds) {
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(most_seconds));
  while (Clock::now() < end) {
    const bool plainer = plainer_scene(drawn, still_broken, end);
    if (!fewer_layers(drawn, still_broken, end) && !plainer) break;
  }
  return drawn;
}

}  // namespace twilight
