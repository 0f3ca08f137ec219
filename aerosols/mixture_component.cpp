#include "aerosols/mixture_component.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "aerosols/component_mie.h"
#include "aerosols/henyey_greenstein.h"
#include "aerosols/imported_phase.h"

namespace twilight {
namespace {

// Radii per e-fold of an own component's efficiencies: within 0.1 % of kRadiiPerEfold.
constexpr int kOwnRadiiPerEfold = 600;

// Dry matter, g cm^-3 (Hess, Koepke & Schult 1998, Table 1c), in the order of AerosolComponent.
constexpr std::array<double, kAerosolComponents> kOpacDensity_g_cm3 = {2.0, 1.8, 1.0, 2.2, 2.2,
                                                                       2.6, 2.6, 2.6, 2.6, 1.7};
constexpr double kOpacMassRadius_um = 7.5;  // theirs counts no larger particles

// 1 um^3 cm^-3 of 1 g cm^-3 is 1 ug m^-3.
double mass_ug_per_m3(double volume_um3, double density_g_cm3) {
  return volume_um3 * density_g_cm3;
}

// Integral of r^power dN, um^power.
double moment(const SizeDistribution& sizes, int power) {
  constexpr int kSteps = 4000;
  const double step = std::log(sizes.largest_radius_um / sizes.smallest_radius_um) / kSteps;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double radius_um = sizes.smallest_radius_um * std::exp((i + 0.5) * step);
    sum += std::pow(radius_um, power) * sizes.per_log_radius(radius_um);
  }
  return sum * step;
}

class OpacComponent : public MixtureComponent {
 public:
  explicit OpacComponent(AerosolComponent component)
      : component_(component), states_(component_states(component)) {
    for (const ComponentState& s : states_) humidities_.push_back(s.relative_humidity_percent);
    const LognormalSizeDistribution& dry = states_.front().sizes;
    mass_ = mass_ug_per_m3(4.0 / 3.0 * std::numbers::pi * dry.moment(3.0, kOpacMassRadius_um),
                           kOpacDensity_g_cm3.at(static_cast<std::size_t>(component)));
    coarse_ = dry.moment(3.0, 1e9) >= kCoarseEffectiveRadius_um * dry.moment(2.0, 1e9);
  }

  std::string_view name() const override { return component_code(component_); }
  std::string_view identity() const override { return name(); }
  std::span<const double> humidities_percent() const override { return humidities_; }
  bool coarse() const override { return coarse_; }
  std::optional<double> dry_mass_ug_per_m3() const override { return mass_; }
  std::optional<ComponentOptics> tabulated(double humidity, double wavelength_nm) const override {
    return component_optics(component_, humidity, wavelength_nm);
  }
  SpheresAtWavelength spheres(std::size_t state, double wavelength_nm) const override {
    const ComponentState& s = states_[state];
    return {s.sizes, refractive_index(s, wavelength_nm), wavelength_nm,
            phase_radii_per_efold(component_)};
  }

 private:
  AerosolComponent component_;
  std::span<const ComponentState> states_;
  std::vector<double> humidities_;
  double mass_ = 0.0;
  bool coarse_ = false;
};

class OwnComponent : public MixtureComponent {
 public:
  explicit OwnComponent(Microphysics m) : m_(std::move(m)) {
    require_sizes(m_.sizes);
    if (m_.index.wavelength_nm.empty()) {
      throw std::invalid_argument("the refractive index of '" + m_.name + "' has no wavelengths");
    }
    if (m_.humidity_percent.empty()) {
      m_.humidity_percent = {0.0};
      m_.radius_growth_factor = {1.0};
    }
    check_growth();
    const double cubes = moment(m_.sizes, 3), squares = moment(m_.sizes, 2);
    effective_radius_um_ = cubes / squares;
    volume_um3_ = 4.0 / 3.0 * std::numbers::pi * cubes;
    identity_ = fmt::format("own {} | {} {} {} | {} {}", m_.sizes_text,
                            fmt::join(m_.index.wavelength_nm, ","), fmt::join(m_.index.real, ","),
                            fmt::join(m_.index.imaginary, ","), fmt::join(m_.humidity_percent, ","),
                            fmt::join(m_.radius_growth_factor, ","));
  }

