#include "aerosols/component_phase.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <stdexcept>
#include <string>

#include "aerosols/amplitude_sum.h"
#include "aerosols/mie.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kHalfPi = 0.5 * std::numbers::pi;

// Steps of the angle grid: 5 % of the angle between the two limits.
constexpr double kSmallestStep_deg = 0.02;
constexpr double kLargestStep_deg = 1.0;
constexpr double kRelativeStep = 0.05;

// Angles from 0 up to, and without, 90 degrees.
std::vector<double> forward_angles_rad() {
  std::vector<double> angle_deg = {0.0};
  while (true) {
    const double last = angle_deg.back();
    const double next =
        last + std::clamp(kRelativeStep * last, kSmallestStep_deg, kLargestStep_deg);
    if (next > 90.0 - 0.5 * kLargestStep_deg) break;
    angle_deg.push_back(next);
  }
  std::vector<double> angle_rad;
  for (const double a : angle_deg) angle_rad.push_back(a * kRadPerDeg);
  return angle_rad;
}

std::vector<double> cosines_to_90_deg() {
  std::vector<double> cosine;
  for (const double a : forward_angles_rad()) cosine.push_back(std::cos(a));
  cosine.push_back(0.0);
  return cosine;
}

double wave_number_per_um(double wavelength_nm) {
  return 2.0 * std::numbers::pi / (wavelength_nm * 1e-3);
}

// Orders of the largest sphere, with some to spare.
std::size_t orders_needed(double largest_radius_um, double wavelength_nm) {
  const double x = wave_number_per_um(wavelength_nm) * largest_radius_um;
  return static_cast<std::size_t>(x + 4.05 * std::cbrt(x) + 6.0);
}

// Elements of the scattering matrix summed over particles, in any unit.
struct MatrixSum {
  double f11 = 0.0, f12 = 0.0, f33 = 0.0, f34 = 0.0;

  void add(double particles, double s1_re, double s1_im, double s2_re, double s2_im) {
    const double perpendicular = s1_re * s1_re + s1_im * s1_im;
    const double parallel = s2_re * s2_re + s2_im * s2_im;
    f11 += particles * 0.5 * (parallel + perpendicular);
    f12 += particles * 0.5 * (parallel - perpendicular);
    f33 += particles * (s1_re * s2_re + s1_im * s2_im);
    f34 += particles * (s2_im * s1_re - s2_re * s1_im);
  }
};

void add(const PairedAmplitudes& s, std::span<const double> particles, MatrixSum& at_angle,
         MatrixSum& at_supplement) {
  for (std::size_t i = 0; i < particles.size(); ++i) {
    at_angle.add(particles[i], s.s1_even_re[i] + s.s1_odd_re[i], s.s1_even_im[i] + s.s1_odd_im[i],
                 s.s2_even_re[i] + s.s2_odd_re[i], s.s2_even_im[i] + s.s2_odd_im[i]);
    at_supplement.add(particles[i], s.s1_even_re[i] - s.s1_odd_re[i],
                      s.s1_even_im[i] - s.s1_odd_im[i], s.s2_even_re[i] - s.s2_odd_re[i],
                      s.s2_even_im[i] - s.s2_odd_im[i]);
  }
}

PhaseMatrix normalised(const std::vector<MatrixSum>& sum) {
  if (!std::ranges::any_of(sum, [](const MatrixSum& s) { return s.f11 > 0.0; })) {
    throw std::invalid_argument("the size distribution holds no particles that scatter");
  }
  PhaseMatrix phase;
  const std::span<const double> angles = phase_angles_rad();
  phase.angle_rad.assign(angles.begin(), angles.end());
  for (const MatrixSum& s : sum) {
    phase.p11.push_back(s.f11);
    phase.p12.push_back(s.f12);
    phase.p33.push_back(s.f33);
    phase.p34.push_back(s.f34);
  }
  // Straight forward and backward S1 = S2 and S1 = -S2; rounding must not say otherwise.
  phase.p12.front() = phase.p12.back() = phase.p34.front() = phase.p34.back() = 0.0;
  phase.p33.front() = phase.p11.front();
  phase.p33.back() = -phase.p11.back();
  const double scale = 1.0 / phase_normalisation(phase);
  for (auto* p : {&phase.p11, &phase.p12, &phase.p33, &phase.p34}) {
    for (double& value : *p) value *= scale;
  }
  return phase;
}

