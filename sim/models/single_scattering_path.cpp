#include "sim/models/single_scattering_path.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace twilight {
namespace {

struct KronrodNode {
  double x, kronrod, gauss;  // on [-1, 1]; gauss 0 where Gauss's rule has no node
};

// Kronrod's 15 and 7 points with Gauss's 7 and 3 (QUADPACK, Piessens et al. 1983; Kronrod 1965).
constexpr std::array<KronrodNode, 15> kFifteen = {{
    {-0.991455371120812639206854697526329, 0.022935322010529224963732008058970, 0},
    {-0.949107912342758524526189684047851, 0.063092092629978553290700663189204,
     0.129484966168869693270611432679082},
    {-0.864864423359769072789712788640926, 0.104790010322250183839876322541518, 0},
    {-0.741531185599394439863864773280788, 0.140653259715525918745189590510238,
     0.279705391489276667901467771423780},
    {-0.586087235467691130294144691693, 0.169004726639267902826583426598550, 0},
    {-0.405845151377397166906606412076961, 0.190350578064785409913256402421014,
     0.381830050505118944950369775488975},
    {-0.207784955007898467600689403773245, 0.204432940075298892414161999234649, 0},
    {0, 0.209482141084727828012999174891714, 0.417959183673469387755102040816327},
    {0.207784955007898467600689403773245, 0.204432940075298892414161999234649, 0},
    {0.405845151377397166906606412076961, 0.190350578064785409913256402421014,
     0.381830050505118944950369775488975},
    {0.586087235467691130294144691693, 0.169004726639267902826583426598550, 0},
    {0.741531185599394439863864773280788, 0.140653259715525918745189590510238,
     0.279705391489276667901467771423780},
    {0.864864423359769072789712788640926, 0.104790010322250183839876322541518, 0},
    {0.949107912342758524526189684047851, 0.063092092629978553290700663189204,
     0.129484966168869693270611432679082},
    {0.991455371120812639206854697526329, 0.022935322010529224963732008058970, 0},
}};
constexpr std::array<KronrodNode, 7> kSeven = {{
    {-0.960491268708020283423507092629080, 0.104656226026467265193823857192073, 0},
    {-0.774596669241483377035853079956480, 0.268488089868333440728569280666710, 5.0 / 9},
    {-0.434243749346802558002071502844628, 0.401397414775962222905051818618432, 0},
    {0, 0.450916538658474142345110087045571, 8.0 / 9},
    {0.434243749346802558002071502844628, 0.401397414775962222905051818618432, 0},
    {0.774596669241483377035853079956480, 0.268488089868333440728569280666710, 5.0 / 9},
    {0.960491268708020283423507092629080, 0.104656226026467265193823857192073, 0},
}};
constexpr double kTolerance = 1e-4;
constexpr double kNothing = 1e-200;  // where rounding to subnormal numbers would never converge
constexpr int kMostHalvings = 14;

// A ray in the air: places are signed distances s from its perigee.
struct Ray {
  StraightLine line;
  double begin_km = 0, end_km = 0;  // of the part within the air
  bool in_air = false, hits_ground = false;
  // Sine of the Sun's elevation at the perigee times its radius, and the change per km: the dot
  // product of a place with the direction of the Sun is offset + slope s.
  double sun_offset_km = 0, sun_slope = 0;

