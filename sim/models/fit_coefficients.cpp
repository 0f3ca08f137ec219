#include "sim/models/fit_coefficients.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "sim/models/hosek.h"
#include "sim/models/perez.h"

namespace twilight {
namespace {

using Json = nlohmann::json;
constexpr double kPi = std::numbers::pi;
constexpr std::size_t kMostNodes = 1000000000;

/// A place in a JSON document that knows its name.
class Place {
 public:
  Place(const std::string& file, const Json& json, std::string pointer = {})
      : file_(file), json_(json), pointer_(std::move(pointer)) {}

  [[noreturn]] void fail(std::string_view must_be) const {
    constexpr std::size_t kLongest = 60;
    std::string shown = json_.is_structured() ? json_.type_name() : json_.dump();
    if (shown.size() > kLongest) shown = shown.substr(0, kLongest) + "...";
    throw std::invalid_argument(fmt::format("{}: {} = {}: must be {}", file_,
                                            pointer_.empty() ? "/" : pointer_, shown, must_be));
  }
  void require(bool holds, std::string_view must_be) const {
    if (!holds) fail(must_be);
  }
  Place member(const std::string& name) const {
    require(json_.is_object(), "an object");
    const auto it = json_.find(name);
    if (it == json_.end()) {
      throw std::invalid_argument(fmt::format("{}: {}/{} is missing", file_, pointer_, name));
    }
    return {file_, *it, pointer_ + "/" + name};
  }
  std::string text() const {
    require(json_.is_string(), "a string");
    return json_.get<std::string>();
  }
  double number(double low, double high, std::string_view must_be) const {
    require(json_.is_number(), must_be);
    const double value = json_.get<double>();
    require(value >= low && value <= high, must_be);
    return value;
  }
  bool truth() const {
    require(json_.is_boolean(), "true or false");
    return json_.get<bool>();
  }
  /// Every element of an array; `size` 0: one or more.
  void each(std::size_t size, const std::function<void(const Place&)>& look) const {
    require(json_.is_array() && !json_.empty() && (size == 0 || json_.size() == size),
            size == 0 ? "an array of one or more" : fmt::format("an array of {}", size));
    for (std::size_t k = 0; k < json_.size(); ++k) {
      look({file_, json_[k], fmt::format("{}/{}", pointer_, k)});
    }
  }
  std::vector<double> numbers(std::size_t size, double low, double high,
                              std::string_view must_be) const {
    std::vector<double> values;
    each(size, [&](const Place& p) { values.push_back(p.number(low, high, must_be)); });
    return values;
  }
  std::vector<double> increasing(double low, double high, const std::string& range) const {
    std::vector<double> values;
    each(0, [&](const Place& p) {
      const double value = p.number(low, high, range);
      p.require(values.empty() || value > values.back(), range + ", above the one before");
      values.push_back(value);
    });
    return values;
  }

