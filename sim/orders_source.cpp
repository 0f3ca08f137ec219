#include "sim/orders_source.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/aerosol_emission.h"
#include "sim/angular_moments.h"
#include "sim/emission_kernel.h"
#include "sim/field_reference.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kFine_rad = ZenithGrid::kFineStep_deg * pi / 180;
// Levels of direct sunlight between two of the field, unless they lie this near already.
constexpr int kBeamDivision = 6;
constexpr double kNearestBeamLevels_km = 0.05;
constexpr int kDayStride = 3;
// A sample of a cubic path weighs what lies up to three levels away, and one more for rays that
// turn.
constexpr std::size_t kReach = 4;

// Whether a kind of aerosol is present within reach of a level.
bool within_reach(const OrdersMedium& medium, const std::vector<double>& level_km,
                  std::size_t level, std::size_t kind) {
  const double low = level_km[level - std::min(level, kReach)];
  const double high = level_km[std::min(level + kReach, level_km.size() - 1)];
  const PathOptics& optics = medium.optics;
  for (std::size_t i = 0; i + 1 < optics.boundary_km.size(); ++i) {
    if (optics.boundary_km[i + 1] < low || optics.boundary_km[i] > high) continue;
    if (optics.kind_present[i * optics.kinds + kind] != 0) return true;
  }
  return false;
}

}  // namespace

BeamRows::BeamRows(const DirectSunlight& sunlight, const OrdersOptions& options,
                   std::span<const double> wavelength_nm)
    : sunlight_(sunlight), wavelengths_(wavelength_nm.size()) {
  if (options.disc_average) {
    disc_.emplace(wavelength_nm, options.sun_distance_au, sunlight.lanes());
  }
}

void BeamRows::row(double altitude_km, std::span<float> beam) const {
  const std::size_t lanes = sunlight_.lanes();
  std::fill(beam.begin(), beam.end(), 0.0F);
  // Attenuation is smooth while the Sun is high: cubic between every kStride-th point.
  constexpr std::size_t kStride = 16, kHigh = static_cast<std::size_t>(65 / 0.05) / 16 * 16;
  std::vector<float> attenuation(ZenithGrid::kFineSize * lanes);
  std::size_t end = 0;
  for (std::size_t k = 0; k < ZenithGrid::kFineSize; k += k < kHigh ? kStride : 1) {
    const double chi = static_cast<double>(k) * kFine_rad;
    if (chi > pi || !sunlight_.attenuation(altitude_km, chi, &attenuation[k * lanes])) break;
    end = k + 1;
  }
  for (std::size_t k = 0; k < std::min(end, kHigh); ++k) {
    if (k % kStride == 0) continue;
    const auto cells = kHigh / kStride + 1;
    const auto t = static_cast<double>(k) / kStride;
    const ZenithGrid::Stencil s = ZenithGrid::stencil(t, cells);
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      double sum = 0;
      for (std::size_t q = 0; q < 4; ++q) {
        sum += s.weight[q] * static_cast<double>(attenuation[(s.first + q) * kStride * lanes + w]);
      }
      attenuation[k * lanes + w] = static_cast<float>(sum);
    }
  }
  for (std::size_t k = 0; k < end; ++k) {
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      const float a = attenuation[k * lanes + w];
      if (a < DirectSunlight::kOpaque) beam[k * lanes + w] = std::exp(-a);
    }
  }
  if (disc_) (*disc_)(end, beam);
}

