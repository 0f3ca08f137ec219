#include "sim/angular_moments.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "aerosols/component_phase.h"
#include "aerosols/phase_expansion.h"
#include "sim/gauss_legendre.h"

namespace twilight {
namespace {

using std::numbers::pi;
using Vector = std::array<double, 3>;
using Tensor = std::array<std::array<double, 3>, 3>;

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// A direction that light comes from, with e_theta and e_phi.
struct Frame {
  Vector n, v, h;
  Frame(double theta, double phi)
      : n{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)},
        v{std::cos(theta) * std::cos(phi), std::cos(theta) * std::sin(phi), -std::sin(theta)},
        h{-std::sin(phi), std::cos(phi), 0} {}
};

struct Stokes {
  double i, q, u;
};

// Polarisation tensor of light whose Q and U refer to the axes a and b.
Tensor tensor(const Stokes& s, const Vector& a, const Vector& b) {
  Tensor t{};
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t k = 0; k < 3; ++k) {
      t[j][k] = 0.5 * ((s.i + s.q) * a[j] * a[k] + (s.i - s.q) * b[j] * b[k] +
                       s.u * (a[j] * b[k] + b[j] * a[k]));
    }
  }
  return t;
}

double between(const Vector& a, const Tensor& t, const Vector& b) {
  double sum = 0;
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t k = 0; k < 3; ++k) sum += a[j] * t[j][k] * b[k];
  }
  return sum;
}

Stokes in_axes(const Tensor& t, const Vector& a, const Vector& b) {
  return {between(a, t, a) + between(b, t, b), between(a, t, a) - between(b, t, b),
          2 * between(a, t, b)};
}

// Light from one direction; its mirror image (-phi, -u) always comes with it.
struct Beam {
  double theta, phi;
  Stokes light;
};

std::vector<Beam> random_beams(int count) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Beam> beams;
  for (int k = 0; k < count; ++k) {
    const double i = 0.2 + unit(random), p = i * unit(random), angle = 2 * pi * unit(random);
    beams.push_back({std::acos(2 * unit(random) - 1),
                     pi * unit(random),
                     {i, p * std::cos(angle), p * std::sin(angle)}});
  }
  return beams;
}

struct Moments {
  std::vector<double> i, e, b;
};

Moments moments_of(const std::vector<Beam>& beams, int degree) {
  const std::size_t count = moment_count(degree);
  Moments m{std::vector<double>(count), std::vector<double>(count), std::vector<double>(count)};
  for (const Beam& beam : beams) {
    const AngularBasis f = angular_basis(degree, beam.theta);
    for (int l = 0; l <= degree; ++l) {
      for (int k = 0; k <= l; ++k) {
        const std::size_t at = moment_index(l, k);
        const double c = std::cos(k * beam.phi), s = std::sin(k * beam.phi);
        m.i[at] += 2 * beam.light.i * f.p[at] * c;
        m.e[at] += 2 * (beam.light.q * f.r[at] * c + beam.light.u * f.t[at] * s);
        m.b[at] += 2 * (beam.light.q * f.t[at] * c + beam.light.u * f.r[at] * s);
      }
    }
  }
  return m;
}

struct Coefficients {
  std::vector<double> a1, b1, a2, a3;
};

Stokes scatter(const Moments& m, const Coefficients& x, double theta, double phi) {
  const int degree = static_cast<int>(x.a1.size()) - 1;
  const AngularBasis f = angular_basis(degree, theta);
  Stokes out{0, 0, 0};
  for (int l = 0; l <= degree; ++l) {
    const auto row = static_cast<std::size_t>(l);
    for (int k = 0; k <= l; ++k) {
      const std::size_t at = moment_index(l, k);
      const double factor = (k > 0 ? 2 : 1) / (4 * pi);
      const double i = x.a1[row] * m.i[at] + x.b1[row] * m.e[at];
      const double e = x.b1[row] * m.i[at] + x.a2[row] * m.e[at];
      const double b = x.a3[row] * m.b[at];
      out.i += factor * f.p[at] * i * std::cos(k * phi);
      out.q += factor * (f.r[at] * e + f.t[at] * b) * std::cos(k * phi);
      out.u += factor * (f.t[at] * e + f.r[at] * b) * std::sin(k * phi);
    }
  }
  return out;
}

