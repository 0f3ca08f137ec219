#include "aerosols/imported_phase.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>

#include "aerosols/component_phase.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kEndTolerance_rad = 1e-3 * kRadPerDeg;
constexpr std::size_t kMostMoments = 5001;

std::string shown(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

void check_angles(PhaseMatrix& phase, const RefuseElement& refuse) {
  std::vector<double>& angle = phase.angle_rad;
  if (angle.size() < 2) refuse("angle", "must be two or more");
  for (std::size_t i = 0; i < angle.size(); ++i) {
    if (!std::isfinite(angle[i])) refuse("angle", "must be finite");
    if (i > 0 && !(angle[i] > angle[i - 1])) {
      refuse("angle", shown(angle[i] / kRadPerDeg) + " degrees after " +
                          shown(angle[i - 1] / kRadPerDeg) + ": must increase strictly");
    }
  }
  if (std::abs(angle.front()) > kEndTolerance_rad) {
    refuse("angle", "begins at " + shown(angle.front() / kRadPerDeg) + ": must begin at 0 degrees");
  }
  if (std::abs(angle.back() - std::numbers::pi) > kEndTolerance_rad) {
    refuse("angle", "ends at " + shown(angle.back() / kRadPerDeg) + ": must end at 180 degrees");
  }
  angle.front() = 0.0;
  angle.back() = std::numbers::pi;
}

}  // namespace

void normalise_imported(PhaseMatrix& phase, const RefuseElement& refuse) {
  check_angles(phase, refuse);
  const std::pair<std::string_view, std::vector<double>*> elements[] = {
      {"p11", &phase.p11}, {"p12", &phase.p12}, {"p33", &phase.p33}, {"p34", &phase.p34}};
  for (const auto& [name, values] : elements) {
    if (values->size() != phase.angle_rad.size()) {
      refuse(name, "has " + std::to_string(values->size()) + " values for " +
                       std::to_string(phase.angle_rad.size()) + " angles");
    }
    for (const double value : *values) {
      if (!std::isfinite(value)) refuse(name, "holds a value that is not finite");
    }
  }
  for (double& value : phase.p11) {
    if (value < -kPhaseBelowZero) {
      refuse("p11", "is " + shown(value) + ": must not be negative (swings of a series cut short " +
                        "down to " + shown(-kPhaseBelowZero) + " count as 0)");
    }
    value = std::max(value, 0.0);
  }
  const double norm = phase_normalisation(phase);
  if (!(std::abs(norm - 1.0) <= kPhaseNormalisationTolerance)) {
    refuse("p11", "has the mean " + shown(norm) + " over the sphere: must be 1 within " +
                      shown(kPhaseNormalisationTolerance));
  }
  for (const auto& [name, values] : elements) {
    for (double& value : *values) value /= norm;
  }
  for (std::size_t i = 0; i < phase.p11.size(); ++i) {
    const double other = std::hypot(phase.p12[i], phase.p33[i], phase.p34[i]);
    if (other <= phase.p11[i]) continue;
    if (other > phase.p11[i] * (1.0 + kPhaseBeyondP11) + kPhaseBelowZero) {
      refuse("p12, p33, p34", "have the length " + shown(other) + " at " +
                                  shown(phase.angle_rad[i] / kRadPerDeg) +
                                  " degrees: must not exceed p11, " + shown(phase.p11[i]));
    }
    for (auto* p : {&phase.p12, &phase.p33, &phase.p34}) (*p)[i] *= phase.p11[i] / other;
  }
}

std::vector<double> unpolarised_p33(std::span<const double> angle_rad,
                                    std::span<const double> p11) {
  std::vector<double> p33;
  for (std::size_t i = 0; i < p11.size(); ++i) {
    const double c = std::cos(angle_rad[i]);
    p33.push_back(p11[i] * 2.0 * c / (1.0 + c * c));
  }
  return p33;
}

PhaseMatrix phase_of_moments(const std::array<std::vector<double>, 4>& moments,
                             const RefuseElement& refuse) {
  constexpr std::string_view kNames[] = {"p11", "p12", "p33", "p34"};
  PhaseMatrix phase;
  const std::span<const double> angles = phase_angles_rad();
  phase.angle_rad.assign(angles.begin(), angles.end());
  std::vector<double>* const elements[] = {&phase.p11, &phase.p12, &phase.p33, &phase.p34};
  for (std::size_t e = 0; e < moments.size(); ++e) {
    const std::vector<double>& series = moments[e];
    if (e == 0 && series.empty()) refuse("p11", "has no moments");
    if (series.size() > kMostMoments) refuse(kNames[e], "has more than 5001 moments");
    for (const double moment : series) {
      if (!std::isfinite(moment)) refuse(kNames[e], "has a moment that is not finite");
    }
    for (const double angle : angles) {
      const double x = std::cos(angle);
      double sum = 0.0, before = 0.0, here = 1.0;  // P_{l-1}, P_l
      for (std::size_t l = 0; l < series.size(); ++l) {
        sum += series[l] * here;
        const double n = static_cast<double>(l);
        const double next = ((2.0 * n + 1.0) * x * here - n * before) / (n + 1.0);
        before = std::exchange(here, next);
      }
      elements[e]->push_back(sum);
    }
  }
  if (moments[1].empty() && moments[2].empty() && moments[3].empty()) {
    phase.p33 = unpolarised_p33(phase.angle_rad, phase.p11);
  }
  normalise_imported(phase, refuse);
  return phase;
}

