// Single-precision kernels against the same sums in double precision on the same random inputs:
// every difference stays below a bound that follows from counting roundings. u = 2^-24.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <vector>

#include "random_scene.h"
#include "sim/aerosol_pass.h"
#include "sim/angular_moments.h"
#include "sim/cell_grid.h"
#include "sim/emission_kernel.h"
#include "sim/gather_kernel.h"
#include "sim/orders_kernel.h"
#include "sim/ring_pair_kernel.h"
#include "sim/ring_pass.h"
#include "sim/zenith_grid.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kUnit = 0x1p-24;

// Differences in units of u times the condition of the sum (the sum of its terms' sizes), each
// with the bound it must keep.
class Worst {
 public:
  explicit Worst(const char* kernel) : kernel_(kernel) {}
  ~Worst() {
    std::printf("%-34s worst %8.2f u, there %8.1f u allowed; nearest to its bound: %.2f of it\n",
                kernel_, worst_, allowed_, nearest_);
    EXPECT_GT(values_, 1000U) << kernel_;
  }
  void add(double got, double want, double size, double bound_u) {
    ++values_;
    const double error = std::abs(got - want);
    // Products of numbers this small leave the normal range.
    if (error <= 1e-35) return;
    const double in_u = error / (kUnit * size);
    if (in_u > worst_) {
      worst_ = in_u;
      allowed_ = bound_u;
    }
    nearest_ = std::max(nearest_, in_u / bound_u);
    if (!(in_u <= bound_u)) {
      if (++failures_ <= 3) {
        ADD_FAILURE() << kernel_ << ": " << got << " for " << want << ", " << in_u << " u of "
                      << size << ", allowed " << bound_u;
      }
    }
  }

 private:
  const char* kernel_;
  double worst_ = 0, allowed_ = 0, nearest_ = 0;
  int failures_ = 0;
  std::size_t values_ = 0;
};

std::vector<float> floats(std::size_t n, double low, double high) {
  std::vector<float> v(n);
  for (float& x : v) x = static_cast<float>(between(low, high));
  return v;
}

template <class T>
std::vector<double> doubles(const std::vector<T>& v) {
  return {v.begin(), v.end()};
}

std::size_t any_lanes() { return one_in(2) ? 8 : one_in(2) ? 16 : 32; }

void for_all(int cases, const char* what, const std::function<void()>& property) {
  const std::string parameters = "noshrink=1 seed=20031208 max_success=" + std::to_string(cases);
  setenv("RC_PARAMS", parameters.c_str(), 1);
  EXPECT_TRUE(rc::check(what, property));
}

// A random pair of rings in random air.
struct Pair {
  Medium medium;
  ExchangeMedium transport;
  RingPoint source, target;
  int divisions;
  double extinction = 0;  // the largest
  std::size_t lanes;

  Pair() : divisions(2 * between(2, 40)), lanes(any_lanes()) {
    Medium& m = medium;
    m.earth_radius_km = 1000 * std::pow(70.0, between(0.0, 1.0));
    const int layers = between(1, 40);
    const double top = between(5.0, 120.0);
    for (int i = 0; i <= layers; ++i) m.boundary_km.push_back(top * i / layers);
    m.wavelength_nm.assign(lanes, 500);
    m.zero_tables();
    const double most = std::pow(10.0, between(-5.0, 0.0));
    LayerTable extinction_per_km(m.layers(), lanes);
    for (std::size_t i = 0; i < m.layers(); ++i) {
      for (std::size_t w = 0; w < lanes; ++w) {
        extinction_per_km(i, w) =
            static_cast<float>(most * std::exp(-m.boundary_km[i] / 8) * between(0.0, 1.0));
        extinction = std::max(extinction, extinction_per_km(i, w));
      }
    }
    transport = make_exchange_medium(m, lanes, extinction_per_km);
    source = point();
    target = point();
  }

  RingPoint point() const {
    RingPoint p;
    const double R = medium.earth_radius_km;
    p.altitude_km = medium.top_km() * between(0.0, 1.0);
    p.rho_km = std::min(0.5 * R, std::pow(10.0, between(-1.0, 3.0)));
    const double r = R + p.altitude_km, up = std::sqrt(r * r - p.rho_km * p.rho_km);
    p.z_km = (p.altitude_km * (2 * R + p.altitude_km) - p.rho_km * p.rho_km) / (up + R);
    p.layer = layer_at(medium, p.altitude_km);
    p.blur_km2 = between(0.0, 1.0);
    return p;
  }

  void kernel(RingPairKernel& out, const AzimuthModes& modes) const {
    out.resize(divisions, lanes, static_cast<int>(medium.layers()));
    ring_pair_kernel(transport, source, target, modes, {1, modes.modes}, false, true, out);
  }
};

