#include "sim/orders.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/angular_moments.h"
#include "sim/gauss_legendre.h"
#include "sim/orders_kernel.h"
#include "sim/spectral_lanes.h"
#include "sim/sun_disc_profile.h"
#include "sim/zenith_grid.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kRadPerDeg = pi / 180;
constexpr int kMostOrders = 500;
// Below this a value is night without a sky: keeps floats out of the denormals.
constexpr double kDark = 1e-30;
// Azimuthal modes of a source below this share of its mean are left out: far below the
// quadratures' errors, and most of the work with aerosols.
constexpr double kNegligibleModeShare = 1e-4;
// Degrees to which light scattered once, and twice or more, is scattered on between the field's
// points; the last scattering, into the view, has all.
constexpr int kFirstDegree = 16, kSmoothDegree = 8;

// The light that is scattered next, on levels of altitude and nodes of solar zenith angle, relative
// to a reference that falls as steeply as the light itself.
template <class T>
struct Source {
  std::vector<double> level_km;
  const ZenithGrid* zenith = nullptr;
  std::size_t aerosol_levels = 0;
  int phase_degree = 0;          // of the moments that scatter
  std::vector<T> coherency;      // [level][node][4][lane]
  std::vector<T> moments;        // [aerosol level][node][k][lane]
  std::vector<T> reference;      // [level][fine][lane]
  std::vector<std::size_t> end;  // [level], fine points from which the reference is 0
  std::vector<T> ground;         // irradiance of the ground, [fine][lane]
  std::size_t ground_end = 0;
  // Direct sunlight has no moments: its apparent direction, [level][fine], instead.
  bool beam = false;
  std::vector<T> cos_sun, sin_sun;
};

// Light that arrives, on the field's own grid.
template <class T>
struct Incoming {
  std::vector<T> coherency, moments, ground;
};

struct Direction {
  double zenith_rad, weight;  // weight: of the cosine
};

// Incoming directions at an altitude: above the horizontal, between it and the ground's horizon
// (the limb, a thin bright belt), and the ground; Gauss nodes crowd at the horizontal.
std::vector<Direction> polar_directions(double radius_km, double altitude_km, int count) {
  std::vector<Direction> directions;
  const double sine = std::min(1.0, radius_km / (radius_km + altitude_km));
  const double dip = std::acos(sine);  // of the horizon below the horizontal
  const bool limb = altitude_km > 1e-3;
  // However few, enough above and below that moments of the light integrate to what they are: with
  // two directions in the upper half, thick white haze scattered more than arrived.
  const int down = std::max(count < 12 ? 3 : 4, count / 6);
  const int middle = limb ? std::max(2, std::min(5 * count / 12, (count - 6) / 2)) : 0;
  const int up = count - down - middle;
  for (const GaussNode& g : gauss_legendre(up, 0, 1)) {
    directions.push_back({std::acos(g.x * g.x), 2 * g.x * g.weight});
  }
  if (limb) {
    for (const GaussNode& g : gauss_legendre(middle, 0, dip)) {
      directions.push_back({pi / 2 + g.x, std::cos(g.x) * g.weight});
    }
  }
  const double edge = limb ? std::sin(dip) : 0.0;
  for (const GaussNode& g : gauss_legendre(down, 0, 1)) {
    const double cosine = edge + (1 - edge) * g.x * g.x;
    directions.push_back({std::acos(-cosine), 2 * g.x * (1 - edge) * g.weight});
  }
  return directions;
}

