// The kernel of the exchange between two rings of cells: transmittance and geometry.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/azimuth_sampling.h"
#include "sim/exchange_medium.h"
#include "sim/field_moments.h"
#include "sim/ring_point.h"

namespace twilight {

/// Azimuth samples 0..S/2 of a ring pair, with everything a pass needs.
struct RingPairKernel {
  /// Bounds of S and of samples, padded to whole vectors.
  static constexpr int kMostDivisions = 360;
  static constexpr std::size_t kMostSamples = 192;

  int samples = 0;  ///< (S/2)/every + 1
  int every = 1;    ///< azimuth differences used: every so many divisions
  int modes = 1;    ///< azimuthal modes that the pair couples noticeably
  std::size_t lanes = 0;
  const float* value = nullptr;  ///< [sample][lane]: transmittance / (4 pi d^2), km^-2
  std::vector<float> own_value;  ///< where value points unless it was given
  std::vector<float> emit;       ///< [sample][kMoments]: weights of the source's moments
  std::vector<float> receive;    ///< [sample][kMoments]: what the target's moments gain
  /// Direction from source to target in the source's frame (radial, azimuthal, up), then in the
  /// target's; [sample]. Emission into it is scaled by leaving, arrival by arriving: 1 in the
  /// air, Lambert's cosine at the ground, 0 where nothing passes.
  std::vector<float> dir_r, dir_a, dir_z, into_r, into_a, leaving, arriving;
  std::vector<float> crossing;  ///< workspace
  bool dark = false;            ///< nothing passes between the rings (less than e^-30 of the light)
  float weight(int sample) const {  ///< of a sample in the sum around the ring
    return static_cast<float>(every) * (sample == 0 || sample == samples - 1 ? 1.0F : 2.0F);
  }

  /// Throws std::invalid_argument for more than 360 azimuth divisions, 512 wavelengths or 546
  /// layers.
  void resize(int azimuth_divisions, std::size_t n_lanes, int layers);

  /// Turns the kernel from source to target into the one from target to source; the value stays.
  void turn_round(const RingPoint& source, const RingPoint& target, bool moments);

  /// emit and receive from the directions; moments = false: of J only.
  void weigh(bool source_ground, bool target_ground, bool moments);
};

/// A boundary that lines of sight cross: n = (h - h_low)(2 R + h + h_low), km^2, with the
/// extinction's step there, [lane]; a dip counts from the perigee.
struct BoundaryCrossing {
  float n;
  bool dip;
  const float* coefficient;
};

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

}  // namespace twilight
