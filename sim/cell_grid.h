// The observer-centred cells of Haber et al. 2005, Sec. 4.1.3.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// How the cells are laid out.
struct CellGridOptions {
  int azimuth_divisions = 120;
  double inner_radius_km = 1.0;
  double observer_height_km = 0.0;
  int active_shell_stride = 1;
  /// true: one exchange shell spans the whole group of shells it stands for
  /// (quadrature weights); false: it is the one active shell itself (the paper).
  bool group_shells = true;
  /// Rings of a shell are bands of altitude no taller than this once the shell's
  /// rings of equal elevation would be taller; 0 = always equal elevation.
  double cell_height_km = 4.0;
  /// true: optical properties are means over the cell; false: at its centre.
  bool cell_means = true;
};

/// Number of shells from the inner radius out: r_j = R_o q^j with
/// q = (1 + d/2)/(1 - d/2), d = 2 pi / S, until r_j >= outer_radius (Sec. 4.1.3, to the letter).
int shells_to_cover(int azimuth_divisions, double inner_radius_km, double outer_radius_km);
/// The same less a last shell whose centre lies beyond the outer radius, as a cell counts when
/// its centre is in the air. This gives the paper's own counts, 101 (S = 72) and 252 (S = 180),
/// with an inner radius of 100 m; the 10 m of its text do not, by either rule.
int shell_count(int azimuth_divisions, double inner_radius_km, double outer_radius_km);

/// Radius of the sphere around the observer that the cells fill: the longest
/// straight path from the observer to the top that clears the ground,
/// sqrt(H^2 + 2 R H) for an observer at the ground (Sec. 4.1.3). km.
double outer_radius_km(const Medium& medium, double observer_height_km);

/// All cells of one shell between two elevations (or two altitudes): the S cells
/// of a ring are alike but for their azimuth.
struct CellRing {
  bool ground = false;  ///< a ring of ground patches instead of air
  int shell = 0;
  double radius_km = 0;  ///< distance of the cells' reference point from the observer
  double elevation_rad = 0;
  double rho_km = 0;       ///< distance from the observer's vertical axis
  double z_km = 0;         ///< height above the observer's horizontal plane
  double altitude_km = 0;  ///< above the ground sphere
  int layer = 0;           ///< of the reference point
  double volume_km3 = 0;   ///< of one cell; ground: area in km^2
  double radial_km = 0, azimuthal_km = 0, third_km = 0;  ///< extents of one cell
  double half_chord_km = 0;                              ///< half the mean chord 4V/S of the cell
  double slope_r = 0, slope_z = 1;  ///< ground: outward normal in the (rho, z) plane
  /// Share of the cell's volume in each layer it touches, as (layer, km^3).
  std::vector<std::pair<int, double>> layer_volume_km3;
};

/// A point of a cell's interior with its share of the volume, for means.
struct CellSample {
  double rho_km, z_km, altitude_km;
  int layer;
  double volume_km3;  ///< per cell (one azimuth division)
};

struct CellShell {
  double r_min_km = 0, r_max_km = 0, r_km = 0;
  bool altitude_bands = false;
  std::size_t first_ring = 0, rings = 0;
  double lower_edge = 0, upper_edge = 0;  ///< of the first and last ring: rad, or km for bands
};

/// Exchange cells: rings of the active shells, then rings of ground.
class CellGrid {
 public:
  CellGrid(const Medium& medium, const CellGridOptions& options);

  const CellGridOptions& options() const { return options_; }
  int azimuth_divisions() const { return options_.azimuth_divisions; }
  double earth_radius_km() const { return earth_radius_km_; }
  const std::vector<CellShell>& shells() const { return shells_; }
  /// Air rings, ordered by shell and then from below upwards, followed by ground rings.
  const std::vector<CellRing>& rings() const { return rings_; }
  std::size_t air_rings() const { return air_rings_; }
  int all_shells() const { return all_shells_; }
  double outer_radius_km() const { return outer_radius_km_; }

  /// Interior points of a ring's cell at relative azimuth zero offset, weights summing to its
  /// volume.
  std::vector<CellSample> samples(const CellRing& ring, const Medium& medium) const;

 private:
  CellGridOptions options_;
  double earth_radius_km_ = 0;
  double outer_radius_km_ = 0;
  int all_shells_ = 0;
  std::vector<CellShell> shells_;
  std::vector<CellRing> rings_;
  std::vector<double> ring_lower_, ring_upper_;  // edges, rad or km
  std::size_t air_rings_ = 0;
};

/// Layer of an altitude; clamped to the medium.
int layer_at(const Medium& medium, double altitude_km);

}  // namespace twilight