 private:
  const std::string& file_;
  const Json& json_;
  std::string pointer_;
};

constexpr double kHuge = 1e30;

template <class Enum, class Named>
Enum enum_at(const Place& place, Named from_name) {
  try {
    return from_name(place.text());
  } catch (const std::invalid_argument& error) {
    place.fail(error.what());
  }
}

void read_axes(const Place& root, FitCoefficients& fit) {
  bool sun = false;
  root.member("axes").each(0, [&](const Place& axis) {
    FitAxis read{axis.member("key").text(), {}};
    const bool is_sun = read.key == kSunElevationKey;
    read.values = is_sun ? axis.member("values").increasing(-90, 90, "a number in -90..90")
                         : axis.member("values").increasing(-kHuge, kHuge, "a finite number");
    const bool again =
        std::ranges::any_of(fit.axes, [&](const FitAxis& a) { return a.key == read.key; });
    axis.member("key").require(!again, "a key that is not an axis already");
    sun = sun || is_sun;
    fit.axes.push_back(std::move(read));
  });
  root.member("axes").require(sun, fmt::format("axes with one of key \"{}\"", kSunElevationKey));
}

void read_nodes(const Place& root, FitCoefficients& fit) {
  const std::size_t N = fit.nodes(), C = fit.channels(), K = coefficient_count(fit.form);
  root.member("coefficients").each(N, [&](const Place& node) {
    node.each(C, [&](const Place& channel) {
      const auto k = channel.numbers(K, -kHuge, kHuge, "a finite number");
      channel.require(sky_form_is_positive(fit.form, k),
                      "coefficients of a form that is positive everywhere");
      fit.coefficients.insert(fit.coefficients.end(), k.begin(), k.end());
    });
  });
  root.member("normalisation").each(N, [&](const Place& node) {
    const auto values = node.numbers(C, 1e-300, kHuge, "a number above 0");
    fit.normalisation.insert(fit.normalisation.end(), values.begin(), values.end());
  });
  root.member("sun_transmittance").each(N, [&](const Place& node) {
    const auto values = node.numbers(fit.wavelength_nm.size(), 0, 1, "a number in 0..1");
    fit.sun_transmittance.insert(fit.sun_transmittance.end(), values.begin(), values.end());
  });
  root.member("converged").each(N, [&](const Place& node) {
    fit.converged.push_back(node.truth());
  });
  for (std::size_t k = 0; k < N * C; ++k) {
    const double scale = fit.scale(k / C, k % C);
    if (std::isfinite(scale) && scale > 0) continue;
    root.member("normalisation")
        .fail(fmt::format("such that node {}, channel {}, is finite", k / C, k % C));
  }
}

}  // namespace

std::string_view sky_form_name(SkyForm form) { return form == SkyForm::kPerez ? "perez" : "hosek"; }

SkyForm sky_form_from_name(std::string_view name) {
  if (name == "perez") return SkyForm::kPerez;
  if (name == "hosek") return SkyForm::kHosek;
  throw std::invalid_argument("one of \"perez\", \"hosek\"");
}

std::size_t coefficient_count(SkyForm form) { return form == SkyForm::kPerez ? 5 : 9; }

std::string coefficient_name(std::size_t k) { return {static_cast<char>('A' + k)}; }

std::string_view sky_form_text(SkyForm form) {
  if (form == SkyForm::kPerez) {
    return "value = normalisation * F(theta, gamma) / F(0, theta_s); F(theta, gamma) = (1 + A * "
           "exp(B / max(cos(theta), 1e-4))) * (1 + C * exp(D * gamma) + E * cos(gamma)^2); theta: "
           "zenith angle of the view, theta_s: of the Sun (90 degrees less sun.elevation_deg, "
           "above "
           "90 when it is down), gamma: angle between view and Sun, radians";
  }
  return "value = normalisation * F(theta, gamma); F(theta, gamma) = (1 + A * exp(B / (cos(theta) "
         "+ "
         "0.01))) * (C + D * exp(E * gamma) + F * cos(gamma)^2 + G * chi(H, gamma) + I * "
         "sqrt(cos(theta))); chi(H, gamma) = (1 + cos(gamma)^2) / (1 + H^2 - 2 * H * "
         "cos(gamma))^1.5; theta: zenith angle of the view, gamma: angle between view and Sun, "
         "radians";
}

double sky_form_value(SkyForm form, std::span<const double> k, double cos_zenith,
                      double sun_angle_rad) {
  if (form == SkyForm::kPerez) {
    return perez({k[0], k[1], k[2], k[3], k[4]}, cos_zenith, sun_angle_rad);
  }
  return hosek({k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8]}, cos_zenith, sun_angle_rad);
}

bool sky_form_is_positive(SkyForm form, std::span<const double> k) {
  // Towards the horizon the exponent only falls, so that the first factor is least at the zenith
  // where a < 0.
  const double at_zenith = k[0] * std::exp(k[1] / (form == SkyForm::kPerez ? 1.0 : 1.01));
  if (!(k[1] <= 0 && at_zenith > -1 && std::isfinite(at_zenith))) return false;
  constexpr double kSteepest = 100;  // e^(100 pi) is finite
  if (form == SkyForm::kPerez) return k[2] >= 0 && k[4] > -1 && std::abs(k[3]) <= kSteepest;
  const double c = k[2], d = k[3], e = k[4], f = k[5], g = k[6], h = k[7], i = k[8];
  if (!(d >= 0 && std::abs(e) <= kSteepest && g >= 0 && h >= 0 && h < 1 && i >= 0)) return false;
  const double least = c + d * std::exp(std::min(e, 0.0) * kPi);
  return least > 0 && least + f > 0;
}

