// Measured volume size distributions, as AERONET retrieves them, and their optics.
#pragma once

#include <complex>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "aerosols/particle_optics.h"
#include "aerosols/size_distribution.h"

namespace twilight {

/// Volume of particles over a unit of area of the ground against radius: dV/d ln r, linear in ln r
/// between the radii, none outside them.
struct VolumeSizeDistribution {
  std::string when;                        ///< "15:08:2019 21:46:45"; "average of 12"; ""
  std::vector<double> radius_um;           ///< strictly increasing, > 0; two or more
  std::vector<double> volume_um3_per_um2;  ///< dV/d ln r, as many, >= 0

  /// Particles: dN/d ln r = dV/d ln r / (4/3 pi r^3), um^-2.
  SizeDistribution per_um2() const;
  /// The same over the number of all particles, number_per_um2(): dimensionless.
  SizeDistribution per_particle() const;
  /// Particles and their volume over the radii, um^-2 and um: exact for the interpolant.
  double number_per_um2() const;
  double volume_um() const;
};

/// Every row of a file, in its order. Two formats:
///  - AERONET's size distributions (inversion product *.siz, versions 2 and 3; CSV): after lines of
///    title a header with Date(...), Time(...) and the radii in um as column names ("0.050000"); a
///    row per retrieval with dV/d ln r, um^3 um^-2. Rows with -999 (or N/A) at a radius are no
///    retrievals and are left out.
///  - CSV with the columns radius_um,dV_dlnr, one line per radius: one distribution. '#' lines are
///    comments.
/// Radii 0.001..100 um, strictly increasing; values 0..1e6, not all 0. Throws std::runtime_error
/// where the file cannot be read, std::invalid_argument "FILE:LINE: column 'NAME': value 'V': must
/// be ..." for what is in it.
std::vector<VolumeSizeDistribution> read_size_distributions(const std::filesystem::path& file);

/// One of them: `row` is "average" (the mean of all), a number from 1, or the date and time of a
/// retrieval as the file has them, "15:08:2019 21:46:45" (the date alone: the mean of its rows).
/// Throws as above, and std::invalid_argument "FILE: row 'ROW': ..." where there is none.
VolumeSizeDistribution read_size_distribution(const std::filesystem::path& file,
                                              std::string_view row = "average");

/// Radii per e-fold of the size integrals below.
inline constexpr int kMeasuredRadiiPerEfold = 300;

/// Optics and scattering matrices (integrate_spheres, sphere_phases) of one particle cm^-3 of the
/// distribution: spheres of m = n - i k, one index for each wavelength (nm, strictly increasing),
/// at one humidity, the ambient one they were measured at (written as 0 %: the table does not
/// change with humidity). Throws std::invalid_argument for sizes that differ and as the integrals
/// do.
ParticleOptics optics_of_sizes(const VolumeSizeDistribution& sizes, std::string name,
                               std::span<const double> wavelength_nm,
                               std::span<const std::complex<double>> index);

/// Extinction optical depth of the column: number times extinction cross section. Throws as above.
double column_optical_depth(const VolumeSizeDistribution& sizes, double wavelength_nm,
                            std::complex<double> index);

}  // namespace twilight
