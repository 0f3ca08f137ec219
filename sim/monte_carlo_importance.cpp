#include "sim/monte_carlo_importance.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRad = kPi / 180;
constexpr std::size_t kCosines = 512;
constexpr int kSweeps = 3;
constexpr double kLongestPieceKm = 60, kThickestPiece = 0.7;
constexpr double kMostPieces = 64;
constexpr double kPhaseCap = 40;

// From the horizon: below it the ground, above it the bright arch. See Bins::elevation().
constexpr std::array<double, 30> kElevationEdgesDeg = {
    -90, -60, -40, -25, -15, -10, -6, -3, -1, 0,  0.5, 1,  1.5, 2,  2.5,
    3,   4,   5,   6.5, 8,   10,  12, 15, 19, 24, 31,  40, 52,  66, 90};
constexpr std::array<double, 9> kAzimuthEdgesDeg = {0, 10, 20, 35, 50, 70, 95, 125, 180};
constexpr std::size_t kElevations = kElevationEdgesDeg.size() - 1;
constexpr std::size_t kAzimuths = kAzimuthEdgesDeg.size() - 1;
constexpr std::size_t kBins = kElevations * kAzimuths;
constexpr std::array<double, 12> kHeightFractions = {0,   0.01, 0.03, 0.06, 0.1,  0.15,
                                                     0.2, 0.28, 0.38, 0.5,  0.65, 0.85};
constexpr std::array<double, 38> kChiDeg = {
    0,  25,  45,  60,  70,  77,  82,  85,  87,  89,  90,  91,  92,  93,  94,  95,  96,  97,  98,
    99, 100, 101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 112, 115, 120, 130, 145, 165, 180};

// exp(-x) to 1e-4 for x >= 0; only sampling densities are made of it.
inline float rough_exp_minus(float x) {
  const float y = std::min(x * 1.44269504F, 120.0F);
  const int whole = static_cast<int>(y);
  const float f = static_cast<float>(whole) - y;  // -1..0
  const float p = 1 + f * (0.693147F + f * (0.240223F + f * (0.0555F + f * 0.0089F)));
  return p * std::bit_cast<float>(static_cast<std::uint32_t>(127 - whole) << 23);
}

}  // namespace

struct MonteCarloImportance::Bins {
  std::array<double, kElevations + 1> edge;  // rad, from the horizon
  std::array<double, kAzimuths + 1> azimuth, cos_azimuth;
  std::array<std::uint8_t, 720> row;  // first candidate of equal parts

  Bins() {
    for (std::size_t i = 0; i <= kElevations; ++i) edge[i] = kElevationEdgesDeg[i] * kRad;
    for (std::size_t j = 0; j <= kAzimuths; ++j) {
      azimuth[j] = kAzimuthEdgesDeg[j] * kRad;
      cos_azimuth[j] = std::cos(azimuth[j]);
    }
    std::size_t i = 0;
    for (std::size_t k = 0; k < row.size(); ++k) {
      const double e = kPi * (static_cast<double>(k) / static_cast<double>(row.size()) - 0.5);
      while (i + 1 < kElevations && edge[i + 1] <= e) ++i;
      row[k] = static_cast<std::uint8_t>(i);
    }
  }

  // Elevation of something `e` from the horizon whose dip is `dip`: sky and ground are stretched
  // so that each fills its own bins.
  static double elevation(double e, double dip) {
    return e < 0 ? -kPi / 2 + (e + kPi / 2) * (1 - dip / (kPi / 2))
                 : -dip + e * (1 + dip / (kPi / 2));
  }
  double edge_sine(std::size_t i, double dip) const { return std::sin(elevation(edge[i], dip)); }

  std::size_t elevation_bin(double sine, double dip) const {
    const double e = std::asin(std::clamp(sine, -1.0, 1.0));
    const double from = e < -dip ? (e + kPi / 2) / (1 - dip / (kPi / 2)) - kPi / 2
                                 : (e + dip) / (1 + dip / (kPi / 2));
    const double part = (from / kPi + 0.5) * static_cast<double>(row.size());
    std::size_t i = row[std::min(row.size() - 1, static_cast<std::size_t>(std::max(0.0, part)))];
    while (i + 1 < kElevations && from >= edge[i + 1]) ++i;
    return i;
  }
  std::size_t azimuth_bin(double cos_a) const {
    std::size_t j = 0;
    while (j + 1 < kAzimuths && cos_a < cos_azimuth[j + 1]) ++j;
    return j;
  }
};

