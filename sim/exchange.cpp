#include "sim/exchange.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>

#include "sim/first_event.h"
#include "sim/kernel_store.h"
#include "sim/spectral_lanes.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Modes kept in azimuth: the field's finest features are as wide as the smoothest kernels
// let through; 24 modes resolve 7.5 degrees.
constexpr int kMaxModes = 24;

std::size_t idx(int i) { return static_cast<std::size_t>(i); }

// Per-ring optical data of the exchange.
struct RingOptics {
  std::vector<float> s0, s1, s2;       // [ring][lane] volume-integrated coefficients, km^2
  std::vector<float> extinction;       // [ring][lane] volume-integrated, km^2
  std::vector<float> half_depth;       // [ring][lane]
  std::vector<float> own_share;        // [ring][lane] (1 - e^-2x)/(2x)
  std::vector<float> self;             // [ring][lane] J gained per unit own power, km^-2
  std::vector<float> ground_scale;     // [ring][lane]
  std::vector<double> escape, ground;  // [ring][lane] fractions of isotropic emission
};

// Transmitted fractions of isotropic emission at a ring's point: to the ground, and out of
// the cells' domain, by quadrature over directions.
void emission_fractions(const ExchangeMedium& medium, const CellGrid& grid, const CellRing& ring,
                        std::size_t wavelengths, double* escape, double* ground) {
  constexpr int kPolar = 20, kAzimuth = 4;
  const double R = medium.earth_radius_km;
  const double h0 = grid.options().observer_height_km;
  const double r = R + ring.altitude_km;
  const double top = medium.boundary_km.back();
  const double outer = grid.outer_radius_km();
  std::fill(escape, escape + wavelengths, 0.0);
  std::fill(ground, ground + wavelengths, 0.0);
  // Local frame: up along the Earth's radius, `out` away from the observer's axis.
  const double zc = R + h0 + ring.z_km;
  const double up_r = ring.rho_km / r, up_z = zc / r;
  const double out_r = up_z, out_z = -up_r;
  const double horizon_mu = -std::sqrt(std::max(0.0, 1 - (R / r) * (R / r)));
  std::vector<double> path(idx(medium.layers));
  for (int part = 0; part < 2; ++part) {
    const double mu0 = part == 0 ? -1.0 : horizon_mu;
    const double mu1 = part == 0 ? horizon_mu : 1.0;
    for (int i = 0; i < kPolar; ++i) {
      // Midpoints of a grid dense towards the horizon, where transmission bends most.
      const double e0 = static_cast<double>(i) / kPolar, e1 = static_cast<double>(i + 1) / kPolar;
      const auto spread = [&](double e) {
        return part == 0 ? mu1 - (mu1 - mu0) * (1 - e) * (1 - e) : mu0 + (mu1 - mu0) * e * e;
      };
      const double lo = spread(e0), hi = spread(e1);
      const double mu = 0.5 * (lo + hi);
      const double sin_t = std::sqrt(std::max(0.0, 1 - mu * mu));
      const double weight = (hi - lo) / 2 / kAzimuth;
      for (int k = 0; k < kAzimuth; ++k) {
        const double phi = kPi * (k + 0.5) / kAzimuth;
        const double dir_r = mu * up_r + sin_t * std::cos(phi) * out_r;
        const double dir_z = mu * up_z + sin_t * std::cos(phi) * out_z;
        const double b = ring.rho_km * dir_r + ring.z_km * dir_z;
        const double c = ring.rho_km * ring.rho_km + ring.z_km * ring.z_km - outer * outer;
        double end = -b + std::sqrt(std::max(0.0, b * b - c));
        const double s0 = r * mu;  // signed distance from the perigee
        const double p2 = r * r * (1 - mu * mu);
        const auto s_at = [&](double h) {
          return std::sqrt(std::max(0.0, (R + h) * (R + h) - p2));
        };
        const bool hits = part == 0;
        const double limit = hits ? -s_at(0) - s0 : s_at(top) - s0;
        const bool inside = end < limit;
        end = std::min(end, limit);
        const double s1 = s0 + end;
        for (int layer = 0; layer < medium.layers; ++layer) {
          const double a0 = s_at(medium.boundary_km[idx(layer)]);
          const double a1 = s_at(medium.boundary_km[idx(layer) + 1]);
          const double up = std::clamp(a1, s0, s1) - std::clamp(a0, s0, s1);
          const double down = std::clamp(-a0, s0, s1) - std::clamp(-a1, s0, s1);
          path[idx(layer)] = up + down;
        }
        for (std::size_t w = 0; w < wavelengths; ++w) {
          double depth = 0;
          for (int layer = 0; layer < medium.layers; ++layer) {
            depth += path[idx(layer)] *
                     static_cast<double>(medium.extinction[idx(layer) * medium.lanes + w]);
          }
          (hits && !inside ? ground : escape)[w] += weight * std::exp(-depth);
        }
      }
    }
  }
}