PhaseMatrix integrate(const SizeDistribution& sizes, std::complex<double> m, double wavelength_nm,
                      const AngularFunctions& functions, int radii_per_efold) {
  const double wave_number = wave_number_per_um(wavelength_nm);
  const double log_span = std::log(sizes.largest_radius_um / sizes.smallest_radius_um);
  const int radii = static_cast<int>(std::ceil(log_span * radii_per_efold));
  const double step = log_span / radii;

  const std::size_t half = functions.angles() - 1;
  std::vector<MatrixSum> sum(2 * half + 1);
  std::vector<MieSeries> series;
  std::vector<double> particles;
  for (int i = 0; i < radii; ++i) {
    const double radius_um = sizes.smallest_radius_um * std::exp((i + 0.5) * step);
    series.push_back(mie_series(wave_number * radius_um, m));
    particles.push_back(sizes.per_log_radius(radius_um));
    if (series.size() < kSpheresTogether && i + 1 < radii) continue;
    const std::vector<PairedAmplitudes> amplitudes = paired_amplitudes(functions, series);
    for (std::size_t j = 0; j < half; ++j) {
      add(amplitudes[j], particles, sum[j], sum[2 * half - j]);
    }
    MatrixSum again;  // 90 degrees is its own supplement
    add(amplitudes[half], particles, sum[half], again);
    series.clear();
    particles.clear();
  }
  return normalised(sum);
}

}  // namespace

std::span<const double> phase_angles_rad() {
  static const std::vector<double> angles = [] {
    std::vector<double> grid = forward_angles_rad();
    const std::size_t half = grid.size();
    grid.push_back(kHalfPi);
    for (std::size_t j = half; j-- > 0;) grid.push_back(std::numbers::pi - grid[j]);
    return grid;
  }();
  return angles;
}

int phase_radii_per_efold(AerosolComponent component) {
  switch (component) {
    case AerosolComponent::kSeaSaltCoarse:
      return 3000;
    case AerosolComponent::kSeaSaltAccumulation:
      return 1600;
    default:
      return 300;
  }
}

PhaseMatrix integrate_component_phase(const ComponentState& state, double wavelength_nm,
                                      int radii_per_efold) {
  if (radii_per_efold < 1) {
    throw std::invalid_argument("radii per e-fold " + std::to_string(radii_per_efold) +
                                " must be at least 1");
  }
  const std::complex<double> m = refractive_index(state, wavelength_nm);  // checks the wavelength
  const AngularFunctions functions(cosines_to_90_deg(),
                                   orders_needed(state.sizes.largest_radius_um, wavelength_nm));
  return integrate(state.sizes, m, wavelength_nm, functions, radii_per_efold);
}

std::vector<PhaseMatrix> sphere_phases(std::span<const SpheresAtWavelength> wanted) {
  std::size_t orders = 0;
  for (const SpheresAtWavelength& w : wanted) {
    require_sizes(w.sizes);
    if (w.radii_per_efold < 1) {
      throw std::invalid_argument("radii per e-fold " + std::to_string(w.radii_per_efold) +
                                  " must be at least 1");
    }
    if (!(w.wavelength_nm > 0.0)) {
      throw std::invalid_argument("wavelength " + std::to_string(w.wavelength_nm) +
                                  " nm must be above 0");
    }
    // Checks the range of radii and index before the tables of their orders are made.
    mie_efficiencies(wave_number_per_um(w.wavelength_nm) * w.sizes.largest_radius_um, w.index);
    orders = std::max(orders, orders_needed(w.sizes.largest_radius_um, w.wavelength_nm));
  }
  const AngularFunctions functions(cosines_to_90_deg(), orders);
  std::vector<PhaseMatrix> result(wanted.size());
  tbb::parallel_for(std::size_t{0}, wanted.size(), [&](std::size_t i) {
    const SpheresAtWavelength& w = wanted[i];
    result[i] = integrate(w.sizes, w.index, w.wavelength_nm, functions, w.radii_per_efold);
  });
  return result;
}

std::vector<PhaseMatrix> component_phases(std::span<const StateAtWavelength> wanted) {
  std::vector<SpheresAtWavelength> spheres;
  for (const StateAtWavelength& w : wanted) {
    if (w.state >= kComponentStates) {
      throw std::invalid_argument("component state " + std::to_string(w.state) + " must be below " +
                                  std::to_string(kComponentStates));
    }
    const ComponentState& state = component_states()[w.state];
    spheres.push_back({state.sizes, refractive_index(state, w.wavelength_nm), w.wavelength_nm,
                       phase_radii_per_efold(state.component)});
  }
  return sphere_phases(spheres);
}

double phase_normalisation(const PhaseMatrix& phase) {
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < phase.angle_rad.size(); ++i) {
    const double a = phase.angle_rad[i], b = phase.angle_rad[i + 1];
    const double slope = (phase.p11[i + 1] - phase.p11[i]) / (b - a);
    sum += phase.p11[i] * std::cos(a) - phase.p11[i + 1] * std::cos(b) +
           slope * (std::sin(b) - std::sin(a));
  }
  return 0.5 * sum;
}

double phase_asymmetry(const PhaseMatrix& phase) {
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < phase.angle_rad.size(); ++i) {
    const double a = phase.angle_rad[i], b = phase.angle_rad[i + 1];
    const double slope = (phase.p11[i + 1] - phase.p11[i]) / (b - a);
    sum += 0.25 * (phase.p11[i] * std::cos(2.0 * a) - phase.p11[i + 1] * std::cos(2.0 * b)) +
           0.125 * slope * (std::sin(2.0 * b) - std::sin(2.0 * a));
  }
  return 0.5 * sum / phase_normalisation(phase);
}

}  // namespace twilight
