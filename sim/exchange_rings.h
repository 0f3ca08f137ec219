// The rings of cells between which light is exchanged: their optics and places.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "atmosphere/medium.h"
#include "sim/cell_grid.h"
#include "sim/exchange_medium.h"
#include "sim/exchange_optics.h"
#include "sim/ring_point.h"

namespace twilight {

/// Optical data of the exchange, per ring.
struct RingOptics {
  std::vector<float> s0, s1, s2;       ///< [ring][lane] volume-integrated coefficients, km^2
  std::vector<float> extinction;       ///< [ring][lane] volume-integrated, km^2
  std::vector<float> half_depth;       ///< [ring][lane]
  std::vector<float> own_share;        ///< [ring][lane] (1 - e^-2x)/(2x)
  std::vector<float> self;             ///< [ring][lane] J gained per unit own power, km^-2
  std::vector<float> ground_scale;     ///< [ring][lane]
  std::vector<double> escape, ground;  ///< [ring][lane] fractions of isotropic emission
};

/// Everything but the light: the sizes of the problem, the rings' optics and their places.
struct ExchangeRings {
  ExchangeRings(const Medium& medium, const CellGrid& cells, const ExchangeOptics& cell_optics,
                std::span<const float> ground_albedo);

  const CellGrid& grid;
  const ExchangeOptics& optics;
  const std::vector<CellRing>& all;
  bool ground;  ///< lights the air
  bool means;
  int S, nodes;
  std::size_t L, W;
  std::size_t n_air, n_all;  ///< that emit: air, and air with ground if that is lit
  ExchangeMedium transport;
  RingOptics ro;
  std::vector<RingPoint> points;

 private:
  void integrate_optics();
  void place_points();
};

}  // namespace twilight
