#include "output/fit_file.h"

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

namespace twilight {
namespace {

using Json = nlohmann::ordered_json;

Json error_json(const FitError& e) {
  return {{"rms", e.rms}, {"p95", e.p95}, {"largest", e.largest}, {"bias", e.bias}};
}

// [node][channel].
template <class Cell>
Json per_node(std::size_t nodes, std::size_t channels, Cell cell) {
  Json all = Json::array();
  for (std::size_t n = 0; n < nodes; ++n) {
    Json row = Json::array();
    for (std::size_t c = 0; c < channels; ++c) row.push_back(cell(n, c));
    all.push_back(std::move(row));
  }
  return all;
}

Json search_json(const ChannelFit& c) {
  return {{"relative_error", error_json(c.error)}, {"rms_of_logarithms", c.fit.rms_log},
          {"bounds_hit", c.fit.bounds_hit},        {"converged", c.fit.converged},
          {"termination", c.fit.termination},      {"iterations", c.fit.iterations},
          {"gradient_norm", c.fit.gradient_norm},  {"start", c.fit.start}};
}

// One member of the outermost object; arrays of nodes get a line per node.
std::string member_text(const std::string& name, const Json& value) {
  std::string text = Json(name).dump() + ": ";
  if (!value.is_array() || value.empty() || !value.front().is_structured()) {
    return text + value.dump();
  }
  text += "[\n";
  for (std::size_t k = 0; k < value.size(); ++k) {
    text += "  " + value[k].dump() + (k + 1 < value.size() ? ",\n" : "\n");
  }
  return text + "]";
}

}  // namespace

std::string fit_json(const SkyFit& fit, const std::string& version) {
  const FitCoefficients& c = fit.coefficients;
  const std::size_t N = c.nodes(), C = c.channels(), W = c.wavelength_nm.size();
  const std::size_t K = coefficient_count(c.form);
  const bool spectral = c.quantity == FitQuantity::kSpectral;
  std::vector<std::string> letters;
  for (std::size_t k = 0; k < K; ++k) letters.push_back(coefficient_name(k));
  Json axes = Json::array();
  for (const FitAxis& axis : c.axes) axes.push_back({{"key", axis.key}, {"values", axis.values}});
  Json luminance = Json::array(), converged = Json::array(), nodes = Json::array();
  for (std::size_t n = 0; n < N; ++n) {
    luminance.push_back(error_json(fit.luminance[n]));
    converged.push_back(static_cast<bool>(c.converged[n]));
    Json values = Json::array();
    for (std::size_t a = 0; a < c.axes.size(); ++a) values.push_back(c.axis_value(n, a));
    nodes.push_back(std::move(values));
  }
  const std::vector<std::pair<std::string, Json>> members = {
      {"format", kFitFormat},
      {"format_version", kFitFormatVersion},
      {"software", version},
      {"form", std::string(sky_form_name(c.form))},
      {"formula", std::string(sky_form_text(c.form))},
      {"quantity", std::string(fit_quantity_name(c.quantity))},
      {"channels", fit.channel_names},
      {"unit", spectral ? Json("W m^-2 sr^-1 nm^-1") : Json({"cd m^-2", "1", "1"})},
      {"coefficient_names", letters},
      {"axes", std::move(axes)},
      {"nodes", std::move(nodes)},
      {"wavelengths_nm", c.wavelength_nm},
      {"solar_spectrum", c.solar_spectrum},
      {"solar_irradiance_w_m2_nm", c.solar_irradiance},
      {"coefficients", per_node(N, C,
                                [&](std::size_t n, std::size_t k) {
                                  const auto all = c.coefficients_at(n, k);
                                  return Json(std::vector<double>(all.begin(), all.end()));
                                })},
      {"normalisation",
       per_node(N, C, [&](std::size_t n, std::size_t k) { return c.normalisation[n * C + k]; })},
      {"sun_transmittance",
       per_node(N, W,
                [&](std::size_t n, std::size_t w) { return c.sun_transmittance[n * W + w]; })},
      {"converged", std::move(converged)},
      {"luminance_relative_error", std::move(luminance)},
      {"goodness", per_node(N, C,
                            [&](std::size_t n, std::size_t k) {
                              return search_json(fit.channels[n * C + k]);
                            })},
      {"scene", fit.scene_toml},
  };
  std::string text = "{\n";
  for (std::size_t k = 0; k < members.size(); ++k) {
    text += member_text(members[k].first, members[k].second);
    text += k + 1 < members.size() ? ",\n" : "\n";
  }
  return text + "}\n";
}

void write_fit(AtomicFile& file, const SkyFit& fit, const std::string& version) {
  file.write(fit_json(fit, version));
}

}  // namespace twilight
