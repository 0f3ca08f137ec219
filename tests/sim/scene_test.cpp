// Every range and joint rule of a scene is kept, at its edges.
#include "sim/scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace twilight {
namespace {

using Change = std::function<void(Scene&)>;

Scene valid_scene() {
  Scene scene;
  scene.sun.elevation_deg = -4.0;
  return scene;
}

void expect_accepted(const Change& change) {
  Scene scene = valid_scene();
  change(scene);
  const auto problem = validate(scene);
  EXPECT_FALSE(problem.has_value()) << problem->key << " " << problem->message;
}

// The complaint must name the key and hold every given fragment: value and range.
void expect_refused(const std::string& key, const std::vector<std::string>& fragments,
                    const Change& change) {
  Scene scene = valid_scene();
  change(scene);
  const auto problem = validate(scene);
  ASSERT_TRUE(problem.has_value()) << key;
  EXPECT_EQ(problem->key, key) << problem->message;
  for (const std::string& fragment : fragments)
    EXPECT_NE(problem->message.find(fragment), std::string::npos)
        << "'" << fragment << "' is not in: " << problem->message;
}

TEST(Scene, DefaultsAreValidOnceTheSunIsSomewhere) {
  expect_accepted([](Scene&) {});
  EXPECT_TRUE(validate(Scene{}).has_value());
}

TEST(Scene, EveryNumberIsKeptToItsClosedRange) {
  struct Range {
    const char* key;
    double low, high;
    std::function<void(Scene&, double)> set;
  };
  const Range ranges[] = {
      {"sun.elevation_deg", -90, 90, [](Scene& s, double v) { s.sun.elevation_deg = v; }},
      {"sun.azimuth_deg", -360, 360, [](Scene& s, double v) { s.sun.azimuth_deg = v; }},
      {"earth.radius_km", 1000, 70000, [](Scene& s, double v) { s.earth.radius_km = v; }},
      {"earth.ground_albedo", 0, 1, [](Scene& s, double v) { s.earth.ground_albedo = v; }},
      {"atmosphere.top_km", 1, 120, [](Scene& s, double v) { s.atmosphere.top_km = v; }},
      {"atmosphere.ozone_du", 0, 1000, [](Scene& s, double v) { s.atmosphere.ozone_du = v; }},
      {"aerosols.relative_humidity_percent", 0, 99,
       [](Scene& s, double v) { s.aerosols.relative_humidity_percent = v; }},
      {"aerosols.angstrom_exponent", -1, 4,
       [](Scene& s, double v) { s.aerosols.angstrom_exponent = v; }},
      {"volcanic_sulfate.optical_depth_550nm", 0, 10,
       [](Scene& s, double v) { s.volcanic_sulfate.optical_depth_550nm = v; }},
      {"dust_layer.optical_depth_550nm", 0, 10,
       [](Scene& s, double v) { s.dust_layer.optical_depth_550nm = v; }},
      {"aerosols.optical_depth_550nm", 0, 100,
       [](Scene& s, double v) { s.aerosols.optical_depth_550nm = v; }},
      {"solver.inner_radius_m", 1, 10000, [](Scene& s, double v) { s.solver.inner_radius_m = v; }},
      {"solver.cell_height_km", 0, 200, [](Scene& s, double v) { s.solver.cell_height_km = v; }},
      {"atmosphere.layers", 1, 500,
       [](Scene& s, double v) { s.atmosphere.layers = static_cast<int>(v); }},
      {"solver.azimuth_divisions", 4, 360,
       [](Scene& s, double v) { s.solver.azimuth_divisions = static_cast<int>(v); }},
      {"solver.scattering_orders", 1, 500,
       [](Scene& s, double v) { s.solver.scattering_orders = static_cast<int>(v); }},
      {"solver.active_shell_stride", 1, 32,
       [](Scene& s, double v) { s.solver.active_shell_stride = static_cast<int>(v); }},
      {"atmosphere.nitrogen_dioxide_du", 0, 5,
       [](Scene& s, double v) { s.atmosphere.nitrogen_dioxide_du = v; }},
      {"solver.altitude_levels", 4, 400,
       [](Scene& s, double v) { s.solver.altitude_levels = static_cast<int>(v); }},
      {"solver.polar_directions", 8, 128,
       [](Scene& s, double v) { s.solver.polar_directions = static_cast<int>(v); }},
      {"solver.azimuth_directions", 4, 64,
       [](Scene& s, double v) { s.solver.azimuth_directions = static_cast<int>(v); }},
      {"solver.phase_degree", 2, 64,
       [](Scene& s, double v) { s.solver.phase_degree = static_cast<int>(v); }},
      {"solver.threads", 0, 1024,
       [](Scene& s, double v) { s.solver.threads = static_cast<int>(v); }},
      {"nishita.view_samples", 1, 100000,
       [](Scene& s, double v) { s.nishita.view_samples = static_cast<int>(v); }},
      {"nishita.light_samples", 1, 100000,
       [](Scene& s, double v) { s.nishita.light_samples = static_cast<int>(v); }},
      {"hoffman_preetham.haze_absorption_per_km", 0, 100,
       [](Scene& s, double v) { s.hoffman_preetham.haze_absorption_per_km = v; }},
      {"hoffman_preetham.asymmetry", -1000, 1000,
       [](Scene& s, double v) { s.hoffman_preetham.asymmetry = v; }},
      {"hoffman_preetham.haze_scattering_per_km", 0, 100,
       [](Scene& s, double v) {
         s.hoffman_preetham.haze_scattering_per_km = {0.1, 0.1, v};
       }},
      {"camera.azimuth_deg", -360, 360, [](Scene& s, double v) { s.camera.azimuth_deg = v; }},
      {"camera.elevation_deg", -90, 90, [](Scene& s, double v) { s.camera.elevation_deg = v; }},
      {"output.size", 4, 16384, [](Scene& s, double v) { s.output.size = static_cast<int>(v); }},
  };
  for (const Range& range : ranges) {
    SCOPED_TRACE(range.key);
    expect_accepted([&](Scene& s) { range.set(s, range.low); });
    expect_accepted([&](Scene& s) { range.set(s, range.high); });
    const std::string low = std::to_string(static_cast<int>(range.low));
    const std::string high = std::to_string(static_cast<int>(range.high));
    const std::string allowed = low + ".." + high;
    expect_refused(range.key, {allowed, std::to_string(static_cast<int>(range.low) - 1)},
                   [&](Scene& s) { range.set(s, range.low - 1); });
    expect_refused(range.key, {allowed, std::to_string(static_cast<int>(range.high) + 1)},
                   [&](Scene& s) { range.set(s, range.high + 1); });
  }
}

// Ranges whose ends are no whole numbers: just outside is refused, with value and range named.
TEST(Scene, EveryFractionIsKeptToItsClosedRange) {
  struct Range {
    const char* key;
    double low, high;
    const char* allowed;
    double* (*member)(Scene&);
  };
  const Range ranges[] = {
      {"solver.zenith_step_deg", 0.1, 3, "0.1..3",
       [](Scene& s) { return &s.solver.zenith_step_deg; }},
      {"camera.field_of_view_deg", 0.1, 170, "0.1..170",
       [](Scene& s) { return &s.camera.field_of_view_deg; }},
      {"camera.aspect_ratio", 0.2, 5, "0.2..5", [](Scene& s) { return &s.camera.aspect_ratio; }},
      {"solver.order_tolerance", 1e-8, 0.1, "1e-08..0.1",
       [](Scene& s) { return &s.solver.order_tolerance; }},
      {"solver.target_relative_error", 1e-5, 1, "1e-05..1",
       [](Scene& s) { return &s.solver.target_relative_error; }},
      {"solver.photons", 100, 1e10, "100..10000000000",
       [](Scene& s) { return &s.solver.photons.emplace(); }},
  };
  for (const Range& range : ranges) {
    SCOPED_TRACE(range.key);
    for (const double good : {range.low, range.high}) {
      expect_accepted([&](Scene& s) { *range.member(s) = good; });
    }
    for (const double bad : {range.low * (1 - 1e-9), range.high * (1 + 1e-9), -1.0}) {
      expect_refused(range.key, {fmt::format("= {}:", bad), range.allowed},
                     [&](Scene& s) { *range.member(s) = bad; });
    }
    expect_refused(range.key, {range.allowed},
                   [&](Scene& s) { *range.member(s) = std::numeric_limits<double>::quiet_NaN(); });
  }
  expect_accepted([](Scene& s) { s.solver.seed = 0; });
  expect_accepted([](Scene& s) { s.solver.seed = std::numeric_limits<int>::max(); });
  expect_refused("solver.seed", {"= -1:", "0..2147483647"}, [](Scene& s) { s.solver.seed = -1; });
}

TEST(Scene, SpectralAlbedoPairsIncreasingWavelengthsWithReflectances) {
  const auto albedo = [](std::vector<double> nm, std::vector<double> values) {
    return [=](Scene& s) {
      s.earth.albedo_wavelengths_nm = nm;
      s.earth.albedo_spectrum = values;
    };
  };
  expect_accepted(albedo({}, {}));
  expect_accepted(albedo({550}, {1}));
  expect_accepted(albedo({200, 2500}, {0, 1}));
  constexpr const char* kWavelengths = "earth.albedo_wavelengths_nm";
  constexpr const char* kSpectrum = "earth.albedo_spectrum";
  expect_refused(kWavelengths, {"= 199.9", "value 1 of 2", "200..2500"},
                 albedo({199.9, 700}, {0, 1}));
  expect_refused(kWavelengths, {"= 2501", "value 2 of 2", "200..2500"},
                 albedo({400, 2501}, {0, 1}));
  expect_refused(kWavelengths, {"= 400", "value 2 of 2", "increase"}, albedo({400, 400}, {0, 1}));
  expect_refused(kWavelengths, {"200..2500"},
                 albedo({std::numeric_limits<double>::quiet_NaN()}, {0}));
  expect_refused(kSpectrum, {"= 1.01", "value 2 of 2", "0..1"}, albedo({400, 700}, {0, 1.01}));
  expect_refused(kSpectrum, {"= -0.01", "value 1 of 1", "0..1"}, albedo({400}, {-0.01}));
  expect_refused(kSpectrum, {"1 values", kWavelengths, "2"}, albedo({400, 700}, {0.5}));
  expect_refused(kSpectrum, {"0 values", kWavelengths, "1"}, albedo({400}, {}));
  expect_refused(kSpectrum, {"1 values", kWavelengths, "0"}, albedo({}, {0.5}));
}

TEST(Scene, NanAndInfinityAreRefused) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    expect_refused("sun.elevation_deg", {"-90..90"}, [&](Scene& s) { s.sun.elevation_deg = bad; });
    expect_refused("atmosphere.depolarisation", {"6/7"},
                   [&](Scene& s) { s.atmosphere.depolarisation = bad; });
    expect_refused("observer.height_m", {"-500 up to"},
                   [&](Scene& s) { s.observer.height_m = bad; });
    expect_refused("spectrum.wavelengths_nm", {"280..1000"},
                   [&](Scene& s) { s.spectrum.wavelengths_nm = {bad}; });
  }
}