template <class T>
class Solver {
 public:
  Solver(const OrdersMedium& medium, const DirectSunlight& sunlight, const OrdersOptions& options,
         const RunControl& control)
      : medium_(medium),
        sunlight_(sunlight),
        options_(options),
        control_(control),
        lanes_(medium.lanes),
        stokes_(options.polarised ? 3 : 1),
        zenith_(options.zenith_step_deg),
        levels_(orders_levels(medium.truncated.top_km(), options.altitude_levels)),
        moments_(medium.degree > 0 ? stokes_ * moment_count(medium.degree) : 0) {
    aerosol_levels_ = aerosol_levels(levels_);
    anisotropic_share_.assign(medium.anisotropic_share.begin(), medium.anisotropic_share.end());
    tabulate_phases();
    const std::size_t azimuths = static_cast<std::size_t>(options.azimuth_directions);
    const std::size_t nodes = zenith_.size();
    for (std::size_t q = 0; q < azimuths; ++q) {
      const double phi = (static_cast<double>(q) + 0.5) * pi / static_cast<double>(azimuths);
      cos_azimuth_.push_back(static_cast<T>(std::cos(phi)));
      sin_azimuth_.push_back(static_cast<T>(std::sin(phi)));
    }
    pairs_ = nodes * azimuths;
    const std::size_t padded = (pairs_ + 15) / 16 * 16;
    for (auto* v : {&cos_chi_, &sin_chi_, &cos_phi_, &sin_phi_}) v->assign(padded, T(0));
    for (std::size_t j = 0; j < nodes; ++j) {
      for (std::size_t q = 0; q < azimuths; ++q) {
        const std::size_t i = j * azimuths + q;
        cos_chi_[i] = static_cast<T>(std::cos(zenith_.zenith_rad()[j]));
        sin_chi_[i] = static_cast<T>(std::sin(zenith_.zenith_rad()[j]));
        cos_phi_[i] = cos_azimuth_[q];
        sin_phi_[i] = sin_azimuth_[q];
      }
    }
    for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
      const double t = zenith_.fine_position()[k];
      fine_stencil_.push_back(ZenithGrid::stencil(t, nodes));
    }
  }

  OrdersField solve() {
    OrdersField field;
    field.wavelength_nm = medium_.truncated.wavelength_nm;
    field.altitude_km = levels_;
    field.solar_zenith_rad = zenith_.zenith_rad();
    field.zenith_step_deg = options_.zenith_step_deg;
    field.phase_degree = medium_.degree;
    field.polarised = options_.polarised;
    field.aerosol_levels = aerosol_levels_;
    field.moments_per_node = moments_;
    const int most = options_.scattering_orders.value_or(kMostOrders);

    Incoming<T> total = empty(), last;
    std::vector<std::vector<double>> shares;
    field.orders = 1;
    for (int order = 1; order < most; ++order) {
      control_.check();
      control_.report("orders", 1 - std::pow(0.7, order - 1));
      const Source<T> source = order == 1 ? beam_source() : light_source(last, order - 1);
      Incoming<T> light = scatter(source, order == 1 ? 0.25 : 0.5);
      const double rest = add(light, last, total);
      shares.push_back(mean_radiance(light));
      field.orders = order + 1;
      // The orders left out are nearly a geometric series, so that nearly all of them can be added.
      constexpr double kSeriesError = 0.05;
      if (kSeriesError * rest < options_.order_tolerance && !options_.scattering_orders) {
        add_series(light, last, total);
        break;
      }
      last = std::move(light);
    }
    const std::vector<double> sum = mean_radiance(total);
    for (const auto& share : shares) {
      for (std::size_t w = 0; w < field.wavelength_nm.size(); ++w) {
        field.order_share.push_back(sum[w] > 0 ? share[w] / sum[w] : 0.0);
      }
    }
    const std::size_t wavelengths = field.wavelength_nm.size();
    const auto unpad = [&](const std::vector<T>& padded) {
      std::vector<float> values;
      values.reserve(padded.size() / lanes_ * wavelengths);
      for (std::size_t i = 0; i < padded.size(); i += lanes_) {
        for (std::size_t w = 0; w < wavelengths; ++w) {
          values.push_back(static_cast<float>(padded[i + w]));
        }
      }
      return values;
    };
    field.coherency = unpad(total.coherency);
    field.aerosol_moments = unpad(total.moments);
    field.ground_irradiance = unpad(total.ground);
    return field;
  }

 private:
  std::size_t aerosol_levels(const std::vector<double>& levels) const {
    if (medium_.degree == 0) return 0;
    // Levels above the aerosol take part in the interpolation, three where it is cubic.
    const auto above = std::ranges::lower_bound(levels, medium_.aerosol_top_km - 1e-9);
    return std::min(static_cast<std::size_t>(above - levels.begin()) + 4, levels.size());
  }

  Incoming<T> empty() const {
    const std::size_t nodes = zenith_.size();
    return {std::vector<T>(levels_.size() * nodes * 4 * lanes_),
            std::vector<T>(aerosol_levels_ * nodes * moments_ * lanes_),
            std::vector<T>(nodes * lanes_)};
  }

  // Direct sunlight on levels finer than the field's, for it has edges; its moments are known.
  Source<T> beam_source() const {
    Source<T> source;
    constexpr int kDivide = 6;
    for (std::size_t i = 0; i + 1 < levels_.size(); ++i) {
      for (int k = 0; k < kDivide; ++k) {
        source.level_km.push_back(levels_[i] + (levels_[i + 1] - levels_[i]) * k / kDivide);
      }
    }
    source.level_km.push_back(levels_.back());
    source.zenith = &zenith_;
    source.beam = true;
    const std::size_t count = source.level_km.size();
    source.reference.assign(count * ZenithGrid::kFineSize * lanes_, T(0));
    source.end.assign(count, 0);
    source.ground.assign(ZenithGrid::kFineSize * lanes_, T(0));
    source.cos_sun.resize(count * ZenithGrid::kFineSize);
    source.sin_sun.resize(count * ZenithGrid::kFineSize);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      const double z = source.level_km[i];
      std::vector<float> beam(ZenithGrid::kFineSize * lanes_);
      beam_row(sunlight_, options_, medium_.truncated.wavelength_nm, z, beam);
      T* reference = &source.reference[i * ZenithGrid::kFineSize * lanes_];
      for (std::size_t k = 0; k < beam.size(); ++k) {
        const bool lit = beam[k] > kDark;
        reference[k] = lit ? static_cast<T>(beam[k]) : T(0);
        if (lit) source.end[i] = k / lanes_ + 1;
      }
      source.end[i] = std::min(source.end[i], ZenithGrid::kFineSize - 1);
      for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
        const double chi =
            std::min(static_cast<double>(k) * ZenithGrid::kFineStep_deg * kRadPerDeg, pi);
        if (k > source.end[i] + 1) break;
        const double a = sunlight_.apparent_zenith_rad(z, chi);
        source.cos_sun[i * ZenithGrid::kFineSize + k] = static_cast<T>(std::cos(a));
        source.sin_sun[i * ZenithGrid::kFineSize + k] = static_cast<T>(std::sin(a));
        if (i > 0) continue;
        for (std::size_t w = 0; w < lanes_; ++w) {
          source.ground[k * lanes_ + w] =
              reference[k * lanes_ + w] * static_cast<T>(std::max(std::cos(a), 0.0));
        }
      }
      if (i == 0) source.ground_end = source.end[0];
    });
    return source;
  }

  // p11 and p12 of the truncated kinds at equal steps of the cosine.
  void tabulate_phases() {
    const std::size_t kinds = medium_.kinds.size();
    phase_.assign(kinds * kPhaseNodes * 2 * lanes_, T(0));
    for (std::size_t k = 0; kinds > 0 && k < kPhaseNodes; ++k) {
      const double x = -1 + 2 * static_cast<double>(k) / (kPhaseNodes - 1);
      const AngularBasis basis = angular_basis(medium_.degree, std::acos(std::clamp(x, -1.0, 1.0)));
      for (std::size_t q = 0; q < kinds; ++q) {
        const TruncatedPhase& kind = medium_.kinds[q];
        for (std::size_t w = 0; w < lanes_; ++w) {
          double p11 = 0, p12 = 0;
          for (int l = 0; l <= medium_.degree; ++l) {
            const std::size_t at = static_cast<std::size_t>(l) * lanes_ + w;
            p11 += kind.a1[at] * basis.p[moment_index(l, 0)];
            p12 += kind.b1[at] * basis.r[moment_index(l, 0)];
          }
          T* out = &phase_[((q * kPhaseNodes + k) * 2) * lanes_ + w];
          out[0] = static_cast<T>(p11);
          out[lanes_] = static_cast<T>(p12);
        }
      }
    }
  }

  // The tensor that scatters like C in air that depolarises: Delta C + (1 - Delta) (tr C / 3) 1.
  void put_coherency(T* at, std::size_t w, double xx, double yy, double zz, double xz) const {
    const double share = medium_.anisotropic_share[w];
    const double mean = (1 - share) * (xx + yy + zz) / 3;
    at[0] = static_cast<T>(share * xx + mean);
    at[lanes_] = static_cast<T>(share * yy + mean);
    at[2 * lanes_] = static_cast<T>(share * zz + mean);
    at[3 * lanes_] = static_cast<T>(share * xz);
  }

  // Light of order 1 still carries the aerosol's forward scattering; later ones are smooth.
  Source<T> light_source(const Incoming<T>& light, int order) const {
    Source<T> source;
    source.phase_degree = std::min(medium_.degree, order == 1 ? kFirstDegree : kSmoothDegree);
    source.level_km = levels_;
    source.zenith = &zenith_;
    source.aerosol_levels = aerosol_levels_;
    const std::size_t nodes = zenith_.size(), count = levels_.size();
    source.coherency.assign(light.coherency.size(), T(0));
    source.moments.assign(light.moments.size(), T(0));
    source.reference.assign(count * ZenithGrid::kFineSize * lanes_, T(0));
    source.end.assign(count, ZenithGrid::kFineSize - 1);
    source.ground.assign(ZenithGrid::kFineSize * lanes_, T(0));
    source.ground_end = ZenithGrid::kFineSize - 1;
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      std::vector<double> trace(nodes * lanes_);
      for (std::size_t j = 0; j < nodes; ++j) {
        const T* C = &light.coherency[(i * nodes + j) * 4 * lanes_];
        T* out = &source.coherency[(i * nodes + j) * 4 * lanes_];
        for (std::size_t w = 0; w < lanes_; ++w) {
          const double xx = C[w], yy = C[lanes_ + w], zz = C[2 * lanes_ + w];
          const double sum = xx + yy + zz;
          // Cubic paths may leave a trace of either sign where it is all but dark.
          if (!(sum > kDark) || std::min({xx, yy, zz}) < 0) continue;
          trace[j * lanes_ + w] = sum;
          put_coherency(out + w, w, xx / sum, yy / sum, zz / sum, C[3 * lanes_ + w] / sum);
        }
        if (i >= aerosol_levels_) continue;
        const std::size_t at = (i * nodes + j) * moments_ * lanes_;
        for (std::size_t k = 0; k < moments_; ++k) {
          for (std::size_t w = 0; w < lanes_; ++w) {
            const double sum = trace[j * lanes_ + w];
            if (sum > 0) {
              source.moments[at + k * lanes_ + w] =
                  static_cast<T>(light.moments[at + k * lanes_ + w] / sum);
            }
          }
        }
      }
      refine(trace.data(), &source.reference[i * ZenithGrid::kFineSize * lanes_]);
    });
    std::vector<double> ground(light.ground.begin(), light.ground.end());
    refine(ground.data(), source.ground.data());
    return source;
  }

  // From nodes to the fine scale, cubic in the logarithm.
  void refine(const double* nodes, T* fine) const {
    std::vector<double> logs(zenith_.size() * lanes_);
    for (std::size_t i = 0; i < logs.size(); ++i) {
      logs[i] = nodes[i] > 0 ? std::log(nodes[i]) : -1e30;
    }
    for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
      const ZenithGrid::Stencil& s = fine_stencil_[k];
      for (std::size_t w = 0; w < lanes_; ++w) {
        double sum = 0;
        bool dark = false;
        for (std::size_t q = 0; q < 4; ++q) {
          const double value = logs[(s.first + q) * lanes_ + w];
          dark = dark || value < -1e29;
          sum += s.weight[q] * value;
        }
        if (!dark) {
          fine[k * lanes_ + w] = static_cast<T>(std::exp(sum));
          continue;
        }
        double linear = 0;
        for (std::size_t q = 0; q < 4; ++q) {
          linear += s.weight[q] * nodes[(s.first + q) * lanes_ + w];
        }
        fine[k * lanes_ + w] = static_cast<T>(std::max(linear, 0.0));
      }
    }
  }

  Incoming<T> scatter(const Source<T>& source, double max_angle_deg) const {
    Incoming<T> light = empty();
    std::atomic<bool> stopped = false;
    tbb::parallel_for(std::size_t{0}, levels_.size(), [&](std::size_t i) {
      if (stopped) return;
      try {
        control_.check();
      } catch (const Cancelled&) {
        stopped = true;
        return;
      }
      gather_level(source, i, max_angle_deg * kRadPerDeg, light);
    });
    control_.check();
    return light;
  }

  // All light that arrives at one level.
  void gather_level(const Source<T>& source, std::size_t level, double max_angle_rad,
                    Incoming<T>& light) const {
    const Medium& m = medium_.truncated;
    const std::size_t nodes = zenith_.size();
    const std::size_t columns = 1 + medium_.kinds.size();
    const double altitude = levels_[level];
    const int degree = std::max(2, medium_.degree);
    const std::size_t source_nodes = source.zenith->size();
    const std::size_t degrees = static_cast<std::size_t>(medium_.degree) + 1;
    std::vector<T> modes(source_nodes * stokes_ * static_cast<std::size_t>(degree + 1) * lanes_);
    std::vector<T> out(pairs_ * stokes_ * lanes_);
    std::vector<T> scratch(3 * ((pairs_ + 15) / 16 * 16));
    std::vector<T> moment_scratch(3 * degrees * lanes_);
    std::vector<T> air_weight(lanes_), ground_weight(lanes_);
    std::vector<T> kind_weight(medium_.kinds.size() * lanes_);
    std::vector<T> a1(degrees * lanes_), b1(a1), a2(a1), a3(a1);
    std::vector<T> p(moment_count(medium_.degree)), r(p), t(p);
    SampledPath path;
    for (const Direction& direction :
         polar_directions(m.earth_radius_km, altitude, options_.polar_directions)) {
      sample_path(medium_.optics, source.level_km, altitude, direction.zenith_rad, max_angle_rad,
                  source.beam ? SourceShape::kLinear : SourceShape::kCubic, path);
      std::fill(out.begin(), out.end(), T(0));
      GatherInput<T> gather;
      gather.pairs = pairs_;
      gather.cos_chi = cos_chi_.data();
      gather.sin_chi = sin_chi_.data();
      gather.cos_phi = cos_phi_.data();
      gather.sin_phi = sin_phi_.data();
      gather.lanes = lanes_;
      gather.polarised = options_.polarised;
      gather.nodes = source_nodes;
      gather.modes = modes.data();
      gather.fine_position = source.zenith->fine_position().data();
      gather.fine_per_radian = static_cast<T>(1 / (ZenithGrid::kFineStep_deg * kRadPerDeg));
      gather.scratch = scratch.data();
      for (std::size_t k = 0; k < path.samples.size(); ++k) {
        const PathSample& sample = path.samples[k];
        const auto at = static_cast<std::size_t>(sample.level);
        if (source.end[at] == 0) continue;
        const double* weight = &path.weight[k * columns * lanes_];
        SourceModesInput<T> in;
        in.nodes = source_nodes;
        in.lanes = lanes_;
        in.polarised = options_.polarised;
        in.cos_theta = static_cast<T>(std::cos(sample.zenith_rad));
        in.sin_theta = static_cast<T>(std::sin(sample.zenith_rad));
        in.air_weight = air_weight.data();
        for (std::size_t w = 0; w < lanes_; ++w) {
          air_weight[w] = static_cast<T>(3 / (8 * pi) * weight[w]);
        }
        gather.cos_psi = static_cast<T>(std::cos(sample.central_angle_rad));
        gather.sin_psi = static_cast<T>(std::sin(sample.central_angle_rad));
        gather.reference = &source.reference[at * ZenithGrid::kFineSize * lanes_];
        gather.fine_end = source.end[at];
        if (source.beam) {
          BeamInput<T> beam;
          beam.gather = gather;
          beam.cos_theta = in.cos_theta;
          beam.sin_theta = in.sin_theta;
          beam.cos_sun = &source.cos_sun[at * ZenithGrid::kFineSize];
          beam.sin_sun = &source.sin_sun[at * ZenithGrid::kFineSize];
          beam.air_weight = air_weight.data();
          beam.anisotropic_share = anisotropic_share_.data();
          bool aerosol = false;
          for (std::size_t k = 0; k < kind_weight.size(); ++k) {
            kind_weight[k] = static_cast<T>(weight[lanes_ + k] / (4 * pi));
            aerosol = aerosol || kind_weight[k] != 0;
          }
          beam.kinds = aerosol ? medium_.kinds.size() : 0;
          beam.phase_nodes = kPhaseNodes;
          beam.kind_weight = kind_weight.data();
          beam.phase = phase_.data();
          gather_beam(beam, out.data());
          continue;
        }
        in.coherency = &source.coherency[at * source_nodes * 4 * lanes_];
        if (at < source.aerosol_levels && weigh_aerosol(weight, a1, b1, a2, a3)) {
          in.degree = std::max(2, source.phase_degree);
          in.phase_degree = source.phase_degree;
          in.stored_phase_degree = medium_.degree;
          fill_basis(sample.zenith_rad, true, p, r, t);
          in.moments = &source.moments[at * source_nodes * moments_ * lanes_];
          in.p = p.data();
          in.r = r.data();
          in.t = t.data();
          in.a1 = a1.data();
          in.b1 = b1.data();
          in.a2 = a2.data();
          in.a3 = a3.data();
        }
        source_modes(in, modes.data());
        gather.stored_degree = in.degree;
        gather.degree = in.degree > 2 ? significant_degree(in, modes.data(),
                                                           static_cast<T>(kNegligibleModeShare))
                                      : in.degree;
        gather_modes(gather, out.data());
      }
      if (path.hits_ground && options_.ground_light) {
        for (std::size_t w = 0; w < lanes_; ++w) {
          ground_weight[w] =
              static_cast<T>(path.ground_transmittance[w] * medium_.ground_albedo[w] / pi);
        }
        gather.cos_psi = static_cast<T>(std::cos(path.ground_angle_rad));
        gather.sin_psi = static_cast<T>(std::sin(path.ground_angle_rad));
        gather.reference = source.ground.data();
        gather.fine_end = source.ground_end;
        gather_ground(gather, ground_weight.data(), stokes_ * lanes_, out.data());
      }
      MomentInput<T> in;
      in.nodes = nodes;
      in.azimuths = cos_azimuth_.size();
      in.lanes = lanes_;
      in.polarised = options_.polarised;
      in.cos_theta = static_cast<T>(std::cos(direction.zenith_rad));
      in.sin_theta = static_cast<T>(std::sin(direction.zenith_rad));
      in.weight = static_cast<T>(2 * direction.weight * pi / options_.azimuth_directions);
      in.cos_phi = cos_azimuth_.data();
      in.sin_phi = sin_azimuth_.data();
      in.light = out.data();
      T* moments = nullptr;
      if (level < aerosol_levels_) {
        in.phase_degree = medium_.degree;
        fill_basis(direction.zenith_rad, false, p, r, t);
        in.p = p.data();
        in.r = r.data();
        in.t = t.data();
        in.scratch = moment_scratch.data();
        moments = &light.moments[level * nodes * moments_ * lanes_];
      }
      add_moments(in, &light.coherency[level * nodes * 4 * lanes_], moments);
      if (level == 0 && direction.zenith_rad < pi / 2) {
        const T flux = in.weight * in.cos_theta;
        for (std::size_t j = 0; j < nodes; ++j) {
          for (std::size_t q = 0; q < cos_azimuth_.size(); ++q) {
            const T* I = &out[(j * cos_azimuth_.size() + q) * stokes_ * lanes_];
            for (std::size_t w = 0; w < lanes_; ++w) light.ground[j * lanes_ + w] += flux * I[w];
          }
        }
      }
    }
  }

  // Expansion coefficients of the kinds times their weights; false where there is no aerosol.
  bool weigh_aerosol(const double* weight, std::vector<T>& a1, std::vector<T>& b1,
                     std::vector<T>& a2, std::vector<T>& a3) const {
    bool any = false;
    for (std::size_t q = 0; q < medium_.kinds.size(); ++q) {
      const double* here = weight + (1 + q) * lanes_;
      if (std::all_of(here, here + lanes_, [](double x) { return x == 0; })) continue;
      const TruncatedPhase& kind = medium_.kinds[q];
      if (!any) {
        for (auto* v : {&a1, &b1, &a2, &a3}) std::fill(v->begin(), v->end(), T(0));
      }
      any = true;
      for (std::size_t k = 0; k < a1.size(); ++k) {
        const double x = here[k % lanes_];
        a1[k] += static_cast<T>(x * kind.a1[k]);
        b1[k] += static_cast<T>(x * kind.b1[k]);
        a2[k] += static_cast<T>(x * kind.a2[k]);
        a3[k] += static_cast<T>(x * kind.a3[k]);
      }
    }
    return any;
  }

  void fill_basis(double theta, bool emission, std::vector<T>& p, std::vector<T>& r,
                  std::vector<T>& t) const {
    const AngularBasis basis = angular_basis(medium_.degree, theta);
    for (int l = 0; l <= medium_.degree; ++l) {
      for (int m = 0; m <= l; ++m) {
        const double factor = emission ? (m > 0 ? 2 : 1) / (4 * pi) : 1.0;
        const std::size_t i = moment_index(l, m);
        p[i] = static_cast<T>(factor * basis.p[i]);
        r[i] = static_cast<T>(factor * basis.r[i]);
        t[i] = static_cast<T>(factor * basis.t[i]);
      }
    }
  }

  // Adds an order; the largest share of any value that the orders left out can add.
  double add(const Incoming<T>& light, const Incoming<T>& before, Incoming<T>& total) const {
    for (std::size_t i = 0; i < light.moments.size(); ++i) total.moments[i] += light.moments[i];
    for (std::size_t i = 0; i < light.ground.size(); ++i) total.ground[i] += light.ground[i];
    double rest = 0;
    constexpr double kDeepest = 109 * kRadPerDeg;
    const std::size_t nodes = zenith_.size();
    for (std::size_t i = 0; i < levels_.size(); ++i) {
      for (std::size_t j = 0; j < nodes; ++j) {
        const std::size_t at = (i * nodes + j) * 4 * lanes_;
        for (std::size_t k = at; k < at + 4 * lanes_; ++k) total.coherency[k] += light.coherency[k];
        if (zenith_.zenith_rad()[j] > kDeepest) continue;
        for (std::size_t w = 0; w < medium_.truncated.wavelengths(); ++w) {
          const auto trace = [&](const Incoming<T>& x) {
            const T* C = &x.coherency[at + w];
            return static_cast<double>(C[0]) + static_cast<double>(C[lanes_]) +
                   static_cast<double>(C[2 * lanes_]);
          };
          const double now = trace(light), sum = trace(total);
          if (!(sum > kDark)) continue;
          const double past = before.coherency.empty() ? 0 : trace(before);
          const double ratio = past > 0 ? std::min(now / past, 0.99999) : 0.9;
          rest = std::max(rest, now / sum * ratio / (1 - ratio));
        }
      }
    }
    return rest;
  }

  // Adds what follows an order when every one is to the order before as this one is to the last.
  void add_series(const Incoming<T>& light, const Incoming<T>& before, Incoming<T>& total) const {
    if (before.coherency.empty()) return;
    const std::size_t nodes = zenith_.size();
    const auto factor = [](double now, double past) {
      constexpr double kMostRatio = 0.999;
      const double ratio = past > 0 ? std::clamp(now / past, 0.0, kMostRatio) : 0.0;
      return ratio / (1 - ratio);
    };
    tbb::parallel_for(std::size_t{0}, levels_.size(), [&](std::size_t i) {
      for (std::size_t j = 0; j < nodes; ++j) {
        const std::size_t C = (i * nodes + j) * 4 * lanes_;
        for (std::size_t w = 0; w < lanes_; ++w) {
          const auto trace = [&](const Incoming<T>& x) {
            const T* at = &x.coherency[C + w];
            return static_cast<double>(at[0]) + static_cast<double>(at[lanes_]) +
                   static_cast<double>(at[2 * lanes_]);
          };
          const T more = static_cast<T>(factor(trace(light), trace(before)));
          for (std::size_t k = 0; k < 4; ++k) {
            total.coherency[C + k * lanes_ + w] += more * light.coherency[C + k * lanes_ + w];
          }
          if (i >= aerosol_levels_) continue;
          const std::size_t M = (i * nodes + j) * moments_ * lanes_ + w;
          for (std::size_t k = 0; k < moments_; ++k) {
            total.moments[M + k * lanes_] += more * light.moments[M + k * lanes_];
          }
        }
      }
    });
    for (std::size_t k = 0; k < light.ground.size(); ++k) {
      total.ground[k] += static_cast<T>(factor(static_cast<double>(light.ground[k]),
                                               static_cast<double>(before.ground[k]))) *
                         light.ground[k];
    }
  }

  std::vector<double> mean_radiance(const Incoming<T>& light) const {
    const ZenithGrid::Stencil s =
        ZenithGrid::stencil(zenith_.position(96 * kRadPerDeg), zenith_.size());
    std::vector<double> mean(lanes_);
    for (std::size_t q = 0; q < 4; ++q) {
      const T* C = &light.coherency[(s.first + q) * 4 * lanes_];
      for (std::size_t w = 0; w < lanes_; ++w) {
        mean[w] += s.weight[q] * static_cast<double>(C[w] + C[lanes_ + w] + C[2 * lanes_ + w]);
      }
    }
    return mean;
  }

  const OrdersMedium& medium_;
  const DirectSunlight& sunlight_;
  const OrdersOptions& options_;
  const RunControl& control_;
  std::size_t lanes_, stokes_;
  ZenithGrid zenith_;
  std::vector<double> levels_;
  std::size_t moments_, aerosol_levels_ = 0, pairs_ = 0;
  std::vector<T> cos_azimuth_, sin_azimuth_, cos_chi_, sin_chi_, cos_phi_, sin_phi_;
  std::vector<ZenithGrid::Stencil> fine_stencil_;
  static constexpr std::size_t kPhaseNodes = 1025;
  std::vector<T> anisotropic_share_, phase_;
};

}  // namespace

