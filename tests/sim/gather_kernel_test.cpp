#include "sim/gather_kernel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "sim/field_moments.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;

struct Optics {
  std::vector<float> extinction, air, aerosol, asymmetry, x2;
  GatherOptics view() const {
    return {extinction.data(), air.data(), aerosol.data(), asymmetry.data(), x2.data()};
  }
};

class March : public testing::TestWithParam<std::size_t> {
 protected:
  std::mt19937 random{2005};
  float any(float lowest, float highest) {
    return std::uniform_real_distribution<float>(lowest, highest)(random);
  }
  static constexpr int kLayers = 12;

  Optics optics(float most) {
    const std::size_t L = GetParam();
    Optics o;
    for (std::size_t i = 0; i < kLayers * L; ++i) {
      o.air.push_back(any(0, most));
      o.aerosol.push_back(any(0, most));
      o.extinction.push_back(o.air.back() + o.aerosol.back() + any(0, 0.1F * most));
      o.asymmetry.push_back(any(-0.5F, 0.9F));
    }
    for (std::size_t w = 0; w < L; ++w) o.x2.push_back(any(0, 0.1F));
    return o;
  }

  GatherMarch ray(int steps) {
    const std::size_t L = GetParam();
    GatherMarch r;
    r.lanes = L;
    r.steps = steps;
    for (int i = 0; i < steps; ++i) {
      r.length_km.push_back(i % 5 == 0 ? 1e-4F : any(0, 4));
      r.layer.push_back(i * kLayers / steps);
      r.lit.push_back(i % 3 != 0);
      for (std::size_t w = 0; w < L; ++w) {
        r.sun_depth.push_back(any(0, 120));
        if (w % 2) r.sun_depth.back() *= 0.02F;
        r.multiple.push_back(any(0, 1e-3F));
      }
    }
    r.cosine = any(-1, 1);
    return r;
  }
};

// Single precision over some hundred steps; (1 - e^-x)/x switches to its series at 2e-3 with an
// error of x^2/6 < 1e-6.
TEST_P(March, AgreesWithItsScalarTwin) {
  const std::size_t L = GetParam();
  for (const float most : {0.0F, 1e-5F, 1e-3F, 0.02F, 0.3F}) {
    for (int trial = 0; trial < 20; ++trial) {
      const Optics o = optics(most);
      const GatherMarch r = ray(200);
      std::vector<float> a(L, 0.0F), b(L, 0.0F), ta(L, 1.0F), tb(L, 1.0F);
      march(r, o.view(), a.data(), ta.data());
      march_scalar(r, o.view(), b.data(), tb.data());
      for (std::size_t w = 0; w < L; ++w) {
        EXPECT_NEAR(a[w], b[w], 1e-5 * b[w]) << most;
        // e^-depth in single precision: depth x 6e-8 a step.
        EXPECT_NEAR(ta[w], tb[w], 4e-5 * tb[w] + 1e-30) << most;
      }
    }
  }
}

// A ray in two pieces gathers what it gathers in one.
TEST_P(March, GoesOnFromWhereItStopped) {
  const std::size_t L = GetParam();
  const Optics o = optics(0.02F);
  const GatherMarch whole = ray(60);
  std::vector<float> a(L, 0.0F), t(L, 1.0F), b(L, 0.0F), u(L, 1.0F);
  march(whole, o.view(), a.data(), t.data());
  for (const int part : {0, 1}) {
    GatherMarch half = whole;
    half.steps = 30;
    const auto from = [&](auto& v, std::size_t each) {
      const auto begin = v.begin() + static_cast<std::ptrdiff_t>(30 * each) * part;
      v.assign(begin, begin + static_cast<std::ptrdiff_t>(30 * each));
    };
    auto source = whole;
    from(source.length_km, 1);
    from(source.layer, 1);
    from(source.lit, 1);
    from(source.sun_depth, L);
    from(source.multiple, L);
    source.steps = 30;
    march(source, o.view(), b.data(), u.data());
  }
  for (std::size_t w = 0; w < L; ++w) {
    EXPECT_NEAR(a[w], b[w], 1e-5 * a[w]);
    EXPECT_NEAR(t[w], u[w], 1e-5 * t[w]);
  }
}