// Edmonds (1957), App. 2; d^1_10 = -sin / sqrt 2 in the phase of Hovenier et al. (2004).
TEST(AngularBasis, ClosedForms) {
  for (const double theta : {0.0, 0.3, 1.2, pi / 2, 2.5, pi}) {
    const double c = std::cos(theta), s = std::sin(theta);
    const AngularBasis f = angular_basis(4, theta);
    EXPECT_NEAR(f.p[moment_index(0, 0)], 1, 1e-14);
    EXPECT_NEAR(f.p[moment_index(1, 0)], c, 1e-14);
    EXPECT_NEAR(f.p[moment_index(2, 0)], 1.5 * c * c - 0.5, 1e-14);
    EXPECT_NEAR(f.p[moment_index(3, 0)], 2.5 * c * c * c - 1.5 * c, 1e-14);
    EXPECT_NEAR(f.p[moment_index(4, 0)], (35 * std::pow(c, 4) - 30 * c * c + 3) / 8, 1e-14);
    EXPECT_NEAR(f.p[moment_index(1, 1)], -s / std::sqrt(2.0), 1e-14);
    EXPECT_NEAR(f.p[moment_index(2, 1)], -std::sqrt(1.5) * s * c, 1e-14);
    EXPECT_NEAR(f.p[moment_index(2, 2)], std::sqrt(6.0) / 4 * s * s, 1e-14);
    EXPECT_NEAR(f.r[moment_index(2, 0)], std::sqrt(6.0) / 4 * s * s, 1e-14);
    EXPECT_NEAR(f.t[moment_index(2, 0)], 0, 1e-14);
    EXPECT_NEAR(f.r[moment_index(2, 2)], (1 + c * c) / 4, 1e-14);
    EXPECT_NEAR(f.t[moment_index(2, 2)], -c / 2, 1e-14);
    for (const std::size_t below : {moment_index(0, 0), moment_index(1, 0), moment_index(1, 1)}) {
      EXPECT_EQ(f.r[below], 0);
      EXPECT_EQ(f.t[below], 0);
    }
  }
}

// d^l_20 = d^l_02, d^l_22 and d^l_2,-2 by the recurrences of aerosols/phase_expansion.h.
TEST(AngularBasis, AgreesWithTheSphericalFunctionsOfOneScattering) {
  constexpr int kDegree = 64;
  for (const double theta : {0.01, 0.9, 1.9, 3.1}) {
    const AngularBasis f = angular_basis(kDegree, theta);
    const SphericalFunctions s = spherical_functions(std::cos(theta), kDegree);
    for (int l = 2; l <= kDegree; ++l) {
      const std::size_t at = moment_index(l, 2);
      const auto row = static_cast<std::size_t>(l);
      EXPECT_NEAR(f.p[at], -s.p02[row], 1e-12) << l;
      EXPECT_NEAR(f.r[at] - f.t[at], s.p22[row], 1e-12) << l;
      EXPECT_NEAR(f.r[at] + f.t[at], s.p2m2[row], 1e-12) << l;
    }
  }
}

TEST(AngularBasis, AdditionTheorem) {
  constexpr int kDegree = 64;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const double one = pi * unit(random), two = pi * unit(random), phi = 2 * pi * unit(random);
    const AngularBasis a = angular_basis(kDegree, one), b = angular_basis(kDegree, two);
    const double x = std::cos(one) * std::cos(two) + std::sin(one) * std::sin(two) * std::cos(phi);
    for (int l = 0; l <= kDegree; ++l) {
      double sum = 0;
      for (int m = 0; m <= l; ++m) {
        const std::size_t at = moment_index(l, m);
        sum += (m > 0 ? 2 : 1) * a.p[at] * b.p[at] * std::cos(m * phi);
      }
      EXPECT_NEAR(sum, std::legendre(static_cast<unsigned>(l), x), 1e-11) << l;
    }
  }
}