namespace {
const MonteCarloImportance::Bins& bins() {
  static const MonteCarloImportance::Bins instance;
  return instance;
}
}  // namespace

MonteCarloImportance::MonteCarloImportance(const Medium& m, std::span<const std::size_t> reference,
                                           std::span<const double> ground_albedo,
                                           const MonteCarloSunlight& sunlight,
                                           const MonteCarloScattering& scattering,
                                           double cos_chi_observer,
                                           const std::function<void()>& check)
    : reference_(reference.begin(), reference.end()),
      sunlight_(&sunlight),
      scattering_model_(&scattering),
      boundary_km_(m.boundary_km),
      radius_km_(m.earth_radius_km) {
  const std::size_t N = m.layers(), G = reference_.size();
  for (std::size_t g = 0; g < G; ++g) albedo_.push_back(ground_albedo[reference_[g]]);
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t g = 0; g < G; ++g) {
      const std::size_t w = reference_[g];
      extinction_.push_back(m.extinction_per_km(i, w));
      air_.push_back(m.air_scattering_per_km(i, w));
      scattering_.push_back(m.air_scattering_per_km(i, w) + m.aerosol_scattering_per_km(i, w));
    }
  }
  // Away from the observer's solar zenith angle few paths go: no nodes there.
  const double chi_observer = std::acos(std::clamp(cos_chi_observer, -1.0, 1.0));
  for (std::size_t i = 0; i < kChiDeg.size(); ++i) {
    const double margin = 20 * kRad;
    const bool after = i + 1 < kChiDeg.size() && kChiDeg[i + 1] * kRad < chi_observer - margin;
    const bool before = i > 0 && kChiDeg[i - 1] * kRad > chi_observer + margin;
    if (!after && !before) node_chi_rad_.push_back(kChiDeg[i] * kRad);
  }
  node_height_km_.push_back(0);  // the ground itself
  for (const double f : kHeightFractions) node_height_km_.push_back(f * m.top_km());

  source_.assign(N * kCosines * G * 2, 0.0F);
  ground_sun_.assign(kCosines * G, 0.0F);
  ground_source_.assign(kCosines * G, 0.0F);
  tbb::parallel_for(std::size_t{0}, N + 1, [&](std::size_t row) {
    // Row N is the ground's.
    const std::size_t layer = row < N ? row : 0;
    const double h = row < N ? 0.5 * (boundary_km_[layer] + boundary_km_[layer + 1]) : 0;
    for (std::size_t c = 0; c < kCosines; ++c) {
      const double cos_chi = -1 + 2 * static_cast<double>(c) / (kCosines - 1);
      for (std::size_t g = 0; g < G; ++g) {
        double irradiance = 0, cosine = 0;
        if (!sunlight.at_one(reference_[g], h, layer, cos_chi, &irradiance, &cosine)) continue;
        if (row < N) {
          source_[((layer * kCosines + c) * G + g) * 2] = static_cast<float>(irradiance);
        } else {
          ground_sun_[c * G + g] = static_cast<float>(irradiance * std::max(0.0, cosine));
        }
      }
    }
  });
  node_mean_.assign(node_height_km_.size() * node_chi_rad_.size() * G, 0.0);
  for (int i = 0; i < kSweeps; ++i) sweep(i + 1 == kSweeps, check);
}

