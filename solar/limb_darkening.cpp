#include "solar/limb_darkening.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace twilight {
namespace {

using Polynomial = std::array<double, 6>;

// Neckel (2005): A_0 = a + b / x, A_k = c_k + d_k / x^5 (x in micrometres, k = 2..5); A_1 makes
// the value at the disc's centre 1.
struct Range {
  double a, b;
  std::array<double, 4> c, d;
};
constexpr Range kBelowBalmerJump{0.35601,
                                 -0.085217,
                                 {-0.67237, 0.18696, 0.00038, 0.01373},
                                 {0.003589, -0.002415, 0.000897, -0.000200}};
constexpr Range kViolet{0.09900,
                        0.010643,
                        {-2.80511, 3.32780, -2.17878, 0.58825},
                        {0.024873, -0.029317, 0.018273, -0.004663}};
constexpr Range kVisible{0.75267,
                         -0.265577,
                         {-1.89287, 2.42234, -1.71150, 0.49062},
                         {0.012582, -0.017117, 0.011977, -0.003347}};
constexpr double kJumpBeginNm = 372.98, kJumpEndNm = 385.0, kVisibleNm = 422.57;
constexpr double kFirstNm = 300.0, kLastNm = 1100.0;

Polynomial evaluate(const Range& range, double nm) {
  const double x = nm * 1e-3;
  const double x5 = std::pow(x, 5);
  Polynomial p{};
  p[0] = range.a + range.b / x;
  double rest = 1 - p[0];
  for (std::size_t k = 0; k < 4; ++k) {
    p[k + 2] = range.c[k] + range.d[k] / x5;
    rest -= p[k + 2];
  }
  p[1] = rest;
  return p;
}

Polynomial centre_normalised(double nm) {
  if (nm <= kJumpBeginNm) return evaluate(kBelowBalmerJump, nm);
  if (nm >= kVisibleNm) return evaluate(kVisible, nm);
  if (nm >= kJumpEndNm) return evaluate(kViolet, nm);
  const Polynomial below = evaluate(kBelowBalmerJump, kJumpBeginNm);
  const Polynomial above = evaluate(kViolet, kJumpEndNm);
  const double t = (nm - kJumpBeginNm) / (kJumpEndNm - kJumpBeginNm);
  Polynomial p{};
  for (std::size_t k = 0; k < p.size(); ++k) p[k] = below[k] + t * (above[k] - below[k]);
  return p;
}

}  // namespace

LimbDarkening::LimbDarkening(double wavelength_nm) {
  if (!(wavelength_nm > 0 && std::isfinite(wavelength_nm))) {
    std::ostringstream s;
    s << "wavelength_nm " << wavelength_nm << " must be finite and above 0";
    throw std::invalid_argument(s.str());
  }
  coefficient_ = centre_normalised(std::fmin(std::fmax(wavelength_nm, kFirstNm), kLastNm));
  double mean = 0;
  for (std::size_t k = 0; k < coefficient_.size(); ++k) {
    mean += 2 * coefficient_[k] / static_cast<double>(k + 2);
  }
  for (double& c : coefficient_) c /= mean;
}

}  // namespace twilight
