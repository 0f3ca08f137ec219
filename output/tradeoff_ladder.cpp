#include "output/tradeoff_ladder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace twilight {
namespace {

using Overrides = std::vector<std::string>;

constexpr const char* kOrders = "orders";
constexpr const char* kCells = "cells";
constexpr const char* kMonteCarlo = "monte-carlo";

// What makes a scene of any method one of this method.
Overrides method_overrides(std::string_view method) {
  if (method == kOrders) return {"solver.method=orders"};
  if (method == kMonteCarlo) return {"solver.method=monte-carlo"};
  // The cells know neither polarisation nor the disc nor Mie phase functions.
  return {"solver.method=cells", "solver.polarisation=auto", "sun.disc_average=auto",
          "aerosols.phase=auto"};
}

// Few wavelengths, placed for the eye; many, the default's and beyond.
constexpr const char* kWavelengths3 = "spectrum.wavelengths_nm=[450,550,640]";
constexpr const char* kWavelengths5 = "spectrum.wavelengths_nm=[410,470,530,590,650]";
constexpr const char* kWavelengths8 =
    "spectrum.wavelengths_nm=[380,428.5714,477.1429,525.7143,574.2857,622.8571,671.4286,720]";
constexpr const char* kWavelengths15 =
    "spectrum.wavelengths_nm=[380,410,440,470,500,530,560,590,620,650,680,710,740,760,780]";

/// Where an approximation belongs.
struct Where {
  bool quick = false;
  RungNeeds needs = RungNeeds::kNothing;
};

/// Collects rungs; those not quick are dropped where a quick ladder is asked for.
class LadderMaker {
 public:
  explicit LadderMaker(bool quick) : quick_(quick) {}

  void add(Rung rung, bool in_quick) {
    if (quick_ && !in_quick) return;
    Overrides all = method_overrides(rung.method);
    all.insert(all.end(), rung.overrides.begin(), rung.overrides.end());
    rung.overrides = std::move(all);
    rungs_.push_back(std::move(rung));
  }

  void method(const std::string& name, const char* method, const std::string& label,
              const Overrides& overrides, bool in_quick = false) {
    add({name, "method", label, RungKind::kMethod, method, overrides}, in_quick);
  }

  /// One key at several values; those in `quick_values` belong to the quick ladder too.
  void values(const char* method, const std::string& group, const std::string& word,
              const std::string& key, std::initializer_list<const char*> values,
              std::initializer_list<const char*> quick_values = {},
              RungNeeds needs = RungNeeds::kNothing) {
    for (const std::string value : values) {
      const bool in_quick = std::ranges::find(quick_values, value) != quick_values.end();
      add({fmt::format("{}-{}-{}", method, word, value),
           group,
           value,
           RungKind::kSetting,
           method,
           {key + "=" + value},
           needs},
          in_quick);
    }
  }

  void wavelengths(const char* method, const char* quick_count) {
    const std::pair<const char*, const char*> sets[] = {
        {"3", kWavelengths3}, {"5", kWavelengths5}, {"8", kWavelengths8}, {"15", kWavelengths15}};
    for (const auto& [count, override] : sets) {
      add({fmt::format("{}-wavelengths-{}", method, count),
           "wavelengths",
           count,
           RungKind::kSetting,
           method,
           {override},
           RungNeeds::kProfile},
          std::string_view(count) == quick_count);
    }
  }

  void approximation(const char* method, const std::string& word, const std::string& label,
                     const Overrides& overrides, Where where = {}) {
    add({fmt::format("{}-{}", method, word), "approximation", label, RungKind::kApproximation,
         method, overrides, where.needs, method},
        where.quick);
  }

  std::vector<Rung> take() { return std::move(rungs_); }

