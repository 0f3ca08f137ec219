// 8-bit pictures as PNG.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "output/atomic_file.h"

namespace twilight {

/// PNG of sRGB pixels [y][x][3], 8 bits; the bytes depend on the arguments alone. Throws
/// std::logic_error if the number of pixels is not width x height, std::runtime_error if libpng
/// refuses.
std::vector<std::uint8_t> png_of(int width, int height, std::span<const std::uint8_t> rgb);

/// The same to a file, whose commit is the caller's; std::runtime_error names the path.
void write_png(AtomicFile& file, int width, int height, std::span<const std::uint8_t> rgb);

}  // namespace twilight
