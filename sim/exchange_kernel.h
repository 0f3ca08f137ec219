// The SIMD kernels of the exchange between two rings of cells, and their scalar twins.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// Extinction of the medium, laid out for the kernels: float, wavelengths in lanes.
struct ExchangeMedium {
  double earth_radius_km = 0;
  int layers = 0;
  std::size_t lanes = 0, wavelengths = 0;
  std::vector<double> largest;      ///< [layer]: extinction at the most opaque wavelength, km^-1
  std::vector<double> boundary_km;  ///< [layers + 1]
  std::vector<float> extinction;    ///< [layer][lane], km^-1
  std::vector<float> step;          ///< [boundary][lane]: extinction below minus above, km^-1
};

/// ext(layer, wavelength) in km^-1 of each layer, padded to `lanes`.
ExchangeMedium make_exchange_medium(const Medium& medium, std::size_t lanes,
                                    const LayerTable& extinction_per_km);

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

/// Angular components of the field in a cell, in the frame (radial, azimuthal,
/// vertical) of the cell's azimuth. Even ones are symmetric in the mirror
/// plane of the Sun, odd ones antisymmetric: S is the traceless part of
/// the second moment, F the first moment, J the zeroth.
enum Moment : int { kJ, kFr, kFz, kSrr, kSzz, kSrz, kFa, kSra, kSaz, kMoments };
constexpr int kEvenMoments = 6;

/// Cosines and sines of m k d for the azimuthal modes m of a ring.
struct AzimuthModes {
  int divisions = 0, samples = 0, modes = 0;
  std::vector<float> cosine, sine;              ///< [mode][sample]
  std::vector<double> sin_step, sin_half_step;  ///< [sample]: sin(k d), sin(k d / 2)
  AzimuthModes(int azimuth_divisions, int modes);
};

/// Azimuth samples 0..S/2 of a ring pair, with everything a pass needs.
struct RingPairKernel {
  int samples = 0;  ///< (S/2)/every + 1
  int every = 1;    ///< azimuth differences used: every so many divisions
  int modes = 1;    ///< azimuthal modes that the pair couples noticeably
  std::size_t lanes = 0;
  const float* value = nullptr;             ///< [sample][lane]: transmittance / (4 pi d^2), km^-2
  std::vector<float> own_value;             ///< where value points unless it was given
  std::vector<float> emit;                  ///< [sample][kMoments]: weights of the source's moments
  std::vector<float> receive;               ///< [sample][kMoments]: what the target's moments gain
  std::vector<double> dir_r, dir_a, dir_z;  ///< direction source to target in the source's frame
  std::vector<float> crossing;
  bool dark = false;  ///< nothing passes between the rings (less than e^-30 of the light)
  float weight(int sample) const {  ///< of a sample in the sum around the ring
    return static_cast<float>(every) * (sample == 0 || sample == samples - 1 ? 1.0F : 2.0F);
  }

  void resize(int azimuth_divisions, std::size_t n_lanes, int layers);
};

/// Mean of 1/d^2 over two extended cells, as 1/(distance^2 * result). With P and p the summed
/// variances of both cells across and along the line of sight over d^2, the mean is
/// 1 / (d^2 (1 + P / (1 + sqrt(P)/2) - min(3 p, 0.6))): expansion to second order for P, p << 1,
/// and fitted to the exact mean for touching cubes, rods 4:1:1 and plates 4:4:1 and 10:10:1 (within
/// 20 %, where the bare 1/d^2 is up to a factor 10 wrong).
double near_field_factor(double across_over_d2, double along_over_d2);

/// How finely the exchange between two rings must be sampled in azimuth.
struct AzimuthSampling {
  int every = 1;
  int modes = 1;
};

/// 1/d^2 between two rings has azimuthal modes that fall like exp(-eta m) with
/// cosh(eta) = (rho_s^2 + rho_t^2 + dz^2)/(2 rho_s rho_t), and extinction narrows a pair's
/// kernel to sqrt(d/(beta rho_s rho_t)). Modes below `tolerance` are dropped, and the azimuth
/// differences are thinned to what the trapezoidal rule needs for the rest; thinned samples
/// divide S/2. tolerance = 0 keeps everything. Where sources with structure of their own are summed
/// directly (first_event_pass), source_modes of them must be told from the kernel's.
AzimuthSampling azimuth_sampling(const ExchangeMedium& medium, const RingPoint& source,
                                 const RingPoint& target, int azimuth_divisions, int max_modes,
                                 double tolerance, int source_modes = 0);

/// Fills the kernel from source ring to target ring: exact path lengths per
/// shell shared by all wavelengths, K = exp(-tau)/(4 pi (d^2 + blur)).
/// For equal rings sample 0 (the cell itself) is left out. K is symmetric: `known_value`,
/// [sample][lane] of the same pair in either order, saves its evaluation.
void ring_pair_kernel(const ExchangeMedium& medium, const RingPoint& source,
                      const RingPoint& target, const AzimuthModes& azimuth,
                      const AzimuthSampling& sampling, bool same_ring, bool moments,
                      RingPairKernel& out, const float* known_value = nullptr);
/// Plain double-precision twin of ring_pair_kernel's values: [sample][lane].
std::vector<double> ring_pair_kernel_scalar(const ExchangeMedium& medium, const RingPoint& source,
                                            const RingPoint& target, int azimuth_divisions,
                                            bool same_ring);

/// Circular convolution in azimuth of all moments of a source ring with the
/// pair's kernel, in cosine (even) and sine (odd) modes:
/// field[mode][moment][lane] += K * source[mode][moment][lane].
void moment_pass(const RingPairKernel& kernel, const AzimuthModes& modes, const float* source,
                 float* field);
void moment_pass_scalar(const RingPairKernel& kernel, const AzimuthModes& modes,
                        const float* source, float* field);

/// Cosine modes of the scalar kernel, sum over the whole ring:
/// mode_kernel[mode][lane] = sum_k w_k K_k receive_k emit_k cos(m k d).
void cosine_transform(const RingPairKernel& kernel, const AzimuthModes& modes, float* mode_kernel);
/// field[i] += a[i] * b[i] * scale
void multiply_add(const float* a, const float* b, float scale, std::size_t n, float* field);

/// First aerosol event of the paper: source power [S/2+1][lane] scattered by
/// Henyey-Greenstein about the Sun's direction (elevation e) towards the target
/// ring: field[target azimuth][lane] += sum over sources. Direct summation, as the
/// emission depends on both azimuths.
void first_event_pass(const RingPairKernel& kernel, int azimuth_divisions, const float* power,
                      const unsigned char* lit, const float* asymmetry, double sun_elevation_rad,
                      float* field);
void first_event_pass_scalar(const RingPairKernel& kernel, int azimuth_divisions,
                             const float* power, const unsigned char* lit, const float* asymmetry,
                             double sun_elevation_rad, float* field);

}  // namespace twilight
