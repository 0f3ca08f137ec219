#include "output/colour_matching.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

struct ObserverRow {
  Tristimulus two_degrees;
  Tristimulus ten_degrees;
};

constexpr ObserverRow kRows[kObserverRows] = {
#include "output/cie_observers_1nm.inc"
};

template <Tristimulus ObserverRow::*column>
constexpr std::array<Tristimulus, kObserverRows> column_of_rows() {
  std::array<Tristimulus, kObserverRows> table{};
  for (std::size_t i = 0; i < kObserverRows; ++i) table[i] = kRows[i].*column;
  return table;
}

constexpr auto kTwoDegrees = column_of_rows<&ObserverRow::two_degrees>();
constexpr auto kTenDegrees = column_of_rows<&ObserverRow::ten_degrees>();

}  // namespace

std::span<const Tristimulus, kObserverRows> colour_matching_table(ColourObserver observer) {
  return observer == ColourObserver::kCie1931 ? kTwoDegrees : kTenDegrees;
}

Tristimulus colour_matching(ColourObserver observer, double wavelength_nm) {
  if (!std::isfinite(wavelength_nm)) {
    throw std::invalid_argument("wavelength_nm is " + std::to_string(wavelength_nm) +
                                "; it must be finite");
  }
  const double row = wavelength_nm - kFirstObserverWavelength_nm;
  if (row < 0.0 || row > static_cast<double>(kObserverRows - 1)) return {0.0, 0.0, 0.0};
  const auto table = colour_matching_table(observer);
  const auto below = std::min(static_cast<std::size_t>(row), kObserverRows - 2);
  const double t = row - static_cast<double>(below);
  Tristimulus value;
  for (std::size_t c = 0; c < 3; ++c) {
    value[c] = (1.0 - t) * table[below][c] + t * table[below + 1][c];
  }
  return value;
}

ColourObserver colour_observer_from_name(std::string_view name) {
  if (name == "cie1931") return ColourObserver::kCie1931;
  if (name == "cie1964") return ColourObserver::kCie1964;
  throw std::invalid_argument("colour observer is \"" + std::string(name) +
                              "\"; it must be \"cie1931\" or \"cie1964\"");
}

}  // namespace twilight