// Transmittance exp(-tau), tau a sum of up to 2 N + 4 products of path lengths (each right to a few
// u of the longest) and extinctions, geometry a float: tau is off by (2 N + 12) u of the greatest
// extinction times the distance. Where the ray turns within a shell a length is a root of a
// difference, off by the root of u: its share is the extinction's step there.
TEST(FloatKernel, RingPairKernel) {
  Worst worst("ring_pair_kernel");
  for_all(400, "ring_pair_kernel", [&] {
    const Pair p;
    RingPairKernel kernel;
    const AzimuthModes modes(p.divisions, p.divisions / 2 + 1);
    p.kernel(kernel, modes);
    const auto twin = ring_pair_kernel_scalar(p.transport, p.source, p.target, p.divisions, false);
    const double brightest = *std::max_element(twin.begin(), twin.end());
    for (std::size_t k = 0; k < static_cast<std::size_t>(kernel.samples); ++k) {
      const double angle = 2 * pi * static_cast<double>(k) / p.divisions;
      const double distance =
          std::sqrt(std::pow(p.source.rho_km - p.target.rho_km, 2) +
                    4 * p.source.rho_km * p.target.rho_km * std::pow(std::sin(angle / 2), 2) +
                    std::pow(p.source.z_km - p.target.z_km, 2));
      const double tau = p.extinction * distance;
      const double bound = 16 + (2.0 * p.transport.layers + 12) * tau + 2 * tau / std::sqrt(kUnit);
      for (std::size_t w = 0; w < p.lanes; ++w) {
        // A sample of less than e^-30 may count as dark.
        const double want = twin[k * p.lanes + w];
        if (!kernel.dark && want > 1e-12 * brightest) {
          worst.add(kernel.value[k * p.lanes + w], want, want, bound);
        }
      }
    }
  });
}

// Per sample six products, the kernel, a rotation and the receiving weight; then a sum of samples.
TEST(FloatKernel, MomentPass) {
  Worst worst("moment_pass");
  for_all(150, "moment_pass", [&] {
    const Pair p;
    RingPairKernel kernel;
    const AzimuthModes modes(p.divisions, std::min(24, p.divisions / 2 + 1));
    p.kernel(kernel, modes);
    if (kernel.dark) return;
    const auto M = static_cast<std::size_t>(modes.modes),
               n = static_cast<std::size_t>(kernel.samples);
    const auto source = floats(M * kMoments * p.lanes, -1, 1);
    std::vector<float> field(source.size(), 0.0F);
    moment_pass(kernel, modes, source.data(), field.data());
    for (std::size_t m = 0; m < M; ++m) {
      for (std::size_t w = 0; w < p.lanes; ++w) {
        double want[kMoments] = {}, size[kMoments] = {};
        for (std::size_t k = 0; k < n; ++k) {
          double sum[2] = {}, sizes[2] = {};
          for (std::size_t c = 0; c < kMoments; ++c) {
            const double term = static_cast<double>(kernel.emit[k * kMoments + c]) *
                                source[(m * kMoments + c) * p.lanes + w];
            sum[c < kEvenMoments ? 0 : 1] += term;
            sizes[c < kEvenMoments ? 0 : 1] += std::abs(term);
          }
          const double value = kernel.value[k * p.lanes + w];
          const double c = modes.cosine[m * static_cast<std::size_t>(modes.samples) + k];
          const double s = modes.sine[m * static_cast<std::size_t>(modes.samples) + k];
          const double turned[2] = {value * (c * sum[0] - s * sum[1]),
                                    value * (s * sum[0] + c * sum[1])};
          const double turned_size[2] = {value * (std::abs(c) * sizes[0] + std::abs(s) * sizes[1]),
                                         value * (std::abs(s) * sizes[0] + std::abs(c) * sizes[1])};
          for (std::size_t i = 0; i < kMoments; ++i) {
            const double b = kernel.receive[k * kMoments + i];
            want[i] += b * turned[i < kEvenMoments ? 0 : 1];
            size[i] += std::abs(b) * turned_size[i < kEvenMoments ? 0 : 1];
          }
        }
        for (std::size_t i = 0; i < kMoments; ++i) {
          worst.add(field[(m * kMoments + i) * p.lanes + w], want[i], size[i],
                    static_cast<double>(n) + 11);
        }
      }
    }
  });
}

// A weight of two factors, two products and a sum of samples; a product and a sum.
TEST(FloatKernel, CosineTransformAndMultiplyAdd) {
  Worst worst("cosine_transform"), added("multiply_add"), both("multiply_add_both");
  for_all(150, "cosine_transform", [&] {
    const Pair p;
    RingPairKernel kernel;
    const AzimuthModes modes(p.divisions, std::min(24, p.divisions / 2 + 1));
    p.kernel(kernel, modes);
    if (kernel.dark) return;
    const auto M = static_cast<std::size_t>(modes.modes),
               n = static_cast<std::size_t>(kernel.samples);
    std::vector<float> out(M * p.lanes);
    cosine_transform(kernel, modes, out.data());
    for (std::size_t m = 0; m < M; ++m) {
      for (std::size_t w = 0; w < p.lanes; ++w) {
        double want = 0, size = 0;
        for (std::size_t k = 0; k < n; ++k) {
          const double term = static_cast<double>(kernel.value[k * p.lanes + w]) *
                              kernel.receive[k * kMoments] *
                              static_cast<double>(kernel.emit[k * kMoments]) *
                              modes.cosine[m * static_cast<std::size_t>(modes.samples) + k];
          want += term;
          size += std::abs(term);
        }
        worst.add(out[m * p.lanes + w], want, size, static_cast<double>(n) + 3);
      }
    }
    const auto b = floats(out.size(), -1, 1), start = floats(out.size(), -1, 1);
    auto field = start;
    const auto scale = static_cast<float>(between(0.0, 4.0));
    multiply_add(out.data(), b.data(), scale, out.size(), field.data());
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double term = static_cast<double>(out[i]) * b[i] * scale;
      added.add(field[i], start[i] + term, std::abs(static_cast<double>(start[i])) + std::abs(term),
                2);
    }
    const auto a = floats(out.size(), -1, 1), other_start = floats(out.size(), -1, 1);
    const auto other_scale = static_cast<float>(between(0.0, 4.0));
    auto field_a = start, field_b = other_start;
    multiply_add_both(out.data(), a.data(), other_scale, b.data(), scale, out.size(),
                      field_a.data(), field_b.data());
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double k = out[i], to_a = k * b[i] * scale, to_b = k * a[i] * other_scale;
      const double start_a = start[i], start_b = other_start[i];
      both.add(field_a[i], start_a + to_a, std::abs(start_a) + std::abs(to_a), 2);
      both.add(field_b[i], start_b + to_b, std::abs(start_b) + std::abs(to_b), 2);
    }
  });
}

