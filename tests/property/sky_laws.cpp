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
    // that into a steradian straight on. The paper's cell centres and its rescaling keep no account
    // of energy; a Monte Carlo of few photons has noise; a Mie peak knows no such bound.
    const SolverOptions& solver = scene_.solver;
    const bool kept = solver.method == "cells" ? solver.active_shell_weighting == "quadrature" &&
                                                     solver.cell_optics == "mean"
                                               : solver.method == "orders" && !mie_phase(scene_);
    if (kept && !(i < 20 * model_.solar_irradiance[w])) {
      add(Law::kEnergy,
          text("I = ", i, " under a Sun of ", model_.solar_irradiance[w], where(k, w)));
    }
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
    if (!(std::abs(other - kOtherSun * plain) <= rounding(scene_) * plain)) {
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

Verdict judge(const Scene& scene, Depth depth) {
  Verdict verdict;
  try {
    const std::size_t copies = depth == Depth::kGlance ? 1 : kCompared;
    SceneModel model = with_copies(build_scene_model(scene), copies);
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

Scene simplest(Scene scene, const std::function<bool(const Scene&)>& still_broken,
               double most_seconds) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const std::function<void(Scene&)> edits[] = {
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
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& edit : edits) {
      if (std::chrono::duration<double>(Clock::now() - start).count() > most_seconds) return scene;
      Scene plainer = scene;
      if (!scene.earth.radius_km) plainer.earth.radius_km = 6371;
      edit(plainer);
      if (!scene.earth.radius_km && plainer.earth.radius_km == 6371)
        plainer.earth.radius_km.reset();
      if (scene_settings(plainer) == scene_settings(scene)) continue;
      if (validate(plainer) || !still_broken(plainer)) continue;
      scene = plainer;
      changed = true;
    }
  }
  return scene;
}

}  // namespace twilight
