#include "sim/orders_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "sim/angular_moments.h"
#include "sim/zenith_grid.h"
#include "tests/sim/kernel_case.h"

namespace twilight {
namespace {

using std::numbers::pi;

// Start points all over the Earth; a reference that is smooth, so that rounding of the Sun's zenith
// angle (a cosine in float has 3e-4 rad of it near 0 and 180 degrees) does no harm.
template <class T>
struct Gather {
  std::size_t pairs = 101, lanes;
  ZenithGrid grid{1.0};
  std::vector<T> cos_chi, sin_chi, cos_phi, sin_phi, fine_position, modes, reference, scratch;
  GatherInput<T> in;

  Gather(std::size_t lane_count, bool polarised, int degree) : lanes(lane_count) {
    RandomValues<T> random;
    std::uniform_real_distribution<double> unit(0, 1);
    const std::size_t padded = padded_pairs(pairs);
    for (auto* v : {&cos_chi, &sin_chi, &cos_phi, &sin_phi}) v->assign(padded, T(0));
    for (std::size_t i = 0; i < pairs; ++i) {
      const double chi = i == 0 ? 0 : i == 1 ? pi : pi * unit(random.engine);
      const double phi = pi * unit(random.engine);
      cos_chi[i] = static_cast<T>(std::cos(chi));
      sin_chi[i] = static_cast<T>(std::sin(chi));
      cos_phi[i] = static_cast<T>(std::cos(phi));
      sin_phi[i] = static_cast<T>(std::sin(phi));
    }
    const std::size_t stokes = polarised ? 3 : 1, row = mode_rows(degree) * lanes,
                      used = static_cast<std::size_t>(degree + 1) * lanes;
    const auto amplitude = random.values(stokes * row), phase = random.values(stokes * row, 0, 6);
    for (std::size_t j = 0; j < grid.size(); ++j) {
      for (std::size_t k = 0; k < stokes * row; ++k) {
        const double chi = grid.zenith_rad()[j];
        const double kept = k % row < used ? 1 : 0;  // the row that pads is zero
        modes.push_back(static_cast<T>(kept * static_cast<double>(amplitude[k]) *
                                       std::cos(chi + static_cast<double>(phase[k]))));
      }
    }
    for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
      for (std::size_t w = 0; w < lanes; ++w) {
        reference.push_back(static_cast<T>(
            1 + 0.3 * std::cos(static_cast<double>(k) * 1e-3 + static_cast<double>(w))));
      }
    }
    scratch.assign(kGatherScratch * padded, T(0));
    fine_position.assign(grid.fine_position().begin(), grid.fine_position().end());
    in.pairs = pairs;
    in.cos_chi = cos_chi.data();
    in.sin_chi = sin_chi.data();
    in.cos_phi = cos_phi.data();
    in.sin_phi = sin_phi.data();
    in.lanes = lanes;
    in.polarised = polarised;
    in.degree = degree;
    in.stored_degree = degree;
    in.nodes = grid.size();
    in.modes = modes.data();
    in.fine_position = fine_position.data();
    in.fine_per_radian = static_cast<T>(180 / pi / ZenithGrid::kFineStep_deg);
    in.reference = reference.data();
    in.fine_end = ZenithGrid::kFineSize - 1;
    in.scratch = scratch.data();
  }
  void move(double psi) {
    in.cos_psi = static_cast<T>(std::cos(psi));
    in.sin_psi = static_cast<T>(std::sin(psi));
  }
};

template <class T>
void gather_modes_agree(const KernelCase& c) {
  const auto [lanes, polarised, phase_degree] = c;
  Gather<T> gather(static_cast<std::size_t>(lanes), polarised, std::max(2, phase_degree));
  for (const double psi : {1e-3, 0.05, 0.3}) {
    gather.move(psi);
    std::vector<T> simd(gather.pairs * (polarised ? 3 : 1) * gather.lanes, T(0.25));
    std::vector<T> scalar = simd;
    gather_modes(gather.in, simd.data());
    gather_modes_scalar(gather.in, scalar.data());
    // The azimuth turns fast where the Sun is near the zenith: m / sin(chi) times rounding.
    expect_same(simd, scalar, sizeof(T) == 4 ? 1e-3 : 1e-7);
  }
}

// Single scattering of the beam by air and two kinds of aerosol.
template <class T>
void gather_beam_agrees(const KernelCase& c) {
  const auto [lane_count, polarised, phase_degree] = c;
  const auto lanes = static_cast<std::size_t>(lane_count);
  Gather<T> gather(lanes, polarised, 2);
  RandomValues<T> random;
  BeamInput<T> in;
  in.kinds = phase_degree > 0 ? 2 : 0;
  in.phase_nodes = 201;
  std::vector<T> lift, phase;
  for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
    const double chi = static_cast<double>(k) * ZenithGrid::kFineStep_deg * pi / 180;
    lift.push_back(static_cast<T>(0.01 * std::sin(chi)));
  }
  const auto amplitude = random.values(2 * 2 * lanes);
  for (std::size_t q = 0; q < 2; ++q) {
    for (std::size_t k = 0; k < in.phase_nodes; ++k) {
      const double x = 2 * static_cast<double>(k) / static_cast<double>(in.phase_nodes - 1) - 1;
      for (std::size_t i = 0; i < 2 * lanes; ++i) {
        phase.push_back(static_cast<T>(static_cast<double>(amplitude[q * 2 * lanes + i]) *
                                       (i < lanes ? std::exp(x) : 1 - x * x)));
      }
    }
  }
  const auto air = random.values(lanes, 0, 1), share = random.values(lanes, 0.9, 1),
             kind_weight = random.values(2 * lanes, 0, 1);
  in.cos_theta = static_cast<T>(std::cos(1.9));
  in.sin_theta = static_cast<T>(std::sin(1.9));
  in.lift_rad = lift.data();
  in.air_weight = air.data();
  in.anisotropic_share = share.data();
  const std::vector<std::size_t> kind{0, 1};
  in.kind = kind.data();
  in.kind_weight = kind_weight.data();
  in.phase = phase.data();
  for (const double psi : {1e-3, 0.05, 0.3}) {
    gather.move(psi);
    in.gather = gather.in;
    std::vector<T> simd(gather.pairs * (polarised ? 3 : 1) * lanes, T(0.25));
    std::vector<T> scalar = simd;
    gather_beam(in, simd.data());
    gather_beam_scalar(in, scalar.data());
    expect_same(simd, scalar, sizeof(T) == 4 ? 1e-3 : 1e-7);
  }
}

