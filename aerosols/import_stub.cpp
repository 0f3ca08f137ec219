// STUB, to be replaced at the merge by the readers of imported files.
#include <stdexcept>

#include "aerosols/particle_optics_file.h"
#include "aerosols/size_distribution_file.h"

namespace twilight {

SizeDistribution read_size_distribution_file(const std::filesystem::path& path) {
  throw std::invalid_argument(path.string() + ": this build reads no size distributions");
}

}  // namespace twilight
