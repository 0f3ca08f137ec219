#include "aerosols/phase_expansion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

constexpr int kLargestDegree = 5000;

// Gauss-Legendre, 6 points on -1..1: the positive abscissas and their weights.
constexpr std::array<double, 3> kGaussAbscissa = {0.23861918608319690863, 0.66120938646626451366,
                                                  0.93246951420315202781};
constexpr std::array<double, 3> kGaussWeight = {0.46791393457269104739, 0.36076157304813860757,
                                                0.17132449237917034504};

void check_degree(int degree) {
  if (!(degree >= 0 && degree <= kLargestDegree)) {
    throw std::invalid_argument("degree " + std::to_string(degree) +
                                " of the phase expansion must be within 0..5000");
  }
}

// Continues P^l_mn from its first two entries at l = start - 1 (0 below |m|, |n|) and start.
void continue_upward(std::vector<double>& p, std::size_t start, double m, double n, double x) {
  for (std::size_t i = start; i + 1 < p.size(); ++i) {
    const double l = static_cast<double>(i);
    const double before = i > 0 ? p[i - 1] : 0.0;
    const double here = (2.0 * l + 1.0) * (l * (l + 1.0) * x - m * n);
    const double below = (l + 1.0) * std::sqrt((l * l - m * m) * (l * l - n * n));
    const double above =
        l * std::sqrt(((l + 1.0) * (l + 1.0) - m * m) * ((l + 1.0) * (l + 1.0) - n * n));
    p[i + 1] = (here * p[i] - below * before) / above;
  }
}

// Linear interpolants of a matrix within one interval of its angles.
class Interval {
 public:
  Interval(const PhaseMatrix& phase, std::size_t i)
      : phase_(phase), i_(i), from_(phase.angle_rad[i]), to_(phase.angle_rad[i + 1]) {}

  double from() const { return from_; }
  double width() const { return to_ - from_; }
  double at(const std::vector<double>& element, double angle) const {
    return std::lerp(element[i_], element[i_ + 1], (angle - from_) / width());
  }
  const PhaseMatrix& phase() const { return phase_; }

 private:
  const PhaseMatrix& phase_;
  std::size_t i_;
  double from_, to_;
};

// Adds the integrand at an angle, without the factor (2l + 1) / 2. alpha2 and alpha3 hold the
// coefficients of a2 + a3 and a2 - a3 until the end.
void add(PhaseExpansion& sum, const Interval& interval, double angle, double weight) {
  const double p11 = interval.at(interval.phase().p11, angle);
  const double p12 = interval.at(interval.phase().p12, angle);
  const double p33 = interval.at(interval.phase().p33, angle);
  const double p34 = interval.at(interval.phase().p34, angle);
  const auto degree = static_cast<int>(sum.alpha1.size()) - 1;
  const SphericalFunctions p = spherical_functions(std::cos(angle), degree);
  const double measure = weight * std::sin(angle);
  for (std::size_t l = 0; l < sum.alpha1.size(); ++l) {
    sum.alpha1[l] += measure * p11 * p.p00[l];
    sum.alpha4[l] += measure * p33 * p.p00[l];
    sum.alpha2[l] += measure * (p11 + p33) * p.p22[l];
    sum.alpha3[l] += measure * (p11 - p33) * p.p2m2[l];
    sum.beta1[l] += measure * p12 * p.p02[l];
    sum.beta2[l] += measure * p34 * p.p02[l];
  }
}

}  // namespace

SphericalFunctions spherical_functions(double x, int degree) {
  check_degree(degree);
  if (!(x >= -1.0 && x <= 1.0)) {
    throw std::invalid_argument("cosine " + std::to_string(x) +
                                " of the scattering angle is outside -1..1");
  }
  const auto size = static_cast<std::size_t>(degree) + 1;
  SphericalFunctions p;
  p.p00.assign(size, 0.0);
  p.p22 = p.p2m2 = p.p02 = p.p00;
  p.p00[0] = 1.0;
  if (size > 1) p.p00[1] = x;
  continue_upward(p.p00, 1, 0.0, 0.0, x);
  if (size > 2) {
    p.p22[2] = 0.25 * (1.0 + x) * (1.0 + x);
    p.p2m2[2] = 0.25 * (1.0 - x) * (1.0 - x);
    p.p02[2] = -0.25 * std::sqrt(6.0) * (1.0 - x * x);
  }
  continue_upward(p.p22, 2, 2.0, 2.0, x);
  continue_upward(p.p2m2, 2, 2.0, -2.0, x);
  continue_upward(p.p02, 2, 0.0, 2.0, x);
  return p;
}

PhaseExpansion expand(const PhaseMatrix& phase, int degree) {
  check_degree(degree);
  const std::size_t angles = phase.angle_rad.size();
  for (const auto* p : {&phase.p11, &phase.p12, &phase.p33, &phase.p34}) {
    if (p->size() != angles) {
      throw std::invalid_argument("phase matrix has " + std::to_string(p->size()) +
                                  " values for its " + std::to_string(angles) + " angles");
    }
  }
  const auto size = static_cast<std::size_t>(degree) + 1;
  PhaseExpansion sum;
  for (auto* c : {&sum.alpha1, &sum.alpha2, &sum.alpha3, &sum.alpha4, &sum.beta1, &sum.beta2}) {
    c->assign(size, 0.0);
  }
  for (std::size_t i = 0; i + 1 < angles; ++i) {
    const Interval interval(phase, i);
    const double parts = std::ceil(interval.width() * std::max(degree, 2));
    const double half = 0.5 * interval.width() / parts;
    for (double part = 0.5; part < parts; ++part) {
      const double middle = interval.from() + interval.width() * part / parts;
      for (std::size_t k = 0; k < kGaussAbscissa.size(); ++k) {
        const double offset = half * kGaussAbscissa[k];
        add(sum, interval, middle - offset, half * kGaussWeight[k]);
        add(sum, interval, middle + offset, half * kGaussWeight[k]);
      }
    }
  }
  for (std::size_t l = 0; l < size; ++l) {
    const double factor = 0.5 * (2.0 * static_cast<double>(l) + 1.0);
    const double plus = factor * sum.alpha2[l], minus = factor * sum.alpha3[l];
    sum.alpha1[l] *= factor;
    sum.alpha4[l] *= factor;
    sum.beta1[l] *= factor;
    sum.beta2[l] *= factor;
    sum.alpha2[l] = 0.5 * (plus + minus);
    sum.alpha3[l] = 0.5 * (plus - minus);
  }
  return sum;
}

MatrixElements evaluate(const PhaseExpansion& expansion, double x) {
  const SphericalFunctions p =
      spherical_functions(x, static_cast<int>(expansion.alpha1.size()) - 1);
  MatrixElements e{};
  double plus = 0.0, minus = 0.0;
  for (std::size_t l = 0; l < expansion.alpha1.size(); ++l) {
    e.a1 += expansion.alpha1[l] * p.p00[l];
    e.a4 += expansion.alpha4[l] * p.p00[l];
    e.b1 += expansion.beta1[l] * p.p02[l];
    e.b2 += expansion.beta2[l] * p.p02[l];
    plus += (expansion.alpha2[l] + expansion.alpha3[l]) * p.p22[l];
    minus += (expansion.alpha2[l] - expansion.alpha3[l]) * p.p2m2[l];
  }
  e.a2 = 0.5 * (plus + minus);
  e.a3 = 0.5 * (plus - minus);
  return e;
}

}  // namespace twilight
