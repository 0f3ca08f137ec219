#include "atmosphere/refraction.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
// Thickness of a shell: n is all but linear in it, off by (thickness / scale height)^2 / 8 of
// n - 1. Growing as n - 1 to the power -1/2 it spreads the error evenly.
constexpr double kShellAtGroundKm = 0.1;
constexpr double kShellGrowthKm = 16.0;
constexpr double kSmoothingKm = 2.0;
constexpr double kDefaultScaleHeightKm = 8.0;
// Below this refractivity the bending of a grazing ray is under 1e-6 rad.
constexpr double kFaintRefractivity = 1e-8;
constexpr int kExtensionShellsPerScaleHeight = 6;
// n r ~ r^m with m = 0 (critical refraction) divides by zero; keeping |m| above this changes n by
// 1e-7 at most.
constexpr double kLeastExponent = 1e-3;
constexpr double kAngleToleranceRad = 1e-7;

[[noreturn]] void fail(const char* quantity, double value, const char* allowed) {
  std::ostringstream s;
  s.precision(17);
  s << quantity << " " << value << " must be " << allowed;
  throw std::invalid_argument(s.str());
}

void check_start(double altitude_km, double zenith_rad) {
  if (!(altitude_km >= 0.0 && std::isfinite(altitude_km))) {
    fail("altitude_km", altitude_km, "finite and at least 0");
  }
  if (!(zenith_rad >= 0.0 && zenith_rad <= kPi)) fail("zenith angle", zenith_rad, "0..pi rad");
}

// Refractivity as a continuous function of height.
class RefractivityProfile {
 public:
  RefractivityProfile(const Medium& medium, std::size_t wavelength) {
    const std::size_t layers = medium.layers();
    const auto centre = [&](std::size_t i) {
      return 0.5 * (medium.boundary_km[i] + medium.boundary_km[i + 1]);
    };
    for (std::size_t i = 0; i < layers; ++i) {
      const std::size_t below = i > 0 ? i - 1 : i;
      const std::size_t above = i + 1 < layers ? i + 1 : i;
      double inverse_scale_height = 1.0 / kDefaultScaleHeightKm;
      if (above > below) {
        const double fall =
            medium.refractivity(below, wavelength) / medium.refractivity(above, wavelength);
        inverse_scale_height = fall > 0.0 && std::isfinite(fall)
                                   ? std::log(fall) / (centre(above) - centre(below))
                                   : 0.0;
      }
      // An exponential takes its mean ln(sinh(x) / x) scale heights below the layer's centre.
      const double x =
          0.5 * (medium.boundary_km[i + 1] - medium.boundary_km[i]) * inverse_scale_height;
      const double shift_km =
          std::abs(x) < 1e-4 ? 0.0 : std::log(std::sinh(x) / x) / inverse_scale_height;
      const double n_minus_1 = medium.refractivity(i, wavelength);
      height_km_.push_back(centre(i) - shift_km);
      refractivity_.push_back(n_minus_1);
    }
    if (layers == 1) {
      height_km_.push_back(height_km_[0] + kDefaultScaleHeightKm);
      refractivity_.push_back(refractivity_[0] * std::exp(-1.0));
    }
    smooth();
    find_slopes();
  }

  double operator()(double height_km) const {
    const auto above = std::upper_bound(height_km_.begin() + 1, height_km_.end() - 1, height_km);
    const auto i = static_cast<std::size_t>(above - height_km_.begin()) - 1;
    const double a = refractivity_[i];
    const double b = refractivity_[i + 1];
    const double step = height_km_[i + 1] - height_km_[i];
    const double t = (height_km - height_km_[i]) / step;
    if (!(a > 0.0 && b > 0.0)) return std::max(0.0, a + t * (b - a));
    if (t <= 0.0) return a * std::exp(t * step * slope_[i]);
    if (t >= 1.0) return b * std::exp((t - 1.0) * step * slope_[i + 1]);
    // Hermite's cubic of ln(n - 1).
    const double rise = std::log(b / a);
    const double from_line =
        t * (1.0 - t) * ((1.0 - t) * (step * slope_[i] - rise) - t * (step * slope_[i + 1] - rise));
    return a * std::exp(t * rise + from_line);
  }

  double top_scale_height_km() const {
    const std::size_t last = height_km_.size() - 1;
    const double fall = refractivity_[last - 1] / refractivity_[last];
    if (!(fall > 1.0 && std::isfinite(fall))) return kDefaultScaleHeightKm;
    return std::clamp((height_km_[last] - height_km_[last - 1]) / std::log(fall), 2.0, 20.0);
  }

