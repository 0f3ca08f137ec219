// Prints the refit of Preetham's experiment as Markdown: coefficients beside the published ones,
// and how far three models are from the simulated skies.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <exception>
#include <numbers>
#include <string>
#include <vector>

#include "sim/quality.h"
#include "tests/validation/preetham_refit.h"

namespace {

namespace v = twilight::validation;
using twilight::FitError;
using v::LinearCoefficients;
using v::RefitSky;

constexpr const char* kChannels[] = {"Y", "x", "y"};

double zenith_rad(const RefitSky& s) { return (90 - s.sun_elevation_deg) * std::numbers::pi / 180; }

const std::vector<double>& channel_of(const RefitSky& s, std::size_t c) {
  return c == 0 ? s.sky.luminance : c == 1 ? s.sky.x : s.sky.y;
}

FitError scaled_error(std::vector<double> form, double scale, const std::vector<double>& value) {
  for (double& f : form) f *= scale;
  return twilight::fit_error(form, value);
}

/// rms errors of one sky's channel: shapes at their best scale, and with formulas for the zenith.
struct Errors {
  double published_shape = 0, linear_shape = 0, own_shape = 0;
  double published = 0, linear = 0;
  double published_bias = 0, linear_bias = 0;
};

Errors errors_of(const RefitSky& s, std::size_t c, const LinearCoefficients& linear,
                 const v::ZenithFit& zenith) {
  const double theta = zenith_rad(s);
  const std::vector<double>& value = channel_of(s, c);
  const auto published_k = v::at_turbidity(v::published_coefficients(c), s.turbidity);
  const auto linear_k = v::at_turbidity(linear, s.turbidity);
  const auto published = v::form_over_views(published_k, theta);
  const auto ours = v::form_over_views(linear_k, theta);
  const auto z = twilight::preetham_zenith(s.turbidity, theta);
  const double their_zenith = c == 0 ? z.luminance_cd_m2 : c == 1 ? z.x : z.y;
  const double our_zenith = v::zenith_value(zenith, c, s.turbidity, theta);
  const FitError their_model =
      scaled_error(published, their_zenith / twilight::perez(published_k, 1, theta), value);
  const FitError our_model =
      scaled_error(ours, our_zenith / twilight::perez(linear_k, 1, theta), value);
  auto samples = twilight::fit_samples(theta);
  for (std::size_t k = 0; k < samples.size(); ++k) samples[k].value = value[k];
  const auto own = twilight::fit_form(twilight::SkyForm::kPerez, samples, theta);
  const twilight::PerezCoefficients own_k = {own.coefficients[0], own.coefficients[1],
                                             own.coefficients[2], own.coefficients[3],
                                             own.coefficients[4]};
  return {scaled_error(published, v::best_scale(published, value), value).rms,
          scaled_error(ours, v::best_scale(ours, value), value).rms,
          scaled_error(v::form_over_views(own_k, theta),
                       own.normalisation / twilight::perez(own_k, 1, theta), value)
              .rms,
          their_model.rms,
          our_model.rms,
          their_model.bias,
          our_model.bias};
}

void print_coefficients(const std::array<LinearCoefficients, 3>& ours) {
  fmt::print("| | published | ours |\n|---|---|---|\n");
  for (std::size_t c = 0; c < 3; ++c) {
    const LinearCoefficients theirs = v::published_coefficients(c);
    for (std::size_t i = 0; i < 5; ++i) {
      fmt::print("| {}_{} | {:+.4f} T {:+.4f} | {:+.4f} T {:+.4f} |\n", static_cast<char>('A' + i),
                 kChannels[c], theirs[i][0], theirs[i][1], ours[c][i][0], ours[c][i][1]);
    }
  }
}

void print_zenith(const v::ZenithFit& z) {
  fmt::print("\nY_z = ({:.4f} T {:+.4f}) tan chi {:+.4f} T {:+.4f} K cd/m2\n", z.luminance[0],
             z.luminance[1], z.luminance[2], z.luminance[3]);
  for (const auto* k : {&z.x, &z.y}) {
    fmt::print("{}_z:", k == &z.x ? "x" : "y");
    for (std::size_t i = 0; i < 12; ++i) {
      fmt::print("{}{:+.4f}", i % 4 == 0 && i > 0 ? ";  " : " ", (*k)[i]);
    }
    fmt::print("\n");
  }
}

// A row per Sun: root mean square over the turbidities, per cent.
void print_errors(const std::vector<RefitSky>& skies,
                  const std::array<LinearCoefficients, 3>& linear, const v::ZenithFit& zenith) {
  for (std::size_t c = 0; c < 3; ++c) {
    fmt::print(
        "\n{}, rms relative error in %, over T = 2..6\n\n| Sun, deg | shape, published | "
        "shape, ours linear in T | shape, ours per sky | model, published (bias) | model, ours "
        "linear in T (bias) |\n|---|---|---|---|---|---|\n",
        kChannels[c]);
    std::vector<double> suns = v::refit_suns_deg();
    suns.push_back(-1);  // all
    for (const double sun : suns) {
      Errors sum;
      double n = 0;
      for (const RefitSky& s : skies) {
        if (sun >= 0 && s.sun_elevation_deg != sun) continue;
        const Errors e = errors_of(s, c, linear[c], zenith);
        const auto add = [](double& total, double value) { total += value * value; };
        add(sum.published_shape, e.published_shape);
        add(sum.linear_shape, e.linear_shape);
        add(sum.own_shape, e.own_shape);
        add(sum.published, e.published);
        add(sum.linear, e.linear);
        sum.published_bias += e.published_bias;
        sum.linear_bias += e.linear_bias;
        ++n;
      }
      const auto rms = [&](double total) { return 100 * std::sqrt(total / n); };
      fmt::print("| {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} ({:+.1f}) | {:.1f} ({:+.1f}) |\n",
                 sun >= 0 ? fmt::format("{}", sun) : "all", rms(sum.published_shape),
                 rms(sum.linear_shape), rms(sum.own_shape), rms(sum.published),
                 100 * sum.published_bias / n, rms(sum.linear), 100 * sum.linear_bias / n);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Preetham's experiment with this program's skies");
  std::string aerosol = "continental_average", quality = "fair";
  int orders = 0;
  app.add_option("--aerosol", aerosol, "OPAC type of the haze")->capture_default_str();
  app.add_option("--quality", quality, "of the simulation")->capture_default_str();
  app.add_option("--orders", orders, "scattering orders; 2 is what they took, 0 is all");
  CLI11_PARSE(app, argc, argv);
  try {
    twilight::Scene scene;
    scene.sun.elevation_deg = 45;
    scene.aerosols.type = aerosol;
    scene.solver.method = "orders";
    scene.spectrum.wavelengths_nm = {380, 420, 460, 500, 540, 580, 620, 660, 700, 740, 780};
    twilight::apply_quality(
        twilight::quality_level(quality), [](std::string_view) { return true; }, scene.solver);
    if (orders > 0) scene.solver.scattering_orders = orders;
    const auto skies = v::refit_skies(
        scene,
        {[](std::string_view stage, double) { fmt::print(stderr, "{} ...\n", stage); }, nullptr});
    std::array<LinearCoefficients, 3> linear;
    bool all = true;
    for (std::size_t c = 0; c < 3; ++c) {
      bool converged = false;
      linear[c] = v::fit_linear_in_turbidity(skies, c, converged);
      if (!converged) fmt::print("The search for {} did not converge.\n", kChannels[c]);
      all = all && converged;
    }
    print_coefficients(linear);
    const v::ZenithFit zenith = v::fit_zenith(skies, linear);
    print_zenith(zenith);
    print_errors(skies, linear, zenith);
    return all ? 0 : 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "preetham_refit: {}\n", error.what());
    return 2;
  }
}