// Uniform emission e through the depth tau: e/beta (1 - exp(-tau)), in any number of steps.
TEST_P(March, UniformEmissionSaturates) {
  const std::size_t L = GetParam();
  for (const int steps : {1, 7, 300}) {
    GatherMarch r;
    r.lanes = L;
    r.steps = steps;
    r.length_km.assign(static_cast<std::size_t>(steps), 30.0F / static_cast<float>(steps));
    r.layer.assign(static_cast<std::size_t>(steps), 0);
    r.lit.assign(static_cast<std::size_t>(steps), 0);
    r.sun_depth.assign(static_cast<std::size_t>(steps) * L, 0.0F);
    r.multiple.assign(static_cast<std::size_t>(steps) * L, 0.01F);
    const std::vector<float> extinction(L, 0.05F), none(L, 0.0F);
    std::vector<float> radiance(L, 0.0F), t(L, 1.0F);
    march(r, {extinction.data(), none.data(), none.data(), none.data(), none.data()},
          radiance.data(), t.data());
    for (std::size_t w = 0; w < L; ++w) {
      EXPECT_NEAR(radiance[w], 0.01 / 0.05 * (1 - std::exp(-1.5)), 2e-6);
      EXPECT_NEAR(t[w], std::exp(-1.5), 5e-6);  // 300 products rounded
    }
  }
}

// Over all directions the scattered sunlight is the scattering coefficient times 4 pi / 4 pi: the
// phase functions are normalised, Rayleigh with any depolarisation, Henyey-Greenstein with any g.
TEST_P(March, PhaseFunctionsAreNormalised) {
  const std::size_t L = GetParam();
  for (const float g : {-0.4F, 0.0F, 0.6F, 0.8F}) {
    const std::vector<float> extinction(L, 0.0F), air(L, 2e-3F), aerosol(L, 3e-3F), gs(L, g),
        x2(L, 0.097F);
    GatherMarch r;
    r.lanes = L;
    r.steps = 1;
    r.length_km = {1.0F};
    r.layer = {0};
    r.lit = {1};
    r.sun_depth.assign(L, 0.0F);
    r.multiple.assign(L, 0.0F);
    std::vector<double> sum(L, 0.0);
    constexpr int kAngles = 20000;
    for (int i = 0; i < kAngles; ++i) {
      r.cosine = static_cast<float>(-1 + 2 * (i + 0.5) / kAngles);
      std::vector<float> radiance(L, 0.0F), t(L, 1.0F);
      march(r, {extinction.data(), air.data(), aerosol.data(), gs.data(), x2.data()},
            radiance.data(), t.data());
      for (std::size_t w = 0; w < L; ++w) sum[w] += radiance[w] * 4 * kPi / kAngles;
    }
    for (const double s : sum) EXPECT_NEAR(s, 5e-3, 5e-3 * 1e-4);
  }
}

INSTANTIATE_TEST_SUITE_P(Lanes, March, testing::Values(8U, 16U, 32U));

// (s0 J + s1 F.w + s2 w.S.w)/(4 pi), never negative.
TEST(CellEmission, IsTheMomentsInTheDirection) {
  const std::size_t L = 8;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(-0.2F, 1);
  std::vector<std::vector<float>> field(4, std::vector<float>(kMoments * L));
  for (auto& f : field) {
    for (float& v : f) v = any(random);
  }
  const float* fields[] = {field[0].data(), field[1].data(), field[2].data(), field[3].data()};
  const float weights[] = {0.4F, 0.3F, 0.2F, 0.1F};
  const std::vector<float> s0(L, 2e-2F), s1(L, 1e-2F), s2(L, 3e-2F);
  for (const int moments : {1, static_cast<int>(kMoments)}) {
    for (double angle = 0; angle < 2 * kPi; angle += 0.37) {
      const double r = std::cos(angle), z = std::sin(angle);
      std::vector<float> out(L);
      cell_emission(fields, weights, 4, moments, L, s0.data(), s1.data(), s2.data(),
                    static_cast<float>(r), static_cast<float>(z), out.data());
      for (std::size_t w = 0; w < L; ++w) {
        double m[kMoments] = {};
        for (std::size_t c = 0; c < 4; ++c) {
          for (std::size_t k = 0; k < static_cast<std::size_t>(moments); ++k) {
            m[k] += static_cast<double>(weights[c]) * field[c][k * L + w];
          }
        }
        const double want = 2e-2 * m[kJ] + 1e-2 * (m[kFr] * r + m[kFz] * z) +
                            3e-2 * (m[kSrr] * r * r + m[kSzz] * z * z + 2 * m[kSrz] * r * z);
        EXPECT_NEAR(out[w], std::max(0.0, want) / (4 * kPi), 1e-8);
      }
    }
  }
}

}  // namespace
}  // namespace twilight
