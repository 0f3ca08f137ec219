// The quick part of the table as tests; the whole of it is validation_table's.
#include "tests/validation/validation.h"

#include <gtest/gtest.h>

#include <string>

namespace twilight::validation {
namespace {

void expect_all_hold(const std::string& name) {
  Settings settings;
  settings.quick = true;
  settings.monte_carlo_seconds = 5;
  bool found = false;
  for (const Section& section : sections()) {
    if (section.name != name) continue;
    found = true;
    for (const Check& check : section.run(settings)) {
      std::printf("%s", markdown_row(check).c_str());
      EXPECT_TRUE(check.holds) << check.name << ": " << check.measured << ", bar " << check.bar;
    }
  }
  EXPECT_TRUE(found) << name;
}

TEST(Validation, OpenCasesByOrders) { expect_all_hold("open-cases-orders"); }
TEST(Validation, OpenCasesOrderByOrder) { expect_all_hold("open-cases-shares"); }
TEST(Validation, OpenCasesByMonteCarlo) { expect_all_hold("open-cases-mc"); }
TEST(Validation, LibRadtranSpherical) { expect_all_hold("libradtran"); }
TEST(Validation, NatrajPlaneParallel) { expect_all_hold("natraj"); }
TEST(Validation, KokhanovskyPlaneParallel) { expect_all_hold("kokhanovsky"); }
TEST(Validation, OrdersAgainstMonteCarlo) { expect_all_hold("orders-mc-grid-average-0.8"); }
TEST(Validation, ZenithOfParanal) { expect_all_hold("paranal"); }
TEST(Validation, AirMassOfKastenAndYoung) { expect_all_hold("air-mass"); }
TEST(Validation, RefractionOfHohenkerkAndSinclair) { expect_all_hold("refraction"); }

}  // namespace
}  // namespace twilight::validation
