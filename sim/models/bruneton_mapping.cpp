#include "sim/models/bruneton_mapping.h"

#include <algorithm>
#include <cmath>

namespace twilight {
namespace {

double last(std::size_t n) { return static_cast<double>(n - 1); }

double clamped_radius(const BrunetonSphere& s, double radius_km) {
  return std::clamp(radius_km, s.ground_radius_km, s.top_radius_km);
}

// Way to the sphere of the given radius ahead (the far one), squares kept as products.
double way_out_km(double radius_km, double mu, double sphere_km) {
  const double rise = (sphere_km - radius_km) * (sphere_km + radius_km);
  const double b = radius_km * mu, root = std::sqrt(std::max(0.0, b * b + rise));
  return b > 0 ? (root + b > 0 ? rise / (root + b) : 0.0) : root - b;
}

}  // namespace

double BrunetonSphere::rho_km(double radius_km) const {
  const double r = std::max(radius_km, ground_radius_km);
  return std::sqrt((r - ground_radius_km) * (r + ground_radius_km));
}

double BrunetonSphere::horizon_km() const { return rho_km(top_radius_km); }

double bruneton_r_texel(const BrunetonSphere& sphere, double radius_km, std::size_t n) {
  const double u = sphere.rho_km(radius_km) / sphere.horizon_km();
  return std::min(u, 1.0) * last(n);
}

double bruneton_radius_km(const BrunetonSphere& sphere, double texel, std::size_t n) {
  const double u = std::clamp(texel / last(n), 0.0, 1.0);
  if (u == 1.0) return sphere.top_radius_km;
  return std::hypot(sphere.ground_radius_km, u * sphere.horizon_km());
}

double bruneton_mu_s_texel(double mu_s, std::size_t n) {
  const double u = std::expm1(-3.0 * mu_s - 0.6) / std::expm1(-3.6);
  return std::clamp(u, 0.0, 1.0) * last(n);
}

double bruneton_mu_s(double texel, std::size_t n) {
  const double u = std::clamp(texel / last(n), 0.0, 1.0);
  return std::clamp(-(std::log1p(u * std::expm1(-3.6)) + 0.6) / 3.0, kBrunetonLowestMuS, 1.0);
}

double bruneton_nu_texel(double nu, std::size_t n) {
  return std::clamp(0.5 * (1.0 + nu), 0.0, 1.0) * last(n);
}

double bruneton_nu(double texel, std::size_t n) {
  return std::clamp(2.0 * texel / last(n) - 1.0, -1.0, 1.0);
}

bool bruneton_meets_ground(const BrunetonSphere& sphere, double radius_km, double mu) {
  const double rho = sphere.rho_km(radius_km);
  return mu < 0 && radius_km * mu < -rho;
}

double bruneton_distance_km(const BrunetonSphere& sphere, double radius_km,
                            const BrunetonView& view) {
  const double r = clamped_radius(sphere, radius_km);
  if (!view.ground) return way_out_km(r, view.mu, sphere.top_radius_km);
  const double rho = sphere.rho_km(r), b = -r * view.mu;
  const double root = std::sqrt(std::max(0.0, (b - rho) * (b + rho)));
  return b + root > 0 ? std::clamp(rho * rho / (b + root), r - sphere.ground_radius_km, rho) : 0.0;
}

double bruneton_u_mu(const BrunetonSphere& sphere, double radius_km, const BrunetonView& view) {
  const double r = clamped_radius(sphere, radius_km), rho = sphere.rho_km(r);
  const double d = bruneton_distance_km(sphere, r, view);
  if (view.ground) return rho > 0 ? 0.5 - 0.5 * std::min(1.0, d / rho) : 0.5;
  return 0.5 + 0.5 * std::min(1.0, d / (rho + sphere.horizon_km()));
}

double bruneton_mu_texel(const BrunetonSphere& sphere, double radius_km, const BrunetonView& view,
                         std::size_t n) {
  const double half = last(n / 2), u = bruneton_u_mu(sphere, radius_km, view);
  return view.ground ? 2.0 * u * half : static_cast<double>(n / 2) + (2.0 * u - 1.0) * half;
}

BrunetonView bruneton_view(const BrunetonSphere& sphere, double radius_km, double texel,
                           std::size_t n) {
  const double half = last(n / 2), r = clamped_radius(sphere, radius_km);
  const double rho = sphere.rho_km(r), horizon = sphere.horizon_km();
  if (texel <= half) {
    const double x = 1.0 - std::max(0.0, texel) / half;  // d / rho
    const double shortest = rho > 0 ? (r - sphere.ground_radius_km) / rho : 0.0;
    if (x <= shortest) return {-1.0, true};
    return {std::clamp(-rho * (1.0 + x * x) / (2.0 * r * x), -1.0, 0.0), true};
  }
  const double x = std::clamp((texel - static_cast<double>(n / 2)) / half, 0.0, 1.0);
  const double d = x * (rho + horizon);
  if (d <= sphere.top_radius_km - r) return {1.0, false};
  return {std::clamp(((horizon - rho) * (horizon + rho) - d * d) / (2.0 * r * d), -1.0, 1.0),
          false};
}

double bruneton_vertical_texel(const BrunetonSphere& sphere, double radius_km, bool ground,
                               std::size_t n) {
  return bruneton_mu_texel(sphere, radius_km, {ground ? -1.0 : 1.0, ground}, n);
}

BrunetonRay bruneton_continued_ray(const BrunetonSphere& sphere, double radius_km,
                                   std::size_t texel, std::size_t n) {
  constexpr double kSteepest = 4.0;
  const double r = clamped_radius(sphere, radius_km), rho = sphere.rho_km(r), half = last(n / 2);
  if (texel < n / 2) {
    const double d = rho * (1.0 - static_cast<double>(texel) / half);
    if (d <= 0) return {rho > 0 || texel + 1 == n / 2 ? -1.0 : 0.0, 0.0, true};
    return {std::max(-(rho * rho + d * d) / (2.0 * r * d), -kSteepest), d, true};
  }
  const double horizon = sphere.horizon_km();
  const double d = (rho + horizon) * static_cast<double>(texel - n / 2) / half;
  if (d <= 0) return {1.0, 0.0, false};
  return {std::min(((horizon - rho) * (horizon + rho) - d * d) / (2.0 * r * d), kSteepest), d,
          false};
}

double bruneton_distance_texel(const BrunetonSphere& sphere, double radius_km, double distance_km,
                               bool ground, std::size_t n) {
  const double rho = sphere.rho_km(radius_km), half = last(n / 2);
  const double longest = ground ? rho : rho + sphere.horizon_km();
  const double x = longest > 0 ? std::clamp(distance_km / longest, 0.0, 1.0) : 0.0;
  return ground ? (1.0 - x) * half : static_cast<double>(n / 2) + x * half;
}

std::array<double, 4> bruneton_texel(const BrunetonSphere& sphere, const BrunetonPoint& point,
                                     const BrunetonSize& size) {
  return {bruneton_r_texel(sphere, point.radius_km, size.r),
          bruneton_mu_texel(sphere, point.radius_km, point.view, size.mu),
          bruneton_mu_s_texel(point.mu_s, size.mu_s), bruneton_nu_texel(point.nu, size.nu)};
}

BrunetonPoint bruneton_point(const BrunetonSphere& sphere, const std::array<double, 4>& texel,
                             const BrunetonSize& size) {
  BrunetonPoint p;
  p.radius_km = bruneton_radius_km(sphere, texel[0], size.r);
  p.view = bruneton_view(sphere, p.radius_km, texel[1], size.mu);
  p.mu_s = bruneton_mu_s(texel[2], size.mu_s);
  const auto [least, greatest] = bruneton_nu_range(p.view.mu, p.mu_s);
  p.nu = std::clamp(bruneton_nu(texel[3], size.nu), least, greatest);
  return p;
}

std::array<double, 2> bruneton_nu_range(double mu, double mu_s) {
  const double middle = mu * mu_s;
  const double half = std::sqrt(std::max(0.0, (1.0 - mu * mu) * (1.0 - mu_s * mu_s)));
  return {std::max(-1.0, middle - half), std::min(1.0, middle + half)};
}

double bruneton_transmittance_texel(const BrunetonSphere& sphere, double radius_km, double mu,
                                    std::size_t n) {
  const double r = clamped_radius(sphere, radius_km);
  const double shortest = sphere.top_radius_km - r;
  const double longest = sphere.rho_km(r) + sphere.horizon_km();
  const double d = bruneton_distance_km(sphere, r, {mu, false});
  return std::clamp((d - shortest) / (longest - shortest), 0.0, 1.0) * last(n);
}

double bruneton_transmittance_mu(const BrunetonSphere& sphere, double radius_km, double texel,
                                 std::size_t n) {
  const double r = clamped_radius(sphere, radius_km);
  const double rho = sphere.rho_km(r), horizon = sphere.horizon_km();
  const double shortest = sphere.top_radius_km - r;
  const double x = std::clamp(texel / last(n), 0.0, 1.0);
  const double d = shortest + x * (rho + horizon - shortest);
  if (d <= shortest) return 1.0;
  return std::clamp(((horizon - rho) * (horizon + rho) - d * d) / (2.0 * r * d), -1.0, 1.0);
}

}  // namespace twilight
