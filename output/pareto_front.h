// Which of many compromises are worth having.
#pragma once

#include <cstddef>
#include <vector>

namespace twilight {

struct CostAndError {
  double cost = 0.0, error = 0.0;
};

/// The Pareto front: indices, by increasing cost, of the points to which no other is at least as
/// good in both cost and error and better in one. Of equal points the first is taken. Points that
/// are not finite are never on it.
std::vector<std::size_t> pareto_front(const std::vector<CostAndError>& points);

}  // namespace twilight