void MonteCarloImportance::sweep(bool last, const std::function<void()>& check) {
  const std::size_t G = reference_.size(), N = boundary_km_.size() - 1;
  const std::size_t H = node_height_km_.size(), X = node_chi_rad_.size();
  if (last) guide_.assign(H * X * G * kBins, 0.0F);
  const Bins& b = bins();
  tbb::parallel_for(std::size_t{0}, H * X, [&](std::size_t node) {
    check();
    const bool ground = node / X == 0;
    const double h = node_height_km_[node / X], chi = node_chi_rad_[node % X];
    const auto above = std::upper_bound(boundary_km_.begin() + 1, boundary_km_.end() - 1, h);
    const auto layer = static_cast<std::size_t>(above - boundary_km_.begin()) - 1;
    LegCutter cutter(boundary_km_, radius_km_);
    LegLight light;
    ReferenceValues sum{}, weight{};
    weight.fill(1);
    std::array<std::array<double, kBins>, kMostReferences> radiance{};
    const double dip = dip_rad(h);
    std::array<double, kElevations + 1> edge_sine{};
    for (std::size_t i = 0; i <= kElevations; ++i) edge_sine[i] = b.edge_sine(i, dip);
    // The mean radiance needs fewer directions than the guide.
    const std::size_t skip = last ? 1 : 2;
    for (std::size_t i = 0; i < kElevations; i += skip) {
      const std::size_t i_end = std::min(kElevations, i + skip);
      const double sine = 0.5 * (edge_sine[i] + edge_sine[i_end]);
      if (ground && sine < 0) continue;
      const bool hits = cutter.cut(h, layer, sine);
      const double cosine = std::sqrt(1 - sine * sine);
      for (std::size_t j = 0; j < kAzimuths; j += skip) {
        const double azimuth = 0.5 * (b.azimuth[j] + b.azimuth[j + skip]);
        const double toward =
            sine * std::cos(chi) + cosine * std::cos(azimuth) * std::sin(chi);  // d . Sun
        const double start = (radius_km_ + h) * std::cos(chi);
        weigh(cutter.crossings(), start, toward, 0.75 * (1 + toward * toward),
              aerosol_phase(toward), weight, light);
        const std::size_t bin = i * kAzimuths + j;
        for (std::size_t g = 0; g < G; ++g) {
          double value = light.lit[g];
          if (hits && albedo_[g] > 0) {
            const double end = cutter.crossings().empty() ? 0 : cutter.crossings().back().end_km;
            const double cos_end = std::clamp((start + toward * end) / radius_km_, -1.0, 1.0);
            const auto c = static_cast<std::size_t>((cos_end + 1) * 0.5 * (kCosines - 1) + 0.5);
            value += light.transmittance[g] * albedo_[g] *
                     (static_cast<double>(ground_sun_[c * G + g]) / kPi +
                      static_cast<double>(ground_source_[c * G + g]));
          }
          radiance[g][bin] = value;
          // Over the ground the irradiance / pi, elsewhere the mean.
          const double solid_angle =
              2 * (edge_sine[i_end] - edge_sine[i]) * (b.azimuth[j + skip] - b.azimuth[j]);
          sum[g] += value * solid_angle * (ground ? sine / kPi : 1 / (4 * kPi));
        }
      }
    }
    for (std::size_t g = 0; g < G; ++g) node_mean_[node * G + g] = sum[g];
    if (!last) return;
    for (std::size_t g = 0; g < G; ++g) {
      double total = 0;
      for (std::size_t k = 0; k < kBins; ++k) {
        const std::size_t i = k / kAzimuths, j = k % kAzimuths;
        const double cosine = ground ? 0.5 * (edge_sine[i] + edge_sine[i + 1]) : 1;
        total += radiance[g][k] * (edge_sine[i + 1] - edge_sine[i]) *
                 (b.azimuth[j + 1] - b.azimuth[j]) * std::max(0.0, cosine);
        guide_[(node * G + g) * kBins + k] = static_cast<float>(total);
      }
      for (std::size_t k = 0; k < kBins; ++k) {
        float& c = guide_[(node * G + g) * kBins + k];
        c = total > 1e-35 ? static_cast<float>(static_cast<double>(c) / total)
                          : static_cast<float>(k + 1) / static_cast<float>(kBins);
      }
    }
  });
  // Back to the fine table, logarithmically in the angle, linearly in altitude.
  const auto value_at = [&](std::size_t height, double chi, std::size_t g) {
    const auto above = std::upper_bound(node_chi_rad_.begin() + 1, node_chi_rad_.end() - 1, chi);
    const auto i = static_cast<std::size_t>(above - node_chi_rad_.begin()) - 1;
    const double t =
        std::clamp((chi - node_chi_rad_[i]) / (node_chi_rad_[i + 1] - node_chi_rad_[i]), 0.0, 1.0);
    const double a = std::max(1e-30, node_mean_[(height * X + i) * G + g]);
    const double c = std::max(1e-30, node_mean_[(height * X + i + 1) * G + g]);
    return std::exp(std::log(a) + t * std::log(c / a));
  };
  tbb::parallel_for(std::size_t{0}, kCosines, [&](std::size_t c) {
    const double chi = std::acos(-1 + 2 * static_cast<double>(c) / (kCosines - 1));
    for (std::size_t g = 0; g < G; ++g) {
      std::array<double, kHeightFractions.size() + 1> column{};
      for (std::size_t k = 0; k < H; ++k) column[k] = value_at(k, chi, g);
      ground_source_[c * G + g] = static_cast<float>(column[0]);
      for (std::size_t i = 0; i < N; ++i) {
        const double h = 0.5 * (boundary_km_[i] + boundary_km_[i + 1]);
        std::size_t k = 1;
        while (k + 2 < H && h >= node_height_km_[k + 1]) ++k;
        const double t = std::clamp(
            (h - node_height_km_[k]) / (node_height_km_[k + 1] - node_height_km_[k]), 0.0, 1.0);
        source_[((i * kCosines + c) * G + g) * 2 + 1] =
            static_cast<float>(column[k] + t * (column[k + 1] - column[k]));
      }
    }
  });
}