 private:
  // Takes kinks out of ln(n - 1), level by level as profiles are tabulated: each node gets the
  // value there of the parabola that fits the nodes within kSmoothingKm best (tricube weights).
  // Parabolas of ln(n - 1) stay as they are, and so do layers thicker than that.
  void smooth() {
    if (*std::min_element(refractivity_.begin(), refractivity_.end()) <= 0.0) return;
    std::vector<double> log_n;
    for (const double n_minus_1 : refractivity_) log_n.push_back(std::log(n_minus_1));
    for (std::size_t i = 0; i < log_n.size(); ++i) {
      double m[5] = {}, b[3] = {};
      int members = 0;
      for (std::size_t k = 0; k < log_n.size(); ++k) {
        const double x = (height_km_[k] - height_km_[i]) / kSmoothingKm;
        if (std::abs(x) >= 1.0) continue;
        const double gap = 1.0 - std::abs(x * x * x);
        const double below = k > 0 ? height_km_[k] - height_km_[k - 1] : 0.0;
        const double above = k + 1 < log_n.size() ? height_km_[k + 1] - height_km_[k] : 0.0;
        double weight = gap * gap * gap * (below + above);
        ++members;
        const double y = log_n[k] - log_n[i];
        for (int power = 0; power < 5; ++power) {
          m[power] += weight;
          if (power < 3) b[power] += weight * y;
          weight *= x;
        }
      }
      if (members < 4) continue;
      // Cramer's rule for the constant of the parabola.
      const double c0 = m[2] * m[4] - m[3] * m[3];
      const double c1 = m[1] * m[4] - m[2] * m[3];
      const double c2 = m[1] * m[3] - m[2] * m[2];
      const double determinant = m[0] * c0 - m[1] * c1 + m[2] * c2;
      if (!(determinant > 1e-9 * m[0] * m[2] * m[4])) continue;
      const double change = (b[0] * c0 - b[1] * c1 + b[2] * c2) / determinant;
      refractivity_[i] = std::exp(log_n[i] + change);
    }
  }

  // Slopes of ln(n - 1) at the nodes: of the natural cubic spline, limited so that the cubic is
  // monotone where the nodes are (Fritsch & Carlson 1980).
  void find_slopes() {
    const std::size_t nodes = height_km_.size();
    slope_.assign(nodes, 0.0);
    if (*std::min_element(refractivity_.begin(), refractivity_.end()) <= 0.0) return;
    std::vector<double> secant, step;
    for (std::size_t i = 0; i + 1 < nodes; ++i) {
      step.push_back(height_km_[i + 1] - height_km_[i]);
      secant.push_back(std::log(refractivity_[i + 1] / refractivity_[i]) / step.back());
    }
    // Continuous second derivative, 0 at the ends; Thomas's algorithm.
    std::vector<double> upper(nodes, 0.0);
    for (std::size_t i = 0; i < nodes; ++i) {
      const double below = i > 0 ? 1.0 / step[i - 1] : 0.0;
      const double above = i + 1 < nodes ? 1.0 / step[i] : 0.0;
      const double known =
          3.0 * ((i > 0 ? below * secant[i - 1] : 0.0) + (i + 1 < nodes ? above * secant[i] : 0.0));
      const double pivot = 2.0 * (below + above) - (i > 0 ? below * upper[i - 1] : 0.0);
      upper[i] = above / pivot;
      slope_[i] = (known - (i > 0 ? below * slope_[i - 1] : 0.0)) / pivot;
    }
    for (std::size_t i = nodes - 1; i-- > 0;) slope_[i] -= upper[i] * slope_[i + 1];
    for (std::size_t i = 0; i < nodes; ++i) {
      const double below = secant[i > 0 ? i - 1 : 0];
      const double above = secant[std::min(i, nodes - 2)];
      const double least = below * above > 0.0 ? std::min(std::abs(below), std::abs(above)) : 0.0;
      const double sign = above < 0.0 ? -1.0 : 1.0;
      slope_[i] = sign * std::clamp(sign * slope_[i], 0.0, 3.0 * least);
    }
  }

  std::vector<double> height_km_;
  std::vector<double> refractivity_;
  std::vector<double> slope_;  // of the logarithm, km^-1
};