// Every term is positive: its own relative error counts. The base of Henyey-Greenstein, (1 - g)^2 +
// 2 |g| (1 -+ cos), between (1 - a)^2 and (1 + a)^2 for a = |g|: the terms of the cosine add up to
// no more than 1 in size and have 4 u each (factor, product, table), 1 + up has u, times 2 a; the
// first two of three sums round at up to (1 + a)^2, the last and (1 - g)^2 (3 u) at their own size.
// Half as much again goes into the power -3/2. 1/sqrt is a guess right to 1.5 x 2^-12 and one
// Newton step: 3.4 u and 2.5 u of rounding, three times; nine more products; the sum over S
// sources, which the twin too rounds once per term.
TEST(FloatKernel, FirstEventPass) {
  Worst worst("first_event_pass");
  for_all(100, "first_event_pass", [&] {
    Pair p;
    RingPairKernel kernel;
    const AzimuthModes modes(p.divisions, p.divisions / 2 + 1);
    p.kernel(kernel, modes);
    if (kernel.dark) return;
    const std::size_t nodes = static_cast<std::size_t>(p.divisions / 2 + 1);
    const auto power = floats(nodes * p.lanes, 0, 1), g = floats(p.lanes, -0.95, 0.99);
    std::vector<unsigned char> lit(nodes);
    for (auto& l : lit) l = static_cast<unsigned char>(between(0, 1));
    const double sun = between(-0.3, pi / 2);
    std::vector<float> got(nodes * p.lanes, 0.0F), twin = got;
    first_event_pass(kernel, modes, power.data(), lit.data(), g.data(), sun, got.data());
    first_event_pass_scalar(kernel, p.divisions, power.data(), lit.data(), g.data(), sun,
                            twin.data());
    for (std::size_t i = 0; i < got.size(); ++i) {
      const double signed_g = g[i % p.lanes], a = std::abs(signed_g);
      const double base =
          (10 * a + 2 * std::pow(1 + a, 2) + 3 * std::pow(1 - signed_g, 2)) / std::pow(1 - a, 2) +
          1;
      worst.add(got[i], twin[i], twin[i], 2.0 * p.divisions + 27 + 1.5 * base);
    }
  });
}

// Terms are positive here too. Transmittance: e^-x is off by u x + 2 u a step. (1 - e^-x) / x loses
// 1 / x, at most 1 / 0.002 where the series (off by x^2 / 6) takes over; sunlight's e^-85 loses
// 2 u. The phase function as in FirstEventPass, with exact roots.
TEST(FloatKernel, March) {
  Worst worst("march");
  for_all(300, "march", [&] {
    const std::size_t L = any_lanes(), layers = 10;
    const double most = std::pow(10.0, between(-6.0, 1.0));
    const auto air = floats(layers * L, 0, most), aerosol = floats(layers * L, 0, most),
               asymmetry = floats(layers * L, -0.95, 0.99), x2 = floats(L, 0, 0.1);
    auto extinction = air;
    for (std::size_t i = 0; i < extinction.size(); ++i) extinction[i] += aerosol[i];
    GatherMarch ray;
    ray.lanes = L;
    ray.steps = between(1, 200);
    ray.cosine = static_cast<float>(between(-1.0, 1.0));
    for (int i = 0; i < ray.steps; ++i) {
      ray.length_km.push_back(static_cast<float>(std::pow(10.0, between(-3.0, 0.6))));
      ray.layer.push_back(i * static_cast<int>(layers) / ray.steps);
      ray.lit.push_back(static_cast<unsigned char>(between(0, 1)));
    }
    ray.sun_depth = floats(static_cast<std::size_t>(ray.steps) * L, 0, 84);
    ray.multiple = floats(static_cast<std::size_t>(ray.steps) * L, 0, 1e-3);
    const GatherOptics optics{extinction.data(), air.data(), aerosol.data(), asymmetry.data(),
                              x2.data()};
    std::vector<float> got(L, 0.0F), t(L, 1.0F), twin(L, 0.0F), twin_t(L, 1.0F);
    march(ray, optics, got.data(), t.data());
    march_scalar(ray, optics, twin.data(), twin_t.data());
    for (std::size_t w = 0; w < L; ++w) {
      double depth = 0, g = 0;
      for (int i = 0; i < ray.steps; ++i) {
        const std::size_t at =
            static_cast<std::size_t>(ray.layer[static_cast<std::size_t>(i)]) * L + w;
        depth += std::min(
            80.0, static_cast<double>(extinction[at]) * ray.length_km[static_cast<std::size_t>(i)]);
        g = std::max(g, std::abs(static_cast<double>(asymmetry[at])));
      }
      worst.add(got[w], twin[w], twin[w],
                520 + 6.0 * ray.steps + 4 * std::min(depth, 90.0) +
                    1.5 * (6 * g / std::pow(1 - g, 2) + 4));
    }
  });
}

