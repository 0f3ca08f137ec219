#include "output/sky_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "../sim/orders_model.h"
#include "aerosols/cornette_shanks.h"
#include "atmosphere/rayleigh.h"
#include "output/hillaire2020_layout.h"
#include "output/table_check.h"
#include "output/table_file.h"
#include "output/table_sky.h"
#include "sim/gauss_legendre.h"
#include "sim/observer_ray.h"
#include "sim/sky_column.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kDegree = pi / 180;

LayoutSizes small_sizes() {
  LayoutSizes n;
  n.transmittance_mu = 16;
  n.transmittance_r = 6;
  n.r = 4;
  n.mu = 24;
  n.mu_s = 12;
  n.nu = 6;
  n.irradiance_mu_s = 6;
  n.irradiance_r = 3;
  return n;
}

// A little aerosol over air, on coarse grids; three wavelengths.
SceneModel hazy_model(double height_m = 0) {
  Scene scene;
  scene.solver.method = "orders";
  scene.sun.elevation_deg = 10;
  scene.observer.height_m = height_m;
  scene.spectrum.wavelengths_nm = {440, 550, 680};
  scene.atmosphere.layers = 40;
  scene.solver.altitude_levels = 16;
  scene.solver.zenith_step_deg = 2;
  scene.solver.polar_directions = 12;
  scene.solver.azimuth_directions = 8;
  scene.solver.phase_degree = 12;
  scene.solver.sunlight_nodes = 128;
  scene.solver.threads = 2;
  return build_scene_model(scene);
}

struct Solved {
  SceneModel model = hazy_model();
  OrdersSky sky{model, RunControl{}};
  TableChannels channels{model, TableSpectrum::kWavelengths};
  TableSource source{model, sky, channels};
  double bottom = model.medium.earth_radius_km, top = bottom + model.medium.top_km();
};

const Solved& solved() {
  static const Solved one;
  return one;
}

class EveryLayout : public ::testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<TableLayout> layout_ = make_layout(GetParam(), {}, 6360, 6420);
};

TEST_P(EveryLayout, TexelsAndQuantitiesGoBothWays) {
  const TableLayout& l = *layout_;
  const LayoutSizes& n = l.sizes();
  for (std::size_t k = 0; k < n.r; k += 3) {
    const double r = l.scattering_r_km(static_cast<double>(k));
    EXPECT_NEAR(l.scattering_r_texel(r), static_cast<double>(k), 1e-6);
    for (std::size_t j = 0; j < n.mu; j += 5) {
      const auto y = static_cast<double>(j);
      const double mu = l.scattering_mu(r, y);
      EXPECT_LE(std::abs(mu), 1);
      if (std::abs(mu) > 1 - 1e-9) continue;  // the vertical, of no azimuth
      // On the ground itself every way to it is none: its texels are one.
      if (k == 0 && l.meets_ground_texel(y)) continue;
      EXPECT_NEAR(l.scattering_mu_texel(r, mu, l.meets_ground_texel(y)), y, 1e-3);
    }
  }
  for (std::size_t k = 0; k < n.mu_s; ++k) {
    const auto x = static_cast<double>(k);
    EXPECT_NEAR(l.scattering_mu_s_texel(l.scattering_mu_s(x)), x, 1e-6);
  }
  for (const double nu : {-1.0, -0.3, 0.2, 1.0}) {
    EXPECT_NEAR(l.scattering_nu(l.scattering_nu_texel(nu)), nu, 1e-12);
  }
  for (const double x : {0.0, 17.0, 101.0}) {
    for (const double y : {1.0, 20.0, 50.0}) {
      const TexelPoint t = l.transmittance_texel(l.transmittance_at({x, y}));
      EXPECT_NEAR(t.x, x, 1e-6);
      EXPECT_NEAR(t.y, y, 1e-6);
      const TexelPoint e = l.irradiance_texel(l.irradiance_at({x / 4, y / 4}));
      EXPECT_NEAR(e.x, x / 4, 1e-9);
      EXPECT_NEAR(e.y, y / 4, 1e-9);
    }
  }
}

