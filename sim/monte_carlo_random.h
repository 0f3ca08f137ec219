// Random numbers of the Monte Carlo: a function of (seed, view, batch, path) alone.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace twilight {

/// The finaliser of SplitMix64 (Steele, Lea & Flood 2014, OOPSLA): a bijection of 64 bits.
inline std::uint64_t mix_bits(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

/// A key made of several: order matters.
inline std::uint64_t combine_keys(std::uint64_t key, std::uint64_t more) {
  return mix_bits(key + 0x9e3779b97f4a7c15ULL + mix_bits(more + 0x632be59bd9b4e019ULL));
}

/// SplitMix64 as a counter-based generator: the n-th number depends on the key and n alone.
class CounterRandom {
 public:
  explicit CounterRandom(std::uint64_t key) : state_(key) {}

  /// Uniform in the open interval (0, 1).
  double next() {
    state_ += 0x9e3779b97f4a7c15ULL;
    return (static_cast<double>(mix_bits(state_) >> 12) + 0.5) * 0x1p-52;
  }

 private:
  std::uint64_t state_;
};

/// The first kDimensions random numbers of each path of a batch: a Kronecker lattice (Roberts'
/// generalised golden ratio) under a random shift, so that every path alone is uniform and
/// batches are independent, while the paths of one batch fill the space evenly.
class ShiftedLattice {
 public:
  static constexpr std::size_t kDimensions = 10;

  explicit ShiftedLattice(std::uint64_t batch_key) {
    CounterRandom random(batch_key);
    // Root of x^(d + 1) = x + 1, by iteration.
    double ratio = 1.1;
    for (int i = 0; i < 60; ++i) ratio = std::pow(1 + ratio, 1.0 / (kDimensions + 1));
    double power = 1;
    for (std::size_t j = 0; j < kDimensions; ++j) {
      power /= ratio;
      step_[j] = power;
      shift_[j] = random.next();
    }
  }

  /// In (0, 1).
  double operator()(std::size_t point, std::size_t dimension) const {
    const double x = shift_[dimension] + static_cast<double>(point) * step_[dimension];
    const double fraction = x - std::floor(x);
    return fraction > 0 ? fraction : 0x1p-53;
  }

 private:
  std::array<double, kDimensions> step_, shift_;
};

/// The numbers of one path: lattice first, then the generator.
class PathRandom {
 public:
  PathRandom(const ShiftedLattice& lattice, std::size_t point, std::uint64_t key)
      : lattice_(&lattice), point_(point), random_(key) {}

  double next() {
    return used_ < ShiftedLattice::kDimensions ? (*lattice_)(point_, used_++) : random_.next();
  }

 private:
  const ShiftedLattice* lattice_;
  std::size_t point_;
  std::size_t used_ = 0;
  CounterRandom random_;
};

}  // namespace twilight