// Leaving modes out is the same as their being 0.
template <class T>
void fewer_modes_agree(const KernelCase& c) {
  const auto [lanes, polarised, phase_degree] = c;
  if (phase_degree < 3) return;
  Gather<T> gather(static_cast<std::size_t>(lanes), polarised, phase_degree);
  gather.move(0.1);
  const int kept = phase_degree - 1;
  const std::size_t row = gather.lanes, stored = mode_rows(phase_degree);
  for (std::size_t k = 0; k < gather.modes.size(); ++k) {
    if (k / row % stored > static_cast<std::size_t>(kept)) gather.modes[k] = 0;
  }
  std::vector<T> all(gather.pairs * (polarised ? 3 : 1) * gather.lanes, T(0)), some = all;
  gather_modes(gather.in, all.data());
  gather.in.degree = kept;
  gather_modes(gather.in, some.data());
  expect_same(some, all, 10 * kRounding<T>);
}

template <class T>
void gather_ground_is_its_definition(const KernelCase& c) {
  const auto lanes = static_cast<std::size_t>(std::get<0>(c));
  Gather<T> gather(lanes, false, 2);
  gather.move(0.1);
  RandomValues<T> random;
  const auto weight = random.values(lanes);
  const std::size_t stride = 3 * lanes;
  std::vector<T> got(gather.pairs * stride, T(0.5)), want = got;
  gather_ground(gather.in, weight.data(), stride, got.data());
  for (std::size_t i = 0; i < gather.pairs; ++i) {
    const double x = static_cast<double>(gather.cos_chi[i]) * std::cos(0.1) +
                     static_cast<double>(gather.sin_chi[i]) * std::sin(0.1) *
                         static_cast<double>(gather.cos_phi[i]);
    const double fine = std::acos(std::clamp(x, -1.0, 1.0)) * 180 / pi / ZenithGrid::kFineStep_deg;
    for (std::size_t w = 0; w < lanes; ++w) {
      const double value = 1 + 0.3 * std::cos(fine * 1e-3 + static_cast<double>(w));
      want[i * stride + w] += static_cast<T>(static_cast<double>(weight[w]) * value);
    }
  }
  expect_same(got, want, sizeof(T) == 4 ? 2e-4 : 1e-6);
}