TEST_P(EveryLayout, TheHalvesOfTheViewAxisMeetAtTheHorizon) {
  const TableLayout& l = *layout_;
  const double half = 0.5 * static_cast<double>(l.sizes().mu), r = 6370;
  const double horizon = -std::sqrt(1 - std::pow(6360 / r, 2));
  EXPECT_NEAR(l.scattering_mu(r, half - 1), -1, GetParam() == "bruneton2008" ? 1e-9 : 1e-9);
  EXPECT_NEAR(l.scattering_mu(r, 0), horizon, 1e-9);
  EXPECT_NEAR(l.scattering_mu(r, half), 1, 1e-9);
  EXPECT_NEAR(l.scattering_mu(r, 2 * half - 1), horizon, 1e-9);
  EXPECT_TRUE(l.meets_ground(r, horizon - 1e-6));
  EXPECT_FALSE(l.meets_ground(r, horizon + 1e-6));
}

TEST_P(EveryLayout, TheSunsAxisEndsAtTheZenithAndItsLowestSun) {
  const TableLayout& l = *layout_;
  EXPECT_NEAR(l.scattering_mu_s(static_cast<double>(l.sizes().mu_s - 1)), 1, 1e-9);
  EXPECT_LT(l.scattering_mu_s(0), -0.15);
  // Darker Suns read the last texel.
  EXPECT_EQ(l.scattering_mu_s_texel(-0.9), 0);
}

INSTANTIATE_TEST_SUITE_P(Layouts, EveryLayout,
                         ::testing::Values("bruneton2008", "bruneton2017", "twilight"),
                         [](const auto& info) { return info.param; });

// Bruneton & Neyret (2008), Sec. 4: u_mu_s = (1 - exp(-3 mu_s - 0.6)) / (1 - exp(-3.6)), u_mu of
// an upward ray d / (rho + H), texture of 32 x 128 x 256.
TEST(Bruneton2008Layout, HasThePapersMappings) {
  const auto l = make_layout("bruneton2008", {}, 6360, 6420);
  EXPECT_NEAR(l->scattering_mu_s(0), -0.2, 1e-12);
  const double u = (1 - std::exp(-3 * 0.3 - 0.6)) / (1 - std::exp(-3.6));
  EXPECT_NEAR(l->scattering_mu_s_texel(0.3), 31 * u, 1e-12);
  const double H = std::sqrt(6420.0 * 6420 - 6360.0 * 6360);
  EXPECT_NEAR(l->scattering_mu_texel(6360, 1.0, false), 64 + 63 * 60 / H, 1e-9);
  EXPECT_NEAR(l->scattering_mu_texel(6360, 0.0, false), 127, 1e-9);
  EXPECT_EQ(l->sizes().nu * l->sizes().mu_s, 256U);
}

// Texel 0 of the Sun's axis is mu_s_min itself, where a = A, the last the zenith.
TEST(Bruneton2017Layout, ItsAxisEndsAtMuSMin) {
  const auto l = make_layout("bruneton2017", {}, 6360, 6420);
  EXPECT_NEAR(l->scattering_mu_s(0), std::cos(102 * kDegree), 1e-9);
  EXPECT_NEAR(l->scattering_mu_s(31), 1.0, 1e-9);
  const auto far = make_layout("bruneton2017", {}, 6360, 6420, 110);
  EXPECT_NEAR(far->scattering_mu_s(0), std::cos(110 * kDegree), 1e-9);
}

TEST(TableLayout, RefusesWhatItCannotBe) {
  EXPECT_THROW(make_layout("hosek", {}, 6360, 6420), std::invalid_argument);
  EXPECT_THROW(make_layout("bruneton2017", {}, 6420, 6360), std::invalid_argument);
  EXPECT_THROW(make_layout("bruneton2017", {}, 6360, 6420, 80), std::invalid_argument);
  EXPECT_THROW(make_layout("bruneton2008", {}, 6360, 6420, 105), std::invalid_argument);
  LayoutSizes odd;
  odd.mu = 7;
  EXPECT_THROW(make_layout("bruneton2017", odd, 6360, 6420), std::invalid_argument);
}

