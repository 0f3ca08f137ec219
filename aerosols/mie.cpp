#include "aerosols/mie.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

using Complex = std::complex<double>;

// The library's complex operators test for NaN and infinity, which costs most of the time
// here and is not needed: every operand is finite and far from overflow.
Complex product(Complex a, Complex b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

Complex quotient(Complex a, Complex b) {
  const double inverse_norm = 1.0 / (b.real() * b.real() + b.imag() * b.imag());
  return {(a.real() * b.real() + a.imag() * b.imag()) * inverse_norm,
          (a.imag() * b.real() - a.real() * b.imag()) * inverse_norm};
}

// Real part of a b*.
double real_overlap(Complex a, Complex b) { return a.real() * b.real() + a.imag() * b.imag(); }

double squared_modulus(Complex a) { return real_overlap(a, a); }

void check(double x, Complex m) {
  if (!(x >= kMieSmallestSizeParameter && x <= kMieLargestSizeParameter)) {
    throw std::invalid_argument("Mie size parameter " + std::to_string(x) +
                                " is outside 1e-4..1e4");
  }
  if (!(m.real() > 0.0 && m.real() <= 20.0)) {
    throw std::invalid_argument("real refractive index " + std::to_string(m.real()) +
                                " is outside (0, 20]");
  }
  if (!(m.imag() <= 0.0 && m.imag() >= -20.0)) {
    throw std::invalid_argument("absorption index k = " + std::to_string(-m.imag()) +
                                " of m = n - i k is outside 0..20");
  }
}

// Logarithmic derivative D_n(z) = psi_n'(z) / psi_n(z) for n = 0..orders (B&H Eq. 4.89).
// Downward recurrence converges where n > |z|, so it starts far enough above |z|: the
// memory of the start value dies over a few |z|^(1/3), the width of the turning region.
std::vector<Complex> logarithmic_derivative(Complex z, std::size_t orders) {
  const double modulus = std::abs(z);
  const double start = std::max(static_cast<double>(orders), modulus) + 8.0 * std::cbrt(modulus);
  const auto first = static_cast<std::size_t>(start) + 16;
  const Complex inverse_z = quotient({1.0, 0.0}, z);

  std::vector<Complex> derivative(orders + 1);
  Complex d = static_cast<double>(first + 1) * inverse_z;
  for (std::size_t n = first; n >= 1; --n) {
    const Complex n_over_z = static_cast<double>(n) * inverse_z;
    d = n_over_z - quotient({1.0, 0.0}, d + n_over_z);  // now D_(n-1)
    if (n - 1 <= orders) derivative[n - 1] = d;
  }
  return derivative;
}

// Riccati-Bessel psi_n(x), n = 0..orders, by downward recurrence of psi_n / psi_(n-1).
// For x < 1, where upward recurrence would cancel and where sin x is a safe anchor.
std::vector<double> small_argument_psi(double x, std::size_t orders) {
  std::vector<double> ratio(orders + 1);
  double r = 0.0;
  for (std::size_t n = orders + 12; n >= 1; --n) {
    r = 1.0 / (static_cast<double>(2 * n + 1) / x - r);
    if (n <= orders) ratio[n] = r;
  }
  std::vector<double> psi(orders + 1);
  psi[0] = std::sin(x);
  for (std::size_t n = 1; n <= orders; ++n) psi[n] = ratio[n] * psi[n - 1];
  return psi;
}

std::vector<MieAmplitudes> amplitudes(const MieSeries& series, std::span<const double> cos_angle) {
  std::vector<MieAmplitudes> result;
  result.reserve(cos_angle.size());
  for (const double mu : cos_angle) {
    if (!(mu >= -1.0 && mu <= 1.0)) {
      throw std::invalid_argument("cosine of the scattering angle " + std::to_string(mu) +
                                  " is outside -1..1");
    }
    Complex s1, s2;
    double pi_before = 0.0, pi_n = 1.0;  // angular functions, B&H Eq. 4.47
    for (std::size_t i = 0; i < series.a.size(); ++i) {
      const double n = static_cast<double>(i + 1);
      const double tau_n = n * mu * pi_n - (n + 1.0) * pi_before;
      const double weight = (2.0 * n + 1.0) / (n * (n + 1.0));
      s1 += weight * (series.a[i] * pi_n + series.b[i] * tau_n);
      s2 += weight * (series.a[i] * tau_n + series.b[i] * pi_n);
      const double pi_next = ((2.0 * n + 1.0) * mu * pi_n - (n + 1.0) * pi_before) / n;
      pi_before = pi_n;
      pi_n = pi_next;
    }
    result.push_back({s1, s2});
  }
  return result;
}

}  // namespace

