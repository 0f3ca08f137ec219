// The inner sum of an optical depth along a ray through shells.
#pragma once

#include <cstddef>

namespace twilight {

/// sum of weight[k] sqrt(max(0, square[k] - impact_squared)) over k < count, in SIMD. With the
/// shells' boundaries squared and the differences of extinction across them this is the optical
/// depth of a ray with that impact parameter.
double sum_weighted_roots(const double* weight, const double* square, std::size_t count,
                          double impact_squared);

}  // namespace twilight