TEST(Hillaire2020Layout, TexelsAndQuantitiesGoBothWays) {
  const Hillaire2020Layout l({}, 6360, 6460);
  for (const double x : {0.0, 40.0, 255.0}) {
    for (const double y : {0.0, 31.0, 63.0}) {
      const TexelPoint t = l.transmittance_texel(l.transmittance_at({x, y}));
      EXPECT_NEAR(t.x, x, 1e-6);
      EXPECT_NEAR(t.y, y, 1e-6);
    }
  }
  // The shaders' look-ups are off by up to n / (n + 1) of half a texel at the edges.
  for (const double x : {0.0, 16.0, 31.0}) {
    const TexelPoint t = l.multiple_texel(l.multiple_at({x, 10}));
    EXPECT_NEAR(t.x, x, 1.0 / 32);
    EXPECT_NEAR(t.y, 10, 1.0 / 32 + 0.01 * 32);
  }
  for (const double y : {0.0, 20.0, 60.0, 107.0}) {
    const TexelPoint t = l.sky_view_texel(6362, l.sky_view_at(6362, {77, y}));
    EXPECT_NEAR(t.x, 77, 1.0 / 60);
    EXPECT_NEAR(t.y, y, 1.0 / 60);
  }
}

TEST(NonnegativeLeastSquares, SolvesAndHoldsWhatWouldBeNegative) {
  // |x0 + x1 - 1|^2 + |x0 - x1 - 3|^2: free minimum (2, -1); with x >= 0: x1 = 0, x0 = 2.
  BandedSystem s(2, 2);
  s.at(0, 0) = 2;
  s.at(1, 1) = 2;
  s.at(1, 0) = 0;
  s.right = {4, -2};
  const std::vector<double> x = nonnegative_least_squares(s, std::vector<double>{0, 0}, 0);
  EXPECT_NEAR(x[0], 2, 1e-12);
  EXPECT_EQ(x[1], 0);
  // A ridge alone gives its start.
  BandedSystem weak(2, 2);
  weak.at(0, 0) = weak.at(1, 1) = 1;
  const std::vector<double> y = nonnegative_least_squares(weak, std::vector<double>{5, 7}, 1e9);
  EXPECT_NEAR(y[0], 5, 1e-6);
  EXPECT_NEAR(y[1], 7, 1e-6);
}

// Light that a table can hold is found again, in either storage.
TEST(ScatteringFit, LightOfATableIsFittedExactly) {
  const std::array<double, 3> rule = {1, 0.8, 0.6};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(0.5, 1.5);
  for (const MieStorage storage : {MieStorage::kSeparate, MieStorage::kCombined}) {
    const ScatteringFit fit({2, 2, 2}, {-1, -0.2, 0.5, 1}, 0.7, storage, TableFilling::kFitted,
                            rule);
    ScatteringTexels truth;
    for (int t = 0; t < 16; ++t) {
      const double red = u(random), mie = 0.3 * u(random);
      truth.star.push_back({red, 2 * u(random), 3 * u(random)});
      truth.mie.push_back({mie, 0.2 * u(random), 0.2 * u(random)});
      for (std::size_t c = 1; storage == MieStorage::kCombined && c < 3; ++c) {
        truth.mie.back()[c] = truth.star.back()[c] * mie / red * rule[c];
      }
    }
    std::vector<ScatteringSample> samples;
    for (const double sun : fit.sample_sun()) {
      for (const double nu : fit.sample_nu()) {
        const auto s = std::min<std::size_t>(static_cast<std::size_t>(sun), 2);
        const double nodes[] = {-1, -0.2, 0.5, 1};
        std::size_t l = 0;
        while (l < 2 && nu > nodes[l + 1]) ++l;
        const double f = (nu - nodes[l]) / (nodes[l + 1] - nodes[l]);
        const double g = sun - static_cast<double>(s);
        std::array<double, 3> star{}, mie{};
        for (std::size_t c = 0; c < 3; ++c) {
          const auto mix = [&](const auto& x) {
            return (1 - g) * std::lerp(x[s * 4 + l][c], x[s * 4 + l + 1][c], f) +
                   g * std::lerp(x[s * 4 + 4 + l][c], x[s * 4 + l + 5][c], f);
          };
          star[c] = mix(truth.star);
          mie[c] = mix(truth.mie);
        }
        ScatteringSample sample;
        sample.weight = 1;
        for (std::size_t c = 0; c < 3; ++c) {
          if (storage == MieStorage::kCombined) mie[c] = star[c] * mie[0] / star[0] * rule[c];
          sample.radiance[c] =
              star[c] * rayleigh_phase_per_sr(nu, 0) + mie[c] * cornette_shanks(nu, 0.7);
          sample.mie[c] = mie[c];
          sample.smooth[c] = star[c] * rayleigh_phase_per_sr(nu, 0);
        }
        samples.push_back(sample);
      }
    }
    EXPECT_LT(fit.error(samples, fit.texels(samples)), 1e-4);
  }
}

