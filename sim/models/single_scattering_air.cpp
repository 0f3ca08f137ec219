#include "sim/models/single_scattering_air.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "aerosols/cornette_shanks.h"
#include "aerosols/henyey_greenstein.h"
#include "atmosphere/rayleigh.h"
#include "sim/gauss_legendre.h"

namespace twilight {
namespace {

using std::numbers::pi;

// p11 / (4 pi), linear between the tabulated angles.
double tabulated_phase_per_sr(const PhaseMatrix& m, double angle_rad) {
  const auto above = std::ranges::upper_bound(m.angle_rad, angle_rad) - m.angle_rad.begin();
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(above, 1, static_cast<std::ptrdiff_t>(m.angle_rad.size()) - 1));
  const double t = (angle_rad - m.angle_rad[i - 1]) / (m.angle_rad[i] - m.angle_rad[i - 1]);
  return std::lerp(m.p11[i - 1], m.p11[i], t) / (4.0 * pi);
}

class ExponentialAir final : public SingleScatteringAir {
 public:
  ExponentialAir(const TwoConstituentAir& air, std::span<const double> wavelength_nm)
      : SingleScatteringAir(air.ground_radius_km, air.top_km, wavelength_nm.size()), air_(air) {
    for (const double nm : wavelength_nm) {
      rayleigh_.push_back(air.rayleigh_per_km(nm));
      mie_.push_back(air.mie_per_km(nm));
      mie_extinction_.push_back(mie_.back() / air.mie_single_scattering_albedo);
    }
    for (const double scale : {air.rayleigh_scale_height_km, air.mie_scale_height_km}) {
      for (const double heights : {1.0, 3.0}) {
        if (heights * scale < air.top_km) levels_km_.push_back(heights * scale);
      }
    }
    std::ranges::sort(levels_km_);
  }

  bool layered() const override { return false; }

  void extinction(double height_km, std::span<double> per_km) const override {
    const double molecules = std::exp(-height_km / air_.rayleigh_scale_height_km);
    const double haze = std::exp(-height_km / air_.mie_scale_height_km);
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      per_km[w] = molecules * rayleigh_[w] + haze * mie_extinction_[w];
    }
  }

  void optical_depth(const StraightLine& line, double from_km, double to_km,
                     std::span<double> depth) const override {
    const double molecules = exponential_column_km(line, from_km, to_km, ground_radius_km_,
                                                   air_.rayleigh_scale_height_km);
    const double haze =
        exponential_column_km(line, from_km, to_km, ground_radius_km_, air_.mie_scale_height_km);
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      depth[w] = molecules * rayleigh_[w] + haze * mie_extinction_[w];
    }
  }

  std::vector<double> scattering_at(double cos_angle) const override {
    const double air = rayleigh_phase_per_sr(cos_angle, 0.0);
    const double haze = cornette_shanks(cos_angle, air_.mie_asymmetry);
    std::vector<double> at(2 * wavelengths_);
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      at[w] = rayleigh_[w] * air;
      at[wavelengths_ + w] = mie_[w] * haze;
    }
    return at;
  }

  void angular_scattering(std::span<const double> at, double height_km,
                          std::span<double> per_km_sr) const override {
    const double molecules = std::exp(-height_km / air_.rayleigh_scale_height_km);
    const double haze = std::exp(-height_km / air_.mie_scale_height_km);
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      per_km_sr[w] = molecules * at[w] + haze * at[wavelengths_ + w];
    }
  }

 private:
  TwoConstituentAir air_;
  std::vector<double> rayleigh_, mie_, mie_extinction_;
};

class LayeredAir final : public SingleScatteringAir {
 public:
  explicit LayeredAir(const Medium& medium)
      : SingleScatteringAir(medium.earth_radius_km, medium.top_km(), medium.wavelengths()),
        medium_(medium),
        extinction_(medium.layers() * medium.wavelengths()) {
    levels_km_.assign(medium.boundary_km.begin() + 1, medium.boundary_km.end() - 1);
    for (std::size_t i = 0; i < medium.layers(); ++i) {
      for (std::size_t w = 0; w < wavelengths_; ++w) {
        extinction_[i * wavelengths_ + w] = medium.extinction_per_km(i, w);
      }
    }
    if (!medium.vertical_filter_optical_depth.empty()) {
      filter_ = medium.vertical_filter_optical_depth;
    }
  }

  bool layered() const override { return true; }

  void extinction(double height_km, std::span<double> per_km) const override {
    std::copy_n(&extinction_[layer(height_km) * wavelengths_], wavelengths_, per_km.begin());
  }