// Eight corners, a direction's three products, three coefficients.
TEST(FloatKernel, CellEmission) {
  Worst worst("cell_emission");
  for_all(400, "cell_emission", [&] {
    const std::size_t L = any_lanes();
    const int corners = between(1, 8);
    std::vector<std::vector<float>> cells;
    const float* fields[8];
    for (int c = 0; c < corners; ++c) cells.push_back(floats(kMoments * L, -1, 1));
    for (int c = 0; c < corners; ++c) fields[c] = cells[static_cast<std::size_t>(c)].data();
    const auto weights = floats(8, 0, 1), s0 = floats(L, 0, 1), s1 = floats(L, -1, 1),
               s2 = floats(L, -1, 1);
    const double angle = between(0.0, 2 * pi);
    const auto r = static_cast<float>(std::cos(angle)), z = static_cast<float>(std::sin(angle));
    std::vector<float> out(L);
    cell_emission(fields, weights.data(), corners, kMoments, L, s0.data(), s1.data(), s2.data(), r,
                  z, out.data());
    for (std::size_t w = 0; w < L; ++w) {
      double want = 0, size = 0;
      for (std::size_t c = 0; c < static_cast<std::size_t>(corners); ++c) {
        const auto f = [&](std::size_t moment) {
          return static_cast<double>(weights[c]) * cells[c][moment * L + w];
        };
        const double rd = r, zd = z;
        for (const double term :
             {s0[w] * f(kJ), s1[w] * f(kFr) * rd, s1[w] * f(kFz) * zd, s2[w] * f(kSrr) * rd * rd,
              s2[w] * f(kSzz) * zd * zd, s2[w] * f(kSrz) * 2 * rd * zd}) {
          want += term / (4 * pi);
          size += std::abs(term) / (4 * pi);
        }
      }
      worst.add(out[w], std::max(0.0, want), size, corners + 11.0);
    }
  });
}

// Random inputs of the kernels of the orders in float, and the same numbers in double.
struct OrdersInput {
  std::size_t lanes = any_lanes();
  bool polarised = one_in(2);
  int phase_degree = one_in(3) ? 0 : between(1, 24);
  std::size_t stokes() const { return polarised ? 3 : 1; }
};

// Each coefficient of the tensor: its weight, half the sum or difference of two, the sum with a
// third; 1 + cos^2 two more. 5 u of the terms.
TEST(FloatKernel, AirModes) {
  Worst worst("air_modes");
  for_all(200, "air_modes", [&] {
    const OrdersInput o;
    const std::size_t nodes = 5, L = o.lanes;
    const double theta = between(0.0, pi);
    const auto coherency = floats(nodes * 4 * L, -1, 1), air = floats(L, 0, 1);
    const auto dc = doubles(coherency), da = doubles(air);
    const auto fill = [&](auto& in, const auto& tensor, const auto& weight) {
      in.nodes = nodes;
      in.lanes = L;
      in.polarised = o.polarised;
      in.degree = std::max(2, o.phase_degree);
      in.cos_theta = static_cast<float>(std::cos(theta));
      in.sin_theta = static_cast<float>(std::sin(theta));
      in.coherency = tensor.data();
      in.air_weight = weight.data();
    };
    AirEmission<float> in;
    fill(in, coherency, air);
    AirEmission<double> twin_in;
    fill(twin_in, dc, da);
    const std::size_t rows = mode_rows(in.degree);
    std::vector<float> got(nodes * o.stokes() * rows * L, 9.0F);
    std::vector<double> twin = doubles(got);
    air_modes(in, got.data());
    air_modes_scalar(twin_in, twin.data());
    const double c = std::abs(twin_in.cos_theta), s = std::abs(twin_in.sin_theta);
    for (std::size_t j = 0; j < nodes; ++j) {
      for (std::size_t w = 0; w < L; ++w) {
        const auto C = [&](std::size_t k) { return da[w] * std::abs(dc[(j * 4 + k) * L + w]); };
        const double mean = (C(0) + C(1)) / 2, zz = C(2), xz = C(3);
        const double size[3][3] = {{(c * c + 1) * mean + s * s * zz, 2 * s * c * xz, s * s * mean},
                                   {s * s * (zz + mean), 2 * s * c * xz, (c * c + 1) * mean},
                                   {0, 2 * s * xz, 2 * c * mean}};
        for (std::size_t q = 0; q < o.stokes(); ++q) {
          for (std::size_t m = 0; m < rows; ++m) {
            const std::size_t at = ((j * o.stokes() + q) * rows + m) * L + w;
            worst.add(got[at], twin[at], m <= 2 ? size[q][m] : 0, 5);
          }
        }
      }
    }
  });
}

