#include "sim/sun_bending.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <type_traits>

#include "atmosphere/refraction.h"

namespace twilight {
namespace {

// Relative error of the layers' refractivities between three wavelengths' that bending can bear.
constexpr double kSameRefractivity = 5e-6;
// Least refractivity of the wavelengths over the greatest: 0.91 for air from 280 to 1000 nm.
constexpr double kLeastRefractivity = 0.85;
// d ln(n r) / d ln r of every shell (0.8 in the Earth's air, 0 where rays are ducted) from which on
// bending is smooth enough in the refractivity.
constexpr double kLeastExponent = 0.5;

// Value and slope at x of the polynomial through six nodes about x (nodes ascending).
struct Sextic {
  double value, slope;
};
Sextic interpolate(const std::vector<double>& nodes, const std::vector<double>& values, double x) {
  constexpr std::size_t kPoints = 6;
  const auto above =
      static_cast<std::size_t>(std::upper_bound(nodes.begin(), nodes.end(), x) - nodes.begin());
  const std::size_t first = std::min(above > 3 ? above - 3 : 0, nodes.size() - kPoints);
  // Neville's scheme, with derivatives.
  double p[kPoints], d[kPoints] = {};
  for (std::size_t i = 0; i < kPoints; ++i) p[i] = values[first + i];
  for (std::size_t order = 1; order < kPoints; ++order) {
    for (std::size_t i = 0; i + order < kPoints; ++i) {
      const double lo = nodes[first + i], hi = nodes[first + i + order];
      const double inverse = 1 / (hi - lo);
      d[i] = ((hi - x) * d[i] + (x - lo) * d[i + 1] + p[i + 1] - p[i]) * inverse;
      p[i] = ((hi - x) * p[i] + (x - lo) * p[i + 1]) * inverse;
    }
  }
  return {p[0], d[0]};
}

bool bends_gently(const Medium& medium, std::size_t wavelength) {
  const RefractedRays rays(medium, wavelength);
  return std::ranges::all_of(
      rays.shells(), [](const RefractedRays::Shell& s) { return s.exponent >= kLeastExponent; });
}

// Wavelengths between three others: the quadratic in the lowest layer's refractivity.
struct TracedColours {
  std::array<std::size_t, 3> traced;
  std::vector<std::array<double, 3>> share;  // of the traced ones, [wavelength]
};

// Nothing where every wavelength is to be traced.
std::optional<TracedColours> traced_colours(const Medium& medium) {
  const std::size_t W = medium.wavelengths();
  if (W <= 3) return std::nullopt;
  std::vector<double> refractivity(W);
  for (std::size_t w = 0; w < W; ++w) refractivity[w] = medium.refractivity(0, w);
  const auto [least, most] = std::ranges::minmax_element(refractivity);
  const auto nearest = std::ranges::min_element(
      refractivity, {}, [&](double value) { return std::abs(value - 0.5 * (*least + *most)); });
  const auto place = [&](auto at) { return static_cast<std::size_t>(at - refractivity.begin()); };
  if (!(*least >= kLeastRefractivity * *most)) return std::nullopt;
  if (*nearest == *least || *nearest == *most || !bends_gently(medium, place(most))) {
    return std::nullopt;
  }
  TracedColours colours{{place(least), place(nearest), place(most)}, {}};
  colours.share.resize(W);
  for (std::size_t w = 0; w < W; ++w) {
    for (std::size_t q = 0; q < 3; ++q) {
      double& share = colours.share[w][q] = 1;
      for (std::size_t p = 0; p < 3; ++p) {
        const double other = refractivity[colours.traced[p]];
        if (p != q) share *= (refractivity[w] - other) / (refractivity[colours.traced[q]] - other);
      }
    }
    for (std::size_t i = 0; i < medium.layers(); ++i) {
      double between = 0;
      for (std::size_t q = 0; q < 3; ++q) {
        between += colours.share[w][q] * medium.refractivity(i, colours.traced[q]);
      }
      const double here = medium.refractivity(i, w);
      if (!(std::abs(between - here) <= kSameRefractivity * here)) return std::nullopt;
    }
  }
  return colours;
}

BendingTable between(const std::array<const BendingTable*, 3>& known,
                     const std::array<double, 3>& share) {
  BendingTable table{known[0]->rows, known[0]->columns, {}, {}, {}};
  const auto mix = [&](auto member) {
    using Numbers = std::remove_cvref_t<decltype(known[0]->*member)>;
    Numbers& out = table.*member;
    out.resize((known[0]->*member).size());
    for (std::size_t k = 0; k < out.size(); ++k) {
      double sum = 0;
      for (std::size_t q = 0; q < 3; ++q) {
        sum += share[q] * static_cast<double>((known[q]->*member)[k]);
      }
      out[k] = static_cast<typename Numbers::value_type>(sum);
    }
  };
  mix(&BendingTable::horizon_rad);
  mix(&BendingTable::bending_rad);
  mix(&BendingTable::derivative);
  for (float& d : table.derivative) {
    d = std::clamp(d, static_cast<float>(BendingTable::kLeastDerivative),
                   static_cast<float>(BendingTable::kMostDerivative));
  }
  return table;
}

}  // namespace

BendingTable traced_bending(const Medium& medium, std::size_t wavelength, int rows, int columns) {
  if (rows < 4 || columns < 8) {
    throw std::invalid_argument("bending of sunlight: rows must be at least 4, columns 8");
  }
  const RefractedRays rays(medium, wavelength);
  BendingTable table;
  table.rows = static_cast<std::size_t>(rows);
  table.columns = static_cast<std::size_t>(columns);
  table.horizon_rad.assign(table.rows, 0.0);
  if (rays.refracting()) {
    table.bending_rad.assign(table.rows * table.columns, 0.0F);
    table.derivative.assign(table.rows * table.columns, 1.0F);
  }
  tbb::parallel_for(std::size_t{0}, table.rows, [&](std::size_t i) {
    const double v = static_cast<double>(i) / static_cast<double>(table.rows - 1);
    const double altitude = medium.top_km() * v * v;
    const double limit = rays.horizon_apparent_zenith_rad(altitude);
    if (!rays.refracting()) {
      table.horizon_rad[i] = limit;
      return;
    }
    std::vector<double> truth, bent;
    for (int k = 0; k <= columns; ++k) {
      const double y = 1 - static_cast<double>(k) / columns;
      // A hair inside the horizon, so that rounding does not send the ray underground.
      const double zenith = limit * (1 - y * y) - (k == columns ? 1e-10 : 0.0);
      const RayTrace trace = rays.trace_outward(altitude, zenith, {});
      // Where the index grows with height several rays may reach the Sun: keep the first.
      if (!truth.empty() && !(trace.true_zenith_rad > truth.back() + 1e-12)) continue;
      truth.push_back(trace.true_zenith_rad);
      bent.push_back(trace.deflection_rad);
    }
    table.horizon_rad[i] = truth.back();
    for (std::size_t k = 0; k < table.columns; ++k) {
      const double x = static_cast<double>(k) / static_cast<double>(table.columns - 1);
      const double chi = truth.back() * (1 - x * x);
      const Sextic p = interpolate(truth, bent, chi);
      table.bending_rad[i * table.columns + k] = static_cast<float>(p.value);
      table.derivative[i * table.columns + k] = static_cast<float>(
          std::clamp(1 - p.slope, BendingTable::kLeastDerivative, BendingTable::kMostDerivative));
    }
  });
  return table;
}

std::vector<BendingTable> bending_tables(const Medium& medium, int rows, int columns) {
  const std::size_t W = medium.wavelengths();
  std::vector<BendingTable> tables(W);
  const std::optional<TracedColours> colours = traced_colours(medium);
  if (!colours) {
    tbb::parallel_for(std::size_t{0}, W,
                      [&](std::size_t w) { tables[w] = traced_bending(medium, w, rows, columns); });
    return tables;
  }
  const auto& traced = colours->traced;
  tbb::parallel_for(std::size_t{0}, traced.size(), [&](std::size_t q) {
    tables[traced[q]] = traced_bending(medium, traced[q], rows, columns);
  });
  const std::array<const BendingTable*, 3> known{&tables[traced[0]], &tables[traced[1]],
                                                 &tables[traced[2]]};
  tbb::parallel_for(std::size_t{0}, W, [&](std::size_t w) {
    if (std::ranges::find(traced, w) == traced.end()) tables[w] = between(known, colours->share[w]);
  });
  return tables;
}

}  // namespace twilight
