#include "output/tradeoff_rows.h"

#include <algorithm>
#include <limits>
#include <map>

#include "output/pareto_front.h"

namespace twilight {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

double mean_or_none(const std::optional<Spread>& spread) { return spread ? spread->mean : kNone; }

void mark_fronts(std::vector<TradeoffRow>& rows) {
  std::map<double, std::vector<TradeoffRow*>> by_sun;
  for (TradeoffRow& row : rows) {
    if (row.baseline == kReferenceBaseline) by_sun[row.sun_elevation_deg].push_back(&row);
  }
  for (auto& [sun, here] : by_sun) {
    for (const ErrorMeasure& m : kErrorMeasures) {
      std::vector<CostAndError> points;
      for (const TradeoffRow* row : here) {
        points.push_back({row->cost.seconds, mean_or_none(row->difference.*m.of_row)});
      }
      for (const std::size_t i : pareto_front(points)) here[i]->*m.row_front = true;
    }
  }
}

void mark_fronts(std::vector<TradeoffMean>& means) {
  for (const ErrorMeasure& m : kErrorMeasures) {
    std::vector<CostAndError> points;
    for (const TradeoffMean& mean : means) {
      points.push_back({mean.cost.seconds, mean_or_none(mean.*m.of_mean)});
    }
    for (const std::size_t i : pareto_front(points)) means[i].*m.mean_front = true;
  }
}

}  // namespace

const SunSample* sun_of(const RungRun& run, double sun_elevation_deg) {
  const auto found =
      std::ranges::find(run.sample.suns, sun_elevation_deg, &SunSample::sun_elevation_deg);
  return found == run.sample.suns.end() ? nullptr : &*found;
}

std::vector<TradeoffRow> tradeoff_rows(const TradeoffOutcome& outcome) {
  std::map<std::string, const RungRun*> by_name;
  for (const RungOutcome& rung : outcome.rungs) {
    if (rung.run) by_name[rung.planned.rung.name] = &*rung.run;
  }
  std::vector<TradeoffRow> rows;
  const auto add = [&](const RungOutcome& rung, const std::string& name, const RungRun& baseline) {
    for (std::size_t k = 0; k < rung.run->sample.suns.size(); ++k) {
      const SunSample& sun = rung.run->sample.suns[k];
      const SunSample* there = sun_of(baseline, sun.sun_elevation_deg);
      if (there == nullptr) continue;
      rows.push_back({&rung, name, sun.sun_elevation_deg, rung.run->cost[k],
                      sky_difference(sun, rung.run->sample.wavelength_nm, *there,
                                     baseline.sample.wavelength_nm)});
    }
  };
  for (const RungOutcome& rung : outcome.rungs) {
    if (!rung.run) continue;
    add(rung, kReferenceBaseline, outcome.reference);
    const auto baseline = by_name.find(rung.planned.rung.baseline);
    if (baseline != by_name.end()) add(rung, baseline->first, *baseline->second);
  }
  mark_fronts(rows);
  return rows;
}

std::vector<TradeoffMean> tradeoff_means(const std::vector<TradeoffRow>& rows) {
  std::vector<const RungOutcome*> order;
  std::map<const RungOutcome*, std::vector<const TradeoffRow*>> by_rung;
  for (const TradeoffRow& row : rows) {
    if (row.baseline != kReferenceBaseline) continue;
    if (!by_rung.contains(row.rung)) order.push_back(row.rung);
    by_rung[row.rung].push_back(&row);
  }
  std::vector<TradeoffMean> means;
  for (const RungOutcome* rung : order) {
    const auto& here = by_rung[rung];
    const double share = 1.0 / static_cast<double>(here.size());
    TradeoffMean mean;
    mean.rung = rung;
    for (const TradeoffRow* row : here) {
      mean.cost.seconds += share * row->cost.seconds;
      mean.cost.most_seconds += share * row->cost.most_seconds;
      mean.cost.cpu_seconds += share * row->cost.cpu_seconds;
      mean.cost.peak_mib = std::max(mean.cost.peak_mib, row->cost.peak_mib);
    }
    for (const ErrorMeasure& m : kErrorMeasures) {
      const auto missing = [&](const TradeoffRow* row) { return !(row->difference.*m.of_row); };
      if (std::ranges::any_of(here, missing)) continue;
      Spread sum;
      for (const TradeoffRow* row : here) {
        const Spread& s = *(row->difference.*m.of_row);
        sum.mean += share * s.mean;
        sum.p95 += share * s.p95;
        sum.largest += share * s.largest;
      }
      mean.*m.of_mean = sum;
    }
    means.push_back(mean);
  }
  mark_fronts(means);
  return means;
}

}  // namespace twilight