// A sum over l of one product (I) or two (Q, U), the weight, and the sum with what was there.
TEST(FloatKernel, AddAerosolModes) {
  Worst worst("add_aerosol_modes");
  for_all(100, "add_aerosol_modes", [&] {
    const OrdersInput o;
    if (o.phase_degree == 0) return;
    const std::size_t nodes = 4, L = o.lanes, count = moment_count(o.phase_degree),
                      stokes = o.stokes();
    const auto points = static_cast<std::size_t>(between(1, static_cast<int>(kEmissionBatch)));
    const auto scattered = floats(nodes * count * stokes * L, -1, 1);
    const auto ds = doubles(scattered);
    const int degree = std::max(2, o.phase_degree) + between(0, 1);
    const std::size_t rows = mode_rows(degree), size_of_modes = nodes * stokes * rows * L;
    std::vector<std::vector<float>> basis, weight, start;
    for (std::size_t k = 0; k < points; ++k) {
      basis.push_back(floats(3 * count, -1, 1));
      weight.push_back(floats(L, 0, 1));
      start.push_back(floats(size_of_modes, -1, 1));
    }
    auto got = start;
    std::vector<std::vector<double>> db, dw, twin;
    for (std::size_t k = 0; k < points; ++k) {
      db.push_back(doubles(basis[k]));
      dw.push_back(doubles(weight[k]));
      twin.push_back(doubles(start[k]));
    }
    const auto fill = [&](auto& in, const auto& moments, const auto& b, const auto& w,
                          auto& modes) {
      in.nodes = nodes;
      in.lanes = L;
      in.polarised = o.polarised;
      in.degree = degree;
      in.phase_degree = o.phase_degree;
      in.scattered = moments.data();
      in.points = points;
      for (std::size_t k = 0; k < points; ++k) {
        in.basis[k] = b[k].data(), in.weight[k] = w[k].data(), in.modes[k] = modes[k].data();
      }
    };
    AerosolPoints<float> in;
    fill(in, scattered, basis, weight, got);
    AerosolPoints<double> twin_in;
    fill(twin_in, ds, db, dw, twin);
    add_aerosol_modes(in);
    add_aerosol_modes_scalar(twin_in);
    for (std::size_t k = 0; k < points; ++k) {
      for (std::size_t j = 0; j < nodes; ++j) {
        for (std::size_t w = 0; w < L; ++w) {
          for (int m = 0; m < static_cast<int>(rows); ++m) {
            double size[3] = {};
            for (int l = m; l <= o.phase_degree; ++l) {
              const std::size_t i = mode_major_index(o.phase_degree, l, m);
              const auto moment = [&](std::size_t field) {
                return dw[k][w] * std::abs(ds[((j * count + i) * stokes + field) * L + w]);
              };
              const double p = std::abs(db[k][3 * i]), r = std::abs(db[k][3 * i + 1]),
                           t = std::abs(db[k][3 * i + 2]);
              size[0] += p * moment(0);
              if (!o.polarised) continue;
              size[1] += r * moment(1) + t * moment(2);
              size[2] += t * moment(1) + r * moment(2);
            }
            const double terms = std::max(0, o.phase_degree + 1 - m);
            for (std::size_t q = 0; q < stokes; ++q) {
              const std::size_t at =
                  ((j * stokes + q) * rows + static_cast<std::size_t>(m)) * L + w;
              worst.add(got[k][at], twin[k][at], size[q] + std::abs(start[k][at]),
                        (q == 0 ? terms : 2 * terms) + 1);
            }
          }
        }
      }
    }
  });
}