 private:
  bool quick_;
  std::vector<Rung> rungs_;
};

/// A grid of the method of orders.
Overrides orders_grid(const char* zenith, int levels, int polar, int azimuths, int degree,
                      const char* tolerance) {
  return {fmt::format("solver.zenith_step_deg={}", zenith),
          fmt::format("solver.altitude_levels={}", levels),
          fmt::format("solver.polar_directions={}", polar),
          fmt::format("solver.azimuth_directions={}", azimuths),
          fmt::format("solver.phase_degree={}", degree),
          fmt::format("solver.order_tolerance={}", tolerance)};
}

Overrides with(Overrides all, std::initializer_list<const char*> more) {
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

void add_methods(LadderMaker& make) {
  make.method("orders", kOrders, "the scene's settings", {}, true);
  make.method("cells", kCells, "the scene's settings", {}, true);
  make.method("cells-best", kCells, "stride 2, cells of 2 km",
              {"solver.active_shell_stride=2", "solver.cell_height_km=2"});
  make.method("cells-every-shell", kCells, "S = 60, every shell",
              {"solver.azimuth_divisions=60", "solver.active_shell_stride=1"});
  for (const char* photons : {"100", "1000", "10000"}) {
    make.method(fmt::format("monte-carlo-{}", photons), kMonteCarlo,
                fmt::format("{} photons per view", photons),
                {fmt::format("solver.photons={}", photons)}, photons == std::string_view("100"));
  }
}

// Several settings at once: where a front lies that single settings do not reach.
void add_combinations(LadderMaker& make) {
  const auto both = [&](const std::string& name, const char* method, const std::string& label,
                        const Overrides& overrides) {
    make.method(name, method, label, overrides);
    const auto fewer = [&](const char* count, const char* wavelengths) {
      Rung rung{name + "-" + count, "method", label + ", " + count + " wavelengths",
                RungKind::kMethod,  method,   with(overrides, {wavelengths}),
                RungNeeds::kProfile};
      make.add(rung, false);
    };
    fewer("8", kWavelengths8);
    fewer("5", kWavelengths5);
  };
  const Overrides draft = orders_grid("3", 12, 12, 6, 6, "0.01");
  const Overrides coarse = orders_grid("2", 20, 16, 8, 12, "0.005");
  both("orders-draft", kOrders, "draft grid", draft);
  both("orders-draft-scalar", kOrders, "draft grid, no polarisation",
       with(draft, {"solver.polarisation=false"}));
  both("orders-coarse", kOrders, "coarse grid", coarse);
  both("orders-middle", kOrders, "middle grid", orders_grid("1.5", 32, 24, 8, 16, "0.002"));
  make.method("orders-fine", kOrders, "fine grid", orders_grid("0.5", 64, 40, 16, 28, "0.0005"));
  both("cells-draft", kCells, "S = 24, stride 8, 40 layers, 8 km cells",
       {"solver.azimuth_divisions=24", "solver.active_shell_stride=8", "atmosphere.layers=40",
        "solver.cell_height_km=8", "solver.inner_radius_m=3000"});
  both("cells-coarse", kCells, "S = 60, stride 4, 8 km cells",
       {"solver.azimuth_divisions=60", "solver.active_shell_stride=4", "solver.cell_height_km=8"});
}

void add_settings(LadderMaker& make) {
  const char* const zenith = "solver.zenith_step_deg";
  make.values(kOrders, "zenith step, deg", "zenith-step", zenith, {"3", "2", "1", "0.5"}, {"3"});
  make.values(kOrders, "altitude levels", "levels", "solver.altitude_levels",
              {"12", "16", "25", "35", "50", "80"}, {"12"});
  make.values(kOrders, "polar directions", "polar", "solver.polar_directions",
              {"12", "16", "24", "32", "48"});
  make.values(kOrders, "azimuth directions", "azimuths", "solver.azimuth_directions",
              {"6", "8", "12", "16", "24"});
  make.values(kOrders, "phase degree", "phase-degree", "solver.phase_degree",
              {"4", "8", "12", "16", "24", "32"}, {}, RungNeeds::kAerosols);
  make.values(kOrders, "order tolerance", "tolerance", "solver.order_tolerance",
              {"0.05", "0.01", "0.001", "0.0001"});
  make.values(kOrders, "precision", "single-precision", "solver.single_precision", {"false"});

  make.values(kCells, "azimuth divisions", "azimuths", "solver.azimuth_divisions",
              {"12", "24", "36", "48", "60", "72", "90", "120", "180"}, {"12"});
  make.values(kCells, "active-shell stride", "stride", "solver.active_shell_stride",
              {"2", "3", "4", "8", "16"}, {"8"});
  make.values(kCells, "inner radius, m", "inner-radius", "solver.inner_radius_m",
              {"100", "300", "1000", "3000", "10000"});
  make.values(kCells, "cell height, km", "cell-height", "solver.cell_height_km",
              {"2", "4", "8", "16"});

  for (const char* method : {kOrders, kCells}) {
    const bool cells = method == std::string_view(kCells);
    make.values(method, "layers", "layers", "atmosphere.layers", {"25", "50", "100", "200"}, {},
                RungNeeds::kProfile);
    make.values(method, "top, km", "top", "atmosphere.top_km", {"50", "70", "85", "100", "120"}, {},
                RungNeeds::kProfile);
    make.values(method, "orders of scattering", "events", "solver.scattering_orders",
                {"1", "2", "3", "4", "8"},  // five is an approximation of the paper
                cells ? std::initializer_list<const char*>{"1"}
                      : std::initializer_list<const char*>{"1", "3"});
    make.wavelengths(method, cells ? "" : "3");
  }
}

// The paper's air as the haber2005 configuration has it, where both methods know it.
const Overrides kBlackGround = {"earth.ground_albedo=0", "earth.albedo_wavelengths_nm=[]",
                                "earth.albedo_spectrum=[]"};
const Overrides kExponential = {"atmosphere.profile=exponential", "atmosphere.ozone_du=300"};
const Overrides kVerticalOzone = {"atmosphere.ozone=vertical"};
const Overrides kNoSpreading = {"atmosphere.refractive_spreading=false"};
const Overrides kIndex = {"atmosphere.refractive_index=haber2005"};
const Overrides kTop35 = {"atmosphere.top_km=35"};
const Overrides kFiveOrders = {"solver.scattering_orders=5"};
const Overrides kLayerCentres = {"atmosphere.layer_optics=centre"};

Overrides joined(std::initializer_list<Overrides> parts) {
  Overrides all;
  for (const Overrides& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

void add_approximations(LadderMaker& make) {
  const Where of_profile{false, RungNeeds::kProfile}, of_profile_quick{true, RungNeeds::kProfile};
  const Overrides shared = joined({kVerticalOzone, kIndex, kNoSpreading, kBlackGround, kExponential,
                                   kTop35, kLayerCentres, kFiveOrders});
  make.approximation(kOrders, "henyey-greenstein", "Henyey-Greenstein aerosol",
                     {"aerosols.phase=henyey-greenstein"}, {false, RungNeeds::kAerosols});
  make.approximation(kOrders, "no-polarisation", "no polarisation", {"solver.polarisation=false"},
                     {true});
  make.approximation(kOrders, "point-sun", "Sun a point", {"sun.disc_average=false"});
  make.approximation(kOrders, "no-ground-light", "no light from the ground to the air",
                     {"solver.ground_light=false"});
  make.approximation(kCells, "isotropic-air", "isotropic air", {"solver.air_phase=isotropic"},
                     {true});
  make.approximation(kCells, "similarity", "aerosol similarity (Eq. 2)",
                     {"solver.aerosol_phase=similarity"}, {false, RungNeeds::kAerosols});
  make.approximation(kCells, "cell-centres", "cell centres instead of means",
                     {"solver.cell_optics=centre"});
  make.approximation(kCells, "undivided-cells", "cells not divided in altitude",
                     {"solver.cell_height_km=0"});
  make.approximation(kCells, "cell-gather", "gather from cells alone", {"solver.gather=cells"},
                     {true});
  make.approximation(kCells, "rescale", "rescaled active shells",
                     {"solver.active_shell_weighting=rescale"});
  for (const char* method : {kOrders, kCells}) {
    const bool quick = method == std::string_view(kOrders);
    make.approximation(method, "vertical-ozone", "ozone as a vertical filter", kVerticalOzone,
                       quick ? of_profile_quick : of_profile);
    make.approximation(method, "no-refraction", "no refraction", {"atmosphere.refraction=false"},
                       {quick});
    make.approximation(method, "no-spreading", "no refractive spreading", kNoSpreading);
    make.approximation(method, "index-as-printed", "refractive index as printed", kIndex,
                       of_profile);
    make.approximation(method, "black-ground", "black ground", kBlackGround, {quick});
    make.approximation(method, "exponential", "air as exp(-h/8 km), 300 DU", kExponential,
                       of_profile);
    make.approximation(method, "layer-centres", "layer centres instead of means", kLayerCentres,
                       of_profile);
    make.approximation(method, "top-35", "top at 35 km", kTop35, of_profile);
    make.approximation(method, "five-orders", "five scattering events", kFiveOrders);
  }

  make.approximation(kOrders, "all", "all of the paper's that this method knows",
                     joined({shared,
                             {"solver.polarisation=false", "sun.disc_average=false",
                              "aerosols.phase=henyey-greenstein"}}),
                     of_profile_quick);
  const Overrides cells_all =
      joined({shared,
              {"solver.air_phase=isotropic", "solver.aerosol_phase=similarity",
               "solver.ground_light=false", "solver.cell_optics=centre", "solver.cell_height_km=0",
               "solver.active_shell_weighting=rescale", "solver.gather=cells"}});
  make.approximation(kCells, "all", "all of the paper's together", cells_all, of_profile_quick);
}

}  // namespace

std::string_view rung_kind_name(RungKind kind) {
  switch (kind) {
    case RungKind::kSetting:
      return "setting";
    case RungKind::kApproximation:
      return "approximation";
    case RungKind::kMethod:
      break;
  }
  return "method";
}

std::vector<Rung> tradeoff_ladder(bool quick) {
  LadderMaker make(quick);
  add_methods(make);
  add_combinations(make);
  add_settings(make);
  add_approximations(make);
  return make.take();
}

std::optional<std::string> why_inapplicable(const Rung& rung, const Scene& scene) {
  const bool own_layers = replaces_profile(scene);
  if (rung.needs == RungNeeds::kProfile && own_layers) {
    return "the scene brings its own optical layers or published air";
  }
  const auto changes = [&](std::string_view start) {
    return std::ranges::any_of(rung.overrides,
                               [&](const std::string& o) { return o.starts_with(start); });
  };
  if (scene.atmosphere.profile_file && changes("atmosphere.profile=")) {
    return "the scene brings its own profile";
  }
  if (rung.needs == RungNeeds::kAerosols && !has_aerosol(scene) && !own_layers) {
    return "the scene has no aerosol";
  }
  return std::nullopt;
}

std::vector<std::string> quick_base_overrides() {
  Overrides all = orders_grid("2", 24, 16, 8, 8, "0.003");
  for (const char* more : {"solver.azimuth_divisions=36", "atmosphere.layers=40"}) {
    all.emplace_back(more);
  }
  return all;
}

std::vector<std::string> orders_reference_overrides(const Scene& scene, bool quick) {
  const SolverOptions& s = scene.solver;
  const auto times = [&](int value, double factor, int least, int most) {
    const int more = static_cast<int>(std::lround(factor * value));
    return std::min(std::max(more, quick ? 0 : least), most);
  };
  Overrides all = method_overrides(kOrders);
  for (const std::string& override : orders_grid(
           fmt::format("{}", std::max(0.1, std::min(0.5 * s.zenith_step_deg, quick ? 3.0 : 0.5)))
               .c_str(),
           times(s.altitude_levels, 1.6, 80, 400), times(s.polar_directions, 1.5, 48, 128),
           s.azimuth_directions, times(s.phase_degree, 1.34, 32, 64),
           fmt::format("{:.6g}", std::max(1e-8, 0.1 * s.order_tolerance)).c_str())) {
    all.push_back(override);
  }
  all.emplace_back("solver.scattering_orders=auto");
  if (replaces_profile(scene)) return all;
  all.push_back(fmt::format("atmosphere.layers={}", times(scene.atmosphere.layers, 2, 200, 500)));
  if (!scene.atmosphere.profile_file) {  // whose own top may be lower
    all.push_back(fmt::format("atmosphere.top_km={}", std::max(120.0, scene.atmosphere.top_km)));
  }
  const std::vector<double>& nm = scene.spectrum.wavelengths_nm;
  if (!quick && nm.size() > 1 && 2 * nm.size() - 1 <= 64) {
    std::vector<double> finer = {nm.front()};
    for (std::size_t i = 1; i < nm.size(); ++i) {
      finer.push_back(0.5 * (nm[i - 1] + nm[i]));
      finer.push_back(nm[i]);
    }
    all.push_back(fmt::format("spectrum.wavelengths_nm=[{}]", fmt::join(finer, ",")));
  }
  return all;
}

std::vector<std::string> monte_carlo_reference_overrides() { return method_overrides(kMonteCarlo); }

}  // namespace twilight