void check_medium(const Medium& medium, std::size_t wavelength) {
  if (wavelength >= medium.wavelengths()) {
    fail("wavelength index", static_cast<double>(wavelength), "below the number of wavelengths");
  }
  if (medium.layers() == 0) fail("number of layers", 0.0, "at least 1");
  if (!(medium.earth_radius_km > 0.0 && std::isfinite(medium.earth_radius_km))) {
    fail("earth_radius_km", medium.earth_radius_km, "finite and above 0");
  }
  if (medium.boundary_km[0] != 0.0) fail("lowest boundary", medium.boundary_km[0], "0 km");
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    if (!(medium.boundary_km[i + 1] > medium.boundary_km[i]) ||
        !std::isfinite(medium.boundary_km[i + 1])) {
      fail("layer boundary", medium.boundary_km[i + 1], "above the one below it");
    }
    const double n_minus_1 = medium.refractivity(i, wavelength);
    if (!(n_minus_1 >= 0.0 && n_minus_1 < 0.1)) fail("refractivity", n_minus_1, "within [0, 0.1)");
  }
}

// atan(b / c) - atan(a / c) for c >= 0, given b - a without cancellation.
double angle_between(double a, double b, double b_minus_a, double c) {
  const double across = c * b_minus_a;
  const double along = c * c + a * b;
  if (std::abs(across) < 0.02 * along) {
    const double t = across / along;
    const double t2 = t * t;
    return t * (1.0 - t2 * (1.0 / 3.0 - t2 * (1.0 / 5.0)));
  }
  return std::atan2(across, along);
}

}  // namespace

RefractedRays::RefractedRays(const Medium& medium, std::size_t wavelength, bool refraction)
    : radius_km_(medium.earth_radius_km), layers_(medium.layers()) {
  check_medium(medium, wavelength);
  for (std::size_t i = 0; i < layers_; ++i) {
    refracting_ = refracting_ || (refraction && medium.refractivity(i, wavelength) > 0.0);
  }
  const RefractivityProfile profile(medium, wavelength);

  // Boundaries of the shells with the refractivity there.
  std::vector<double> height_km{0.0};
  std::vector<double> refractivity{refracting_ ? profile(0.0) : 0.0};
  std::vector<std::size_t> layer;
  std::vector<double> sag;  // n - 1 of a straight line at mid-shell less the profile's
  const auto add = [&](double height, double n_minus_1, std::size_t of_layer) {
    double below_line = 0.0;
    if (refracting_ && of_layer != kAboveModel) {
      // Limited so that the shell's parabola is monotone.
      const double limit = 0.25 * std::abs(refractivity.back() - n_minus_1);
      below_line = std::clamp(
          0.5 * (refractivity.back() + n_minus_1) - profile(0.5 * (height_km.back() + height)),
          -limit, limit);
    }
    sag.push_back(below_line);
    height_km.push_back(height);
    refractivity.push_back(n_minus_1);
    layer.push_back(of_layer);
  };
  for (std::size_t i = 0; i < layers_; ++i) {
    const double bottom = medium.boundary_km[i];
    const double top = medium.boundary_km[i + 1];
    const bool bends = refracting_ && refractivity.back() > kFaintRefractivity;
    if (bends) {
      // Steps even in exp(-h / growth), relative to the layer's bottom.
      const double fall = -std::expm1((bottom - top) / kShellGrowthKm);
      const double thickness = kShellAtGroundKm * std::exp(std::min(bottom, 60.0) / kShellGrowthKm);
      const int parts =
          static_cast<int>(std::clamp(std::ceil(fall * kShellGrowthKm / thickness), 1.0, 2000.0));
      for (int part = 1; part < parts; ++part) {
        const double h = bottom - kShellGrowthKm * std::log1p(-fall * part / parts);
        add(h, profile(h), i);
      }
    }
    add(top, refracting_ ? profile(top) : 0.0, i);
  }
  if (refracting_) {
    const double scale_km = profile.top_scale_height_km();
    while (refractivity.back() > kFaintRefractivity) {
      add(height_km.back() + scale_km / kExtensionShellsPerScaleHeight,
          refractivity.back() * std::exp(-1.0 / kExtensionShellsPerScaleHeight), kAboveModel);
    }
    add(height_km.back() + scale_km, 0.0, kAboveModel);
  }

  const auto v_of = [&](std::size_t j) {
    return height_km[j] + refractivity[j] * (radius_km_ + height_km[j]);
  };
  boundary_.push_back({0.0, v_of(0)});
  for (std::size_t j = 0; j < layer.size(); ++j) {
    const Boundary& lower = boundary_.back();
    const double log_r =
        std::log1p((height_km[j + 1] - height_km[j]) / (radius_km_ + height_km[j]));
    double v = v_of(j + 1);
    double m = std::log1p((v - lower.v_km) / (radius_km_ + lower.v_km)) / log_r;
    if (std::abs(m) < kLeastExponent) {
      m = m < 0.0 ? -kLeastExponent : kLeastExponent;
      v = lower.v_km + (radius_km_ + lower.v_km) * std::expm1(m * log_r);
    }
    const double n = 1.0 + 0.5 * (refractivity[j] + refractivity[j + 1]);
    const double thick = height_km[j + 1] - height_km[j];
    const double second_derivative = 8.0 * sag[j] / (thick * thick);
    shell_.push_back({m, 1.0 / (m * n), (1.0 - m) / m,
                      second_derivative / ((radius_km_ + lower.v_km) * m * m * n * n), layer[j]});
    boundary_.push_back({height_km[j + 1], v});
  }
}

