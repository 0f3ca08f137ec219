#include "sim/angular_moments.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace twilight {
namespace {

// d^l_{m,n}(theta) for l = 0..degree (0 below max(|m|, |n|)), by the three-term recurrence in l.
void wigner_column(int degree, int m, int n, double theta, std::vector<double>& d) {
  d.assign(static_cast<std::size_t>(degree) + 1, 0.0);
  const int start = std::max(std::abs(m), std::abs(n));
  if (start > degree) return;
  const double c = std::cos(theta);
  const int a = std::abs(m - n), b = std::abs(m + n);
  double lead = 1;  // sqrt((2 l0)! / (a! b!)) / 2^l0, with a + b = 2 l0
  for (int k = 1; k <= a; ++k) lead *= std::sqrt(static_cast<double>(b + k) / k);
  lead *= std::pow(std::sin(theta / 2), a) * std::pow(std::cos(theta / 2), b);
  if (n < m && (m - n) % 2 != 0) lead = -lead;
  d[static_cast<std::size_t>(start)] = lead;
  for (int l = start; l < degree; ++l) {
    const auto i = static_cast<std::size_t>(l);
    if (l == 0) {
      d[1] = c * d[0];
      continue;
    }
    const double ll = l;
    const double below = l > start ? d[i - 1] : 0.0;
    const double up =
        ll * std::sqrt((ll + 1) * (ll + 1) - m * m) * std::sqrt((ll + 1) * (ll + 1) - n * n);
    const double down = (ll + 1) * std::sqrt(std::max(0.0, ll * ll - m * m)) *
                        std::sqrt(std::max(0.0, ll * ll - n * n));
    d[i + 1] = ((2 * ll + 1) * (ll * (ll + 1) * c - m * n) * d[i] - down * below) / up;
  }
}

}  // namespace

AngularBasis angular_basis(int degree, double theta_rad) {
  const std::size_t count = moment_count(degree);
  AngularBasis basis{std::vector<double>(count), std::vector<double>(count),
                     std::vector<double>(count)};
  std::vector<double> zero, plus, minus;
  for (int m = 0; m <= degree; ++m) {
    wigner_column(degree, m, 0, theta_rad, zero);
    wigner_column(degree, m, 2, theta_rad, plus);
    wigner_column(degree, m, -2, theta_rad, minus);
    for (int l = m; l <= degree; ++l) {
      const auto i = static_cast<std::size_t>(l);
      const std::size_t k = moment_index(l, m);
      basis.p[k] = zero[i];
      basis.r[k] = 0.5 * (plus[i] + minus[i]);
      basis.t[k] = 0.5 * (minus[i] - plus[i]);
    }
  }
  return basis;
}

}  // namespace twilight