// The active rings between which a ring of any shell is interpolated.
struct PassiveRing {
  std::size_t ring[2] = {0, 0};
  double weight[2] = {0, 0};
};

std::vector<PassiveRing> passive_rings(const CellGrid& active, const CellGrid& all) {
  const double half_step = kPi / active.azimuth_divisions();
  const auto& shells = active.shells();
  const auto& rings = active.rings();
  // Ring of an active shell at an elevation; npos where the shell has none there. Means of cells
  // that ground or top cut through stand closer than half a step: the nearest.
  constexpr auto npos = static_cast<std::size_t>(-1);
  const auto find = [&](const CellShell& shell, double elevation) {
    std::size_t nearest = npos;
    double least = half_step;
    for (std::size_t i = shell.first_ring; i < shell.first_ring + shell.rings; ++i) {
      const double away = std::abs(rings[i].elevation_rad - elevation);
      if (away >= least) continue;
      nearest = i;
      least = away;
    }
    return nearest;
  };
  std::vector<PassiveRing> result(all.air_rings());
  for (std::size_t i = 0; i < all.air_rings(); ++i) {
    const CellRing& ring = all.rings()[i];
    const double r = all.shells()[idx(ring.shell)].r_km;
    std::size_t hi = 0;
    while (hi < shells.size() && shells[hi].r_km < r) ++hi;
    const std::size_t lo = hi == 0 ? 0 : hi - 1;
    hi = std::min(hi, shells.size() - 1);
    const double span = shells[hi].r_km - shells[lo].r_km;
    const double t = span > 0 ? (r - shells[lo].r_km) / span : 0.0;
    const std::size_t a = find(shells[lo], ring.elevation_rad);
    const std::size_t b = find(shells[hi], ring.elevation_rad);
    PassiveRing& p = result[i];
    if (a != npos && b != npos) {
      p = {{a, b}, {1 - t, t}};
    } else if (a != npos || b != npos) {
      p = {{a != npos ? a : b, a != npos ? a : b}, {1.0, 0.0}};
    }
  }
  return result;
}

}  // namespace

double cos_solar_zenith(const SunGeometry& sun, double earth_radius_km, double observer_height_km,
                        double rho_km, double azimuth_rad, double z_km) {
  const double up = earth_radius_km + observer_height_km + z_km;
  const double radius = std::hypot(rho_km, up);
  return std::clamp((std::cos(sun.elevation_rad) * rho_km * std::cos(azimuth_rad) +
                     std::sin(sun.elevation_rad) * up) /
                        radius,
                    -1.0, 1.0);
}

