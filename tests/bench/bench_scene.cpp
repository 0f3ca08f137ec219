#include "tests/bench/bench_scene.h"

#include <cmath>

#include "sim/cell_grid.h"
#include "sim/exchange_optics.h"
#include "sim/spectral_lanes.h"

namespace twilight {
namespace {

constexpr int kModes = 24;

ExchangeMedium exchange_medium(std::size_t wavelengths) {
  const SceneModel model = bench_model(wavelengths);
  const ExchangeOptics optics = make_exchange_optics(model.medium, {});
  return make_exchange_medium(model.medium, optics.lanes, optics.extinction);
}

RingPoint ring_point(const ExchangeMedium& medium, double rho_km, double altitude_km) {
  RingPoint p;
  p.rho_km = rho_km;
  p.altitude_km = altitude_km;
  const double r = medium.earth_radius_km + altitude_km;
  p.z_km = std::sqrt(r * r - rho_km * rho_km) - medium.earth_radius_km;
  while (p.layer + 1 < medium.layers &&
         medium.boundary_km[static_cast<std::size_t>(p.layer) + 1] <= altitude_km) {
    ++p.layer;
  }
  p.blur_km2 = 1;
  return p;
}

}  // namespace

SceneModel bench_model(std::size_t wavelengths) {
  Scene scene;
  scene.sun.elevation_deg = -4;
  scene.spectrum.wavelengths_nm.resize(wavelengths);
  return build_scene_model(scene);
}

BenchPair::BenchPair(std::size_t wavelengths, int divisions)
    : medium(exchange_medium(wavelengths)),
      lanes(padded_lanes(wavelengths)),
      azimuth(divisions, kModes),
      source(ring_point(medium, 60, 3)),
      target(ring_point(medium, 100, 12)) {
  half_depth.assign(lanes, 0.01F);
  source.half_depth = half_depth.data();
  target.half_depth = half_depth.data();
  kernel.resize(divisions, lanes, medium.layers);
  evaluate(true);
}

void BenchPair::evaluate(bool moments) {
  ring_pair_kernel(medium, source, target, azimuth, {1, kModes}, false, moments, kernel);
}

}  // namespace twilight