// Tensor: a weight of four products, a sum of two Stokes parameters, three sums per azimuth, one
// per direction. Moments: the cosine of mode m by recurrence has 3.5 u a mode (products and
// sum 2.4, the unit vector that turns it 1), then a sum over azimuths, and one or two products per
// direction.
TEST(FloatKernel, AddMoments) {
  Worst worst("add_moments, coherency"), moments_worst("add_moments, moments");
  for_all(100, "add_moments", [&] {
    const OrdersInput o;
    const std::size_t nodes = 4, L = o.lanes, count = moment_count(o.phase_degree),
                      stokes = o.stokes();
    const std::size_t azimuths = static_cast<std::size_t>(between(2, 32));
    const auto directions = static_cast<std::size_t>(between(1, static_cast<int>(kEmissionBatch)));
    std::vector<float> cosine, sine;
    for (std::size_t q = 0; q < azimuths; ++q) {
      const double phi = between(0.0, pi);
      cosine.push_back(static_cast<float>(std::cos(phi)));
      sine.push_back(static_cast<float>(std::sin(phi)));
    }
    const auto dcos = doubles(cosine), dsin = doubles(sine);
    std::vector<std::vector<float>> light, basis;
    std::vector<std::vector<double>> dlight, dbasis;
    std::vector<float> weight = floats(directions, 0, 1);
    std::vector<double> theta;
    for (std::size_t k = 0; k < directions; ++k) {
      light.push_back(floats(nodes * azimuths * stokes * L, -1, 1));
      basis.push_back(floats(3 * count, -1, 1));
      dlight.push_back(doubles(light[k]));
      dbasis.push_back(doubles(basis[k]));
      theta.push_back(between(0.0, pi));
    }
    std::vector<float> scratch(kEmissionBatch * 3 * static_cast<std::size_t>(o.phase_degree + 1) *
                               L);
    const auto coherency0 = floats(nodes * 4 * L, -1, 1),
               moments0 = floats(nodes * stokes * count * L, -1, 1);
    const auto fill = [&](auto& in, const auto& c, const auto& s, const auto& rays,
                          const auto& functions) {
      in.nodes = nodes;
      in.azimuths = azimuths;
      in.lanes = L;
      in.polarised = o.polarised;
      in.directions = directions;
      in.cos_phi = c.data(), in.sin_phi = s.data();
      in.phase_degree = o.phase_degree;
      for (std::size_t k = 0; k < directions; ++k) {
        in.cos_theta[k] = static_cast<float>(std::cos(theta[k]));
        in.sin_theta[k] = static_cast<float>(std::sin(theta[k]));
        in.weight[k] = weight[k];
        in.light[k] = rays[k].data();
        in.basis[k] = functions[k].data();
      }
    };
    MomentInput<float> in;
    fill(in, cosine, sine, light, basis);
    in.scratch = scratch.data();
    MomentInput<double> twin_in;
    fill(twin_in, dcos, dsin, dlight, dbasis);
    auto coherency = coherency0, moments = moments0;
    auto twin_coherency = doubles(coherency0), twin_moments = doubles(moments0);
    const bool aerosol = o.phase_degree > 0;
    add_moments(in, coherency.data(), aerosol ? moments.data() : nullptr);
    add_moments_scalar(twin_in, twin_coherency.data(), aerosol ? twin_moments.data() : nullptr);
    const auto n = static_cast<double>(azimuths), K = static_cast<double>(directions);
    for (std::size_t j = 0; j < nodes; ++j) {
      for (std::size_t w = 0; w < L; ++w) {
        // Of each direction, the sizes of I, Q, U around the circle.
        double sum[kEmissionBatch][3] = {}, all = 0;
        for (std::size_t k = 0; k < directions; ++k) {
          for (std::size_t q = 0; q < azimuths * stokes; ++q) {
            const double size = static_cast<double>(weight[k]) *
                                std::abs(dlight[k][(j * azimuths * stokes + q) * L + w]);
            sum[k][q % stokes] += size;
            all += size;
          }
        }
        for (std::size_t k = 0; k < 4; ++k) {
          const std::size_t at = (j * 4 + k) * L + w;
          worst.add(coherency[at], twin_coherency[at], all + std::abs(coherency0[at]),
                    3 * n + 5 + K);
        }
        for (int l = 0; aerosol && l <= o.phase_degree; ++l) {
          for (int m = 0; m <= l; ++m) {
            double size[3] = {};
            for (std::size_t k = 0; k < directions; ++k) {
              const std::size_t b = 3 * mode_major_index(o.phase_degree, l, m);
              const double p = std::abs(dbasis[k][b]), r = std::abs(dbasis[k][b + 1]),
                           t = std::abs(dbasis[k][b + 2]);
              size[0] += p * sum[k][0];
              size[1] += r * sum[k][1] + t * sum[k][2];
              size[2] += t * sum[k][1] + r * sum[k][2];
            }
            for (std::size_t q = 0; q < stokes; ++q) {
              const std::size_t at = ((j * stokes + q) * count + moment_index(l, m)) * L + w;
              moments_worst.add(moments[at], twin_moments[at], size[q] + std::abs(moments0[at]),
                                n + 3.5 * m + (q == 0 ? K : 2 * K));
            }
          }
        }
      }
    }
  });
}

// Starts all over the Earth, light that is smooth in the Sun's zenith angle chi: what a wrong chi
// costs is its slope. The cosine of chi is right to 3 u, so chi to 4 u / sin(chi), and near 0 and
// pi, where a cosine says little, to sqrt(8 u); its place on the scale to 5 u pi (an arc cosine of
// two ulp and a product). The azimuth of the ray from the Sun's is right to 4 u / sin(chi).
struct Starts {
  std::size_t pairs = 60, lanes;
  ZenithGrid grid{3.0};
  std::vector<float> cos_chi, sin_chi, cos_phi, sin_phi, reference, fine_position, scratch;
  double psi = std::pow(10.0, between(-4.0, -0.5));
  static constexpr double kReferenceSlope = 0.3, kReference = 1.3;

  explicit Starts(std::size_t lane_count) : lanes(lane_count) {
    const std::size_t padded = padded_pairs(pairs);
    for (auto* v : {&cos_chi, &sin_chi, &cos_phi, &sin_phi}) v->assign(padded, 0.0F);
    for (std::size_t i = 0; i < pairs; ++i) {
      const double chi = i == 0 ? 0 : i == 1 ? pi : between(0.0, pi), phi = between(0.0, pi);
      cos_chi[i] = static_cast<float>(std::cos(chi));
      sin_chi[i] = static_cast<float>(std::sin(chi));
      cos_phi[i] = static_cast<float>(std::cos(phi));
      sin_phi[i] = static_cast<float>(std::sin(phi));
    }
    for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
      const double chi = static_cast<double>(k) * ZenithGrid::kFineStep_deg * pi / 180;
      for (std::size_t w = 0; w < lanes; ++w) {
        reference.push_back(static_cast<float>(1 + 0.3 * std::cos(chi + static_cast<double>(w))));
      }
    }
    scratch.assign(kGatherScratch * padded, 0.0F);
    fine_position.assign(grid.fine_position().begin(), grid.fine_position().end());
  }
  // Error of chi and of the azimuth at the point, rad.
  struct Angles {
    double chi_error, azimuth_error, chi, azimuth;
  };
  Angles angles(std::size_t i) const {
    const double cc = cos_chi[i], sc = sin_chi[i], cf = cos_phi[i], sf = sin_phi[i];
    const double cp = static_cast<float>(std::cos(psi)), sp = static_cast<float>(std::sin(psi));
    const double along = cp * sc * cf - sp * cc, across = sf * sc;
    const double sine = std::hypot(along, across), cosine = cc * cp + sc * sp * cf;
    return {std::min(4 * kUnit / sine, std::sqrt(8 * kUnit)) + 5 * pi * kUnit,
            std::min(4 * kUnit / sine, 2.0), std::atan2(sine, cosine), std::atan2(across, along)};
  }
  void fill(GatherInput<float>& in) {
    fill(in, cos_chi, sin_chi, cos_phi, sin_phi, reference, fine_position);
    in.scratch = scratch.data();
  }
  // The same numbers in double, which keep the memory of what `in` points to.
  std::vector<std::vector<double>> fill(GatherInput<double>& in) const {
    std::vector<std::vector<double>> v;
    for (const auto* f : {&cos_chi, &sin_chi, &cos_phi, &sin_phi, &reference, &fine_position}) {
      v.push_back(doubles(*f));
    }
    fill(in, v[0], v[1], v[2], v[3], v[4], v[5]);
    return v;
  }

 private:
  template <class In, class V>
  void fill(In& in, const V& cc, const V& sc, const V& cf, const V& sf, const V& ref,
            const V& position) const {
    in.pairs = pairs;
    in.cos_chi = cc.data(), in.sin_chi = sc.data(), in.cos_phi = cf.data(), in.sin_phi = sf.data();
    in.cos_psi = static_cast<float>(std::cos(psi));
    in.sin_psi = static_cast<float>(std::sin(psi));
    in.lanes = lanes;
    in.nodes = grid.size();
    in.fine_position = position.data();
    in.fine_per_radian = static_cast<float>(180 / pi / ZenithGrid::kFineStep_deg);
    in.reference = ref.data();
    in.fine_end = ZenithGrid::kFineSize - 1;
  }
};