std::size_t RefractedRays::shell_at(double height_km) const {
  const auto above = std::upper_bound(boundary_.begin() + 1, boundary_.end() - 1, height_km,
                                      [](double h, const Boundary& b) { return h < b.height_km; });
  return static_cast<std::size_t>(above - boundary_.begin()) - 1;
}

double RefractedRays::v_km(double height_km, std::size_t shell) const {
  if (height_km >= boundary_.back().height_km) return height_km;
  const Boundary& lower = boundary_[shell];
  const double above_km = height_km - lower.height_km;
  if (above_km == 0.0) return lower.v_km;
  if (shell_[shell].exponent == 1.0) {  // n is constant there
    return lower.v_km + above_km * (radius_km_ + lower.v_km) / (radius_km_ + lower.height_km);
  }
  return lower.v_km + (radius_km_ + lower.v_km) *
                          std::expm1(shell_[shell].exponent *
                                     std::log1p(above_km / (radius_km_ + lower.height_km)));
}

namespace {

// A ray's way through one shell.
struct Leg {
  std::size_t shell;
  double step_km;   // change of n r cos(theta), which is negative downwards
  double turn_rad;  // by how much the local zenith angle falls
  double bending_rad;
  double to_height_km;
};

}  // namespace

template <typename Visit>
RayTrace RefractedRays::march(double altitude_km, double apparent_zenith_rad,
                              const Visit& visit) const {
  const double sine = std::sin(apparent_zenith_rad);
  const double cosine = std::cos(apparent_zenith_rad);
  bool up = cosine >= 0.0;
  RayTrace trace{false, 0.0, apparent_zenith_rad, altitude_km};

  std::size_t shell = shell_at(altitude_km);
  const double v0 = v_km(altitude_km, shell);
  const double u0 = radius_km_ + v0;
  const double impact = u0 * sine;               // n r sin(theta)
  const double start_x = u0 * std::abs(cosine);  // n r |cos(theta)|
  const auto x_squared = [&](const Boundary& b) {
    return start_x * start_x + (b.v_km - v0) * (b.v_km + v0 + 2.0 * radius_km_);
  };
  // Below u0 by u0 (1 - sin(theta)), written without cancellation.
  const double perigee_v = v0 - start_x * start_x / (u0 * (1.0 + sine));
  const auto perigee_km = [&](std::size_t in_shell) {
    const Boundary& b = boundary_[in_shell];
    return b.height_km + (radius_km_ + b.height_km) *
                             std::expm1(std::log1p((perigee_v - b.v_km) / (radius_km_ + b.v_km)) /
                                        shell_[in_shell].exponent);
  };

  double x = start_x;
  double v = v0;
  if (altitude_km >= boundary_.back().height_km) {
    if (up) return trace;
    const double entry = x_squared(boundary_.back());
    if (entry <= 0.0) {
      trace.perigee_km = perigee_v;
      return trace;
    }
    x = std::sqrt(entry);
    v = boundary_.back().v_km;
    shell = shell_.size() - 1;
    const double step = (v0 - v) * (v0 + v + 2.0 * radius_km_) / (start_x + x);
    visit(Leg{kAboveModel, step, angle_between(-start_x, -x, step, impact), 0.0,
              boundary_.back().height_km});
  } else if (!up && altitude_km == boundary_[shell].height_km) {
    if (shell == 0) {
      trace.hits_ground = true;
      trace.perigee_km = 0.0;
      return trace;
    }
    --shell;
  }

  for (int turns = 0;;) {
    const Shell& s = shell_[shell];
    const Boundary& boundary = boundary_[up ? shell + 1 : shell];
    const double end_squared = x_squared(boundary);
    const bool turning = end_squared < 0.0;
    const double end = turning ? 0.0 : std::sqrt(end_squared);
    // n r cos(theta) along the ray: x when going up, -x when going down.
    const double from = up ? x : -x;
    const double to = up ? end : -end;
    double step = to - from;
    if (!turning && x > 0.0) {  // without cancellation
      step =
          (boundary.v_km - v) * (boundary.v_km + v + 2.0 * radius_km_) / (up ? x + end : -x - end);
    }
    const double angle = angle_between(from, to, step, impact);
    double bending = s.bending_factor * angle;
    if (s.curvature != 0.0) {
      // Minus the integral over x = n r cos(theta) of b / v dn / dv / n, v = n r, for what a
      // slope n'' (y - thickness / 2) at y above the bottom adds; y is linear in x^2.
      const Boundary& bottom = boundary_[shell];
      const double mean_y = ((from * from + from * to + to * to) / 3.0 - x_squared(bottom)) *
                            s.length_factor / (2.0 * (radius_km_ + bottom.v_km));
      const double half = 0.5 * (boundary_[shell + 1].height_km - bottom.height_km);
      bending -= impact * s.curvature * step * (mean_y - half);
    }
    trace.deflection_rad += bending;
    double height = boundary.height_km;
    if (turning) {
      height = std::max(0.0, perigee_km(shell));
      if (!up) trace.perigee_km = std::min(trace.perigee_km, height);
    }
    const double end_v = turning ? perigee_v : boundary.v_km;
    visit(Leg{shell, step, angle, bending, height});
    x = end;
    v = end_v;
    if (turning) {
      if (++turns == 3) {
        trace.hits_ground = true;
        break;
      }
      up = !up;
    } else if (up) {
      if (++shell == shell_.size()) break;
    } else if (shell-- == 0) {
      trace.hits_ground = true;
      trace.perigee_km = 0.0;
      break;
    }
  }
  return trace;
}