TEST(Scene, EveryWordIsOneOfItsList) {
  const std::pair<const char*, std::function<void(Scene&)>> words[] = {
      {"sun.spectrum", [](Scene& s) { s.sun.spectrum = "sodium"; }},
      {"atmosphere.profile", [](Scene& s) { s.atmosphere.profile = "sodium"; }},
      {"atmosphere.layer_spacing", [](Scene& s) { s.atmosphere.layer_spacing = "sodium"; }},
      {"atmosphere.layer_optics", [](Scene& s) { s.atmosphere.layer_optics = "sodium"; }},
      {"atmosphere.ozone", [](Scene& s) { s.atmosphere.ozone = "sodium"; }},
      {"atmosphere.refractive_index", [](Scene& s) { s.atmosphere.refractive_index = "sodium"; }},
      {"aerosols.type", [](Scene& s) { s.aerosols.type = "sodium"; }},
      {"aerosols.humidity", [](Scene& s) { s.aerosols.humidity = "sodium"; }},
      {"aerosols.phase", [](Scene& s) { s.aerosols.phase = "sodium"; }},
      {"solver.method", [](Scene& s) { s.solver.method = "sodium"; }},
      {"solver.active_shell_weighting",
       [](Scene& s) { s.solver.active_shell_weighting = "sodium"; }},
      {"solver.air_phase", [](Scene& s) { s.solver.air_phase = "sodium"; }},
      {"solver.cell_optics", [](Scene& s) { s.solver.cell_optics = "sodium"; }},
      {"solver.gather", [](Scene& s) { s.solver.gather = "sodium"; }},
      {"output.projection", [](Scene& s) { s.output.projection = "sodium"; }},
      {"hoffman_preetham.haze", [](Scene& s) { s.hoffman_preetham.haze = "sodium"; }},
      {"hoffman_preetham.phase", [](Scene& s) { s.hoffman_preetham.phase = "sodium"; }},
      {"output.channels", [](Scene& s) { s.output.channels = "sodium"; }},
      {"output.colour_observer", [](Scene& s) { s.output.colour_observer = "sodium"; }},
  };
  for (const auto& [key, change] : words) expect_refused(key, {"\"sodium\"", "must be"}, change);
}

