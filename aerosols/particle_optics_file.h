// Imported optics of particles.
#pragma once

#include <filesystem>

#include "aerosols/particle_optics.h"

namespace twilight {

ParticleOptics read_particle_optics(const std::filesystem::path& path);

}  // namespace twilight