// Over the cosine of theta: p with p, and (r, t) with (r, t), 2 / (2 l + 1); r with t, 0.
TEST(AngularBasis, Orthogonality) {
  constexpr int kDegree = 12;
  const std::size_t count = moment_count(kDegree);
  std::vector<double> pp(count * count), ee(count * count), eb(count * count);
  for (const GaussNode& g : gauss_legendre(kDegree + 2, -1, 1)) {
    const AngularBasis f = angular_basis(kDegree, std::acos(g.x));
    for (std::size_t j = 0; j < count; ++j) {
      for (std::size_t k = 0; k < count; ++k) {
        pp[j * count + k] += g.weight * f.p[j] * f.p[k];
        ee[j * count + k] += g.weight * (f.r[j] * f.r[k] + f.t[j] * f.t[k]);
        eb[j * count + k] += g.weight * (f.r[j] * f.t[k] + f.t[j] * f.r[k]);
      }
    }
  }
  for (int m = 0; m <= kDegree; ++m) {
    for (int l = m; l <= kDegree; ++l) {
      for (int k = m; k <= kDegree; ++k) {
        const std::size_t at = moment_index(l, m) * count + moment_index(k, m);
        const double one = l == k ? 2.0 / (2 * l + 1) : 0;
        EXPECT_NEAR(pp[at], one, 1e-13);
        EXPECT_NEAR(ee[at], l < 2 ? 0 : one, 1e-13);
        EXPECT_NEAR(eb[at], 0, 1e-13);
      }
    }
  }
}

// Air without depolarisation: 3 / (8 pi) P C P, P the projection across the direction.
TEST(AngularMoments, RayleighScatteringIsTheCoherencyTensors) {
  const std::vector<Beam> beams = random_beams(6);
  Tensor c{};
  for (const Beam& beam : beams) {
    for (const double side : {1.0, -1.0}) {
      const Frame f(beam.theta, side * beam.phi);
      const Tensor t = tensor({beam.light.i, beam.light.q, side * beam.light.u}, f.v, f.h);
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t k = 0; k < 3; ++k) c[j][k] += t[j][k];
      }
    }
  }
  const Moments m = moments_of(beams, 2);
  const Coefficients air{{1, 0, 0.5}, {0, 0, -std::sqrt(6.0) / 2}, {0, 0, 3}, {0, 0, 0}};
  for (const Beam& view : random_beams(20)) {
    const Frame f(view.theta, view.phi);
    const Stokes want = in_axes(c, f.v, f.h), got = scatter(m, air, view.theta, view.phi);
    EXPECT_NEAR(got.i, 3 / (8 * pi) * want.i, 1e-13);
    EXPECT_NEAR(got.q, 3 / (8 * pi) * want.q, 1e-13);
    EXPECT_NEAR(got.u, 3 / (8 * pi) * want.u, 1e-13);
  }
}