ExchangeOptics make_exchange_optics(const Medium& medium, const ExchangeOptions& options) {
  ExchangeOptics o;
  const std::size_t n = medium.layers(), W = medium.wavelengths();
  const std::size_t L = padded_lanes(W);
  o.lanes = L;
  for (auto* v : {&o.s0, &o.s1, &o.s2, &o.air, &o.aerosol, &o.asymmetry}) v->assign(n * L, 0.0F);
  o.rayleigh_x2.assign(L, 0.0F);
  o.extinction = LayerTable(n, W);
  o.beam_extinction = LayerTable(n, W);
  for (std::size_t w = 0; w < W; ++w) {
    // Legendre coefficient of (3/4)(1 + cos^2) is 1/10; depolarised air: Bucholtz (1995) Eq. 12.
    const double rho = medium.depolarisation.empty() ? 0.0 : medium.depolarisation[w];
    const double gamma = rho / (2 - rho);
    const double x2 = options.rayleigh ? (1 - gamma) / (10 * (1 + 2 * gamma)) : 0.0;
    o.rayleigh_x2[w] = static_cast<float>(x2);
    for (std::size_t i = 0; i < n; ++i) {
      const double air = medium.air_scattering_per_km(i, w);
      const double aerosol = medium.aerosol_scattering_per_km(i, w);
      const double g = medium.aerosol_asymmetry(i, w);
      const double absorbed =
          medium.aerosol_absorption_per_km(i, w) + medium.gas_absorption_per_km(i, w);
      double scaled = aerosol, a1 = 0, a2 = 0;
      if (options.similarity) {
        scaled = aerosol * (1 - g);
      } else {
        // Delta-M (Wiscombe 1977): the moments of degree 3 and above go into the beam.
        const double f = g > 0 ? g * g * g : 0.0;
        scaled = aerosol * (1 - f);
        a1 = (g - f) / (1 - f);
        a2 = (g * g - f) / (1 - f);
      }
      const std::size_t at = i * L + w;
      o.air[at] = static_cast<float>(air);
      o.aerosol[at] = static_cast<float>(aerosol);
      o.asymmetry[at] = static_cast<float>(g);
      o.s0[at] = static_cast<float>(air + scaled);
      o.s1[at] = static_cast<float>(3 * scaled * a1);
      o.s2[at] = static_cast<float>(7.5 * (air * x2 + scaled * a2));
      o.extinction(i, w) = air + scaled + absorbed;
      o.beam_extinction(i, w) =
          options.similarity ? air + aerosol + absorbed : air + scaled + absorbed;
    }
  }
  return o;
}

Medium beam_medium(const Medium& medium, const ExchangeOptics& optics) {
  Medium beam = medium;
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    for (std::size_t w = 0; w < medium.wavelengths(); ++w) {
      beam.aerosol_scattering_per_km(i, w) = std::max(
          0.0, optics.beam_extinction(i, w) - medium.air_scattering_per_km(i, w) -
                   medium.aerosol_absorption_per_km(i, w) - medium.gas_absorption_per_km(i, w));
    }
  }
  return beam;
}