std::string_view fit_quantity_name(FitQuantity quantity) {
  return quantity == FitQuantity::kSpectral ? "spectral" : "luminance-chromaticity";
}

FitQuantity fit_quantity_from_name(std::string_view name) {
  if (name == "spectral") return FitQuantity::kSpectral;
  if (name == "luminance-chromaticity") return FitQuantity::kLuminanceChromaticity;
  throw std::invalid_argument("one of \"spectral\", \"luminance-chromaticity\"");
}

std::size_t FitCoefficients::nodes() const {
  std::size_t count = 1;
  for (const FitAxis& axis : axes) {
    // More than any file holds: kept from wrapping.
    count = axis.values.size() > kMostNodes / count ? kMostNodes : count * axis.values.size();
  }
  return count;
}

std::size_t FitCoefficients::channels() const {
  return quantity == FitQuantity::kSpectral ? wavelength_nm.size() : 3;
}

double FitCoefficients::axis_value(std::size_t node, std::size_t axis) const {
  for (std::size_t a = axes.size(); a-- > axis + 1;) node /= axes[a].values.size();
  return axes[axis].values[node % axes[axis].values.size()];
}

double FitCoefficients::sun_zenith_rad(std::size_t node) const {
  const auto sun = std::ranges::find(axes, kSunElevationKey, &FitAxis::key);
  const auto axis = static_cast<std::size_t>(sun - axes.begin());
  return (90.0 - axis_value(node, axis)) * kPi / 180;
}

std::span<const double> FitCoefficients::coefficients_at(std::size_t node,
                                                         std::size_t channel) const {
  const std::size_t K = coefficient_count(form);
  return std::span(coefficients).subspan((node * channels() + channel) * K, K);
}

double FitCoefficients::scale(std::size_t node, std::size_t channel) const {
  const double at = normalisation[node * channels() + channel];
  if (form == SkyForm::kHosek) return at;
  return at / sky_form_value(form, coefficients_at(node, channel), 1.0, sun_zenith_rad(node));
}

double FitCoefficients::value(std::size_t node, std::size_t channel, double cos_zenith,
                              double sun_angle_rad) const {
  return scale(node, channel) *
         sky_form_value(form, coefficients_at(node, channel), cos_zenith, sun_angle_rad);
}

FitCoefficients read_fit_coefficients(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) {
    throw std::runtime_error(fmt::format("{}: cannot read this file of coefficients", name));
  }
  Json json;
  try {
    json = Json::parse(stream);
  } catch (const Json::exception& error) {
    throw std::invalid_argument(fmt::format("{}: is not JSON: {}", name, error.what()));
  }
  const Place root(name, json);
  const Place format = root.member("format");
  format.require(format.text() == kFitFormat, fmt::format("\"{}\"", kFitFormat));
  root.member("format_version")
      .number(kFitFormatVersion, kFitFormatVersion, fmt::format("{}", kFitFormatVersion));
  FitCoefficients fit;
  fit.form = enum_at<SkyForm>(root.member("form"), sky_form_from_name);
  fit.quantity = enum_at<FitQuantity>(root.member("quantity"), fit_quantity_from_name);
  read_axes(root, fit);
  fit.wavelength_nm =
      root.member("wavelengths_nm").increasing(100, 10000, "a number in 100..10000");
  fit.solar_spectrum = root.member("solar_spectrum").text();
  fit.solar_irradiance = root.member("solar_irradiance_w_m2_nm")
                             .numbers(fit.wavelength_nm.size(), 1e-300, kHuge, "a number above 0");
  read_nodes(root, fit);
  return fit;
}

}  // namespace twilight
