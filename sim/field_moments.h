// The angular moments of the light in a cell.
#pragma once

namespace twilight {

/// Angular components of the field in a cell, in the frame (radial, azimuthal,
/// vertical) of the cell's azimuth. Even ones are symmetric in the mirror
/// plane of the Sun, odd ones antisymmetric: S is the traceless part of
/// the second moment, F the first moment, J the zeroth.
enum Moment : int { kJ, kFr, kFz, kSrr, kSzz, kSrz, kFa, kSra, kSaz, kMoments };
constexpr int kEvenMoments = 6;

}  // namespace twilight