RayTrace RefractedRays::trace_outward(double altitude_km, double apparent_zenith_rad,
                                      std::span<double> path_km) const {
  check_start(altitude_km, apparent_zenith_rad);
  if (!path_km.empty() && path_km.size() != layers_) {
    fail("size of path_km", static_cast<double>(path_km.size()), "the number of layers or 0");
  }
  std::fill(path_km.begin(), path_km.end(), 0.0);
  RayTrace trace = march(altitude_km, apparent_zenith_rad, [&](const Leg& leg) {
    if (path_km.empty() || leg.shell == kAboveModel) return;
    const Shell& s = shell_[leg.shell];
    if (s.layer != kAboveModel) path_km[s.layer] += leg.step_km * s.length_factor;
  });
  trace.true_zenith_rad = apparent_zenith_rad + trace.deflection_rad;
  return trace;
}

RayPath RefractedRays::follow(double altitude_km, double apparent_zenith_rad) const {
  check_start(altitude_km, apparent_zenith_rad);
  RayPath path;
  double height = altitude_km;
  double central = 0.0;
  double zenith = apparent_zenith_rad;
  const RayTrace trace = march(altitude_km, apparent_zenith_rad, [&](const Leg& leg) {
    PathPiece piece;
    piece.start_altitude_km = height;
    piece.start_angle_rad = central;
    piece.start_zenith_rad = zenith;
    height = leg.to_height_km;
    zenith -= leg.turn_rad;
    central += leg.turn_rad + leg.bending_rad;  // direction: zenith + central = start + deflection
    piece.end_altitude_km = height;
    piece.end_angle_rad = central;
    piece.end_zenith_rad = zenith;
    if (leg.shell == kAboveModel || shell_[leg.shell].layer == kAboveModel) return;
    piece.layer = shell_[leg.shell].layer;
    piece.length_km = leg.step_km * shell_[leg.shell].length_factor;
    if (piece.length_km > 0.0) path.pieces.push_back(piece);
  });
  path.hits_ground = trace.hits_ground;
  path.deflection_rad = trace.deflection_rad;
  return path;
}

double RefractedRays::refractive_index(double altitude_km) const {
  check_start(altitude_km, 0.0);
  if (!refracting_) return 1.0;
  const double v = v_km(altitude_km, shell_at(altitude_km));
  return 1.0 + (v - altitude_km) / (radius_km_ + altitude_km);
}