template <class T>
BeamSource<T> beam_source(const OrdersGrid<T>& grid, const OrdersMedium& medium,
                          const DirectSunlight& sunlight, const OrdersOptions& options) {
  constexpr std::size_t kFine = ZenithGrid::kFineSize;
  const std::size_t lanes = grid.lanes;
  BeamSource<T> source;
  for (std::size_t i = 0; i + 1 < grid.level_km.size(); ++i) {
    const double step = grid.level_km[i + 1] - grid.level_km[i];
    const int parts = std::clamp(static_cast<int>(step / kNearestBeamLevels_km), 1, kBeamDivision);
    for (int k = 0; k < parts; ++k) {
      if (k % kDayStride == 0) source.day_level.push_back(source.level_km.size());
      source.level_km.push_back(grid.level_km[i] + step * k / parts);
    }
  }
  source.day_level.push_back(source.level_km.size());
  source.level_km.push_back(grid.level_km.back());
  for (const std::size_t i : source.day_level) source.day_level_km.push_back(source.level_km[i]);
  const std::size_t count = source.level_km.size();
  source.irradiance.assign(count * kFine * lanes, T(0));
  source.end.assign(count, 0);
  source.ground.assign(kFine * lanes, T(0));
  source.lift_rad.resize(count * kFine);
  const BeamRows beams(sunlight, options, medium.truncated.wavelength_nm);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const double z = source.level_km[i];
    std::vector<float> beam(kFine * lanes);
    beams.row(z, beam);
    T* irradiance = &source.irradiance[i * kFine * lanes];
    for (std::size_t k = 0; k < beam.size(); ++k) {
      const bool lit = static_cast<double>(beam[k]) > kDarkTrace;
      irradiance[k] = lit ? static_cast<T>(beam[k]) : T(0);
      if (lit) source.end[i] = k / lanes + 1;
    }
    source.end[i] = std::min(source.end[i], kFine - 1);
    for (std::size_t k = 0; k <= source.end[i]; ++k) {
      const double chi = std::min(static_cast<double>(k) * kFine_rad, pi);
      const double apparent = sunlight.apparent_zenith_rad(z, chi);
      source.lift_rad[i * kFine + k] = static_cast<T>(chi - apparent);
      if (i > 0) continue;
      for (std::size_t w = 0; w < lanes; ++w) {
        source.ground[k * lanes + w] =
            irradiance[k * lanes + w] * static_cast<T>(std::max(std::cos(apparent), 0.0));
      }
    }
  });
  return source;
}

template <class T>
ScatteredSource<T> scattered_source(const OrdersGrid<T>& grid, const OrdersMedium& medium,
                                    const IncomingLight<T>& light, int phase_degree) {
  constexpr std::size_t kFine = ZenithGrid::kFineSize;
  const std::size_t all = grid.zenith.size(), lanes = grid.lanes, levels = grid.level_km.size();
  ScatteredSource<T> source;
  source.phase_degree = std::min(grid.moment_degree, phase_degree);
  source.coherency.assign(light.coherency.size(), T(0));
  source.reference.assign(levels * kFine * lanes, T(0));
  source.ground.assign(kFine * lanes, T(0));
  const std::size_t kinds = medium.kinds.size();
  const std::size_t block = grid.nodes * moment_count(source.phase_degree) * grid.stokes * lanes;
  source.scattered_at.assign(grid.aerosol_levels * kinds, ScatteredSource<T>::kAbsent);
  std::size_t blocks = 0;
  for (std::size_t i = 0; i < grid.aerosol_levels; ++i) {
    for (std::size_t q = 0; q < kinds; ++q) {
      if (within_reach(medium, grid.level_km, i, q)) {
        source.scattered_at[i * kinds + q] = blocks++ * block;
      }
    }
  }
  source.scattered.assign(blocks * block, T(0));
  tbb::parallel_for(std::size_t{0}, levels, [&](std::size_t i) {
    std::vector<double> trace(all * lanes);
    LevelLight<T, T> level;
    level.nodes = all;
    level.in_lanes = level.out_lanes = lanes;
    level.coherency = &light.coherency[i * all * 4 * lanes];
    level.anisotropic_share = medium.anisotropic_share.data();
    level.relative_coherency = &source.coherency[i * all * 4 * lanes];
    level.trace = trace.data();
    divide_by_trace(level);
    refine_trace(grid.zenith, trace, lanes, lanes, 0, kFine, &source.reference[i * kFine * lanes]);
    if (i >= grid.aerosol_levels) return;
    const ArrivingMoments<T> arriving{grid.nodes,
                                      lanes,
                                      grid.polarised,
                                      grid.moment_degree,
                                      &light.moments[i * all * grid.moments * lanes],
                                      trace.data()};
    for (std::size_t q = 0; q < kinds; ++q) {
      const std::size_t at = source.scattered_at[i * kinds + q];
      if (at == ScatteredSource<T>::kAbsent) continue;
      scatter_moments(arriving, medium.kinds[q], source.phase_degree, &source.scattered[at]);
    }
  });
  const std::vector<double> ground(light.ground.begin(), light.ground.end());
  refine_trace(grid.zenith, ground, lanes, lanes, 0, kFine, source.ground.data());
  return source;
}

template BeamSource<float> beam_source(const OrdersGrid<float>&, const OrdersMedium&,
                                       const DirectSunlight&, const OrdersOptions&);
template BeamSource<double> beam_source(const OrdersGrid<double>&, const OrdersMedium&,
                                        const DirectSunlight&, const OrdersOptions&);
template ScatteredSource<float> scattered_source(const OrdersGrid<float>&, const OrdersMedium&,
                                                 const IncomingLight<float>&, int);
template ScatteredSource<double> scattered_source(const OrdersGrid<double>&, const OrdersMedium&,
                                                  const IncomingLight<double>&, int);

}  // namespace twilight