// The place among N nodes rounds at up to N u, of steps of 4 degrees at most; a tap has 7 u (five
// products and differences), times 1.6, the sum of their sizes at the ends; their sum 4 u more.
TEST(FloatKernel, GatherModes) {
  Worst worst("gather_modes");
  for_all(40, "gather_modes", [&] {
    const OrdersInput o;
    Starts starts(o.lanes);
    const std::size_t L = o.lanes, degree = static_cast<std::size_t>(std::max(2, o.phase_degree));
    const std::size_t rows = mode_rows(static_cast<int>(degree)), row = o.stokes() * rows * L;
    auto amplitude = floats(row, -1, 1);
    const auto phase = floats(row, 0, 6);
    for (std::size_t k = 0; k < row; ++k) {
      if (k / L % rows > degree) amplitude[k] = 0;  // the row that pads
    }
    std::vector<float> modes;
    for (std::size_t j = 0; j < starts.grid.size(); ++j) {
      for (std::size_t k = 0; k < row; ++k) {
        modes.push_back(static_cast<float>(
            amplitude[k] * std::cos(starts.grid.zenith_rad()[j] + static_cast<double>(phase[k]))));
      }
    }
    const auto both = [&](auto& in) {
      in.polarised = o.polarised;
      in.degree = in.stored_degree = static_cast<int>(degree);
    };
    GatherInput<float> in;
    starts.fill(in);
    both(in);
    in.modes = modes.data();
    const auto dm = doubles(modes);
    GatherInput<double> twin_in;
    const auto kept = starts.fill(twin_in);
    both(twin_in);
    twin_in.modes = dm.data();
    std::vector<float> got(starts.pairs * o.stokes() * L, 0.0F);
    std::vector<double> twin = doubles(got);
    gather_modes(in, got.data());
    gather_modes_scalar(twin_in, twin.data());
    const double place_error = static_cast<double>(starts.grid.size()) * kUnit * 4 * pi / 180;
    for (std::size_t i = 0; i < starts.pairs; ++i) {
      const Starts::Angles a = starts.angles(i);
      for (std::size_t q = 0; q < o.stokes(); ++q) {
        for (std::size_t w = 0; w < L; ++w) {
          double size = 0, error = 0;
          for (std::size_t m = 0; m <= degree; ++m) {
            const double A = std::abs(amplitude[(q * rows + m) * L + w]) * Starts::kReference;
            size += A;
            // 1.6: slope of the cubic and of the reference. Of the recurrence's error a step 4 u is
            // the length of the unit vector (a square root, a division, products), 2 u the turn.
            error += A * (1.6 * (a.chi_error + place_error) +
                          std::min(2.0, static_cast<double>(m) * (a.azimuth_error + 6 * kUnit)));
          }
          const std::size_t at = (i * o.stokes() + q) * L + w;
          worst.add(got[at], twin[at], size,
                    error / (kUnit * size) + static_cast<double>(degree) + 22);
        }
      }
    }
  });
}