TEST(Scene, HazeScatteringIsThreeValues) {
  expect_refused("hoffman_preetham.haze_scattering_per_km", {"2 values", "three"}, [](Scene& s) {
    s.hoffman_preetham.haze_scattering_per_km = {0.1, 0.2};
  });
}

TEST(Scene, AzimuthDivisionsAreEven) {
  expect_refused("solver.azimuth_divisions", {"= 9:", "even", "4..360"},
                 [](Scene& s) { s.solver.azimuth_divisions = 9; });
}

TEST(Scene, PlaceAndElevationExcludeEachOther) {
  expect_refused("sun.elevation_deg", {"-4", "not both"}, [](Scene& s) {
    s.observer.latitude_deg = 49.25;
    s.observer.longitude_deg = 6.97;
    s.observer.time = "2003-12-08T17:00:00+01:00";
  });
}

TEST(Scene, PlaceIsCompleteOrAbsent) {
  const Change given[] = {
      [](Scene& s) { s.observer.latitude_deg = 49.25; },
      [](Scene& s) { s.observer.longitude_deg = 6.97; },
      [](Scene& s) { s.observer.time = "2003-12-08T17:00:00+01:00"; },
  };
  const char* keys[] = {"observer.latitude_deg", "observer.longitude_deg", "observer.time"};
  for (int missing = 0; missing < 3; ++missing) {
    expect_refused(keys[missing], {"missing"}, [&](Scene& s) {
      s.sun.elevation_deg.reset();
      for (int i = 0; i < 3; ++i)
        if (i != missing) given[i](s);
    });
  }
  expect_accepted([&](Scene& s) {
    s.sun.elevation_deg.reset();
    for (const Change& change : given) change(s);
  });
}