// At the nodes of a table that is filled so, its reader gives what the solver has.
TEST(SkyTables, NodesHoldTheDirectSolution) {
  const Solved& s = solved();
  const auto layout = make_layout("bruneton2017", small_sizes(), s.bottom, s.top);
  for (const MieStorage storage : {MieStorage::kCombined, MieStorage::kSeparate}) {
    SkyTableOptions options;
    options.filling = TableFilling::kNodes;
    options.storage = storage;
    const SkyTables tables = fill_sky_tables(s.source, *layout, options, {}, {0});
    const TableSky read(*layout, tables, false);
    int compared = 0;
    for (const double j : {14.0, 18.0, 21.0}) {
      for (const double k : {3.0, 6.0, 9.0}) {
        for (const double l : {1.0, 2.0, 3.0, 4.0}) {
          const double mu = layout->scattering_mu(s.bottom, j), mu_s = layout->scattering_mu_s(k);
          const double nu = layout->scattering_nu(l);
          const double product = std::sqrt((1 - mu * mu) * (1 - mu_s * mu_s));
          if (std::abs(nu - mu * mu_s) > 0.95 * product) continue;
          const std::vector<ViewDirection> view = {
              {std::asin(mu), std::acos((nu - mu * mu_s) / product)}};
          const std::vector<double> truth = s.sky.under(std::asin(mu_s))->radiance(view);
          const ChannelTriple found = read.radiance(s.bottom, mu, mu_s, nu);
          // 3e-3: columns interpolate azimuths; channels run from red to blue.
          for (std::size_t c = 0; c < 3; ++c) {
            EXPECT_NEAR(found[c] / truth[2 - c], 1, 3e-3) << j << ' ' << k << ' ' << l;
          }
          ++compared;
        }
      }
    }
    EXPECT_GT(compared, 8);
  }
}

// What the fit is for: aerosols' forward peaks between nodes of nu.
TEST(SkyTables, FittedTexelsReadBetterThanNodes) {
  const Solved& s = solved();
  const auto layout = make_layout("bruneton2017", small_sizes(), s.bottom, s.top);
  const TableTruth truth(s.source, {30, 10, 3});
  SkyTableOptions options;
  const auto worst = [&](TableFilling filling) {
    options.filling = filling;
    const SkyTables tables = fill_sky_tables(s.source, *layout, options, {}, {0});
    double most = 0;
    for (const TableError& e : truth.errors("", *layout, tables, false))
      most = std::max(most, e.mean);
    return most;
  };
  const double fitted = worst(TableFilling::kFitted);
  EXPECT_LT(fitted, 0.05);
  EXPECT_LT(fitted, 0.2 * worst(TableFilling::kNodes));
}