// One scattering with the Stokes frames turned into the scattering plane and out of it, by vectors.
template <class Matrix>
Stokes scatter_directly(const std::vector<Beam>& beams, const Matrix& matrix, double theta,
                        double phi) {
  const Frame view(theta, phi);
  Tensor sum{};
  for (const Beam& beam : beams) {
    for (const double side : {1.0, -1.0}) {
      const Frame from(beam.theta, side * beam.phi);
      Vector normal = cross(from.n, view.n);
      const double size = std::sqrt(dot(normal, normal));
      for (double& x : normal) x /= size;
      // Light travels along -n; parallel axis, normal and travel are right-handed.
      const auto parallel = [&](const Vector& n) { return cross(n, normal); };
      const Tensor in = tensor({beam.light.i, beam.light.q, side * beam.light.u}, from.v, from.h);
      const Stokes s = in_axes(in, parallel(from.n), normal);
      const MatrixElements p = matrix(dot(from.n, view.n));
      const Stokes out{p.a1 * s.i + p.b1 * s.q, p.b1 * s.i + p.a2 * s.q, p.a3 * s.u};
      const Tensor t = tensor(out, parallel(view.n), normal);
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t k = 0; k < 3; ++k) sum[j][k] += t[j][k] / (4 * pi);
      }
    }
  }
  return in_axes(sum, view.v, view.h);
}

PhaseMatrix sulfate() {
  for (const ComponentState& state : component_states()) {
    if (state.component == AerosolComponent::kSulfate) {
      return integrate_component_phase(state, 550, phase_radii_per_efold(state.component));
    }
  }
  throw std::logic_error("no sulfate");
}

Coefficients coefficients(const PhaseExpansion& e) {
  Coefficients x{e.alpha1, e.beta1, e.alpha2, e.alpha3};
  for (double& b : x.b1) b = -b;
  return x;
}

// A Mie matrix cut at degree 30 is a matrix too, and scatters exactly; V is not followed.
TEST(AngularMoments, ScatteringBySpheresTurnsTheFramesAlike) {
  const PhaseExpansion mie = expand(sulfate(), 30);
  const std::vector<Beam> beams = random_beams(5);
  const Moments m = moments_of(beams, 30);
  double largest = 0;
  for (const Beam& view : random_beams(25)) {
    const Stokes want = scatter_directly(
        beams, [&](double x) { return evaluate(mie, x); }, view.theta, view.phi + 0.01);
    const Stokes got = scatter(m, coefficients(mie), view.theta, view.phi + 0.01);
    EXPECT_NEAR(got.i, want.i, 1e-10);
    EXPECT_NEAR(got.q, want.q, 1e-10);
    EXPECT_NEAR(got.u, want.u, 1e-10);
    largest = std::max(largest, std::abs(want.u));
  }
  EXPECT_GT(largest, 0.01);  // there was something to turn
}

// The uncut matrix of stratospheric sulfate, as tabulated; degree 64 leaves 1e-3 of the mean.
TEST(AngularMoments, SulfateToDegree64IsItsTable) {
  const PhaseMatrix table = sulfate();
  const auto matrix = [&](double x) {
    const double angle = std::acos(std::clamp(x, -1.0, 1.0));
    std::size_t i = 1;
    while (i + 1 < table.angle_rad.size() && table.angle_rad[i] < angle) ++i;
    const double f =
        (angle - table.angle_rad[i - 1]) / (table.angle_rad[i] - table.angle_rad[i - 1]);
    const auto at = [&](const std::vector<double>& v) { return std::lerp(v[i - 1], v[i], f); };
    return MatrixElements{at(table.p11), at(table.p11), at(table.p33),
                          at(table.p33), at(table.p12), at(table.p34)};
  };
  const std::vector<Beam> beams = random_beams(4);
  const Moments m = moments_of(beams, 64);
  const Coefficients mie = coefficients(expand(table, 64));
  for (const Beam& view : random_beams(25)) {
    const double phi = view.phi + 0.05;
    const Stokes want = scatter_directly(beams, matrix, view.theta, phi);
    const Stokes got = scatter(m, mie, view.theta, phi);
    const double mean = 2 * 4 * 0.7 / (4 * pi);
    EXPECT_NEAR(got.i, want.i, 1e-3 * mean);
    EXPECT_NEAR(got.q, want.q, 1e-3 * mean);
    EXPECT_NEAR(got.u, want.u, 1e-3 * mean);
  }
}

}  // namespace
}  // namespace twilight
