// One pass of the exchange between two rings, in azimuthal modes.
#pragma once

#include <cstddef>

#include "sim/azimuth_sampling.h"
#include "sim/ring_pair_kernel.h"

namespace twilight {

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
/// Both directions of a pair: field_a[i] += k[i] * b[i] * scale_b, field_b[i] += k[i] * a[i] *
/// scale_a. The arrays differ.
void multiply_add_both(const float* k, const float* a, float scale_a, const float* b, float scale_b,
                       std::size_t n, float* field_a, float* field_b);

}  // namespace twilight