// Vertical and slant transmittance of layers without refraction: sum of chords.
TEST(SkyTables, TransmittanceIsTheExponentialOfTheChords) {
  const SceneModel model = orders_model(exponential_air(0.3, 30, 60, 3), 20);
  const OrdersSky sky(model, RunControl{});
  const TableChannels channels(
      [&] {
        SceneModel m = model;
        m.medium.wavelength_nm = {440, 550, 680};
        return m;
      }(),
      TableSpectrum::kWavelengths);
  const TableSource source{model, sky, channels};
  const double R = model.medium.earth_radius_km;
  const auto layout = make_layout("bruneton2017", small_sizes(), R, R + 60);
  const Texture t =
      fill_transmittance(source, 16, 6, [&](TexelPoint p) { return layout->transmittance_at(p); });
  for (std::size_t y = 0; y < 6; ++y) {
    for (std::size_t x = 0; x < 15; ++x) {
      const auto [r, mu] =
          layout->transmittance_at({static_cast<double>(x), static_cast<double>(y)});
      const double perigee = r * std::sqrt(1 - mu * mu);
      double depth = 0;
      for (std::size_t i = 0; i < 30; ++i) {
        const double low = R + model.medium.boundary_km[i];
        const double high = R + model.medium.boundary_km[i + 1];
        const auto leg = [&](double from) {  // outwards from a radius, inside the layer
          const double a = std::max({low, from, perigee}), b = std::max(high, a);
          return std::sqrt(std::max(0.0, b * b - perigee * perigee)) -
                 std::sqrt(std::max(0.0, a * a - perigee * perigee));
        };
        const double length = mu >= 0 ? leg(r) : 2 * leg(perigee) - leg(r);
        depth += length * model.medium.air_scattering_per_km(i, 2);
      }
      EXPECT_NEAR(t.at(x, y)[0], std::exp(-depth), 2e-6) << x << ' ' << y;
    }
  }
}

// Columns without the ground's light, the gather without it, and with it, above a bright ground.
TEST(SkyColumns, LeaveOutTheGroundsOwnLight) {
  SceneModel model = orders_model(exponential_air(0.2), 30, 0.8, 5);
  const OrdersSky sky(model, RunControl{});
  const std::vector<ViewDirection> views = {view_deg(-40, 60), view_deg(30, 60)};
  const std::vector<double> all = sky.radiance(views), scattered = sky.scattered_radiance(views);
  EXPECT_GT(all[0], 1.5 * scattered[0]);
  EXPECT_EQ(all[1], scattered[1]);
  const OrdersAtmosphere& air = *sky.atmosphere();
  const OrdersGather gather(air, pi / 3, 5);
  const ObserverRays rays(air, 5);
  const SkyColumns columns(air, gather, pi / 3, false);
  const std::vector<float> column =
      columns.at(*rays.at(views[0].elevation_rad), std::vector<double>{pi / 3, pi / 3});
  SkyPoint p = columns.point(views[0].elevation_rad, pi / 3);
  p.nodes = 2;
  p.node[0] = p.node[1] = column.data();
  p.weight[0] = 1;
  std::vector<float> seen(air.lanes());
  sky_radiance(p, seen.data());
  EXPECT_NEAR(seen[0] / scattered[0], 1, 1e-3);
}

// Against the sky's and the air's light below, gathered in every direction at a texel's place.
TEST(HillaireTables, MultipleScatteringIsTheMeanRadiance) {
  constexpr double kCosine = 2 * 27.0 / 31 - 1;  // of texel 27
  SceneModel model = orders_model(exponential_air(0.3, 30, 60, 3), 30);
  model.medium.wavelength_nm = {440, 550, 680};
  const double R = model.medium.earth_radius_km;
  const Hillaire2020Layout layout({8, 4, 32, 12, 8}, R, R + 60);
  // The public shaders' lowest row stands 1 % of the air's height above the ground.
  const double height_km = layout.multiple_at({27, 0}).r_km - R;
  EXPECT_NEAR(height_km, 0.6, 1e-3);
  model.scene.observer.height_m = 1e3 * height_km;
  model.sun_elevation_rad = std::asin(kCosine);
  const OrdersSky sky(model, RunControl{});
  const TableChannels channels(model, TableSpectrum::kWavelengths);
  const HillaireTables tables = fill_hillaire_tables({model, sky, channels}, layout, {30}, {});
  std::vector<ViewDirection> views;
  std::vector<double> weight;
  for (const double side : {-1.0, 1.0}) {
    for (const GaussNode& g : gauss_legendre(24, 0, 1)) {
      for (int k = 0; k < 16; ++k) {
        views.push_back({side * std::asin(g.x * g.x), (k + 0.5) * pi / 16});
        weight.push_back(2 * g.x * g.weight * 2 * pi / 16);
      }
    }
  }
  const std::vector<double> light = sky.radiance(views);
  double mean = 0;
  for (std::size_t v = 0; v < views.size(); ++v) mean += weight[v] * light[3 * v + 1] / (4 * pi);
  EXPECT_NEAR(tables.multiple.at(27, 0)[1] / mean, 1, 0.02);  // levels are linear between
}

