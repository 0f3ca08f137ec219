// How far refraction has bent the sunlight that reaches a point.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// Bending chi - a (chi geometric, a apparent solar zenith angle) and da/dchi of one wavelength.
/// Rows stand at altitudes top * v^2, v evenly in 0..1; columns at chi = horizon * (1 - x^2), x
/// evenly in 0..1: in both the bending is smooth.
struct BendingTable {
  std::size_t rows = 0, columns = 0;
  std::vector<double> horizon_rad;  ///< [row], geometric solar zenith angle of the grazing ray
  /// [row][column]; empty without refraction.
  std::vector<float> bending_rad, derivative;
  /// da/dchi of caustics, in media that focus (strong inversions, ducts), is held within these; the
  /// Earth's is 0.1 to 1.1.
  static constexpr double kLeastDerivative = 1e-3, kMostDerivative = 10;
  bool refracting() const { return !bending_rad.empty(); }
};

/// The tables of every wavelength, each row from as many traced rays as it has columns.
///
/// Colours differ in refractivity by some percent, and the bending is a smooth function of it: the
/// rays of three wavelengths (least, middle and greatest refractivity) are traced and the others'
/// tables interpolated (quadratic), where the medium ducts no rays, refractivities differ by
/// less than 15 % and that gives every layer's to 5e-6 (a medium from a file need not disperse
/// alike in all layers, nor a medium of variants side by side). Error against an own table: 3e-7 of
/// the greatest bending in the mean, 1e-4 at rays that graze a boundary of layers, where the
/// columns' own is as large. Runs on the current oneTBB arena. rows >= 4, columns >= 8. Throws
/// std::invalid_argument for less, or a medium out of range (see RefractedRays).
std::vector<BendingTable> bending_tables(const Medium& medium, int rows, int columns);

/// The table of one wavelength from its own rays. As bending_tables().
BendingTable traced_bending(const Medium& medium, std::size_t wavelength, int rows, int columns);

}  // namespace twilight
