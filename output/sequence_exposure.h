// How the frames of a sequence are exposed: together, so that a film does not flicker.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "output/preview.h"

namespace twilight {

/// Width (one sigma) of the smoothing kernel in frames: 1/32 of the sequence, at least 1. A share
/// of the sequence and not of a second, so that the same evening in more frames has the same
/// course.
double exposure_kernel_frames(std::size_t frames);

/// Values convolved with a Gaussian of `sigma` frames (> 0), cut off at 4 sigma, continued beyond
/// the ends by reflection in the end points (2 f_0 - f_j). Non-negative weights of sum 1 and that
/// continuation keep a constant, a straight line and whatever rises or falls throughout; the
/// second difference is at most 0.97 / sigma^2 (for sigma >= 2) times half of max - min of the
/// continued values, however the values jump. Throws std::invalid_argument unless sigma > 0.
std::vector<double> smooth_over_frames(std::span<const double> values, double sigma);

/// Exposures that follow the frames' own (sky_exposure): the logarithms of grey and of white, each
/// smoothed over the frames. A frame without light counts as the nearest with light, the earlier
/// of two; a sequence without any is exposed for 1.
std::vector<ToneExposure> follow_exposures(std::span<const std::optional<ToneExposure>> own);

/// One exposure for all frames: grey is the luminance that a camera's exposure value, at ISO 100,
/// is right for, 2^ev K / 100 with K = 12.5 cd/m^2 (ISO 2720:1974, reflected light); white is the
/// largest of the frames' own. `white_luminance_cd_m2` is that of the map's value 1.
std::vector<ToneExposure> fixed_exposures(std::span<const std::optional<ToneExposure>> own,
                                          double ev, double white_luminance_cd_m2);

}  // namespace twilight