TEST(TableSky, HalvesRoundToTheNearestEven) {
  EXPECT_EQ(rounded_to_half(1.0F), 1.0F);
  EXPECT_EQ(rounded_to_half(1.0F + std::ldexp(1.0F, -11)), 1.0F);
  EXPECT_EQ(rounded_to_half(1.0F + 3 * std::ldexp(1.0F, -11)), 1.0F + std::ldexp(1.0F, -9));
  EXPECT_EQ(rounded_to_half(1e6F), 65504.0F);
  EXPECT_EQ(rounded_to_half(std::ldexp(1.0F, -24)), std::ldexp(1.0F, -24));
  EXPECT_EQ(rounded_to_half(std::ldexp(1.0F, -26)), 0.0F);
}

TEST(SkyTables, ApparentDirectionsKeepTheHorizon) {
  const double straight = -3.2 * kDegree, refracted = -2.9 * kDegree;
  EXPECT_EQ(apparent_elevation_rad(0.3, straight, refracted), 0.3);
  EXPECT_NEAR(apparent_elevation_rad(straight, straight, refracted), refracted, 1e-15);
  EXPECT_NEAR(apparent_elevation_rad(-pi / 2, straight, refracted), -pi / 2, 1e-15);
  for (const double e : {-1.2, -0.2, -0.03, 0.0, 0.4}) {
    EXPECT_NEAR(
        straight_elevation_rad(apparent_elevation_rad(e, straight, refracted), straight, refracted),
        e, 1e-12);
  }
}

TEST(TableFile, WhatIsWrittenIsReadBack) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / "twilight_table_file_test";
  fs::remove_all(folder);
  const auto layout = make_layout("twilight", small_sizes(), 6360, 6420);
  SkyTables tables;
  tables.transmittance = Texture(16, 6);
  tables.irradiance = Texture(6, 3);
  tables.scattering = Texture(72, 24, 4);
  tables.single_mie = Texture(72, 24, 4);
  tables.sun_scale = Texture(8, 1);
  for (std::size_t i = 0; i < tables.scattering.rgba.size(); ++i) {
    tables.scattering.rgba[i] = static_cast<float>(i) * 0.001F;
  }
  tables.sun_scale->rgba[3] = -12.5F;
  tables.constants.mie_g = 0.77;
  tables.constants.mie_per_km = {0.01, 0.012, 0.014};
  TableManifest manifest;
  manifest.layout = "twilight";
  manifest.bottom_radius_km = 6360;
  manifest.top_radius_km = 6420;
  manifest.mappings = layout->formulas();
  write_table_set(folder, textures_of(tables), manifest, &tables, layout.get(), true);
  const TableSet set = read_table_set(folder);
  EXPECT_EQ(set.tables.scattering.rgba, tables.scattering.rgba);
  EXPECT_EQ(set.tables.sun_scale->rgba, tables.sun_scale->rgba);
  EXPECT_EQ(set.tables.constants.mie_g, 0.77);
  EXPECT_EQ(set.tables.constants.mie_per_km, tables.constants.mie_per_km);
  EXPECT_NEAR(set.layout->geometry().mu_s_min, layout->geometry().mu_s_min, 1e-12);
  const TableSky a(*layout, tables, false), b(*set.layout, set.tables, false);
  for (std::size_t c = 0; c < 3; ++c) {
    const double wanted = a.radiance(6365, 0.3, 0.1, 0.2)[c];
    EXPECT_NEAR(b.radiance(6365, 0.3, 0.1, 0.2)[c], wanted, 1e-9 * wanted);
  }
  std::ifstream stream(folder / "manifest.json");
  EXPECT_TRUE(nlohmann::json::parse(stream).contains("mappings"));
  EXPECT_EQ(fs::file_size(folder / "scattering.dat"), 72U * 24 * 4 * 16);
  fs::resize_file(folder / "scattering.dat", 1000);
  EXPECT_THROW(read_table_set(folder), std::runtime_error);
  fs::remove(folder / "irradiance.dat");
  EXPECT_THROW(read_table_set(folder), std::runtime_error);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace twilight
