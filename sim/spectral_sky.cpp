#include "sim/spectral_sky.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace twilight {

SpectralInterpolation::SpectralInterpolation(std::span<const double> solved_nm,
                                             std::span<const double> wanted_nm)
    : solved_(solved_nm.size()) {
  if (solved_nm.empty()) throw std::invalid_argument("no wavelength was solved");
  for (const double nm : wanted_nm) {
    if (nm < solved_nm.front() || nm > solved_nm.back()) {
      throw std::invalid_argument("a wavelength lies beyond those that were solved");
    }
    Stencil s;
    const auto above = static_cast<std::size_t>(std::ranges::upper_bound(solved_nm, nm) -
                                                solved_nm.begin());  // at least 1
    s.below = above - 1;
    if (solved_nm[s.below] == nm) {
      s.first = s.below;
      stencils_.push_back(s);
      continue;
    }
    s.fraction = (nm - solved_nm[s.below]) / (solved_nm[above] - solved_nm[s.below]);
    s.count = std::min<std::size_t>(4, solved_);
    s.first = std::min(s.below > 0 ? s.below - 1 : 0, solved_ - s.count);
    for (std::size_t i = 0; i < s.count; ++i) {
      s.weight[i] = 1;
      for (std::size_t k = 0; k < s.count; ++k) {
        if (k == i) continue;
        const double own = solved_nm[s.first + i], other = solved_nm[s.first + k];
        s.weight[i] *= (nm - other) / (own - other);
      }
    }
    stencils_.push_back(s);
  }
}

void SpectralInterpolation::logarithmic(std::span<const double> values,
                                        std::span<double> out) const {
  for (std::size_t w = 0; w < stencils_.size(); ++w) {
    const Stencil& s = stencils_[w];
    if (s.count == 1) {
      out[w] = values[s.first];
      continue;
    }
    double sum = 0;
    bool positive = true;
    for (std::size_t i = 0; i < s.count; ++i) {
      positive = positive && values[s.first + i] > 0;
      if (positive) sum += s.weight[i] * std::log(values[s.first + i]);
    }
    out[w] = positive ? std::exp(sum) : std::lerp(values[s.below], values[s.below + 1], s.fraction);
  }
}

void SpectralInterpolation::plain(std::span<const double> values, std::span<double> out) const {
  for (std::size_t w = 0; w < stencils_.size(); ++w) {
    const Stencil& s = stencils_[w];
    out[w] = 0;
    for (std::size_t i = 0; i < s.count; ++i) out[w] += s.weight[i] * values[s.first + i];
  }
}

SpectralSky::SpectralSky(std::unique_ptr<Sky> solved, std::vector<double> wavelength_nm,
                         std::vector<double> solar_irradiance)
    : solved_(std::move(solved)),
      wavelength_nm_(std::move(wavelength_nm)),
      solar_irradiance_(std::move(solar_irradiance)),
      interpolation_(solved_->wavelength_nm(), wavelength_nm_) {}

// [spectrum][solved wavelength] to [spectrum][wavelength].
std::vector<double> SpectralSky::per_sunlight(const std::vector<double>& values) const {
  const std::size_t from = interpolation_.solved(), to = interpolation_.wanted();
  const std::span<const double> sun = solved_->solar_irradiance();
  std::vector<double> out(values.size() / from * to), ratio(from);
  for (std::size_t v = 0; v * from < values.size(); ++v) {
    for (std::size_t w = 0; w < from; ++w) ratio[w] = values[v * from + w] / sun[w];
    const std::span<double> spectrum(&out[v * to], to);
    interpolation_.logarithmic(ratio, spectrum);
    for (std::size_t w = 0; w < to; ++w) spectrum[w] *= solar_irradiance_[w];
  }
  return out;
}

std::vector<double> SpectralSky::radiance(std::span<const ViewDirection> views) const {
  return per_sunlight(solved_->radiance(views));
}

std::vector<double> SpectralSky::map_radiance(std::span<const ViewDirection> views) const {
  return per_sunlight(solved_->map_radiance(views));
}

StokesRadiance SpectralSky::stokes(std::span<const ViewDirection> views) const {
  const StokesRadiance light = solved_->stokes(views);
  const std::size_t from = interpolation_.solved(), to = interpolation_.wanted();
  StokesRadiance out;
  out.i = per_sunlight(light.i);
  const auto shares = [&](const std::vector<double>& values) {
    std::vector<double> result(values.empty() ? 0 : out.i.size()), share(from);
    for (std::size_t v = 0; v * from < values.size(); ++v) {
      for (std::size_t w = 0; w < from; ++w) {
        const double i = light.i[v * from + w];
        share[w] = i > 0 ? values[v * from + w] / i : 0.0;
      }
      interpolation_.plain(share, std::span(&result[v * to], to));
      for (std::size_t w = 0; w < to; ++w) result[v * to + w] *= out.i[v * to + w];
    }
    return result;
  };
  out.q = shares(light.q);
  out.u = shares(light.u);
  out.standard_error = shares(light.standard_error);
  for (double& error : out.standard_error) error = std::max(error, 0.0);
  // Interpolation must not polarise light by more than itself.
  for (std::size_t k = 0; k < out.q.size(); ++k) {
    const double p = std::hypot(out.q[k], out.u[k]);
    if (p <= out.i[k]) continue;
    out.q[k] *= out.i[k] / p;
    out.u[k] *= out.i[k] / p;
  }
  return out;
}

Irradiance SpectralSky::irradiance() const {
  const Irradiance parts = solved_->irradiance();
  return {per_sunlight(parts.direct), per_sunlight(parts.diffuse)};
}

std::vector<double> SpectralSky::sun_transmittance() const {
  std::vector<double> out(interpolation_.wanted());
  interpolation_.logarithmic(solved_->sun_transmittance(), out);
  return out;
}

std::optional<AerialLight> SpectralSky::aerial_light(const ViewDirection& view,
                                                     double distance_km) const {
  std::optional<AerialLight> light = solved_->aerial_light(view, distance_km);
  if (!light) return light;
  std::vector<double> transmittance(interpolation_.wanted());
  interpolation_.logarithmic(light->transmittance, transmittance);
  return AerialLight{std::move(transmittance), per_sunlight(light->inscattered)};
}

std::unique_ptr<Sky> SpectralSky::with_sun_at(double sun_elevation_rad) const {
  std::unique_ptr<Sky> other = solved_->with_sun_at(sun_elevation_rad);
  if (!other) return nullptr;
  return std::make_unique<SpectralSky>(std::move(other), wavelength_nm_, solar_irradiance_);
}

}  // namespace twilight