  std::string_view name() const override { return m_.name; }
  std::string_view identity() const override { return identity_; }
  std::span<const double> humidities_percent() const override { return m_.humidity_percent; }
  bool coarse() const override { return effective_radius_um_ >= kCoarseEffectiveRadius_um; }
  std::optional<double> dry_mass_ug_per_m3() const override {
    if (!(m_.density_g_cm3 > 0.0)) return std::nullopt;
    return mass_ug_per_m3(volume_um3_, m_.density_g_cm3);
  }
  std::optional<ComponentOptics> tabulated(double, double) const override { return std::nullopt; }

  ComponentOptics integrate(std::size_t state, double wavelength_nm) const override {
    const SpheresAtWavelength wet = spheres(state, wavelength_nm);
    return integrate_spheres(wet.sizes, wet.index, wavelength_nm, kOwnRadiiPerEfold);
  }

  SpheresAtWavelength spheres(std::size_t state, double wavelength_nm) const override {
    const double growth = m_.radius_growth_factor[state];
    const auto& known_nm = m_.index.wavelength_nm;
    if (!(wavelength_nm >= known_nm.front() && wavelength_nm <= known_nm.back())) {
      throw std::invalid_argument(
          fmt::format("component '{}': wavelength {} nm is outside its refractive index, {}..{} nm",
                      m_.name, wavelength_nm, known_nm.front(), known_nm.back()));
    }
    const std::complex<double> dry = m_.index.at(wavelength_nm);
    SpheresAtWavelength s{m_.sizes, dry, wavelength_nm, 300};
    if (growth > 1.0) {
      const auto per_log_radius = m_.sizes.per_log_radius;
      s.sizes = {
          [per_log_radius, growth](double radius) { return per_log_radius(radius / growth); },
          m_.sizes.smallest_radius_um * growth, m_.sizes.largest_radius_um * growth};
      const std::complex<double> water = water_refractive_index().at(wavelength_nm);
      s.index = water + (dry - water) / (growth * growth * growth);
    }
    // As phase_radii_per_efold(): interference in large transparent spheres averages slowly.
    constexpr double kTransparent = 1e-3;
    const double radius = effective_radius_um_ * growth;
    if (-s.index.imag() < kTransparent && radius > kCoarseEffectiveRadius_um) {
      s.radii_per_efold = radius > 3.0 ? 3000 : 1600;
    }
    return s;
  }

 private:
  void check_growth() const {
    const std::vector<double>&at = m_.humidity_percent, &factor = m_.radius_growth_factor;
    if (at.size() != factor.size() || at.front() != 0.0 || factor.front() != 1.0) {
      throw std::invalid_argument(fmt::format(
          "growth of '{}' has {} humidities and {} factors: must have as many of both, 0 % with "
          "factor 1 first",
          m_.name, at.size(), factor.size()));
    }
    for (std::size_t i = 1; i < at.size(); ++i) {
      if (!(at[i] > at[i - 1] && at[i] <= kTableLargestHumidity_percent)) {
        throw std::invalid_argument(
            fmt::format("growth humidity {} % of '{}' must be above the one before it and at most "
                        "{} %",
                        at[i], m_.name, kTableLargestHumidity_percent));
      }
      if (!(factor[i] >= factor[i - 1] && factor[i] <= 10.0)) {
        throw std::invalid_argument(fmt::format(
            "growth factor {} of '{}' must be at least the one before it and at most 10", factor[i],
            m_.name));
      }
    }
  }