ExchangeResult solve_exchange(const Medium& medium, const CellGrid& grid, const CellGrid* all_cells,
                              const DirectSunlight& sunlight, const SunGeometry& sun,
                              const ExchangeOptics& optics, const ExchangeOptions& options,
                              const RunControl& control) {
  const int S = grid.azimuth_divisions();
  const int nodes = S / 2 + 1;
  const std::size_t L = optics.lanes;
  const std::size_t W = medium.wavelengths();
  const auto& rings = grid.rings();
  const std::size_t n_air = grid.air_rings();
  // Lanes beyond the wavelengths stay dark.
  std::vector<float> albedo(L, 0.0F);
  for (std::size_t w = 0; w < std::min(W, options.ground_albedo.size()); ++w) {
    albedo[w] = static_cast<float>(options.ground_albedo[w]);
  }
  const bool ground = std::ranges::any_of(albedo, [](float a) { return a > 0; });
  const std::size_t n_all = ground ? rings.size() : n_air;
  const bool means = grid.options().cell_means;

  // One number per cell and wavelength suffices where every later event is isotropic.
  bool anisotropic = options.rayleigh || !options.similarity;
  const int nm = anisotropic ? kMoments : 1;
  const AzimuthModes modes(S, std::min(kMaxModes, nodes));
  const int M = modes.modes;
  const std::size_t block = idx(M) * idx(nm) * L;  // floats per ring in mode space

  ExchangeResult result;
  ExchangeReport& report = result.report;
  report.shells = grid.all_shells();
  report.active_shells = static_cast<int>(grid.shells().size());
  report.active_rings = n_air;
  report.ground_rings = rings.size() - n_air;
  report.active_cells = n_air * idx(S);
  report.azimuth_modes = M;
  const auto start = Clock::now();
  control.report("exchange: setup", 0.0);

  // Optical properties of every ring's cell.
  const ExchangeMedium transport = make_exchange_medium(medium, L, optics.extinction);
  RingOptics ro;
  for (auto* v : {&ro.s0, &ro.s1, &ro.s2, &ro.extinction, &ro.half_depth, &ro.self}) {
    v->assign(rings.size() * L, 0.0F);
  }
  ro.own_share.assign(rings.size() * L, 1.0F);
  ro.ground_scale.assign(rings.size() * L, 1.0F);
  ro.escape.assign(rings.size() * W, 0.0);
  ro.ground.assign(rings.size() * W, 0.0);
  for (std::size_t i = 0; i < n_air; ++i) {
    for (const auto& [layer, volume] : rings[i].layer_volume_km3) {
      for (std::size_t w = 0; w < W; ++w) {
        const std::size_t at = idx(layer) * L + w;
        const auto v = static_cast<float>(volume);
        ro.s0[i * L + w] += v * optics.s0[at];
        ro.s1[i * L + w] += v * optics.s1[at];
        ro.s2[i * L + w] += v * optics.s2[at];
        ro.extinction[i * L + w] += v * static_cast<float>(optics.extinction(idx(layer), w));
      }
    }
    for (std::size_t w = 0; w < W; ++w) {
      const double mean = ro.extinction[i * L + w] / rings[i].volume_km3;
      const double x = mean * rings[i].half_chord_km;
      ro.half_depth[i * L + w] = static_cast<float>(x);
      ro.own_share[i * L + w] =
          static_cast<float>(x > 1e-6 ? -std::expm1(-2 * x) / (2 * x) : 1.0 - x);
    }
  }
  std::vector<RingPoint> points(rings.size());
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const CellRing& ring = rings[i];
    RingPoint& p = points[i];
    p.rho_km = ring.rho_km;
    p.z_km = ring.z_km;
    p.altitude_km = ring.altitude_km;
    p.layer = ring.layer;
    p.ground = ring.ground;
    p.normal_r = ring.slope_r;
    p.normal_z = ring.slope_z;
    p.half_depth = &ro.half_depth[i * L];
    if (means) {
      p.axis_r = ring.ground ? ring.slope_z : std::cos(ring.elevation_rad);
      p.axis_z = ring.ground ? -ring.slope_r : std::sin(ring.elevation_rad);
      p.variance_radial_km2 = ring.radial_km * ring.radial_km / 12;
      p.variance_azimuthal_km2 = ring.azimuthal_km * ring.azimuthal_km / 12;
      p.variance_third_km2 = ring.third_km * ring.third_km / 12;
    } else if (!ring.ground) {
      // The paper's solid angle of a disc of area V^(2/3), (1 - cos atan(a/d))/2, saturates
      // like a^2/(4 d^2 + 3 a^2); half of it from either cell.
      p.blur_km2 = 0.12 * std::pow(ring.volume_km3, 2.0 / 3);
    }
  }

  struct Workspace {
    RingPairKernel kernel;
    std::vector<float> scaled, pair_modes;
  };
  tbb::enumerable_thread_specific<Workspace> workspaces([&] {
    Workspace w;
    w.kernel.resize(S, L, static_cast<int>(medium.layers()));
    w.scaled.assign((idx(nodes) + 16) * L, 0.0F);
    w.pair_modes.assign(idx(M) * L, 0.0F);
    return w;
  });
  std::atomic<std::uint64_t> evaluations{0};
  std::atomic<std::size_t> done{0};
  const int passes = std::max(0, options.scattering_orders - 1);
  const bool need_rows = means && passes > 0;

  // The paper's first aerosol event is summed directly: Henyey-Greenstein has modes that fall
  // like g^m, and the shadow's edge adds some of its own.
  float largest_g = 0.0F;
  bool aerosol_present = false;
  for (std::size_t i = 0; i < optics.aerosol.size(); ++i) {
    if (optics.aerosol[i] <= 0) continue;
    aerosol_present = true;
    largest_g = std::max(largest_g, std::abs(optics.asymmetry[i]));
  }
  const bool aerosol_first = options.similarity && aerosol_present;
  int source_modes = 0;
  if (aerosol_first && options.azimuth_tolerance > 0) {
    constexpr int kShadowModes = 8;
    const double fall = std::log(options.azimuth_tolerance) /
                        std::log(std::clamp(static_cast<double>(largest_g), 1e-6, 0.999));
    source_modes = std::min(S, kShadowModes + static_cast<int>(std::ceil(fall)));
  }

  // Kernels are symmetric in the pair: evaluated once, kept for both directions and all passes.
  KernelStore store(transport, points, n_air, modes, options.azimuth_tolerance, source_modes);
  if (passes > 0) {
    const std::uint64_t count = store.evaluate([&] { return &workspaces.local().kernel; },
                                               [&](double fraction) {
                                                 control.check();
                                                 control.report("exchange: kernels", fraction);
                                               });
    evaluations += count * W;
  }

  // Rows of the exchange: what a cell emits must arrive, reach the ground or leave. The
  // part that point-to-point kernels miss is what the cell's neighbourhood takes itself.
  std::atomic<std::size_t> clipped{0};
  if (need_rows) {
    // Light of cell s that the kernels bring to all other cells and to the ground.
    const auto row = [&](std::size_t s, std::vector<double>& air, std::vector<double>& earth) {
      auto& ws = workspaces.local();
      for (std::size_t t = 0; t < rings.size(); ++t) {
        if (!store.fetch(s, t, false, ws.kernel)) continue;
        auto& sum = t < n_air ? air : earth;
        for (int k = 0; k < ws.kernel.samples; ++k) {
          const auto at = idx(k) * kMoments;
          const double weight = ws.kernel.receive[at] * ws.kernel.emit[at];
          for (std::size_t w = 0; w < W; ++w) {
            const double size =
                t < n_air ? static_cast<double>(ro.extinction[t * L + w]) * ro.own_share[t * L + w]
                          : rings[t].volume_km3;
            sum[w] += weight * ws.kernel.value[idx(k) * L + w] * size;
          }
        }
      }
    };
    // Rows that would bring more than what interacts at all are shortened, both ways.
    std::vector<float> fit(rings.size() * L, 1.0F);
    tbb::parallel_for(std::size_t{0}, n_air, [&](std::size_t s) {
      control.check();
      emission_fractions(transport, grid, rings[s], W, &ro.escape[s * W], &ro.ground[s * W]);
      std::vector<double> air(L, 0.0), earth(L, 0.0);
      row(s, air, earth);
      for (std::size_t w = 0; w < W; ++w) {
        const double interacting = 1 - ro.escape[s * W + w] - ro.ground[s * W + w];
        const double brought = ro.own_share[s * L + w] * air[w];
        if (brought > interacting) {
          clipped.fetch_add(1, std::memory_order_relaxed);
          fit[s * L + w] = static_cast<float>(std::max(0.0, interacting) / brought);
        }
      }
    });
    for (std::size_t k = 0; k < fit.size(); ++k) ro.own_share[k] *= fit[k];
    tbb::parallel_for(std::size_t{0}, n_air, [&](std::size_t s) {
      control.check();
      std::vector<double> air(L, 0.0), earth(L, 0.0);
      row(s, air, earth);
      for (std::size_t w = 0; w < W; ++w) {
        const double own = ro.own_share[s * L + w];
        const double interacting = 1 - ro.escape[s * W + w] - ro.ground[s * W + w];
        const double rest = interacting - own * air[w];
        ro.self[s * L + w] = static_cast<float>(
            std::max(0.0, rest) / std::max(1e-30, static_cast<double>(ro.extinction[s * L + w])));
        ro.ground_scale[s * L + w] = static_cast<float>(
            earth[w] * own > 1e-12 ? std::min(10.0, ro.ground[s * W + w] / (earth[w] * own)) : 1.0);
      }
    });
    report.clipped_row_share =
        static_cast<double>(clipped) / std::max(1.0, static_cast<double>(n_air * W));
  }
  report.setup_seconds = seconds_since(start);

  // First event: power scattered out of the direct beam in every cell.
  const auto first_start = Clock::now();
  const FirstEvent first =
      first_event(medium, grid, n_all, sunlight, sun, optics, aerosol_first, albedo, nm);
  const auto& node_source = first.source;
  std::vector<float> aerosol_power = first.aerosol_power;
  for (std::size_t k = 0; k < aerosol_power.size(); ++k) {
    aerosol_power[k] *= ro.own_share[k / (idx(nodes) * L) * L + k % L];
  }
  const auto& lit = first.lit;
  const auto& ring_asymmetry = first.asymmetry;

  // Node values to modes: cosine series for even moments, sine series for odd ones.
  const auto to_modes = [&](const float* node, float* mode) {
    std::fill(mode, mode + block, 0.0F);
    for (int m = 0; m < M; ++m) {
      const double norm = (m == 0 || 2 * m == S) ? 1.0 / S : 2.0 / S;
      for (int j = 0; j < nodes; ++j) {
        const double twice = (j == 0 || 2 * j == S) ? 1.0 : 2.0;
        const auto at = idx(m) * idx(nodes) + idx(j);
        const auto c = static_cast<float>(norm * twice) * modes.cosine[at];
        const auto s = static_cast<float>(norm * twice) * modes.sine[at];
        for (int q = 0; q < nm; ++q) {
          const float f = q < kEvenMoments ? c : s;
          const float* src = node + (idx(j) * idx(nm) + idx(q)) * L;
          float* dst = mode + (idx(m) * idx(nm) + idx(q)) * L;
          for (std::size_t w = 0; w < L; ++w) dst[w] += f * src[w];
        }
      }
    }
  };
  const auto to_nodes = [&](const float* mode, float* node) {
    for (int j = 0; j < nodes; ++j) {
      for (int q = 0; q < nm; ++q) {
        float* dst = node + (idx(j) * idx(nm) + idx(q)) * L;
        for (int m = 0; m < M; ++m) {
          const auto at = idx(m) * idx(nodes) + idx(j);
          const float f = q < kEvenMoments ? modes.cosine[at] : modes.sine[at];
          const float* src = mode + (idx(m) * idx(nm) + idx(q)) * L;
          for (std::size_t w = 0; w < L; ++w) dst[w] += f * src[w];
        }
      }
    }
  };

  std::vector<float> source(n_all * block), field(n_all * block), total(n_all * block, 0.0F),
      sent(n_all * block);
  tbb::parallel_for(std::size_t{0}, n_all, [&](std::size_t i) {
    to_modes(&node_source[i * idx(nodes) * idx(nm) * L], &source[i * block]);
  });
  std::vector<float> ground_exitance;  // by diffuse light; the direct part is exact elsewhere
  if (ground) ground_exitance.assign((n_all - n_air) * idx(nodes) * L, 0.0F);

  const auto power_of = [&](const std::vector<float>& modes_of) {
    std::vector<double> p(W, 0.0);
    for (std::size_t i = 0; i < n_air; ++i) {
      for (std::size_t w = 0; w < W; ++w) {
        p[w] += static_cast<double>(S) * static_cast<double>(modes_of[i * block + w]);
      }
    }
    return p;
  };
  report.escaped.assign(W, 0.0);
  report.ground_absorbed.assign(W, 0.0);
  report.event_power.push_back(first.power);

  // The paper's ratio: what all shells emit over what the active ones do.
  std::vector<float> rescale(L, 1.0F);
  std::vector<PassiveRing> passive;
  const auto set_rescale = [&](const std::vector<double>& all, const std::vector<double>& active) {
    for (std::size_t w = 0; w < W; ++w) {
      // Where no active cell emits there is nothing to rescale.
      rescale[w] = active[w] > 0 ? static_cast<float>(std::min(all[w] / active[w], 1e6)) : 1.0F;
    }
  };
  if (all_cells != nullptr) {
    report.cells = all_cells->air_rings() * idx(S);
    report.rings = all_cells->air_rings();
  }
  if (options.rescale && all_cells != nullptr) {
    const FirstEvent every = first_event(medium, *all_cells, all_cells->air_rings(), sunlight, sun,
                                         optics, aerosol_first, albedo, 1);
    set_rescale(every.power, first.power);
    for (std::size_t w = 0; w < W; ++w) report.rescale_factor.push_back(rescale[w]);
    // Where every active shell's cells have their centres outside the air none is interpolated.
    if (n_air > 0) passive = passive_rings(grid, *all_cells);
  }

  const bool scalar = nm == 1;
  // The scalar exchange is a product of cosine modes: the kernels' modes serve all passes.
  const bool keep_modes =
      scalar && passes > 0 && store.mode_count() * L * sizeof(float) <= KernelStore::kLargestBytes;
  std::vector<float> pair_modes;
  if (keep_modes) {
    pair_modes.resize(store.mode_count() * L);
    tbb::parallel_for(std::size_t{0}, n_all, [&](std::size_t t) {
      control.check();
      auto& ws = workspaces.local();
      for (std::size_t s = 0; s <= t; ++s) {
        if (!store.fetch(s, t, false, ws.kernel)) continue;
        cosine_transform(ws.kernel, modes, &pair_modes[store.mode_offset(s, t) * L]);
      }
    });
  }
  report.first_event_seconds = seconds_since(first_start);

  const auto passes_start = Clock::now();
  for (int pass = 0; pass < passes; ++pass) {
    std::fill(field.begin(), field.end(), 0.0F);
    // What leaves a cell: its emission less what its own air takes.
    tbb::parallel_for(std::size_t{0}, n_all, [&](std::size_t i) {
      for (std::size_t k = 0; k < block; ++k) {
        sent[i * block + k] = source[i * block + k] * ro.own_share[i * L + k % L];
      }
    });
    done = 0;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n_all, 1), [&](const auto& range) {
      for (std::size_t t = range.begin(); t != range.end(); ++t) {
        control.check();
        auto& ws = workspaces.local();
        float* out = &field[t * block];
        if (pass == 0 && aerosol_first) {
          // Emission that depends on both azimuths: direct summation, once.
          std::vector<float> aerosol_field(idx(nodes) * L, 0.0F);
          for (std::size_t s = 0; s < n_air; ++s) {
            bool any_lit = false;
            for (int j = 0; j < nodes; ++j) any_lit |= lit[s * idx(nodes) + idx(j)] != 0;
            if (!any_lit || !store.fetch(s, t, false, ws.kernel)) continue;
            first_event_pass(ws.kernel, S, &aerosol_power[s * idx(nodes) * L], &lit[s * idx(nodes)],
                             &ring_asymmetry[s * L], sun.elevation_rad, aerosol_field.data());
          }
          std::vector<float> nodes_all(idx(nodes) * idx(nm) * L, 0.0F), mode(block);
          for (int j = 0; j < nodes; ++j) {
            std::copy_n(&aerosol_field[idx(j) * L], L, &nodes_all[idx(j) * idx(nm) * L]);
          }
          to_modes(nodes_all.data(), mode.data());
          for (std::size_t k = 0; k < block; ++k) out[k] += mode[k];
        }
        const bool target_ground = t >= n_air;
        for (std::size_t s = 0; s < n_all; ++s) {
          const bool source_ground = s >= n_air;
          if (source_ground && target_ground) continue;  // the ground is convex
          // The same correction both ways keeps a pair with the ground reciprocal.
          const float* scale = source_ground   ? &ro.ground_scale[t * L]
                               : target_ground ? &ro.ground_scale[s * L]
                                               : nullptr;
          if (scalar) {
            if (!store.lit(s, t)) continue;
            // Stored from air to ground; the ground's Lambertian emission is four cosines.
            const float factor = source_ground ? 4.0F : 1.0F;
            const std::size_t used = idx(store.modes(s, t)) * L;
            const float* k = nullptr;
            if (keep_modes) {
              k = &pair_modes[store.mode_offset(s, t) * L];
            } else {
              store.fetch(std::min(s, t), std::max(s, t), false, ws.kernel);
              cosine_transform(ws.kernel, modes, ws.pair_modes.data());
              k = ws.pair_modes.data();
            }
            if (scale != nullptr) {
              for (std::size_t i = 0; i < used; ++i) ws.scaled[i] = k[i] * scale[i % L];
              k = ws.scaled.data();
            }
            multiply_add(k, &sent[s * block], factor, used, out);
            continue;
          }
          if (!store.fetch(s, t, true, ws.kernel)) continue;
          if (scale != nullptr) {
            for (std::size_t i = 0; i < idx(ws.kernel.samples) * L; ++i) {
              ws.scaled[i] = ws.kernel.value[i] * scale[i % L];
            }
            ws.kernel.value = ws.scaled.data();
          }
          moment_pass(ws.kernel, modes, &sent[s * block], out);
        }
        const std::size_t finished = ++done;
        if (finished % 64 == 0) {
          control.report(
              "exchange",
              (pass + static_cast<double>(finished) / static_cast<double>(n_all)) / passes);
        }
      }
    });
    // Own light, own attenuation, and the next event's sources.
    for (std::size_t i = 0; i < n_air; ++i) {
      for (std::size_t w = 0; w < W; ++w) {
        report.escaped[w] += static_cast<double>(S) * static_cast<double>(source[i * block + w]) *
                             ro.escape[i * W + w];
        report.ground_absorbed[w] +=
            (1.0 - static_cast<double>(albedo[w])) * static_cast<double>(S) *
            static_cast<double>(source[i * block + w]) * ro.ground[i * W + w];
      }
    }
    tbb::parallel_for(std::size_t{0}, n_all, [&](std::size_t i) {
      float* f = &field[i * block];
      float* q = &source[i * block];
      float* sum = &total[i * block];
      for (int m = 0; m < M; ++m) {
        for (int c = 0; c < nm; ++c) {
          for (std::size_t w = 0; w < L; ++w) {
            const std::size_t at = (idx(m) * idx(nm) + idx(c)) * L + w;
            float value = f[at] * ro.own_share[i * L + w] * rescale[w];
            if (i < n_air) {
              // Moments that a uniform neighbourhood sends itself: the mean of (w.F)w is F/3,
              // of (w.S.w)(ww - 1/3) it is 2S/15; off-diagonal sources carry S once.
              const float gain =
                  c == kJ ? 1.0F : (c == kFr || c == kFz || c == kFa ? 1.0F / 3 : 2.0F / 15);
              value += gain * ro.self[i * L + w] * q[at];
            }
            f[at] = value;
            sum[at] += value;
          }
        }
      }
      for (int m = 0; m < M; ++m) {
        for (int c = 0; c < nm; ++c) {
          for (std::size_t w = 0; w < L; ++w) {
            const std::size_t at = (idx(m) * idx(nm) + idx(c)) * L + w;
            if (i >= n_air) {
              q[at] = c == kJ ? f[at] * albedo[w] * static_cast<float>(rings[i].volume_km3) : 0.0F;
              continue;
            }
            const float s =
                c == kJ ? ro.s0[i * L + w]
                        : (c == kFr || c == kFz || c == kFa ? ro.s1[i * L + w] : ro.s2[i * L + w]);
            // (emission is spread over the cell as its own light is: source side share)
            q[at] = f[at] * s;
          }
        }
      }
    });
    report.event_power.push_back(power_of(source));
    if (!passive.empty()) {
      // Passive shells by linear interpolation of the arriving light between active ones.
      std::vector<double> all(W, 0.0);
      for (std::size_t i = 0; i < passive.size(); ++i) {
        const PassiveRing& p = passive[i];
        const CellRing& ring = all_cells->rings()[i];
        for (const auto& [layer, volume] : ring.layer_volume_km3) {
          for (std::size_t w = 0; w < W; ++w) {
            const double light = p.weight[0] * static_cast<double>(field[p.ring[0] * block + w]) +
                                 p.weight[1] * static_cast<double>(field[p.ring[1] * block + w]);
            all[w] += S * light * volume * static_cast<double>(optics.s0[idx(layer) * L + w]);
          }
        }
      }
      set_rescale(all, report.event_power.back());
    }
    control.report("exchange", static_cast<double>(pass + 1) / passes);
  }
  report.kernel_evaluations = evaluations;
  report.passes_seconds = seconds_since(passes_start);

  CellField& cell_field = result.field;
  cell_field.lanes = L;
  cell_field.nodes = nodes;
  cell_field.moments = nm;
  cell_field.values.assign(n_air * idx(nodes) * idx(nm) * L, 0.0F);
  tbb::parallel_for(std::size_t{0}, n_air, [&](std::size_t i) {
    float* v = &cell_field.values[i * idx(nodes) * idx(nm) * L];
    to_nodes(&total[i * block], v);
    for (int j = 0; j < nodes; ++j) {
      for (std::size_t w = 0; w < L; ++w) {
        float& mean = v[idx(j) * idx(nm) * L + kJ * L + w];
        mean = std::max(mean, 0.0F);  // truncated series may ring below zero in the dark
      }
    }
  });
  if (ground) {
    std::vector<float> node(idx(nodes) * idx(nm) * L);
    for (std::size_t i = n_air; i < n_all; ++i) {
      std::fill(node.begin(), node.end(), 0.0F);
      to_nodes(&total[i * block], node.data());
      for (int j = 0; j < nodes; ++j) {
        for (std::size_t w = 0; w < L; ++w) {
          ground_exitance[((i - n_air) * idx(nodes) + idx(j)) * L + w] +=
              albedo[w] * std::max(0.0F, node[idx(j) * idx(nm) * L + w]);
        }
      }
    }
  }
  result.ground_exitance = std::move(ground_exitance);
  return result;
}

}  // namespace twilight
