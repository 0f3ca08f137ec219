// How many scenes a property test draws: CI or nightly.
#pragma once

#include <rapidcheck.h>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace twilight {

/// Whether the environment asks for bigger grids and more scenes: TWILIGHT_PROPERTY=nightly.
bool nightly();

/// Scenes of a test whose CI size is `ci`: TWILIGHT_PROPERTY_SCENES, a factor, scales it.
std::size_t scene_count(std::size_t ci);

/// Of the random scenes; fixed unless TWILIGHT_PROPERTY_SEED sets it.
std::uint64_t scene_seed();

/// n scenes, whatever `draw` makes of RapidCheck's generators.
template <class Draw>
auto draw_scenes(std::size_t n, const Draw& draw) {
  rc::Random random(scene_seed());
  const auto generator = rc::gen::exec(draw);
  std::vector<std::invoke_result_t<Draw>> scenes;
  for (std::size_t i = 0; i < n; ++i) {
    scenes.push_back(generator(random.split(), rc::kNominalSize).value());
  }
  return scenes;
}

}  // namespace twilight
