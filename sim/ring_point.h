// Where a ring of cells is and how far its cells extend.
#pragma once

namespace twilight {

/// One end of a ring pair: the common (rho, z) of the ring's cells about the
/// observer's vertical axis.
struct RingPoint {
  double rho_km = 0, z_km = 0, altitude_km = 0;
  int layer = 0;
  /// Near field. Either a length squared added to the squared distance (the paper's disc), or
  /// the variances of positions within the cell along its radial axis (axis_r, axis_z), azimuth
  /// and third axis: see near_field_factor.
  double blur_km2 = 0;
  double axis_r = 1, axis_z = 0;
  double variance_radial_km2 = 0, variance_azimuthal_km2 = 0, variance_third_km2 = 0;
  bool ground = false;
  double normal_r = 0, normal_z = 1;  ///< ground only
  const float* half_depth = nullptr;  ///< [lane]: half the cell's own optical depth, or null
};

/// Mean of 1/d^2 over two extended cells, as 1/(distance^2 * result). With P and p the summed
/// variances of both cells across and along the line of sight over d^2, the mean is
/// 1 / (d^2 (1 + P / (1 + sqrt(P)/2) - min(3 p, 0.6))): expansion to second order for P, p << 1,
/// and fitted to the exact mean for touching cubes, rods 4:1:1 and plates 4:4:1 and 10:10:1 (within
/// 20 %, where the bare 1/d^2 is up to a factor 10 wrong).
double near_field_factor(double across_over_d2, double along_over_d2);

}  // namespace twilight