  double radius_km(double s) const { return line.radius_km(s); }
  double along_sun_km(double s) const { return sun_offset_km + sun_slope * s; }
  // The line from a place to the Sun; it begins at along_sun_km.
  StraightLine to_sun(double s) const {
    const double r = radius_km(s), along = along_sun_km(s);
    return {std::sqrt(std::max(0.0, (r - along) * (r + along)))};
  }
};

Ray trace(const SingleScatteringAir& air, const RaySegment& segment) {
  Ray ray;
  const double ground = air.ground_radius_km(), top = air.top_radius_km();
  const double start = ground + std::max(0.0, segment.start_height_km);
  const double sine = std::sin(segment.elevation_rad), cosine = std::cos(segment.elevation_rad);
  ray.line.perigee_radius_km = start * cosine;
  const double start_s = start * sine;
  const double sun_sine = std::sin(segment.sun_elevation_rad);
  ray.sun_slope = sine * sun_sine + cosine * std::cos(segment.sun_elevation_rad) *
                                        std::cos(segment.relative_azimuth_rad);
  ray.sun_offset_km = start * sun_sine - start_s * ray.sun_slope;

  double end = std::isfinite(segment.length_km) ? start_s + segment.length_km
                                                : std::numeric_limits<double>::infinity();
  if (ray.line.perigee_radius_km < ground && start_s < 0.0) {
    const double surface = std::max(start_s, -ray.line.half_chord_km(ground));
    if (surface <= end) {
      end = surface;
      ray.hits_ground = true;
    }
  }
  const double chord = ray.line.half_chord_km(top);
  ray.begin_km = std::max(start_s, -chord);
  ray.end_km = std::min(end, chord);
  ray.in_air = ray.line.perigee_radius_km < top && ray.end_km > ray.begin_km;
  return ray;
}

// The ray to the Sun meets the planet: the place lies behind it and within its radius of the axis.
bool in_shadow(const Ray& ray, double s, double ground) {
  return ray.along_sun_km(s) < 0.0 && ray.to_sun(s).perigee_radius_km < ground;
}

// Where the ray crosses the rim of the shadow, a cylinder of the ground's radius, and the plane
// through the centre across the Sun's direction.
void add_shadow_cuts(const Ray& ray, double ground, std::vector<double>& cuts) {
  // perigee^2 + s^2 - (offset + slope s)^2 = ground^2
  const double a = 1.0 - ray.sun_slope * ray.sun_slope;
  const double b = -ray.sun_offset_km * ray.sun_slope;
  const double p = ray.line.perigee_radius_km;
  const double c = (p - ground) * (p + ground) - ray.sun_offset_km * ray.sun_offset_km;
  const double discriminant = b * b - a * c;
  if (a > 1e-14 && discriminant >= 0.0) {
    const double q = std::sqrt(discriminant);
    cuts.push_back((-b - q) / a);
    cuts.push_back((-b + q) / a);
  }
  if (ray.sun_slope != 0.0) cuts.push_back(-ray.sun_offset_km / ray.sun_slope);
}

std::vector<double> cuts_of(const SingleScatteringAir& air, const Ray& ray) {
  std::vector<double> cuts = {0.0};
  add_shadow_cuts(ray, air.ground_radius_km(), cuts);
  for (const double level : air.levels_km()) {
    const double s = ray.line.half_chord_km(air.ground_radius_km() + level);
    if (s > 0.0) cuts.insert(cuts.end(), {-s, s});
  }
  std::erase_if(cuts, [&](double s) { return !(s > ray.begin_km && s < ray.end_km); });
  cuts.push_back(ray.begin_km);
  cuts.push_back(ray.end_km);
  std::ranges::sort(cuts);
  cuts.erase(std::ranges::unique(cuts).begin(), cuts.end());
  return cuts;
}

// The converged integral along one ray.
class Integral {
 public:
  Integral(const SingleScatteringAir& air, const Ray& ray)
      : air_(air),
        ray_(ray),
        W_(air.wavelengths()),
        at_(air.scattering_at(ray.sun_slope)),
        before_(W_),
        extinction_(W_),
        view_(W_),
        sun_(W_),
        source_(W_) {}

  // Inscattered radiance per unit of solar irradiance.
  std::vector<double> operator()() {
    const std::vector<double> cuts = cuts_of(air_, ray_);
    std::vector<Piece> pieces;
    std::vector<double> whole(W_);
    for (std::size_t i = 1; i < cuts.size(); ++i) {
      if (in_shadow(ray_, 0.5 * (cuts[i - 1] + cuts[i]), air_.ground_radius_km())) continue;
      const double from = root(cuts[i - 1]), to = root(cuts[i]);
      if (!(to > from)) continue;  // shorter than rounding
      pieces.push_back(piece(from, to));
      for (std::size_t w = 0; w < W_; ++w) whole[w] += pieces.back().value[w];
    }
    std::vector<double> result(W_);
    for (const Piece& p : pieces) add(p, whole, kMostHalvings, result);
    return result;
  }

 private:
  // Of the coordinate u, s = +-u sqrt(2 perigee + u^2), in which heights grow as u^2.
  struct Piece {
    double from, to;
    std::vector<double> value, error;
  };

  double root(double s) const {
    const double p = ray_.line.perigee_radius_km;
    return s / std::sqrt(ray_.radius_km(s) + p);
  }