void require_particle_optics(const ParticleOptics& optics, const std::string& file) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument(file + ": " + what);
  };
  const std::vector<double>& humidity = optics.relative_humidity_percent;
  const std::vector<double>& wavelength = optics.wavelength_nm;
  if (humidity.empty() || wavelength.empty()) refuse("has no humidity or no wavelength");
  for (std::size_t i = 0; i < humidity.size(); ++i) {
    if (!(humidity[i] >= 0.0 && humidity[i] <= 99.0)) {
      refuse("relative humidity " + shown(humidity[i]) + " %: must be 0..99");
    }
    if (i > 0 && !(humidity[i] > humidity[i - 1])) {
      refuse("relative humidity " + shown(humidity[i]) + " % after " + shown(humidity[i - 1]) +
             ": must increase strictly");
    }
  }
  for (std::size_t i = 0; i < wavelength.size(); ++i) {
    if (!(wavelength[i] > (i == 0 ? 0.0 : wavelength[i - 1])) || !std::isfinite(wavelength[i])) {
      refuse("wavelength " + shown(wavelength[i]) + " nm: must be above 0 and the one before");
    }
  }
  const std::size_t size = humidity.size() * wavelength.size();
  if (optics.optics.size() != size) refuse("has not one set of coefficients per state");
  if (!optics.phase.empty() && optics.phase.size() != size) {
    refuse("has not one scattering matrix per state");
  }
  for (std::size_t i = 0; i < size; ++i) {
    const ComponentOptics& o = optics.optics[i];
    const std::string where = " at " + shown(wavelength[i % wavelength.size()]) + " nm and " +
                              shown(humidity[i / wavelength.size()]) + " % humidity";
    for (const auto& [name, value] :
         {std::pair{"scattering", o.scattering_per_km}, {"absorption", o.absorption_per_km}}) {
      if (!(value >= 0.0 && std::isfinite(value))) {
        refuse(std::string(name) + " coefficient " + shown(value) + where + ": must be 0 or above");
      }
    }
    if (!(o.extinction_per_km() > 0.0)) refuse("extinction" + where + ": must be above 0");
    if (!(std::abs(o.asymmetry) < 1.0)) {
      refuse("asymmetry " + shown(o.asymmetry) + where + ": must be within (-1, 1)");
    }
    if (optics.phase.empty() || o.scattering_per_km == 0.0) continue;
    const double mean_cosine = phase_asymmetry(optics.phase[i]);
    if (!(std::abs(mean_cosine - o.asymmetry) <= kAsymmetryTolerance)) {
      refuse("asymmetry " + shown(o.asymmetry) + where + ": must be the phase function's " +
             shown(mean_cosine) + " within " + shown(kAsymmetryTolerance));
    }
  }
}

ParticleOptics joined_humidities(std::vector<ParticleOptics> tables, const std::string& file) {
  if (tables.empty()) throw std::invalid_argument(file + ": holds no table");
  std::ranges::sort(tables, {},
                    [](const ParticleOptics& t) { return t.relative_humidity_percent.front(); });
  ParticleOptics all = std::move(tables.front());
  for (std::size_t i = 1; i < tables.size(); ++i) {
    ParticleOptics& t = tables[i];
    if (t.wavelength_nm != all.wavelength_nm || t.per != all.per ||
        t.phase.empty() != all.phase.empty()) {
      throw std::invalid_argument(
          file + ": the files of " + shown(all.relative_humidity_percent.front()) + " % and " +
          shown(t.relative_humidity_percent.front()) +
          " % humidity: must have the same wavelengths and kind of coefficients");
    }
    const auto append = [](auto& to, auto& from) {
      to.insert(to.end(), std::make_move_iterator(from.begin()),
                std::make_move_iterator(from.end()));
    };
    append(all.relative_humidity_percent, t.relative_humidity_percent);
    append(all.optics, t.optics);
    append(all.phase, t.phase);
  }
  require_particle_optics(all, file);
  return all;
}

}  // namespace twilight