double RefractedRays::horizon_apparent_zenith_rad(double altitude_km) const {
  check_start(altitude_km, 0.0);
  const double v0 = v_km(altitude_km, shell_at(altitude_km));
  double least_above = v0;
  double least_below = v0;
  for (const Boundary& b : boundary_) {
    double& least = b.height_km >= altitude_km ? least_above : least_below;
    least = std::min(least, b.v_km);
  }
  const bool ducted = least_above < v0;
  const double least = ducted ? least_above : least_below;
  const double cosine_side = std::sqrt((v0 - least) * (v0 + least + 2.0 * radius_km_));
  const double angle = std::atan2(cosine_side, radius_km_ + least);
  return 0.5 * kPi + (ducted ? -angle : angle);
}

std::optional<double> RefractedRays::apparent_zenith_rad(double altitude_km,
                                                         double true_zenith_rad) const {
  check_start(altitude_km, true_zenith_rad);
  if (true_zenith_rad == 0.0) return 0.0;
  const double horizon = horizon_apparent_zenith_rad(altitude_km);
  if (!refracting_) {
    if (true_zenith_rad > horizon) return std::nullopt;
    return true_zenith_rad;
  }
  const auto error_at = [&](double zenith) {
    return zenith + trace_outward(altitude_km, zenith, {}).deflection_rad - true_zenith_rad;
  };

  // The limiting ray itself, which rounding may put into the ground.
  const auto last_leaving = [&] {
    double zenith = horizon;
    double step = 1e-14;
    for (int i = 0; i < 8 && trace_outward(altitude_km, zenith, {}).hits_ground; ++i) {
      zenith = horizon - step;
      step *= 10.0;
    }
    return zenith;
  };
  double high = true_zenith_rad < horizon ? true_zenith_rad : last_leaving();
  double high_error = error_at(high);
  // Bending grows with the zenith angle, so it is at most that of `high`.
  double low = std::clamp(high - high_error, 0.0, high);
  if (high_error < 0.0) {
    if (true_zenith_rad >= horizon) return std::nullopt;
    // Rays bent upwards, by a refractivity that grows with height.
    low = high;
    high = last_leaving();
    high_error = error_at(high);
    if (high_error < 0.0) return std::nullopt;
  }
  double low_error = error_at(low);
  if (low_error > 0.0) {
    low = 0.0;
    low_error = -true_zenith_rad;
  }
  bool last_low = false;
  bool last_high = false;
  for (int i = 0; i < 100 && high - low > kAngleToleranceRad; ++i) {
    double trial = i % 8 == 7 || high_error == low_error
                       ? 0.5 * (low + high)
                       : (low * high_error - high * low_error) / (high_error - low_error);
    trial = std::clamp(trial, low, high);
    const double error = error_at(trial);
    if (std::abs(error) < 0.1 * kAngleToleranceRad) return trial;
    // The Illinois rule: halve the error of an end that stays, so that both ends move.
    if (error > 0.0) {
      high = trial;
      high_error = error;
      if (last_high) low_error *= 0.5;
    } else {
      low = trial;
      low_error = error;
      if (last_low) high_error *= 0.5;
    }
    last_high = error > 0.0;
    last_low = !last_high;
  }
  return 0.5 * (low + high);
}

RayTrace trace_outward(const Medium& medium, std::size_t wavelength, double altitude_km,
                       double apparent_zenith_rad, std::span<double> path_km) {
  return RefractedRays(medium, wavelength).trace_outward(altitude_km, apparent_zenith_rad, path_km);
}

std::optional<double> apparent_zenith_rad(const Medium& medium, std::size_t wavelength,
                                          double altitude_km, double true_zenith_rad) {
  return RefractedRays(medium, wavelength).apparent_zenith_rad(altitude_km, true_zenith_rad);
}

double horizon_apparent_zenith_rad(const Medium& medium, std::size_t wavelength,
                                   double altitude_km) {
  return RefractedRays(medium, wavelength).horizon_apparent_zenith_rad(altitude_km);
}

double slant_optical_depth(const Medium& medium, std::size_t wavelength,
                           std::span<const double> path_km) {
  if (path_km.size() != medium.layers()) {
    fail("size of path_km", static_cast<double>(path_km.size()), "the number of layers");
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < path_km.size(); ++i) {
    if (path_km[i] > 0.0) sum += medium.extinction_per_km(i, wavelength) * path_km[i];
  }
  return sum;
}

}  // namespace twilight