// The apparent Sun is the true one, whose sine and cosine are right to 5 u (no arc comes between),
// turned by the lift (3 u, and its slope of 0.01 times the error of chi); its azimuth times its
// sine has 8 u. So has the look's scalar product with it, and the components that turn the plane of
// polarisation: 24 u with their own roundings. The table of the phase function rounds its place by
// 4 u more. Light is polarised by no more than sin^2 of the scattering angle, which keeps a plane
// that is lost near 0 and pi from mattering; but the table stops 1e-3 of a step before cosine 1.
TEST(FloatKernel, GatherBeam) {
  Worst worst("gather_beam, I"), linear("gather_beam, Q and U");
  for_all(40, "gather_beam", [&] {
    const OrdersInput o;
    Starts starts(o.lanes);
    const std::size_t L = o.lanes, kinds = o.phase_degree > 0 ? 2 : 0, phase_nodes = 201;
    std::vector<float> lift, phase;
    for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
      const double chi = static_cast<double>(k) * ZenithGrid::kFineStep_deg * pi / 180;
      lift.push_back(static_cast<float>(0.01 * std::sin(chi)));
    }
    const auto amplitude = floats(2 * 2 * L, 0, 1);
    for (std::size_t q = 0; q < 2; ++q) {
      for (std::size_t k = 0; k < phase_nodes; ++k) {
        const double x = 2 * static_cast<double>(k) / static_cast<double>(phase_nodes - 1) - 1;
        for (std::size_t i = 0; i < 2 * L; ++i) {
          phase.push_back(
              static_cast<float>(amplitude[q * 2 * L + i] * (i < L ? std::exp(x) : 1 - x * x)));
        }
      }
    }
    const auto air = floats(L, 0, 1), share = floats(L, 0.9, 1), weight = floats(2 * L, 0, 1);
    const double theta = between(0.0, pi);
    const std::vector<std::size_t> kind{1, 0};
    const auto fill = [&](auto& in, const auto& l, const auto& a, const auto& h, const auto& k,
                          const auto& p) {
      in.gather.polarised = o.polarised;
      in.kinds = kinds;
      in.kind = kind.data();
      in.phase_nodes = phase_nodes;
      in.cos_theta = static_cast<float>(std::cos(theta));
      in.sin_theta = static_cast<float>(std::sin(theta));
      in.lift_rad = l.data(), in.air_weight = a.data();
      in.anisotropic_share = h.data(), in.kind_weight = k.data(), in.phase = p.data();
    };
    BeamInput<float> in;
    starts.fill(in.gather);
    fill(in, lift, air, share, weight, phase);
    const auto dl = doubles(lift), da = doubles(air), dh = doubles(share), dw = doubles(weight),
               dph = doubles(phase);
    BeamInput<double> twin_in;
    const auto kept = starts.fill(twin_in.gather);
    fill(twin_in, dl, da, dh, dw, dph);
    std::vector<float> got(starts.pairs * o.stokes() * L, 0.0F);
    std::vector<double> twin = doubles(got);
    gather_beam(in, got.data());
    gather_beam_scalar(twin_in, twin.data());
    for (std::size_t i = 0; i < starts.pairs; ++i) {
      const Starts::Angles a = starts.angles(i);
      const double direction_error = 24 * kUnit + 0.015 * a.chi_error;
      const double apparent = a.chi - 0.01 * std::sin(a.chi);
      const double sine = std::hypot(std::sin(apparent) * std::sin(a.azimuth),
                                     std::sin(apparent) * std::cos(theta) * std::cos(a.azimuth) -
                                         std::cos(apparent) * std::sin(theta));
      const double plane_error =
          2 * (sine * direction_error + 2e-5 * std::min(1.0, direction_error / sine));
      for (std::size_t w = 0; w < L; ++w) {
        // Size, and slope with the cosine of the scattering angle.
        double size = 1.0 * da[w], slope = 1.0 * da[w];
        for (std::size_t q = 0; q < kinds; ++q) {
          size += dw[q * L + w] *
                  (std::numbers::e * amplitude[q * 2 * L + w] + amplitude[(q * 2 + 1) * L + w]);
          slope += dw[q * L + w] * (std::numbers::e * amplitude[q * 2 * L + w] +
                                    2 * static_cast<double>(amplitude[(q * 2 + 1) * L + w]));
        }
        size *= Starts::kReference;
        slope *= Starts::kReference;
        const double error =
            slope * (direction_error + 4 * kUnit) + 0.3 * size * a.chi_error + 16 * kUnit * size;
        const std::size_t at = i * o.stokes() * L + w;
        worst.add(got[at], twin[at], size, error / (kUnit * size));
        if (!o.polarised) continue;
        const double turn = size * (plane_error + 6 * kUnit);
        for (std::size_t q = 1; q < 3; ++q) {
          linear.add(got[at + q * L], twin[at + q * L], size, (error + turn) / (kUnit * size));
        }
      }
    }
  });
}

// The reference at a chi that is off, between two points of its table, times a weight.
TEST(FloatKernel, GatherGround) {
  Worst worst("gather_ground");
  for_all(40, "gather_ground", [&] {
    const std::size_t L = any_lanes(), stride = L * (one_in(2) ? 3 : 1);
    Starts starts(L);
    GatherInput<float> in;
    starts.fill(in);
    const auto weight = floats(L, -1, 1), start = floats(starts.pairs * stride, -1, 1);
    auto got = start;
    gather_ground(in, weight.data(), stride, got.data());
    for (std::size_t i = 0; i < starts.pairs; ++i) {
      const Starts::Angles a = starts.angles(i);
      const double fine = a.chi * static_cast<double>(in.fine_per_radian);
      const auto cell = static_cast<std::size_t>(fine);
      for (std::size_t w = 0; w < stride; ++w) {
        const double before = start[i * stride + w];
        if (w >= L) {
          EXPECT_EQ(got[i * stride + w], start[i * stride + w]);
          continue;
        }
        const double value = std::lerp(static_cast<double>(starts.reference[cell * L + w]),
                                       static_cast<double>(starts.reference[(cell + 1) * L + w]),
                                       fine - static_cast<double>(cell));
        const double k = weight[w], size = std::abs(before) + std::abs(k) * Starts::kReference;
        worst.add(got[i * stride + w], before + k * value, size,
                  Starts::kReferenceSlope * std::abs(k) * a.chi_error / (kUnit * size) + 3);
      }
    }
  });
}

}  // namespace
}  // namespace twilight
