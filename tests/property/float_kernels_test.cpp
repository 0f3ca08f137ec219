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
#include "sim/angular_moments.h"
#include "sim/cell_grid.h"
#include "sim/exchange_kernel.h"
#include "sim/gather_kernel.h"
#include "sim/orders_kernel.h"
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
  Worst worst("cosine_transform"), added("multiply_add");
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
  });
}

// Every term is positive: its own relative error counts. The cosine is off by 6 u, the base of
// Henyey-Greenstein (1 - g)^2 + 2 g (1 - cos) by 12 g u of at least (1 - g)^2 (or that of -g), and
// half as much again goes into its power -3/2; 1/sqrt is a guess of 12 bits and one Newton step:
// 3/2 2^-24, three times. The twin rounds once per term itself.
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
    first_event_pass(kernel, p.divisions, power.data(), lit.data(), g.data(), sun, got.data());
    first_event_pass_scalar(kernel, p.divisions, power.data(), lit.data(), g.data(), sun,
                            twin.data());
    for (std::size_t i = 0; i < got.size(); ++i) {
      const double a = std::abs(g[i % p.lanes]);
      worst.add(got[i], twin[i], twin[i],
                2.0 * p.divisions + 16 + 1.5 * (12 * a / std::pow(1 - a, 2) + 4));
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

// Air: four products in a row and two sums; a moment: three products, two sums over fields, then a
// sum over l.
TEST(FloatKernel, SourceModes) {
  Worst worst("source_modes");
  for_all(100, "source_modes", [&] {
    const OrdersInput o;
    const std::size_t nodes = 5, count = moment_count(o.phase_degree), L = o.lanes;
    const auto rows = static_cast<std::size_t>(o.phase_degree) + 1;
    const double theta = between(0.0, pi);
    const auto coherency = floats(nodes * 4 * L, -1, 1), air = floats(L, 0, 1),
               moments = floats(nodes * o.stokes() * count * L, -1, 1), p = floats(count, -1, 1),
               r = floats(count, -1, 1), t = floats(count, -1, 1), a1 = floats(rows * L, -1, 1),
               b1 = floats(rows * L, -1, 1), a2 = floats(rows * L, -1, 1),
               a3 = floats(rows * L, -1, 1);
    const auto fill = [&](auto& in, const auto&... v) {
      in.nodes = nodes;
      in.lanes = L;
      in.polarised = o.polarised;
      in.cos_theta = static_cast<float>(std::cos(theta));
      in.sin_theta = static_cast<float>(std::sin(theta));
      in.degree = std::max(2, o.phase_degree);
      in.phase_degree = in.stored_phase_degree = o.phase_degree;
      const decltype(in.p) all[] = {v.data()...};
      in.coherency = all[0];
      in.air_weight = all[1];
      if (o.phase_degree == 0) return;
      in.moments = all[2];
      in.p = all[3], in.r = all[4], in.t = all[5];
      in.a1 = all[6], in.b1 = all[7], in.a2 = all[8], in.a3 = all[9];
    };
    SourceModesInput<float> in;
    fill(in, coherency, air, moments, p, r, t, a1, b1, a2, a3);
    const auto dc = doubles(coherency), da = doubles(air), dm = doubles(moments), dp = doubles(p),
               dr = doubles(r), dt = doubles(t), d1 = doubles(a1), d2 = doubles(b1),
               d3 = doubles(a2), d4 = doubles(a3);
    SourceModesInput<double> twin_in;
    fill(twin_in, dc, da, dm, dp, dr, dt, d1, d2, d3, d4);
    const auto degree = static_cast<std::size_t>(in.degree);
    std::vector<float> got(nodes * o.stokes() * (degree + 1) * L);
    std::vector<double> twin = doubles(got);
    source_modes(in, got.data());
    source_modes_scalar(twin_in, twin.data());
    for (std::size_t j = 0; j < nodes; ++j) {
      for (std::size_t m = 0; m <= degree; ++m) {
        for (std::size_t w = 0; w < L; ++w) {
          double size[3] = {};
          for (std::size_t k = 0; k < 4 && m <= 2; ++k) {
            for (double& s : size) s += 2 * da[w] * std::abs(dc[(j * 4 + k) * L + w]);
          }
          for (std::size_t l = m; o.phase_degree > 0 && l < rows; ++l) {
            const std::size_t i = moment_index(static_cast<int>(l), static_cast<int>(m));
            const std::size_t at = l * L + w;
            const auto moment = [&](std::size_t field) {
              return o.polarised || field == 0
                         ? std::abs(dm[((j * o.stokes() + field) * count + i) * L + w])
                         : 0.0;
            };
            const double I = moment(0), E = moment(1), B = moment(2);
            const double Es = std::abs(d2[at]) * I + std::abs(d3[at]) * E,
                         Bs = std::abs(d4[at]) * B;
            size[0] += std::abs(dp[i]) * (std::abs(d1[at]) * I + std::abs(d2[at]) * E);
            size[1] += std::abs(dr[i]) * Es + std::abs(dt[i]) * Bs;
            size[2] += std::abs(dt[i]) * Es + std::abs(dr[i]) * Bs;
          }
          for (std::size_t q = 0; q < o.stokes(); ++q) {
            if (q == 2 && m == 0) continue;  // unused
            const std::size_t at = ((j * o.stokes() + q) * (degree + 1) + m) * L + w;
            worst.add(got[at], twin[at], size[q], 2.0 * static_cast<double>(rows) + 8);
          }
        }
      }
    }
  });
}

// Per azimuth up to six factors (cosines by recurrence: 3 u more a degree); a sum over azimuths, a
// basis function, a sum.
TEST(FloatKernel, AddMoments) {
  Worst worst("add_moments, coherency"), moments_worst("add_moments, moments");
  for_all(100, "add_moments", [&] {
    const OrdersInput o;
    const std::size_t nodes = 4, L = o.lanes, count = moment_count(o.phase_degree);
    const std::size_t azimuths = static_cast<std::size_t>(between(2, 32));
    std::vector<float> cosine, sine;
    for (std::size_t q = 0; q < azimuths; ++q) {
      const double phi = between(0.0, pi);
      cosine.push_back(static_cast<float>(std::cos(phi)));
      sine.push_back(static_cast<float>(std::sin(phi)));
    }
    const auto light = floats(nodes * azimuths * o.stokes() * L, -1, 1), p = floats(count, -1, 1),
               r = floats(count, -1, 1), t = floats(count, -1, 1);
    std::vector<float> scratch(3 * static_cast<std::size_t>(o.phase_degree + 1) * L);
    const auto coherency0 = floats(nodes * 4 * L, -1, 1),
               moments0 = floats(nodes * o.stokes() * count * L, -1, 1);
    const double theta = between(0.0, pi);
    const auto fill = [&](auto& in) {
      in.nodes = nodes;
      in.azimuths = azimuths;
      in.lanes = L;
      in.polarised = o.polarised;
      in.cos_theta = static_cast<float>(std::cos(theta));
      in.sin_theta = static_cast<float>(std::sin(theta));
      in.weight = 0.37F;
      in.phase_degree = o.phase_degree;
    };
    MomentInput<float> in;
    fill(in);
    in.cos_phi = cosine.data(), in.sin_phi = sine.data(), in.light = light.data();
    in.p = p.data(), in.r = r.data(), in.t = t.data(), in.scratch = scratch.data();
    const auto dcos = doubles(cosine), dsin = doubles(sine), dlight = doubles(light),
               dp = doubles(p), dr = doubles(r), dt = doubles(t);
    MomentInput<double> twin_in;
    fill(twin_in);
    twin_in.cos_phi = dcos.data(), twin_in.sin_phi = dsin.data(), twin_in.light = dlight.data();
    twin_in.p = dp.data(), twin_in.r = dr.data(), twin_in.t = dt.data();
    auto coherency = coherency0, moments = moments0;
    auto twin_coherency = doubles(coherency0), twin_moments = doubles(moments0);
    const bool aerosol = o.phase_degree > 0;
    add_moments(in, coherency.data(), aerosol ? moments.data() : nullptr);
    add_moments_scalar(twin_in, twin_coherency.data(), aerosol ? twin_moments.data() : nullptr);
    for (std::size_t j = 0; j < nodes; ++j) {
      for (std::size_t w = 0; w < L; ++w) {
        double sum = 0;
        for (std::size_t q = 0; q < azimuths; ++q) {
          for (std::size_t k = 0; k < o.stokes(); ++k) {
            sum += 0.37 * std::abs(dlight[((j * azimuths + q) * o.stokes() + k) * L + w]);
          }
        }
        const auto n = static_cast<double>(azimuths);
        for (std::size_t k = 0; k < 4; ++k) {
          const std::size_t at = (j * 4 + k) * L + w;
          worst.add(coherency[at], twin_coherency[at], sum + std::abs(coherency0[at]), 3 * n + 8);
        }
        for (std::size_t k = 0; aerosol && k < o.stokes() * count; ++k) {
          const std::size_t at = (j * o.stokes() * count + k) * L + w;
          moments_worst.add(moments[at], twin_moments[at], 2 * sum + std::abs(moments0[at]),
                            n + 3.0 * o.phase_degree + 8);
        }
      }
    }
  });
}

// Starts all over the Earth, light that is smooth in the Sun's zenith angle chi: what a wrong chi
// costs is its slope. The cosine of chi is right to 3 u, so chi to 4 u / sin(chi), and near 0 and
// pi, where a cosine says little, to sqrt(8 u); its place on the scale to 4 u pi. The azimuth of
// the ray from the Sun's is right to 4 u / sin(chi).
struct Starts {
  std::size_t pairs = 60, lanes;
  ZenithGrid grid{3.0};
  std::vector<float> cos_chi, sin_chi, cos_phi, sin_phi, reference, scratch;
  double psi = std::pow(10.0, between(-4.0, -0.5));
  static constexpr double kReferenceSlope = 0.3, kReference = 1.3;

  explicit Starts(std::size_t lane_count) : lanes(lane_count) {
    const std::size_t padded = (pairs + 15) / 16 * 16;
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
    scratch.assign(3 * padded, 0.0F);
  }
  // Error of chi and of the azimuth at the point, rad.
  struct Angles {
    double chi_error, azimuth_error, chi, sine;
  };
  Angles angles(std::size_t i) const {
    const double cc = cos_chi[i], sc = sin_chi[i], cf = cos_phi[i], sf = sin_phi[i];
    const double cp = static_cast<float>(std::cos(psi)), sp = static_cast<float>(std::sin(psi));
    const double along = cp * sc * cf - sp * cc, across = sf * sc;
    const double sine = std::hypot(along, across), cosine = cc * cp + sc * sp * cf;
    return {std::min(4 * kUnit / sine, std::sqrt(8 * kUnit)) + 4 * pi * kUnit,
            std::min(4 * kUnit / sine, 2.0), std::atan2(sine, cosine), sine};
  }
  template <class In, class T>
  void fill(In& in, const std::vector<T>& cc, const std::vector<T>& sc, const std::vector<T>& cf,
            const std::vector<T>& sf, const std::vector<T>& ref) const {
    in.pairs = pairs;
    in.cos_chi = cc.data(), in.sin_chi = sc.data(), in.cos_phi = cf.data(), in.sin_phi = sf.data();
    in.cos_psi = static_cast<float>(std::cos(psi));
    in.sin_psi = static_cast<float>(std::sin(psi));
    in.lanes = lanes;
    in.nodes = grid.size();
    in.fine_position = grid.fine_position().data();
    in.fine_per_radian = static_cast<T>(180 / pi / ZenithGrid::kFineStep_deg);
    in.reference = ref.data();
    in.fine_end = ZenithGrid::kFineSize - 1;
  }
};

TEST(FloatKernel, GatherModes) {
  Worst worst("gather_modes");
  for_all(40, "gather_modes", [&] {
    const OrdersInput o;
    Starts starts(o.lanes);
    const std::size_t L = o.lanes, degree = static_cast<std::size_t>(std::max(2, o.phase_degree));
    const std::size_t row = o.stokes() * (degree + 1) * L;
    const auto amplitude = floats(row, -1, 1), phase = floats(row, 0, 6);
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
    starts.fill(in, starts.cos_chi, starts.sin_chi, starts.cos_phi, starts.sin_phi,
                starts.reference);
    both(in);
    in.modes = modes.data();
    in.scratch = starts.scratch.data();
    const auto cc = doubles(starts.cos_chi), sc = doubles(starts.sin_chi),
               cf = doubles(starts.cos_phi), sf = doubles(starts.sin_phi),
               ref = doubles(starts.reference), dm = doubles(modes);
    GatherInput<double> twin_in;
    starts.fill(twin_in, cc, sc, cf, sf, ref);
    both(twin_in);
    twin_in.modes = dm.data();
    std::vector<float> got(starts.pairs * o.stokes() * L, 0.0F);
    std::vector<double> twin = doubles(got);
    gather_modes(in, got.data());
    gather_modes_scalar(twin_in, twin.data());
    for (std::size_t i = 0; i < starts.pairs; ++i) {
      const Starts::Angles a = starts.angles(i);
      for (std::size_t q = 0; q < o.stokes(); ++q) {
        for (std::size_t w = 0; w < L; ++w) {
          double size = 0, error = 0;
          for (std::size_t m = 0; m <= degree; ++m) {
            const double A =
                std::abs(amplitude[(q * (degree + 1) + m) * L + w]) * Starts::kReference;
            size += A;
            // 1.3: slope of the cubic; a recurrence's error grows by 3 u a step.
            error += A * (1.6 * a.chi_error +
                          std::min(2.0, static_cast<double>(m) * (a.azimuth_error + 3 * kUnit)));
          }
          const std::size_t at = (i * o.stokes() + q) * L + w;
          worst.add(got[at], twin[at], size,
                    error / (kUnit * size) + static_cast<double>(degree) + 24);
        }
      }
    }
  });
}

// The scattering angle inherits the errors of chi and the azimuth (times sin(chi)); the plane of
// polarisation turns by that over its sine.
TEST(FloatKernel, GatherBeam) {
  Worst worst("gather_beam, I"), linear("gather_beam, Q and U");
  for_all(40, "gather_beam", [&] {
    const OrdersInput o;
    Starts starts(o.lanes);
    const std::size_t L = o.lanes, kinds = o.phase_degree > 0 ? 2 : 0, phase_nodes = 201;
    std::vector<float> cos_sun, sin_sun, phase;
    for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
      const double chi = static_cast<double>(k) * ZenithGrid::kFineStep_deg * pi / 180;
      const double apparent = chi - 0.01 * std::sin(chi);
      cos_sun.push_back(static_cast<float>(std::cos(apparent)));
      sin_sun.push_back(static_cast<float>(std::sin(apparent)));
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
    const auto fill = [&](auto& in, const auto& c, const auto& s, const auto& a, const auto& h,
                          const auto& k, const auto& p) {
      in.gather.polarised = o.polarised;
      in.kinds = kinds;
      in.phase_nodes = phase_nodes;
      in.cos_theta = static_cast<float>(std::cos(theta));
      in.sin_theta = static_cast<float>(std::sin(theta));
      in.cos_sun = c.data(), in.sin_sun = s.data(), in.air_weight = a.data();
      in.anisotropic_share = h.data(), in.kind_weight = k.data(), in.phase = p.data();
    };
    BeamInput<float> in;
    starts.fill(in.gather, starts.cos_chi, starts.sin_chi, starts.cos_phi, starts.sin_phi,
                starts.reference);
    in.gather.scratch = starts.scratch.data();
    fill(in, cos_sun, sin_sun, air, share, weight, phase);
    const auto cc = doubles(starts.cos_chi), sc = doubles(starts.sin_chi),
               cf = doubles(starts.cos_phi), sf = doubles(starts.sin_phi),
               ref = doubles(starts.reference), dcs = doubles(cos_sun), dss = doubles(sin_sun),
               da = doubles(air), dh = doubles(share), dw = doubles(weight), dph = doubles(phase);
    BeamInput<double> twin_in;
    starts.fill(twin_in.gather, cc, sc, cf, sf, ref);
    fill(twin_in, dcs, dss, da, dh, dw, dph);
    std::vector<float> got(starts.pairs * o.stokes() * L, 0.0F);
    std::vector<double> twin = doubles(got);
    gather_beam(in, got.data());
    gather_beam_scalar(twin_in, twin.data());
    for (std::size_t i = 0; i < starts.pairs; ++i) {
      const Starts::Angles a = starts.angles(i);
      const double angle_error = a.chi_error + a.azimuth_error * a.sine + 8 * kUnit;
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
        const double error = slope * angle_error + 0.3 * size * a.chi_error + 24 * kUnit * size;
        const std::size_t at = i * o.stokes() * L + w;
        worst.add(got[at], twin[at], size, error / (kUnit * size));
        if (!o.polarised) continue;
        // The light is polarised by no more than the sine of the scattering angle squared, which
        // is what keeps a plane that is lost near 0 and pi from mattering: q <= size * 2 sin^2.
        const double turn = 8 * size * angle_error;
        for (std::size_t q = 1; q < 3; ++q) {
          linear.add(got[at + q * L], twin[at + q * L], size, (error + turn) / (kUnit * size));
        }
      }
    }
  });
}

}  // namespace
}  // namespace twilight
