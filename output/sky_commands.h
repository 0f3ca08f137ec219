// The commands that solve one sky and write what is seen of it.
#pragma once

#include "output/command_run.h"
#include "output/exr_image.h"

namespace twilight {

/// What an image says of itself (scene_map.h), the choices of the run's budget included.
ImageAttributes image_attributes(const Run& run, const SceneModel& model, const Sky& sky);

/// `twilight render`: the map, its spectral twin and its preview.
void render(Run& run);
/// `twilight radiance`: CSV of the views' spectral radiance and polarisation.
void radiance(Run& run);
/// `twilight aerial`: CSV of aerial perspective of every view over every distance.
void aerial(Run& run);
/// `twilight irradiance`: CSV of the horizontal irradiances.
void irradiance(Run& run);
/// `twilight solve`: the field of "orders".
void solve(Run& run);

}  // namespace twilight
