// Where Bruneton & Neyret (2008) keep what in their tables.
#pragma once

#include <array>
#include <cstddef>

namespace twilight {

/// The two spheres that bound the air, km; 0 < ground < top.
struct BrunetonSphere {
  double ground_radius_km = 6360.0;
  double top_radius_km = 6420.0;
  /// H of their Sec. 4: from the horizon on the ground to the air's top, km.
  double horizon_km() const;
  /// rho of their Sec. 4: from radius_km (taken as at least the ground's) to its horizon, km.
  double rho_km(double radius_km) const;
};

/// Cosine of a view's zenith angle, and whether the view ends on the ground: at the horizon both
/// ends exist, and the tables keep them apart.
struct BrunetonView {
  double mu = 1.0;
  bool ground = false;
};

/// A place in the scattering table: distance from the Earth's centre, km; cosines of the zenith
/// angles of view and Sun and of the angle between the two.
struct BrunetonPoint {
  double radius_km = 6360.0;
  BrunetonView view;
  double mu_s = 1.0;
  double nu = 1.0;
};

/// Number of texels along u_r, u_mu (even: half of them look at the ground), u_mus and u_nu.
struct BrunetonSize {
  std::size_t r = 32, mu = 128, mu_s = 32, nu = 8;
  std::size_t texels() const { return r * mu * mu_s * nu; }
  /// As their packed texture: r slowest, then mu, nu, and mu_s fastest.
  std::size_t index(std::size_t i_r, std::size_t i_mu, std::size_t i_mu_s, std::size_t i_nu) const {
    return ((i_r * mu + i_mu) * nu + i_nu) * mu_s + i_mu_s;
  }
};

/// Size of a table in radius and one cosine: transmittance 64 x 256, irradiance 16 x 64 (Sec. 6;
/// T(r, mu) and E(r, mu_s) are named in this order, hence so are the sizes). r is slow.
struct BrunetonPlaneSize {
  std::size_t r = 64, cosine = 256;
  std::size_t texels() const { return r * cosine; }
  std::size_t index(std::size_t i_r, std::size_t i) const { return i_r * cosine + i; }
};

/// The lowest Sun of the mapping: u_mus = 0 (Sec. 4), zenith angle 101.54 degrees.
inline constexpr double kBrunetonLowestMuS = -0.2;

// Texels lie at the ends of their range: texel k of n holds u = k / (n - 1), so that ground, top,
// horizon, forward and back and the highest and lowest Sun are texels themselves. What follows
// gives texels as real numbers in [0, n - 1], and back; arguments outside are taken at the edge.

/// u_r = rho / H, and back.
double bruneton_r_texel(const BrunetonSphere& sphere, double radius_km, std::size_t n);
double bruneton_radius_km(const BrunetonSphere& sphere, double texel, std::size_t n);

/// u_mus = (1 - exp(-3 mu_s - 0.6)) / (1 - exp(-3.6)), and back: -0.2 at texel 0, 1 at the last.
double bruneton_mu_s_texel(double mu_s, std::size_t n);
double bruneton_mu_s(double texel, std::size_t n);

/// u_nu = (1 + nu) / 2, and back.
double bruneton_nu_texel(double nu, std::size_t n);
double bruneton_nu(double texel, std::size_t n);

/// u_mu as printed, in [0, 1]: u = 1/2 - d / (2 rho) for views that meet the ground after d (0 at
/// the horizon), u = 1/2 + d / (2 rho + 2 H) for those that leave the air after d (1 at the
/// horizon). On the ground itself (rho = 0) views to it have the limit 1/2.
double bruneton_u_mu(const BrunetonSphere& sphere, double radius_km, const BrunetonView& view);
/// The texel: u = 0..1/2 on the first half of the n (0..n/2 - 1), 1/2..1 on the second (n/2..n -
/// 1), so that no interpolation crosses the horizon.
double bruneton_mu_texel(const BrunetonSphere& sphere, double radius_km, const BrunetonView& view,
                         std::size_t n);
/// And back. Texels with a shorter way than the vertical one are reached by no view: they give
/// straight down or up. See bruneton_vertical_texel().
BrunetonView bruneton_view(const BrunetonSphere& sphere, double radius_km, double texel,
                           std::size_t n);
/// The texel of the view straight up, or down (`ground`): the last texels n/2 - 1 and n/2 are
/// beyond.
double bruneton_vertical_texel(const BrunetonSphere& sphere, double radius_km, bool ground,
                               std::size_t n);

/// A texel's view as the formulas continue it beyond the vertical, where |mu| > 1 and no view is:
/// the same way d, r mu = (end^2 - r^2 - d^2) / (2 d). Tables filled so let linear interpolation
/// hold up to the vertical itself, which lies between texels. mu is bounded (at d = 0) by +-4.
struct BrunetonRay {
  double mu = 1.0;
  double distance_km = 0.0;
  bool ground = false;
};
BrunetonRay bruneton_continued_ray(const BrunetonSphere& sphere, double radius_km,
                                   std::size_t texel, std::size_t n);
/// The texel of a way of that length to the ground or the air's top, also shorter than vertical.
double bruneton_distance_texel(const BrunetonSphere& sphere, double radius_km, double distance_km,
                               bool ground, std::size_t n);

/// Whether a view from there meets the ground: r mu < 0 and r^2 mu^2 > rho^2.
bool bruneton_meets_ground(const BrunetonSphere& sphere, double radius_km, double mu);
/// The way to the ground or the air's top, km, d_o of Sec. 4; radius_km within the spheres.
double bruneton_distance_km(const BrunetonSphere& sphere, double radius_km,
                            const BrunetonView& view);

/// Texels (r, mu, mu_s, nu) of a place, as real numbers, and the place of a texel; there nu is
/// taken within the angles that the two zenith angles allow.
std::array<double, 4> bruneton_texel(const BrunetonSphere& sphere, const BrunetonPoint& point,
                                     const BrunetonSize& size);
BrunetonPoint bruneton_point(const BrunetonSphere& sphere, const std::array<double, 4>& texel,
                             const BrunetonSize& size);
/// Least and greatest nu of two zenith angles: mu mu_s -+ sqrt((1 - mu^2)(1 - mu_s^2)).
std::array<double, 2> bruneton_nu_range(double mu, double mu_s);

/// Transmittance to the air's top (views to the ground have the quotient of two such). The paper
/// prints no mapping for it; here u_r as above and, along the second axis, the way d to the top
/// between the vertical one, 0, and that of the horizon, 1.
double bruneton_transmittance_texel(const BrunetonSphere& sphere, double radius_km, double mu,
                                    std::size_t n);
double bruneton_transmittance_mu(const BrunetonSphere& sphere, double radius_km, double texel,
                                 std::size_t n);

// Irradiance E(r, mu_s): u_r and u_mus as in the scattering table (the paper prints no other).

}  // namespace twilight