  Microphysics m_;
  double effective_radius_um_ = 0.0, volume_um3_ = 0.0;
  std::string identity_;
};

void scale(PhaseMatrix& phase, double factor) {
  for (auto* p : {&phase.p11, &phase.p12, &phase.p33, &phase.p34}) {
    for (double& value : *p) value *= factor;
  }
}

PhaseMatrix henyey_greenstein_matrix(double asymmetry) {
  PhaseMatrix phase;
  const std::span<const double> angles = phase_angles_rad();
  phase.angle_rad.assign(angles.begin(), angles.end());
  for (const double angle : angles) {
    const double c = std::cos(angle);
    const double p11 = 4.0 * std::numbers::pi * henyey_greenstein(c, asymmetry);
    phase.p11.push_back(p11);
  }
  phase.p12.assign(angles.size(), 0.0);
  phase.p33 = unpolarised_p33(phase.angle_rad, phase.p11);
  phase.p34.assign(angles.size(), 0.0);
  scale(phase, 1.0 / phase_normalisation(phase));
  return phase;
}

// On phase_angles_rad(), linear between the matrix's own angles, normalised again.
PhaseMatrix on_our_angles(const PhaseMatrix& from) {
  const std::span<const double> angles = phase_angles_rad();
  if (std::ranges::equal(from.angle_rad, angles)) return from;
  PhaseMatrix to;
  to.angle_rad.assign(angles.begin(), angles.end());
  const auto& grid = from.angle_rad;
  for (const double angle : angles) {
    const auto above = std::upper_bound(grid.begin() + 1, grid.end() - 1, angle);
    const auto i = static_cast<std::size_t>(above - grid.begin()) - 1;
    const double t = std::clamp((angle - grid[i]) / (grid[i + 1] - grid[i]), 0.0, 1.0);
    to.p11.push_back(std::lerp(from.p11[i], from.p11[i + 1], t));
    to.p12.push_back(std::lerp(from.p12[i], from.p12[i + 1], t));
    to.p33.push_back(std::lerp(from.p33[i], from.p33[i + 1], t));
    to.p34.push_back(std::lerp(from.p34[i], from.p34[i + 1], t));
  }
  scale(to, 1.0 / phase_normalisation(to));
  return to;
}

class TableComponent : public MixtureComponent {
 public:
  TableComponent(ParticleOptics table, std::string content)
      : table_(std::move(table)), identity_("table " + std::move(content)) {
    const std::size_t cells = table_.relative_humidity_percent.size() * table_.wavelength_nm.size();
    if (cells == 0 || table_.optics.size() != cells ||
        (!table_.phase.empty() && table_.phase.size() != cells)) {
      throw std::invalid_argument("the tables of '" + table_.name +
                                  "' must have a value for every humidity and wavelength");
    }
  }

  std::string_view name() const override { return table_.name; }
  std::string_view identity() const override { return identity_; }
  OpticsPer per() const override { return table_.per; }
  std::span<const double> humidities_percent() const override {
    return table_.relative_humidity_percent;
  }

  bool coarse() const override {
    const auto& nm = table_.wavelength_nm;
    const double blue = std::clamp(440.0, nm.front(), nm.back());
    const double red = std::clamp(870.0, nm.front(), nm.back());
    if (!(red > blue)) return false;
    const double ratio =
        at_state(0, blue).extinction_per_km() / at_state(0, red).extinction_per_km();
    return std::log(ratio) / std::log(red / blue) < 1.0;
  }

  std::optional<double> dry_mass_ug_per_m3() const override {
    if (!(table_.dry_mass_ug_per_m3 > 0.0)) return std::nullopt;
    return table_.dry_mass_ug_per_m3;
  }

  std::optional<ComponentOptics> tabulated(double humidity, double wavelength_nm) const override {
    const std::vector<double>& percents = table_.relative_humidity_percent;
    const HumidityClasses c = humidity_classes(percents, humidity);
    const ComponentOptics low = at_state(c.low, wavelength_nm);
    if (c.low == c.high) return low;
    return between_humidities(low, at_state(c.high, wavelength_nm), c.fraction,
                              percents[c.low] == 0.0);
  }

  std::optional<PhaseMatrix> tabulated_phase(std::size_t state,
                                             double wavelength_nm) const override {
    if (table_.phase.empty()) {
      return henyey_greenstein_matrix(at_state(state, wavelength_nm).asymmetry);
    }
    const auto [i, t] = wavelength_interval(wavelength_nm);
    PhaseMatrix low = on_our_angles(table_.phase[table_.index(state, i)]);
    if (t == 0.0) return low;
    const PhaseMatrix high = on_our_angles(table_.phase[table_.index(state, i + 1)]);
    for (std::size_t a = 0; a < low.angle_rad.size(); ++a) {
      low.p11[a] = std::lerp(low.p11[a], high.p11[a], t);
      low.p12[a] = std::lerp(low.p12[a], high.p12[a], t);
      low.p33[a] = std::lerp(low.p33[a], high.p33[a], t);
      low.p34[a] = std::lerp(low.p34[a], high.p34[a], t);
    }
    return low;
  }

 private:
  std::pair<std::size_t, double> wavelength_interval(double wavelength_nm) const {
    const auto& grid = table_.wavelength_nm;
    if (!(wavelength_nm >= grid.front() && wavelength_nm <= grid.back())) {
      throw std::invalid_argument(
          fmt::format("wavelength {} nm is outside the table of '{}', {}..{} "
                      "nm",
                      wavelength_nm, table_.name, grid.front(), grid.back()));
    }
    if (grid.size() == 1) return {0, 0.0};
    const auto above = std::upper_bound(grid.begin() + 1, grid.end() - 1, wavelength_nm);
    const auto i = static_cast<std::size_t>(above - grid.begin()) - 1;
    return {i, (wavelength_nm - grid[i]) / (grid[i + 1] - grid[i])};
  }