std::vector<double> orders_levels(double top_km, int levels) {
  std::vector<double> altitudes;
  for (int i = 0; i < levels; ++i) {
    const double v = static_cast<double>(i) / (levels - 1);
    altitudes.push_back(top_km * v * v * (0.6 + 0.4 * v));
  }
  altitudes.front() = 0;
  altitudes.back() = top_km;
  return altitudes;
}

void beam_row(const DirectSunlight& sunlight, const OrdersOptions& options,
              std::span<const double> wavelength_nm, double altitude_km, std::span<float> beam) {
  const std::size_t lanes = sunlight.lanes();
  std::vector<float> attenuation(lanes);
  std::fill(beam.begin(), beam.end(), 0.0F);
  std::size_t end = 0;
  for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
    const double chi = static_cast<double>(k) * ZenithGrid::kFineStep_deg * kRadPerDeg;
    if (chi > pi || !sunlight.attenuation(altitude_km, chi, attenuation.data())) break;
    for (std::size_t w = 0; w < wavelength_nm.size(); ++w) {
      if (attenuation[w] < DirectSunlight::kOpaque) beam[k * lanes + w] = std::exp(-attenuation[w]);
    }
    end = k + 1;
  }
  if (options.disc_average) {
    average_over_disc(wavelength_nm, options.sun_distance_au, lanes, end, beam);
  }
}

