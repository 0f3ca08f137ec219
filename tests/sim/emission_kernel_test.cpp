#include "sim/emission_kernel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sim/angular_moments.h"
#include "tests/sim/kernel_case.h"

namespace twilight {
namespace {

template <class T>
void air_modes_agree(const KernelCase& c) {
  const auto [lane_count, polarised, phase_degree] = c;
  const auto lanes = static_cast<std::size_t>(lane_count);
  RandomValues<T> random;
  AirEmission<T> in;
  in.nodes = 7;
  in.lanes = lanes;
  in.polarised = polarised;
  in.degree = std::max(2, phase_degree);
  in.cos_theta = static_cast<T>(std::cos(2.0));
  in.sin_theta = static_cast<T>(std::sin(2.0));
  const auto coherency = random.values(in.nodes * 4 * lanes), air = random.values(lanes, 0, 1);
  in.coherency = coherency.data();
  in.air_weight = air.data();
  // Whatever was there before is overwritten.
  std::vector<T> simd(in.nodes * (polarised ? 3 : 1) * mode_rows(in.degree) * lanes, T(99));
  std::vector<T> scalar = simd;
  air_modes(in, simd.data());
  air_modes_scalar(in, scalar.data());
  expect_same(simd, scalar, 10 * kRounding<T>);
}

template <class T>
void aerosol_modes_agree(const KernelCase& c) {
  const auto [lane_count, polarised, phase_degree] = c;
  if (phase_degree == 0) return;
  const auto lanes = static_cast<std::size_t>(lane_count);
  const std::size_t fields = polarised ? 3 : 1, count = moment_count(phase_degree);
  for (std::size_t points = 1; points <= kEmissionBatch; ++points) {
    RandomValues<T> random;
    AerosolPoints<T> in;
    in.nodes = 5;
    in.lanes = lanes;
    in.polarised = polarised;
    in.phase_degree = phase_degree;
    in.degree = phase_degree + 1;
    in.points = points;
    const auto scattered = random.values(in.nodes * count * fields * lanes);
    in.scattered = scattered.data();
    std::vector<std::vector<T>> basis, weight, simd, scalar;
    for (std::size_t k = 0; k < points; ++k) {
      basis.push_back(random.values(3 * count));
      weight.push_back(random.values(lanes, 0, 1));
      simd.push_back(random.values(in.nodes * fields * mode_rows(in.degree) * lanes));
    }
    scalar = simd;
    const auto run = [&](std::vector<std::vector<T>>& modes, auto kernel) {
      for (std::size_t k = 0; k < points; ++k) {
        in.basis[k] = basis[k].data();
        in.weight[k] = weight[k].data();
        in.modes[k] = modes[k].data();
      }
      kernel(in);
    };
    run(simd, add_aerosol_modes<T>);
    run(scalar, add_aerosol_modes_scalar<T>);
    for (std::size_t k = 0; k < points; ++k) expect_same(simd[k], scalar[k], 10 * kRounding<T>);
  }
}

template <class T>
void significant_degree_finds_the_last_mode(const KernelCase& c) {
  const auto [lane_count, polarised, phase_degree] = c;
  const auto lanes = static_cast<std::size_t>(lane_count);
  AirEmission<T> in;
  in.nodes = 5;
  in.lanes = lanes;
  in.polarised = polarised;
  in.degree = std::max(2, phase_degree);
  const std::size_t rows = mode_rows(in.degree), stokes = polarised ? 3 : 1;
  for (std::size_t last = 0; last <= static_cast<std::size_t>(in.degree); ++last) {
    std::vector<T> modes(in.nodes * stokes * rows * lanes, T(0));
    for (std::size_t j = 0; j < in.nodes; ++j) {
      for (std::size_t w = 0; w < lanes; ++w) modes[j * stokes * rows * lanes + w] = T(2);
    }
    // One node, one lane, the last of the Stokes parameters.
    modes[((3 * stokes + stokes - 1) * rows + last) * lanes + lanes - 1] = T(0.5);
    EXPECT_EQ(significant_degree(in, modes.data(), T(0.1)),
              std::max<int>(2, static_cast<int>(last)))
        << "last mode " << last;
    EXPECT_EQ(significant_degree(in, modes.data(), T(0.3)), 2) << "last mode " << last;
  }
}

class EmissionKernels : public testing::TestWithParam<KernelCase> {};

TEST_P(EmissionKernels, AirModesAreTheScalarOnes) {
  air_modes_agree<float>(GetParam());
  air_modes_agree<double>(GetParam());
}

TEST_P(EmissionKernels, AerosolModesAreTheScalarOnes) {
  aerosol_modes_agree<float>(GetParam());
  aerosol_modes_agree<double>(GetParam());
}

TEST_P(EmissionKernels, SignificantDegreeFindsTheLastMode) {
  significant_degree_finds_the_last_mode<float>(GetParam());
  significant_degree_finds_the_last_mode<double>(GetParam());
}

INSTANTIATE_TEST_SUITE_P(LanesPolarisationAerosol, EmissionKernels, kernel_cases());

TEST(ModeMajorIndex, CountsEveryPairOnce) {
  for (const int degree : {0, 1, 2, 7}) {
    std::size_t next = 0;
    for (int m = 0; m <= degree; ++m) {
      for (int l = m; l <= degree; ++l) EXPECT_EQ(mode_major_index(degree, l, m), next++);
    }
    EXPECT_EQ(next, moment_count(degree));
  }
}

}  // namespace
}  // namespace twilight