MieSeries mie_series(double x, Complex m_n_minus_ik) {
  check(x, m_n_minus_ik);
  // Bohren & Huffman write m = n + i k.
  const Complex m(m_n_minus_ik.real(), -m_n_minus_ik.imag());
  const auto orders = static_cast<std::size_t>(x + 4.05 * std::cbrt(x) + 3.0);

  const std::vector<Complex> d = logarithmic_derivative(x * m, orders);
  const Complex inverse_m = quotient({1.0, 0.0}, m);
  const bool small = x < 1.0;
  const std::vector<double> psi_table =
      small ? small_argument_psi(x, orders) : std::vector<double>();

  // chi in B&H's sign: chi_0 = cos x, xi = psi - i chi. It grows with n, so upward is stable.
  // psi upward for x >= 1: its error grows as chi does and drops out of a_n, b_n ~ psi / chi.
  double psi_before = std::cos(x), psi = std::sin(x);
  double chi_before = -std::sin(x), chi = std::cos(x);

  MieSeries series;
  series.a.resize(orders);
  series.b.resize(orders);
  for (std::size_t n = 1; n <= orders; ++n) {
    const double order = static_cast<double>(n);
    const double factor = (2.0 * order - 1.0) / x;
    double psi_next = factor * psi - psi_before;
    if (small) {
      psi = psi_table[n - 1];
      psi_next = psi_table[n];
    }
    const double chi_next = factor * chi - chi_before;

    const Complex n_over_x(order / x, 0.0);
    const Complex electric = product(d[n], inverse_m) + n_over_x;
    const Complex magnetic = product(d[n], m) + n_over_x;
    const Complex xi(psi, -chi), xi_next(psi_next, -chi_next);
    series.a[n - 1] = quotient(electric * psi_next - psi, product(electric, xi_next) - xi);
    series.b[n - 1] = quotient(magnetic * psi_next - psi, product(magnetic, xi_next) - xi);

    psi_before = psi;
    psi = psi_next;
    chi_before = chi;
    chi = chi_next;
  }
  return series;
}

double scattering_sum(const MieSeries& series) {
  double sum = 0.0;
  for (std::size_t i = 0; i < series.a.size(); ++i) {
    sum += static_cast<double>(2 * i + 3) *
           (squared_modulus(series.a[i]) + squared_modulus(series.b[i]));
  }
  return sum;
}

MieEfficiencies mie_efficiencies(double size_parameter, std::complex<double> refractive_index) {
  const MieSeries series = mie_series(size_parameter, refractive_index);
  double extinction = 0.0, asymmetry = 0.0;
  Complex back;
  double sign = -1.0;
  const std::size_t orders = series.a.size();
  for (std::size_t i = 0; i < orders; ++i) {
    const double n = static_cast<double>(i + 1);
    const Complex a = series.a[i], b = series.b[i];
    extinction += (2.0 * n + 1.0) * (a.real() + b.real());
    asymmetry += (2.0 * n + 1.0) / (n * (n + 1.0)) * real_overlap(a, b);
    if (i + 1 < orders) {
      asymmetry += n * (n + 2.0) / (n + 1.0) *
                   (real_overlap(a, series.a[i + 1]) + real_overlap(b, series.b[i + 1]));
    }
    back += sign * (2.0 * n + 1.0) * (a - b);
    sign = -sign;
  }
  const double scattering = scattering_sum(series);
  const double x_squared = size_parameter * size_parameter;

  MieEfficiencies result;
  result.scattering = 2.0 / x_squared * scattering;
  // Rounding must not make a transparent sphere absorb or emit.
  result.absorption = refractive_index.imag() == 0.0
                          ? 0.0
                          : std::max(0.0, 2.0 / x_squared * (extinction - scattering));
  result.extinction = result.scattering + result.absorption;
  result.asymmetry = 2.0 * asymmetry / scattering;
  result.backscatter = squared_modulus(back) / x_squared;
  return result;
}

std::vector<MieAmplitudes> mie_amplitudes(double size_parameter,
                                          std::complex<double> refractive_index,
                                          std::span<const double> cos_angle) {
  return amplitudes(mie_series(size_parameter, refractive_index), cos_angle);
}

std::vector<double> mie_phase_function(double size_parameter, std::complex<double> refractive_index,
                                       std::span<const double> cos_angle) {
  const MieSeries series = mie_series(size_parameter, refractive_index);
  const double norm = 1.0 / (4.0 * std::numbers::pi * scattering_sum(series));
  std::vector<double> result;
  result.reserve(cos_angle.size());
  for (const MieAmplitudes& s : amplitudes(series, cos_angle)) {
    result.push_back((squared_modulus(s.s1) + squared_modulus(s.s2)) * norm);
  }
  return result;
}

}  // namespace twilight