  Piece piece(double from, double to) {
    return air_.layered() ? apply(kSeven, from, to) : apply(kFifteen, from, to);
  }

  template <std::size_t N>
  Piece apply(const std::array<KronrodNode, N>& rule, double from, double to) {
    Piece p{from, to, std::vector<double>(W_), std::vector<double>(W_)};
    std::vector<double>& gauss = p.error;
    const double middle = 0.5 * (from + to), half = 0.5 * (to - from);
    if (air_.layered()) enter_layer(from, middle);
    for (const KronrodNode& node : rule) {
      const double scale = half * light(middle + half * node.x);
      for (std::size_t w = 0; w < W_; ++w) {
        p.value[w] += scale * node.kronrod * source_[w];
        gauss[w] += scale * node.gauss * source_[w];
      }
    }
    for (std::size_t w = 0; w < W_; ++w) p.error[w] = std::abs(p.value[w] - gauss[w]);
    return p;
  }

  double place(double u) const { return u * std::sqrt(2.0 * ray_.line.perigee_radius_km + u * u); }

  double height(double u) const {
    return std::clamp(ray_.line.perigee_radius_km + u * u - air_.ground_radius_km(), 0.0,
                      air_.top_radius_km() - air_.ground_radius_km());
  }

  // A piece lies in one layer, where the view's optical depth grows evenly.
  void enter_layer(double from, double middle) {
    entry_km_ = std::max(place(from), ray_.begin_km);
    air_.optical_depth(ray_.line, ray_.begin_km, entry_km_, before_);
    air_.extinction(height(middle), extinction_);
  }

  void view_depth(double s) {
    if (!air_.layered()) {
      air_.optical_depth(ray_.line, ray_.begin_km, std::max(s, ray_.begin_km), view_);
      return;
    }
    for (std::size_t w = 0; w < W_; ++w) {
      view_[w] = before_[w] + std::max(0.0, s - entry_km_) * extinction_[w];
    }
  }

  // Leaves the light scattered per km in source_; returns ds/du.
  double light(double u) {
    const double p = ray_.line.perigee_radius_km;
    const double s = place(u), r = p + u * u;
    air_.angular_scattering(at_, height(u), source_);
    view_depth(s);
    const StraightLine up = ray_.to_sun(s);
    const double from = ray_.along_sun_km(s);
    air_.optical_depth(up, from, std::max(from, up.half_chord_km(air_.top_radius_km())), sun_);
    for (std::size_t w = 0; w < W_; ++w) source_[w] *= std::exp(-view_[w] - sun_[w]);
    return 2.0 * r / std::sqrt(r + p);
  }

  void add(const Piece& p, std::span<const double> whole, int halvings, std::vector<double>& sum) {
    bool good = halvings == 0;
    if (!good) {
      good = true;
      for (std::size_t w = 0; w < W_; ++w) {
        good = good && p.error[w] <= kTolerance * whole[w] + kNothing;
      }
    }
    if (good) {
      for (std::size_t w = 0; w < W_; ++w) sum[w] += p.value[w];
      return;
    }
    const double middle = 0.5 * (p.from + p.to);
    add(piece(p.from, middle), whole, halvings - 1, sum);
    add(piece(middle, p.to), whole, halvings - 1, sum);
  }

