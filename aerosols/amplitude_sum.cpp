#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "aerosols/amplitude_sum.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include "aerosols/amplitude_sum.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Adds the orders [first, last) (indices n - 1, first even) to the sums of one angle.
// coefficients: [order][a re, a im, b re, b im][sphere], times (2n + 1) / (n (n + 1)).
void AddOrders(const double* pi, const double* tau, const double* coefficients, std::size_t first,
               std::size_t last, PairedAmplitudes& sums) {
  const hn::CappedTag<double, kSpheresTogether> d;
  for (std::size_t lane = 0; lane < kSpheresTogether; lane += hn::Lanes(d)) {
    auto s1e_re = hn::LoadU(d, sums.s1_even_re.data() + lane);
    auto s1e_im = hn::LoadU(d, sums.s1_even_im.data() + lane);
    auto s1o_re = hn::LoadU(d, sums.s1_odd_re.data() + lane);
    auto s1o_im = hn::LoadU(d, sums.s1_odd_im.data() + lane);
    auto s2e_re = hn::LoadU(d, sums.s2_even_re.data() + lane);
    auto s2e_im = hn::LoadU(d, sums.s2_even_im.data() + lane);
    auto s2o_re = hn::LoadU(d, sums.s2_odd_re.data() + lane);
    auto s2o_im = hn::LoadU(d, sums.s2_odd_im.data() + lane);
    const double* c = coefficients + lane;
    for (std::size_t i = first; i < last; i += 2) {
      // Odd n: pi_n is even about 90 degrees, tau_n odd.
      const double* k = c + 4 * kSpheresTogether * i;
      auto p = hn::Set(d, pi[i]), t = hn::Set(d, tau[i]);
      auto a_re = hn::LoadU(d, k), a_im = hn::LoadU(d, k + kSpheresTogether);
      auto b_re = hn::LoadU(d, k + 2 * kSpheresTogether);
      auto b_im = hn::LoadU(d, k + 3 * kSpheresTogether);
      s1e_re = hn::MulAdd(a_re, p, s1e_re);
      s1e_im = hn::MulAdd(a_im, p, s1e_im);
      s1o_re = hn::MulAdd(b_re, t, s1o_re);
      s1o_im = hn::MulAdd(b_im, t, s1o_im);
      s2e_re = hn::MulAdd(b_re, p, s2e_re);
      s2e_im = hn::MulAdd(b_im, p, s2e_im);
      s2o_re = hn::MulAdd(a_re, t, s2o_re);
      s2o_im = hn::MulAdd(a_im, t, s2o_im);
      // Even n: the other way round.
      k += 4 * kSpheresTogether;
      p = hn::Set(d, pi[i + 1]);
      t = hn::Set(d, tau[i + 1]);
      a_re = hn::LoadU(d, k);
      a_im = hn::LoadU(d, k + kSpheresTogether);
      b_re = hn::LoadU(d, k + 2 * kSpheresTogether);
      b_im = hn::LoadU(d, k + 3 * kSpheresTogether);
      s1o_re = hn::MulAdd(a_re, p, s1o_re);
      s1o_im = hn::MulAdd(a_im, p, s1o_im);
      s1e_re = hn::MulAdd(b_re, t, s1e_re);
      s1e_im = hn::MulAdd(b_im, t, s1e_im);
      s2o_re = hn::MulAdd(b_re, p, s2o_re);
      s2o_im = hn::MulAdd(b_im, p, s2o_im);
      s2e_re = hn::MulAdd(a_re, t, s2e_re);
      s2e_im = hn::MulAdd(a_im, t, s2e_im);
    }
    hn::StoreU(s1e_re, d, sums.s1_even_re.data() + lane);
    hn::StoreU(s1e_im, d, sums.s1_even_im.data() + lane);
    hn::StoreU(s1o_re, d, sums.s1_odd_re.data() + lane);
    hn::StoreU(s1o_im, d, sums.s1_odd_im.data() + lane);
    hn::StoreU(s2e_re, d, sums.s2_even_re.data() + lane);
    hn::StoreU(s2e_im, d, sums.s2_even_im.data() + lane);
    hn::StoreU(s2o_re, d, sums.s2_odd_re.data() + lane);
    hn::StoreU(s2o_im, d, sums.s2_odd_im.data() + lane);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <stdexcept>
#include <string>

namespace twilight {

HWY_EXPORT(AddOrders);

AngularFunctions::AngularFunctions(std::span<const double> cos_angle, std::size_t orders)
    : angles_(cos_angle.size()),
      orders_(orders + orders % 2),  // the sums take two orders at a time
      pi_(angles_ * orders_),
      tau_(angles_ * orders_) {
  for (std::size_t j = 0; j < angles_; ++j) {
    const double mu = cos_angle[j];
    if (!(mu >= 0.0 && mu <= 1.0)) {
      throw std::invalid_argument("cosine " + std::to_string(mu) +
                                  " of an angle up to 90 degrees is outside 0..1");
    }
    double pi_before = 0.0, pi_n = 1.0;
    for (std::size_t i = 0; i < orders_; ++i) {
      const double n = static_cast<double>(i + 1);
      pi_[j * orders_ + i] = pi_n;
      tau_[j * orders_ + i] = n * mu * pi_n - (n + 1.0) * pi_before;
      const double pi_next = ((2.0 * n + 1.0) * mu * pi_n - (n + 1.0) * pi_before) / n;
      pi_before = pi_n;
      pi_n = pi_next;
    }
  }
}

std::vector<PairedAmplitudes> paired_amplitudes(const AngularFunctions& functions,
                                                std::span<const MieSeries> spheres) {
  if (spheres.size() > kSpheresTogether) {
    throw std::invalid_argument("number of spheres " + std::to_string(spheres.size()) +
                                " must be at most " + std::to_string(kSpheresTogether));
  }
  std::size_t orders = 0;
  for (const MieSeries& sphere : spheres) orders = std::max(orders, sphere.a.size());
  orders += orders % 2;
  if (orders > functions.orders()) {
    throw std::invalid_argument("number of orders " + std::to_string(orders) +
                                " must be at most the angular functions' " +
                                std::to_string(functions.orders()));
  }
  std::vector<double> coefficients(orders * 4 * kSpheresTogether);
  for (std::size_t s = 0; s < spheres.size(); ++s) {
    for (std::size_t i = 0; i < spheres[s].a.size(); ++i) {
      const double n = static_cast<double>(i + 1);
      const double weight = (2.0 * n + 1.0) / (n * (n + 1.0));
      double* const c = coefficients.data() + i * 4 * kSpheresTogether + s;
      c[0] = weight * spheres[s].a[i].real();
      c[kSpheresTogether] = weight * spheres[s].a[i].imag();
      c[2 * kSpheresTogether] = weight * spheres[s].b[i].real();
      c[3 * kSpheresTogether] = weight * spheres[s].b[i].imag();
    }
  }
  std::vector<PairedAmplitudes> sums(functions.angles());
  // So many orders at a time that their coefficients stay in the first cache.
  constexpr std::size_t kOrdersTogether = 64;
  for (std::size_t first = 0; first < orders; first += kOrdersTogether) {
    const std::size_t last = std::min(orders, first + kOrdersTogether);
    for (std::size_t j = 0; j < functions.angles(); ++j) {
      HWY_DYNAMIC_DISPATCH(AddOrders)
      (functions.pi(j), functions.tau(j), coefficients.data(), first, last, sums[j]);
    }
  }
  return sums;
}

}  // namespace twilight
#endif  // HWY_ONCE
