#include "sim/cell_gather.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "aerosols/henyey_greenstein.h"
#include "sim/gather_kernel.h"

namespace twilight {
namespace {
constexpr double kPi = std::numbers::pi;
std::size_t idx(int i) { return static_cast<std::size_t>(i); }
}  // namespace

CellGather::CellGather(const GatherInputs& in, const CellGrid& all_cells)
    : lanes_(in.optics->lanes), divisions_(all_cells.azimuth_divisions()) {
  const Medium& m = *in.medium;
  const ExchangeOptics& o = *in.optics;
  const std::size_t L = lanes_, W = m.wavelengths();
  const int nodes = divisions_ / 2 + 1;
  const double R = m.earth_radius_km, h0 = in.observer_height_km;
  step_rad_ = 2 * kPi / divisions_;
  rows_ = divisions_ / 2;  // cell centres -90 + step/2 ... 90 - step/2
  first_elevation_rad_ = -kPi / 2 + step_rad_ / 2;
  table_.assign(idx(rows_) * idx(nodes) * L, 0.0F);
  const auto& shells = all_cells.shells();
  const ViewGather field(in);

  tbb::parallel_for(0, rows_, [&](int row) {
    const double elevation = first_elevation_rad_ + row * step_rad_;
    const double ce = std::cos(elevation), se = std::sin(elevation);
    std::vector<double> depth(W, 0.0), cell_depth(W);
    std::vector<float> sun(L), emission(L);
    double walked = 0;  // optical depth is summed along the ray as far as this
    const double reach = shells.back().r_max_km;
    for (const CellShell& shell : shells) {
      const double r = shell.r_km;
      const double q = R + h0;
      const double d2 = r * r + 2 * q * r * se;
      const double h = h0 + d2 / (std::sqrt(std::max(0.0, q * q + d2)) + q);
      if (r > reach || h <= 0 || h >= m.top_km()) continue;
      // Depth from the observer to the cell's centre, shell by shell.
      const double s0 = q * se;
      const double p2 = q * q * ce * ce;
      for (std::size_t layer = 0; layer < m.layers(); ++layer) {
        const auto s_at = [&](double b) {
          return std::sqrt(std::max(0.0, (R + b) * (R + b) - p2));
        };
        const double a0 = s_at(m.boundary_km[layer]), a1 = s_at(m.boundary_km[layer + 1]);
        const double lo = s0 + walked, hi = s0 + r;
        const double length = std::clamp(a1, lo, hi) - std::clamp(a0, lo, hi) +
                              std::clamp(-a0, lo, hi) - std::clamp(-a1, lo, hi);
        if (length <= 0) continue;
        for (std::size_t w = 0; w < W; ++w) depth[w] += length * o.beam_extinction(layer, w);
      }
      walked = r;
      ViewStep step;
      step.layer = layer_at(m, h);
      step.altitude_km = h;
      step.rho_km = r * ce;
      step.z_km = r * se;
      step.dir_r = ce;
      step.dir_z = se;
      const std::size_t at = idx(step.layer) * L;
      const double dr = shell.r_max_km - shell.r_min_km;
      for (int j = 0; j < nodes; ++j) {
        const double phi = j * step_rad_;
        field.multiple_emission(step, j, emission.data());
        const double cosine = std::cos(in.sun.elevation_rad) * ce * std::cos(phi) +
                              std::sin(in.sun.elevation_rad) * se;
        const double cos_z = cos_solar_zenith(in.sun, R, h0, step.rho_km, phi, step.z_km);
        const bool lit = in.sunlight->attenuation(h, std::acos(cos_z), sun.data());
        float* out = &table_[(idx(row) * idx(nodes) + idx(j)) * L];
        for (std::size_t w = 0; w < W; ++w) {
          double source = emission[w];
          if (lit) {
            const double hg = 4 * kPi * henyey_greenstein(cosine, o.asymmetry[at + w]);
            const double air = 1 + 5.0 * o.rayleigh_x2[w] * (1.5 * cosine * cosine - 0.5);
            source += std::exp(-static_cast<double>(sun[w])) *
                      (o.air[at + w] * air + o.aerosol[at + w] * hg) / (4 * kPi);
          }
          // Within the cell itself: front to back as in Eq. 5, about its centre.
          const double x = 0.5 * dr * o.beam_extinction(idx(step.layer), w);
          const double own = x > 1e-6 ? -std::expm1(-2 * x) / (2 * x) : 1.0;
          out[w] += static_cast<float>(source * dr * own * std::exp(-std::max(0.0, depth[w] - x)));
        }
      }
    }
  });
}

void CellGather::radiance(double elevation_rad, double relative_azimuth_rad, float* out) const {
  const double azimuth = std::abs(std::remainder(relative_azimuth_rad, 2 * kPi));
  const int nodes = divisions_ / 2 + 1;
  // The first row above the horizon is the lowest that the cells resolve.
  const double lowest = rows_ / 2.0;
  const double y = std::clamp((elevation_rad - first_elevation_rad_) / step_rad_,
                              elevation_rad >= 0 ? lowest : 0.0, rows_ - 1.0);
  const double x = std::min(azimuth / step_rad_, nodes - 1.0);
  const int i = std::min(static_cast<int>(y), rows_ - 2);
  const int j = std::min(static_cast<int>(x), nodes - 2);
  const auto u = static_cast<float>(y - i), v = static_cast<float>(x - j);
  const auto at = [&](int a, int b) { return &table_[(idx(a) * idx(nodes) + idx(b)) * lanes_]; };
  for (std::size_t w = 0; w < lanes_; ++w) {
    out[w] = (1 - u) * ((1 - v) * at(i, j)[w] + v * at(i, j + 1)[w]) +
             u * ((1 - v) * at(i + 1, j)[w] + v * at(i + 1, j + 1)[w]);
  }
}

}  // namespace twilight