  const SingleScatteringAir& air_;
  const Ray& ray_;
  std::size_t W_;
  double entry_km_ = 0;
  std::vector<double> at_, before_, extinction_, view_, sun_, source_;
};

// Optical depth towards the Sun by samples at the middles of even segments; false where one of them
// lies below the ground.
bool sampled_sun_depth(const SingleScatteringAir& air, const StraightLine& line, double from_km,
                       int samples, std::span<double> depth, std::span<double> extinction) {
  const double top_km = air.top_radius_km() - air.ground_radius_km();
  const double step = std::max(0.0, line.half_chord_km(air.top_radius_km()) - from_km) / samples;
  std::ranges::fill(depth, 0.0);
  for (int j = 0; j < samples; ++j) {
    const double height = line.radius_km(from_km + (j + 0.5) * step) - air.ground_radius_km();
    if (height < 0.0) return false;
    air.extinction(std::min(height, top_km), extinction);
    for (std::size_t w = 0; w < depth.size(); ++w) depth[w] += extinction[w] * step;
  }
  return true;
}

// The lesson's loop: inscattered radiance per unit of solar irradiance, and the view's depth.
std::vector<double> sampled(const SingleScatteringAir& air, const Ray& ray,
                            const NishitaOptions& options, std::span<double> view_depth) {
  const std::size_t W = air.wavelengths();
  const std::vector<double> at = air.scattering_at(ray.sun_slope);
  std::vector<double> result(W), extinction(W), scattering(W), sun(W);
  const double step = (ray.end_km - ray.begin_km) / options.view_samples;
  const double top_km = air.top_radius_km() - air.ground_radius_km();
  for (int i = 0; i < options.view_samples; ++i) {
    const double s = ray.begin_km + (i + 0.5) * step;
    const double height = std::clamp(ray.radius_km(s) - air.ground_radius_km(), 0.0, top_km);
    air.extinction(height, extinction);
    for (std::size_t w = 0; w < W; ++w) view_depth[w] += extinction[w] * step;
    if (!sampled_sun_depth(air, ray.to_sun(s), ray.along_sun_km(s), options.light_samples, sun,
                           extinction)) {
      continue;
    }
    air.angular_scattering(at, height, scattering);
    for (std::size_t w = 0; w < W; ++w) {
      result[w] += scattering[w] * step * std::exp(-view_depth[w] - sun[w]);
    }
  }
  return result;
}

}  // namespace

SingleScattering::SingleScattering(const SingleScatteringAir& air, const NishitaOptions& options,
                                   std::span<const double> solar_irradiance)
    : air_(air),
      options_(options),
      solar_irradiance_(solar_irradiance.begin(), solar_irradiance.end()) {
  const auto filter = air.sunlight_filter();
  for (std::size_t w = 0; w < solar_irradiance_.size(); ++w) {
    solar_irradiance_[w] *= std::exp(-filter[w]);
  }
}

SingleScatteredRay SingleScattering::along(const RaySegment& segment) const {
  const std::size_t W = air_.wavelengths();
  const Ray ray = trace(air_, segment);
  SingleScatteredRay result{{std::vector<double>(W, 1.0), std::vector<double>(W)},
                            ray.hits_ground,
                            std::vector<double>(W)};
  if (ray.in_air) {
    std::vector<double> depth(W);
    if (options_.converged) {
      result.inscattered = Integral(air_, ray)();
      air_.optical_depth(ray.line, ray.begin_km, ray.end_km, depth);
    } else {
      result.inscattered = sampled(air_, ray, options_, depth);
    }
    for (std::size_t w = 0; w < W; ++w) {
      result.inscattered[w] *= solar_irradiance_[w];
      result.transmittance[w] = std::exp(-depth[w]);
    }
  }
  if (ray.hits_ground) {
    const double sine =
        std::clamp(ray.along_sun_km(ray.end_km) / air_.ground_radius_km(), -1.0, 1.0);
    if (sine > 0.0) {
      result.ground_irradiance = sun_transmittance(0.0, std::asin(sine));
      for (double& e : result.ground_irradiance) e *= sine;
    }
  }
  return result;
}

std::vector<double> SingleScattering::sun_transmittance(double height_km,
                                                        double sun_elevation_rad) const {
  const std::size_t W = air_.wavelengths();
  const double r = air_.ground_radius_km() + std::max(0.0, height_km);
  const StraightLine line{r * std::cos(sun_elevation_rad)};
  const double from = r * std::sin(sun_elevation_rad);
  std::vector<double> depth(W), result(W);
  if (from < 0.0 && line.perigee_radius_km < air_.ground_radius_km()) return result;
  const double chord = line.half_chord_km(air_.top_radius_km());
  const double begin = std::max(from, -chord);
  if (line.perigee_radius_km < air_.top_radius_km() && chord > begin) {
    if (options_.converged) {
      air_.optical_depth(line, begin, chord, depth);
    } else {
      std::vector<double> extinction(W);
      if (!sampled_sun_depth(air_, line, begin, options_.light_samples, depth, extinction)) {
        return result;
      }
    }
  }
  for (std::size_t w = 0; w < W; ++w) {
    result[w] = std::exp(-depth[w] - air_.sunlight_filter()[w]);
  }
  return result;
}

}  // namespace twilight