OrdersMedium make_orders_medium(const Medium& medium, std::span<const double> ground_albedo,
                                const OrdersOptions& options) {
  OrdersMedium result;
  const std::size_t lanes = padded_lanes(medium.wavelengths());
  const std::size_t layers = medium.layers(), wavelengths = medium.wavelengths();
  result.lanes = lanes;
  result.truncated = medium;
  const AerosolKinds kinds = aerosol_kinds(medium);
  if (!kinds.scattering_per_km.empty()) result.degree = options.phase_degree;
  result.kinds = truncate_phases(kinds, result.degree, lanes);
  result.anisotropic_share.assign(lanes, 0.0);
  result.ground_albedo.assign(lanes, 0.0);
  for (std::size_t w = 0; w < wavelengths; ++w) {
    const double rho = medium.depolarisation.empty() ? 0.0 : medium.depolarisation[w];
    result.anisotropic_share[w] = (1 - rho) / (1 + 0.5 * rho);
    result.ground_albedo[w] = ground_albedo[w];
  }
  PathOptics& optics = result.optics;
  optics.earth_radius_km = medium.earth_radius_km;
  optics.boundary_km = medium.boundary_km;
  optics.lanes = lanes;
  optics.kinds = kinds.scattering_per_km.size();
  const std::size_t columns = 1 + optics.kinds;
  optics.extinction_per_km.assign(layers * lanes, 0.0);
  optics.scattering_per_km.assign(layers * columns * lanes, 0.0);
  optics.kind_present.assign(layers * optics.kinds, 0);
  for (std::size_t i = 0; i < layers; ++i) {
    for (std::size_t w = 0; w < wavelengths; ++w) {
      optics.scattering_per_km[i * columns * lanes + w] = medium.air_scattering_per_km(i, w);
      double left = 0;
      for (std::size_t q = 0; q < optics.kinds; ++q) {
        const double all = kinds.scattering_per_km[q](i, w);
        const double kept = all * (1 - result.kinds[q].peak[w]);
        optics.scattering_per_km[(i * columns + 1 + q) * lanes + w] = kept;
        left += kept;
        if (all > 0) {
          optics.kind_present[i * optics.kinds + q] = 1;
          result.aerosol_top_km = std::max(result.aerosol_top_km, medium.boundary_km[i + 1]);
        }
      }
      result.truncated.aerosol_scattering_per_km(i, w) = left;
      optics.extinction_per_km[i * lanes + w] = result.truncated.extinction_per_km(i, w);
    }
  }
  return result;
}

OrdersField solve_orders(const OrdersMedium& medium, const DirectSunlight& sunlight,
                         const OrdersOptions& options, const RunControl& control) {
  if (options.single_precision) return Solver<float>(medium, sunlight, options, control).solve();
  return Solver<double>(medium, sunlight, options, control).solve();
}

}  // namespace twilight
