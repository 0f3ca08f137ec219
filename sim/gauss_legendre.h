// Gauss-Legendre quadrature.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

namespace twilight {

struct GaussNode {
  double x, weight;
};

/// Nodes (increasing) and weights of the n-point Gauss-Legendre rule on [from, to]; n >= 1. Exact
/// for polynomials of degree 2 n - 1 to rounding.
inline std::vector<GaussNode> gauss_legendre(int n, double from, double to) {
  std::vector<GaussNode> nodes(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int step = 0; step < 100; ++step) {
      double p0 = 1, p1 = x;
      for (int k = 2; k <= n; ++k) {
        const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
        p0 = p1;
        p1 = p2;
      }
      slope = n * (x * p1 - p0) / (x * x - 1);
      const double change = p1 / slope;
      x -= change;
      if (std::abs(change) < 1e-15) break;
    }
    nodes[static_cast<std::size_t>(n - 1 - i)] = {0.5 * (from + to) + 0.5 * (to - from) * x,
                                                  (to - from) / ((1 - x * x) * slope * slope)};
  }
  return nodes;
}

}  // namespace twilight