ReferenceValues MonteCarloImportance::aerosol_phase(double cosine) const {
  ReferenceValues phase{};
  if (!scattering_model_->has_aerosol()) return phase;
  for (std::size_t g = 0; g < reference_.size(); ++g) {
    phase[g] = std::min(kPhaseCap, 4 * kPi * scattering_model_->aureole_density_per_sr(g, cosine));
  }
  return phase;
}

const float* MonteCarloImportance::source(std::size_t layer, double cos_chi,
                                          double& fraction) const {
  const double position = (std::clamp(cos_chi, -1.0, 1.0) + 1) * 0.5 * (kCosines - 1);
  const std::size_t c = std::min(static_cast<std::size_t>(position), kCosines - 2);
  fraction = position - static_cast<double>(c);
  return &source_[(layer * kCosines + c) * reference_.size() * 2];
}

double MonteCarloImportance::scattered(std::size_t layer, double cos_chi, std::size_t g) const {
  double f = 0;
  const float* s = source(layer, cos_chi, f) + 2 * g + 1;
  return static_cast<double>(s[0]) + f * static_cast<double>(s[2 * reference_.size()] - s[0]);
}

double MonteCarloImportance::ground_scattered(double cos_chi, std::size_t g) const {
  const double position = (std::clamp(cos_chi, -1.0, 1.0) + 1) * 0.5 * (kCosines - 1);
  return static_cast<double>(
      ground_source_[static_cast<std::size_t>(position + 0.5) * reference_.size() + g]);
}

void MonteCarloImportance::weigh(std::span<const LegCrossing> crossings, double cosine_start,
                                 double cosine_slope, double phase_air,
                                 const ReferenceValues& phase_aerosol,
                                 const ReferenceValues& weight, LegLight& out) const {
  constexpr float kInv4Pi = static_cast<float>(1 / (4 * kPi));
  const std::size_t G = reference_.size();
  out.pieces.clear();
  std::array<float, kMostReferences> before{}, lit{}, analogue{}, scale{}, aerosol{}, depth{};
  for (std::size_t g = 0; g < G; ++g) {
    before[g] = 1;
    scale[g] = static_cast<float>(weight[g]);
    aerosol[g] = static_cast<float>(phase_aerosol[g]) * kInv4Pi;
  }
  const auto air = static_cast<float>(phase_air) * kInv4Pi;
  double start = 0, lit_sum = 0, analogue_sum = 0;
  for (const LegCrossing& crossing : crossings) {
    const double length = crossing.end_km - start;
    if (!(length > 0)) continue;
    const double* extinction = &extinction_[crossing.layer * G];
    double thickest = 0;
    for (std::size_t g = 0; g < G; ++g) thickest = std::max(thickest, extinction[g]);
    const double parts = std::min(
        kMostPieces,
        std::ceil(length * std::max(thickest * (1 / kThickestPiece), 1 / kLongestPieceKm)));
    const int n = std::max(1, static_cast<int>(parts));
    const double step = length / n;
    const double radius =
        radius_km_ + 0.5 * (boundary_km_[crossing.layer] + boundary_km_[crossing.layer + 1]);
    for (int p = 0; p < n; ++p) {
      const double at = start + step * p;
      double f = 0;
      const float* s =
          source(crossing.layer, (cosine_start + (at + 0.5 * step) * cosine_slope) / radius, f);
      const auto fraction = static_cast<float>(f);
      const auto ds = static_cast<float>(step);
      for (std::size_t g = 0; g < G; ++g) {
        const std::size_t cell = crossing.layer * G + g;
        const auto beta = static_cast<float>(extinction[g]);
        const auto scattering = static_cast<float>(scattering_[cell]);
        const auto beta_air = static_cast<float>(air_[cell]);
        depth[g] += beta * ds;
        const float after = rough_exp_minus(depth[g]);
        const float sun = s[2 * g] + fraction * (s[2 * (G + g)] - s[2 * g]);
        const float rest = s[2 * g + 1] + fraction * (s[2 * (G + g) + 1] - s[2 * g + 1]);
        const float value =
            0.5F * (before[g] + after) * ds *
            (sun * (beta_air * air + (scattering - beta_air) * aerosol[g]) + scattering * rest);
        lit[g] += value;
        lit_sum += static_cast<double>(scale[g] * value);
        const float part = beta > 0 ? std::max(0.0F, before[g] - after) * scattering / beta : 0.0F;
        analogue[g] += part;
        analogue_sum += static_cast<double>(scale[g] * part);
        before[g] = after;
      }
      out.pieces.push_back({at, step, crossing.layer, lit_sum, analogue_sum});
    }
    start = crossing.end_km;
  }
  for (std::size_t g = 0; g < G; ++g) {
    out.lit[g] = static_cast<double>(lit[g]);
    out.transmittance[g] = static_cast<double>(before[g]);
    out.analogue[g] = static_cast<double>(analogue[g]);
  }
  out.lit_total = lit_sum;
  out.analogue_total = analogue_sum;
}

