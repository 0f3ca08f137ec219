#include "output/colour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <vector>

#include "output/colour_matching.h"
#include "output/photometry.h"

namespace twilight {
namespace {

std::vector<double> even_wavelengths(double first_nm, double last_nm, int count) {
  std::vector<double> nm;
  for (int i = 0; i < count; ++i) nm.push_back(first_nm + (last_nm - first_nm) * i / (count - 1));
  return nm;
}

double unit(double) { return 1.0; }

/// CIE 15: illuminant A, relative to 560 nm.
double illuminant_a(double nm) {
  constexpr double kC2_nm = 1.435e7;
  return std::pow(560.0 / nm, 5) * std::expm1(kC2_nm / (2848.0 * 560.0)) /
         std::expm1(kC2_nm / (2848.0 * nm));
}

/// XYZ of a spectrum known at every nm; nothing is left to interpolation.
Tristimulus every_nanometre(ColourObserver observer, const std::function<double(double)>& f) {
  const auto nm = even_wavelengths(360.0, 830.0, 471);
  std::vector<double> spectrum, solar(nm.size(), 1.0);
  for (double l : nm) spectrum.push_back(f(l));
  return ColourIntegrator(nm, unit, observer).xyz(spectrum, solar);
}

// CIE 15: the y functions peak at 1 at 555 nm (1931) and 557 nm (1964).
TEST(ColourMatching, LuminosityPeaksAtOne) {
  EXPECT_EQ(colour_matching(ColourObserver::kCie1931, 555.0)[1], 1.0);
  EXPECT_NEAR(colour_matching(ColourObserver::kCie1964, 557.0)[1], 1.0, 1e-6);
}

TEST(ColourMatching, IsLinearBetweenRowsAndZeroOutside) {
  const auto a = colour_matching(ColourObserver::kCie1931, 600.0);
  const auto b = colour_matching(ColourObserver::kCie1931, 601.0);
  const auto m = colour_matching(ColourObserver::kCie1931, 600.5);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(m[c], 0.5 * (a[c] + b[c]), 1e-15);
  EXPECT_EQ(colour_matching(ColourObserver::kCie1931, 359.9)[0], 0.0);
  EXPECT_EQ(colour_matching(ColourObserver::kCie1931, 830.1)[0], 0.0);
  EXPECT_GT(colour_matching(ColourObserver::kCie1931, 830.0)[0], 0.0);
  EXPECT_THROW(colour_matching(ColourObserver::kCie1931, std::nan("")), std::invalid_argument);
}

// CIE 15: the three 1931 functions have equal integrals; sum of y at 1 nm = 106.8569.
TEST(ColourMatching, EqualIntegrals) {
  Tristimulus sum = {};
  for (const auto& row : colour_matching_table(ColourObserver::kCie1931)) {
    for (std::size_t c = 0; c < 3; ++c) sum[c] += row[c];
  }
  EXPECT_NEAR(sum[1], 106.8569, 1e-3);
  EXPECT_NEAR(sum[0] / sum[1], 1.0, 2e-4);
  EXPECT_NEAR(sum[2] / sum[1], 1.0, 4e-4);
}

TEST(ColourMatching, EqualEnergyIsOneThird) {
  for (auto observer : {ColourObserver::kCie1931, ColourObserver::kCie1964}) {
    const auto xy = chromaticity(every_nanometre(observer, unit));
    EXPECT_NEAR(xy[0], 1.0 / 3.0, 1e-4);
    EXPECT_NEAR(xy[1], 1.0 / 3.0, 1e-4);
  }
}

// CIE 15, Table T.3: illuminant A, x = 0.44758 y = 0.40745 (2 deg), x10 = 0.45117 y10 = 0.40594.
TEST(ColourIntegrator, IlluminantAChromaticity) {
  const auto two = chromaticity(every_nanometre(ColourObserver::kCie1931, illuminant_a));
  EXPECT_NEAR(two[0], 0.44758, 2e-5);
  EXPECT_NEAR(two[1], 0.40745, 2e-5);
  const auto ten = chromaticity(every_nanometre(ColourObserver::kCie1964, illuminant_a));
  EXPECT_NEAR(ten[0], 0.45117, 2e-5);
  EXPECT_NEAR(ten[1], 0.40594, 2e-5);
}

TEST(ColourIntegrator, SolarSpectrumIsResolvedBetweenSamples) {
  // A sky exactly lambda^-4 under a lined source, from 3 samples.
  const auto lined = [](double nm) { return static_cast<int>(nm) % 7 == 0 ? 0.3 : 1.0; };
  const std::vector<double> nm = {420.0, 527.3, 650.0};
  std::vector<double> radiance;
  const std::vector<double> solar = {2.0, 3.0, 4.0};  // any E0_i: only the ratio counts
  for (std::size_t i = 0; i < 3; ++i) radiance.push_back(solar[i] * std::pow(500.0 / nm[i], 4));
  const auto few = ColourIntegrator(nm, lined, ColourObserver::kCie1931).xyz(radiance, solar);
  const auto all = every_nanometre(ColourObserver::kCie1931,
                                   [&](double l) { return lined(l) * std::pow(500.0 / l, 4); });
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(few[c] / all[c], 1.0, 1e-12);
}

TEST(ColourIntegrator, SingleWavelengthIsRayleigh) {
  const std::vector<double> nm = {550.0}, one = {1.0};
  const auto xyz = ColourIntegrator(nm, unit, ColourObserver::kCie1931).xyz(one, one);
  const auto all =
      every_nanometre(ColourObserver::kCie1931, [](double l) { return std::pow(550.0 / l, 4); });
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(xyz[c] / all[c], 1.0, 1e-12);
}

TEST(ColourIntegrator, WeightsAreNotNegative) {
  const auto nm = even_wavelengths(280.0, 1000.0, 64);
  const ColourIntegrator integrator(nm, unit, ColourObserver::kCie1964);
  for (const auto& w : integrator.weights()) {
    for (double value : w) EXPECT_GE(value, 0.0);
  }
}

TEST(ColourIntegrator, IsLinearInRadiance) {
  const auto nm = even_wavelengths(380.0, 780.0, 9);
  const std::vector<double> solar(9, 1.7), a = {1, 2, 3, 4, 5, 4, 3, 2, 1};
  std::vector<double> b(9, 0.5), sum(9);
  for (std::size_t i = 0; i < 9; ++i) sum[i] = 2.0 * a[i] + b[i];
  const ColourIntegrator integrator(nm, unit, ColourObserver::kCie1931);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(integrator.xyz(sum, solar)[c],
                2.0 * integrator.xyz(a, solar)[c] + integrator.xyz(b, solar)[c], 1e-12);
  }
}

// Paper Sec. 4.7: 8 wavelengths 380..720 nm and 16 look alike. Here: Rayleigh
// scattering seen through 10 air masses of Rayleigh air, tau = 0.00879 (lambda/um)^-4.09
// (Leckner 1978), as at 5 deg above the horizon. Linear
// interpolation is of second order in the step.
TEST(ColourIntegrator, EightSixteenAndEightyOneConverge) {
  const auto sky = [](double l) {
    const double tau = 0.00879 * std::pow(l / 1000.0, -4.09);
    return std::pow(500.0 / l, 4) * std::exp(-10.0 * tau);
  };
  const auto from = [&](int count, double last_nm) {
    const auto nm = even_wavelengths(380.0, last_nm, count);
    std::vector<double> radiance, solar(nm.size(), 1.0);
    for (double l : nm) radiance.push_back(sky(l));
    return ColourIntegrator(nm, unit, ColourObserver::kCie1931).xyz(radiance, solar);
  };
  const auto exact = every_nanometre(ColourObserver::kCie1931, sky);
  struct Error {
    double component = 0.0;  // relative, the worst of X, Y, Z
    double xy = 0.0;         // distance in the chromaticity diagram
  };
  const auto error = [&](const Tristimulus& xyz) {
    Error e;
    for (std::size_t c = 0; c < 3; ++c) {
      e.component = std::max(e.component, std::abs(xyz[c] / exact[c] - 1.0));
    }
    const auto a = chromaticity(xyz), b = chromaticity(exact);
    e.xy = std::hypot(a[0] - b[0], a[1] - b[1]);
    return e;
  };
  const Error eight = error(from(8, 720.0)), sixteen = error(from(16, 780.0)),
              many = error(from(81, 780.0));
  EXPECT_LT(eight.component, 0.04);
  EXPECT_LT(eight.xy, 0.005);
  EXPECT_LT(sixteen.component, 0.012);
  EXPECT_LT(sixteen.xy, 0.002);
  EXPECT_LT(many.component, 0.001);
  // The bounds ColourIntegrator documents. Steps of 48.6, 26.7 and 5 nm.
  EXPECT_NEAR(eight.component / sixteen.component, std::pow(48.57 / 26.67, 2), 0.5);
}

TEST(ColourIntegrator, RefusesBadInput) {
  const std::vector<double> none, falling = {500.0, 400.0}, two = {400.0, 500.0}, one = {1.0};
  const std::vector<double> dark = {1.0, 0.0}, light = {1.0, 1.0};
  const auto make = [](const std::vector<double>& nm) {
    return ColourIntegrator(nm, unit, ColourObserver::kCie1931);
  };
  EXPECT_THROW(make(none), std::invalid_argument);
  EXPECT_THROW(make(falling), std::invalid_argument);
  EXPECT_THROW(ColourIntegrator(
                   two, [](double) { return -1.0; }, ColourObserver::kCie1931),
               std::invalid_argument);
  EXPECT_THROW(make(two).xyz(one, light), std::invalid_argument);
  EXPECT_THROW(make(two).xyz(light, dark), std::invalid_argument);
}

TEST(Rec709, WhiteIsOneOneOne) {
  const double x = 0.3127, y = 0.3290;  // ITU-R BT.709-6: D65
  const auto rgb = linear_rec709({x / y, 1.0, (1.0 - x - y) / y});
  for (double c : rgb) EXPECT_NEAR(c, 1.0, 1e-14);
}

// IEC 61966-2-1: Y = 0.2126 R + 0.7152 G + 0.0722 B, and the XYZ of the primaries to 4 digits.
TEST(Rec709, MatrixMatchesPublishedDigits) {
  const double published[3][3] = {
      {0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(xyz_from_rec709()[r][c], published[r][c], 6e-5);
  }
}

TEST(Rec709, MatricesAreInverse) {
  const Tristimulus xyz = {0.2, 0.5, 0.9};
  const auto rgb = linear_rec709(xyz);
  for (std::size_t r = 0; r < 3; ++r) {
    double back = 0.0;
    for (std::size_t c = 0; c < 3; ++c) back += xyz_from_rec709()[r][c] * rgb[c];
    EXPECT_NEAR(back, xyz[r], 1e-15);
  }
}

TEST(Gamut, MappingKeepsLuminanceAndHueDirection) {
  const auto violet = linear_rec709(colour_matching(ColourObserver::kCie1931, 440.0));
  const double luminance = rec709_luminance(violet);
  const auto mapped = into_gamut(violet);
  EXPECT_TRUE(mapped.moved);
  EXPECT_NEAR(rec709_luminance(mapped.rgb), luminance, 1e-15);
  EXPECT_EQ(*std::min_element(mapped.rgb.begin(), mapped.rgb.end()), 0.0);
  const double kept = (mapped.rgb[0] - luminance) / (violet[0] - luminance);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(mapped.rgb[c] - luminance, kept * (violet[c] - luminance), 1e-13);
  }
  EXPECT_GT(kept, 0.0);
  EXPECT_LT(kept, 1.0);
}

TEST(Gamut, ColoursInsideStay) {
  const LinearRgb inside = {0.0, 0.4, 17.0};
  EXPECT_FALSE(into_gamut(inside).moved);
  EXPECT_EQ(into_gamut(inside).rgb, inside);
  EXPECT_EQ(into_gamut({-1.0, 0.0, 0.0}).rgb, (LinearRgb{0.0, 0.0, 0.0}));
  EXPECT_THROW(into_gamut({std::numeric_limits<double>::infinity(), 0.0, 0.0}),
               std::invalid_argument);
}

// SI: 1 W/m^2 of light near 540 THz (555 nm) is 683 lux.
TEST(Photometry, OneWattAtFiveHundredFiftyFive) {
  const std::vector<double> nm = {554.0, 555.0, 556.0}, line = {0.0, 1.0, 0.0}, solar(3, 1.0);
  const ColourIntegrator integrator(nm, unit, ColourObserver::kCie1931);
  EXPECT_NEAR(illuminance_lux(integrator, line, solar), 683.0, 1e-9);
  EXPECT_THROW(luminance_cd_m2(ColourIntegrator(nm, unit, ColourObserver::kCie1964), line, solar),
               std::invalid_argument);
}

}  // namespace
}  // namespace twilight