TEST(Scene, TimeIsAnOffsetDateTime) {
  for (const char* bad : {"2003-12-08", "2003-12-08T17:00:00", "2003-02-30T17:00:00Z", "noon"}) {
    expect_refused("observer.time", {bad, "2003-12-08T17:00:00+01:00"}, [&](Scene& s) {
      s.sun.elevation_deg.reset();
      s.observer.latitude_deg = 49.25;
      s.observer.longitude_deg = 6.97;
      s.observer.time = bad;
    });
  }
}

TEST(Scene, ObserverStandsInsideTheAtmosphere) {
  expect_accepted([](Scene& s) { s.observer.height_m = 99999.0; });
  expect_accepted([](Scene& s) { s.observer.height_m = -430.0; });
  expect_refused("observer.height_m", {"= -1:", "at least 0", "optical_layers"}, [](Scene& s) {
    s.observer.height_m = -1.0;
    s.atmosphere.optical_layers = "layers.csv";
  });
  expect_refused("observer.height_m", {"= 100000:", "cells"},
                 [](Scene& s) { s.observer.height_m = 100000.0; });
  expect_refused("observer.height_m", {"= -501:"}, [](Scene& s) { s.observer.height_m = -501.0; });
}

// Orders and Monte Carlo know the Earth's limb from orbit as well.
TEST(Scene, OtherMethodsSeeFromOrbit) {
  for (const char* method : {"orders", "monte-carlo"}) {
    for (const bool own_layers : {false, true}) {
      const auto height = [&](double height_m) {
        return [=](Scene& s) {
          s.solver.method = method;
          if (own_layers) s.atmosphere.optical_layers = "layers.csv";
          s.observer.height_m = height_m;
        };
      };
      expect_accepted(height(0));
      expect_accepted(height(100000));
      expect_accepted(height(4e7));
      expect_refused("observer.height_m", {"= 40000001:", "-500..40000000"}, height(40000001));
      expect_refused("observer.height_m", {"= -501:", own_layers ? "at least 0" : "-500..40000000"},
                     height(-501));
    }
  }
}

TEST(Scene, OnlyTheExponentialProfileReachesBeyondTheTables) {
  expect_accepted([](Scene& s) {
    s.atmosphere.profile = "exponential";
    s.atmosphere.top_km = 200.0;
  });
  expect_refused("atmosphere.top_km", {"= 121:", "1..120"},
                 [](Scene& s) { s.atmosphere.top_km = 121.0; });
}

TEST(Scene, DepolarisationStaysBelowSixSevenths) {
  expect_accepted([](Scene& s) { s.atmosphere.depolarisation = 0.857; });
  expect_refused("atmosphere.depolarisation", {"6/7"},
                 [](Scene& s) { s.atmosphere.depolarisation = 6.0 / 7.0; });
}

