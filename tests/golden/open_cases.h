// Sky radiances of pure Rayleigh air by an independent backward Monte Carlo.
#pragma once

#include <array>

namespace twilight {

/// One view of the reference sky. Radiances are per unit solar irradiance, sr^-1.
struct OpenCase {
  double sun_elevation_deg;
  double view_elevation_deg;
  double relative_azimuth_deg;  ///< 0 = towards the Sun
  double radiance;
  double standard_error;
  double single;  ///< share of the first scattering order
};

/// Scalar (unpolarised) backward Monte Carlo in spherical geometry, 2e5 to 2e7 photons a row: the
/// project's reference table "open cases". Earth radius 6371 km, black ground, observer on the
/// ground, no refraction, no absorption, no depolarisation, air scattering 0.0116 km^-1 exp(-z/8
/// km) up to 100 km in layers of 0.5 km that hold their means, the Sun a point. Rows with the Sun
/// at -6 deg or higher and views 10 deg up or more.
inline constexpr std::array<OpenCase, 35> kOpenCases = {{
    {30, 90, 0, 0.007016, 4.78e-06, 0.0060274},
    {30, 45, 0, 0.0145107, 7.26e-06, 0.012912},
    {30, 45, 90, 0.00903138, 6.84e-06, 0.0075137},
    {30, 45, 180, 0.00867787, 7e-06, 0.0071255},
    {30, 10, 0, 0.0467324, 2.46e-05, 0.040938},
    {30, 10, 90, 0.0272992, 2.28e-05, 0.021893},
    {30, 10, 180, 0.0402051, 2.44e-05, 0.034461},
    {5, 90, 0, 0.00414922, 3.94e-06, 0.0034277},
    {5, 45, 0, 0.008647, 6.83e-06, 0.0074745},
    {5, 45, 90, 0.00582652, 5.6e-06, 0.0047152},
    {5, 45, 180, 0.00777667, 6.43e-06, 0.0066194},
    {5, 10, 0, 0.0343503, 2.58e-05, 0.029994},
    {5, 10, 90, 0.0187814, 1.84e-05, 0.014841},
    {5, 10, 180, 0.0323931, 2.4e-05, 0.028216},
    {0, 90, 0, 0.00182791, 3.43e-06, 0.001515},
    {0, 45, 0, 0.00370305, 6.89e-06, 0.0031866},
    {0, 45, 90, 0.00255784, 4.8e-06, 0.0020755},
    {0, 45, 180, 0.00353113, 6.63e-06, 0.0030373},
    {0, 10, 0, 0.0154055, 2.96e-05, 0.013381},
    {0, 10, 90, 0.00772634, 1.51e-05, 0.0060459},
    {0, 10, 180, 0.011749, 2.33e-05, 0.010142},
    {-3, 90, 0, 0.000334427, 1.34e-06, 0.00027699},
    {-3, 45, 0, 0.000722535, 2.88e-06, 0.00062182},
    {-3, 45, 90, 0.00046514, 1.86e-06, 0.00037622},
    {-3, 45, 180, 0.000586234, 2.34e-06, 0.00049928},
    {-3, 10, 0, 0.00380693, 1.52e-05, 0.0033571},
    {-3, 10, 90, 0.00125503, 5.01e-06, 0.00095376},
    {-3, 10, 180, 0.0007428, 2.98e-06, 0.00049297},
    {-6, 90, 0, 1.45128e-05, 5.76e-08, 9.5376e-06},
    {-6, 45, 0, 4.02851e-05, 1.61e-07, 3.051e-05},
    {-6, 45, 90, 2.03966e-05, 8.16e-08, 1.2774e-05},
    {-6, 45, 180, 1.79714e-05, 7.05e-08, 1.0015e-05},
    {-6, 10, 0, 0.00045852, 1.83e-06, 0.00041019},
    {-6, 10, 90, 5.42875e-05, 2.16e-07, 2.8929e-05},
    {-6, 10, 180, 2.36025e-05, 1.16e-07, 0},
}};

}  // namespace twilight
