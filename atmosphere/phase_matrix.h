// The scattering matrix of an ensemble of spheres.
#pragma once

#include <vector>

namespace twilight {

/// Scattering matrix against scattering angle, in the Stokes basis (I, Q, U, V) whose Q is
/// positive along the scattering plane:
///   [ p11  p12   0    0  ]
///   [ p12  p11   0    0  ]
///   [  0    0   p33  p34 ]
///   [  0    0  -p34  p33 ]
/// dimensionless, 1/2 integral of p11 sin(angle) d(angle) = 1 for the linear interpolant in
/// angle. All vectors have one size >= 2. In the limit of small spheres p12 / p11 =
/// -sin^2 / (1 + cos^2): light scattered at 90 degrees is polarised across the plane.
struct PhaseMatrix {
  std::vector<double> angle_rad;  ///< strictly increasing from 0 to pi
  std::vector<double> p11, p12, p33, p34;
};

}  // namespace twilight
