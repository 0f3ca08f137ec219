// Imported size distributions.
#pragma once

#include <filesystem>

#include "aerosols/size_distribution.h"

namespace twilight {

SizeDistribution read_size_distribution_file(const std::filesystem::path& path);

}  // namespace twilight
