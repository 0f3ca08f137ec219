#include "sim/ring_point.h"

#include <algorithm>
#include <cmath>

namespace twilight {

double near_field_factor(double across_over_d2, double along_over_d2) {
  return 1 + across_over_d2 / (1 + 0.5 * std::sqrt(across_over_d2)) -
         std::min(3 * along_over_d2, 0.6);
}

}  // namespace twilight
