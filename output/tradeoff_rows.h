// What a ladder's outcome says: errors and costs of every rung, and which are worth having.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "output/sky_sample.h"
#include "output/tradeoff.h"

namespace twilight {

inline constexpr const char* kReferenceBaseline = "reference";

/// One rung under one Sun against one baseline.
struct TradeoffRow {
  const RungOutcome* rung = nullptr;
  std::string baseline;  ///< "reference", or the rung that differs by one approximation alone
  double sun_elevation_deg = 0.0;
  SunCost cost;
  SkyDifference difference;
  /// On the Pareto front of seconds and mean error among all rungs under this Sun (against the
  /// reference alone).
  bool front_radiance = false, front_luminance = false, front_ciede2000 = false;
};

/// Rows of every rung that was run, against the reference and then its own baseline. Refers to
/// `outcome`.
std::vector<TradeoffRow> tradeoff_rows(const TradeoffOutcome& outcome);

/// A rung over all its Suns, against the reference: means over the Suns of what a row has, largest
/// for memory.
struct TradeoffMean {
  const RungOutcome* rung = nullptr;
  SunCost cost;
  std::optional<Spread> radiance, luminance, ciede2000;  ///< none if one Sun has none
  bool front_radiance = false, front_luminance = false, front_ciede2000 = false;
};
std::vector<TradeoffMean> tradeoff_means(const std::vector<TradeoffRow>& rows);

/// A kind of error: how files call it, and where rows and means keep it.
struct ErrorMeasure {
  const char* name;   ///< in columns and files
  const char* title;  ///< in headings
  const char* axis;
  double factor;  ///< to the unit of tables and plots
  std::optional<Spread> SkyDifference::*of_row;
  std::optional<Spread> TradeoffMean::*of_mean;
  bool TradeoffRow::*row_front;
  bool TradeoffMean::*mean_front;
};
inline constexpr ErrorMeasure kRadianceError = {"radiance",
                                                "radiance",
                                                "mean |L/L_ref - 1| of spectral radiance, per cent",
                                                100,
                                                &SkyDifference::radiance,
                                                &TradeoffMean::radiance,
                                                &TradeoffRow::front_radiance,
                                                &TradeoffMean::front_radiance};
inline constexpr ErrorMeasure kLuminanceError = {"luminance",
                                                 "luminance",
                                                 "mean |L/L_ref - 1| of luminance, per cent",
                                                 100,
                                                 &SkyDifference::luminance,
                                                 &TradeoffMean::luminance,
                                                 &TradeoffRow::front_luminance,
                                                 &TradeoffMean::front_luminance};
inline constexpr ErrorMeasure kColourError = {"ciede2000",
                                              "CIEDE2000",
                                              "mean CIEDE2000",
                                              1,
                                              &SkyDifference::ciede2000,
                                              &TradeoffMean::ciede2000,
                                              &TradeoffRow::front_ciede2000,
                                              &TradeoffMean::front_ciede2000};
inline constexpr std::array<ErrorMeasure, 3> kErrorMeasures = {kRadianceError, kLuminanceError,
                                                               kColourError};

/// The sample under a Sun, or null where there is none.
const SunSample* sun_of(const RungRun& run, double sun_elevation_deg);

}  // namespace twilight