TEST(Scene, WavelengthsIncreaseStrictlyInsideTheTables) {
  expect_accepted([](Scene& s) { s.spectrum.wavelengths_nm = {280, 1000}; });
  expect_refused("spectrum.wavelengths_nm", {"0 values", "1..64"},
                 [](Scene& s) { s.spectrum.wavelengths_nm = {}; });
  expect_refused("spectrum.wavelengths_nm", {"65 values", "1..64"}, [](Scene& s) {
    s.spectrum.wavelengths_nm.clear();
    for (int i = 0; i < 65; ++i) s.spectrum.wavelengths_nm.push_back(400.0 + i);
  });
  expect_refused("spectrum.wavelengths_nm", {"= 550", "value 2 of 2", "increase"}, [](Scene& s) {
    s.spectrum.wavelengths_nm = {550, 550};
  });
  expect_refused("spectrum.wavelengths_nm", {"= 279.9", "280..1000"}, [](Scene& s) {
    s.spectrum.wavelengths_nm = {279.9, 550};
  });
  // TSIS-1's table starts later than the others.
  expect_refused("spectrum.wavelengths_nm", {"= 300", "350..1000"}, [](Scene& s) {
    s.sun.spectrum = "tsis1_hsrs";
    s.spectrum.wavelengths_nm = {300, 550};
  });
}

// What the cells cannot do is refused there and allowed elsewhere; saying no is always allowed.
TEST(Scene, CellsAreScalarLitByAPointAndHenyeyGreenstein) {
  struct Wish {
    const char* key;
    std::vector<std::string> fragments;
    Change yes, no;
  };
  const Wish wishes[] = {
      {"solver.polarisation",
       {"= true", "cells", "scalar"},
       [](Scene& s) { s.solver.polarisation = true; },
       [](Scene& s) { s.solver.polarisation = false; }},
      {"sun.disc_average",
       {"= true", "cells", "elevation"},
       [](Scene& s) { s.sun.disc_average = true; },
       [](Scene& s) { s.sun.disc_average = false; }},
      {"aerosols.phase",
       {"= \"mie\"", "cells", "henyey-greenstein"},
       [](Scene& s) { s.aerosols.phase = "mie"; },
       [](Scene& s) { s.aerosols.phase = "henyey-greenstein"; }},
  };
  for (const Wish& wish : wishes) {
    expect_refused(wish.key, wish.fragments, wish.yes);
    expect_accepted(wish.no);
    for (const char* method : {"orders", "monte-carlo"}) {
      for (const Change& change : {wish.yes, wish.no}) {
        expect_accepted([&](Scene& s) {
          s.solver.method = method;
          change(s);
        });
      }
    }
  }
}

TEST(Scene, OwnLayersHaveNoMiePhase) {
  const auto layers = [](std::optional<std::string> phase) {
    return [=](Scene& s) {
      s.solver.method = "orders";
      s.atmosphere.optical_layers = "layers.csv";
      s.aerosols.phase = phase;
    };
  };
  expect_accepted(layers(std::nullopt));
  expect_accepted(layers("henyey-greenstein"));
  expect_refused("aerosols.phase", {"= \"mie\"", "optical_layers"}, layers("mie"));
}

TEST(Scene, UnsetOptionsFollowTheMethod) {
  Scene scene = valid_scene();
  EXPECT_FALSE(polarised(scene) || disc_averaged(scene) || mie_phase(scene));
  for (const char* method : {"orders", "monte-carlo"}) {
    scene = valid_scene();
    scene.solver.method = method;
    EXPECT_TRUE(polarised(scene) && disc_averaged(scene) && mie_phase(scene));
    scene.solver.polarisation = false;
    scene.sun.disc_average = false;
    EXPECT_FALSE(polarised(scene) || disc_averaged(scene));
    scene.aerosols.phase = "henyey-greenstein";
    EXPECT_FALSE(mie_phase(scene));
    scene.aerosols.phase = "mie";
    EXPECT_TRUE(mie_phase(scene));
    scene.aerosols.type = "none";
    EXPECT_FALSE(mie_phase(scene));
    scene.aerosols = {};
    scene.atmosphere.optical_layers = "layers.csv";
    EXPECT_FALSE(mie_phase(scene));
  }
}

TEST(Scene, NoAerosolsHaveNoOpticalDepth) {
  expect_refused("aerosols.optical_depth_550nm", {"= 0.1", "none"}, [](Scene& s) {
    s.aerosols.type = "none";
    s.aerosols.optical_depth_550nm = 0.1;
  });
}

}  // namespace
}  // namespace twilight