  ComponentOptics at_state(std::size_t state, double wavelength_nm) const {
    const auto [i, t] = wavelength_interval(wavelength_nm);
    const ComponentOptics& low = table_.optics[table_.index(state, i)];
    if (t == 0.0) return low;
    const ComponentOptics& high = table_.optics[table_.index(state, i + 1)];
    return {.scattering_per_km = std::lerp(low.scattering_per_km, high.scattering_per_km, t),
            .absorption_per_km = std::lerp(low.absorption_per_km, high.absorption_per_km, t),
            .asymmetry = std::lerp(low.asymmetry, high.asymmetry, t)};
  }

  ParticleOptics table_;
  std::string identity_;
};

}  // namespace

ComponentOptics MixtureComponent::integrate(std::size_t, double) const {
  throw std::logic_error("the optics of this component are tabulated");
}

std::optional<PhaseMatrix> MixtureComponent::tabulated_phase(std::size_t, double) const {
  return std::nullopt;
}

SpheresAtWavelength MixtureComponent::spheres(std::size_t, double) const {
  throw std::logic_error("the scattering matrices of this component are tabulated");
}

std::shared_ptr<const MixtureComponent> opac_component(AerosolComponent component) {
  return std::make_shared<OpacComponent>(component);
}

std::shared_ptr<const MixtureComponent> find_opac_component(std::string_view code) {
  for (std::size_t i = 0; i < kAerosolComponents; ++i) {
    const auto component = static_cast<AerosolComponent>(i);
    if (component_code(component) == code) return opac_component(component);
  }
  return nullptr;
}

std::shared_ptr<const MixtureComponent> own_component(Microphysics microphysics) {
  return std::make_shared<OwnComponent>(std::move(microphysics));
}

std::shared_ptr<const MixtureComponent> table_component(ParticleOptics table, std::string content) {
  return std::make_shared<TableComponent>(std::move(table), std::move(content));
}

std::complex<double> RefractiveIndexTable::at(double nm) const {
  const auto& grid = wavelength_nm;
  if (grid.empty() || !(nm >= grid.front() && nm <= grid.back())) {
    throw std::invalid_argument(
        grid.empty() ? "a refractive index has no wavelengths"
                     : fmt::format("wavelength {} nm is outside the refractive index, {}..{} nm",
                                   nm, grid.front(), grid.back()));
  }
  if (grid.size() == 1) return {real[0], -imaginary[0]};
  const auto above = std::upper_bound(grid.begin() + 1, grid.end() - 1, nm);
  const auto i = static_cast<std::size_t>(above - grid.begin());
  const double t = (nm - grid[i - 1]) / (grid[i] - grid[i - 1]);
  return {std::lerp(real[i - 1], real[i], t), -std::lerp(imaginary[i - 1], imaginary[i], t)};
}

double effective_radius_um(const SizeDistribution& sizes) {
  return moment(sizes, 3) / moment(sizes, 2);
}

const RefractiveIndexTable& water_refractive_index() {
  static const RefractiveIndexTable table = {
      {250, 275, 300, 325, 350, 375, 400, 425, 450, 475, 500, 525, 550, 575, 600, 625,
       650, 675, 700, 725, 750, 775, 800, 825, 850, 875, 900, 925, 950, 975, 1000},
      {1.362, 1.354, 1.349, 1.346, 1.343, 1.341, 1.339, 1.338, 1.337, 1.336, 1.335,
       1.334, 1.333, 1.333, 1.332, 1.332, 1.331, 1.331, 1.331, 1.330, 1.330, 1.330,
       1.329, 1.329, 1.329, 1.328, 1.328, 1.328, 1.327, 1.327, 1.327},
      {3.35e-8, 2.35e-8,  1.60e-8, 1.08e-8, 6.50e-9, 3.50e-9, 1.86e-9, 1.30e-9,
       1.02e-9, 9.35e-10, 1.00e-9, 1.32e-9, 1.96e-9, 3.60e-9, 1.09e-8, 1.39e-8,
       1.64e-8, 2.23e-8,  3.35e-8, 9.15e-8, 1.56e-7, 1.48e-7, 1.25e-7, 1.82e-7,
       2.93e-7, 3.91e-7,  4.86e-7, 1.06e-6, 2.93e-6, 3.48e-6, 2.89e-6}};
  return table;
}

}  // namespace twilight