double MonteCarloImportance::dip_rad(double h) const {
  return std::atan2(std::sqrt(std::max(0.0, h * (2 * radius_km_ + h))), radius_km_);
}

MonteCarloImportance::Guide MonteCarloImportance::guide(double h, bool on_ground,
                                                        double cos_chi) const {
  const double chi = std::acos(std::clamp(cos_chi, -1.0, 1.0));
  const auto interval = [](const std::vector<double>& v, std::size_t first, double x, double& t) {
    const auto above =
        std::upper_bound(v.begin() + static_cast<std::ptrdiff_t>(first) + 1, v.end() - 1, x);
    const auto i = static_cast<std::size_t>(above - v.begin()) - 1;
    t = std::clamp((x - v[i]) / (v[i + 1] - v[i]), 0.0, 1.0);
    return i;
  };
  double t = 0, f = 0;
  const std::size_t c = interval(node_chi_rad_, 0, chi, t);
  const std::size_t k = on_ground ? 0 : interval(node_height_km_, 1, h, f);
  const std::size_t X = node_chi_rad_.size();
  const std::size_t up = on_ground ? 0 : X;
  return {{k * X + c, k * X + c + 1, k * X + up + c, k * X + up + c + 1},
          {(1 - f) * (1 - t), (1 - f) * t, f * (1 - t), f * t},
          on_ground ? 0.0 : dip_rad(h)};
}

void MonteCarloImportance::sample_direction(const Guide& guide, std::size_t g, double u, double v,
                                            double w, double& sine, double& azimuth) const {
  const Bins& b = bins();
  std::size_t n = 0;
  while (n < 3 && u >= guide.share[n]) u -= guide.share[n++];
  u = guide.share[n] > 0 ? std::clamp(u / guide.share[n], 0.0, 1.0) : u;
  const float* c = &guide_[(guide.node[n] * reference_.size() + g) * kBins];
  const auto target = static_cast<float>(u) < 1 ? static_cast<float>(u) : 0.99999994F;
  auto k = static_cast<std::size_t>(std::upper_bound(c, c + kBins - 1, target) - c);
  const std::size_t i = k / kAzimuths, j = k % kAzimuths;
  const double low = b.edge_sine(i, guide.dip_rad);
  sine = low + v * (b.edge_sine(i + 1, guide.dip_rad) - low);
  // One random number serves the side and the place inside the bin.
  const double side = w < 0.5 ? 1 : -1;
  const double t = w < 0.5 ? 2 * w : 2 * w - 1;
  azimuth = side * (b.azimuth[j] + t * (b.azimuth[j + 1] - b.azimuth[j]));
}

ReferenceValues MonteCarloImportance::direction_density_per_sr(const Guide& guide, double sine,
                                                               double cos_azimuth) const {
  const Bins& b = bins();
  const std::size_t i = b.elevation_bin(sine, guide.dip_rad), j = b.azimuth_bin(cos_azimuth);
  const std::size_t k = i * kAzimuths + j, G = reference_.size();
  ReferenceValues density{};
  for (std::size_t n = 0; n < guide.node.size(); ++n) {
    if (!(guide.share[n] > 0)) continue;
    for (std::size_t g = 0; g < G; ++g) {
      const float* c = &guide_[(guide.node[n] * G + g) * kBins];
      density[g] += guide.share[n] * static_cast<double>(c[k] - (k > 0 ? c[k - 1] : 0.0F));
    }
  }
  const double solid_angle = 2 *
                             (b.edge_sine(i + 1, guide.dip_rad) - b.edge_sine(i, guide.dip_rad)) *
                             (b.azimuth[j + 1] - b.azimuth[j]);
  for (std::size_t g = 0; g < G; ++g) density[g] /= solid_angle;
  return density;
}

}  // namespace twilight