  void optical_depth(const StraightLine& line, double from_km, double to_km,
                     std::span<double> depth) const override {
    std::ranges::fill(depth, 0.0);
    if (from_km < 0.0 && to_km > 0.0) {
      add_depth(line, 0.0, -from_km, depth);
      add_depth(line, 0.0, to_km, depth);
    } else {
      const double a = std::abs(from_km), b = std::abs(to_km);
      add_depth(line, std::min(a, b), std::max(a, b), depth);
    }
  }

  std::vector<double> scattering_at(double cos_angle) const override {
    std::vector<double> at(extinction_.size());
    const std::size_t kinds = medium_.aerosol_phase.size();
    const double angle_rad = std::acos(std::clamp(cos_angle, -1.0, 1.0));
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      const double air = rayleigh_phase_per_sr(cos_angle, medium_.depolarisation[w]);
      std::vector<double> phase(kinds);
      for (std::size_t k = 0; k < kinds; ++k) {
        phase[k] = tabulated_phase_per_sr(medium_.aerosol_phase[k][w], angle_rad);
      }
      for (std::size_t i = 0; i < medium_.layers(); ++i) {
        double sum = air * medium_.air_scattering_per_km(i, w);
        for (std::size_t k = 0; k < kinds; ++k) {
          sum += phase[k] * medium_.aerosol_kind_scattering_per_km[k](i, w);
        }
        if (kinds == 0) {
          sum += medium_.aerosol_scattering_per_km(i, w) *
                 henyey_greenstein(cos_angle, medium_.aerosol_asymmetry(i, w));
        }
        at[i * wavelengths_ + w] = sum;
      }
    }
    return at;
  }

  void angular_scattering(std::span<const double> at, double height_km,
                          std::span<double> per_km_sr) const override {
    std::copy_n(&at[layer(height_km) * wavelengths_], wavelengths_, per_km_sr.begin());
  }

 private:
  std::size_t layer(double height_km) const {
    return static_cast<std::size_t>(std::ranges::upper_bound(levels_km_, height_km) -
                                    levels_km_.begin());
  }

  // Of a stretch on one side of the perigee, 0 <= near <= far.
  void add_depth(const StraightLine& line, double near_km, double far_km,
                 std::span<double> depth) const {
    double begin = near_km;
    for (std::size_t i = layer(line.radius_km(near_km) - ground_radius_km_);
         i < medium_.layers() && begin < far_km; ++i) {
      const double upper = line.half_chord_km(ground_radius_km_ + medium_.boundary_km[i + 1]);
      const double end = std::min(upper, far_km);
      if (end <= begin) continue;
      const double* extinction = &extinction_[i * wavelengths_];
      for (std::size_t w = 0; w < wavelengths_; ++w) depth[w] += (end - begin) * extinction[w];
      begin = end;
    }
  }

  Medium medium_;
  std::vector<double> extinction_;  // [layer][wavelength]
};

}  // namespace

double StraightLine::radius_km(double s_km) const { return std::hypot(perigee_radius_km, s_km); }

double StraightLine::half_chord_km(double radius_km) const {
  return std::sqrt(
      std::max(0.0, (radius_km - perigee_radius_km) * (radius_km + perigee_radius_km)));
}

double exponential_column_km(const StraightLine& line, double from_km, double to_km,
                             double ground_radius_km, double scale_height_km) {
  if (from_km < 0.0 && to_km > 0.0) {
    return exponential_column_km(line, 0.0, -from_km, ground_radius_km, scale_height_km) +
           exponential_column_km(line, 0.0, to_km, ground_radius_km, scale_height_km);
  }
  // With u^2 = r - perigee: ds = 2 r / sqrt(r + perigee) du, smooth down to the perigee.
  static const std::vector<GaussNode> kUnit = gauss_legendre(16, 0.0, 1.0);
  constexpr double kScaleHeights = 27.0;  // e^-27: 2e-12 of what lies below
  const double perigee = line.perigee_radius_km;
  const auto root = [&](double s) {
    return s > 0.0 ? s / std::sqrt(line.radius_km(s) + perigee) : 0.0;
  };
  const double a = root(std::min(std::abs(from_km), std::abs(to_km)));
  const double b = std::min(root(std::max(std::abs(from_km), std::abs(to_km))),
                            std::sqrt(a * a + kScaleHeights * scale_height_km));
  double sum = 0.0;
  for (const GaussNode& node : kUnit) {
    const double u = a + (b - a) * node.x;
    const double r = perigee + u * u;
    sum += node.weight * std::exp((ground_radius_km - r) / scale_height_km) * r /
           std::sqrt(r + perigee);
  }
  return 2.0 * (b - a) * sum;
}

std::unique_ptr<const SingleScatteringAir> single_scattering_air(const SceneModel& model) {
  if (model.two_constituent_air) {
    return std::make_unique<ExponentialAir>(*model.two_constituent_air, model.medium.wavelength_nm);
  }
  return std::make_unique<LayeredAir>(model.medium);
}

}  // namespace twilight
