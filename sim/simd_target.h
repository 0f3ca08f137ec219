// Which vector instructions the kernels use.
#pragma once

#include <string>
#include <string_view>

namespace twilight {

/// Name of the best instruction set that the kernels were built for and this processor (and
/// cap_simd_target) allows, as Highway calls it: "AVX3" is AVX-512, "EMU128" plain C++.
std::string simd_target();

/// Keeps every kernel from anything better than `name`: "best", "avx512", "avx2", "sse4" or
/// "scalar", plain C++ for whatever the compiler makes of it. For measurements and tests; results
/// agree within the kernels' own error bounds. Throws std::invalid_argument for any other name.
void cap_simd_target(std::string_view name);

}  // namespace twilight