template <class T>
void add_moments_agree(const KernelCase& c) {
  const auto [lane_count, polarised, phase_degree] = c;
  const auto lanes = static_cast<std::size_t>(lane_count);
  RandomValues<T> random;
  MomentInput<T> in;
  in.nodes = 5;
  in.azimuths = 9;
  in.lanes = lanes;
  in.polarised = polarised;
  std::vector<T> cosine, sine;
  for (std::size_t q = 0; q < in.azimuths; ++q) {
    const double phi = pi * (static_cast<double>(q) + 0.5) / static_cast<double>(in.azimuths);
    cosine.push_back(static_cast<T>(std::cos(phi)));
    sine.push_back(static_cast<T>(std::sin(phi)));
  }
  in.cos_phi = cosine.data();
  in.sin_phi = sine.data();
  const std::size_t stokes = polarised ? 3 : 1, count = moment_count(phase_degree);
  in.directions = 3;
  std::vector<std::vector<T>> light, basis;
  for (std::size_t k = 0; k < in.directions; ++k) {
    const double theta = 0.3 + 0.9 * static_cast<double>(k);
    in.cos_theta[k] = static_cast<T>(std::cos(theta));
    in.sin_theta[k] = static_cast<T>(std::sin(theta));
    in.weight[k] = T(0.37);
    light.push_back(random.values(in.nodes * in.azimuths * stokes * lanes));
    basis.push_back(random.values(3 * count));
    in.light[k] = light[k].data();
    in.basis[k] = basis[k].data();
  }
  std::vector<T> scratch(kEmissionBatch * 3 * static_cast<std::size_t>(phase_degree + 1) * lanes);
  in.scratch = scratch.data();
  in.phase_degree = phase_degree;
  auto coherency = random.values(in.nodes * 4 * lanes);
  auto moments = random.values(in.nodes * stokes * count * lanes);
  auto coherency_scalar = coherency, moments_scalar = moments;
  add_moments(in, coherency.data(), phase_degree > 0 ? moments.data() : nullptr);
  add_moments_scalar(in, coherency_scalar.data(),
                     phase_degree > 0 ? moments_scalar.data() : nullptr);
  expect_same(coherency, coherency_scalar, 10 * kRounding<T>);
  expect_same(moments, moments_scalar, 10 * kRounding<T>);
}

class OrdersKernels : public testing::TestWithParam<KernelCase> {};

TEST_P(OrdersKernels, GatherModesIsTheScalarOne) {
  gather_modes_agree<float>(GetParam());
  gather_modes_agree<double>(GetParam());
}

TEST_P(OrdersKernels, GatherBeamIsTheScalarOne) {
  gather_beam_agrees<float>(GetParam());
  gather_beam_agrees<double>(GetParam());
}

TEST_P(OrdersKernels, ModesLeftOutAreZeros) {
  fewer_modes_agree<float>(GetParam());
  fewer_modes_agree<double>(GetParam());
}

TEST_P(OrdersKernels, GatherGroundIsItsDefinition) {
  gather_ground_is_its_definition<float>(GetParam());
  gather_ground_is_its_definition<double>(GetParam());
}

TEST_P(OrdersKernels, AddMomentsIsTheScalarOne) {
  add_moments_agree<float>(GetParam());
  add_moments_agree<double>(GetParam());
}

INSTANTIATE_TEST_SUITE_P(LanesPolarisationAerosol, OrdersKernels, kernel_cases());

// What lies beyond fine_end is dark, to the last of the fine points before it.
TEST(OrdersKernels, NothingComesFromBeyondTheShadow) {
  Gather<double> gather(8, true, 2);
  gather.move(0.02);
  gather.in.fine_end = 1900;
  std::vector<double> out(gather.pairs * 24, 0.0), ground(gather.pairs * 8, 0.0);
  const std::vector<double> weight(8, 1.0);
  gather_modes(gather.in, out.data());
  gather_ground(gather.in, weight.data(), 8, ground.data());
  for (std::size_t i = 0; i < gather.pairs; ++i) {
    const double x =
        gather.cos_chi[i] * std::cos(0.02) + gather.sin_chi[i] * std::sin(0.02) * gather.cos_phi[i];
    const bool dark = std::acos(std::clamp(x, -1.0, 1.0)) * 180 / pi >= 95;
    EXPECT_EQ(out[i * 24] == 0, dark);
    EXPECT_EQ(ground[i * 8] == 0, dark);
  }
}

}  // namespace
}  // namespace twilight
